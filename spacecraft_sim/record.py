"""A flight as a recording (.rrd) for the rerun viewer, written while it is flown.

Two flights lie over each other: that of the full plant, and beneath it another that is known
beforehand, of the reduced model or of another run; it says how large everything will be.  The same
calls write a file, an open viewer, or both, in chunks; after each the file reads up to there.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any
from uuid import uuid4

import rerun as rr

from spacecraft_sim import record_chart, record_scene, record_signals, record_text
from spacecraft_sim.changes import Channel, changes
from spacecraft_sim.chart import Charts
from spacecraft_sim.drawing import Drawing, channel_units
from spacecraft_sim.frames import Frames, at_rest, ghost, simulated, suited_factor
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.mjcf import BUS
from spacecraft_sim.record_layout import Layout, blueprint
from spacecraft_sim.spacecraft import Spacecraft
from spacecraft_sim.trajectory import Trajectory, selected

APPLICATION = "spacecraft_sim"
PATIENCE = 5.0  # how long a viewer may take for a chunk before the run goes on without it, s
CHUNK = 1000  # rows of a flight that is over
PLUME = 0.25  # longest plume, in sizes of the spacecraft


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """What a recording is about.

    Attributes:
        title: Name of the recording.
        scenario: The scenario, as TOML.
        model: The compiled spacecraft.
        machine: The spacecraft.
        band: Accuracy that the quasi-rigid angle shall keep, rad; None if none was asked for.
        charts: What the law draws beside its theorem.
    """

    title: str
    scenario: str
    model: Any
    machine: Spacecraft
    band: float | None = None
    charts: Charts = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Beneath:
    """The flight that lies beneath the other, drawn as a ghost.

    Attributes:
        flight: The flight.
        known: Flights that are known beforehand: this one, and the other one if it is over.
        key: Its name in paths; in alphabetical order before that of the other.
        name: Its name in keys.
        over_key: Name of the other flight in paths.
        over_name: Name of the other flight in keys.
        rest: Its machine in the reference configuration.
        bodies: The bodies that are drawn; the first carries the booms.
        frames: Draws a part of it, given its rows, the frames and the rows of the other flight.
        factor: How many times too far all booms are bent.
        channels: Channels that get lanes of their own.
        notes: What is to be said of the recording.
    """

    flight: Trajectory
    known: Sequence[Trajectory]
    key: str
    name: str
    over_key: str
    over_name: str
    rest: Drawing
    bodies: Sequence[str]
    frames: Callable[[Trajectory, Frames, Trajectory], Frames]
    factor: float
    channels: Sequence[Channel] = ()
    notes: tuple[str, ...] = ()


def reduced(subject: Subject, flight: Trajectory, factor: float | None = None) -> Beneath:
    """Returns the flight of the reduced model as the one that lies beneath.

    Args:
        subject: What the recording is about.
        flight: The flight.
        factor: How many times too far booms are bent; a round factor that shows it if left out.
    """
    machine, rest = subject.machine, at_rest(subject.model, subject.machine)
    if factor is None:
        factor = suited_factor(flight, {boom.name: boom.length for boom in machine.booms})

    def frames(part: Trajectory, beside: Frames, over: Trajectory) -> Frames:
        if BUS not in rest.positions:  # an arm: the readings of its equations place no body
            return Frames(time=part.time, positions={}, quaternions={}, booms={})
        return ghost(machine, rest, beside, over, factor).frames(part, beside)

    return Beneath(
        flight=flight,
        known=(flight,),
        key="reduced",
        name="reduced",
        over_key="simulated",
        over_name="MuJoCo",
        rest=rest,
        bodies=[BUS] if BUS in rest.positions else [],
        frames=frames,
        factor=factor,
        notes=(
            f"Booms are drawn bent {factor:g} times as far as they are. Translucent: the reduced "
            "model. It knows attitude and boom tips; its bus stands at the place of the MuJoCo bus "
            "and its booms have the shape of the first cantilever mode through their tips.",
        ),
    )


def channels(flight: Trajectory, rest: Drawing, machine: Spacecraft) -> list[Channel]:
    """Returns the thruster channels of a flight.

    Args:
        flight: The flight, or a part of it.
        rest: Its machine in the reference configuration.
        machine: The machine.
    """
    units = channel_units(flight, rest)
    return [
        Channel(thruster=thruster, unit=units[thruster.name])
        for thruster in machine.thrusters
        if thruster.name in units
    ]


def write(
    path: Path,
    subject: Subject,
    measured: Trajectory,
    beneath: Beneath,
    verdicts: Sequence[Verdict],
    page: str | None = None,
) -> None:
    """Writes the recording of flights that are over.

    Args:
        path: The .rrd file.
        subject: What it is about.
        measured: The flight on top.
        beneath: The other flight.
        verdicts: What became of the guarantees of the flight on top.
        page: What stands in place of the table of verdicts, as Markdown.
    """
    with Recording(subject, path) as recording:
        recording.expect(beneath)
        for k in range(0, len(measured.time), CHUNK):
            recording.take(selected(measured, slice(k, k + CHUNK)))
        recording.conclude(verdicts, page)


class Recording:
    """A recording that is being written; use it in a `with` statement, which completes the file.

    Attributes:
        trouble: Why the viewer no longer gets the data; None while it does.
    """

    def __init__(self, subject: Subject, path: Path | None, viewer: str | None = None):
        """Opens the recording and logs what is known before any flight.

        Args:
            subject: What it is about.
            path: The .rrd file; None for none.
            viewer: Address of an open viewer; None for none.
        """
        self.trouble: str | None = None
        self._subject, self._viewer, self._patience = subject, viewer, PATIENCE
        self._stream = stream = rr.RecordingStream(APPLICATION, recording_id=uuid4())
        sinks = [rr.FileSink(path)] if path else []
        sinks += [rr.GrpcSink(viewer)] if viewer else []
        stream.set_sinks(*sinks)
        stream.send_recording_name(subject.title)
        self._rest = at_rest(subject.model, subject.machine)
        self._bodies = record_scene.drawn_bodies(self._rest)
        self._shown = 0  # rows of the flight beneath
        self._last: dict[str, dict[str, float]] = {}  # signals in the last row, by flight
        self._document("scenario", record_text.scenario_page(subject.scenario))
        self._document("verdicts", record_text.unjudged_page(subject.title, ()))
        record_scene.setting(stream, self._rest)
        self._flush()

    def __enter__(self) -> "Recording":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._flush()
        self._stream.disconnect()  # writes the footer of the file

    def expect(self, beneath: Beneath) -> None:
        """Takes the flight that is known beforehand, and lays out the views.

        Args:
            beneath: The flight.
        """
        stream, flight, subject = self._stream, beneath.flight, self._subject
        self._beneath = beneath
        self._size = record_scene.extent(self._rest)
        self._plots = record_signals.plots(beneath.known, list(self._rest.booms))
        self._planes = record_chart.planes(subject.charts, beneath.known, subject.band)
        duration = float(flight.time[-1]) or 1.0
        self._spacing = min(0.05, duration / 1500)
        self._end, self._edges = float(flight.time[0]), 0
        root, other = self._root(beneath.over_key), self._root(beneath.key)
        record_scene.solids(stream, root, self._rest, self._bodies, False)
        record_scene.solids(stream, other, beneath.rest, beneath.bodies, True)
        self._nozzles = record_scene.nozzles(stream, root, self._rest)
        for key, name, under in (
            (beneath.over_key, beneath.over_name, False),
            (beneath.key, beneath.name, True),
        ):
            record_signals.styles(stream, self._plots, flight, key, name, under)
            color = record_signals.AXES["z"][under]
            record_chart.track_styles(stream, self._planes, key, color, under)
        if subject.band:
            record_signals.band_style(stream, subject.band)
        record_chart.plane_frames(stream, self._planes, flight)
        record_chart.maps(stream, subject.charts)
        self._channels: list[Channel] = []
        if beneath.channels:
            record_signals.lane_styles(stream, beneath.channels, beneath.key, True)
        self._document("verdicts", record_text.unjudged_page(subject.title, beneath.notes))
        self._send_layout()
        self._flush()

    def take(self, part: Trajectory) -> None:
        """Logs rows of the flight on top, and those of the other up to there.

        Args:
            part: The next rows, at least one.
        """
        beneath, stream, subject = self._beneath, self._stream, self._subject
        if not self._channels:
            self._channels = channels(part, self._rest, subject.machine)
            lanes = beneath.over_key if beneath.channels else ""
            record_signals.lane_styles(stream, self._channels, lanes, False)
        beside = simulated(subject.model, subject.machine, part, beneath.factor)
        self._beside = beside, part
        root = self._root(beneath.over_key)
        record_scene.motion(stream, root, beside, self._rest, self._bodies)
        self._signals(part, beneath.over_key, self._channels, self._nozzles)
        end = float(part.time[-1])
        self._end = end
        self._fill_band(end)
        self._show_beneath(end)
        self._flush()

    def conclude(self, verdicts: Sequence[Verdict], page: str | None = None) -> None:
        """Logs what became of the claims; the flight has come to its end.

        Args:
            verdicts: Of the flight on top.
            page: What stands in place of the table of verdicts, as Markdown.
        """
        longest = float(self._beneath.flight.time[-1])
        self._fill_band(longest)
        self._show_beneath(longest)
        record_signals.verdict_events(self._stream, verdicts, self._end)
        title, notes = self._subject.title, self._beneath.notes
        self._document("verdicts", page or record_text.verdict_page(title, verdicts, notes))

    def stop(self, reason: str) -> None:
        """Logs why the flight ended before its time.

        Args:
            reason: Why.
        """
        record_signals.remark(self._stream, self._end, reason)

    def _fill_band(self, end: float) -> None:
        if width := self._subject.band:
            stream, spacing = self._stream, self._spacing
            self._edges = record_signals.band(stream, self._edges, end, width, spacing)

    def _show_beneath(self, end: float) -> None:
        """The rows of the flight beneath up to an instant."""
        beneath = self._beneath
        stop = int(beneath.flight.time.searchsorted(end, side="right"))
        if stop > self._shown:
            part = selected(beneath.flight, slice(self._shown, stop))
            frames = beneath.frames(part, *self._beside)
            root = self._root(beneath.key)
            record_scene.motion(self._stream, root, frames, beneath.rest, beneath.bodies)
            self._signals(part, beneath.key, beneath.channels, {})
            self._shown = stop

    def _signals(
        self, part: Trajectory, key: str, found: Sequence[Channel], nozzles: dict[str, list[str]]
    ) -> None:
        stream, before = self._stream, self._last.get(key, {})
        record_signals.histories(stream, self._plots, part, key)
        record_chart.tracks(stream, self._planes, part, key, before)
        happened = changes(part, found, before)
        lanes = key if self._beneath.channels else ""
        record_signals.lanes(stream, happened, lanes)
        record_signals.events(stream, happened, lanes)
        record_scene.plumes(stream, nozzles, happened, PLUME * self._size)
        self._last[key] = {name: float(value[-1]) for name, value in part.signals.items()}

    def _send_layout(self) -> None:
        """The file opens at rest; a viewer that is open follows the flight."""
        beneath = self._beneath
        layout = Layout(
            extent=self._size,
            factor=beneath.factor,
            ghost=beneath.name,
            ends={
                key: float(flight.time[-1])
                for key, flight in (
                    (beneath.key, beneath.known[0]),
                    (beneath.over_key, beneath.known[-1]),
                )
            },
            planes=self._planes,
            charts=self._subject.charts,
            band=self._subject.band,
        )
        self._stream.send_blueprint(blueprint(layout, following=False))
        if self._viewer:
            self._flush()
            aside = rr.RecordingStream(APPLICATION, recording_id=self._stream.get_recording_id())
            aside.connect_grpc(self._viewer)
            aside.send_blueprint(blueprint(layout, following=True))
            aside.flush(timeout_sec=self._patience)
            aside.disconnect()

    def _document(self, path: str, text: str) -> None:
        document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
        self._stream.log(path, document, static=True)

    def _flush(self) -> None:
        """Brings all that was logged to file and viewer; a viewer that is gone stops no run."""
        try:
            self._stream.flush(timeout_sec=self._patience)
        except RuntimeError as error:
            self.trouble = self.trouble or str(error)
            self._patience = 0.0

    def _root(self, key: str) -> str:
        return f"world/{key}"
