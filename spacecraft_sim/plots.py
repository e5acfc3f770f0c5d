"""A flight on one page: film strip, histories, the end of the flight, thrust, verdicts."""

import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec, GridSpecBase
from matplotlib.lines import Line2D

from spacecraft_sim import spans
from spacecraft_sim.drawing import Drawing
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.plots_film import BOOMS, INK, MINUS, PLUS, SOFT, film
from spacecraft_sim.plots_panel import AXES, DPI, panel, prefix, time_axis
from spacecraft_sim.plots_table import BAD, GOOD, ROW, table
from spacecraft_sim.trajectory import Trajectory, between_rows, channel_units, moving_axes

Array = np.ndarray
Flights = tuple[Trajectory, Trajectory]  # of the reduced model and of the full plant

WIDTH, FRAMES = 18.0, 6  # inches, pictures in the film strip
Plants = tuple[tuple[str, str, float], ...]  # name, colour and width of the lines of each
PLANTS: Plants = (("reduced", "#f29b38", 3.2), ("MuJoCo", "#1f6fd6", 1.2))  # thin over wide
SMOOTH: Plants = (("reduced: wide and pale", "#c3c9d4", 5.0), ("MuJoCo", INK, 1.2))  # many colours
STAGGER = (0.15, 0.19)  # shares of a panel between names of its own bounds, and of the others
REST = 1e-9  # share of the angle, and rad/s, that count as no motion
FEW = 3000  # rows of a track that is drawn between them too
DENSE = 160  # commands in a panel that would hide what they cross


def summary(
    path: Path,
    *,
    measured: Trajectory,
    predicted: Trajectory,
    drawing: Drawing,
    verdicts: Sequence[Verdict],
    title: str,
    bands: Mapping[str, float] | None = None,
    histories: Sequence[Callable[[Axes, Flights, bool], None]] | None = None,
    law: Sequence[Callable[[Axes, Flights], None]] = (),
) -> None:
    """Draws what happened on one page of about 1800 x 1200 pixels.

    Args:
        path: The PNG file.
        measured: Flight of the full plant.
        predicted: Flight of the reduced model.
        drawing: Shapes and motion of the full plant.
        verdicts: What became of the guarantees on the full plant.
        title: One line over the page.
        bands: Half-widths that signals are to keep, by signal, rad; none if left out.
        histories: Four panels in place of those of the quasi-rigid motion.
        law: Panels that the law asks for, in place of those of the end of the flight.
    """
    channels, bands = channel_units(measured), bands or {}
    lanes = max(1.0, 0.42 * len(channels))  # inches
    claims = ROW * (len(verdicts) + 1)  # inches
    heights = [1.9, 2.3, 2.3, claims if histories else max(claims, 2 * lanes + 0.6)]
    keys = 0.85 if histories else 0.62  # stand under the panels of the upper row
    edges = np.cumsum([1.12, heights[0], 0.55, heights[1], keys, heights[2], 0.72, heights[3]])
    height = edges[-1] + 0.4
    figure = Figure(figsize=(WIDTH, height), dpi=DPI)
    FigureCanvasAgg(figure)  # the figure keeps it
    rows = 1 - edges.reshape(4, 2) / height  # top and bottom of each, as shares of the page
    _heading(figure, title, verdicts, 1 - 0.36 / height)
    late = spans.last_cycles(measured)
    strip = [figure.add_subplot(cell) for cell in _grid(figure, rows[0], FRAMES, 0.012, 0.03)]
    note = film(strip, drawing, measured)
    figure.text(0.012, 1 - 0.72 / height, note, size=9.5, color=SOFT, va="center")
    plants = SMOOTH if histories else PLANTS
    moving = () if histories else moving_axes(measured, "attitude")
    _key(figure, 1 - 0.72 / height, plants, moving, bands)
    if law:
        for cell, draw in zip([*_grid(figure, rows[2], len(law), 0.05, 0.19)], law, strict=True):  # pyright: ignore
            draw(figure.add_subplot(cell), (predicted, measured))
        _side(figure, rows[2], "THE LAW")
    for row, zoom in ((rows[1], False), (rows[2], True))[: 1 if law else 2]:
        start = late if zoom else measured.time[0]
        flights = _since(predicted, start), _since(measured, start)
        panels = [figure.add_subplot(cell) for cell in _grid(figure, row, 4, 0.05, 0.19)]
        if histories:
            for draw, axes in zip(histories, panels, strict=True):
                draw(axes, flights, zoom)
        else:
            _angle(panels[0], flights, "quasi_rigid_angle", bands, zoom)
            _angle(panels[1], flights, "attitude", bands, zoom)
            _tips(panels[2], flights, tuple(drawing.booms))
            _phase_plane(panels[3], flights, bands, zoom)
        _side(figure, row, "END OF THE FLIGHT" if zoom else "WHOLE FLIGHT")
    if histories:  # which show the torques
        table(figure.add_subplot(_grid(figure, rows[3], 1, 0.012, 0.0)[0]), verdicts)
    else:
        left, thrust = _grid(figure, rows[3], 2, 0.012, 0.1, (2, 1))
        table(figure.add_subplot(left), verdicts)
        _lanes(figure, thrust.subgridspec(2, 1, hspace=0.55 / lanes), measured, channels)
    figure.savefig(path, pil_kwargs={"compress_level": 3})


