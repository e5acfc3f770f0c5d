"""Panels of a flight's page for machines without a quasi-rigid motion: arms and turning bodies."""

import math
from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter

from spacecraft_sim.families import families
from spacecraft_sim.plots import Flights
from spacecraft_sim.plots_film import BOOMS
from spacecraft_sim.plots_panel import panel, prefix, time_axis
from spacecraft_sim.trajectory import Trajectory

Panel = Callable[[Axes, Flights, bool], None]  # draws the whole flight, or its end
COLORS = (*BOOMS, "#2b6cd4", "#8a5a33", "#6b7484", "#97a800")  # of the curves of a panel
UNIT_VECTORS = "of unit vectors"  # in place of a unit
_LEAST = 1e-17  # difference that a logarithmic axis shows as zero


def panels(measured: Trajectory, vectors: Sequence[str]) -> tuple[Panel, ...]:
    """Returns the four panels that suit a flight: places, rates, torques, and the difference.

    Args:
        measured: Flight of the full plant.
        vectors: Names of the fixed directions that are shown.
    """
    found = families(measured, vectors)
    curves = (_curves(title, names, measured) for title, names in found.items())
    return (*curves, _difference(next(iter(found.values())), measured))


def _curves(title: str, names: Sequence[str], measured: Trajectory) -> Panel:
    """Named signals over time, the reduced plant wide below."""

    def draw(axes: Axes, flights: Flights, zoom: bool) -> None:
        peak = max((float(np.abs(flights[1][n]).max()) for n in names), default=0.0)
        scale, letter = prefix(peak)
        for k, name in enumerate(names[: len(COLORS)]):
            if name in flights[0].signals:
                values = flights[0][name] / scale
                axes.plot(flights[0].time, values, color=COLORS[k], linewidth=5.0, alpha=0.3)
            values = flights[1][name] / scale
            words = name.removesuffix("_rate").replace("_", " ")
            label = None if zoom else words  # the panel above has the key
            axes.plot(flights[1].time, values, label=label, color=COLORS[k], linewidth=1.2)
        time_axis(axes, flights[1].time[0], flights[1].time[-1])
        unit = measured.units[names[0]] if names else ""
        more = f"; {len(COLORS)} of {len(names)}" if len(names) > len(COLORS) else ""
        panel(axes, f"{title}, {f'{letter}{unit}' if unit else UNIT_VECTORS}{more}", below=True)

    return draw


def _difference(names: Sequence[str], measured: Trajectory) -> Panel:
    """How far the two plants are apart, on a logarithmic scale."""

    def draw(axes: Axes, flights: Flights, zoom: bool) -> None:
        predicted, flown = flights
        time, i, j = np.intersect1d(predicted.time, flown.time, return_indices=True)
        for k, name in enumerate(n for n in names[: len(COLORS)] if n in predicted.signals):
            gap = np.maximum(np.abs(flown[name][j] - predicted[name][i]), _LEAST)
            look = {"color": COLORS[k], "linewidth": 1.0}
            label = None if zoom else name.replace("_", " ")
            axes.semilogy(time, gap, label=label, **look)
        time_axis(axes, flown.time[0], flown.time[-1])
        low, high = np.log10(axes.get_ylim())
        axes.set_ylim(10.0 ** math.floor(low), 10.0 ** math.ceil(high))  # whole decades have names
        axes.yaxis.set_minor_formatter(NullFormatter())
        unit = measured.units[names[0]] if names else ""
        panel(axes, f"MuJoCo minus reduced, {unit or UNIT_VECTORS}", below=True)

    return draw
