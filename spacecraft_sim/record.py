"""A flight as a recording (.rrd) for the rerun viewer: motion, signals, relays, events, verdicts.

The paths and the layout are the same for every spacecraft, so recordings share one blueprint.
"""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from spacecraft_sim import record_chart
from spacecraft_sim.chart import Charts
from spacecraft_sim.drawing import Drawing, Jet, Shape, boom_points, channel_units, turned
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.trajectory import Trajectory, moving_axes

Array = np.ndarray
Stream = rr.RecordingStream
Verdicts = Sequence[Verdict]
Flights = tuple[Trajectory, Trajectory]  # of the reduced model and of the full plant

CHUNK = 250  # frames: the viewer loads and drops whole chunks
TIMELINE = "sim_time"
EXAGGERATION = 10.0  # of the drawn bending lines; true deflections hardly show
NEAR = 8.0  # half-width of the plots that follow the cursor, s
FINAL = 60.0  # the end of a flight, shown on its own in the phase plane, s

WHITE, GREY, FAINT, NIGHT = (235, 238, 245), (120, 126, 140), (70, 75, 88), (13, 15, 22)
GREEN, AMBER = (98, 205, 132), (255, 200, 87)
PLUS, MINUS, OFF = (240, 98, 74), (74, 144, 240), (44, 47, 56)
AXES = {  # colours of the full and of the reduced flight
    "z": ((77, 163, 255), (255, 170, 64)),
    "y": ((98, 205, 132), (228, 216, 92)),
    "x": ((255, 122, 144), (214, 130, 255)),
}
BOOMS = (((98, 205, 132), (49, 102, 66)), ((199, 125, 255), (99, 62, 127)), (AMBER, (127, 100, 43)))


def write(
    path: Path,
    *,
    measured: Trajectory,
    predicted: Trajectory,
    drawing: Drawing,
    verdicts: Sequence[Verdict],
    scenario_toml: str,
    title: str,
    band: float | None = None,
    charts: Charts = (),
) -> None:
    """Writes a recording with its blueprint; nothing is sent anywhere else.

    Args:
        path: The .rrd file.
        measured: Flight of the full plant.
        predicted: Flight of the reduced model.
        drawing: Shapes and motion of the full plant.
        verdicts: What became of the guarantees on the full plant.
        scenario_toml: The scenario, as text.
        title: Name of the recording.
        band: Accuracy that the quasi-rigid angle shall keep, rad; None if none was asked for.
        charts: What the law draws beside its theorem.
    """
    stream = Stream("spacecraft_sim")
    stream.save(path)
    with stream:  # the file is complete when the block ends
        stream.send_recording_name(title)
        stream.send_blueprint(_blueprint(_extent(drawing), charts))
        _documents(stream, verdicts, scenario_toml, title)
        _solids(stream, drawing)
        _plumes(stream, drawing, measured)
        _motion(stream, drawing)
        _signals(stream, (predicted, measured), tuple(drawing.booms), band or 0.0)
        _thrust(stream, measured, drawing)
        _phase_plane(stream, "phase/whole", (predicted, measured), 0.0)
        _phase_plane(stream, "phase/end", (predicted, measured), measured.time[-1] - FINAL)
        record_chart.log(stream, measured, charts)
        _events(stream, measured, drawing, verdicts)


def _solids(stream: Stream, drawing: Drawing) -> None:
    """Shapes once, in the frames of their bodies."""
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for body, kind in sorted({(shape.body, shape.kind) for shape in drawing.shapes}):
        shapes = [s for s in drawing.shapes if (s.body, s.kind) == (body, kind)]
        stream.log(f"world/{body}/{kind}", _solid(kind, shapes), static=True)


