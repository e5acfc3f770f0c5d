"""Controls whose moments are nearly right, brought right by their edges and by short pulses."""

import numpy as np

from controllers.extremal_lp import solved
from controllers.moment_problem import Problem, with_ends
from controllers.moments import Array

RESIDUAL = 1e-11  # of the moments, as a share of the manoeuvre
ALIKE = 1e-13  # of the largest singular value: directions below it do not show
_FEW = 1e-3  # share of the moments that short pulses can be expected to add


def has_moments(problem: Problem, edges: Array, levels: Array) -> bool:
    """Returns whether a control has the moments wanted.

    Args:
        problem: The moments wanted.
        edges: Times to go at which the level changes, in (0, 1).
        levels: The control between them, one more.
    """
    ascending = bool(np.all(np.diff(with_ends(edges)) > 0))
    return ascending and problem.error(edges, levels) < _tolerated(problem, levels)


def completed(
    problem: Problem, edges: Array, levels: Array, pulses: tuple[float, ...], lam: Array
) -> tuple[Array, Array]:
    """Brings the moments of a control right, by short pulses where its edges alone cannot.

    Close to a problem whose optimum has fewer edges than there are moments, the optimum has pulses
    so short that h_l does not show the two edges.

    Args:
        problem: The moments wanted.
        edges: Times to go at which the level changes, ascending, in (0, 1).
        levels: The control between them, one more.
        pulses: Levels that a pulse may have.
        lam: l', the multipliers of q, which say where pulses cost least.

    Returns:
        Edges and levels.
    """
    edges = _polished(problem, edges, levels)
    if _tolerated(problem, levels) < problem.error(edges, levels) < _FEW:
        edges, levels = _with_pulses(problem, edges, levels, pulses, lam)
        edges = _polished(problem, edges, levels)
    return edges, levels


def _polished(problem: Problem, edges: Array, levels: Array) -> Array:
    """Moves the edges of a control, as little as it takes, towards the moments wanted."""
    error = problem.error(edges, levels)
    for _ in range(20):
        J = problem.functions(edges) * (levels[:-1] - levels[1:])
        step = np.linalg.lstsq(J, problem.defect(edges, levels), rcond=ALIKE)[0]
        if np.any(np.diff(with_ends(edges - step)) <= 0):
            break
        closer = problem.error(edges - step, levels)
        if closer >= error:
            break
        edges, error = edges - step, closer
    return edges


def _with_pulses(
    problem: Problem, edges: Array, levels: Array, pulses: tuple[float, ...], lam: Array
) -> tuple[Array, Array]:
    """Adds the short pulses that give the moments lacking at least cost, to first order.

    A level L costs -L h_l, and |L| more if zero is among the pulses; if it is not, it is the peak
    that costs, and all levels may grow together.
    """
    lack = -problem.defect(edges, levels)
    size = float(np.max(np.abs(lack)))
    s = (np.arange(128) + 0.5) / 128
    q, now = problem.functions(s), levels[np.searchsorted(edges, s)]
    h, weight = lam @ q, 0.0 in pulses
    dearer = [weight * (abs(x) - np.abs(now)) - (x - now) * h for x in pulses]
    steps = problem.functions(edges) * (levels[:-1] - levels[1:])
    growth = problem.of_switched(edges, levels)
    n, k, most = len(s) * len(pulses), len(edges), 1e4  # lengths in units of what is lacking
    x, _ = solved(
        cost=np.concatenate([*(np.maximum(d, 0) for d in dearer), np.zeros(k), [lam @ growth]]),
        equations=np.column_stack([*((x - now) * q for x in pulses), steps, growth]),
        right=lack / size,
        low=np.concatenate([np.zeros(n), np.full(k, -most), [0.0]]),
        high=np.concatenate([np.full(n + k, most), [0.0 if weight else most]]),
    )
    lengths = size * x[:n].reshape(len(pulses), -1)
    edges, levels = edges + size * x[n:-1], levels * (1 + size * x[-1])
    pulses = tuple(level * (1 + size * x[-1]) for level in pulses)
    for level, row in zip(pulses, lengths, strict=True):
        for j in np.flatnonzero(row > 0):
            i = int(np.searchsorted(edges, s[j]))
            edges = np.insert(edges, i, [s[j] - row[j] / 2, s[j] + row[j] / 2])
            levels = np.insert(levels, i + 1, [level, levels[i]])
    return edges, levels


def _tolerated(problem: Problem, levels: Array) -> float:
    """Error of the moments that passes: an edge is known to some eps, a moment to that times m."""
    return RESIDUAL + problem.noise(float(np.max(np.abs(levels))))
