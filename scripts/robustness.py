"""Flies the laws of Efremov et al. (2006) on MuJoCo plants other than those they were made for.

Stiffness, mass, damping and delay are off by up to 20 %; the disturbance is a square wave at the
bound of the theorem, in step with the limit cycle or a few times slower. A claim whose assumption
fails is reported as not guaranteed, whatever was measured.
"""

import argparse
import sys

from spacecraft_sim import mission
from support.variations import LAWS, variations


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
        for name, settings in variations(law, limit).items():
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
