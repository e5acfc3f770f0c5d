"""Panels of a flight's page for machines without a quasi-rigid motion: arms and turning bodies."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes

from spacecraft_sim.plots import PLANTS, Flights, panel, prefix
from spacecraft_sim.plots_film import BOOMS
from spacecraft_sim.trajectory import Trajectory

Panel = Callable[[Axes, Flights, bool], None]  # draws the whole flight, or its end
WHEN = ("whole flight", "end of the flight")
_SHOWN = 9  # curves that a panel can carry


def panels(measured: Trajectory) -> tuple[Panel, ...]:
    """Returns the four panels that suit a flight: positions, rates, torques, and the difference.

    Args:
        measured: Flight of the full plant.
    """
    names = list(measured.signals)
    torques = [name for name in names if f"{name}_command" in measured.signals]
    rates = [n for n in names if n.endswith("_rate") or n.startswith("rate_")]
    vectors = [n for n in names if n[:3] in ("s2_", "s3_")]
    angles = [n for n in names if f"{n}_rate" in measured.signals]
    places, what = (vectors, "Directions") if vectors else (angles, "Joint angles")
    return (
        _curves(what, places, measured),
        _curves("Rates", rates, measured),
        _curves("Torques", torques, measured),
        _difference(places, measured),
    )


def _curves(title: str, names: Sequence[str], measured: Trajectory) -> Panel:
    """Named signals over time, the reduced plant wide below."""

    def draw(axes: Axes, flights: Flights, zoom: bool) -> None:
        peak = max((float(np.abs(flights[1][n]).max()) for n in names), default=0.0)
        scale, letter = prefix(peak)
        for k, name in enumerate(names[:_SHOWN]):
            color = BOOMS[k % len(BOOMS)]
            if name in flights[0].signals:
                look = {"color": PLANTS[0][1], "linewidth": 3.2, "alpha": 0.45}
                axes.plot(flights[0].time, flights[0][name] / scale, **look)
            dashes = ("-", "--")[k // len(BOOMS)]
            look = {"color": color, "linewidth": 1.2, "linestyle": dashes}
            axes.plot(
                flights[1].time, flights[1][name] / scale, label=name.replace("_", " "), **look
            )
        axes.set_xlim(flights[1].time[0], flights[1].time[-1])
        unit = "N m" if title == "Torques" else measured.units[names[0]] if names else ""
        words = f"{title}, {WHEN[zoom]}; time in s"
        panel(axes, words, "", f"{letter}{unit}" or "component", below=True)

    return draw


def _difference(names: Sequence[str], measured: Trajectory) -> Panel:
    """How far the two plants are apart, on a logarithmic scale."""

    def draw(axes: Axes, flights: Flights, zoom: bool) -> None:
        predicted, flown = flights
        time, i, j = np.intersect1d(predicted.time, flown.time, return_indices=True)
        for k, name in enumerate(n for n in names[:_SHOWN] if n in predicted.signals):
            gap = np.maximum(np.abs(flown[name][j] - predicted[name][i]), 1e-17)
            axes.semilogy(
                time, gap, color=BOOMS[k % len(BOOMS)], linewidth=1.0, label=name.replace("_", " ")
            )
        unit = measured.units[names[0]] if names else ""
        words = f"MuJoCo minus reduced, {WHEN[zoom]}; time in s"
        panel(axes, words, "", f"|difference|, {unit or '1'}", below=True)

    return draw
