"""Linear programs for controls that are constant on the cells of a grid: where Newton starts.

The moments of such a control are exact, so what a program returns is a control that does the
manoeuvre; its dual values are multipliers.  At most as many cells as there are moments lie between
the levels; each is replaced by levels switched inside it.
"""

from typing import NamedTuple

import numpy as np

from controllers.moment_problem import Problem
from controllers.moments import Array

_TIGHT = 1e-10  # tolerance of HiGHS, which is absolute
_FULL = 1e-7  # a cell this close to a level is on it


class Guess(NamedTuple):
    """Where Newton's method starts.

    Attributes:
        edges: Times to go at which the level changes, ascending, in (0, 1).
        pattern: -1, 0 or 1 between the edges, from s = 0 on.
        multipliers: l.
        peak: Size of the levels.
    """

    edges: Array
    pattern: Array
    multipliers: Array
    peak: float


def least_peak_guess(problem: Problem, nodes: Array) -> Guess:
    """Returns the control of least peak on a grid.

    Args:
        problem: The moments wanted.
        nodes: The grid over [0, 1].
    """
    A, d = _cells(problem, nodes)
    # Maximise r with int h v = r c, |v| <= 1.
    x, lam = solved(
        cost=np.append(np.zeros_like(d), -1.0),
        equations=np.column_stack([A, -problem.target]),
        right=np.zeros_like(problem.target),
        low=np.append(-d, -np.inf),
        high=np.append(d, np.inf),
    )
    edges, pattern = _switched(nodes, x[:-1] / d, (-1.0, 1.0))
    return Guess(edges=edges, pattern=pattern, multipliers=lam, peak=1 / x[-1])


def least_fuel_guess(problem: Problem, bound: float, nodes: Array) -> Guess:
    """Returns the control of least fuel on a grid.

    Args:
        problem: The moments wanted.
        bound: m0.
        nodes: The grid over [0, 1].
    """
    A, d = _cells(problem, nodes)
    # In units of the bound, thrust of either sign apart.
    x, lam = solved(
        cost=np.ones(2 * len(d)),
        equations=np.column_stack([A, -A]),
        right=problem.target / bound,
        low=np.zeros(2 * len(d)),
        high=np.concatenate([d, d]),
    )
    v = (x[: len(d)] - x[len(d) :]) / d
    edges, pattern = _switched(nodes, v, (-1.0, 0.0, 1.0))
    return Guess(edges=edges, pattern=pattern, multipliers=lam, peak=bound)


def one_signed_guess(problem: Problem, bound: float, nodes: Array) -> Guess:
    """Returns a control of one sign on a grid, its thrust gathered about the middle.

    Args:
        problem: The moments wanted, which a control in [0, m0] has.
        bound: m0.
        nodes: The grid over [0, 1].
    """
    A, d = _cells(problem, nodes)
    middles = (nodes[1:] + nodes[:-1]) / 2
    x, lam = solved(
        cost=(middles - 0.5) ** 2 + d**2 / 12,
        equations=A,
        right=problem.target / bound,
        low=np.zeros_like(d),
        high=d,
    )
    edges, pattern = _switched(nodes, x / d, (0.0, 1.0))
    return Guess(edges=edges, pattern=pattern, multipliers=lam, peak=bound)


def _cells(problem: Problem, nodes: Array) -> tuple[Array, Array]:
    """Means of the moment functions over the cells, and the lengths of the cells."""
    d = np.diff(nodes)
    return np.diff(problem.integrals(nodes)) / d, d  # HiGHS drops entries below 1e-9


def solved(
    *, cost: Array, equations: Array, right: Array, low: Array, high: Array
) -> tuple[Array, Array]:
    """Returns the solution of a linear program and the dual values of its equations.

    Args:
        cost: To be least.
        equations: Matrix.
        right: What it takes the solution to.
        low: Bounds from below.
        high: Bounds from above.

    Raises:
        ArithmeticError: If HiGHS finds none.
    """
    from scipy.optimize import linprog

    result = linprog(
        cost,
        A_eq=equations,
        b_eq=right,
        bounds=np.column_stack([low, high]),
        method="highs",
        options={"primal_feasibility_tolerance": _TIGHT, "dual_feasibility_tolerance": _TIGHT},
    )
    if result.status != 0:
        raise ArithmeticError(f"HiGHS found no control on a grid: {result.message}")
    return result.x, result.eqlin.marginals


def _switched(nodes: Array, v: Array, levels: tuple[float, ...]) -> tuple[Array, Array]:
    """Edges and pattern of a control whose cells between two levels switch inside instead."""
    v = np.clip(v, levels[0], levels[-1])
    nearest = np.array(levels)[np.argmin(np.abs(v[:, None] - levels), axis=1)]
    edges, pattern = [0.0], []
    for k, x in enumerate(v):
        start, d = nodes[k], nodes[k + 1] - nodes[k]
        if abs(x - nearest[k]) < _FULL:
            pieces = [(nodes[k + 1], nearest[k])]
        else:
            low = max(level for level in levels if level < x)
            high = min(level for level in levels if level > x)
            part = d * (x - low) / (high - low)  # time at the upper level
            if k and nearest[k - 1] >= high:
                pieces = [(start + part, high), (nodes[k + 1], low)]
            else:
                pieces = [(start + d - part, low), (nodes[k + 1], high)]
        for end, level in pieces:
            if pattern and pattern[-1] == level:
                edges[-1] = end
            else:
                edges.append(end)
                pattern.append(level)
    return np.array(edges[1:-1]), np.array(pattern)
