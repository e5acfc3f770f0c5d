"""Controls of one sign: where there is one, the least fuel is |c_2|, and multipliers fix nothing.

Then h_l is constant, and every control of that sign with the right moments costs as little.  Of
those that are on or off one is returned that gathers its thrust about the middle: it makes
int (s - 1/2)^2 |u| least on a fine grid, and so has few edges; these then move, by as little as it
takes, until the moments are exact.
"""

import numpy as np

from controllers.completion import completed, has_moments
from controllers.extremal import least_peak, refined
from controllers.extremal_lp import one_signed_guess
from controllers.moment_problem import Problem
from controllers.moments import Array

_ROUNDS = 10  # of refining the grid of the linear program


def one_signed(problem: Problem, bound: float) -> tuple[Array, Array] | None:
    """Finds a control of one sign, on or off, if there is one within the bound.

    Args:
        problem: The moments wanted.
        bound: m0, in the problem's unit.

    Returns:
        Edges and the pattern of 0 and 1 or -1 between them, or None.

    Raises:
        ArithmeticError: If the edges of the control that there is cannot be found.
    """
    sign = float(np.sign(problem.moments[1]))
    first, impulse = sign * problem.moments[:2]
    soonest = impulse**2 / (2 * bound)  # int s u if all thrust is at the end
    if impulse <= 0 or not soonest <= first <= impulse - soonest:
        return None
    # u in [0, m0] has the moments c if u - m0/2, of peak m0/2, has the moments c - (m0/2) int h.
    centred = problem.shifted(sign=sign, offset=bound / 2)
    least = least_peak(centred)
    if centred.unit * least.peak > problem.unit * bound / 2:
        return None
    forward = problem.shifted(sign=sign, offset=0.0)
    nodes = np.union1d(problem.grid(), least.edges)
    for _ in range(_ROUNDS):
        guess = one_signed_guess(forward, bound, nodes)
        edges, levels = completed(
            forward, guess.edges, bound * guess.pattern, (0.0, bound), problem.constant(1.0)
        )
        if has_moments(forward, edges, levels):
            return edges, sign * levels / bound
        nodes = refined(nodes, guess.edges)
    raise ArithmeticError(
        f"there is a control of one sign within {problem.unit * bound:.9g}, but its edges do not "
        "settle"
    )
