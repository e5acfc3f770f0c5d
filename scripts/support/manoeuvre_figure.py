"""Duration against fuel and residual vibration, for every profile."""

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from spacecraft_sim import mission
from spacecraft_sim.scenario import Scenario
from support.manoeuvres import PROFILES, planned, swing_left

COLORS = ("#1f6fd6", "#d8432f", "#1f8f4d", "#6b7484", "#8a4fd0", "#c98a00", "#178d99")


def write(path: Path, base: Scenario, *, short: bool = False) -> None:
    """Draws fuel, peak, nominal residual and residual 10 % off over the duration.

    Args:
        path: The PNG file.
        base: The slew.
        short: Whether a few durations will do.
    """
    model, angle = mission.assemble(base).linear_model, base.controller["angle"]
    inertia = 1 / model.gain("thruster_z", "quasi_rigid_rate_z")
    slowest = 2 * np.pi / float(model.frequencies[0])
    durations = slowest * np.linspace(1.4, 9.0, 4 if short else 60)
    figure = Figure(figsize=(17, 10), dpi=100)
    FigureCanvasAgg(figure)
    axes = figure.subplots(2, 2)
    figure.subplots_adjust(left=0.06, right=0.985, top=0.9, bottom=0.06, hspace=0.24, wspace=0.14)
    words = "a slew by 0.7 rad: the plan knows one mode, the machine has eight"
    figure.suptitle(f"What a manoeuvre costs and leaves, {words}", weight="bold", size=15)
    for profile, color in zip(PROFILES, COLORS, strict=True):
        rows = []
        for T in durations.tolist():
            try:
                plan = planned(model, profile, angle, T, 1)
            except ValueError:  # a shaper is longer than the manoeuvre
                continue
            left = [swing_left(plan, model, factor=f) for f in (1.0, 1.1)]
            rows.append((T, inertia * plan.fuel, inertia * plan.peak, *left))
        table = np.array(rows).T
        for axis, values in zip(axes.ravel(), table[1:], strict=True):
            axis.plot(table[0], values, color=color, label=profile, linewidth=1.6)
    titles = (
        ("fuel, N m s", "Impulse spent"),
        ("peak torque, N m", "Largest torque"),
        ("swing of the bus, rad", "Vibration left, all modes, frequencies as planned"),
        ("swing of the bus, rad", "Vibration left, all modes, frequencies 10 % higher"),
    )
    for axis, (label, title) in zip(axes.ravel(), titles, strict=True):
        axis.set(xlabel="duration, s", ylabel=label, yscale="log")
        axis.set_title(title, loc="left", weight="bold", size=11)
        axis.grid(color="#e3e7ee", linewidth=0.7, which="both")
        axis.spines[["top", "right"]].set_visible(False)
        axis.legend(fontsize=9, ncols=2)
    figure.savefig(path)
