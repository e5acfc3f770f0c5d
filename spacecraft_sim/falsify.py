"""Search for the worst: whatever makes a figure largest in a box, with so many evaluations.

The covariance matrix adaptation evolution strategy (CMA-ES) with restarts: N. Hansen, "The CMA
evolution strategy: a tutorial" (2016), equations in comments; each restart doubles the population,
as A. Auger, N. Hansen, "A restart CMA evolution strategy with increasing population size" (2005).

What breaks a bound is a chain of instants that must fit each other, such as the switchings that
keep a mode ringing, and often has some of them at the end of their range: waits of no length, a
disturbance at its bound.  The strategy does not care how the variables are turned into each other,
and points beyond the box are projected onto it, so that its faces are met exactly: folding them
back instead found a third less on schedules of 12 to 20 switchings.  Differential evolution, given
the same projection, finds as much there; it would need a library for no gain.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

Array = np.ndarray

_START = 0.3  # step size at first, of the box
_STALLED = 1e-6  # spread of figures, over their size, or step of the box, at which it starts anew


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """The worst that was found.

    Attributes:
        x: Where, shape (n,).
        value: How bad.
        evaluations: How often the objective was asked.
        history: The worst so far after each evaluation, shape (evaluations,).
    """

    x: Array
    value: float
    evaluations: int
    history: Array


def falsify(
    objective: Callable[[Array], float],
    bounds: Sequence[tuple[float, float]],
    *,
    evaluations: int,
    rng: np.random.Generator,
    starts: Sequence[Array] = (),
) -> Found:
    """Searches a box for the largest value of a function.

    Args:
        objective: Figure to be made large, such as measured over bound; -inf where it has none.
        bounds: Least and largest value of each variable.
        evaluations: How often the objective may be asked.
        rng: Source of all that is random.
        starts: Points that are asked first; the search begins from the worst of them.

    Returns:
        The worst that was found.

    Raises:
        ValueError: If a bound is not finite or its ends are not ascending, there is no variable or
            no evaluation, or the objective is not a number.
    """
    box = np.array(bounds, dtype=float)
    if box.ndim != 2 or box.shape[1] != 2 or len(box) == 0 or not np.all(np.isfinite(box)):
        raise ValueError(f"bounds must be finite pairs, one a variable; got {bounds!r}")
    if np.any(box[:, 0] >= box[:, 1]):
        k = int(np.argmax(box[:, 0] >= box[:, 1]))
        raise ValueError(f"bounds of variable {k} must ascend, got {tuple(box[k].tolist())}")
    if evaluations < 1:
        raise ValueError(f"evaluations = {evaluations} must be >= 1")
    low, width = box[:, 0], box[:, 1] - box[:, 0]
    values: list[float] = []
    best: tuple[float, Array] = (-math.inf, low + width / 2)

    def ask(u: Array) -> float:
        nonlocal best
        x = low + width * np.clip(u, 0.0, 1.0)
        value = float(objective(x))
        if math.isnan(value):
            raise ValueError(f"the objective is nan at {x}")
        values.append(value)
        if value > best[0] or len(values) == 1:
            best = (value, x)
        return value

    for x in starts[:evaluations]:
        ask((np.asarray(x, dtype=float) - low) / width)
    population = 4 + int(3 * math.log(len(box)))  # (48)
    mean = (best[1] - low) / width if len(starts) else rng.uniform(size=len(box))
    while len(values) < evaluations:
        _climb(ask, mean, population, evaluations - len(values), rng)
        mean, population = rng.uniform(size=len(box)), 2 * population
    return Found(
        x=best[1],
        value=best[0],
        evaluations=len(values),
        history=np.maximum.accumulate(values),
    )


def _climb(
    ask: Callable[[Array], float],
    mean: Array,
    population: int,
    budget: int,
    rng: np.random.Generator,
) -> None:
    """One run, until its population has come together or the budget is spent."""
    n, step = len(mean), _START
    half = population // 2
    weights = math.log((population + 1) / 2) - np.log(np.arange(1, half + 1))  # (49)
    weights /= weights.sum()
    mass = 1 / np.sum(weights**2)  # (8)
    c_step = (mass + 2) / (n + mass + 5)  # (55)
    damping = 1 + c_step + 2 * max(0.0, math.sqrt((mass - 1) / (n + 1)) - 1)
    c_path = (4 + mass / n) / (n + 4 + 2 * mass / n)  # (56)
    c_one = 2 / ((n + 1.3) ** 2 + mass)  # (57)
    c_rank = min(1 - c_one, 2 * (mass - 2 + 1 / mass) / ((n + 2) ** 2 + mass))  # (58)
    length = math.sqrt(n) * (1 - 1 / (4 * n) + 1 / (21 * n * n))  # of a normal vector
    C, path, path_step = np.eye(n), np.zeros(n), np.zeros(n)
    generation = 0
    while budget > 0:
        squares, axes = np.linalg.eigh(C)
        root = np.sqrt(np.maximum(squares, 1e-20))
        normal = rng.standard_normal((population, n))
        steps = normal * root @ axes.T  # (38)-(40)
        asked = steps[: min(population, budget)]
        figures = np.array([ask(mean + step * y) for y in asked])
        budget -= len(asked)
        if len(asked) < population:
            return
        order = np.argsort(-figures)[:half]
        move = weights @ steps[order]  # (41)
        mean = np.clip(mean + step * move, 0.0, 1.0)
        white = axes @ (axes.T @ move / root)
        path_step = (1 - c_step) * path_step + math.sqrt(c_step * (2 - c_step) * mass) * white
        generation += 1
        grown = np.linalg.norm(path_step) / math.sqrt(1 - (1 - c_step) ** (2 * generation))
        calm = grown < (1.4 + 2 / (n + 1)) * length
        path = (1 - c_path) * path + calm * math.sqrt(c_path * (2 - c_path) * mass) * move  # (45)
        lost = (1 - calm) * c_path * (2 - c_path)
        C = (
            (1 + c_one * lost - c_one - c_rank) * C
            + c_one * np.outer(path, path)
            + c_rank * (steps[order].T * weights) @ steps[order]
        )  # (47)
        step *= math.exp(
            min(1.0, c_step / damping * (np.linalg.norm(path_step) / length - 1))
        )  # (44)
        finite = figures[np.isfinite(figures)]
        spread, size = np.ptp(finite) if len(finite) else 0.0, np.abs(finite).max(initial=0.0)
        if step * root.max() < _STALLED or spread <= _STALLED * size:
            return
