"""What a law would draw beside its theorem, as plain data: the page and the recording show it.

A law may have an attribute `charts`, a tuple of portraits, maps, histories and spheres; those who
draw know no law.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, NamedTuple, Protocol

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


class Measured(NamedTuple):
    """What a part of a flight adds to a history.

    Attributes:
        rows: Numbers of the rows that have values, ascending, shape (n,).
        values: One column a curve, shape (n, k).
        memory: What to hand over with the next part.
    """

    rows: Array
    values: Array
    memory: Any


class Measure(Protocol):
    """Computes the curves of a history from a flight, part after part, each row seen once."""

    def __call__(self, part: Trajectory, wanted: Array, memory: Any) -> Measured:
        """Returns values for those of the wanted rows that can have some.

        Args:
            part: The next rows of the flight.
            wanted: Whether a row is wanted, shape (n,).
            memory: What the part before left; None at the start of a flight.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """A curve of a history.

    Attributes:
        name: Its name in the key.
        hue: Number of its colour, which it may share; None for what the history is about.
        beneath: Whether it is drawn wide, for another of its colour to lie upon it.
    """

    name: str
    hue: int | None = None
    beneath: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class History:
    """Quantities over time that a flight does not hold as signals.

    Attributes:
        name: One word, for files and paths.
        title: What it shows.
        unit: Its unit; empty for a pure number.
        curves: Its curves.
        signals: Names of the signals that it is computed from.
        measure: Computes the curves.
        decades: How many powers of ten below the first value a logarithmic axis reaches down to;
            None where the axis is linear.
    """

    name: str
    title: str
    unit: str
    curves: tuple[Curve, ...]
    signals: tuple[str, ...]
    measure: Measure
    decades: int | None = None

    @property
    def heads(self) -> list[int]:
        """Numbers of the curves that the history is about."""
        return [k for k, curve in enumerate(self.curves) if curve.hue is None]


@dataclass(frozen=True, slots=True, kw_only=True)
class Arrow:
    """A unit vector that moves on a sphere.

    Attributes:
        name: Its name.
        signals: Names of the signals of its components.
        target: Where it is to point, a unit vector; opposite to it is a second equilibrium.
        basin: Outline of where it stays if its flight is certified, shape (n, 3); None if that is
            all of the sphere or nothing is certified.
    """

    name: str
    signals: tuple[str, str, str]
    target: tuple[float, float, float]
    basin: Array | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Sphere:
    """Unit vectors on the unit sphere of the frame in which they are measured.

    Attributes:
        name: One word, for files and paths.
        title: What it shows.
        frame: The frame, in words.
        arrows: The vectors.
        bound: What the outlines of the basins say, in words; empty if there are none.
    """

    name: str
    title: str
    frame: str
    arrows: tuple[Arrow, ...]
    bound: str = ""


Chart = Portrait | Map | History | Sphere
Charts = tuple[Chart, ...]


def charts_of(law: Any) -> Charts:
    """Returns the charts of a law; none if it has none.

    Args:
        law: A controller.
    """
    return tuple(getattr(law, "charts", ()))


def counted(portrait: Portrait, lengths: Array) -> str:
    """Returns in words how many pulses a channel gave, and the shortest.

    Args:
        portrait: The chart.
        lengths: Lengths of the pulses, shape (n,), s.
    """
    shortest = f", the shortest {lengths.min():.6g} s" if len(lengths) else ""
    return f"{len(lengths)} pulses of {portrait.channel}{shortest}"


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


def portraits(charts: Sequence[Chart]) -> list[Portrait]:
    """Returns the portraits among some charts.

    Args:
        charts: The charts.
    """
    return [chart for chart in charts if isinstance(chart, Portrait)]


def histories(charts: Sequence[Chart], flight: Trajectory) -> list[History]:
    """Returns the histories among some charts that can be computed from a flight.

    Args:
        charts: The charts.
        flight: The flight.
    """
    found = [chart for chart in charts if isinstance(chart, History)]
    return [chart for chart in found if all(name in flight.signals for name in chart.signals)]


def spheres(charts: Sequence[Chart], flight: Trajectory) -> list[Sphere]:
    """Returns the spheres among some charts whose vectors a flight has.

    Args:
        charts: The charts.
        flight: The flight.
    """
    found = [chart for chart in charts if isinstance(chart, Sphere)]
    return [c for c in found if all(n in flight.signals for a in c.arrows for n in a.signals)]


def vectors(charts: Sequence[Chart], flight: Trajectory) -> tuple[str, ...]:
    """Returns the names of the fixed directions that are shown: those on spheres, or two of three.

    Args:
        charts: The charts.
        flight: The flight.
    """
    found = tuple(a.name for chart in spheres(charts, flight) for a in chart.arrows)
    return found or ("s2", "s3")


def path_of(arrow: Arrow, flight: Trajectory) -> Array:
    """Returns where the tip of an arrow is at each row of a flight, shape (n, 3).

    Args:
        arrow: The arrow.
        flight: The flight.
    """
    return np.stack([flight[name] for name in arrow.signals], axis=1)


def series(history: History, flight: Trajectory, most: int) -> tuple[Array, Array]:
    """Returns times and values of a history over a whole flight.

    Args:
        history: The history.
        flight: The flight.
        most: How many rows at most, about; they lie evenly.

    Returns:
        Times, shape (n,), s, and values, shape (n, k).
    """
    wanted = np.zeros(len(flight.time), dtype=bool)
    wanted[np.unique(np.linspace(0, len(wanted) - 1, most).astype(int))] = True
    found = history.measure(flight, wanted, None)
    return flight.time[found.rows], found.values


def floor(history: History, first: Array) -> float:
    """Returns the value below which a logarithmic axis shows nothing.

    Args:
        history: A history with a logarithmic axis.
        first: Its first values, shape (k,).
    """
    largest = float(np.max(np.abs(first), initial=0.0)) or 1.0
    return largest * 10.0 ** -(history.decades or 0)
