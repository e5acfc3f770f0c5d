"""The fuel that no bound on the thrust can save: the limit of impulses.

Gorelov, (10) to (12) with p = infinity.  The infimum of int |u| over all controls is
max {l . c : |h_l| <= 1 on [0, T]}; impulses where |h_l| = 1 attain it, and on-off controls come as
close as their bound is high.
"""

from dataclasses import dataclass

import numpy as np

from controllers.extremal_lp import solved
from controllers.moment_problem import Problem, crossings, problem_of, with_ends
from controllers.moments import Array, Numbers, modes_of, share
from controllers.plans import read_only

_GAP = 1e-11  # between the impulses and the bound that l proves, relative
_ROUNDS = 10  # of refining the grid of the linear program


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ImpulseLimit:
    """Impulses that do a manoeuvre with the least fuel.

    Attributes:
        fuel: Sum of |impulse|, the infimum of int |u| over all controls.
        times: When they come, ascending, in [0, T], s.
        impulses: Their sizes, N m s or rad/s.
        residual: Largest error of a moment as a share of the manoeuvre, see `moments.share`.
        normal: Whether the multipliers fix the impulses; if not, others cost as little.
        multipliers: l, with |h_l| <= 1 and l . c = fuel.
        duration: T, s.
    """

    fuel: float
    times: Array
    impulses: Array
    residual: float
    normal: bool
    multipliers: Array
    duration: float


def impulse_limit(
    *,
    omega: Numbers,
    damping: Numbers,
    duration: float,
    x1: float,
    x0: float = 0.0,
    v0: float = 0.0,
    v1: float = 0.0,
) -> ImpulseLimit:
    """Finds the least fuel of all controls, which impulses need.

    Args:
        omega: w of the mode, or one a mode, rad/s.
        damping: b of the mode, the coefficient of y', or one a mode, 1/s.
        duration: T, s.
        x1: x at the end.
        x0: x at the start.
        v0: x' at the start, per s.
        v1: x' at the end, per s.

    Raises:
        ValueError: If a number is out of range, a mode is not underdamped, or the manoeuvre is
            empty.
        ArithmeticError: If impulses and bound do not come together.
    """
    modes = modes_of(omega, damping)
    problem = problem_of(modes, duration=duration, x0=x0, v0=v0, x1=x1, v1=v1)
    nodes = problem.grid()
    gap = np.inf
    for _ in range(_ROUNDS):
        rough = _on_grid(problem, nodes)
        for s, impulses, lam in (rough, _newton(problem, *_merged(nodes, *rough))):
            turns = _extremes(problem, lam)
            highest = float(np.max(np.abs(lam @ problem.functions(turns))))
            fuel, lower = float(np.abs(impulses).sum()), float(lam @ problem.target) / highest
            gap = abs(fuel / lower - 1)
            found = _limit(problem, s, impulses, lam / highest)
            if gap < _GAP and found.residual < _GAP:
                return found
            nodes = np.union1d(nodes, turns)
    raise ArithmeticError(f"impulses and their bound stay {gap:.1e} apart; {_GAP} is asked for")


def _on_grid(problem: Problem, nodes: Array) -> tuple[Array, Array, Array]:
    """Times to go, impulses and l' of the least fuel with impulses at the nodes."""
    q, n = problem.functions(nodes), len(nodes)
    x, lam = solved(
        cost=np.ones(2 * n),
        equations=np.column_stack([q, -q]),
        right=problem.target,
        low=np.zeros(2 * n),
        high=np.full(2 * n, np.inf),
    )
    impulses = x[:n] - x[n:]
    used = np.abs(impulses) > 1e-9 * np.abs(impulses).sum()
    return nodes[used], impulses[used], lam


def _merged(nodes: Array, s: Array, impulses: Array, lam: Array) -> tuple[Array, Array, Array]:
    """Impulses of one sign at neighbouring nodes as one between them."""
    neighbours = np.diff(np.searchsorted(nodes, s)) == 1
    apart = ~neighbours | (np.diff(np.sign(impulses)) != 0)
    groups = np.concatenate([[0], np.cumsum(apart)])
    sums = np.bincount(groups, impulses)
    return np.bincount(groups, impulses * s) / sums, sums, lam


def _newton(problem: Problem, s: Array, impulses: Array, lam: Array) -> tuple[Array, Array, Array]:
    """Solves sum p_i q(s_i) = c, h_l(s_i) = sign p_i and, between the ends, h_l'(s_i) = 0."""
    k, n, signs = len(s), len(lam), np.sign(impulses)
    inner = (s > 1e-9) & (s < 1 - 1e-9)
    for _ in range(10):
        q, slopes = problem.functions(s), problem.slopes(s)
        bend = [problem.curve(lam).derivative().derivative()(x)[0] for x in s]
        J = np.zeros((n + 2 * k, n + 2 * k))
        J[:n, :k], J[:n, k : 2 * k] = impulses * slopes, q
        J[n : n + k, :k], J[n : n + k, 2 * k :] = np.diag(lam @ slopes), q.T
        J[n + k :, :k], J[n + k :, 2 * k :] = np.diag(bend), slopes.T
        J[n + k :][~inner] = 0.0
        J[n + k :, :k][~inner] = np.eye(k)[~inner]  # an impulse at an end stays there
        error = np.concatenate(
            [problem.excess(s, impulses), lam @ q - signs, np.where(inner, lam @ slopes, 0.0)]
        )
        x = np.linalg.lstsq(J, -error, rcond=1e-13)[0]
        if np.any(np.abs(s + x[:k] - 0.5) > 0.5):
            break
        s, impulses, lam = s + x[:k], impulses + x[k : 2 * k], lam + x[2 * k :]
    return s, impulses, lam


def _extremes(problem: Problem, lam: Array) -> Array:
    """Where h_l may be largest: its turns and the ends."""
    slope = problem.curve(lam).derivative()
    return with_ends(crossings(slope, (0.0,), (-1.0, 1.0))[0])


def _limit(problem: Problem, s: Array, impulses: Array, lam: Array) -> ImpulseLimit:
    """The result in the units of the manoeuvre."""
    got = problem.modes.functions(s) @ impulses
    constant = np.max(np.abs(np.abs(lam @ problem.functions(np.linspace(0, 1, 33))) - 1)) < 1e-9
    unit, T = problem.unit * problem.duration, problem.duration
    return ImpulseLimit(
        fuel=unit * float(np.abs(impulses).sum()),
        times=read_only(T * (1 - s[::-1])),
        impulses=read_only(unit * impulses[::-1]),
        residual=share(problem.modes, got - problem.moments, problem.moments, 1.0),
        normal=not constant,
        multipliers=read_only(problem.multipliers(lam)),
        duration=T,
    )