def _grid(
    figure: Figure, row: Array, columns: int, left: float, space: float, widths=None
) -> GridSpec:
    place = {"top": row[0], "bottom": row[1], "left": left, "right": 0.988, "wspace": space}
    return figure.add_gridspec(1, columns, width_ratios=widths, **place)


def _side(figure: Figure, row: Array, words: str) -> None:
    style = {"size": 9, "color": SOFT, "weight": "bold", "rotation": 90, "va": "center"}
    figure.text(0.016, row.mean(), words, ha="center", **style)


def _heading(figure: Figure, title: str, verdicts: Sequence[Verdict], y: float) -> None:
    figure.text(0.012, y, title, size=17, weight="bold", color=INK, va="center")
    kept, color = sum(v.holds for v in verdicts), GOOD if all(v.holds for v in verdicts) else BAD
    style = {"size": 14, "weight": "bold", "ha": "right", "va": "center", "color": color}
    figure.text(0.988, y, f"{kept} of {len(verdicts)} claims hold", **style)


def _key(
    figure: Figure, y: float, plants: Plants, axes: Sequence[str], bands: Mapping[str, float]
) -> None:
    """One key for the page, so that none covers a curve."""
    entries = [
        (f"{axis} {name}" if len(axes) > 1 else name, AXES[axis][1 - k], width)
        for axis in sorted(axes)
        for k, (name, _, width) in enumerate(plants)
    ] or [*plants]
    if bands:
        asked = ", ".join(f"{signal[-1]} ±{half:.3g} rad" for signal, half in bands.items())
        entries.append((f"asked: {asked}", GOOD, 1.4))
    x = 0.988
    for name, color, width in reversed(entries):
        text = figure.text(x, y, name, size=9.5, color=INK, ha="right", va="center")
        x = text.get_window_extent().x0 / figure.bbox.width - 0.005
        look = {"color": color, "linewidth": width}
        figure.add_artist(Line2D([x - 0.018, x], [y, y], transform=figure.transFigure, **look))
        x -= 0.03


