"""What exact propagation of a delayed relay costs, beside adaptive and fixed-step integration."""

import statistics

import numpy as np

from support import relay_rivals as rivals
from support.flight_cost import seconds, spread


def beside_rivals(*, rounds: int) -> None:
    """Prints the ratios of cost to the rivals at their best, in interleaved rounds.

    Args:
        rounds: Interleaved rounds.
    """
    case = rivals.system()
    run = rivals.exact(case)
    exact_times, n = run.switch_times, len(run.switch_times)
    tolerances = (1e-6, 1e-8, 1e-10, 1e-12)
    cost: dict[str, list[float]] = {"exact": [], "fixed": [], **{f"{r}": [] for r in tolerances}}
    for _ in range(rounds):
        cost["exact"].append(min(seconds(lambda: rivals.exact(case)) for _ in range(5)))
        cost["fixed"].append(seconds(lambda: rivals.fixed_step(case, dt=1e-3)))
        for rtol in tolerances:
            cost[f"{rtol}"].append(seconds(lambda r=rtol: rivals.adaptive(case, rtol=r)))
    micro = statistics.median(cost["exact"]) / n * 1e6
    print(f"exact relay propagation: {n - 1} switchings in 100 s, {micro:.0f} us a switching")
    for rtol in tolerances:
        found = rivals.adaptive(case, rtol=rtol)
        error = np.max(np.abs(found[:n] - exact_times[: len(found)]))
        ratios = [a / b for a, b in zip(cost[f"{rtol}"], cost["exact"], strict=True)]
        print(
            f"  DOP853 with events, rtol {rtol:g} / exact: {spread(ratios, 0)}; error {error:.0e} s"
        )
    found = rivals.fixed_step(case, dt=1e-3)
    error = np.max(np.abs(found[:100] - exact_times[:100]))
    ratios = [a / b for a, b in zip(cost["fixed"], cost["exact"], strict=True)]
    print(f"  fixed step of 1 ms / exact: {spread(ratios, 0)}; error {error:.0e} s")


def growth(*, longest: float) -> None:
    """Prints the cost of a switching as the run and the number of modes grow.

    Args:
        longest: Length of the longest run, s.
    """
    case = rivals.system()
    for duration in (longest / 100, longest / 10, longest):
        run = rivals.exact(case, duration)
        elapsed = seconds(lambda d=duration: rivals.exact(case, d))
        n = len(run.switch_times)
        print(f"  {n} switchings: {elapsed / n * 1e6:.0f} us each")
    for modes in (1, 3, 10, 30):
        case = rivals.system(modes)
        n = len(rivals.exact(case).switch_times)
        elapsed = statistics.median(seconds(lambda c=case: rivals.exact(c)) for _ in range(3))
        print(f"  {modes} modes: {elapsed / n * 1e6:.0f} us a switching")
