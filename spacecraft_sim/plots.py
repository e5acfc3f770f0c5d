"""A flight on one page: film strip, histories, the end of the flight, thrust, verdicts."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from matplotlib.patches import FancyArrowPatch, Polygon, Rectangle

from spacecraft_sim.drawing import Drawing, Shape, boom_points, channel_units, turned
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.trajectory import Trajectory, moving_axes

Array = np.ndarray
Flights = tuple[Trajectory, Trajectory]  # of the reduced model and of the full plant

WIDTH, DPI, FRAMES = 18.0, 100, 6  # inches, dots an inch, pictures in the film strip
INK, SOFT, SHADE = "#1d2430", "#6b7484", "#f4f6fa"
PLANTS = (("reduced", "#f29b38", 3.2), ("MuJoCo", "#1f6fd6", 1.2))  # the thin over the wide line
PLUS, MINUS, GOOD, BAD = "#d8432f", "#2b6cd4", "#1f8f4d", "#c62828"
BOOMS = ("#1f8f4d", "#8a4fd0", "#c98a00", "#178d99", "#d0437a")
COLUMNS = {"claim": 0.035, "predicted": 0.5, "measured": 0.625, "bound": 0.755}
COLUMNS |= {"unit": 0.80, "margin": 0.91, "worst at": 0.995}
WHEN = ("whole flight", "end of the flight")


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
    heights = [1.9, 2.2, 2.2, max(0.3 * (len(verdicts) + 1), 2.5)]
    edges = np.cumsum([1.12, heights[0], 0.5, heights[1], 0.82, heights[2], 0.78, heights[3]])
    height = edges[-1] + 0.5
    figure = Figure(figsize=(WIDTH, height), dpi=DPI)
    FigureCanvasAgg(figure)  # the figure keeps it
    rows = 1 - edges.reshape(4, 2) / height  # top and bottom of each, as shares of the page
    _heading(figure, title, verdicts, 1 - 0.36 / height)
    end = float(measured.time[-1])
    late = min(_last_cycles(measured), float(measured.time[-min(20, len(measured.time))]))
    _film(figure, _grid(figure, rows[0], FRAMES, 0.012, 0.03), drawing, measured)
    for row, zoom in ((rows[1], False), (rows[2], True)):
        start = late if zoom else measured.time[0]
        flights = _since(predicted, start), _since(measured, start)
        panels = [figure.add_subplot(cell) for cell in _grid(figure, row, 4, 0.045, 0.27)]
        _angle(panels[0], flights, band or 0.0, zoom)
        _attitude(panels[1], flights, band or 0.0, zoom)
        _tips(panels[2], flights, tuple(drawing.booms), zoom)
        _phase_plane(panels[3], flights, band or 0.0, zoom)
    table, thrust = _grid(figure, rows[3], 2, 0.012, 0.13, (2, 1))
    _table(figure.add_subplot(table), verdicts)
    lanes = thrust.subgridspec(2, 1, hspace=0.75)
    for k, span in enumerate(((0.0, min(1.3 * _settled(measured) + 1, end)), (late, end))):
        _thrust(figure.add_subplot(lanes[k]), measured, drawing, span)
    figure.savefig(path, pil_kwargs={"compress_level": 3})


def _grid(
    figure: Figure, row: Array, columns: int, left: float, space: float, widths=None
) -> GridSpec:
    place = {"top": row[0], "bottom": row[1], "left": left, "right": 0.988, "wspace": space}
    return figure.add_gridspec(1, columns, width_ratios=widths, **place)


def _heading(figure: Figure, title: str, verdicts: Sequence[Verdict], y: float) -> None:
    figure.text(0.012, y, title, size=17, weight="bold", color=INK, va="center")
    kept, color = sum(v.holds for v in verdicts), GOOD if all(v.holds for v in verdicts) else BAD
    style = {"size": 14, "weight": "bold", "ha": "right", "va": "center", "color": color}
    figure.text(0.988, y, f"{kept} of {len(verdicts)} claims hold", **style)


def panel(axes: Axes, title: str, x: str, y: str, middle: bool = False) -> None:
    """Gives axes the look of this house.

    Args:
        axes: The axes.
        title: What they show.
        x: Label of the x axis.
        y: Label of the y axis.
        middle: Whether the key, if there is one, stands in the middle.
    """
    axes.set_title(title, size=10.5, color=INK, loc="left", y=1.0, weight="bold", pad=5)
    axes.set_xlabel(x, size=9, color=SOFT, labelpad=2)
    axes.set_ylabel(y, size=9, color=SOFT, labelpad=3)
    axes.tick_params(labelsize=8.5, colors=SOFT, length=3)
    axes.grid(color="#e3e7ee", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color("#b9c0cc")
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="center" if middle else "upper right", fontsize=8.5, edgecolor="none")


def _film(figure: Figure, grid: GridSpec, drawing: Drawing, measured: Trajectory) -> None:
    """The spacecraft from +z at a few instants, its bending exaggerated."""
    instants = [*np.linspace(drawing.time[0], _settled(measured), FRAMES - 1), drawing.time[-1]]
    frames = [int(np.argmin(np.abs(drawing.time - t))) for t in instants]
    factor = _exaggeration(drawing, frames)
    strip = [figure.add_subplot(cell) for cell in grid]
    for axes, frame in zip(strip, frames, strict=True):
        axes.set(xticks=[], yticks=[], facecolor=SHADE)
        axes.spines[:].set_visible(False)
        _craft(axes, drawing, frame, factor)
        row = int(np.searchsorted(measured.time, drawing.time[frame], side="right")) - 1
        thrust = _arrows(axes, drawing, measured, frame, row)
        axes.set_title(
            f"t = {drawing.time[frame]:.1f} s", loc="left", y=1.0, size=10, weight="bold", pad=4
        )
        axes.set_title(thrust, loc="right", y=1.0, size=9, color=SOFT, pad=4)
    # Every frame shows the same window, with equal scales.
    reach = np.max([np.abs(axes.dataLim.get_points()).max(axis=0) for axes in strip], axis=0)
    box = strip[0].get_window_extent()
    width = 1.06 * max(reach[0], reach[1] * box.width / box.height)
    height = width * box.height / box.width
    for axes in strip:
        axes.set(xlim=(-width, width), ylim=(-height, height))
    note = f"Seen from +z; bending drawn × {factor:g}, dashed: unbent; arrows: thrust on the craft"
    strip[0].text(0, 1.15, note, transform=strip[0].transAxes, size=9.5, color=SOFT)


def _exaggeration(drawing: Drawing, frames: Sequence[int]) -> float:
    """A round factor that brings the largest deflection to about a quarter of its boom."""
    largest = 1e-4 if drawing.booms else 1.0
    for bent, straight in (_boom(drawing, boom, k) for boom in drawing.booms for k in frames):
        length = np.linalg.norm(straight[-1] - straight[0])
        largest = max(largest, float(np.linalg.norm(bent[-1] - straight[-1]) / length))
    return max(f for f in (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0) if f == 1 or f < 0.3 / largest)


def _boom(drawing: Drawing, boom: str, frame: int) -> tuple[Array, Array]:
    """Hinges and tip of a boom, and where they were without bending, (n, 3) each, m."""
    bent, straight = boom_points(drawing, boom)
    return bent[frame], straight[frame]


def _craft(axes: Axes, drawing: Drawing, frame: int, factor: float) -> None:
    """Bent booms as lines, all other bodies as outlines, about the first body."""
    centre = next(iter(drawing.positions.values()))[frame]
    for k, boom in enumerate(drawing.booms):
        bent, straight = _boom(drawing, boom, frame)
        line = straight + factor * (bent - straight) - centre
        axes.plot(*(straight - centre)[:, :2].T, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
        axes.plot(*line[:, :2].T, color=BOOMS[k % len(BOOMS)], linewidth=2.4)
    flexible = {body for bodies in drawing.booms.values() for body in bodies}
    for shape in drawing.shapes:
        if shape.body in flexible:
            continue
        place, turn = drawing.positions[shape.body][frame], drawing.quaternions[shape.body][frame]
        points = place + turned(turn, shape.position + turned(shape.quaternion, _surface(shape)))
        hull = (points - centre)[_outline(points), :2]
        style = {"facecolor": shape.rgba[:3], "edgecolor": INK, "linewidth": 0.7}
        axes.add_patch(Polygon(hull, zorder=3 + points[:, 2].max(), **style))


def _outline(points: Array) -> Array:
    """Indices of the points furthest out in x, y when looked for all the way round, every 2 deg."""
    angle = np.linspace(0, 2 * np.pi, 180, endpoint=False)
    furthest = np.argmax(points[:, :2] @ np.stack([np.cos(angle), np.sin(angle)]), axis=0)
    return furthest[np.r_[True, np.diff(furthest) != 0]]


def _surface(shape: Shape) -> Array:
    """Points in the shape's own frame whose hull is the shape, m."""
    if shape.kind == "box":
        return shape.size * (np.array(list(np.ndindex(2, 2, 2))) * 2.0 - 1)
    angle = np.linspace(0, 2 * np.pi, 24, endpoint=False)
    ring = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    ball = np.vstack([np.roll(ring, k, axis=1) for k in range(3)])
    if shape.kind == "ellipsoid":
        return shape.size * ball
    radius, length = shape.size[0], 0.0 if shape.kind == "sphere" else shape.size[1]
    end = radius * (ring if shape.kind == "cylinder" else ball)
    return np.vstack([end + np.array([0, 0, z]) for z in (-length, length)])


