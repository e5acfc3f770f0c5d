"""Prints the regulator of maximal guaranteed accuracy beside the usual ones, in one scenario.

One thruster with a minimum on-time, one steady torque, one disturbance: what each law holds, how
often it fires and what it spends.
"""

import argparse
import sys

from support import regulators

HEAD = f"{'regulator':40s} {'limsup |x|':>12s} {'over p0':>9s} {'firings/h':>10s}"
HEAD += f" {'on-time, s/h':>13s} {'spent, N s/h':>13s}  worst disturbance"


def main(argv: list[str] | None = None) -> int:
    """Flies the regulators and prints a table.

    Args:
        argv: Words of the command line; those of the process if left out.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--duration", type=float, default=300.0, help="of each flight, s")
    parser.add_argument("--short", action="store_true", help="do not tune the usual ones")
    arguments = parser.parse_args(argv)
    print(HEAD)
    p0 = 0.0
    for row, disturbance in regulators.flown(arguments.duration, tune=not arguments.short):
        p0 = p0 or row.worst
        print(
            f"{row.name:40s} {row.worst:9.3e} rad {row.worst / p0:9.4f} {row.firings:10.0f}"
            f" {row.on_time:13.0f} {row.impulse:13.2f}  {disturbance}"
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
