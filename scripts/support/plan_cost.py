"""What a manoeuvre costs to plan, beside cvxpy on the same problem cut into cells."""

import importlib.util
import statistics

import numpy as np

from controllers import gorelov
from controllers.moments import Array, Modes, targets
from support.flight_cost import seconds, spread

CASE = {"omega": 1.0, "damping": 0.02, "x1": 1.0}
DURATION, BOUND = 8.0, 0.2
ACCURACY = 1e-6  # share of the optimum to which the cells are to come; the planners come to 1e-12


def beside_cvxpy(*, rounds: int) -> None:
    """Prints the time of each planner, and that of cvxpy a millionth from the optimum.

    Args:
        rounds: Interleaved rounds.
    """
    least = gorelov.min_peak(**CASE, duration=DURATION)
    m0 = 1.5 * least.peak
    planners = {
        "min_energy": lambda: gorelov.min_energy(**CASE, duration=DURATION),
        "min_peak": lambda: gorelov.min_peak(**CASE, duration=DURATION),
        "min_fuel": lambda: gorelov.min_fuel(**CASE, duration=DURATION, bound=m0),
        "min_time": lambda: gorelov.min_time(**CASE, bound=BOUND),
    }
    for name, plan in planners.items():
        plan()  # imports
        times = [1e3 * seconds(plan) for _ in range(max(rounds, 3))]
        residual = plan().residual
        print(f"plan of {name}: {spread(times)} ms, moments to {residual:.0e}")
    if importlib.util.find_spec("cvxpy") is None:
        print("cvxpy is not installed: pip install 'spacecraft-sim[test]' to compare")
        return
    fuel = planners["min_fuel"]().fuel
    for name, exact, bound in (("min_peak", least.peak, None), ("min_fuel", fuel, m0)):
        cells, error = _cells_needed(exact, bound)
        own, rival = [], []
        for _ in range(rounds):
            own.append(seconds(planners[name]))
            rival.append(seconds(lambda n=cells, b=bound: optimum(n, b)))
        ratio = statistics.median(b / a for a, b in zip(own, rival, strict=True))
        time = 1e3 * statistics.median(rival)
        words = f"{cells} cells, {error:.0e} from the optimum"
        print(f"  cvxpy, {name}, {words}: {time:.0f} ms, {ratio:.0f} times as long")


def optimum(cells: int, bound: float | None) -> float:
    """Returns the least peak, or the least fuel under a bound, of a control constant in each cell.

    Args:
        cells: How many, of equal length.
        bound: Of |u|; None for the least peak.
    """
    import cvxpy

    modes = Modes(omega=(CASE["omega"],), damping=(CASE["damping"],))
    A = moments_of_cells(modes, cells)
    c = targets(modes, duration=DURATION, x0=0.0, v0=0.0, x1=CASE["x1"], v1=0.0)
    u = cvxpy.Variable(cells)
    if bound is None:
        goal, limits = cvxpy.norm_inf(u), []
    else:
        goal, limits = cvxpy.norm1(u) * (DURATION / cells), [cvxpy.abs(u) <= bound]
    problem = cvxpy.Problem(cvxpy.Minimize(goal), [A @ u == c, *limits])
    return float(problem.solve(solver=cvxpy.HIGHS))


def moments_of_cells(modes: Modes, cells: int) -> Array:
    """Returns the moments of a unit control in each cell, shape (4, cells).

    Args:
        modes: The modes.
        cells: How many.
    """
    edges = modes.integrals(np.linspace(DURATION, 0.0, cells + 1))
    return edges[:, :-1] - edges[:, 1:]


def _cells_needed(exact: float, bound: float | None) -> tuple[int, float]:
    cells = 200
    while True:
        error = abs(optimum(cells, bound) / exact - 1)
        if error < ACCURACY or cells > 50_000:
            return cells, error
        cells *= 2
