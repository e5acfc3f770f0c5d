"""What a law draws of a flight in its recording: histories that it computes, vectors on spheres."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from spacecraft_sim import sphere
from spacecraft_sim.chart import Arrow, Curve, History, Sphere, floor, path_of
from spacecraft_sim.record_chart import NIGHT, strips
from spacecraft_sim.record_scene import TIMELINE, Color
from spacecraft_sim.record_signals import CURVES, GREY
from spacecraft_sim.record_stream import Stream, rr, rrb
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray

HEAD = ((240, 242, 247), (255, 170, 64))  # of what a history is about, above and beneath
GOAL, NET, GLOBE, BORDER = (98, 205, 132), (62, 67, 80), (30, 35, 48, 170), (98, 205, 132)
OPPOSITE = (200, 70, 60)
DISTANCE = 2.75  # of the eye from the middle of a sphere, in radii
RADIUS = 0.985  # of the globe, so that paths lie above it
ROWS, CLOSEST, FURTHEST = 1000, 0.02, 0.1  # rows of a flight, and the time between two, s
WIDE, THIN = 4.5, 1.6  # widths of curves, in points


@dataclass(frozen=True, slots=True, kw_only=True)
class Progress:
    """How far the histories of a flight have come.

    Attributes:
        memories: What each handed over, by its name.
        floors: Where its logarithmic axis ends, by its name.
        row: Signals and `time` in the last row that was shown; empty before the first.
    """

    memories: Mapping[str, Any] = field(default_factory=dict)
    floors: Mapping[str, float] = field(default_factory=dict)
    row: Mapping[str, float] = field(default_factory=dict)


def spacing(duration: float) -> float:
    """Returns the time between two rows that are shown of a flight, s.

    Args:
        duration: Its length, s.
    """
    return min(max(duration / ROWS, CLOSEST), FURTHEST)


def shown_rows(time: Array, every: float, before: Progress, end: float) -> Array:
    """Returns which rows of a part are shown, shape (n,): one at times, and that at the end.

    Args:
        time: Times of the rows, shape (n,), s.
        every: Time between two rows that are shown, s.
        before: What was shown before.
        end: End of the flight, s.
    """
    place = np.floor(time / every + 1e-6)
    last = np.floor(before.row["time"] / every + 1e-6) if before.row else -1.0
    return (np.diff(place, prepend=last) > 0) | (time == end)


def _last(part: Trajectory, wanted: Array, before: Progress) -> Mapping[str, float]:
    rows = np.flatnonzero(wanted)
    if not len(rows):
        return before.row
    row = {name: float(value[rows[-1]]) for name, value in part.signals.items()}
    return {"time": float(part.time[rows[-1]]), **row}


def styles(stream: Stream, drawn: Sequence[History], key: str, name: str, beneath: bool) -> None:
    """Logs how the histories of a flight look.

    Args:
        stream: The recording.
        drawn: The histories.
        key: Name of the flight in paths.
        name: Name of the flight in keys.
        beneath: Whether it is drawn beneath the other, its head curves alone.
    """
    for history in drawn:
        shown = _shown(history, beneath)
        for logarithmic in (False, True) if history.decades else (False,):
            unit = f"log10 {history.unit}" if logarithmic else history.unit
            look = rr.SeriesLines(
                names=[f"{_named(c, name)} [{unit or '-'}]" for c in shown],
                colors=[_color(c, beneath) for c in shown],
                widths=[_width(c, beneath) for c in shown],
                aggregation_policy="MinMax",
            )
            stream.log(f"{history_path(history, logarithmic)}/{key}", look, static=True)


def histories(
    stream: Stream,
    drawn: Sequence[History],
    part: Trajectory,
    wanted: Array,
    key: str,
    beneath: bool,
    before: Progress,
) -> Progress:
    """Logs a part of a flight in the histories.

    Args:
        stream: The recording.
        drawn: The histories.
        part: All rows of the part.
        wanted: Whether a row is to be shown, shape (n,).
        key: Name of the flight in paths.
        beneath: Whether it is drawn beneath the other, its head curves alone.
        before: How far the histories had come.

    Returns:
        How far they are now.
    """
    memories, floors = dict(before.memories), dict(before.floors)
    row = _last(part, wanted, before)
    for history in drawn:
        if beneath and not history.heads:
            continue
        rows, values, memories[history.name] = history.measure(
            part, wanted, memories.get(history.name)
        )
        if not len(rows):
            continue
        times = [rr.TimeColumn(TIMELINE, duration=part.time[rows])]
        low = floors.setdefault(history.name, floor(history, values[0]))
        shown = values[:, history.heads] if beneath else values
        counts = np.full(len(rows), shown.shape[1])
        scalars = rr.Scalars.columns(scalars=shown.ravel()).partition(counts)
        stream.send_columns(f"{history_path(history)}/{key}", times, scalars)
        if history.decades:
            powers = np.log10(np.where(shown >= low, shown, np.nan)).astype(np.float32)
            scalars = rr.Scalars.columns(scalars=powers.ravel()).partition(counts)
            stream.send_columns(f"{history_path(history, power=True)}/{key}", times, scalars)
    return Progress(memories=memories, floors=floors, row=row)


def history_path(history: History, power: bool = False) -> str:
    """Returns the path of a history, beneath which each flight has its own.

    Args:
        history: The history.
        power: Whether of the logarithms of its values.
    """
    return f"law/{history.name}{'_log10' if power else ''}"


def globes(stream: Stream, drawn: Sequence[Sphere]) -> None:
    """Logs what stands still on the spheres: globe, axes, targets, their opposites, basins.

    Args:
        stream: The recording.
        drawn: The spheres.
    """
    for chart in drawn:
        path = f"sphere/{chart.name}"
        stream.log(path, rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
        ball = rr.Ellipsoids3D(half_sizes=[[RADIUS] * 3], colors=GLOBE, fill_mode="solid")
        stream.log(f"{path}/globe", ball, static=True)
        circles = rr.LineStrips3D(sphere.net(), colors=NET, radii=-0.7)
        stream.log(f"{path}/net", circles, static=True)
        ends = 1.25 * np.eye(3)
        axes = rr.LineStrips3D([[end * 0.8, end] for end in ends], colors=NET, radii=-1.0)
        stream.log(f"{path}/axes", axes, static=True)
        names = rr.Points3D(ends, labels=["x", "y", "z"], colors=GREY, radii=-0.1)
        stream.log(f"{path}/axes/names", names, static=True)
        for k, arrow in enumerate(chart.arrows):
            target, color = np.array(arrow.target), CURVES[k % len(CURVES)][1]
            words = f"goal of {arrow.name}"
            goal = rr.Points3D([target], labels=[words], colors=GOAL, radii=-6.0)
            stream.log(f"{path}/goals/{arrow.name}", goal, static=True)
            off = rr.Points3D([-target], colors=OPPOSITE, radii=-4.0)
            stream.log(f"{path}/opposite/{arrow.name}", off, static=True)
            if arrow.basin is not None:
                line = rr.LineStrips3D([arrow.basin], colors=color, radii=-0.9)
                stream.log(f"{path}/basins/{arrow.name}", line, static=True)


def arrow_styles(stream: Stream, drawn: Sequence[Sphere], key: str, beneath: bool) -> None:
    """Logs how the vectors of a flight look.

    Args:
        stream: The recording.
        drawn: The spheres.
        key: Name of the flight in paths.
        beneath: Whether it is drawn beneath the other.
    """
    for chart in drawn:
        for k, arrow in enumerate(chart.arrows):
            color, path = CURVES[k % len(CURVES)][beneath], _flight(chart, arrow, key)
            look = rr.LineStrips3D.from_fields(colors=color, radii=-0.8 if beneath else -2.2)
            stream.log(f"{path}/track", look, static=True)
            shaft = rr.Arrows3D.from_fields(
                origins=[[0.0, 0.0, 0.0]],
                colors=color,
                radii=0.012 if beneath else 0.022,
                labels=None if beneath else [arrow.name],
            )
            stream.log(f"{path}/now", shaft, static=True)


def arrows(
    stream: Stream,
    drawn: Sequence[Sphere],
    part: Trajectory,
    key: str,
    before: Mapping[str, float],
) -> None:
    """Logs a part of a flight on the spheres: the present vectors, and their paths in short strips.

    Args:
        stream: The recording.
        drawn: The spheres.
        part: The part, at least one row.
        key: Name of the flight in paths.
        before: The signals in the row before the part; empty at the start of a flight.
    """
    for chart in drawn:
        for arrow in chart.arrows:
            path, points, time = _flight(chart, arrow, key), path_of(arrow, part), part.time
            times = [rr.TimeColumn(TIMELINE, duration=time)]
            stream.send_columns(f"{path}/now", times, rr.Arrows3D.columns(vectors=points))
            if before:
                last = [before[name] for name in arrow.signals]
                points, time = np.vstack([last, points]), np.r_[before["time"], time]
            starts, pieces = strips(time, points)
            times = [rr.TimeColumn(TIMELINE, duration=starts)]
            stream.send_columns(f"{path}/track", times, rr.LineStrips3D.columns(strips=pieces))


def sphere_views(drawn: Sequence[Sphere], keys: Sequence[str]) -> list[rrb.Spatial3DView]:
    """Returns a view for each sphere, seen from where its targets are.

    Args:
        drawn: The spheres.
        keys: Names of the flights in paths.
    """
    always = rrb.VisibleTimeRanges(
        rr.VisibleTimeRange(
            TIMELINE, start=rr.TimeRangeBoundary.infinite(), end=rr.TimeRangeBoundary.infinite()
        )
    )
    return [
        rrb.Spatial3DView(
            origin=f"sphere/{chart.name}",
            name=f"{chart.title}, {chart.frame}",
            background=NIGHT,
            line_grid=rrb.LineGrid3D(visible=False),
            eye_controls=rrb.EyeControls3D(
                position=DISTANCE * sphere.eye(chart),
                look_target=[0, 0, 0],
                eye_up=sphere.view(chart).up,
            ),
            overrides={
                f"{_flight(chart, arrow, key)}/track": [always]
                for arrow in chart.arrows
                for key in keys
            },
        )
        for chart in drawn
    ]


def _shown(history: History, beneath: bool) -> list[Curve]:
    return [history.curves[k] for k in history.heads] if beneath else list(history.curves)


def _named(curve: Curve, flight: str) -> str:
    return f"{curve.name}, {flight}" if curve.hue is None else curve.name


def _color(curve: Curve, beneath: bool) -> Color:
    if curve.hue is None:
        return HEAD[beneath]
    # The wide curve of a pair is the dark one, so that the thin one is seen on it.
    return CURVES[curve.hue % len(CURVES)][curve.beneath]


def _width(curve: Curve, beneath: bool) -> float:
    if curve.hue is None:
        return WIDE if beneath else 2.4
    return WIDE if curve.beneath else THIN


def _flight(chart: Sphere, arrow: Arrow, key: str) -> str:
    return f"sphere/{chart.name}/flights/{key}/{arrow.name}"