def _solid(kind: str, shapes: Sequence[Shape]) -> rr.AsComponents:
    size = np.array([shape.size for shape in shapes])
    centre = np.array([shape.position for shape in shapes])
    turn = np.array([shape.quaternion for shape in shapes])
    radius, length = size[:, 0], 2 * size[:, 1]
    look = {
        "quaternions": np.roll(turn, -1, axis=1),  # (w, x, y, z) -> (x, y, z, w)
        "colors": np.array([shape.rgba for shape in shapes]),
        "fill_mode": "solid",
    }
    if kind in ("capsule", "sphere"):  # a sphere is a capsule of no length
        # A capsule starts at its origin here; MuJoCo's origin is its middle.
        start = centre - size[:, 1:2] * turned(turn, np.array([0.0, 0.0, 1.0]))
        return rr.Capsules3D(radii=radius, lengths=length, translations=start, **look)
    if kind == "cylinder":
        return rr.Cylinders3D(radii=radius, lengths=length, centers=centre, **look)
    if kind == "box":
        return rr.Boxes3D(half_sizes=size, centers=centre, **look)
    return rr.Ellipsoids3D(half_sizes=size, centers=centre, **look)


def _motion(stream: Stream, drawing: Drawing) -> None:
    """Body poses, and each boom as a line, unbent and bent too far, in chunks of frames."""
    turns = {body: np.roll(q, -1, axis=1) for body, q in drawing.quaternions.items()}
    lines = {}
    for boom in drawing.booms:
        points, straight = boom_points(drawing, boom)
        lines[f"unbent/{boom}"] = straight[:, [0, -1]]
        lines[f"bending/{boom}"] = straight + EXAGGERATION * (points - straight)
    for path in lines:
        color = AMBER if path.startswith("bending") else GREY
        look = rr.LineStrips3D.from_fields(colors=color, radii=-1.2)  # -: in points of the screen
        stream.log(f"world/{path}", look, static=True)
    for k in range(0, len(drawing.time), CHUNK):
        part = slice(k, k + CHUNK)
        times = [rr.TimeColumn(TIMELINE, duration=drawing.time[part])]
        for body, position in drawing.positions.items():
            pose = rr.Transform3D.columns(translation=position[part], quaternion=turns[body][part])
            stream.send_columns(f"world/{body}", times, pose)
        for path, points in lines.items():
            strips = rr.LineStrips3D.columns(strips=points[part].astype(np.float32))
            stream.send_columns(f"world/{path}", times, strips)
        stream.flush()


def _extent(drawing: Drawing) -> float:
    """Distance of the farthest body origin or boom tip from the first body, m."""
    origins = np.array([position[0] for position in drawing.positions.values()])
    tips = [boom_points(drawing, boom)[0][0, -1] for boom in drawing.booms]
    return float(np.linalg.norm(np.array([*origins, *tips]) - origins[0], axis=1).max()) or 1.0


def _plumes(stream: Stream, drawing: Drawing, measured: Trajectory) -> None:
    """Exhaust of every jet: against the force, longer at a higher level."""
    for k, jet in enumerate(drawing.jets):
        rows = _changes(measured[jet.channel])
        size = 0.25 * _extent(drawing) * _throttle(measured[jet.channel])[rows]
        size[size == 0] = 1e-6  # a transform must have an inverse
        scale = rr.Transform3D.columns(scale=np.stack([abs(size), abs(size), size], axis=1))
        times = [rr.TimeColumn(TIMELINE, duration=measured.time[rows])]
        for n, (point, force) in enumerate(_nozzles(jet, drawing)):
            path = f"world/{jet.body}/jets/{jet.channel}_{k}_{n}"
            side = np.cross(force, np.eye(3)[np.argmin(np.abs(force))])
            side /= np.linalg.norm(side)
            frame = np.stack([side, np.cross(side, force), -force], axis=1)
            stream.log(path, rr.Transform3D(translation=point, mat3x3=frame), static=True)
            stream.log(f"{path}/plume", _cone(), static=True)
            stream.send_columns(f"{path}/plume", times, scale)


def _nozzles(jet: Jet, drawing: Drawing) -> list[tuple[Array, Array]]:
    """Where a jet blows and the direction of its force; a pure torque is drawn as a pair."""
    if np.any(jet.force):
        return [(jet.position, jet.force / np.linalg.norm(jet.force))]
    axis = jet.torque / np.linalg.norm(jet.torque)
    shapes = [shape for shape in drawing.shapes if shape.body == jet.body]
    reach = max((max(np.abs(s.position)) + max(s.size) for s in shapes), default=1.0)
    arm = reach * np.eye(3)[0 if abs(axis[0]) < 0.9 else 1]
    force = np.cross(axis, arm) / np.linalg.norm(np.cross(axis, arm))
    return [(jet.position + arm, force), (jet.position - arm, -force)]


