"""Machines and disturbances other than those the laws of Efremov et al. (2006) are made for."""

import math

QUIET = ("disturbance.z.amplitude=0.0",)
VARIATIONS: dict[str, tuple[str, ...]] = {
    "as designed": QUIET,
    "EI +20 %": (*QUIET, "actual.booms.all.bending_stiffness=42.0"),
    "EI -20 %": (*QUIET, "actual.booms.all.bending_stiffness=28.0"),
    "boom mass +20 %": (*QUIET, "actual.booms.all.linear_density=1.836"),
    "boom mass -20 %": (*QUIET, "actual.booms.all.linear_density=1.224"),
    "damping +20 %": (*QUIET, "actual.booms.all.damping_time=0.02225"),
    "damping -20 %": (*QUIET, "actual.booms.all.damping_time=0.01483"),
    "delay -20 %": (*QUIET, "actual.thrusters.all.delay=0.16"),
    "delay +20 %": (*QUIET, "actual.thrusters.all.delay=0.24"),
    "delay 2 to 198 ms": (
        *QUIET,
        "actual.thrusters.all.delay={mean=0.1, amplitude=0.098, frequency=3.0}",
    ),
}
ONE_SIZE = (
    "thrusters.thruster_z.levels=[1.193945799375]",
    "controller.attraction_level=1.193945799375",
)
WORST = 'disturbance.z={{amplitude={:.6g}, frequency={:.6g}, waveform="square"}}'
INERTIA, CYCLE = 1183.2375, 0.826439  # kg m^2 and s, of the machine as designed
LAWS = {  # scenario, bound of |f/J|, rad/s^2
    "efremov-nonlocal": 0.0045 * 0.31 / 2,
    "efremov-local": 0.31**2 * 0.007 / 4,
}


def variations(law: str, limit: float) -> dict[str, tuple[str, ...]]:
    """Returns the variations, the worst disturbances at a bound among them.

    Args:
        law: Name of the scenario.
        limit: Bound of |f/J|, rad/s^2.
    """
    found = dict(VARIATIONS)
    if law == "efremov-local":
        found["one thruster size"] = (*QUIET, *ONE_SIZE)
    for ratio in (1.0, 0.5, 1 / 3, 0.1):
        setting = WORST.format(0.999 * limit * INERTIA, ratio * 2 * math.pi / CYCLE)
        found[f"square f at bound, {ratio:.2g} x cycle"] = (setting,)
    return found