def _angle(axes: Axes, flights: Flights, kind: str, bands: Mapping[str, float], zoom: bool) -> None:
    """An angle with its own bands filled and those of the other angle dotted, all with names."""
    own = {name: half for name, half in bands.items() if name[:-2] == kind}
    others = {name: half for name, half in bands.items() if name not in own}
    shown = [*own.values(), *(others.values() if zoom else ())]
    peak, scale, unit = _histories(axes, flights, kind, max(shown, default=0.0))
    for k, (name, half) in enumerate(own.items()):
        axes.axhspan(-half / scale, half / scale, color=GOOD, alpha=0.10, linewidth=0)
        words = f"{name[-1]} ±{half / scale:.3g}", 0.995 - STAGGER[0] * k, "right"
        _bound(axes, half / scale, words, _bound_color(name, own), "-")
    for k, (name, half) in enumerate(others.items() if zoom else ()):
        kept = (
            name[:-2].replace("quasi_rigid_angle", "quasi-rigid").replace("attitude", "of the bus")
        )
        label = f"{name[-1]} {kept.replace('_', ' ')}", 0.005 + STAGGER[1] * k, "left"
        _bound(axes, half / scale, label, _bound_color(name, others), ":")
    low, high = axes.get_ylim()
    outermost = 1.2 * max(shown, default=0.0) / scale  # with room for its name
    axes.set_ylim(min(low, -outermost), max(high, outermost))
    limit = max(own.values(), default=0.0) / scale
    if zoom and len(own) == 1 and 0 < peak < 0.4 * limit:
        # Linear up to the peak, logarithmic to the limit: cycle and bound on one axis.
        axes.set_yscale("symlog", linthresh=1.2 * peak, linscale=1.0)
        axes.set_yticks(ticks := [-limit, -peak, 0, peak, limit], [f"{t:.3g}" for t in ticks])
        axes.set_yticks([], minor=True)
        axes.set_ylim(-1.5 * limit, 1.5 * limit)
        unit += " (log beyond the peak)"
    titles = {"quasi_rigid_angle": "Quasi-rigid angle", "attitude": "Attitude of the bus"}
    panel(axes, f"{titles[kind]}, {unit}")


def _bound_color(name: str, drawn: Mapping[str, float]) -> str:
    """That of the axis where bounds of several are drawn."""
    return AXES[name[-1]][0] if len(drawn) > 1 and name[-1] in AXES else GOOD


def _bound(axes: Axes, half: float, label: tuple[str, float, str], color: str, dashes: str) -> None:
    """Two lines, the upper with its name: what it says, where, and which end of it is there."""
    for limit in (-half, half):
        axes.axhline(limit, color=color, linewidth=1.4, linestyle=dashes)
    words, x, side = label
    place = {"transform": axes.get_yaxis_transform(), "ha": side, "va": "bottom", "zorder": 6}
    ground = {"facecolor": "white", "alpha": 0.75, "linewidth": 0, "pad": 0.4}
    axes.text(x, half, words, size=7.5, color=color, bbox=ground, **place)


def _histories(
    axes: Axes, flights: Flights, kind: str, also: float = 0.0
) -> tuple[float, float, str]:
    """Draws the moving axes; returns their peak and a unit that suits it and `also`, with name."""
    moving = moving_axes(flights[1], kind)  # the largest first, beneath the others
    drawn = [
        (flight.time, flight[f"{kind}_{axis}"], AXES[axis][1 - k], width)
        for k, (flight, (_, _, width)) in enumerate(zip(flights, PLANTS, strict=True))
        for axis in moving
        if f"{kind}_{axis}" in flight.signals
    ]
    unit = "rad/s" if kind == "rate" else "rad"
    peak = max((_peak(value) for _, value, *_ in drawn), default=0.0)
    base = 0.0 if also else _base([value for _, value, *_ in drawn])
    scale, letter = prefix(max([also, *(_peak(value - base) for _, value, *_ in drawn)]))
    for time, value, color, width in drawn:
        axes.plot(time, (value - base) / scale, color=color, linewidth=width)
    time_axis(axes, flights[1].time[0], flights[1].time[-1])
    return peak / scale, scale, f"{letter}{unit}{_from(base, unit)}"


def _base(values: Sequence[Array]) -> float:
    """A round number to measure from, where values differ little beside where they lie; or zero."""
    low = min((float(value.min()) for value in values), default=0.0)
    high = max((float(value.max()) for value in values), default=0.0)
    size, span = max(abs(low), abs(high)), high - low
    if span > 2e-3 * size or size == 0:
        return 0.0
    return round((low + high) / 2, -math.floor(math.log10(max(span, 1e-6 * size))) - 1)


