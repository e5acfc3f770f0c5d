"""The search for a disturbance that breaks the bound of Ivanova & Sokolov (1999), or comes nearest.

Tried are the 16 feedbacks eps = +-e by thrust off or on and sign of v, (3.2), (3.3), (3.6) and
(3.7) among them; those with the sign flipped within each arc, at rates found by a local search;
pairs of feedbacks in turn, as in the proof of Lemma 3.4, one to creep up and one to strike; and
programmes of time.  The search proves nothing: it finds a counterexample or it does not.
"""

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from controllers.contour import Contour
from spacecraft_sim.parabola_arcs import (
    Disturbance,
    Signs,
    alternating,
    feedback,
    flipped,
    program,
    propagate,
)
from spacecraft_sim.switching_curves import Relay

OUTER = Signs(1, -1, 1, -1)  # (3.2)
INNER = Signs(-1, 1, -1, 1)  # (3.3)
LEFTMOST = Signs(1, -1, -1, -1)  # (3.6)
RIGHTMOST = Signs(-1, 1, 1, -1)  # (3.7)
FEEDBACKS = tuple(Signs(*signs) for signs in itertools.product((1, -1), repeat=4))
_HALVINGS = 12  # of the step of a local search


@dataclass(frozen=True, slots=True, kw_only=True)
class Worst:
    """The worst that was found.

    Attributes:
        figure: limsup |x|/p, or the share of an excess that a turn left.
        disturbance: In words.
        runs: How many runs it took.
    """

    figure: float
    disturbance: str
    runs: int


class _Best:
    """Keeps the worst of many runs."""

    def __init__(self) -> None:
        self.figure, self.disturbance, self.runs = -float("inf"), "", 0

    def offer(self, figure: float, disturbance: str) -> float:
        self.runs += 1
        if figure > self.figure:
            self.figure, self.disturbance = figure, disturbance
        return figure

    def worst(self) -> Worst:
        return Worst(figure=self.figure, disturbance=self.disturbance, runs=self.runs)


def worst_limsup(
    relay: Relay,
    c: Contour,
    *,
    bound: float | None = None,
    starts: Sequence[tuple[float, float]] | None = None,
    switchings: int = 200,
    flips: int = 0,
    pairs: Sequence[tuple[int, int]] = (),
    programmes: int = 0,
    rng: np.random.Generator | None = None,
) -> Worst:
    """Searches for the largest |x| in the end, over the half width.

    Args:
        relay: The law.
        c: The contour whose half width the figure is taken over.
        bound: Size of the disturbance over the thrust; e of the contour if left out.
        starts: (x, v) of the starts; left, right and in the contour if left out.
        switchings: Switchings of a run, of which the second half counts.
        flips: How many feedbacks, the worst first, to flip within their arcs.
        pairs: Switchings (m, n) for which all 256 pairs are tried: m of one, n of the other.
        programmes: How many random programmes of time to try.
        rng: Source of randomness; needed for programmes.

    Returns:
        The worst.

    Raises:
        ValueError: If programmes are asked for without a source of randomness.
    """
    e = c.eps if bound is None else bound
    places = starts or ((-6 * c.p, 0.0), (6 * c.p, 0.0), (-0.99 * c.p, 0.0))
    best = _Best()

    def run(disturbance: Disturbance, words: str) -> float:
        figures = []
        for start in places:
            flight = propagate(
                relay, start=start, bias=c.F, disturbance=disturbance, switchings=switchings
            )
            late = float(flight.times[flight.switch_arcs[switchings // 2]])
            figures.append(best.offer(flight.largest(after=late) / c.p, words))
        return max(figures)

    ranked = sorted(FEEDBACKS, key=lambda s: -run(feedback(e, s), f"feedback {tuple(s)}"))
    for signs in ranked[:flips]:
        _search(lambda r, s=signs: run(flipped(e, s, r), f"{tuple(s)} flipped at {tuple(r)}"), c)
    for (many, few), a, b in itertools.product(pairs, FEEDBACKS, FEEDBACKS):
        turns = [feedback(e, a)] * many + [feedback(e, b)] * few
        words = f"{many} switchings of {tuple(a)}, {few} of {tuple(b)}"
        run(alternating(turns, switchings=1), words)
    for _ in range(programmes):
        if rng is None:
            raise ValueError(f"programmes = {programmes} are random: give rng")
        run(*_random_programme(e, rng))
    return best.worst()


def worst_turn(relay: Relay, c: Contour, *, excess: float, flips: int = 4) -> Worst:
    """Searches for the turn that leaves most of an excess of -x over p.

    Args:
        relay: The law.
        c: The contour.
        excess: Excess over p at the left turning point, in units of p.
        flips: How many feedbacks, the worst first, to flip within their arcs.

    Returns:
        The worst share that is left at the next left turning point.
    """
    best = _Best()

    def run(disturbance: Disturbance, words: str) -> float:
        peaks, switchings = [], 3
        while len(peaks) < 2:  # far out Example 2 takes several pulses to turn
            flight = propagate(
                relay,
                start=(-(1 + excess) * c.p, 0.0),
                bias=c.F,
                disturbance=disturbance,
                switchings=switchings,
            )
            peaks, switchings = flight.peaks.tolist(), 4 * switchings
        return best.offer((-peaks[1] / c.p - 1) / excess, words)

    ranked = sorted(FEEDBACKS, key=lambda s: -run(feedback(c.eps, s), f"feedback {tuple(s)}"))
    for signs in ranked[:flips]:
        _search(
            lambda r, s=signs: run(flipped(c.eps, s, r), f"{tuple(s)} flipped at {tuple(r)}"),
            c,
            reach=4 * (1 + excess) ** 0.5,
        )
    return best.worst()


def _search(figure: Callable[[Signs], float], c: Contour, *, reach: float = 4.0) -> None:
    """Compass search over the four rates at which a feedback flips, from no flip at all."""
    top = reach * max(c.A1.v, -c.A2.v)
    rates, step = [top] * 4, top / 2
    value = figure(Signs(*rates))
    for _ in range(_HALVINGS):
        moved = True
        while moved:
            moved = False
            for i, way in itertools.product(range(4), (-step, step)):
                trial = rates.copy()
                trial[i] = min(max(trial[i] + way, 0.0), top)
                if trial != rates and (found := figure(Signs(*trial))) > value * (1 + 1e-12):
                    rates, value, moved = trial, found, True
        step /= 2


def _random_programme(e: float, rng: np.random.Generator) -> tuple[Disturbance, str]:
    """A bang-bang function of time with exponential intervals."""
    mean = float(rng.uniform(0.1, 3.0))
    times = np.cumsum(rng.exponential(mean, size=2000))
    values = e * (-1.0) ** np.arange(2001)
    return program(times.tolist(), values.tolist()), f"signs in turn, {mean:.3g} each on average"
