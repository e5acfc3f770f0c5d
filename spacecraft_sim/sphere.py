"""The unit sphere as a picture: whence it is seen, its net, and the parts of a path at the back."""

import numpy as np

from spacecraft_sim.chart import Sphere
from spacecraft_sim.sketch import View

Array = np.ndarray

ROUND = 73  # points of a circle
_ASIDE = np.array([0.35, -0.6, 0.45])  # off the targets, so that they are not seen end on


def eye(chart: Sphere) -> Array:
    """Returns the unit vector towards the eye, such that all targets are in front, shape (3,).

    Args:
        chart: The sphere.
    """
    targets = np.array([arrow.target for arrow in chart.arrows])
    middle = targets.sum(axis=0) / np.linalg.norm(targets.sum(axis=0))
    aside = _ASIDE - (_ASIDE @ middle) * middle
    way = middle + 0.5 * aside / np.linalg.norm(aside)
    return way / np.linalg.norm(way)


def view(chart: Sphere) -> View:
    """Returns the parallel projection of a sphere, z up.

    Args:
        chart: The sphere.
    """
    near = eye(chart)
    pole = np.eye(3)[2 if abs(near[2]) < 0.9 else 1]
    up = pole - (pole @ near) * near
    up /= np.linalg.norm(up)
    return View(words="", right=np.cross(up, near), up=up, near=near)


def net() -> list[Array]:
    """Returns the three great circles in the planes of the axes, each of shape (n, 3)."""
    angle = np.linspace(0, 2 * np.pi, ROUND)
    circle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    return [np.roll(circle, k, axis=1) for k in range(3)]


def sides(points: Array, near: Array) -> tuple[Array, Array]:
    """Returns a path twice, with NaN where it is at the back, and where it is in front.

    Args:
        points: Points of the path, shape (n, 3).
        near: Unit vector towards the eye, shape (3,).
    """
    front = points @ near >= 0
    # A point of each side joins on to the other, so that no gap is left between them.
    both = np.zeros(len(front), dtype=bool)
    both[1:] = front[1:] != front[:-1]
    before = np.where((front | both)[:, None], points, np.nan)
    behind = np.where((~front | both)[:, None], points, np.nan)
    return before, behind
