"""Two runs over each other on one page."""

import textwrap
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from spacecraft_sim.plots import DPI, GOOD, INK, SOFT, WIDTH, panel, prefix
from spacecraft_sim.signal_groups import Group, groups
from spacecraft_sim.trajectory import Trajectory, channel_units, moving_axes

Array = np.ndarray
Named = tuple[tuple[str, Trajectory], tuple[str, Trajectory]]
Table = Sequence[tuple[str, Sequence[tuple[str, ...]]]]

RUNS = (("#f29b38", 2.8), ("#1f6fd6", 1.1))  # colour and width: B thin over A
DASHES = ("-", "--", ":", "-.")
NEAR = 12.0  # s of thrust at the start and at the end
PANEL, LINE = 3.5, 0.165  # heights of a panel with its key, and of a line of the table, inches
COLUMNS = (0.645, 0.83, 1.0)  # right edges of those of the table after the first
LETTERS = 50  # of a line of the first column


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
        panels += [partial(_phase_plane, flights=flights, names=plane, share=s) for s in (0.0, 0.9)]
    panels += [partial(_thrust, flights=flights, share=share) for share in (0.0, 1.0)]
    rows = -(-len(panels) // 2)
    lines = _lines(table)
    height = max(PANEL * rows + 0.6, LINE * (len(lines) + 1) + 1.1)
    figure = Figure(figsize=(WIDTH, height), dpi=DPI)
    FigureCanvasAgg(figure)
    style = {"size": 17, "weight": "bold", "color": INK, "va": "center"}
    figure.text(0.012, 1 - 0.3 / height, title, **style)
    grid = figure.add_gridspec(
        rows, 2, left=0.045, right=0.62, top=1 - 0.85 / height,
        bottom=1 - (PANEL * rows - 0.5) / height, hspace=0.62, wspace=0.2,
    )  # fmt: skip
    for k, draw in enumerate(panels):
        draw(figure.add_subplot(grid[k // 2, k % 2]))
    tall = LINE * (len(lines) + 1) / height
    _table(figure.add_axes((0.65, 1 - 0.6 / height - tall, 0.34, tall)), lines)
    figure.savefig(path, pil_kwargs={"compress_level": 3})


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
    for (run, flight), (color, width), band in zip(flights, RUNS, own, strict=True):
        for k, (name, label) in enumerate(zip(group.signals, group.labels, strict=True)):
            look = {"color": color, "linewidth": width, "linestyle": DASHES[k % len(DASHES)]}
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


def _phase_plane(axes: Axes, *, flights: Named, names: tuple[str, str], share: float) -> None:
    """Rate over angle, for the whole flight or its last part."""
    late = [flight.time >= share * flight.time[-1] for _, flight in flights]
    scales = [
        prefix(max(_peak(f[name][rows]) for (_, f), rows in zip(flights, late, strict=True)))
        for name in names
    ]
    (sx, px), (sy, py) = scales
    for (run, flight), (color, width), rows in zip(flights, RUNS, late, strict=True):
        x, y = (flight[name][rows] for name in names)
        axes.plot(x / sx, y / sy, color=color, linewidth=width, label=run)
    axis = names[0][-1]
    labels = f"quasi-rigid angle {axis}, {px}rad", f"quasi-rigid rate {axis}, {py}rad/s"
    panel(axes, f"Phase plane, {'last tenth' if share else 'whole flight'}", *labels)
    _key(axes)


def _thrust(axes: Axes, *, flights: Named, share: float) -> None:
    """The first channels of both, as delivered, over the first or the last seconds."""
    units = [channel_units(flight) for _, flight in flights]
    channels = [*dict.fromkeys(name for found in units for name in found)]
    end = share * min(float(flight.time[-1]) for _, flight in flights)
    start = max(end - NEAR, 0.0)
    for (run, flight), (color, width) in zip(flights, RUNS, strict=True):
        own = [channel for channel in channels if channel in flight.signals]
        for channel, dashes in zip(own, DASHES, strict=False):
            look = {"color": color, "linewidth": width, "linestyle": dashes}
            axes.step(flight.time, flight[channel], where="post", label=f"{run}: {channel}", **look)
    axes.set_xlim(start, start + NEAR)
    when = "to the end" if share else "from the start"
    kinds = " or ".join(sorted({unit for found in units for unit in found.values()}))
    panel(axes, f"Thrust as delivered, {when}, {kinds}", "time, s")
    _key(axes)


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
        for what, *figures in rows or [("none", "")]:
            first, *more = textwrap.wrap(what, LETTERS, subsequent_indent="   ") or [""]
            lines += [(first, *figures), *((part, "") for part in more)]
    return lines


def _table(axes: Axes, lines: Sequence[tuple[str, ...]]) -> None:
    axes.set_axis_off()
    axes.set(xlim=(0, 1), ylim=(len(lines), -1))
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