def _arrows(axes: Axes, drawing: Drawing, measured: Trajectory, frame: int, row: int) -> str:
    """Draws the thrust as arrows, an arc for a torque; returns its figures."""
    centre = next(iter(drawing.positions.values()))[frame]
    size = np.abs(axes.dataLim.get_points()).max() * 0.28
    for jet in drawing.jets:
        level = np.sign(measured[jet.channel][row])
        turn = drawing.quaternions[jet.body][frame]
        place = drawing.positions[jet.body][frame] + turned(turn, jet.position) - centre
        force, torque = turned(turn, jet.force)[:2] * level, turned(turn, jet.torque)[2] * level
        style = {"color": PLUS if level > 0 else MINUS, "linewidth": 2, "zorder": 99}
        style |= {"arrowstyle": "-|>", "mutation_scale": 14, "shrinkA": 0, "shrinkB": 0}
        if np.linalg.norm(force) > 1e-9:
            end = place[:2] + size * force / np.linalg.norm(force)
            axes.add_patch(FancyArrowPatch(place[:2], end, **style))
        elif abs(torque) > 1e-9:
            way = np.sign(torque)
            ends = [place[:2] + size * np.array([0.75 * way * x, 0.65]) for x in (1, -1)]
            style["connectionstyle"] = f"arc3,rad={0.45 * way}"
            axes.add_patch(FancyArrowPatch(*ends, **style))
    channels = channel_units(measured, drawing)
    on = [f"{measured[c][row]:+.3g} {unit}" for c, unit in channels.items() if measured[c][row]]
    return ", ".join(on) if 0 < len(on) < 3 else f"{len(on)} thrusters on" if on else "thrust off"


