"""Controls of least peak and of least fuel under a bound, by convex duality and Newton's method.

Everything here is in the manoeuvre's own units (`moment_problem`), s in [0, 1].

Least peak (Gorelov, p = 1).  m = max {l . c : int |h_l| = 1}; the control is m sign h_l.
Least fuel with |u| <= m0.  fuel = max l . c - m0 int (|h_l| - 1)_+; the control is m0 sign h_l
where |h_l| >= 1, else zero.  The printed rule takes h_l of the unbounded problem; l depends on m0.

Either way the control is a pattern of levels e_j in {-1, 0, 1} between edges s_j, and the optimum
satisfies, with rho the inverse of the peak and h_l at unit distance from zero at the edges of a
pause,

    sum e_j int h = rho c,    h_l(s_j) = e_(j-1) + e_j.

Newton's method solves for edges and l at once; eliminating the edges would leave the Jacobian
sum (e_(j-1) - e_j)^2 h h^T/|h_l'|, which is infinite where two edges meet.  A pattern is accepted
only if its moments are met and l proves, by duality, that no control is better by 1e-10; by 1e-7
if rounding lets no grid do better.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from controllers.completion import ALIKE, completed, has_moments
from controllers.extremal_lp import Guess, least_fuel_guess, least_peak_guess
from controllers.moment_problem import Problem, with_ends
from controllers.moments import Array

GAP = 1e-10  # between the cost of a control and its lower bound, relative
_LOOSE = 1e-7  # the gap that is accepted where rounding keeps it open
_ROUNDS = 10  # of refining the grid of the linear program


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Extremal:
    """A control between levels of one size.

    Attributes:
        edges: Times to go at which the level changes, ascending, in (0, 1).
        pattern: -1, 0 or 1 between the edges, from s = 0 on.
        multipliers: l.
        peak: Size of the levels.
        cost: What is least: the peak, or the fuel.
        lower: Lower bound of the cost that l proves.
    """

    edges: Array
    pattern: Array
    multipliers: Array
    peak: float
    cost: float
    lower: float

    @property
    def gap(self) -> float:
        """Distance of the cost from its bound, relative."""
        return abs(self.cost - self.lower) / self.cost


@dataclass(frozen=True, slots=True, kw_only=True)
class _Kind:
    """What is to be least.

    Attributes:
        thresholds: Values of h_l between which the pattern is constant.
        pattern: The pattern there.
        settle: Control and bound from a guess.
        program: Guess from a grid.
    """

    thresholds: tuple[float, ...]
    pattern: tuple[float, ...]
    settle: Callable[[Guess], Extremal | None]
    program: Callable[[Array], Guess]


def least_peak(problem: Problem, *, near: Extremal | None = None) -> Extremal:
    """Finds the control of least peak.

    Args:
        problem: The moments wanted.
        near: The optimum of a problem close by, tried first.

    Raises:
        ArithmeticError: If no control passes the test of optimality.
    """

    def settle(guess: Guess) -> Extremal | None:
        found = _newton(problem, guess, None)
        if found is None:
            return None
        edges, e = problem.crossings(found.multipliers, kind.thresholds, kind.pattern)
        lam = found.multipliers / (found.multipliers @ problem.of_switched(edges, e))
        return replace(found, multipliers=lam, cost=found.peak, lower=float(lam @ problem.target))

    kind = _Kind(
        thresholds=(0.0,),
        pattern=(-1.0, 1.0),
        settle=settle,
        program=lambda nodes: least_peak_guess(problem, nodes),
    )
    if near is not None:
        found = settle(Guess(near.edges, near.pattern, near.multipliers, near.peak))
        if found is not None and _proven(problem, found):
            return found
    return _search(problem, kind)


def least_fuel(problem: Problem, bound: float, *, peak: Extremal) -> Extremal:
    """Finds the control of least fuel among those within a bound, where it is unique.

    Args:
        problem: The moments wanted.
        bound: m0, above the least peak.
        peak: The control of least peak, which shows that there is one.

    Raises:
        ArithmeticError: If no control passes the test of optimality.
    """

    def fuel(edges: Array, e: Array) -> float:
        return bound * float(np.diff(with_ends(edges)) @ np.abs(e))

    def settle(guess: Guess) -> Extremal | None:
        found = _newton(problem, guess, bound)
        if found is None:
            return None
        lam = found.multipliers
        edges, e = problem.crossings(lam, kind.thresholds, kind.pattern)
        excess = bound * float(lam @ problem.of_switched(edges, e)) - fuel(edges, e)
        cost, lower = fuel(found.edges, found.pattern), float(lam @ problem.target) - excess
        return replace(found, cost=cost, lower=lower)

    feasible = max(bound, peak.peak * (1 + 1e-8))  # beyond the tolerance of HiGHS
    kind = _Kind(
        thresholds=(-1.0, 1.0),
        pattern=(-1.0, 0.0, 1.0),
        settle=settle,
        program=lambda nodes: least_fuel_guess(problem, feasible, np.union1d(nodes, peak.edges)),
    )
    if 0 < bound / peak.peak - 1 < 1e-3 and len(peak.edges):
        found = settle(_with_pauses(problem, peak, bound))
        if found is not None and _proven(problem, found):
            return found
    return _search(problem, kind)


def _with_pauses(problem: Problem, peak: Extremal, bound: float) -> Guess:
    """The control of least fuel where little more than the least peak is allowed.

    With l . c = 1 the pauses are where |h_l| < theta, theta^2 m sum 1/|h_l'| = (m0 - m)/m.
    """
    lam = peak.multipliers / (peak.multipliers @ problem.target)
    widths = 1 / np.abs(lam @ problem.slopes(peak.edges))
    theta = float(np.sqrt((bound / peak.peak - 1) / (peak.peak * widths.sum())))
    edges = np.stack([peak.edges - theta * widths, peak.edges + theta * widths], axis=1).ravel()
    pattern = np.zeros(len(edges) + 1)
    pattern[::2] = peak.pattern
    return Guess(edges=edges, pattern=pattern, multipliers=lam / theta, peak=bound)


def _search(problem: Problem, kind: _Kind) -> Extremal:
    """Solves on a grid, then exactly; refines the grid where that shows it to be too coarse."""
    nodes, best = problem.grid(), None
    # More edges are rounding errors about zero.
    most = 4 * len(problem.target) + int(max(problem.modes.omega))
    for _ in range(_ROUNDS):
        primal = kind.program(nodes)
        lam = primal.multipliers
        dual = Guess(*problem.crossings(lam, kind.thresholds, kind.pattern), lam, primal.peak)
        extra = [dual.edges, primal.edges]
        for guess in (dual, primal):
            found = kind.settle(guess) if len(guess.edges) <= most else None
            if found is None:
                continue
            extra += [
                found.edges,
                problem.crossings(found.multipliers, kind.thresholds, kind.pattern)[0],
            ]
            if found.gap < _LOOSE and not _has_moments(problem, found):
                found = _complete(problem, found, kind)
            if _proven(problem, found):
                return found
            if _has_moments(problem, found) and (best is None or found.gap < best.gap):
                best = found
        nodes = refined(nodes, np.concatenate(extra))
    if best is not None and best.gap < _LOOSE:
        return best
    omega = ", ".join(f"{w:.3g}" for w in problem.modes.omega)
    reached = "none has its moments" if best is None else f"the best is within {best.gap:.1e}"
    raise ArithmeticError(
        f"no control passes the test of optimality: {reached}, {GAP} is asked for; omega T = "
        f"{omega} may be too small, or two modes too much alike, for the moments to differ in "
        "double precision"
    )


def _complete(problem: Problem, x: Extremal, kind: _Kind) -> Extremal:
    """The control with its moments put right; the bound stays, the cost hardly changes."""
    fuel = len(kind.pattern) == 3
    pulses = tuple(x.peak * e for e in kind.pattern)
    edges, levels = completed(problem, x.edges, x.peak * x.pattern, pulses, x.multipliers)
    peak, lengths = float(np.max(np.abs(levels))), np.diff(with_ends(edges))
    cost = float(lengths @ np.abs(levels)) if fuel else peak
    return replace(x, edges=edges, pattern=np.sign(levels), peak=peak, cost=cost)


def refined(nodes: Array, extra: Array) -> Array:
    """Returns a grid with more nodes, and more cells around these, but none closer than 1e-7.

    Args:
        nodes: The grid.
        extra: The nodes to be added.
    """
    k = np.clip(np.searchsorted(nodes, extra), 1, len(nodes) - 1)
    left, right = nodes[k - 1], nodes[k]
    more = [left + (right - left) * x for x in (0.25, 0.5, 0.75)]
    nodes = np.unique(np.concatenate([nodes, extra, *more]))
    keep = np.diff(nodes, prepend=-1.0) > 1e-7
    keep[-1] = True
    return nodes[keep]


def _has_moments(problem: Problem, x: Extremal) -> bool:
    return has_moments(problem, x.edges, x.peak * x.pattern)


def _proven(problem: Problem, x: Extremal) -> bool:
    """Whether the control meets its moments and its cost the lower bound.

    An edge is known to some eps, a moment therefore to eps m, and l times that is seen in the cost.
    """
    unsure = 4 * np.finfo(float).eps * x.peak * float(np.linalg.norm(x.multipliers)) / x.cost
    return x.gap < min(GAP + unsure, _LOOSE) and _has_moments(problem, x)


def _newton(problem: Problem, guess: Guess, bound: float | None) -> Extremal | None:
    """Solves the conditions of optimality from a guess; edges that meet leave the pattern.

    Unknown are the edges, l with l . c = 1, and one number: rho if no bound is given, otherwise
    the size of h_l at an edge, which is near zero where the bound is near the least peak.
    """
    edges, e, c = guess.edges, guess.pattern, problem.target
    value = float(guess.multipliers @ c)
    lam, n, best = guess.multipliers / value, len(c), np.inf
    rho = 1 / (bound or guess.peak)
    threshold = 1 / value if bound else 0.0
    for _ in range(40):
        k, h, at_edge = len(edges), problem.functions(edges), e[:-1] + e[1:]
        error = np.concatenate(
            [problem.defect(edges, e, rho), lam @ h - threshold * at_edge, [lam @ c - 1]]
        )
        size = float(np.max(np.abs(error)))
        if size < 1e-15 or (size < 1e-9 and size > best / 2):
            break
        best = size if size < 1e-6 else np.inf
        J = np.zeros((n + k + 1, n + k + 1))
        J[:n, :k] = h * (e[:-1] - e[1:])
        J[n:-1, :k], J[n:-1, k:-1] = np.diag(lam @ problem.slopes(edges)), h.T
        J[-1, k:-1] = c
        if bound:
            J[n:-1, -1] = -at_edge
        else:
            J[:n, -1] = -c
        step = np.linalg.lstsq(J, -error, rcond=ALIKE)[0]
        lam = lam + step[k:-1]
        rho, threshold = (rho, threshold + step[-1]) if bound else (rho + step[-1], 0.0)
        moved = _moved(edges, e, step[:k])
        if moved is None or not (rho > 0 and threshold >= 0):
            return None
        edges, e = moved
    else:
        return None
    if bound and threshold == 0:
        return None
    return Extremal(
        edges=edges,
        pattern=e,
        multipliers=lam / threshold if bound else lam,
        peak=1 / rho,
        cost=np.nan,
        lower=np.nan,
    )


def _moved(edges: Array, e: Array, step: Array) -> tuple[Array, Array] | None:
    """Edges after a step; one that leaves (0, 1) goes, and so do two that pass each other."""
    full = with_ends(edges + step)
    while np.any(gone := np.diff(full) <= 0):
        j = int(np.argmax(gone))  # between full[j] and full[j + 1]
        if len(full) == 2:
            return None
        if j == 0:
            full, e = np.delete(full, 1), e[1:]
        elif j == len(full) - 2:
            full, e = np.delete(full, -2), e[:-1]
        elif e[j - 1] == e[j + 1]:
            full, e = np.delete(full, [j, j + 1]), np.delete(e, [j, j + 1])
        else:
            return None
    return full[1:-1], e
