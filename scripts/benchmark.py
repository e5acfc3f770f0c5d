"""Prints what things cost, as ratios taken in one run: medians of several interleaved rounds.

Times of one machine say little; the ratios carry over.
"""

import argparse
import sys

from support import certificate_cost, flight_cost, plan_cost, recording_cost, relay_cost


def main(argv: list[str] | None = None) -> int:
    """Runs the benchmarks.

    Args:
        argv: Words of the command line; those of the process if left out.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7, help="interleaved rounds")
    parser.add_argument("--span", type=float, default=5.0, help="simulated time of a round, s")
    parser.add_argument("--duration", type=float, default=448.8, help="of the whole run, s")
    parser.add_argument("--longest", type=float, default=77000.0, help="longest relay run, s")
    arguments = parser.parse_args(argv)
    flight_cost.controlled_step(span=arguments.span, rounds=arguments.rounds)
    flight_cost.whole_run(duration=arguments.duration, rounds=min(arguments.rounds, 3))
    plan_cost.beside_cvxpy(rounds=min(arguments.rounds, 3))
    certificate_cost.four_booms(rounds=min(arguments.rounds, 3))
    certificate_cost.growth(rounds=min(arguments.rounds, 3))
    recording_cost.recording(duration=arguments.duration, rounds=min(arguments.rounds, 5))
    relay_cost.beside_rivals(rounds=min(arguments.rounds, 3))
    relay_cost.growth(longest=arguments.longest)
    return 0


if __name__ == "__main__":
    sys.exit(main())