def _angle(axes: Axes, flights: Flights, band: float, zoom: bool) -> None:
    peak, scale, unit = _histories(axes, flights, "quasi_rigid_angle", band)
    label = f"quasi-rigid angle, {unit}"
    if band:
        limit = band / scale
        axes.axhspan(-limit, limit, color=GOOD, alpha=0.10, linewidth=0)
        axes.hlines([-limit, limit], *axes.get_xlim(), color=GOOD, label=f"±{band:g} rad")
        if zoom and 0 < peak < 0.4 * limit:
            # Linear up to the peak, logarithmic to the limit: cycle and bound on one axis.
            axes.set_yscale("symlog", linthresh=1.2 * peak, linscale=1.0)
            axes.set_yticks(ticks := [-limit, -peak, 0, peak, limit], [f"{t:.3g}" for t in ticks])
            axes.set_yticks([], minor=True)
            axes.set_ylim(-1.6 * limit, 25 * limit)  # room for the legend
            label = f"{unit}, log beyond the peak"
    panel(axes, f"Quasi-rigid angle, {WHEN[zoom]}", "time, s", label)


def _attitude(axes: Axes, flights: Flights, band: float, zoom: bool) -> None:
    peak, scale, unit = _histories(axes, flights, "attitude")
    if zoom:
        for limit in (-band / scale, band / scale):
            axes.axhline(limit, color=GOOD, linewidth=1, linestyle=":")
        axes.set_ylim(top=1.8 * max(peak, band / scale))  # room for the legend
    panel(axes, f"Attitude of the bus, {WHEN[zoom]}", "time, s", f"attitude, {unit}")


