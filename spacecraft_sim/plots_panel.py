"""The look of the panels of all pages: titles, keys, axes, units, colours of axes."""

import math

from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from spacecraft_sim.plots_film import INK, SOFT
from spacecraft_sim.plots_table import fit

DPI = 100  # dots an inch
TITLE = (10.5, 9.5, 8.5)  # sizes of the letters of a title, points
BEYOND = 0.03  # share of a panel by which a title may be wider
AXES = {  # colours of the flight on top and of the one beneath, as in the report
    "x": ("#c2366b", "#b99bf0"),
    "y": ("#178a52", "#d8bf3a"),
    "z": ("#1f6fd6", "#f2a24b"),
}


def panel(axes: Axes, title: str, x: str = "", y: str = "", below: bool = False) -> None:
    """Gives axes the look of this house.

    Args:
        axes: The axes.
        title: What they show.
        x: Label of the x axis.
        y: Label of the y axis.
        below: Whether the key, if there is one, stands under the axes and not over them.
    """
    look = {"size": TITLE[0], "color": INK, "weight": "bold"}
    drawn = axes.set_title(title, loc="left", y=1.0, pad=5, **look)
    fit(drawn, axes.get_window_extent().width * (1 + BEYOND), TITLE)
    axes.set_xlabel(x, size=9, color=SOFT, labelpad=2)
    axes.set_ylabel(y, size=9, color=SOFT, labelpad=3)
    axes.tick_params(labelsize=8.5, colors=SOFT, length=3)
    axes.grid(color="#e3e7ee", linewidth=0.7)
    axes.set_axisbelow(True)
    for axis in (axes.xaxis, axes.yaxis):  # an offset would stand in the title
        if isinstance(shown := axis.get_major_formatter(), ScalarFormatter):
            shown.set_useOffset(False)
            shown.set_scientific(False)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color("#b9c0cc")
    handles = axes.get_legend_handles_labels()[0]
    if handles:
        deep = (0.45 if x else 0.19) * DPI / axes.get_window_extent().height  # under the ticks
        place = {"loc": "upper left", "bbox_to_anchor": (0, -deep)} if below else {}
        place = place or {"loc": "lower right", "bbox_to_anchor": (1.01, 0.985)}
        rows = math.ceil(len(handles) / (4 if x else 6)) if below else 1
        columns = math.ceil(len(handles) / rows)  # rows of one length
        look = {"fontsize": 8.5, "frameon": False, "borderpad": 0.2}
        if not x:  # a narrow panel
            look |= {"handlelength": 1.0, "columnspacing": 0.9, "handletextpad": 0.4}
        axes.legend(ncols=columns, **look, **place)


def time_axis(axes: Axes, start: float, end: float) -> None:
    """Sets the limits of a time axis, its ticks with their unit.

    Args:
        axes: The axes.
        start: Where it begins, s.
        end: Where it ends, s.
    """
    axes.set_xlim(start, end)
    axes.xaxis.set_major_locator(MaxNLocator(6, steps=(1, 2, 5, 10)))
    axes.xaxis.set_major_formatter(lambda t, _: f"{t:g} s")


def prefix(peak: float) -> tuple[float, str]:
    """Returns a scale that brings the peak above one half, and the prefix of the unit.

    Args:
        peak: The largest value, in the unit itself.
    """
    prefixes = ((1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p"), (1e-15, "f"))
    return next((p for p in prefixes if peak >= p[0] / 2), prefixes[0])
