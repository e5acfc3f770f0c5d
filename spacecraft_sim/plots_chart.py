"""The charts of a law on one page: phase portraits with the flight, pulses, maps of parameters."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.collections import LineCollection
from matplotlib.colors import to_rgb
from matplotlib.figure import Figure

from spacecraft_sim.chart import (
    Charts,
    Line,
    Map,
    Portrait,
    Region,
    counted,
    half_width,
    locked,
    portraits,
    pulses,
    worst_to_come,
)
from spacecraft_sim.plots import BAD, GOOD, INK, MINUS, PLUS, SOFT
from spacecraft_sim.plots_panel import DPI, panel, prefix
from spacecraft_sim.trajectory import Trajectory, between_rows

Array = np.ndarray

LOOKS = {
    "bound": {"color": GOOD, "linewidth": 3.4},
    "switching": {"color": "#7a3fb5", "linewidth": 1.6, "linestyle": "--"},
    "aid": {"color": SOFT, "linewidth": 0.9},
}
REGIONS = ("#ffca85", "#8fbcf5", "#bda7e8", "#93d6a6")
FLIGHT = "#1f6fd6"


def page(path: Path, *, measured: Trajectory, charts: Charts, title: str) -> None:
    """Draws the charts of a law, one row a portrait and one for the maps.

    Args:
        path: The PNG file.
        measured: The flight.
        charts: Portraits and maps.
        title: One line over the page.
    """
    drawn, maps = portraits(charts), [chart for chart in charts if isinstance(chart, Map)]
    rows = max(len(drawn), 1)
    figure = Figure(figsize=(18.0, 9.6 * rows + 1.1), dpi=DPI)
    FigureCanvasAgg(figure)
    figure.text(0.012, 1 - 0.3 / (9.6 * rows + 1.1), title, size=17, weight="bold", color=INK,
                va="center")  # fmt: skip
    grid = figure.add_gridspec(
        rows, 2, left=0.05, right=0.985, top=1 - 0.9 / (9.6 * rows + 1.1),
        bottom=1.05 / (9.6 * rows + 1.1), wspace=0.16, hspace=0.2, width_ratios=(1.15, 1),
    )  # fmt: skip
    for k, portrait in enumerate(drawn):
        _portrait(figure.add_subplot(grid[k, 0]), portrait, measured)
        mine = maps[k : k + 1]
        side = grid[k, 1].subgridspec(2 + len(mine), 1, hspace=0.42,
                                      height_ratios=(1, 1, *(1.5 for _ in mine)))  # fmt: skip
        _history(figure.add_subplot(side[0]), portrait, measured)
        _pulses(figure.add_subplot(side[1]), portrait, measured)
        for j, chart in enumerate(mine):
            _map(figure.add_subplot(side[2 + j]), chart)
    figure.savefig(path, pil_kwargs={"compress_level": 3})


def _portrait(axes: Axes, portrait: Portrait, measured: Trajectory) -> None:
    """Regions, lines, the flight; the flight is wide and red where the thruster may not stop."""
    x, y = (measured[name] for name in portrait.signals)
    (sx, px), (sy, py) = _scales(portrait, x, y)
    _regions(axes, portrait.regions, (sx, sy))
    _lines(axes, portrait.lines, (sx, sy))
    pieces = between_rows(measured.time, x, y) / (sx, sy)
    look = {"color": FLIGHT, "linewidth": 1.0, "label": "flight", "zorder": 4}
    axes.add_collection(LineCollection(list(pieces), **look))
    if portrait.min_on_time:
        young = locked(measured, portrait)
        look = {"color": BAD, "linewidth": 1.8, "label": "minimum on-time running", "zorder": 5}
        axes.add_collection(LineCollection(list(pieces[young[:-1]]), **look))
    axes.plot(x[0] / sx, y[0] / sy, "o", color=INK, markersize=5, label="start", zorder=6)
    half = [half_width(portrait, k) / (sx, sy)[k] for k in (0, 1)]
    axes.set(xlim=(-half[0], half[0]), ylim=(-half[1], half[1]))
    labels = [
        f"{name.replace('_', ' ')}, {letter}{measured.units[name]}"
        for name, letter in zip(portrait.signals, (px, py), strict=True)
    ]
    panel(axes, portrait.title, labels[0], labels[1], below=True)


def _regions(axes: Axes, regions: Sequence[Region], scales: tuple[float, float]) -> None:
    """Shaded in turn; they may overlap, so each has a hatching of its own."""
    for region, color, hatch in zip(regions, REGIONS, ("", "//", "..", "xx"), strict=False):
        look = {"facecolor": (*to_rgb(color), 0.5), "edgecolor": color, "hatch": hatch}
        axes.fill(*(region.outline / scales).T, label=region.name, linewidth=0.8, zorder=1, **look)


def _scales(portrait: Portrait, x: Array, y: Array) -> tuple[tuple[float, str], tuple[float, str]]:
    half = [half_width(portrait, k) for k in (0, 1)]
    return prefix(half[0] or float(np.abs(x).max())), prefix(half[1] or float(np.abs(y).max()))


def _lines(axes: Axes, lines: Sequence[Line], scales: tuple[float, float]) -> None:
    named: set[str] = set()
    for line in lines:
        label = None if line.name in named else line.name
        named.add(line.name)
        axes.plot(*(line.points / scales).T, label=label, zorder=3, **LOOKS[line.look])


def _history(axes: Axes, portrait: Portrait, measured: Trajectory) -> None:
    """The angle over its band, and the worst that is still to come."""
    name = portrait.signals[0]
    value, band = measured[name], portrait.band
    scale, letter = prefix(2 * band if band else float(np.abs(value).max()))
    if band:
        axes.axhspan(-band / scale, band / scale, color=GOOD, alpha=0.12, linewidth=0)
        axes.axhline(band / scale, color=GOOD, linewidth=1.2, label="guaranteed")
        axes.axhline(-band / scale, color=GOOD, linewidth=1.2)
        axes.set_ylim(-2 * band / scale, 2 * band / scale)
    axes.plot(measured.time, value / scale, color=FLIGHT, linewidth=1.0, label="flight")
    axes.plot(measured.time, worst_to_come(value) / scale, color=BAD, linewidth=1.2,
              label="largest still to come")  # fmt: skip
    axes.set_xlim(measured.time[0], measured.time[-1])
    words = name.replace("_", " ")
    panel(axes, "In its band", "time, s", f"{words}, {letter}{measured.units[name]}")


def _pulses(axes: Axes, portrait: Portrait, measured: Trajectory) -> None:
    """A stem a pulse: when it began and how long it was, over the minimum."""
    thrust = measured[portrait.channel]
    start, length = pulses(measured.time, thrust)
    positive = np.array([measured[portrait.channel][np.searchsorted(measured.time, t)] > 0
                         for t in start], dtype=bool)  # fmt: skip
    for mask, color, word in ((positive, PLUS, "positive"), (~positive, MINUS, "negative")):
        if mask.any():
            axes.vlines(start[mask], 0, length[mask], color=color, linewidth=1.0, alpha=0.6)
            axes.plot(start[mask], length[mask], ".", color=color, label=f"{word} pulse")
    if portrait.min_on_time:
        axes.axhline(portrait.min_on_time, color=INK, linewidth=1.2, label="minimum on-time")
    axes.set_xlim(measured.time[0], measured.time[-1])
    axes.set_ylim(0, 1.35 * max(length.max(initial=0.0), portrait.min_on_time, 1e-9))
    panel(axes, counted(portrait, length), "time, s", "length, s")


def _map(axes: Axes, chart: Map) -> None:
    _regions(axes, chart.regions, (1.0, 1.0))
    looks = ("-", "--", "-.", ":")
    for line, dashes in zip(chart.lines, looks * len(chart.lines), strict=False):
        axes.plot(*line.points.T, color=INK, linewidth=1.2, linestyle=dashes, label=line.name)
    axes.plot(*chart.point, "*", color=BAD, markersize=15, label="here", zorder=9)
    panel(axes, chart.title, *chart.labels, below=True)