def _histories(
    axes: Axes, flights: Flights, kind: str, also: float = 0.0
) -> tuple[float, float, str]:
    """Draws the moving axes; returns their peak and a unit that suits it and `also`, with name."""
    moving = moving_axes(flights[1], kind)
    peak = max((_peak(flights[1][f"{kind}_{axis}"]) for axis in moving), default=0.0)
    scale, letter = prefix(max(peak, also))
    for axis, dashes in zip(moving, ("-", "--", ":"), strict=False):
        for flight, (plant, color, width) in zip(flights, PLANTS, strict=True):
            if (value := flight.signals.get(f"{kind}_{axis}")) is not None:
                look = {"color": color, "linewidth": width, "linestyle": dashes}
                axes.plot(flight.time, value / scale, label=f"{axis}, {plant}", **look)
    axes.set_xlim(flights[1].time[0], flights[1].time[-1])
    return peak / scale, scale, f"{letter}rad"


def _tips(axes: Axes, flights: Flights, booms: Sequence[str], zoom: bool) -> None:
    signals = [s for s in (f"{boom}_tip_y" for boom in booms) if s in flights[1].signals]
    scale, letter = prefix(max((_peak(flights[1][s]) for s in signals), default=0.0))
    for k, signal in enumerate(s for s in signals if s in flights[0].signals):
        label, value = None if k else "reduced", flights[0][signal] / scale
        axes.plot(flights[0].time, value, color=PLANTS[0][1], linewidth=3.2, label=label)
    for k, signal in enumerate(signals):
        # Booms often swing alike: the later ones are thinner, so that all can be seen.
        width, value = max(2.2 - 1.2 * k, 0.8), flights[1][signal] / scale
        axes.plot(flights[1].time, value, color=BOOMS[k % 5], linewidth=width, label=signal[:-6])
    axes.set_xlim(flights[1].time[0], flights[1].time[-1])
    panel(axes, f"Boom tips, {WHEN[zoom]}", "time, s", f"tip deflection y, {letter}m")


def _phase_plane(axes: Axes, flights: Flights, band: float, zoom: bool) -> None:
    axis = next(iter(moving_axes(flights[1], "quasi_rigid_angle")), "")
    x, y = f"quasi_rigid_angle_{axis}", f"quasi_rigid_rate_{axis}"
    if not all(signal in flights[1].signals for signal in (x, y)):
        return panel(axes, f"Phase plane, {WHEN[zoom]}", "not recorded", "")
    (sx, px), (sy, py) = prefix(_peak(flights[1][x])), prefix(_peak(flights[1][y]))
    for flight, (plant, color, width) in zip(flights, PLANTS, strict=True):
        if x in flight.signals and y in flight.signals:
            axes.plot(flight[x] / sx, flight[y] / sy, color=color, linewidth=width, label=plant)
    if not zoom:
        x0, y0 = flights[1][x][0] / sx, flights[1][y][0] / sy
        axes.plot(x0, y0, "o", color=INK, markersize=4, label="start")
        axes.axvspan(-band / sx, band / sx, color=GOOD, alpha=0.25, linewidth=0)
    labels = f"quasi-rigid angle {axis}, {px}rad", f"quasi-rigid rate {axis}, {py}rad/s"
    return panel(axes, f"Phase plane, {WHEN[zoom]}", *labels, middle=zoom)


def _thrust(axes: Axes, measured: Trajectory, drawing: Drawing, span: tuple[float, float]) -> None:
    """A lane for each channel, on a logarithmic scale of the levels of both signs."""
    channels, ticks = channel_units(measured, drawing), {}
    for k, channel in enumerate(channels):
        levels = np.unique(np.abs(measured[channel][measured[channel] != 0]))
        height, middle = _log_heights(levels), -2.4 * k
        delivered = middle + height(measured[channel])
        for edge, color in ((np.maximum, PLUS), (np.minimum, MINUS)):
            style = {"step": "post", "color": color, "alpha": 0.55, "linewidth": 0}
            axes.fill_between(measured.time, middle, edge(delivered, middle), **style)
        command = middle + height(measured[f"{channel}_command"])
        axes.step(measured.time, command, where="post", color=INK, linewidth=0.8)
        few = levels if len(channels) == 1 and len(levels) < 5 else levels[-1:]
        for level in [*few, *-few] if len(channels) == 1 else []:
            ticks[middle + float(height(level))] = f"{level:+.3g}"
        ticks[middle] = "0" if len(channels) == 1 else f"{channel}  ±{max(few, default=0):.3g}"
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.set_xlim(*span)
    when, unit = "to the end" if span[0] else "from the start", set(channels.values())
    words = f"Thrust {when}: filled as delivered, line as commanded"
    panel(axes, words, "time, s", f"{' or '.join(sorted(unit))}, log levels")


