"""The counterpart of the paper's figure 4: beta, v, gamma, q and u of both plants over time."""

from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from spacecraft_sim.scenario import Scenario
from spacecraft_sim.trajectory import Trajectory

CYCLES = 10  # of the relay, shown at the end of the flight
INK, SOFT, BAND = "#1d2430", "#6b7484", "#1f8f4d"
# The thin line lies over the wide one: where both are seen, the plants agree.
PLANTS = (("reduced model, one mode", "#f29b38", 3.4), ("MuJoCo", "#1f6fd6", 1.2))
WHEN = ("whole flight", "end of the flight")
# Symbol and name, signal, unit, scale, whether the accuracy is drawn as a band.
PANELS = (
    (r"$\beta/J$, quasi-rigid angle of bus and booms", "quasi_rigid_angle_z", "mrad", 1e3, True),
    (r"$v/J$, its rate", "quasi_rigid_rate_z", "mrad/s", 1e3, False),
    (r"$\gamma$, attitude of the bus", "attitude_z", "mrad", 1e3, True),
    (r"$q$ = half the tip deflection", "left_tip_y", "mm", 0.5e3, False),
    (r"$u$, thrust as delivered", "thruster_z", "N m", 1.0, False),
)


def write(path: Path, measured: Trajectory, predicted: Trajectory, scenario: Scenario) -> None:
    """Draws five stacked panels, the whole flight on the left, its end on the right.

    Args:
        path: The PNG file.
        measured: Flight of the full plant.
        predicted: Flight of the reduced model.
        scenario: What was flown.
    """
    figure = Figure(figsize=(15, 13), dpi=100)
    FigureCanvasAgg(figure)  # the figure keeps it
    grid = figure.add_gridspec(
        len(PANELS), 2, width_ratios=[1.35, 1], left=0.065, right=0.985, top=0.885, bottom=0.05,
        hspace=0.32, wspace=0.12,
    )  # fmt: skip
    end = float(measured.time[-1])
    eps = scenario.controller["accuracy"]
    spans = (0.0, end), (_last_cycles(measured), end)
    for row, (name, signal, unit, scale, banded) in enumerate(PANELS):
        for column, span in enumerate(spans):
            axes = figure.add_subplot(grid[row, column])
            for flight, (label, color, width) in zip((predicted, measured), PLANTS, strict=True):
                rows = _rows(flight.time, span)
                value = scale * flight[signal][rows]
                if signal == "thruster_z":
                    style = {"drawstyle": "steps-post", "linewidth": min(width, 0.4 + 2 * column)}
                else:
                    style = {"linewidth": width if column else 0.7 * width}
                axes.plot(flight.time[rows], value, color=color, label=label, **style)
            if banded:
                axes.axhspan(-eps * scale, eps * scale, color=BAND, alpha=0.13, linewidth=0)
            title = f"{name}, {WHEN[column]}"
            _dress(axes, title, unit, span, bottom=row == len(PANELS) - 1)
    lines, labels = axes.get_legend_handles_labels()
    figure.legend(
        lines, labels, loc="upper right", bbox_to_anchor=(0.985, 0.957), ncols=2, frameon=False
    )
    figure.text(0.065, 0.969, scenario.title, size=16, weight="bold", color=INK)
    words = (
        f"Efremov, Polyakov & Strygin (2006), section 5, the authors' boom; green: ±{eps:g} rad.\n"
        "The booms do not act on β and v; γ and q carry modes that the reduced model leaves out."
    )
    figure.text(0.065, 0.96, words, size=11, color=SOFT, va="top", linespacing=1.5)
    figure.savefig(path)


def _dress(axes: Axes, title: str, unit: str, span: tuple[float, float], *, bottom: bool) -> None:
    axes.set_xlim(*span)
    axes.set_ylabel(unit, size=10, color=SOFT)
    axes.set_title(title, size=11, color=INK, loc="left", pad=5)
    axes.tick_params(labelsize=9, colors=SOFT, labelbottom=bottom)
    axes.grid(color="#e3e7ee", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)
    axes.spines[["left", "bottom"]].set_color("#b9c0cc")
    if bottom:
        axes.set_xlabel("time, s", size=10, color=SOFT)


def _rows(time: np.ndarray, span: tuple[float, float]) -> slice:
    """The rows of a span, with one more on either side for the lines to cross its ends."""
    first, last = np.searchsorted(time, span, side="left")
    return slice(max(int(first) - 1, 0), int(last) + 2)


def _last_cycles(measured: Trajectory) -> float:
    """Start of the last cycles of the thrust, at most the last tenth of the flight, s."""
    on = measured["thruster_z"] > 0
    rising = measured.time[1:][on[1:] & ~on[:-1]]
    latest = float(measured.time[-1]) * 0.9
    return max(latest, float(rising[-CYCLES - 1])) if len(rising) > CYCLES else latest
