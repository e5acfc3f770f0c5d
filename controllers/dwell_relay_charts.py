"""Figures of a two-level relay with a dwell: contour and arcs in the phase plane, map of (F, e)."""

import math

import numpy as np

from spacecraft_sim.chart import Charts, Line, Map, Portrait, Region
from spacecraft_sim.dwell_accuracy import guaranteed_accuracy
from spacecraft_sim.dwell_axes import Band
from spacecraft_sim.dwell_contour import Half

Array = np.ndarray

_POINTS = 61  # of a line
_LEVELS = (0.2, 0.5, 1.0, 2.0)  # of p0


def charts(band: Band, *, name: str, signals: tuple[str, str], channel: str) -> Charts:
    """Returns phase portrait and map of an axis.

    Args:
        band: The axis with its contour.
        name: x, y or z.
        signals: Names of angle and rate that are fed back.
        channel: Name of the thruster.
    """
    return (_portrait(band, name, signals, channel), _map(band, name))


def _portrait(band: Band, name: str, signals: tuple[str, str], channel: str) -> Portrait:
    contour, units = band.contour, (band.axis.length, band.axis.speed)
    upper, lower = contour.upper, contour.lower
    outline = np.vstack([_half(upper, lower), -_half(lower, upper)])
    return Portrait(
        name=f"dwell_relay_{name}",
        title=f"Contour that is not left about {name}, and the flight",
        signals=signals,
        channel=channel,
        min_on_time=band.axis.dwell,
        band=contour.accuracy * band.axis.length,
        lines=(
            Line(name="contour", points=np.vstack([outline, outline[:1]]) * units, look="bound"),
            Line(name="to -1 beyond", points=_arc(contour.half_width, upper) * units,
                 look="switching"),
            Line(name="to +1 beyond", points=-_arc(contour.half_width, lower) * units,
                 look="switching"),
        ),
    )  # fmt: skip


def _half(half: Half, other: Half) -> Array:
    """From the left end up with the fastest push, and down to the right end with the slowest."""
    push = 2 - half.brake  # 1 + F + e, with half.brake = 1 - F - e
    # Where -left + v^2/(2 push) meets end - v^2/(2 brake).
    top = math.sqrt(2 * (half.end + other.end) / (1 / push + 1 / half.brake))
    v = np.linspace(0, top, _POINTS)
    up = np.stack([-other.end + v**2 / (2 * push), v], axis=1)
    down = np.stack([half.end - v**2 / (2 * half.brake), v], axis=1)[::-1]
    return np.vstack([up, down])


def _arc(half_width: float, half: Half) -> Array:
    v = np.linspace(0, 1.3 * half.fastest, _POINTS)
    return np.stack([half_width - v**2 / (2 * half.brake), v], axis=1)


def _map(band: Band, name: str) -> Map:
    """The plane of (F, e) with lines of equal p0."""
    biases = np.linspace(0, 1, _POINTS)
    lines = []
    for level in _LEVELS:
        reached = [(F, e) for F in biases.tolist() if (e := _disturbance(F, level)) is not None]
        lines.append(Line(name=f"p0 = {level:g}", points=np.array(reached)))
    F, e = abs(band.axis.bias), band.axis.disturbance
    return Map(
        name=f"dwell_relay_accuracy_{name}",
        title=f"Guaranteed about {name}: p0 u0 dwell^2, here p0 = {guaranteed_accuracy(F, e):.4g}",
        labels=(
            "F, constant disturbance over the thrust",
            "e, moment of the elastic parts over it",
        ),
        point=(F, e),
        lines=tuple(lines),
        regions=(Region(name="F + e < 1: finite", outline=np.array([[0, 0], [1, 0], [0, 1]])),),
    )


def _disturbance(F: float, level: float) -> float | None:
    """The e at which p0 is as much; None if it is more without any."""
    if F >= 1 or guaranteed_accuracy(F, 0.0) > level:
        return None
    low, high = 0.0, 1 - F
    for _ in range(40):
        middle = (low + high) / 2
        low, high = (middle, high) if guaranteed_accuracy(F, middle) < level else (low, middle)
    return low
