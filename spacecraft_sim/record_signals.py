"""The signals of two flights, one over the other: histories, bounds, lanes of thrust, events."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr

from spacecraft_sim.changes import BETWEEN, Changes, Channel, What
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.record_scene import BOOMS, TIMELINE, Color, Stream, throttle
from spacecraft_sim.trajectory import Trajectory, moving_axes

Array = np.ndarray

AXES = {  # colours of the flight on top and of the one beneath
    "z": ((77, 163, 255), (255, 170, 64)),
    "y": ((98, 205, 132), (228, 216, 92)),
    "x": ((255, 122, 144), (214, 130, 255)),
}
PLUS, MINUS, OFF = (240, 98, 74), (74, 144, 240), (44, 47, 56)
GREY, BAND = (120, 126, 140), (22, 62, 40)
AMBER = ((255, 200, 87), (150, 104, 24))  # thrust of the flight on top and of the one beneath
KINDS = ("attitude", "quasi_rigid_angle", "rate", "quasi_rigid_rate")
WIDTHS = (2.0, 4.2)  # of the line on top and of the one beneath


@dataclass(frozen=True, slots=True, kw_only=True)
class Plot:
    """Signals that are drawn together, one entity a flight.

    Attributes:
        view: Path of the view.
        signals: Their names.
        labels: Their names in the key.
        colors: Of each signal: on top and beneath.
    """

    view: str
    signals: tuple[str, ...]
    labels: tuple[str, ...]
    colors: tuple[tuple[Color, Color], ...]


def plots(known: Sequence[Trajectory], booms: Sequence[str]) -> tuple[Plot, ...]:
    """Returns what is plotted: whatever moves.

    Args:
        known: Flights that are known beforehand.
        booms: Names of the booms.
    """
    found = []
    for kind in KINDS:
        if axes := sorted({axis for flight in known for axis in moving_axes(flight, kind)}):
            signals = tuple(f"{kind}_{axis}" for axis in axes)
            colors = tuple(AXES[axis] for axis in axes)
            found.append(Plot(view=kind, signals=signals, labels=tuple(axes), colors=colors))
    tips = [
        (boom, axis, k, max(float(np.ptp(flight[f"{boom}_tip_{axis}"])) for flight in known))
        for k, boom in enumerate(booms)
        for axis in "yz"
        if all(f"{boom}_tip_{axis}" in flight.signals for flight in known)
    ]
    least = 1e-3 * max((swing for *_, swing in tips), default=0.0)
    if moving := [(boom, axis, k) for boom, axis, k, swing in tips if swing >= least]:
        tip = Plot(
            view="tips",
            signals=tuple(f"{boom}_tip_{axis}" for boom, axis, _ in moving),
            labels=tuple(f"{boom} {axis}" for boom, axis, _ in moving),
            colors=tuple(BOOMS[k % len(BOOMS)] for *_, k in moving),
        )
        found.append(tip)
    return tuple(found)


def styles(
    stream: Stream, drawn: Sequence[Plot], flight: Trajectory, key: str, name: str, beneath: bool
) -> None:
    """Logs how the lines of a flight look.

    Args:
        stream: The recording.
        drawn: The plots.
        flight: A flight, for the units.
        key: Name of the flight in paths.
        name: Name of the flight in keys.
        beneath: Whether it is drawn beneath the other.
    """
    for plot in drawn:
        # Booms often swing alike: the later ones are thinner, so that all can be seen.
        ranks = np.arange(len(plot.signals)) if plot.view == "tips" else np.zeros(len(plot.signals))
        look = rr.SeriesLines(
            names=[
                f"{label}, {name} [{flight.units[signal]}]"
                for label, signal in zip(plot.labels, plot.signals, strict=True)
            ],
            colors=[pair[beneath] for pair in plot.colors],
            widths=np.maximum(WIDTHS[beneath] - 0.8 * ranks, 0.8),
            aggregation_policy="MinMax",  # the average of a limit cycle would be a flat line
        )
        stream.log(f"{plot.view}/{key}", look, static=True)


def histories(stream: Stream, drawn: Sequence[Plot], part: Trajectory, key: str) -> None:
    """Logs a part of a flight.

    Args:
        stream: The recording.
        drawn: The plots.
        part: The part.
        key: Name of the flight in paths.
    """
    times = [rr.TimeColumn(TIMELINE, duration=part.time)]
    for plot in drawn:
        if all(signal in part.signals for signal in plot.signals):
            values = np.stack([part[signal] for signal in plot.signals], axis=1)
            scalars = rr.Scalars.columns(scalars=values.ravel())
            counts = np.full(len(part.time), len(plot.signals))
            stream.send_columns(f"{plot.view}/{key}", times, scalars.partition(counts))


def band_style(stream: Stream, band: float) -> None:
    """Logs how the bound of the angle looks.

    Args:
        stream: The recording.
        band: Half-width, rad.
    """
    look = rr.SeriesLines(
        names=f"±{band:g} rad", colors=BAND, widths=4, aggregation_policy="MinMax"
    )
    stream.log("bound/angle", look, static=True)


def band(stream: Stream, first: int, stop: float, band: float, spacing: float) -> int:
    """Logs the bound of the angle as a band: a line so quick between its edges that it fills it.

    Args:
        stream: The recording.
        first: How many points of the line are logged already.
        stop: Until when, s.
        band: Half-width, rad.
        spacing: Time from edge to edge, s.

    Returns:
        How many points are logged now.
    """
    count = np.arange(first, int(stop / spacing + 1e-6) + 1)
    if len(count):
        times = [rr.TimeColumn(TIMELINE, duration=count * spacing)]
        edges = rr.Scalars.columns(scalars=np.where(count % 2, -band, band))
        stream.send_columns("bound/angle", times, edges)
    return first + len(count)


def lane_styles(stream: Stream, channels: Sequence[Channel], name: str, beneath: bool) -> None:
    """Logs how commands and delivered thrusts look, as lanes of states and as plots.

    Args:
        stream: The recording.
        channels: The channels.
        name: Name of the flight, put before the lanes' names; empty for none.
        beneath: Whether the flight is drawn beneath the other.
    """
    for channel in channels:
        values = np.array(list(channel.states.values()))
        share = np.abs(throttle(values, channel.thruster.levels))[:, None]
        bright = np.where(values[:, None] > 0, PLUS, MINUS)
        colors = np.where(share > 0, OFF + share * (bright - OFF), OFF)
        lane = rr.StateConfiguration(
            values=[*channel.states, *BETWEEN],
            colors=np.vstack([colors, PLUS, MINUS]).astype(np.uint8),
        )
        for what in ("command", "thrust"):
            path = _lane(channel, what, name)
            stream.log(f"relay/{path}", lane, static=True)
            plot = rr.SeriesLines(
                names=f"{path} [{channel.unit}]",
                colors=GREY if what == "command" else AMBER[beneath],
                widths=1.2 if what == "command" else 2.0,
                interpolation_mode="StepAfter",
                aggregation_policy="MinMax",
            )
            stream.log(f"thrust/{path}", plot, static=True)


def lanes(stream: Stream, found: Sequence[Changes], name: str) -> None:
    """Logs the changes of commands and thrusts, as states and as steps.

    Args:
        stream: The recording.
        found: The changes.
        name: As for `lane_styles`.
    """
    for change in found:
        path = _lane(change.channel, change.what, name)
        # The last value is repeated, so that the line reaches to the end of the part.
        time, value = np.append(change.time, change.end), np.append(change.value, change.last)
        fresh = len(change.time) == 0 or change.time[-1] < change.end
        time, value = (time, value) if fresh else (change.time, change.value)
        times = [rr.TimeColumn(TIMELINE, duration=time)]
        stream.send_columns(f"thrust/{path}", times, rr.Scalars.columns(scalars=value))
        if len(change.time):
            states = change.channel.state_by_state(change.value)
            times = [rr.TimeColumn(TIMELINE, duration=change.time)]
            stream.send_columns(f"relay/{path}", times, rr.StateChange.columns(state=states))


def _lane(channel: Channel, what: What, name: str) -> str:
    """In the viewer the path is the name of the lane."""
    word = "command" if what == "command" else "delivered"
    return f"{channel.name}/{name}_{word}" if name else f"{channel.name}/{word}"


def events(stream: Stream, found: Sequence[Changes], name: str) -> None:
    """Logs in words what each change of a command or a thrust is.

    Args:
        stream: The recording.
        found: The changes.
        name: As for `lane_styles`.
    """
    rows = [
        (
            time,
            "INFO" if change.what == "command" else "TRACE",
            f"{name}: {words}" if name else words,
        )
        for change in found
        for time, words in zip(change.time.tolist(), change.words(), strict=True)
    ]
    _log_events(stream, sorted(rows))


def verdict_events(stream: Stream, verdicts: Sequence[Verdict], end: float, name: str = "") -> None:
    """Logs the instants that decided the verdicts.

    Args:
        stream: The recording.
        verdicts: The verdicts.
        end: End of the flight, s.
        name: Name of the flight, put before the claims; empty for none.
    """
    rows = []
    for v in verdicts:
        word = "closest to its bound" if v.holds else "BROKEN" if v.margin < 0 else "not guaranteed"
        about = f"{name}: claim {word}" if name else f"claim {word}"
        text = f"{about}: {v.claim}: {v.measured:.4g} {v.unit}, bound {v.bound:.4g}"
        level = "DEBUG" if v.holds else "ERROR"
        rows.append((end if v.t_worst is None else v.t_worst, level, text))
    _log_events(stream, sorted(rows))


def remark(stream: Stream, time: float, text: str) -> None:
    """Logs an event that ends a flight before its time.

    Args:
        stream: The recording.
        time: When, s.
        text: What happened.
    """
    _log_events(stream, [(time, "CRITICAL", text)])


def _log_events(stream: Stream, rows: Sequence[tuple[float, str, str]]) -> None:
    if rows:
        time, level, text = zip(*rows, strict=True)
        columns = rr.TextLog.columns(text=text, level=level)
        stream.send_columns("events", [rr.TimeColumn(TIMELINE, duration=np.array(time))], columns)