def _log_heights(levels: Array) -> Callable[[Array], Array]:
    """Maps thrust to -1 .. 1, zero to zero and the levels evenly in their logarithms."""
    least, most = (levels[0], levels[-1]) if len(levels) else (1.0, 1.0)

    def height(thrust: Array) -> Array:
        size = np.abs(thrust) / least
        above = 1 + np.log10(np.maximum(size, 1.0))
        return np.sign(thrust) * np.where(size < 1, size, above) / (1 + np.log10(most / least))

    return height


def _table(axes: Axes, verdicts: Sequence[Verdict]) -> None:
    axes.set_axis_off()
    axes.set(xlim=(0, 1), ylim=(max(len(verdicts) + 1, 8), 0))
    axes.plot([0, 1], [0.95, 0.95], color=INK, linewidth=1)
    for head, x in COLUMNS.items():
        side = "left" if head in ("claim", "unit") else "right"
        axes.text(x, 0.5, head, ha=side, va="center", size=9, color=SOFT, weight="bold")
        for k, v in enumerate(verdicts, start=1):
            color = INK if head != "margin" else GOOD if v.holds else BAD
            axes.text(x, k + 0.5, _cell(v, head), ha=side, va="center", size=9.5, color=color)
    for k, v in enumerate(verdicts, start=1):
        color, mark = (GOOD, "✔") if v.holds else (BAD, "✘")
        axes.add_patch(Rectangle((0, k + 0.1), 0.006, 0.8, color=color, linewidth=0))
        axes.text(0.02, k + 0.5, mark, color=color, ha="center", va="center", size=11)
        if k % 2 == 0:
            axes.add_patch(Rectangle((0, k), 1, 1, color=SHADE, linewidth=0, zorder=0))


def _cell(v: Verdict, head: str) -> str:
    if head == "claim":
        claim = f"not guaranteed: {v.claim}" if v.failed else v.claim
        return claim if len(claim) <= 50 else f"{claim[:49]}…"
    if head == "predicted":
        return "" if v.predicted is None else f"{v.predicted:.4g}"
    if head == "worst at":
        return "" if v.t_worst is None else f"{v.t_worst:.1f} s"
    bound = f"{'±' if v.kind == 'within' else '≤ '}{v.bound:.3g}"
    margin = f"{100 * v.margin:.1f} %"
    return {"measured": f"{v.measured:.4g}", "bound": bound, "unit": v.unit, "margin": margin}[head]


def _since(flight: Trajectory, start: float) -> Trajectory:
    late = flight.time >= start
    signals = {name: value[late] for name, value in flight.signals.items()}
    return Trajectory(time=flight.time[late], signals=signals, units=flight.units)


def _settled(measured: Trajectory) -> float:
    """When the quasi-rigid angle is last beyond a twentieth of its peak, s."""
    last, times = float(measured.time[-1]), [0.0]
    for axis in moving_axes(measured, "quasi_rigid_angle")[:1]:
        angle = np.abs(measured[f"quasi_rigid_angle_{axis}"])
        times += measured.time[angle > 0.05 * angle.max()].tolist()
    return min(times[-1] or last / 2, 0.8 * last)


def _last_cycles(measured: Trajectory, cycles: int = 10) -> float:
    """Start of the last few cycles of the thrust, at most the last tenth of the flight, s."""
    starts = [0.9 * float(measured.time[-1])]
    for channel in (s.removesuffix("_command") for s in measured.signals if "_command" in s):
        on = measured[channel] > 0
        starts += measured.time[1:][on[1:] & ~on[:-1]][-cycles - 1 : -cycles].tolist()
    return max(starts)


def _peak(value: Array) -> float:
    return float(np.abs(value).max(initial=0.0))


def prefix(peak: float) -> tuple[float, str]:
    """Returns a scale that brings the peak above one half, and the prefix of the unit.

    Args:
        peak: The largest value, in the unit itself.
    """
    prefixes = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))
    return next((p for p in prefixes if peak >= p[0] / 2), prefixes[0])