def _cone(sides: int = 16) -> rr.Mesh3D:
    """A plume of unit length along z, bright at the nozzle and fading."""
    angle = 2 * np.pi * np.arange(sides) / sides
    circle = np.stack([0.13 * np.cos(angle), 0.13 * np.sin(angle), np.ones(sides)], axis=1)
    rim = 1 + np.arange(sides)
    return rr.Mesh3D(
        vertex_positions=np.vstack([np.zeros(3), circle]),
        triangle_indices=np.stack([np.zeros(sides, int), rim, np.roll(rim, -1)], axis=1),
        vertex_colors=np.array([(255, 226, 130, 255)] + sides * [(255, 96, 20, 40)], np.uint8),
    )


def _signals(stream: Stream, flights: Flights, booms: Sequence[str], band: float) -> None:
    """Angles, rates and tips of both plants; the quasi-rigid angle over the accuracy too."""
    predicted, measured = flights
    kinds = ("quasi_rigid_angle", "attitude", "quasi_rigid_rate", "rate")
    rows = [(k, a, f"{k}_{a}", AXES[a], 0) for k in kinds for a in moving_axes(measured, k)]
    rows += [("tips", b, f"{b}_tip_y", BOOMS[k % 3], k) for k, b in enumerate(booms)]
    for view, name, signal, (full, reduced), k in rows:
        # Paths are drawn in the order of their names.  Booms often swing alike: the later ones are
        # thinner, so that all can be seen.
        for flight, plant, end, color, width in (
            (predicted, "reduced", "reduced", reduced, max(4.0 - k, 1.6)),
            (measured, "MuJoCo", "simulated", full, max(2.2 - 0.8 * k, 0.8)),
        ):
            if (value := flight.signals.get(signal)) is None:
                continue
            label = f"{name}, {plant} [{flight.units[signal]}]"
            style = rr.SeriesLines(names=label, colors=color, widths=width)
            _plot(stream, f"{view}/{name}/{end}", flight.time, value, style)
            if band and view == "quasi_rigid_angle":
                style = rr.SeriesLines(names=f"{name}, {plant}", colors=color, widths=width)
                _plot(stream, f"accuracy/{name}/{end}", flight.time, value / band, style)
    for sign in (-1.0, 1.0) if band else ():
        for view, limit, unit in (("quasi_rigid_angle", band, " rad"), ("accuracy", 1.0, "")):
            style = rr.SeriesLines(names=f"±{limit:g}{unit} asked", colors=GREEN, widths=1)
            ends = measured.time[[0, -1]], np.full(2, sign * limit)
            _plot(stream, f"{view}/limit/{'upper' if sign > 0 else 'lower'}", *ends, style)


def _plot(stream: Stream, path: str, time: Array, value: Array, style: rr.SeriesLines) -> None:
    stream.log(path, style, static=True)
    columns = rr.Scalars.columns(scalars=value)
    stream.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time)], columns)


def _thrust(stream: Stream, measured: Trajectory, drawing: Drawing) -> None:
    """Commanded and delivered thrust: as plots and as lanes of states."""
    for channel, unit in channel_units(measured, drawing).items():
        for what, end, color in (("command", "_command", GREY), ("delivered", "", AMBER)):
            value = measured[f"{channel}{end}"]
            time, value = measured.time[_changes(value)], value[_changes(value)]
            _lane(stream, f"relay/{channel}/{what}", time, value, unit)
            label = f"{channel} {what} [{unit}]"
            style = rr.SeriesLines(names=label, colors=color, interpolation_mode="StepAfter")
            time, value = np.append(time, measured.time[-1]), np.append(value, value[-1])
            _plot(stream, f"thrust/{channel}/{what}", time, value, style)


def _lane(stream: Stream, path: str, time: Array, value: Array, unit: str) -> None:
    """The levels as states; a thrust that rises and falls has too many, its sign must do."""
    if len(np.unique(value)) > 16:
        value, unit = np.sign(value), ""
        time, value = time[_changes(value)], value[_changes(value)]
    levels = np.unique(value)
    labels = [f"{v:+.3g} {unit}" if v else "off" for v in levels]
    share = np.abs(_throttle(levels))[:, None]
    bright = np.where(levels[:, None] > 0, PLUS, MINUS)
    colors = (OFF + share * (bright - OFF)).astype(np.uint8)
    stream.log(path, rr.StateConfiguration(values=labels, colors=colors), static=True)
    states = rr.StateChange.columns(state=[labels[k] for k in np.searchsorted(levels, value)])
    stream.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time)], states)


