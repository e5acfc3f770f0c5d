"""A flight as a recording (.rrd) for the rerun viewer: motion, signals, relays, events, verdicts.

The paths and the layout are the same for every spacecraft, so recordings share one blueprint.
"""

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from spacecraft_sim.drawing import Drawing, Jet, Shape
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray

CHUNK = 250  # frames: the viewer loads and drops whole chunks
TIMELINE = "sim_time"
FINAL = 60.0  # the end of a flight, shown on its own in the phase plane, s

WHITE, GREY, FAINT = (235, 238, 245), (120, 126, 140), (70, 75, 88)
GREEN, AMBER = (98, 205, 132), (255, 200, 87)
PLUS, MINUS, OFF = (240, 98, 74), (74, 144, 240), (44, 47, 56)
MEASURED = {"z": (77, 163, 255), "y": (98, 205, 132), "x": (255, 122, 144)}
PREDICTED = {"z": (255, 170, 64), "y": (228, 216, 92), "x": (214, 130, 255)}
TIPS = ((98, 205, 132), (199, 125, 255), (255, 200, 87), (90, 214, 220), (255, 122, 144))


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
    """
    stream = rr.RecordingStream("spacecraft_sim")
    stream.save(path)
    with stream:  # the file is complete when the block ends
        stream.send_recording_name(title)
        stream.send_blueprint(_blueprint(_extent(drawing)))
        _documents(stream, verdicts, scenario_toml, title)
        _solids(stream, drawing)
        _plumes(stream, drawing, measured)
        _motion(stream, drawing)
        _series(stream, measured, predicted, drawing, band)
        _thrust(stream, measured, drawing)
        _phase_planes(stream, measured, predicted, drawing.time, band)
        _events(stream, measured, drawing, verdicts)
        stream.flush()


# -- the spacecraft --------------------------------------------------------------------------------


def _solids(stream: rr.RecordingStream, drawing: Drawing) -> None:
    """Shapes once, in the frames of their bodies; the unbent line of each boom beside it."""
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for body in drawing.positions:
        shapes = [shape for shape in drawing.shapes if shape.body == body]
        for kind in sorted({shape.kind for shape in shapes}):
            solids = _solid(kind, [shape for shape in shapes if shape.kind == kind])
            stream.log(f"world/{body}/{kind}", solids, static=True)
    for boom, bodies in drawing.booms.items():
        reach = float(np.sum(np.linalg.norm(np.diff(_boom_points(drawing, boom)[0], axis=0), axis=1)))
        unbent = rr.LineStrips3D([[[0, 0, 0], [reach, 0, 0]]], colors=FAINT, radii=-0.7)
        stream.log(f"world/{bodies[0]}/unbent", unbent, static=True)


def _solid(kind: str, shapes: Sequence[Shape]):
    size = np.array([shape.size for shape in shapes])
    centre = np.array([shape.position for shape in shapes])
    w, x, y, z = quaternion = np.array([shape.quaternion for shape in shapes]).T
    common = {
        "quaternions": np.roll(quaternion.T, -1, axis=1),  # (w, x, y, z) -> (x, y, z, w)
        "colors": np.array([shape.rgba for shape in shapes]),
        "fill_mode": "solid",
    }
    if kind == "capsule":
        # A capsule starts at its origin here; MuJoCo's origin is its middle.
        axis = np.stack([2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)], axis=1)
        start = centre - axis * size[:, 1:2]
        return rr.Capsules3D(
            radii=size[:, 0], lengths=2 * size[:, 1], translations=start, **common
        )
    if kind == "cylinder":
        return rr.Cylinders3D(radii=size[:, 0], lengths=2 * size[:, 1], centers=centre, **common)
    if kind == "box":
        return rr.Boxes3D(half_sizes=size, centers=centre, **common)
    half = size if kind == "ellipsoid" else np.repeat(size[:, :1], 3, axis=1)
    return rr.Ellipsoids3D(half_sizes=half, centers=centre, **common)


def _motion(stream: rr.RecordingStream, drawing: Drawing) -> None:
    booms = {boom: _boom_points(drawing, boom).astype(np.float32) for boom in drawing.booms}
    positions = {body: p.astype(np.float32) for body, p in drawing.positions.items()}
    quaternions = {
        body: np.roll(q, -1, axis=1).astype(np.float32) for body, q in drawing.quaternions.items()
    }
    for boom in booms:
        stream.log(f"world/booms/{boom}", rr.LineStrips3D.from_fields(colors=WHITE, radii=-1.6), static=True)
    for part in _chunks(len(drawing.time)):
        times = [rr.TimeColumn(TIMELINE, duration=drawing.time[part])]
        for body in positions:
            columns = rr.Transform3D.columns(
                translation=positions[body][part], quaternion=quaternions[body][part]
            )
            stream.send_columns(f"world/{body}", times, columns)
        for boom, points in booms.items():
            stream.send_columns(
                f"world/booms/{boom}", times, rr.LineStrips3D.columns(strips=points[part])
            )
        stream.flush()


def _boom_points(drawing: Drawing, boom: str) -> Array:
    """Hinges and tip of a boom in the world, shape (n, n_hinges + 2, 3), m."""
    bodies = drawing.booms[boom]
    origin, q = drawing.positions[bodies[-1]], drawing.quaternions[bodies[-1]]
    tip = np.broadcast_to(drawing.tips[boom], origin.shape)
    turn = 2 * np.cross(q[:, 1:], tip)
    end = origin + tip + q[:, :1] * turn + np.cross(q[:, 1:], turn)
    return np.stack([*(drawing.positions[body] for body in bodies), end], axis=1)


def _plumes(stream: rr.RecordingStream, drawing: Drawing, measured: Trajectory) -> None:
    """Exhaust of every jet: against the force, as long as the level is high."""
    length = 0.25 * _extent(drawing)
    for k, jet in enumerate(drawing.jets):
        thrust = measured[jet.channel]
        rows = _changes(thrust)
        size = length * _throttle(thrust)[rows]
        # Not quite zero when the jet is off: a transform must have an inverse.
        size = np.where(np.abs(size) < 1e-6, 1e-6, size)
        scale = np.stack([np.abs(size), np.abs(size), size], axis=1)
        times = [rr.TimeColumn(TIMELINE, duration=measured.time[rows])]
        for n, (point, force) in enumerate(_nozzles(jet, drawing)):
            path = f"world/{jet.body}/jets/{jet.channel}_{k}{n}"
            frame = rr.Transform3D(translation=point, mat3x3=_frame(-force))
            stream.log(path, frame, static=True)
            stream.log(f"{path}/plume", _cone(), static=True)
            stream.send_columns(f"{path}/plume", times, rr.Transform3D.columns(scale=scale))


def _nozzles(jet: Jet, drawing: Drawing) -> list[tuple[Array, Array]]:
    """Where a jet blows and the direction of its force; a pure torque is drawn as a pair."""
    if np.any(jet.force):
        return [(jet.position, jet.force / np.linalg.norm(jet.force))]
    axis = jet.torque / np.linalg.norm(jet.torque)
    ends = [_corners(shape) for shape in drawing.shapes if shape.body == jet.body]
    reach = np.abs(np.vstack(ends) - jet.position).max(axis=0) if ends else np.ones(3)
    arm = np.eye(3)[np.argmax(reach * (1 - np.abs(axis)))] * reach
    force = np.cross(axis, arm / np.linalg.norm(arm))
    return [(jet.position + arm, force), (jet.position - arm, -force)]


def _corners(shape: Shape) -> Array:
    """Corners of the box around a shape, in the body frame, shape (8, 3), m."""
    r, h = shape.size[0], shape.size[1]
    half = {
        "box": shape.size,
        "ellipsoid": shape.size,
        "sphere": np.array([r, r, r]),
        "cylinder": np.array([r, r, h]),
        "capsule": np.array([r, r, h + r]),
    }[shape.kind]
    corners = half * (np.array(list(np.ndindex(2, 2, 2))) * 2 - 1)
    w, v = shape.quaternion[0], shape.quaternion[1:]
    turn = 2 * np.cross(v, corners)
    return shape.position + corners + w * turn + np.cross(v, turn)


def _frame(direction: Array) -> Array:
    """A rotation whose third column is the direction."""
    side = np.cross(direction, np.eye(3)[np.argmin(np.abs(direction))])
    side /= np.linalg.norm(side)
    return np.stack([np.cross(side, direction), side, direction], axis=1)


def _cone(sides: int = 16) -> rr.Mesh3D:
    """A plume of unit length along z, bright at the nozzle and fading."""
    angle = 2 * np.pi * np.arange(sides) / sides
    circle = np.stack([np.cos(angle), np.sin(angle), np.zeros(sides)], axis=1)
    rings = [(0.02, 0.0, (255, 252, 230, 255)), (0.07, 0.35, (255, 190, 70, 190))]
    rings += [(0.12, 1.0, (255, 90, 20, 0))]
    vertices = np.vstack([radius * circle + (0, 0, z) for radius, z, _ in rings])
    colors = np.repeat([rgba for _, _, rgba in rings], sides, axis=0).astype(np.uint8)
    near = np.arange((len(rings) - 1) * sides)
    beside = near - near % sides + (near + 1) % sides
    triangles = np.vstack(
        [np.stack([near, beside, near + sides], 1), np.stack([beside, beside + sides, near + sides], 1)]
    )
    return rr.Mesh3D(vertex_positions=vertices, triangle_indices=triangles, vertex_colors=colors)


# -- signals ---------------------------------------------------------------------------------------


def _series(
    stream: rr.RecordingStream,
    measured: Trajectory,
    predicted: Trajectory,
    drawing: Drawing,
    band: float | None,
) -> None:
    flights = ((predicted, PREDICTED, "reduced", 3.0), (measured, MEASURED, "simulated", 1.5))
    for kind in ("quasi_rigid_angle", "attitude", "quasi_rigid_rate", "rate"):
        for axis in _moving_axes(measured, kind):
            for flight, colors, plant, width in flights:
                signal = f"{kind}_{axis}"
                if signal not in flight.signals:
                    continue
                name = f"{kind.replace('_', ' ')} {axis}, {_PLANT[plant]}"
                unit, values = flight.units[signal], flight[signal]
                style = rr.SeriesLines(names=f"{name} [{unit}]", colors=colors[axis], widths=width)
                _plot(stream, f"{kind}/{axis}/{plant}", flight.time, values, style)
                if band and kind == "quasi_rigid_angle":
                    path = f"accuracy/{axis}/{plant}"
                    style = rr.SeriesLines(names=name, colors=colors[axis], widths=width)
                    _plot(stream, path, flight.time, values / band, style)
    for k, boom in enumerate(drawing.booms):
        for flight, _, plant, width in flights:
            if (signal := f"{boom}_tip_y") in flight.signals:
                color = TIPS[k % len(TIPS)]
                color = color if plant == "simulated" else tuple(c // 2 for c in color)
                name = f"{boom} tip y, {_PLANT[plant]} [{flight.units[signal]}]"
                style = rr.SeriesLines(names=name, colors=color, widths=width)
                _plot(stream, f"tips/{boom}/{plant}", flight.time, flight[signal], style)
    if band:
        _limits(stream, measured, band)


_PLANT = {"simulated": "MuJoCo", "reduced": "reduced model"}


def _limits(stream: rr.RecordingStream, measured: Trajectory, band: float) -> None:
    """The asked accuracy as a pair of lines, in rad and in units of itself."""
    ends = measured.time[[0, -1]]
    for path, limit, name in (
        ("quasi_rigid_angle", band, f"±{band:g} rad asked"),
        ("accuracy", 1.0, f"±1 = {band:g} rad"),
    ):
        for side, sign in (("lower", -1), ("upper", 1)):
            style = rr.SeriesLines(names=name, colors=GREEN, widths=1.0)
            _plot(stream, f"{path}/limit/{side}", ends, np.full(2, sign * limit), style)


def _thrust(stream: rr.RecordingStream, measured: Trajectory, drawing: Drawing) -> None:
    """Commanded and delivered thrust: as plots and as lanes of states."""
    for channel in _channels(measured):
        unit = _unit(channel, measured, drawing)
        for what, signal, color, width in (
            ("command", f"{channel}_command", GREY, 1.0),
            ("delivered", channel, AMBER, 1.8),
        ):
            rows, value = _changes(measured[signal]), measured[signal]
            style = rr.SeriesLines(
                names=f"{channel} {what} [{unit}]",
                colors=color,
                widths=width,
                interpolation_mode="StepAfter",
                aggregation_policy="MinMax",
            )
            ends = np.union1d(rows, len(value) - 1)
            _plot(stream, f"thrust/{channel}/{what}", measured.time[ends], value[ends], style)
            _lane(stream, f"relay/{channel}/{what}", measured.time[rows], value[rows], unit)


def _lane(
    stream: rr.RecordingStream, path: str, time: Array, value: Array, unit: str
) -> None:
    levels = np.unique(value)
    throttle = np.abs(_throttle(levels))
    if len(levels) > 16:  # thrust that rises and falls: its sign says enough
        levels, throttle, value = np.array([-1.0, 0.0, 1.0]), np.ones(3), np.sign(value)
        labels = ["−", "off", "+"]
    else:
        labels = [f"{level:+.3g} {unit}" if level else "off" for level in levels]
    colors = [
        tuple(int(o + (c - o) * t) for o, c in zip(OFF, PLUS if v > 0 else MINUS, strict=True))
        if v
        else OFF
        for v, t in zip(levels, throttle, strict=True)
    ]
    stream.log(path, rr.StateConfiguration(values=labels, colors=colors), static=True)
    states = np.array(labels)[np.searchsorted(levels, value)]
    columns = rr.StateChange.columns(state=states.tolist())
    stream.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time)], columns)


def _plot(stream: rr.RecordingStream, path: str, time: Array, value: Array, style) -> None:
    stream.log(path, style, static=True)
    columns = rr.Scalars.columns(scalars=value)
    stream.send_columns(path, [rr.TimeColumn(TIMELINE, duration=time)], columns)


def _phase_planes(
    stream: rr.RecordingStream,
    measured: Trajectory,
    predicted: Trajectory,
    frames: Array,
    band: float | None,
) -> None:
    """Angle against rate, each over its largest value: the view has equal axes and y down."""
    last = measured.time[-1]
    for plane, start in (("whole", -np.inf), ("end", last - min(FINAL, last / 4))):
        late = measured.time >= start
        axes = _moving_axes(measured, "quasi_rigid_angle")
        if not axes or f"quasi_rigid_rate_{axes[0]}" not in measured.signals:
            return
        axis = axes[0]
        names = f"quasi_rigid_angle_{axis}", f"quasi_rigid_rate_{axis}"
        largest = np.array([np.abs(measured[name][late]).max() or 1.0 for name in names])
        scale = np.array([1.0, -1.0]) / largest
        _phase_axes(stream, plane, largest, band)
        for flight, colors, plant, radius in (
            (predicted, PREDICTED, "reduced", -1.5),
            (measured, MEASURED, "simulated", -0.9),
        ):
            shown = flight.time >= start
            if not all(name in flight.signals for name in names):
                continue
            track = np.stack([flight[name][shown] for name in names], axis=1) * scale
            path = f"phase/{plane}/{plant}"
            line = rr.LineStrips2D([track], colors=colors[axis], radii=radius)
            stream.log(path, line, static=True)
        now = [np.interp(frames, measured.time, measured[name]) for name in names]
        points = (np.stack(now, axis=1) * scale)[frames >= start]
        times = [rr.TimeColumn(TIMELINE, duration=frames[frames >= start])]
        stream.log(f"phase/{plane}/now", rr.Points2D.from_fields(colors=WHITE, radii=-5.0), static=True)
        stream.send_columns(f"phase/{plane}/now", times, rr.Points2D.columns(positions=points))


def _phase_axes(stream: rr.RecordingStream, plane: str, largest: Array, band: float | None) -> None:
    cross = [[[-1.15, 0], [1.15, 0]], [[0, -1.15], [0, 1.15]]]
    stream.log(f"phase/{plane}/axes", rr.LineStrips2D(cross, colors=FAINT, radii=-0.7), static=True)
    labels = [f"{largest[0]:.3g} rad", f"{largest[1]:.3g} rad/s"]
    ends = rr.Points2D([[1, 0], [0, -1]], labels=labels, colors=GREY, radii=-2, show_labels=True)
    stream.log(f"phase/{plane}/scale", ends, static=True)
    if band and band < 1.2 * largest[0]:
        x = band / largest[0]
        sides = rr.LineStrips2D([[[s * x, -1.1], [s * x, 1.1]] for s in (-1, 1)], colors=GREEN)
        stream.log(f"phase/{plane}/accuracy", sides, static=True)


# -- words -----------------------------------------------------------------------------------------


def _events(
    stream: rr.RecordingStream,
    measured: Trajectory,
    drawing: Drawing,
    verdicts: Sequence[Verdict],
) -> None:
    events: list[tuple[float, str, str]] = []
    for channel in _channels(measured):
        unit = _unit(channel, measured, drawing)
        for signal, word in ((f"{channel}_command", "command"), (channel, "thrust")):
            rows = _changes(measured[signal])
            for t, v in zip(measured.time[rows], measured[signal][rows], strict=True):
                events.append((t, rr.TextLogLevel.INFO, f"{channel}: {word} {v:+.4g} {unit}"))
    for v in verdicts:
        if v.t_worst is None and v.holds:
            continue
        t = measured.time[-1] if v.t_worst is None else v.t_worst
        level = rr.TextLogLevel.DEBUG if v.holds else rr.TextLogLevel.ERROR
        word = "closest to its bound" if v.holds else "broken" if v.margin < 0 else "not guaranteed"
        events.append((t, level, f"{word}: {v.claim}: {v.measured:.4g} {v.unit}"))
    events.sort(key=lambda event: event[0])
    if events:
        times, levels, texts = zip(*events, strict=True)
        columns = rr.TextLog.columns(text=texts, level=levels)
        index = [rr.TimeColumn(TIMELINE, duration=np.array(times))]
        stream.send_columns("events", index, columns)


def _documents(
    stream: rr.RecordingStream, verdicts: Sequence[Verdict], scenario_toml: str, title: str
) -> None:
    lines = [
        f"# {title}",
        "|  | claim | predicted | measured | bound | margin | at |",
        "|:-:|:--|--:|--:|--:|--:|--:|",
    ]
    for v in verdicts:
        mark = "✔" if v.holds else "✘"
        predicted = "" if v.predicted is None else f"{v.predicted:.4g}"
        bound = f"{'±' if v.kind == 'within' else '≤ '}{v.bound:.3g}"
        at = "" if v.t_worst is None else f"{v.t_worst:.2f} s"
        claim = v.claim.replace("|", "\\|")
        lines.append(
            f"| {mark} | {claim} | {predicted} | {v.measured:.4g} | {bound} {v.unit} "
            f"| {100 * v.margin:.3g} % | {at} |"
        )
    failed = {str(a): v.source for v in verdicts for a in v.failed}
    if failed:
        lines += ["", "**Assumptions that do not hold**", ""]
        lines += [f"- {text.replace('|', chr(92) + '|')} ({source})" for text, source in failed.items()]
    lines += ["", "**Sources**", ""]
    lines += [f"- {v.claim.replace('|', chr(92) + '|')}: {v.source}" for v in verdicts]
    markdown = rr.MediaType.MARKDOWN
    stream.log("verdicts", rr.TextDocument("\n".join(lines), media_type=markdown), static=True)
    toml = f"```toml\n{scenario_toml.strip()}\n```"
    stream.log("scenario", rr.TextDocument(toml, media_type=markdown), static=True)


# -- what recordings have in common ----------------------------------------------------------------


def _chunks(n: int) -> Iterator[slice]:
    return (slice(k, k + CHUNK) for k in range(0, n, CHUNK))


def _changes(value: Array) -> Array:
    """Rows at which a signal takes a new value, the first included."""
    return np.flatnonzero(np.r_[True, value[1:] != value[:-1]])


def _throttle(value: Array) -> Array:
    """Signed size from 0 to 1 of a thrust, on a log scale: its levels span decades."""
    magnitude = np.abs(value)
    on = magnitude > 0
    if not on.any():
        return np.zeros_like(value)
    least, most = magnitude[on].min(), magnitude.max()
    decades = max(np.log(most / least), 1e-9)
    grown = 0.4 + 0.6 * np.log(np.where(on, magnitude, least) / least) / decades
    return np.sign(value) * (np.where(on, grown, 0.0) if most > least else 1.0)


def _moving_axes(flight: Trajectory, kind: str) -> list[str]:
    """Axes of a vector signal that move at all, the most moving first."""
    signals = {axis: flight.signals.get(f"{kind}_{axis}") for axis in "xyz"}
    peaks = {axis: float(np.abs(x).max()) for axis, x in signals.items() if x is not None}
    most = max(peaks.values(), default=0.0)
    return sorted((a for a in peaks if peaks[a] >= 1e-3 * most), key=lambda a: -peaks[a])


def _channels(flight: Trajectory) -> list[str]:
    return [name for name in flight.signals if f"{name}_command" in flight.signals]


def _unit(channel: str, flight: Trajectory, drawing: Drawing) -> str:
    """N or N m, where the jets tell which it is."""
    forces = [bool(np.any(jet.force)) for jet in drawing.jets if jet.channel == channel]
    return ("N" if forces[0] else "N m") if forces else flight.units[channel]


def _extent(drawing: Drawing) -> float:
    """Distance of the farthest body origin or boom tip from the first body, m."""
    centre = next(iter(drawing.positions.values()))[0]
    points = [p[0] for p in drawing.positions.values()]
    points += [_boom_points(drawing, boom)[0, -1] for boom in drawing.booms]
    return float(np.linalg.norm(np.array(points) - centre, axis=1).max()) or 1.0


def _blueprint(extent: float) -> rrb.Blueprint:
    """The layout; only the camera's distance follows the spacecraft.

    Args:
        extent: Distance of the farthest point of the spacecraft from its bus, m.
    """
    linked = rrb.TimeAxis(link="LinkToGlobal")
    above = np.array([0.0, -0.9, 1.1]) * extent
    space = rrb.Spatial3DView(
        origin="world",
        name="Spacecraft: plumes as delivered, thin line = boom unbent",
        background=[13, 15, 22],
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            position=above, look_target=[0, 0, 0], eye_up=[0, 0, 1], kind="Orbital"
        ),
    )

    def plot(origin: str, name: str, span: tuple[float, float] | None = None):
        axis = rrb.ScalarAxis(range=span) if span else None
        legend = rrb.PlotLegend(corner="RightTop")
        return rrb.TimeSeriesView(
            origin=origin, name=name, axis_x=linked, axis_y=axis, plot_legend=legend
        )

    def plane(origin: str, name: str):
        bounds = rrb.VisualBounds2D(x_range=[-1.3, 1.3], y_range=[-1.3, 1.3])
        return rrb.Spatial2DView(
            origin=origin, name=name, visual_bounds=bounds, background=[13, 15, 22]
        )

    words = rrb.Tabs(
        rrb.TextDocumentView(origin="verdicts", name="Verdicts"),
        rrb.TextLogView(
            origin="events",
            name="Events",
            columns=rrb.TextLogColumns(
                timeline_columns=[TIMELINE], text_log_columns=["LogLevel", "Body"]
            ),
        ),
        rrb.TextDocumentView(origin="scenario", name="Scenario"),
    )
    return rrb.Blueprint(
        rrb.Horizontal(
            rrb.Vertical(space, words, row_shares=[3, 2]),
            rrb.Vertical(
                plot("quasi_rigid_angle", "Quasi-rigid angle [rad]"),
                plot("accuracy", "Quasi-rigid angle over the accuracy asked [-]", (-2.0, 2.0)),
                plot("attitude", "Attitude [rad]"),
                plot("tips", "Boom tips, deflection [m]"),
                rrb.Tabs(
                    plot("rate", "Rate [rad/s]"), plot("quasi_rigid_rate", "Quasi-rigid rate [rad/s]")
                ),
            ),
            rrb.Vertical(
                rrb.Tabs(
                    plane("phase/whole", "Phase plane: right = angle/max, up = rate/max"),
                    plane("phase/end", "The same, last minute"),
                ),
                plot("thrust", "Thrust"),
                rrb.StateTimelineView(origin="relay", name="Relay", time_view=linked),
                row_shares=[3, 2, 1],
            ),
            column_shares=[4, 4, 3],
        ),
        rrb.TimePanel(timeline=TIMELINE, state="collapsed", play_state="paused", playback_speed=4.0),
        rrb.BlueprintPanel(state="hidden"),
        rrb.SelectionPanel(state="hidden"),
    )
