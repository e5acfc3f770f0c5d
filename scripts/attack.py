"""Tries to pass the guaranteed bound of the elastic moment: worst, random and searched switchings.

Each flight on MuJoCo is held to the bound of Sokolov (2004), with 2 % for what small motion leaves
out. Where small motion ends the bound may be passed: the assumption that failed is named, and such
a flight is never said to keep it.
"""

import argparse
import sys
from itertools import chain

from support import attacks

HEAD = f"{'flight':46s} {'M0':>6s} {'M_e':>10s} {'exists':>10s} {'measured':>10s} {'/M_e':>7s}"
HEAD += f" {'/exists':>8s}  verdict"


def main(argv: list[str] | None = None) -> int:
    """Flies the attacks and prints a table; returns 1 if a bound is broken.

    Args:
        argv: Words of the command line; those of the process if left out.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--longest", type=float, default=400.0, help="flights are cut to this, s")
    parser.add_argument("--evaluations", type=int, default=300, help="flights of each search")
    arguments = parser.parse_args(argv)
    print(HEAD)
    broken = 0
    for row in chain(
        attacks.worst_phase(arguments.longest),
        attacks.at_random(arguments.longest),
        attacks.spinning(arguments.longest),
        attacks.searched(arguments.evaluations, arguments.longest),
    ):
        share = f"{row.measured / row.bound:7.4f}" if row.bound else "      -"
        attained = f"{row.measured / row.worst:8.4f}" if row.worst == row.worst else "       -"
        exists = f"{row.worst:10.5g}" if row.worst == row.worst else "         -"
        print(
            f"{row.what:46s} {row.torque:6g} {row.bound:10.5g} {exists} {row.measured:10.5g}"
            f" {share} {attained}  {row.word}"
        )
        broken += row.word == "BROKEN"
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
