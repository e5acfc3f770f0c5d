"""What a law would draw beside its theorem, as plain data: the page and the recording show it.

A law may have an attribute `charts`, a tuple of portraits and maps; those who draw know no law.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

import numpy as np

from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray
Look = Literal["bound", "switching", "aid"]  # what is guaranteed, where the law acts, what explains


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A line of a chart.

    Attributes:
        name: Its name in the key.
        points: Its points, shape (n, 2), SI; NaN breaks it.
        look: What it stands for.
    """

    name: str
    points: Array
    look: Look = "aid"


@dataclass(frozen=True, slots=True, kw_only=True)
class Region:
    """A shaded part of a chart.

    Attributes:
        name: Its name in the key.
        outline: Its corners, shape (n, 2), SI.
    """

    name: str
    outline: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Portrait:
    """A phase plane on which a flight is drawn.

    Attributes:
        name: One word, for files and paths.
        title: What it shows.
        signals: Names of the signals along x and y.
        channel: Name of the thruster whose pulses are shown beside it.
        min_on_time: What no pulse may be shorter than, s; 0 if there is no such limit.
        band: Half-width that the x signal is to keep; None if nothing is promised.
        lines: Lines, in the units of the signals.
        regions: Regions, likewise.
    """

    name: str
    title: str
    signals: tuple[str, str]
    channel: str
    min_on_time: float = 0.0
    band: float | None = None
    lines: tuple[Line, ...] = ()
    regions: tuple[Region, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Map:
    """A plane of parameters with the point at which a law works.

    Attributes:
        name: One word, for files and paths.
        title: What it shows.
        labels: Of the x and the y axis, with units.
        point: Where the law works.
        lines: Borders and level lines.
        regions: Regions.
    """

    name: str
    title: str
    labels: tuple[str, str]
    point: tuple[float, float]
    lines: tuple[Line, ...] = ()
    regions: tuple[Region, ...] = ()


Charts = tuple[Portrait | Map, ...]


def charts_of(law: Any) -> Charts:
    """Returns the charts of a law; none if it has none.

    Args:
        law: A controller.
    """
    return tuple(getattr(law, "charts", ()))


def pulses(time: Array, thrust: Array) -> tuple[Array, Array]:
    """Returns start and length of each completed pulse of one sign, each of shape (n,), s.

    Args:
        time: Times of the rows, shape (n,), s.
        thrust: Thrust just after each, shape (n,).
    """
    sign = np.sign(thrust)
    change = np.flatnonzero(np.diff(sign)) + 1
    starts = [(k, m) for k, m in pairwise(change) if sign[k]]
    begin = np.array([time[k] for k, _ in starts])
    return begin, np.array([time[m] for _, m in starts]) - begin


def worst_to_come(value: Array) -> Array:
    """Returns the largest |value| from each row to the end, whose limit is limsup |value|.

    Args:
        value: Samples, shape (n,).
    """
    return np.maximum.accumulate(np.abs(value)[::-1])[::-1]


def half_width(portrait: Portrait, k: int) -> float:
    """Returns half the window of a portrait: a little more than its bounds, which so fill it.

    Args:
        portrait: The portrait.
        k: 0 for the x axis, 1 for the y axis.

    Returns:
        The half width in the unit of the signal; 0 if the portrait has no bound.
    """
    shown = [line.points[:, k] for line in portrait.lines if line.look == "bound"]
    return 1.45 * max((float(np.nanmax(np.abs(points))) for points in shown), default=0.0)


def locked(measured: Trajectory, portrait: Portrait) -> Array:
    """Returns whether the pulse that is on at a row is still younger than the minimum on-time.

    Args:
        measured: The flight.
        portrait: For the channel and its minimum on-time.
    """
    sign = np.sign(measured[portrait.channel])
    began = np.r_[True, np.diff(sign) != 0]
    start = np.maximum.accumulate(np.where(began, np.arange(len(sign)), 0))
    age = measured.time - measured.time[start]
    return (sign != 0) & (age < portrait.min_on_time * (1 - 1e-9))


def portraits(charts: Sequence[Portrait | Map]) -> list[Portrait]:
    """Returns the portraits among some charts.

    Args:
        charts: The charts.
    """
    return [chart for chart in charts if isinstance(chart, Portrait)]