def _phase_plane(stream: Stream, path: str, flights: Flights, start: float) -> None:
    """Angle against rate, each over its largest value: the view has equal axes and y down."""
    axis = next(iter(moving_axes(flights[1], "quasi_rigid_angle")), "")
    names = [f"quasi_rigid_angle_{axis}", f"quasi_rigid_rate_{axis}"]
    if not all(name in flight.signals for flight in flights for name in names):
        return
    tracks = [np.stack([f[name][f.time >= start] for name in names], axis=1) for f in flights]
    largest = np.abs(tracks[1]).max(axis=0, initial=1e-12)
    tracks = [track * (1, -1) / largest for track in tracks]
    cross = [[(-1, 0), (1, 0)], [(0, -1), (0, 1)]]
    stream.log(f"{path}/axes", rr.LineStrips2D(cross, colors=FAINT, radii=-0.7), static=True)
    # A label stands below its point: both points are moved off the curve.
    labels = [f"{largest[0]:.3g} rad", f"{largest[1]:.3g} rad/s"]
    places = rr.Points2D([(1.38, -0.14), (0.4, -1.22)], labels=labels, colors=GREY, radii=-0.1)
    stream.log(f"{path}/scale", places, static=True)
    for track, end, color, width in zip(
        tracks, ("reduced", "simulated"), AXES[axis][::-1], (1.8, 0.7), strict=True
    ):
        line = rr.LineStrips2D([track], colors=color, radii=-width, draw_order=60 - width)
        stream.log(f"{path}/{end}", line, static=True)
    stream.log(f"{path}/now", rr.Points2D.from_fields(colors=WHITE, radii=-5.0), static=True)
    times = [rr.TimeColumn(TIMELINE, duration=flights[1].time[flights[1].time >= start])]
    stream.send_columns(f"{path}/now", times, rr.Points2D.columns(positions=tracks[1]))


def _changes(value: Array) -> Array:
    """Rows at which a signal takes a new value, the first included."""
    return np.flatnonzero(np.r_[True, value[1:] != value[:-1]])


def _throttle(value: Array) -> Array:
    """Signed size from 0 to 1 of a thrust, on a log scale: its levels span decades."""
    on = value[value != 0]
    least, most = (np.abs(on).min(), np.abs(on).max()) if len(on) else (1.0, 1.0)
    share = np.log(np.maximum(np.abs(value), least) / least) / max(np.log(most / least), 1e-9)
    return np.sign(value) * (0.4 + 0.6 * share if most > least else 1.0)


def _events(stream: Stream, measured: Trajectory, drawing: Drawing, verdicts: Verdicts) -> None:
    """Changes of command and thrust, and the instants that decided the verdicts."""
    events = []
    for channel, unit in channel_units(measured, drawing).items():
        for signal, word in ((f"{channel}_command", "command"), (channel, "thrust")):
            for row in _changes(measured[signal]):
                text = f"{channel}: {word} {measured[signal][row]:+.4g} {unit}"
                events.append((measured.time[row], "INFO", text))
    for v in verdicts:
        word = "closest to its bound" if v.holds else "broken" if v.margin < 0 else "not guaranteed"
        text = f"{word}: {v.claim}: {v.measured:.4g} {v.unit}"
        t = measured.time[-1] if v.t_worst is None else v.t_worst
        events.append((t, "DEBUG" if v.holds else "ERROR", text))
    events.sort(key=lambda event: event[0])
    time, level, text = zip(*events, strict=True) if events else ((), (), ())
    columns = rr.TextLog.columns(text=text, level=level)
    stream.send_columns("events", [rr.TimeColumn(TIMELINE, duration=np.array(time))], columns)


