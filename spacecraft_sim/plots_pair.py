"""Two runs over each other on one page."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from spacecraft_sim.plots import DPI, GOOD, INK, SOFT, WIDTH, panel, prefix
from spacecraft_sim.trajectory import Trajectory, moving_axes

Array = np.ndarray
Named = tuple[tuple[str, Trajectory], tuple[str, Trajectory]]

RUNS = (("#f29b38", 2.8), ("#1f6fd6", 1.1))  # colour and width: B thin over A
DASHES = ("-", "--", ":")
NEAR = 12.0  # s of thrust at the start and at the end
ROWS = 30  # of the table that find room


def page(
    path: Path,
    *,
    a: Trajectory,
    b: Trajectory,
    title: str,
    bands: tuple[float | None, float | None],
    table: Sequence[tuple[str, Sequence[tuple[str, ...]]]],
) -> None:
    """Draws two flights over each other, with the table of their differences.

    Args:
        path: The PNG file.
        a: One flight.
        b: The other.
        title: One line over the page.
        bands: Accuracy that the quasi-rigid angle shall keep in A and in B, rad; None for none.
        table: Headings, and below each rows of (what, A, B, B - A).
    """
    figure = Figure(figsize=(WIDTH, 13.0), dpi=DPI)
    FigureCanvasAgg(figure)
    figure.text(0.012, 0.977, title, size=17, weight="bold", color=INK, va="center")
    flights: Named = (("A", a), ("B", b))
    grid = figure.add_gridspec(
        4, 2, left=0.045, right=0.62, top=0.945, bottom=0.045, hspace=0.36, wspace=0.2
    )
    cells = [figure.add_subplot(grid[k // 2, k % 2]) for k in range(8)]
    _history(cells[0], flights, "attitude", "Attitude of the bus")
    _history(cells[1], flights, "quasi_rigid_angle", "Quasi-rigid angle within its bound", bands)
    _history(cells[2], flights, "rate", "Rate of the bus")
    _tips(cells[3], flights)
    _phase_plane(cells[4], flights, 0.0, "whole flight")
    _phase_plane(cells[5], flights, 0.9, "last tenth")
    _thrust(cells[6], flights, 0.0, "from the start")
    _thrust(cells[7], flights, 1.0, "to the end")
    _table(figure.add_axes((0.65, 0.045, 0.34, 0.9)), table)
    figure.savefig(path, pil_kwargs={"compress_level": 3})


def _history(
    axes: Axes,
    flights: Named,
    kind: str,
    title: str,
    bands: tuple[float | None, float | None] = (None, None),
) -> None:
    moving = sorted({axis for _, flight in flights for axis in moving_axes(flight, kind)})
    names = [f"{kind}_{axis}" for axis in moving]
    largest = max((b for b in bands if b), default=0.0)
    peak = max((_peak(f.signals.get(n, np.zeros(1))) for _, f in flights for n in names), default=0)
    scale, letter = prefix(largest or peak)
    for (run, flight), (color, width), band in zip(flights, RUNS, bands, strict=True):
        for name, dashes in zip(names, DASHES, strict=False):
            if name in flight.signals:
                look = {"color": color, "linewidth": width, "linestyle": dashes}
                axes.plot(flight.time, flight[name] / scale, label=f"{run}: {name[-1]}", **look)
        if band:
            axes.axhspan(-band / scale, band / scale, color=GOOD, alpha=0.08, linewidth=0)
            for sign in (-1, 1):
                axes.axhline(sign * band / scale, color=color, linewidth=1.0, linestyle=":")
    if largest:
        axes.set_ylim(-1.6 * largest / scale, 1.6 * largest / scale)
    axes.set_xlim(0, max(flight.time[-1] for _, flight in flights))
    unit = "rad/s" if kind == "rate" else "rad"
    panel(
        axes,
        title,
        "time, s",
        f"{kind.replace('quasi_', 'quasi-').replace('_', ' ')}, {letter}{unit}",
    )


def _tips(axes: Axes, flights: Named) -> None:
    names = sorted({n for _, f in flights for n in f.signals if n.endswith("_tip_y")})
    peak = max((_peak(f.signals.get(n, np.zeros(1))) for _, f in flights for n in names), default=0)
    scale, letter = prefix(peak)
    for (run, flight), (color, width) in zip(flights, RUNS, strict=True):
        for name, dashes in zip(names, DASHES * len(names), strict=False):
            if name in flight.signals:
                look = {"color": color, "linewidth": width, "linestyle": dashes}
                axes.plot(flight.time, flight[name] / scale, label=f"{run}: {name[:-6]}", **look)
    panel(axes, "Boom tips", "time, s", f"tip deflection y, {letter}m")


def _phase_plane(axes: Axes, flights: Named, share: float, when: str) -> None:
    title = f"Phase plane, {when}"
    axis = next(iter(moving_axes(flights[0][1], "quasi_rigid_angle")), "")
    x, y = f"quasi_rigid_angle_{axis}", f"quasi_rigid_rate_{axis}"
    drawn = [
        (run, flight, flight.time >= share * flight.time[-1], look)
        for (run, flight), look in zip(flights, RUNS, strict=True)
        if x in flight.signals and y in flight.signals
    ]
    if not drawn:
        return panel(axes, title, "not recorded", "")
    (sx, px), (sy, py) = (prefix(max(_peak(f[s][late]) for _, f, late, _ in drawn)) for s in (x, y))
    for run, flight, late, (color, width) in drawn:
        points = flight[x][late] / sx, flight[y][late] / sy
        axes.plot(*points, color=color, linewidth=width, label=run)
    labels = f"quasi-rigid angle {axis}, {px}rad", f"quasi-rigid rate {axis}, {py}rad/s"
    return panel(axes, title, *labels)


def _thrust(axes: Axes, flights: Named, share: float, when: str) -> None:
    """The first channels of both, as delivered, over the first or the last seconds."""
    channels = [n.removesuffix("_command") for n in flights[0][1].signals if n.endswith("_command")]
    end = share * min(float(flight.time[-1]) for _, flight in flights)
    start = max(end - NEAR, 0.0)
    for k, channel in enumerate(channels[:3]):
        for (run, flight), (color, width) in zip(flights, RUNS, strict=True):
            if channel in flight.signals:
                look = {"color": color, "linewidth": width, "linestyle": DASHES[k]}
                value = flight[channel]
                axes.step(flight.time, value, where="post", label=f"{run}: {channel}", **look)
    axes.set_xlim(start, start + NEAR)
    panel(axes, f"Thrust as delivered, {when}", "time, s", "N or N m")


def _table(axes: Axes, table: Sequence[tuple[str, Sequence[tuple[str, ...]]]]) -> None:
    axes.set_axis_off()
    lines: list[tuple[str, ...]] = []
    for heading, rows in table:
        lines += [(heading.upper(),), *(rows or [("none",)])]
    count = max(len(lines), 2 * ROWS)
    axes.set(xlim=(0, 1), ylim=(count, -1))
    for head, x in (("A", 0.66), ("B", 0.83), ("B - A", 1.0)):
        axes.text(x, -0.5, head, size=9, weight="bold", color=SOFT, ha="right", va="center")
    for k, cells in enumerate(lines):
        heading = len(cells) == 1 and cells[0].isupper()
        style = {"size": 8, "va": "center", "color": SOFT if heading else INK}
        axes.text(0.0, k + 0.5, _short(cells[0], 46), weight="bold" if heading else None, **style)
        for text, x in zip(cells[1:], (0.66, 0.83, 1.0), strict=False):
            wide = 20 if cells[2:3] != ("",) else 60
            axes.text(x, k + 0.5, _short(text, wide), ha="right", **style)


def _short(text: str, length: int) -> str:
    return text if len(text) <= length else f"{text[: length - 1]}…"


def _peak(value: Array) -> float:
    return float(np.abs(value).max(initial=0.0))
