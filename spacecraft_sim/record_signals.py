"""The signals of two flights, one over the other: histories, bounds, lanes of thrust, events."""

from collections.abc import Mapping, Sequence

import numpy as np

from spacecraft_sim.changes import BETWEEN, Changes, Channel, What
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.record_scene import BOOMS, TIMELINE, Color, throttle
from spacecraft_sim.record_stream import Stream, rr
from spacecraft_sim.signal_groups import Group
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray

AXES = {  # colours of the flight on top and of the one beneath
    "z": ((77, 163, 255), (255, 170, 64)),
    "y": ((98, 205, 132), (228, 216, 92)),
    "x": ((255, 122, 144), (214, 130, 255)),
}
CURVES = (*BOOMS, ((77, 163, 255), (38, 80, 125)), ((255, 122, 144), (125, 60, 70)))
PLUS, MINUS, OFF = (240, 98, 74), (74, 144, 240), (44, 47, 56)
GREY = (120, 126, 140)
BANDS = ((22, 62, 40), (18, 50, 58), (48, 56, 26))
AMBER = ((255, 200, 87), (150, 104, 24))  # thrust of the flight on top and of the one beneath
WIDTHS = (2.0, 4.2)  # of the line on top and of the one beneath


def styles(stream: Stream, drawn: Sequence[Group], key: str, name: str, beneath: bool) -> None:
    """Logs how the lines of a flight look.

    Args:
        stream: The recording.
        drawn: What is plotted.
        key: Name of the flight in paths.
        name: Name of the flight in keys.
        beneath: Whether it is drawn beneath the other.
    """
    for group in drawn:
        # Booms often swing alike: the later ones are thinner, so that all can be seen.
        ranks = np.arange(len(group.signals)) * (group.role == "tip")
        look = rr.SeriesLines(
            names=[f"{label}, {name} [{group.unit or '-'}]" for label in group.labels],
            colors=[_colors(group, k)[beneath] for k in range(len(group.labels))],
            widths=np.maximum(WIDTHS[beneath] - 0.8 * ranks, 0.8),
            aggregation_policy="MinMax",  # the average of a limit cycle would be a flat line
        )
        stream.log(f"{group.name}/{key}", look, static=True)


def _colors(group: Group, k: int) -> tuple[Color, Color]:
    """Axes and booms keep their colours from plot to plot."""
    return AXES.get(group.labels[k]) or CURVES[k % len(CURVES)]


def histories(stream: Stream, drawn: Sequence[Group], part: Trajectory, key: str) -> None:
    """Logs a part of a flight.

    Args:
        stream: The recording.
        drawn: What is plotted.
        part: The part.
        key: Name of the flight in paths.
    """
    times = [rr.TimeColumn(TIMELINE, duration=part.time)]
    for group in drawn:
        if all(signal in part.signals for signal in group.signals):
            values = np.stack([part[signal] for signal in group.signals], axis=1)
            scalars = rr.Scalars.columns(scalars=values.ravel())
            counts = np.full(len(part.time), len(group.signals))
            stream.send_columns(f"{group.name}/{key}", times, scalars.partition(counts))


def band_styles(stream: Stream, bands: Mapping[str, float]) -> None:
    """Logs how the bounds of signals look; the widest lies at the bottom.

    Args:
        stream: The recording.
        bands: Half-widths by signal, the widest first, rad.
    """
    for k, (signal, half) in enumerate(bands.items()):
        look = rr.SeriesLines(
            names=f"{signal[-1]} ±{half:g} rad",
            colors=BANDS[k % len(BANDS)],
            widths=4,
            aggregation_policy="MinMax",
        )
        stream.log(band_path(k, signal), look, static=True)


def band_path(k: int, signal: str) -> str:
    """Returns the path of a bound: lines are drawn over each other in the order of their paths.

    That order is a reader's: digits come first, and capitals are as small letters are.

    Args:
        k: Rank of the bound, the widest first.
        signal: The signal.
    """
    return f"0_bounds/{k}_{signal}"


def band(
    stream: Stream, bands: Mapping[str, float], first: int, stop: float, spacing: float
) -> int:
    """Logs bounds as bands: lines so quick between their edges that they fill them.

    Args:
        stream: The recording.
        bands: Half-widths by signal, the widest first, rad.
        first: How many points of each line are logged already.
        stop: Until when, s.
        spacing: Time from edge to edge, s.

    Returns:
        How many points are logged now.
    """
    count = np.arange(first, int(stop / spacing + 1e-6) + 1)
    if len(count) and bands:
        times = [rr.TimeColumn(TIMELINE, duration=count * spacing)]
        side = np.where(count % 2, -1.0, 1.0)
        for k, (signal, half) in enumerate(bands.items()):
            edges = rr.Scalars.columns(scalars=half * side)
            stream.send_columns(band_path(k, signal), times, edges)
    return first + len(count)


def lane_styles(stream: Stream, channels: Sequence[Channel], name: str, beneath: bool) -> None:
    """Logs how commands and delivered thrusts look, as lanes of states and as plots.

    Args:
        stream: The recording.
        channels: The channels.
        name: Name of the flight, put before the lanes' names; empty for none.
        beneath: Whether the flight is drawn beneath the other.
    """
    for k, channel in enumerate(channels):
        relay = not channel.thruster.proportional
        for what in ("command", "thrust"):
            path = _lane(channel, what, name)
            if relay:
                stream.log(f"relay/{path}", _states(channel), static=True)
            bright = CURVES[k % len(CURVES)][beneath] if len(channels) > 1 else AMBER[beneath]
            plot = rr.SeriesLines(
                names=f"{path} [{channel.unit}]",
                colors=GREY if what == "command" else bright,
                widths=1.2 if what == "command" else 2.0,
                interpolation_mode="StepAfter" if relay else "Linear",
                aggregation_policy="MinMax",
            )
            stream.log(f"thrust/{path}", plot, static=True)


def _states(channel: Channel) -> rr.StateConfiguration:
    values = np.array(list(channel.states.values()))
    share = np.abs(throttle(values, channel))[:, None]
    bright = np.where(values[:, None] > 0, PLUS, MINUS)
    colors = np.where(share > 0, OFF + share * (bright - OFF), OFF)
    return rr.StateConfiguration(
        values=[*channel.states, *BETWEEN], colors=np.vstack([colors, PLUS, MINUS]).astype(np.uint8)
    )


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
        if len(change.time) and not change.channel.thruster.proportional:
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
        if not change.channel.thruster.proportional  # such a thrust changes all the time
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
        word = {"holds": "closest to its bound", "FAILS": "BROKEN"}.get(v.outcome, v.outcome)
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
