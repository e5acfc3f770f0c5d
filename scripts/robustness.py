"""Flies the laws of Efremov et al. (2006) on MuJoCo plants other than those they were made for.

Stiffness, mass, damping and delay are off by up to 20 %; the disturbance is a square wave at the
bound of the theorem, in step with the limit cycle or a few times slower. A claim whose assumption
fails is reported as not guaranteed, whatever was measured.
"""

import argparse
import sys

from spacecraft_sim import mission

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
WORST = 'disturbance.z={{amplitude={:.6g}, frequency={:.6g}, waveform="square"}}'
INERTIA, CYCLE = 1183.2375, 0.826439  # kg m^2 and s, of the machine as designed
LAWS = {  # scenario, bound of |f/J|, rad/s^2
    "efremov-nonlocal": 0.0045 * 0.31 / 2,
    "efremov-local": 0.31**2 * 0.007 / 4,
}


def variations(limit: float) -> dict[str, tuple[str, ...]]:
    """Returns the variations, the worst disturbances at a bound among them.

    Args:
        limit: Bound of |f/J|, rad/s^2.
    """
    found = dict(VARIATIONS)
    for ratio in (1.0, 0.5, 1 / 3, 0.1):
        setting = WORST.format(0.999 * limit * INERTIA, ratio * 2 * 3.141592653589793 / CYCLE)
        found[f"square f at bound, {ratio:.2g} x cycle"] = (setting,)
    return found


def main(argv: list[str] | None = None) -> int:
    """Prints a line for each law and variation.

    Args:
        argv: Words of the command line; those of the process if left out.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--duration", type=float, default=150.0, help="of each flight, s")
    duration = parser.parse_args(argv).duration
    print(f"{'law':18}{'variation':32}{'|beta|/eps':>11}{'|v|/bound':>11}  verdict on beta")
    broken = 0
    for law, limit in LAWS.items():
        for name, settings in variations(limit).items():
            scenario = mission.load_scenario(law, (f"duration={duration}", *settings))
            ready = mission.assemble(scenario)
            flight = ready.fly()
            verdicts = {g.claim: g.check(flight) for g in ready.guarantees}
            kept = verdicts["|beta/J| < eps from the predicted time on"]
            rate = verdicts["|v/J| in the end"]
            failed = "; ".join(a.text for a in kept.failed)
            word = "holds" if kept.holds else f"not guaranteed: {failed}" if failed else "BROKEN"
            broken += word == "BROKEN"
            shares = kept.measured / kept.bound, rate.measured / rate.bound
            print(f"{law:18}{name:32}{shares[0]:11.3f}{shares[1]:11.3f}  {word}")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
