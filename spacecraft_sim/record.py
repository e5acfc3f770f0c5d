"""A flight as a recording (.rrd) for the rerun viewer, written while it is flown.

Two flights lie over each other: that of the full plant, and beneath it another that is known
beforehand, of the reduced model or of another run; it says how large everything will be.  The same
calls write a file, an open viewer, or both, in chunks; after each the file reads up to there.
"""

import os
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from uuid import uuid4

import numpy as np

from spacecraft_sim import (
    record_chart,
    record_law,
    record_scene,
    record_signals,
    record_text,
    spans,
)
from spacecraft_sim.beneath import Beneath, Subject, channels
from spacecraft_sim.changes import Channel, changes, rows_to_show
from spacecraft_sim.chart import histories, spheres, vectors
from spacecraft_sim.frames import (
    Frames,
    at_rest,
    drawn_bodies,
    posed,
    read_joints,
    simulated,
    spacing,
    thinned,
)
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.mjcf import BUS
from spacecraft_sim.record_layout import Layout, blueprint
from spacecraft_sim.record_stream import Outlet, Stream, rr
from spacecraft_sim.signal_groups import groups
from spacecraft_sim.trajectory import Trajectory, selected

APPLICATION = "spacecraft_sim"
CHUNK = 1000  # rows of a flight that is over
Nozzles = dict[str, list[record_scene.Nozzle]]
LOOKS = 60  # instants of a flight at which it is looked how far an arm reaches
_FOOTER = b"RRF2FOOT"  # and four bytes more end a file that is whole
ROOM = 1_000_000  # bytes that a disk must have for a recording to begin
UNFINISHED = "cannot be written to its end"
REST = "is the disk full? 'repair' keeps what is there"
PLUME = 0.25  # longest plume, in sizes of the spacecraft


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

    Raises:
        OSError: If the file cannot be written to its end.
    """
    with Recording(subject, path) as recording:
        recording.expect(beneath)
        for k in range(0, len(measured.time), CHUNK):
            recording.take(selected(measured, slice(k, k + CHUNK)))
        recording.conclude(verdicts, page)
    if recording.lost_file:
        raise OSError(recording.lost_file)


class Recording:
    """A recording that is being written; use it in a `with` statement, which completes the file.

    Attributes:
        lost_viewer: Why the viewer did not get all of it, once it is closed; None if it did.
        lost_file: Why the file did not, likewise.
    """

    def __init__(self, subject: Subject, path: Path | None, viewer: str | None = None):
        """Opens the recording and logs what is known before any flight.

        Args:
            subject: What it is about.
            path: The .rrd file; None for none.
            viewer: Address of an open viewer; None for none.

        Raises:
            OSError: If the file cannot be written.
        """
        self.lost_viewer: str | None = None
        self.lost_file: str | None = None
        self._subject, self._path = subject, path and path.absolute()
        self._rest = at_rest(subject.model, subject.machine)
        self._bodies = drawn_bodies(self._rest)
        self._shown = 0  # rows of the flight beneath
        self._last: dict[str, dict[str, float]] = {}  # signals in the last row, by flight
        if self._path:
            _make_sure_of_room(self._path.with_suffix(".room"))
        name = str(uuid4())
        # A viewer has one layout for all recordings of an application: each is one of its own.
        own = f"{APPLICATION} {name[:8]}"
        self._file = Outlet(own, name, rr.FileSink(str(self._path))) if path else None
        if self._file and self._path:
            self._file.hold(self._path)
        self._viewer = Outlet(own, name, rr.GrpcSink(viewer)) if viewer else None
        self._stream = stream = Stream([o for o in (self._file, self._viewer) if o])
        stream.send_recording_name(subject.title)
        self._document("scenario", record_text.scenario_page(subject.scenario))
        self._document("verdicts", record_text.unjudged_page(subject.title, ()))
        record_scene.setting(stream, self._rest)
        stream.flush()

    def __enter__(self) -> "Recording":
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._stream.end()
        if self._viewer and (reason := self._viewer.close()):
            self.lost_viewer = f"the viewer was lost: {reason}"
        if self._file and self._path:
            reason = self._file.close() or _unfinished(self._path)
            self.lost_file = f"{self._path}: {UNFINISHED}: {reason}; {REST}" if reason else None

    def expect(self, beneath: Beneath) -> None:
        """Takes the flight that is known beforehand, and lays out the views.

        Args:
            beneath: The flight.
        """
        stream, known, subject = self._stream, beneath.known, self._subject
        self._beneath = beneath
        upright = BUS not in self._rest.positions
        self._size = record_scene.extent(self._rest)
        middle, radius = record_scene.ball(self._rest, self._poses(known) if upright else ())
        record_scene.ruler(stream, self._rest, middle, radius, upright)
        self._spheres = spheres(subject.charts, known[0])
        directions = vectors(subject.charts, known[0])
        self._plots = groups(known, list(self._rest.booms), directions)
        wide = sorted(subject.bands.items(), key=lambda band: -band[1])
        plotted = {signal for group in self._plots for signal in group.signals}
        self._bands = {signal: half for signal, half in wide if signal in plotted}
        self._planes = record_chart.planes(subject.charts, known, self._bands)
        self._drawn = {
            beneath.key: histories(beneath.charts, known[0]),
            beneath.over_key: histories(subject.charts, known[-1]),
        }
        self._progress = dict.fromkeys(self._drawn, record_law.Progress())
        longest = max(known, key=lambda flight: flight.time[-1])
        self._ends = {
            beneath.key: float(known[0].time[-1]),
            beneath.over_key: float(known[-1].time[-1]),
        }
        self._every = spacing(longest)
        self._apart = record_law.spacing(max(self._ends.values()))
        self._edge_to_edge = min(0.05, float(longest.time[-1]) / 1500) or 1.0
        self._edges, self._end = 0, 0.0
        root, other = self._root(beneath.over_key), self._root(beneath.key)
        record_scene.solids(stream, root, self._rest, self._bodies, False)
        record_scene.solids(stream, other, beneath.rest, beneath.bodies, True)
        self._nozzles = record_scene.nozzles(stream, root, self._rest)
        for key, name, under in (
            (beneath.over_key, beneath.over_name, False),
            (beneath.key, beneath.name, True),
        ):
            record_signals.styles(stream, self._plots, key, name, under)
            record_law.styles(stream, self._drawn[key], key, name, under)
            record_law.arrow_styles(stream, self._spheres, key, under)
            color = record_signals.AXES["z"][under]
            record_chart.track_styles(stream, self._planes, key, color, under)
        record_signals.band_styles(stream, self._bands)
        record_chart.plane_frames(stream, self._planes, beneath.flight)
        record_chart.maps(stream, subject.charts)
        record_law.globes(stream, self._spheres)
        self._channels = channels(beneath.flight, subject.machine, known)
        both = bool(beneath.channels)
        record_signals.lane_styles(stream, self._channels, beneath.over_key if both else "", False)
        record_signals.lane_styles(stream, beneath.channels, beneath.key, True)
        self._document("verdicts", record_text.unjudged_page(subject.title, beneath.notes))
        self._send_layout(middle, radius)
        self._stream.flush()

    def take(self, part: Trajectory) -> None:
        """Logs rows of the flight on top, and those of the other up to there.

        Args:
            part: The next rows, at least one.
        """
        beneath, subject = self._beneath, self._subject
        rows = thinned(part, self._every)
        beside = simulated(subject.model, subject.machine, rows, beneath.factor)
        self._beside = beside, rows
        root = self._root(beneath.over_key)
        record_scene.motion(self._stream, root, beside, self._rest, self._bodies)
        self._signals(part, beneath.over_key, self._channels, self._nozzles)
        self._end = float(part.time[-1])
        self._fill_bands(self._end)
        self._show_beneath(self._end)
        self._stream.flush()

    def conclude(self, verdicts: Sequence[Verdict], page: str | None = None) -> None:
        """Logs what became of the claims, and lets the recording close: nothing may follow.

        Args:
            verdicts: Of the flight on top.
            page: What stands in place of the table of verdicts, as Markdown.
        """
        longest = float(self._beneath.flight.time[-1])
        self._fill_bands(longest)
        self._show_beneath(longest)
        record_signals.verdict_events(self._stream, verdicts, self._end)
        title, notes = self._subject.title, self._beneath.notes
        self._document("verdicts", page or record_text.verdict_page(title, verdicts, notes))
        self._stream.end()

    def stop(self, reason: str) -> None:
        """Logs why the flight ended before its time.

        Args:
            reason: Why.
        """
        record_signals.remark(self._stream, self._end, reason)

    def _fill_bands(self, end: float) -> None:
        self._edges = record_signals.band(
            self._stream, self._bands, self._edges, end, self._edge_to_edge
        )

    def _show_beneath(self, end: float) -> None:
        """The rows of the flight beneath up to an instant."""
        beneath = self._beneath
        stop = int(beneath.flight.time.searchsorted(end, side="right"))
        if stop > self._shown:
            part = selected(beneath.flight, slice(self._shown, stop))
            frames = beneath.frames(thinned(part, self._every), *self._beside)
            root = self._root(beneath.key)
            record_scene.motion(self._stream, root, frames, beneath.rest, beneath.bodies)
            self._signals(part, beneath.key, beneath.channels, {})
            self._shown = stop

    def _signals(
        self, part: Trajectory, key: str, found: Sequence[Channel], nozzles: Nozzles
    ) -> None:
        stream, before = self._stream, self._last.get(key, {})
        chosen = rows_to_show(part, self._channels, before)
        chosen[-1] |= part.time[-1] == self._ends[key]
        self._draw_law(part, key)
        part = selected(part, chosen)
        if not len(part.time):
            return
        record_signals.histories(stream, self._plots, part, key)
        record_chart.tracks(stream, self._planes, part, key, before)
        happened = changes(part, found, before)
        lanes = key if self._beneath.channels else ""
        record_signals.lanes(stream, happened, lanes)
        record_signals.events(stream, happened, lanes)
        record_scene.plumes(stream, nozzles, happened, PLUME * self._size, self._apart)
        last = {name: float(value[-1]) for name, value in part.signals.items()}
        self._last[key] = {"time": float(part.time[-1]), **last}

    def _draw_law(self, part: Trajectory, key: str) -> None:
        stream, before = self._stream, self._progress[key]
        wanted = record_law.shown_rows(part.time, self._apart, before, self._ends[key])
        under = key == self._beneath.key
        self._progress[key] = record_law.histories(
            stream, self._drawn[key], part, wanted, key, under, before
        )
        if wanted.any():
            record_law.arrows(stream, self._spheres, selected(part, wanted), key, before.row)

    def _poses(self, known: Sequence[Trajectory]) -> list[Frames]:
        """Some frames of the flights whose readings say where every joint is."""
        subject, found = self._subject, []
        for flight in known:
            if joints := read_joints(subject.model, flight):
                rows = np.linspace(0, len(flight.time) - 1, LOOKS).astype(int)
                part = selected(flight, rows)
                found.append(posed(subject.model, subject.machine, part, joints, 1.0))
        return found

    def _send_layout(self, middle: np.ndarray, radius: float) -> None:
        """The file opens at rest; a viewer that is open follows the flight."""
        beneath = self._beneath
        layout = Layout(
            middle=middle,
            radius=radius,
            factor=beneath.factor,
            ghost=beneath.name,
            ends=self._ends,
            planes=self._planes,
            charts=self._subject.charts,
            histories=tuple({h.name: h for key in self._drawn for h in self._drawn[key]}.values()),
            spheres=self._spheres,
            groups=self._plots,
            bands=self._bands,
            relays=any(not channel.thruster.proportional for channel in self._channels),
            acting=self._acting(),
            unit=" or ".join(sorted({c.unit for c in (*self._channels, *beneath.channels)})),
            duration=max(self._ends.values()),
            active=self._active(),
            booms=bool(self._rest.booms),
            drawn=bool(beneath.bodies),
            upright=BUS not in self._rest.positions,
        )
        self._stream.flush()
        if self._file:
            self._file.lay_out(blueprint(layout, following=False))
        if self._viewer:
            self._viewer.lay_out(blueprint(layout, following=True))

    def _acting(self) -> list[str]:
        """Channels that act in a flight that is known; all if none does."""
        names = list(dict.fromkeys(c.name for c in (*self._channels, *self._beneath.channels)))
        known = self._beneath.known
        acting = [n for n in names if any(np.any(f.signals.get(n, 0.0)) for f in known)]
        return acting or names

    def _active(self) -> float | None:
        """Until when there is something to see of a machine that comes to rest, s."""
        known = self._beneath.known
        if any(not channel.thruster.proportional for channel in self._channels):
            return None
        signals = [name for group in self._plots for name in group.signals]
        active = max(spans.transient(flight, signals) for flight in known)
        return active if active < 0.7 * max(self._ends.values()) else None

    def _document(self, path: str, text: str) -> None:
        document = rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN)
        self._stream.log(path, document, static=True)

    def _root(self, key: str) -> str:
        return f"world/{key}"


def _make_sure_of_room(path: Path) -> None:
    """Writes a file and takes it away: where there is no room at all, rerun waits for ever."""
    try:
        path.write_bytes(bytes(ROOM))
    finally:
        path.unlink(missing_ok=True)


def _unfinished(path: Path) -> str | None:
    """What a file lacks that was closed."""
    try:
        with path.open("rb") as file:
            file.seek(-len(_FOOTER) - 4, os.SEEK_END)
            return None if file.read(len(_FOOTER)) == _FOOTER else "it has no footer"
    except OSError as error:  # it was taken away
        return error.strerror