def _documents(stream: Stream, verdicts: Verdicts, scenario_toml: str, title: str) -> None:
    head = "|  | claim | predicted | measured | bound | margin | worst at | source |"
    lines = [f"### {title}", head, "|:-:|:--|--:|--:|--:|--:|--:|:--|"]
    for v in verdicts:
        # Words, not marks: the viewer panics on a glyph that its font lacks, as the cross.
        claim = f"{'holds' if v.holds else '**FAILS**'} | {v.claim.replace('|', chr(92) + '|')}"
        expected = "" if v.predicted is None else f"{v.predicted:.4g}"
        bound = f"{'±' if v.kind == 'within' else '≤ '}{v.bound:.3g} {v.unit}"
        worst = "" if v.t_worst is None else f"{v.t_worst:.2f} s"
        figures = f"{expected} | {v.measured:.4g} | {bound} | {100 * v.margin:.3g} % | {worst}"
        lines.append(f"| {claim} | {figures} | {v.source} |")
    if failed := sorted({str(assumption) for v in verdicts for assumption in v.failed}):
        lines += ["", "**Assumptions that do not hold**", "", *(f"- `{text}`" for text in failed)]
    toml = f"```toml\n{scenario_toml.strip()}\n```"
    for path, text in (("verdicts", "\n".join(lines)), ("scenario", toml)):
        stream.log(path, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)


def _blueprint(extent: float, charts: Charts) -> rrb.Blueprint:
    """The layout; only the camera's distance follows the spacecraft, whose size is `extent`, m."""
    boundary = rr.TimeRangeBoundary
    ever = boundary.infinite()
    before, after = (boundary.cursor_relative(seconds=s * NEAR) for s in (-1, 1))
    whole = rrb.TimeAxis(view_range=rr.TimeRange(start=ever, end=ever))
    near = rrb.TimeAxis(view_range=rr.TimeRange(start=before, end=after))

    def plot(origin: str, name: str, time: rrb.TimeAxis = whole, **more) -> rrb.TimeSeriesView:
        look = {"axis_x": time, "plot_legend": rrb.PlotLegend(corner="RightTop"), **more}
        return rrb.TimeSeriesView(origin=origin, name=name, **look)

    def plane(origin: str, name: str) -> rrb.Spatial2DView:
        bounds = rrb.VisualBounds2D(x_range=[-1.4, 1.7], y_range=[-1.3, 1.2])
        return rrb.Spatial2DView(origin=origin, name=name, visual_bounds=bounds, background=NIGHT)

    eye = extent * np.array([0.0, -1.2, 1.5])
    space = rrb.Spatial3DView(
        origin="world",
        name=f"Spacecraft; amber: bending × {EXAGGERATION:g}, grey: unbent",
        background=NIGHT,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(position=eye, look_target=[0, 0, 0], eye_up=[0, 0, 1]),
    )
    columns = rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["LogLevel", "Body"])
    documents = [rrb.TextDocumentView(origin=p, name=p.title()) for p in ("verdicts", "scenario")]
    words = rrb.Tabs(*documents, rrb.TextLogView(origin="events", name="Events", columns=columns))
    unity = rrb.ScalarAxis(range=(-1.5, 1.5))
    histories = rrb.Vertical(
        plot("quasi_rigid_angle", "Quasi-rigid angle [rad]"),
        plot("accuracy", "Quasi-rigid angle / accuracy [-], near the cursor", near, axis_y=unity),
        plot("attitude", "Attitude [rad]"),
        plot("tips", "Boom tips, deflection [m]"),
        rrb.Tabs(
            plot("rate", "Rate [rad/s]"), plot("quasi_rigid_rate", "Quasi-rigid rate [rad/s]")
        ),
    )
    planes = (
        plane("phase/whole", "Phase plane: right = angle/max, up = rate/max"),
        plane("phase/end", "Phase plane of the last minute, scaled likewise"),
    )
    drawn = record_chart.views(charts)
    upper = (rrb.Tabs(*drawn), rrb.Tabs(*planes)) if drawn else planes
    switching = rrb.Vertical(
        *upper,
        plot("thrust", "Thrust, near the cursor", near),
        rrb.StateTimelineView(origin="relay", name="Relay, near the cursor", time_view=near),
        row_shares=[3, 3, 2, 1.4],
    )
    left = rrb.Vertical(space, words, row_shares=[3, 2])
    return rrb.Blueprint(
        rrb.Horizontal(left, histories, switching, column_shares=[4, 4, 3]),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed", play_state="paused", playback_speed=4),
        collapse_panels=True,
    )
