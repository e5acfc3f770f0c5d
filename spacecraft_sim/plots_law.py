"""Panels of a flight's page that a law asks for: histories that it computes, vectors on spheres."""

from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes

from spacecraft_sim import spans, sphere
from spacecraft_sim.chart import Charts, History, Sphere, floor, histories, path_of, series, spheres
from spacecraft_sim.plots import GOOD, INK, PLANTS, SOFT, Flights
from spacecraft_sim.plots_film import BOOMS, PLUS, SHADE
from spacecraft_sim.plots_panel import panel, prefix, time_axis
from spacecraft_sim.sketch import View
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray
Panel = Callable[[Axes, Flights], None]

_ROWS = 4000  # of a flight at which a history is computed
_BACK = 0.35  # opacity of what is at the back of a sphere


def panels(charts: Charts, measured: Trajectory) -> tuple[Panel, ...]:
    """Returns a panel for each history and each sphere of a law that a flight can show.

    Args:
        charts: What the law draws.
        measured: Flight of the full plant.
    """
    over_time = tuple(_history(chart) for chart in histories(charts, measured))
    return over_time + tuple(_sphere(chart) for chart in spheres(charts, measured))


def _history(history: History) -> Panel:
    """The curves of the full plant; of the reduced one what the history is about, wide below."""

    def draw(axes: Axes, flights: Flights) -> None:
        predicted, measured = flights
        time, values = series(history, measured, _ROWS)
        least, peak = floor(history, values[0]), float(np.abs(values).max(initial=0.0))
        plain = history.decades or not history.unit[:1].isalpha()
        scale, letter = (1.0, "") if plain else prefix(peak)

        def shown(values: Array) -> Array:
            return np.where(values >= least, values, np.nan) if history.decades else values / scale

        if history.heads and all(name in predicted.signals for name in history.signals):
            below, heads = series(history, predicted, _ROWS)
            look = {"color": PLANTS[0][1], "linewidth": 3.2, "alpha": 0.6}
            axes.plot(below, shown(heads[:, history.heads]), **look)
        for curve, value in zip(history.curves, shown(values).T, strict=True):
            color = INK if curve.hue is None else BOOMS[curve.hue % len(BOOMS)]
            width, alpha = (4.0, 0.35) if curve.beneath else (1.2, 1.0)
            order = 2.0 if curve.hue is not None else 3.0  # what it is about lies on top
            look = {"color": color, "linewidth": width, "alpha": alpha, "zorder": order}
            axes.plot(time, value, label=None if curve.beneath else curve.name, **look)
        if history.decades:
            axes.set_yscale("log")
        else:
            end = _active(time, values)
            time, values = time[time <= end], values[time <= end]
        time_axis(axes, time[0], time[-1])
        panel(axes, f"{history.title}, {letter}{history.unit or '-'}", below=True)

    return draw


def _active(time: Array, values: Array) -> float:
    """Until when there is something to see of curves that come to rest, s."""
    names = [str(k) for k in range(values.shape[1])]
    signals = dict(zip(names, values.T, strict=True))
    flight = Trajectory(time=time, signals=signals, units=dict.fromkeys(names, ""))
    end = spans.transient(flight, names)
    return end if end < 0.7 * time[-1] else float(time[-1])


def _sphere(chart: Sphere) -> Panel:
    """The sphere as it is seen from where the targets are; pale: its back."""

    def draw(axes: Axes, flights: Flights) -> None:
        view = sphere.view(chart)
        angle = np.linspace(0, 2 * np.pi, 181)
        circle = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        axes.fill(*circle.T, facecolor=SHADE, edgecolor=SOFT, linewidth=0.8, zorder=0)
        for line in sphere.net():
            _curve(axes, view, line, {"color": SOFT, "linewidth": 0.6})
        for k, name in enumerate("xyz"):
            place = view.project(1.12 * np.eye(3)[k])
            back = np.eye(3)[k] @ view.near < 0
            style = {"ha": "center", "va": "center", "size": 9, "color": SOFT}
            axes.text(place[0], place[1], name, alpha=_BACK if back else 1.0, **style)
        for k, arrow in enumerate(chart.arrows):
            color, target = BOOMS[k % len(BOOMS)], np.array(arrow.target)
            if arrow.basin is not None:
                dashes = {"color": color, "linewidth": 1.0, "linestyle": (0, (4, 2))}
                _curve(axes, view, arrow.basin, dashes)
            for flight, (plant, _, _) in zip(flights, PLANTS, strict=True):
                if not all(name in flight.signals for name in arrow.signals):
                    continue
                track, full = path_of(arrow, flight), plant == "MuJoCo"
                look = {"color": color if full else PLANTS[0][1], "linewidth": 1.4 if full else 3.4}
                _curve(axes, view, track, look | {"label": arrow.name if full else None})
            track = path_of(arrow, flights[1])
            _mark(axes, view, track[0], {"marker": "o", "color": INK, "markersize": 5})
            _mark(axes, view, target, {"marker": "*", "color": GOOD, "markersize": 13})
            _mark(axes, view, -target, {"marker": "X", "color": PLUS, "markersize": 7})
        axes.plot([], [], "o", color=INK, markersize=5, label="start")
        axes.plot([], [], "*", color=GOOD, markersize=10, label="goal")
        axes.plot([], [], "X", color=PLUS, markersize=6, label="unstable")
        axes.set(xlim=(-1.25, 1.25), ylim=(-1.2, 1.2), aspect="equal")
        axes.set_axis_off()
        axes.set_anchor("W")
        panel(axes, chart.title)
        axes.legend(loc="center left", bbox_to_anchor=(1.0, 0.5), fontsize=8.5, frameon=False)
        words = f"{chart.frame}; pale: at the back"
        words += f"\ndashed: {chart.bound}" if chart.bound else ""
        axes.text(-1.2, -1.1, words, size=8.5, color=SOFT, ha="left", va="top")

    return draw


def _curve(axes: Axes, view: View, points: Array, look: dict) -> None:
    """A curve on the sphere, pale where it is at the back."""
    front, back = sphere.sides(points, view.near)
    axes.plot(*view.project(back).T, **{**look, "label": None}, alpha=_BACK, zorder=1)
    axes.plot(*view.project(front).T, **look, zorder=3)


def _mark(axes: Axes, view: View, point: Array, look: dict) -> None:
    alpha = 1.0 if point @ view.near >= 0 else _BACK
    axes.plot(*view.project(point), linestyle="", alpha=alpha, zorder=5, **look)