def _from(base: float, unit: str) -> str:
    return f" from {base:.6g} {unit}" if base else ""


def _tips(axes: Axes, flights: Flights, booms: Sequence[str]) -> None:
    signals = [s for s in (f"{boom}_tip_y" for boom in booms) if s in flights[1].signals]
    if not signals:
        _, _, unit = _histories(axes, flights, "rate")
        return panel(axes, f"Rate of the bus, {unit}")
    scale, letter = prefix(max((_peak(flights[1][s]) for s in signals), default=0.0))
    for signal in signals:
        if signal in flights[0].signals:
            value, (_, color, _) = flights[0][signal] / scale, PLANTS[0]
            axes.plot(flights[0].time, value, color=color, linewidth=4.5)
    for k, signal in enumerate(signals):
        # Booms often swing alike: the later ones are thinner, so that all can be seen.
        color, width = BOOMS[k % len(BOOMS)], max(2.2 - 0.8 * k, 0.8)
        axes.plot(flights[1].time, flights[1][signal] / scale, color=color, linewidth=width)
    place = 1.0
    for k, signal in reversed([*enumerate(signals)]):
        boom, color = signal.removesuffix("_tip_y"), BOOMS[k % len(BOOMS)]
        style = {"transform": axes.transAxes, "ha": "right", "size": 9, "weight": "bold"}
        axes.text(place, 1.03, boom, color=color, **style)
        place -= 0.024 * len(boom) + 0.03
    time_axis(axes, flights[1].time[0], flights[1].time[-1])
    return panel(axes, f"Boom tips, deflection, {letter}m")


def _phase_plane(axes: Axes, flights: Flights, bands: Mapping[str, float], zoom: bool) -> None:
    axis = next(iter(moving_axes(flights[1], "quasi_rigid_angle")), "")
    x, y = f"quasi_rigid_angle_{axis}", f"quasi_rigid_rate_{axis}"
    if not all(signal in flights[1].signals for signal in (x, y)):
        return panel(axes, "Phase plane: not recorded")
    angle, rate = flights[1][x], flights[1][y]
    if np.ptp(angle) <= REST * _peak(angle) and np.ptp(rate) <= REST:
        axes.plot(0, 0, "o", color=INK, markersize=4)
        axes.set(xticks=[], yticks=[])
        return panel(axes, f"Phase plane {axis}: at rest at {angle[-1]:.4g} rad")
    drawn = [
        (flight, AXES[axis][1 - k], width)
        for k, (flight, (_, _, width)) in enumerate(zip(flights, PLANTS, strict=True))
        if x in flight.signals and y in flight.signals
    ]
    base = np.array([_base([flight[name] for flight, *_ in drawn]) for name in (x, y)])
    (sx, px), (sy, py) = (
        prefix(max(_peak(flight[name] - from_) for flight, *_ in drawn))
        for name, from_ in zip((x, y), base, strict=True)
    )
    for flight, color, width in drawn:
        track = np.stack([flight[x], flight[y]], axis=1)
        if len(track) < FEW:  # the rows alone would be corners
            track = between_rows(flight.time, flight[x], flight[y]).reshape(-1, 2)
        axes.plot(*((track - base) / (sx, sy)).T, color=color, linewidth=width)
    if not zoom:
        axes.plot((angle[0] - base[0]) / sx, (rate[0] - base[1]) / sy, "o", color=INK, markersize=4)
        if half := bands.get(x, 0.0):
            window = axes.get_xlim()
            edges = (np.array([-half, half]) - base[0]) / sx
            axes.axvspan(*edges, color=GOOD, alpha=0.15, linewidth=0)
            if base[0]:  # the band reaches far beyond what is seen
                axes.set_xlim(window)
    angles, rates = _from(base[0], "rad"), _from(base[1], "rad/s")
    return panel(axes, f"Phase plane {axis}", f"angle, {px}rad{angles}", f"rate, {py}rad/s{rates}")


