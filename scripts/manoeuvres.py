"""Flies one slew planned in many ways and prints what each leaves of vibration, and what it costs.

Seven profiles at one duration on the full machine: then modes added to the plan, frequencies off,
thrust that goes off late, a minimum on-time.  With --out a picture of duration against fuel and
residual.
"""

import argparse
import sys
from pathlib import Path

from support import manoeuvre_figure, manoeuvres

HEAD = f"{'':34s}{'modes':>5s}{'T, s':>8s}{'peak, N m':>11s}{'fuel, N m s':>12s}"
HEAD += f"{'MuJoCo, rad':>13s}{'linear, rad':>13s}{'miss, rad':>11s}"


def main(argv: list[str] | None = None) -> int:
    """Prints the tables.

    Args:
        argv: Words of the command line; those of the process if left out.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--machine", default="two_boom", help="two_boom or two_boom_free")
    parser.add_argument("--time", type=float, default=65.0, help="duration of the slew, s")
    parser.add_argument("--short", action="store_true", help="two profiles and no variations")
    parser.add_argument("--out", type=Path, help="PNG file for the picture")
    arguments = parser.parse_args(argv)
    base = manoeuvres.scenario(arguments.machine, (f"duration={arguments.time + 60}",))
    print(HEAD)
    tables = list(manoeuvres.tables(base, arguments.time, 1))
    for table in tables[: 2 if arguments.short else None]:
        line(table["profile"], manoeuvres.flown(base, table))
    if not arguments.short:
        for name, result in manoeuvres.variations(base, arguments.time):
            line(name, result)
    if arguments.out:
        manoeuvre_figure.write(arguments.out, base, short=arguments.short)
        print(f"duration against fuel and residual: {arguments.out}")
    return 0


def line(name: str, r: manoeuvres.Result) -> None:
    """Prints one manoeuvre.

    Args:
        name: Its name.
        r: Its outcome.
    """
    cost = f"{r.modes:5d}{r.duration:8.2f}{r.peak:11.4f}{r.fuel:12.3f}"
    print(f"{name:34s}{cost}{r.mujoco:13.3e}{r.reduced:13.3e}{r.error:11.2e}")


if __name__ == "__main__":
    sys.exit(main())
