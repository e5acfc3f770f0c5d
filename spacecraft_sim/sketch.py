"""A spacecraft as a line drawing: where it is seen from, outlines of its shapes, bending booms.

Needs neither OpenGL nor a display; the pictures and the report draw from this.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spacecraft_sim.drawing import Drawing, Jet, Shape, boom_points, turned

Array = np.ndarray

_FLAT = 1e-3  # share of a turn or of the length out of the plane that does not show
_RING = np.linspace(0, 2 * np.pi, 24, endpoint=False)
_CORNERS = np.array(list(np.ndindex(2, 2, 2))) * 2.0 - 1
# Corners of the six faces of a box, anticlockwise from outside.
BOX_FACES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """A parallel projection.

    Attributes:
        words: Where it is seen from.
        right: Unit vector that points right in the picture, shape (3,).
        up: Unit vector that points up, shape (3,).
        near: Unit vector towards the eye, shape (3,).
    """

    words: str
    right: Array
    up: Array
    near: Array

    def project(self, points: Array) -> Array:
        """Returns places in the picture, shape (..., 2), in the unit of the points.

        Args:
            points: Shape (..., 3).
        """
        return points @ np.stack([self.right, self.up], axis=1)


_S2, _S3, _S6 = np.sqrt([2.0, 3.0, 6.0])
TOP = View(words="seen from +z", right=np.eye(3)[0], up=np.eye(3)[1], near=np.eye(3)[2])
ISOMETRIC = View(
    words="isometric, seen from (1, -1, 1)",
    right=np.array([1.0, 1.0, 0.0]) / _S2,
    up=np.array([-1.0, 1.0, 2.0]) / _S6,
    near=np.array([1.0, -1.0, 1.0]) / _S3,
)


def view_of(drawing: Drawing) -> View:
    """Returns the view from above if all bodies turn about z at one height, else the isometric one.

    Args:
        drawing: Shapes and motion.
    """
    centre = next(iter(drawing.positions.values()))
    offsets = [position - centre for position in drawing.positions.values()]
    size = max(float(np.abs(offset).max()) for offset in offsets) or 1.0
    tilted = any(np.abs(q[:, 1:3]).max() > _FLAT for q in drawing.quaternions.values())
    lifted = any(np.ptp(offset[:, 2]) > _FLAT * size for offset in offsets)
    return ISOMETRIC if tilted or lifted else TOP


def surface(shape: Shape) -> Array:
    """Returns points whose hull is the shape, in the frame of its body, shape (n, 3), m.

    Args:
        shape: The shape; the points of a box are its corners, in the order of `BOX_FACES`.
    """
    if shape.kind == "box":
        points = shape.size * _CORNERS
    else:
        ring = np.stack([np.cos(_RING), np.sin(_RING), 0 * _RING], axis=1)
        ball = np.vstack([np.roll(ring, k, axis=1) for k in range(3)])
        if shape.kind == "ellipsoid":
            points = shape.size * ball
        else:
            radius, length = shape.size[0], 0.0 if shape.kind == "sphere" else shape.size[1]
            end = radius * (ring if shape.kind == "cylinder" else ball)
            points = np.vstack([end + np.array([0, 0, z]) for z in (-length, length)])
    return shape.position + turned(shape.quaternion, points)


def outline(points: Array) -> Array:
    """Returns indices of the points furthest out, looked for all the way round, every 2 degrees.

    Args:
        points: Places in a picture, shape (n, 2).
    """
    angle = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    furthest = np.argmax(points @ np.stack([np.cos(angle), np.sin(angle)]), axis=0)
    return furthest[np.r_[True, np.diff(furthest) != 0]]


def solid_shapes(drawing: Drawing) -> list[Shape]:
    """Returns the shapes that are seen and belong to no boom.

    Args:
        drawing: Shapes and motion.
    """
    flexible = {body for bodies in drawing.booms.values() for body in bodies}
    return [s for s in drawing.shapes if s.body not in flexible and s.rgba[3] > 0]


def boom_lines(drawing: Drawing) -> dict[str, tuple[Array, Array]]:
    """Returns each boom, bent and unbent, about the first body, shapes (n frames, n points, 3), m.

    Args:
        drawing: Shapes and motion.
    """
    centre = next(iter(drawing.positions.values()))[:, None]
    lines = {boom: boom_points(drawing, boom) for boom in drawing.booms}
    return {boom: (bent - centre, straight - centre) for boom, (bent, straight) in lines.items()}


def exhausts(jet: Jet, shapes: Sequence[Shape], level: float) -> list[tuple[Array, Array]]:
    """Returns where exhaust leaves a body and the unit vector along which it blows, in its frame.

    A jet inside a hull blows from where its line of action comes out: the force is the same. A pure
    torque is drawn as a pair, as far out as the hull reaches.

    Args:
        jet: The jet.
        shapes: Shapes of the machine.
        level: The thrust; its sign counts.
    """
    hulls = [shape for shape in shapes if shape.body == jet.body and shape.kind == "box"]
    if np.any(jet.force):
        pairs = [(jet.position, jet.force / np.linalg.norm(jet.force))]
    else:
        axis = jet.torque / np.linalg.norm(jet.torque)
        reach = max((float(np.abs(surface(hull)).max()) for hull in hulls), default=1.0)
        arm = reach * np.eye(3)[0 if abs(axis[0]) < 0.9 else 1]
        force = np.cross(axis, arm) / np.linalg.norm(np.cross(axis, arm))
        pairs = [(jet.position + arm, force), (jet.position - arm, -force)]
    found = []
    for point, force in pairs:
        away = -np.sign(level) * force
        found.append(
            (point + max((_exit(h, point, away) for h in hulls), default=0.0) * away, away)
        )
    return found


def _exit(hull: Shape, point: Array, way: Array) -> float:
    """How far it is from a point inside a box to its surface; zero from a point outside."""
    back = hull.quaternion * (1, -1, -1, -1)
    p, d = turned(back, point - hull.position), turned(back, way)
    if np.any(np.abs(p) > hull.size):
        return 0.0
    run = np.abs(d) > 1e-9
    return float(((np.sign(d) * hull.size - p)[run] / d[run]).min())
