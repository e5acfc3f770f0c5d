"""Two runs over each other on one page."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from spacecraft_sim import spans
from spacecraft_sim.plots import GOOD, INK, SOFT, WIDTH
from spacecraft_sim.plots_panel import AXES, DPI, panel, prefix
from spacecraft_sim.plots_table import fit
from spacecraft_sim.signal_groups import Group, groups
from spacecraft_sim.trajectory import Trajectory, channel_units, moving_axes

Array = np.ndarray
Named = tuple[tuple[str, Trajectory], tuple[str, Trajectory]]
Table = Sequence[tuple[str, Sequence[tuple[str, ...]]]]

RUNS = (("#f29b38", 2.8), ("#1f6fd6", 1.1))  # colour and width: B thin over A
DASHES = ("-", "--", ":", "-.")
NEAR = 12.0  # s of thrust in a panel
UNLIKE = 10.0  # times as strong are thrusts that need a scale of their own
CYCLES = 4  # of a limit cycle, of which hundreds would be a band
PANEL, LINE = 3.5, 0.165  # heights of a panel with its key, and of a line of the table, inches
TITLE = (17, 14, 11)  # sizes of its letters, points
ACROSS, STACKS = 4, 3  # panels in a row at most, and parts of the table beside each other
COLUMNS = (0.64, 0.835, 1.0)  # right edges of those of the table after the first
LETTERS, INDENT = 44, "   "  # of a line of the first column


def page(
    path: Path,
    *,
    a: Trajectory,
    b: Trajectory,
    booms: Sequence[str],
    title: str,
    bands: tuple[Mapping[str, float], Mapping[str, float]],
    table: Table,
) -> None:
    """Draws two flights over each other, with the table of their differences.

    Args:
        path: The PNG file.
        a: One flight.
        b: The other.
        booms: Names of the booms of both.
        title: One line over the page.
        bands: Half-widths that signals of A and of B are to keep, by signal, rad.
        table: Headings, and below each rows of (what, A, B, B - A).
    """
    flights: Named = (("A", a), ("B", b))
    panels: list[Callable[[Axes], None]] = []
    for group in groups((a, b), booms):
        panels.append(partial(_history, flights=flights, group=group))
        if any(signal in band for band in bands for signal in group.signals):
            panels.append(partial(_history, flights=flights, group=group, bands=bands))
    axis = next(iter(moving_axes(a, "quasi_rigid_angle")), "")
    plane = f"quasi_rigid_angle_{axis}", f"quasi_rigid_rate_{axis}"
    if all(name in flight.signals for name in plane for flight in (a, b)):
        planes = (
            partial(_phase_plane, flights=flights, names=plane, late=k) for k in (False, True)
        )
        panels += planes
    thrust = [partial(_thrust, flights=flights), partial(_thrust_at_the_end, flights=flights)]
    rows = [*_rows(panels), thrust]
    stacks = _stacks(_lines(table))
    longest = max(map(len, stacks))
    height = PANEL * len(rows) + LINE * (longest + 1) + 0.75
    figure = Figure(figsize=(WIDTH, height), dpi=DPI)
    FigureCanvasAgg(figure)
    heading = figure.text(0.012, 1 - 0.3 / height, title, weight="bold", color=INK, va="center")
    fit(heading, 0.976 * figure.bbox.width, TITLE)
    for k, row in enumerate(rows):
        edges = {"top": 1 - (0.85 + PANEL * k) / height, "bottom": 1 - (3.05 + PANEL * k) / height}
        grid = figure.add_gridspec(1, len(row), left=0.045, right=0.965, wspace=0.2, **edges)
        for cell, draw in zip([*grid], row, strict=True):  # pyright: ignore
            draw(figure.add_subplot(cell))
    for k, lines in enumerate(stacks):
        tall, wide = LINE * (longest + 1) / height, 0.976 / STACKS
        place = (0.012 + k * wide, 0.1 / height, wide - 0.02 * (k + 1 < STACKS), tall)
        _table(figure.add_axes(place), lines, longest)
    figure.savefig(path, pil_kwargs={"compress_level": 3})


def _rows(panels: Sequence[Callable[[Axes], None]]) -> list[Sequence[Callable[[Axes], None]]]:
    """Rows of about one length, each of which fills the page."""
    edges = np.linspace(0, len(panels), -(-len(panels) // ACROSS) + 1).round().astype(int)
    return [panels[a:b] for a, b in pairwise(edges)]


def _history(
    axes: Axes,
    *,
    flights: Named,
    group: Group,
    bands: tuple[Mapping[str, float], Mapping[str, float]] = ({}, {}),
) -> None:
    """A group of signals; with bands near these."""
    own = [{s: half for s, half in band.items() if s in group.signals} for band in bands]
    largest = max((half for band in own for half in band.values()), default=0.0)
    peak = max(_peak(flight[name]) for _, flight in flights for name in group.signals)
    scale, letter = prefix(largest or peak)
    for n, ((run, flight), (color, width), band) in enumerate(zip(flights, RUNS, own, strict=True)):
        for k, (name, label) in enumerate(zip(group.signals, group.labels, strict=True)):
            look = {"color": color, "linewidth": width, "linestyle": DASHES[k % len(DASHES)]}
            if label in AXES:
                smaller = sum(_peak(flight[x]) > _peak(flight[name]) for x in group.signals)
                look |= {"color": AXES[label][1 - n], "linestyle": "-"}
                look |= {"zorder": 2 + 0.5 * n + 0.1 * smaller}  # over the larger ones
            axes.plot(flight.time, flight[name] / scale, label=f"{run}: {label}", **look)
        for half in band.values():
            axes.axhspan(-half / scale, half / scale, color=GOOD, alpha=0.08, linewidth=0)
            for sign in (-1, 1):
                axes.axhline(sign * half / scale, color=color, linewidth=1.0, linestyle=":")
    if largest:
        axes.set_ylim(-1.6 * largest / scale, 1.6 * largest / scale)
    axes.set_xlim(0, max(flight.time[-1] for _, flight in flights))
    title = f"{group.title} within its bound" if largest else group.title
    panel(axes, f"{title}, {letter}{group.unit or '-'}", "time, s")
    _key(axes)


def _phase_plane(axes: Axes, *, flights: Named, names: tuple[str, str], late: bool) -> None:
    """Rate over angle, for the whole flight or its last cycles."""
    shown = [
        flight.time >= (spans.last_cycles(flight, CYCLES) if late else flight.time[0])
        for _, flight in flights
    ]
    scales = [
        prefix(max(_peak(f[name][rows]) for (_, f), rows in zip(flights, shown, strict=True)))
        for name in names
    ]
    (sx, px), (sy, py) = scales
    for (run, flight), (color, width), rows in zip(flights, RUNS, shown, strict=True):
        x, y = (flight[name][rows] for name in names)
        axes.plot(x / sx, y / sy, color=color, linewidth=width, label=run)
    axis = names[0][-1]
    labels = f"quasi-rigid angle {axis}, {px}rad", f"quasi-rigid rate {axis}, {py}rad/s"
    panel(axes, f"Phase plane, {'last cycles of each' if late else 'whole flight'}", *labels)
    _key(axes)


def _thrust(axes: Axes, *, flights: Named) -> None:
    """As delivered, while it changes most; the whole of a flight that is short."""
    start, end = busiest([flight for _, flight in flights])
    unit = _channels(axes, flights, (start, end), (0.0, 0.0))
    panel(axes, f"Thrust as delivered, where it changes most, {unit}", "time, s")
    _key(axes)


def _thrust_at_the_end(axes: Axes, *, flights: Named) -> None:
    """As delivered, the ends of flights of whatever lengths over each other."""
    ends = [float(flight.time[-1]) for _, flight in flights]
    unit = _channels(axes, flights, (-min(NEAR, *ends), 0.0), ends)
    panel(
        axes,
        f"Thrust as delivered, to the end of each, {unit}",
        f"time from the end, s, of A at {ends[0]:g} s and of B at {ends[1]:g} s",
    )
    _key(axes)


def _channels(axes: Axes, flights: Named, span: tuple[float, float], zeros: Sequence[float]) -> str:
    """Draws the first channels over times from the zeros; returns their units."""
    units = [channel_units(flight) for _, flight in flights]
    channels = [*dict.fromkeys(name for found in units for name in found)]
    peaks, scales = [], (axes, axes)
    shown = [
        _between(flight.time - zero, span) for (_, flight), zero in zip(flights, zeros, strict=True)
    ]
    for found, (_, flight), rows in zip(units, flights, shown, strict=True):
        peaks.append(max((_peak(flight[channel][rows]) for channel in found), default=0.0))
    if 0 < UNLIKE * min(peaks) < max(peaks):  # on one scale the weaker would be a flat line
        scales = axes, axes.twinx()
        scales[1].tick_params(labelsize=8.5, colors=RUNS[1][0], length=3)
        scales[1].spines[:].set_visible(False)
        for own, peak in zip(scales, peaks, strict=True):
            own.set_ylim(-1.1 * peak, 1.1 * peak)
    for k, ((run, flight), (color, width), rows) in enumerate(
        zip(flights, RUNS, shown, strict=True)
    ):
        for channel, dashes in zip((c for c in channels if c in units[k]), DASHES, strict=False):
            look = {"color": color, "linewidth": width, "linestyle": dashes}
            time, thrust = flight.time[rows] - zeros[k], flight[channel][rows]
            (line,) = scales[k].step(time, thrust, where="post", label=f"{run}: {channel}", **look)
            if scales[k] is not axes:  # whose key it is to stand in
                axes.plot([], [], label=line.get_label(), **look)
    axes.set_xlim(*span)
    kinds = [" or ".join(sorted(set(found.values()))) for found in units]
    if scales[0] is scales[1]:
        return " or ".join(sorted({unit for found in units for unit in found.values()}))
    return f"A: {kinds[0]}, on the left; B: {kinds[1]}, on the right"


def _between(time: Array, span: tuple[float, float]) -> slice:
    """The rows in a span, the one before it, which still holds, and the one after it."""
    first = max(int(np.searchsorted(time, span[0], side="right")) - 1, 0)
    return slice(first, int(np.searchsorted(time, span[1], side="right")) + 1)


def busiest(flights: Sequence[Trajectory]) -> tuple[float, float]:
    """Returns when the thrusts change most, beside their own peaks, before the end of a flight.

    Args:
        flights: The flights.

    Returns:
        From when until when, s; the whole of the shortest flight if it is short.
    """
    end = min(float(flight.time[-1]) for flight in flights)
    if end <= 2 * NEAR:
        return 0.0, end
    starts = np.arange(0.0, end - 2 * NEAR, NEAR / 12)
    total = np.zeros(len(starts))
    for flight in flights:
        for channel in channel_units(flight):
            change = np.abs(np.diff(flight[channel], prepend=0.0))
            way = np.r_[0.0, np.cumsum(change / (_peak(flight[channel]) or 1.0))]
            edges = (np.searchsorted(flight.time, starts + after) for after in (0.0, NEAR))
            before, then = (way[edge] for edge in edges)
            total += then - before
    start = float(starts[np.argmax(total.round(9))])  # the first of equal ones
    return start, start + NEAR


def _key(axes: Axes) -> None:
    """Under the panel, in as many columns as there is room for."""
    labels = axes.get_legend_handles_labels()[1]
    columns = 4 if max(map(len, labels), default=0) < 10 else 3
    deep = 0.42 * DPI / axes.get_window_extent().height  # under ticks and label
    place = {"loc": "upper left", "bbox_to_anchor": (-0.02, -deep)}
    axes.legend(ncols=columns, fontsize=8.5, frameon=False, borderpad=0.0, **place)


def _lines(table: Table) -> list[tuple[str, ...]]:
    """The lines of the table; a heading has no figures, and a long name takes two lines."""
    lines: list[tuple[str, ...]] = []
    for heading, rows in table:
        lines.append((heading.upper(),))
        for what, *figures in rows:
            first, *more = textwrap.wrap(what, LETTERS, subsequent_indent=INDENT) or [""]
            lines += [(first, *figures), *((part, "") for part in more)]
    return lines


def _stacks(lines: Sequence[tuple[str, ...]]) -> list[Sequence[tuple[str, ...]]]:
    """Parts of about one length; none parts a heading or a name from the line below it."""
    edges = [0]
    for k in range(1, STACKS):
        edge = max(round(len(lines) * k / STACKS), edges[-1])
        while edge < len(lines) and (
            len(lines[edge - 1]) == 1 or lines[edge][0].startswith(INDENT)
        ):
            edge += 1
        edges.append(edge)
    return [lines[a:b] for a, b in pairwise([*edges, len(lines)])]


def _table(axes: Axes, lines: Sequence[tuple[str, ...]], longest: int) -> None:
    axes.set_axis_off()
    axes.set(xlim=(0, 1), ylim=(longest, -1))
    for head, x in zip(("A", "B", "B - A"), COLUMNS, strict=True):
        axes.text(x, -0.5, head, size=9, weight="bold", color=SOFT, ha="right", va="center")
    for k, (what, *figures) in enumerate(lines):
        style = {"size": 8, "va": "center", "color": INK if figures else SOFT}
        axes.text(0.0, k + 0.5, what, weight=None if figures else "bold", **style)
        wide = 16 if any(figures[:2]) else 60
        for text, x in zip(figures, COLUMNS, strict=False):
            axes.text(x, k + 0.5, _short(text, wide), ha="right", **style)


def _short(text: str, length: int) -> str:
    return text if len(text) <= length else f"{text[: length - 1]}…"


def _peak(value: Array) -> float:
    return float(np.abs(value).max(initial=0.0))