def _lanes(
    figure: Figure, grid: GridSpecBase, measured: Trajectory, channels: dict[str, str]
) -> None:
    """Thrust until the flight has settled, and at its end."""
    end = float(measured.time[-1])
    settled = min(1.3 * spans.settled(measured) + 1, end)
    for k, span in enumerate(((0.0, settled), (spans.last_cycles(measured), end))):
        dense = _thrust(axes := figure.add_subplot(grid[k]), measured, channels, span)
        unit = " or ".join(sorted(set(channels.values()))) or "N"
        line = "commands too dense" if dense else "line: commanded"
        words = f"Thrust, {unit}, log levels; filled: delivered; {line}"
        panel(axes, f"The same at the end{'; ' + line if dense else ''}" if k else words)


def _thrust(
    axes: Axes, measured: Trajectory, channels: dict[str, str], span: tuple[float, float]
) -> bool:
    """A lane a channel, on a log scale of its levels; returns if commands are too many to draw."""
    first = max(int(np.searchsorted(measured.time, span[0], side="right")) - 1, 0)
    ticks, dense = {}, False
    pitch = 3.2 if len(channels) > 1 else 2.4  # room for the name of a lane above it
    rows = slice(first, int(np.searchsorted(measured.time, span[1])) + 1)
    time = measured.time[rows]
    for k, channel in enumerate(channels):
        levels = np.unique(np.abs(measured[channel][measured[channel] != 0]))
        height, middle = _log_heights(levels), -pitch * k
        delivered = middle + height(measured[channel][rows])
        command = measured[f"{channel}_command"][rows]
        crowded = int(np.count_nonzero(np.diff(command))) > DENSE
        dense = dense or crowded
        if not crowded:
            style = {"where": "post", "color": INK, "linewidth": 0.8}
            axes.step(time, middle + height(command), **style)
        for edge, color in ((np.maximum, PLUS), (np.minimum, MINUS)):
            style = {"step": "post", "facecolor": (color, 0.5), "edgecolor": color}
            # Over the line, so that a pulse as narrow as it keeps its colour.
            axes.fill_between(time, middle, edge(delivered, middle), lw=0.7, zorder=3, **style)
        axes.axhline(middle, color=INK, linewidth=0.7, zorder=4)
        ticks[middle] = "0"
        if len(channels) == 1:
            few = {levels[0], levels[-1]} if len(levels) else ()
            if len(few) == 2 and height(levels[0]) > 0.7:  # their figures would cover each other
                few = {levels[-1]}
            ticks |= {middle + float(height(v)): f"{v:+.3g}" for e in few for v in (e, -e)}
            continue
        words = f"{channel} ±{levels[-1]:.3g}" if len(levels) else f"{channel}: never on"
        place = {"transform": axes.get_yaxis_transform(), "va": "bottom", "zorder": 5}
        axes.text(0.004, middle + 1.05, words, size=8.5, color=INK, **place)
    axes.set_yticks(list(ticks), list(ticks.values()))
    axes.set_ylim(
        -pitch * max(len(channels) - 1, 0) - 1.2, pitch - (0.4 if len(channels) > 1 else 1.2)
    )
    time_axis(axes, *span)
    return dense


def _log_heights(levels: Array) -> Callable[[Array], Array]:
    """Maps thrust to -1 .. 1, zero to zero and the levels evenly in their logarithms."""
    least, most = (levels[0], levels[-1]) if len(levels) else (1.0, 1.0)

    def height(thrust: Array) -> Array:
        size = np.abs(thrust) / least
        above = 1 + np.log10(np.maximum(size, 1.0))
        return np.sign(thrust) * np.where(size < 1, size, above) / (1 + np.log10(most / least))

    return height


def _since(flight: Trajectory, start: float) -> Trajectory:
    late = flight.time >= start
    signals = {name: value[late] for name, value in flight.signals.items()}
    return Trajectory(time=flight.time[late], signals=signals, units=flight.units)


def _peak(value: Array) -> float:
    return float(np.abs(value).max(initial=0.0))
