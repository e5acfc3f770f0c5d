"""A flight on one page: film strip, histories, the end of the flight, thrust, verdicts."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.patches import FancyArrowPatch, Polygon, Rectangle
from scipy.spatial import ConvexHull, QhullError

from spacecraft_sim.drawing import Drawing, Jet, Shape
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray

DPI, WIDTH = 100, 18.0  # dots an inch; inches
FRAMES = 6  # of the film strip
INK, SOFT, GRID, PAPER = "#1d2430", "#6b7484", "#e3e7ee", "#ffffff"
FULL, REDUCED = "#1f6fd6", "#f29b38"
PLUS, MINUS, GOOD, BAD = "#d8432f", "#2b6cd4", "#1f8f4d", "#c62828"
BOOMS = ("#1f8f4d", "#8a4fd0", "#c98a00", "#178d99", "#d0437a")
PREFIXES = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def summary(
    path: Path,
    *,
    measured: Trajectory,
    predicted: Trajectory,
    drawing: Drawing,
    verdicts: Sequence[Verdict],
    title: str,
    band: float | None = None,
) -> None:
    """Draws what happened on one page of about 1800 x 1200 pixels.

    Args:
        path: The PNG file.
        measured: Flight of the full plant.
        predicted: Flight of the reduced model.
        drawing: Shapes and motion of the full plant.
        verdicts: What became of the guarantees on the full plant.
        title: One line over the page.
        band: Accuracy that the quasi-rigid angle shall keep, rad; None if none was asked for.
    """
    table = 0.30 * (len(verdicts) + 1)
    heights = [1.9, 2.2, 2.2, max(table, 2.5)]
    gaps, top, bottom = (0.5, 0.82, 0.78), 1.12, 0.5
    height = sum(heights) + sum(gaps) + top + bottom
    figure = Figure(figsize=(WIDTH, height), dpi=DPI, facecolor=PAPER)
    FigureCanvasAgg(figure)
    rows = _rows(heights, gaps, top, height)
    _heading(figure, title, verdicts, height)
    settled = _settled(measured, drawing)
    _film(figure, rows[0], drawing, measured, settled)
    late = _last_cycles(measured)
    for row, start in ((rows[1], None), (rows[2], late)):
        grid = _grid(figure, row, 4, left=0.045, space=0.27)
        flights = _since(measured, start), _since(predicted, start)
        _angle(figure.add_subplot(grid[0]), *flights, band, zoom=start is not None)
        _attitude(figure.add_subplot(grid[1]), *flights, band, zoom=start is not None)
        _tips(figure.add_subplot(grid[2]), *flights, drawing, zoom=start is not None)
        _phase(figure.add_subplot(grid[3]), *flights, band, zoom=start is not None)
    lanes = _grid(figure, rows[3], 2, left=0.012, space=0.13, ratios=(2.0, 1.0))
    _table(figure.add_subplot(lanes[0]), verdicts)
    stacked = lanes[1].subgridspec(2, 1, hspace=0.75)
    until = min(1.3 * settled + 1.0, float(measured.time[-1]))
    _thrust(figure.add_subplot(stacked[0]), measured, drawing, (measured.time[0], until))
    _thrust(figure.add_subplot(stacked[1]), measured, drawing, (late, measured.time[-1]))
    figure.savefig(path)


# -- the page --------------------------------------------------------------------------------------


def _rows(heights, gaps, top: float, height: float) -> list[tuple[float, float]]:
    """Bottom and top of each row, as shares of the page."""
    edges, upper = [], height - top
    for h, gap in zip(heights, (*gaps, 0.0), strict=True):
        edges.append(((upper - h) / height, upper / height))
        upper -= h + gap
    return edges


def _grid(figure: Figure, row, columns: int, *, left: float, space: float, ratios=None) -> GridSpec:
    return figure.add_gridspec(
        1, columns, bottom=row[0], top=row[1], left=left, right=0.988,
        wspace=space, width_ratios=ratios,
    )  # fmt: skip


def _heading(figure: Figure, title: str, verdicts: Sequence[Verdict], height: float) -> None:
    figure.text(0.012, 1 - 0.36 / height, title, size=17, weight="bold", color=INK, va="center")
    kept = sum(v.holds for v in verdicts)
    color = GOOD if kept == len(verdicts) else BAD
    text = f"{kept} of {len(verdicts)} claims hold"
    place = {"ha": "right", "va": "center", "size": 14, "weight": "bold"}
    figure.text(0.988, 1 - 0.36 / height, text, color=color, **place)


def _panel(axes: Axes, title: str, x: str, y: str) -> None:
    axes.set_title(title, size=10.5, color=INK, loc="left", weight="bold", pad=5)
    axes.set_xlabel(x, size=9, color=SOFT, labelpad=2)
    axes.set_ylabel(y, size=9, color=SOFT, labelpad=3)
    axes.tick_params(labelsize=8.5, colors=SOFT, length=3)
    axes.grid(color=GRID, linewidth=0.7)
    axes.set_axisbelow(True)
    for side, spine in axes.spines.items():
        spine.set_visible(side in ("left", "bottom"))
        spine.set_color("#b9c0cc")


def _legend(axes: Axes, place: str = "upper right") -> None:
    axes.legend(loc=place, fontsize=8.5, frameon=True, framealpha=0.85, edgecolor="none",
                handlelength=1.5, borderpad=0.3, labelspacing=0.25)  # fmt: skip


# -- film strip ------------------------------------------------------------------------------------


def _film(figure: Figure, row, drawing: Drawing, measured: Trajectory, settled: float) -> None:
    """The spacecraft from +z at a few instants, its bending exaggerated."""
    instants = [*np.linspace(drawing.time[0], settled, FRAMES - 1), drawing.time[-1]]
    frames = [int(np.argmin(np.abs(drawing.time - t))) for t in instants]
    factor = _exaggeration(drawing, frames)
    root = next(iter(drawing.positions.values()))
    views = [_view(drawing, frame, factor, root[frame]) for frame in frames]
    points = [np.vstack([*solids, *booms, *straight]) for solids, booms, straight in views]
    grid = _grid(figure, row, FRAMES, left=0.012, space=0.03)
    box = grid[0].get_position(figure)
    reach = _window(np.abs(np.vstack(points)).max(axis=0), _shape_of(box, figure))
    for k, (frame, view) in enumerate(zip(frames, views, strict=True)):
        axes = figure.add_subplot(grid[k])
        axes.set_facecolor("#f4f6fa")
        axes.set(xticks=[], yticks=[], xlim=(-reach[0], reach[0]), ylim=(-reach[1], reach[1]))
        for spine in axes.spines.values():
            spine.set_visible(False)
        _craft(axes, drawing, view)
        t = drawing.time[frame]
        now = max(int(np.searchsorted(measured.time, t, side="right")) - 1, 0)
        says = _arrows(axes, drawing, measured, frame, now, reach[0])
        axes.set_title(f"t = {t:.1f} s", loc="left", size=10, weight="bold", color=INK, pad=4)
        axes.set_title(says, loc="right", size=9, color=SOFT, pad=4)
    bent = f"bending drawn × {factor:g}" if factor != 1 else "bending to scale"
    note = f"Seen from +z, {bent}; dashed: booms unbent; arrows: thrust on the spacecraft"
    figure.text(0.012, row[1] + 0.022, note, size=9.5, color=SOFT)


def _shape_of(box, figure: Figure) -> float:
    """Width over height of a place on the page."""
    width, height = figure.get_size_inches()
    return box.width * width / (box.height * height)


def _window(reach: Array, shape: float) -> tuple[float, float]:
    """Half-widths of a view of the given shape, equal in scale, that holds the reach."""
    width = 1.06 * max(reach[0], reach[1] * shape)
    return width, width / shape


def _exaggeration(drawing: Drawing, frames: list[int]) -> float:
    """A round factor that brings the largest deflection to a quarter of the boom."""
    shares = [0.0]
    for boom in drawing.booms:
        for frame in frames:
            bent, straight = _boom(drawing, boom, frame)
            length = np.linalg.norm(straight[-1] - straight[0])
            shares.append(float(np.linalg.norm(bent[-1] - straight[-1]) / length))
    wanted = 1 / 4 / max(max(shares), 1e-4)
    return max((f for f in (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0) if f <= wanted), default=1.0)


def _boom(drawing: Drawing, boom: str, frame: int) -> tuple[Array, Array]:
    """Hinges and tip of a boom, and where they were if it were straight, (n, 3) each, m."""
    bodies = drawing.booms[boom]
    points = np.array([drawing.positions[body][frame] for body in bodies])
    end = points[-1] + _turned(drawing.quaternions[bodies[-1]][frame], drawing.tips[boom])
    points = np.vstack([points, end])
    reach = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))]
    axis = _turned(drawing.quaternions[bodies[0]][frame], np.array([1.0, 0.0, 0.0]))
    return points, points[0] + reach[:, None] * axis


def _view(drawing: Drawing, frame: int, factor: float, centre: Array):
    """Outlines of the solids, bent booms and unbent booms in the x-y plane about the first body."""
    flexible = {body for bodies in drawing.booms.values() for body in bodies}
    solids = [
        _outline(shape, drawing, frame)[:, :2] - centre[:2]
        for shape in sorted(drawing.shapes, key=lambda s: s.position[2])
        if shape.body not in flexible
    ]
    booms, straight = [], []
    for boom in drawing.booms:
        bent, line = _boom(drawing, boom, frame)
        booms.append((line + factor * (bent - line) - centre)[:, :2])
        straight.append((line - centre)[[0, -1], :2])
    return solids, booms, straight


def _outline(shape: Shape, drawing: Drawing, frame: int) -> Array:
    """Points in the world whose hull is the shape, m."""
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    r, h = shape.size[0], shape.size[1]
    ball = np.vstack([np.roll(ring, k, axis=1) for k in range(3)])
    if shape.kind == "box":
        points = shape.size * (np.array(list(np.ndindex(2, 2, 2))) * 2.0 - 1)
    elif shape.kind == "cylinder":
        points = np.vstack([r * ring + (0, 0, z) for z in (-h, h)])
    elif shape.kind == "capsule":
        points = np.vstack([r * ball + (0, 0, z) for z in (-h, h)])
    else:
        points = ball * (shape.size if shape.kind == "ellipsoid" else r)
    local = shape.position + _turned(shape.quaternion, points)
    turned = _turned(drawing.quaternions[shape.body][frame], local)
    return drawing.positions[shape.body][frame] + turned


def _turned(quaternion: Array, vector: Array) -> Array:
    """A vector turned by a (w, x, y, z) quaternion."""
    w, v = quaternion[0], quaternion[1:]
    turn = 2 * np.cross(v, vector)
    return vector + w * turn + np.cross(v, turn)


def _craft(axes: Axes, drawing: Drawing, view) -> None:
    solids, booms, straight = view
    flexible = {body for bodies in drawing.booms.values() for body in bodies}
    shapes = sorted(drawing.shapes, key=lambda s: s.position[2])
    rigid = [shape for shape in shapes if shape.body not in flexible]
    for line in straight:
        axes.plot(*line.T, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
    for k, line in enumerate(booms):
        axes.plot(*line.T, color=BOOMS[k % len(BOOMS)], linewidth=2.4, solid_capstyle="round")
    for shape, points in zip(rigid, solids, strict=True):
        try:
            hull = points[ConvexHull(points).vertices]
        except QhullError:  # seen edge on
            continue
        style = {"facecolor": tuple(shape.rgba[:3]), "edgecolor": INK, "linewidth": 0.7}
        axes.add_patch(Polygon(hull, zorder=3 + shape.position[2], **style))


def _arrows(
    axes: Axes, drawing: Drawing, measured: Trajectory, frame: int, row: int, reach: float
) -> str:
    """Draws the thrust as arrows on the spacecraft; returns it in words."""
    root = next(iter(drawing.positions.values()))[frame]
    for jet in drawing.jets:
        level = measured[jet.channel][row]
        if level == 0:
            continue
        color = PLUS if level > 0 else MINUS
        q, place = drawing.quaternions[jet.body][frame], drawing.positions[jet.body][frame]
        point = (place + _turned(q, jet.position) - root)[:2]
        torque, force = _turned(q, jet.torque)[2], _turned(q, jet.force)[:2]
        if np.linalg.norm(force) > 1e-9:
            end = point + np.sign(level) * force / np.linalg.norm(force) * 0.3 * reach
            ends, bend = (point, end), "arc3"
        elif abs(torque) > 1e-9:
            start, stop = (-50, 50) if torque * level > 0 else (50, -50)
            angles = np.radians([start + 90, stop + 90])
            ends = [point + 0.24 * reach * np.array([np.cos(a), np.sin(a)]) for a in angles]
            bend = f"arc3,rad={0.45 if torque * level > 0 else -0.45}"
        else:
            continue
        arrow = FancyArrowPatch(*ends, connectionstyle=bend, arrowstyle="-|>", mutation_scale=14,
                                color=color, linewidth=2, zorder=6, shrinkA=0, shrinkB=0)  # fmt: skip
        axes.add_patch(arrow)
    thrust = [(name, measured[name][row]) for name in _channels(measured)]
    on = [f"{u:+.3g} {_unit(name, measured, drawing)}" for name, u in thrust if u]
    # More than two do not fit; the lanes below show them all.
    return ", ".join(on) if 0 < len(on) < 3 else f"{len(on)} thrusters on" if on else "thrust off"


# -- histories -------------------------------------------------------------------------------------


def _angle(
    axes: Axes, measured: Trajectory, predicted: Trajectory, band: float | None, *, zoom: bool
) -> None:
    peak, scale = _histories(axes, measured, predicted, "quasi_rigid_angle", band or 0.0)
    _panel(axes, f"Quasi-rigid angle, {_WHEN[zoom]}", "time, s", axes.get_ylabel())
    if band:
        limit = band / scale
        axes.axhspan(-limit, limit, color=GOOD, alpha=0.10, linewidth=0)
        axes.axhline(-limit, color=GOOD, linewidth=1)
        axes.axhline(limit, color=GOOD, linewidth=1, label=f"±{band:g} rad")
        if zoom and peak < 0.4 * limit:
            _level_scale(axes, peak, limit)
    _legend(axes, "center right" if zoom and band else "upper right")


def _level_scale(axes: Axes, peak: float, limit: float) -> None:
    """Linear up to the peak, logarithmic to the limit: cycle and bound on one axis."""
    axes.set_yscale("symlog", linthresh=1.2 * peak, linscale=1.6)
    ticks = [-limit, -peak, 0, peak, limit]
    axes.set_yticks(ticks, [f"{t:.3g}" for t in ticks])
    axes.set_yticks([], minor=True)
    axes.set_ylim(-1.6 * limit, 1.6 * limit)


_WHEN = {False: "whole flight", True: "end of the flight"}


def _attitude(
    axes: Axes, measured: Trajectory, predicted: Trajectory, band: float | None, *, zoom: bool
) -> None:
    _, scale = _histories(axes, measured, predicted, "attitude")
    if zoom and band:
        for side in (-1, 1):
            axes.axhline(side * band / scale, color=GOOD, linewidth=1, linestyle=":")
    _panel(axes, f"Attitude of the bus, {_WHEN[zoom]}", "time, s", axes.get_ylabel())
    _legend(axes)


def _histories(
    axes: Axes, measured: Trajectory, predicted: Trajectory, kind: str, also: float = 0.0
) -> tuple[float, float]:
    """Draws the moving axes of both flights; returns the scaled peak and the scale.

    The unit suits the peak and the value `also`, which is drawn beside it.
    """
    moving = _moving_axes(measured, kind)
    if not moving:
        axes.set_ylabel("not recorded")
        return 0.0, 1.0
    signals = [f"{kind}_{axis}" for axis in moving]
    peak = max(float(np.abs(measured[s]).max(initial=0)) for s in signals)
    scale, unit = _prefixed(max(peak, also), measured.units[signals[0]])
    for k, (axis, signal) in enumerate(zip(moving, signals, strict=True)):
        style = ("-", "--", ":")[k]
        for flight, color, width, plant in (
            (predicted, REDUCED, 3.2, "reduced"),
            (measured, FULL, 1.2, "MuJoCo"),
        ):
            if signal in flight.signals:
                axes.plot(flight.time, flight[signal] / scale, style, color=color,
                          linewidth=width, label=f"{axis}, {plant}")  # fmt: skip
    axes.set_xlim(measured.time[0], measured.time[-1])
    axes.set_ylabel(f"{kind.replace('quasi_', 'quasi-').replace('_', ' ')}, {unit}")
    return peak / scale, scale


def _tips(
    axes: Axes, measured: Trajectory, predicted: Trajectory, drawing: Drawing, *, zoom: bool
) -> None:
    signals = [f"{boom}_tip_y" for boom in drawing.booms if f"{boom}_tip_y" in measured.signals]
    peak = max((float(np.abs(measured[s]).max(initial=0)) for s in signals), default=1.0)
    scale, unit = _prefixed(peak, "m")
    for k, signal in enumerate(signals):
        if signal in predicted.signals:
            axes.plot(predicted.time, predicted[signal] / scale, color=REDUCED,
                      linewidth=3.2, label="reduced" if k == 0 else None)  # fmt: skip
    for k, signal in enumerate(signals):
        # Booms often swing alike: the later ones are thinner, so that all can be seen.
        axes.plot(measured.time, measured[signal] / scale, color=BOOMS[k % len(BOOMS)],
                  linewidth=max(2.2 - 1.2 * k, 0.7), label=signal.removesuffix("_tip_y"))  # fmt: skip
    axes.set_xlim(measured.time[0], measured.time[-1])
    _panel(axes, f"Boom tips, {_WHEN[zoom]}", "time, s", f"tip deflection y, {unit}")
    if signals:
        _legend(axes)


def _phase(
    axes: Axes, measured: Trajectory, predicted: Trajectory, band: float | None, *, zoom: bool
) -> None:
    title = f"Phase plane, {_WHEN[zoom]}"
    moving = _moving_axes(measured, "quasi_rigid_angle")
    names = [
        f"{kind}_{a}" for a in moving[:1] for kind in ("quasi_rigid_angle", "quasi_rigid_rate")
    ]
    if not names or not all(name in measured.signals for name in names):
        _panel(axes, title, "not recorded", "")
        return
    (sx, ux), (sy, uy) = (
        _prefixed(float(np.abs(measured[n]).max(initial=0)), measured.units[n]) for n in names
    )
    for flight, color, width, plant in (
        (predicted, REDUCED, 3.2, "reduced"),
        (measured, FULL, 1.2, "MuJoCo"),
    ):
        if all(name in flight.signals for name in names):
            x, y = (flight[n] / s for n, s in zip(names, (sx, sy), strict=True))
            axes.plot(x, y, color=color, linewidth=width, label=plant)
    if not zoom:
        start = [measured[n][0] / s for n, s in zip(names, (sx, sy), strict=True)]
        axes.plot(*start, "o", color=INK, markersize=4, label="start")
        if band:
            axes.axvspan(-band / sx, band / sx, color=GOOD, alpha=0.25, linewidth=0)
    _panel(
        axes, title, f"quasi-rigid angle {moving[0]}, {ux}", f"quasi-rigid rate {moving[0]}, {uy}"
    )
    axes.margins(0.08)
    _legend(axes)


def _thrust(axes: Axes, measured: Trajectory, drawing: Drawing, span: tuple[float, float]) -> None:
    """A lane for each channel; heights grow with the logarithm of the level."""
    channels = _channels(measured)
    ticks, labels = [], []
    for k, channel in enumerate(channels):
        thrust, command = measured[channel], measured[f"{channel}_command"]
        levels = np.unique(np.abs(thrust[thrust != 0]))
        middle, height = -2.4 * k, _heights(levels)
        y = middle + height(thrust)
        step = {"step": "post", "linewidth": 0, "alpha": 0.55}
        axes.fill_between(measured.time, middle, np.maximum(y, middle), color=PLUS, **step)
        axes.fill_between(measured.time, middle, np.minimum(y, middle), color=MINUS, **step)
        axes.step(measured.time, middle + height(command), where="post", color=INK, linewidth=0.8)
        shown = levels if len(levels) <= 4 and len(channels) == 1 else levels[-1:]
        for level in (*-shown[::-1], 0.0, *shown):
            ticks.append(middle + float(height(np.array([level]))[0]))
            labels.append(f"{level:+.3g}" if level else (channel if len(channels) > 1 else "0"))
    axes.set_yticks(ticks, labels)
    axes.set_xlim(*span)
    units = " or ".join(sorted({_unit(c, measured, drawing) for c in channels}))
    when = "to the end" if span[1] == measured.time[-1] else "from the start"
    words = f"Thrust {when}: filled as delivered, line as commanded"
    _panel(axes, words, "time, s", f"{units}, log levels")


def _heights(levels: Array):
    """Maps thrust to -1 .. 1: zero to zero, the levels evenly in their logarithms."""
    least, most = (levels[0], levels[-1]) if len(levels) else (1.0, 1.0)
    decades = np.log10(most / least)

    def height(thrust: Array) -> Array:
        size = np.abs(thrust)
        grown = (np.log10(np.maximum(size, least) / least) + 1) / (decades + 1)
        return np.sign(thrust) * np.where(size < least, size / least / (decades + 1), grown)

    return height


# -- verdicts --------------------------------------------------------------------------------------

_COLUMNS = ((0.035, "left"), (0.50, "right"), (0.625, "right"), (0.755, "right"), (0.80, "left"),
            (0.91, "right"), (0.995, "right"))  # fmt: skip
_HEADS = ("claim", "predicted", "measured", "bound", "unit", "margin", "worst at")


def _table(axes: Axes, verdicts: Sequence[Verdict]) -> None:
    axes.set_axis_off()
    rows = len(verdicts) + 1
    axes.set(xlim=(0, 1), ylim=(max(rows, 8), 0))
    for (x, side), head in zip(_COLUMNS, _HEADS, strict=True):
        axes.text(x, 0.5, head, ha=side, va="center", size=9, color=SOFT, weight="bold")
    axes.plot([0, 1], [0.95, 0.95], color=INK, linewidth=1)
    for k, v in enumerate(verdicts, start=1):
        color = GOOD if v.holds else BAD
        if k % 2 == 0:
            axes.add_patch(Rectangle((0, k), 1, 1, color="#f4f6fa", linewidth=0, zorder=0))
        axes.add_patch(Rectangle((0, k + 0.12), 0.006, 0.76, color=color, linewidth=0))
        axes.text(0.02, k + 0.5, "✔" if v.holds else "✘", color=color, ha="center", va="center",
                  size=11, family="DejaVu Sans")  # fmt: skip
        for (x, side), text in zip(_COLUMNS, _cells(v), strict=True):
            ink = color if side == "right" and x > 0.9 and x < 0.95 else INK
            axes.text(x, k + 0.5, text, ha=side, va="center", size=9.5, color=ink)


def _cells(v: Verdict) -> tuple[str, ...]:
    claim = v.claim if len(v.claim) <= 52 else v.claim[:51] + "…"
    if v.failed:
        claim += "  (assumptions fail)"
    return (
        claim,
        "" if v.predicted is None else f"{v.predicted:.4g}",
        f"{v.measured:.4g}",
        f"{'±' if v.kind == 'within' else '≤ '}{v.bound:.3g}",
        v.unit,
        f"{100 * v.margin:.1f} %",
        "" if v.t_worst is None else f"{v.t_worst:.1f} s",
    )


# -- reading flights -------------------------------------------------------------------------------


def _since(flight: Trajectory, start: float | None) -> Trajectory:
    """The flight from a time on."""
    if start is None:
        return flight
    rows = flight.time >= start
    signals = {name: value[rows] for name, value in flight.signals.items()}
    return Trajectory(time=flight.time[rows], signals=signals, units=flight.units)


def _settled(measured: Trajectory, drawing: Drawing) -> float:
    """When the quasi-rigid angle is last beyond a twentieth of its peak, s."""
    last = float(drawing.time[-1])
    moving = _moving_axes(measured, "quasi_rigid_angle")
    if not moving:
        return last / 2
    angle = np.abs(measured[f"quasi_rigid_angle_{moving[0]}"])
    beyond = measured.time[angle > 0.05 * angle.max()]
    return min(float(beyond[-1]) if len(beyond) else last / 2, 0.8 * last)


def _last_cycles(measured: Trajectory, cycles: int = 10) -> float:
    """Start of the last few cycles of the thrust, or of the last tenth of the flight, s."""
    end, starts = float(measured.time[-1]), []
    for channel in _channels(measured):
        on = measured[channel] > 0
        rising = measured.time[1:][on[1:] & ~on[:-1]]
        if len(rising) > cycles:
            starts.append(float(rising[-cycles - 1]))
    tenth = end - 0.1 * (end - float(measured.time[0]))
    return max(min(starts, default=tenth), tenth)


def _moving_axes(flight: Trajectory, kind: str) -> list[str]:
    """Axes of a vector signal that move at all, the most moving first."""
    signals = {axis: flight.signals.get(f"{kind}_{axis}") for axis in "xyz"}
    peaks = {a: float(np.abs(x).max(initial=0)) for a, x in signals.items() if x is not None}
    most = max(peaks.values(), default=0.0)
    return sorted((a for a in peaks if peaks[a] >= 1e-3 * most), key=lambda a: -peaks[a])


def _channels(flight: Trajectory) -> list[str]:
    return [name for name in flight.signals if f"{name}_command" in flight.signals]


def _unit(channel: str, flight: Trajectory, drawing: Drawing) -> str:
    """N or N m, where the jets tell which it is."""
    jets: list[Jet] = [jet for jet in drawing.jets if jet.channel == channel]
    return ("N" if np.any(jets[0].force) else "N m") if jets else flight.units[channel]


def _prefixed(peak: float, unit: str) -> tuple[float, str]:
    """A scale that brings the peak above 1, and the unit with its prefix."""
    scale, letter = next(
        (p for p in PREFIXES if peak >= p[0] / 2), PREFIXES[-1] if peak else PREFIXES[0]
    )
    return scale, letter + unit
