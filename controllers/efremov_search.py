"""Parameters of Theorems 1 and 2 that meet a requirement, or why there are none.

A requirement is h0, eps, R, a bound of |f| and the acceleration that the thrusters can give.  The
margin of a choice is the least share that is left of any hypothesis and of the thrust.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np

from spacecraft_sim.checks import positive

Array = np.ndarray
Aim = Literal["margin", "thrust"]
_GRID = 401  # points a parameter; refined around the best three times


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """Parameters that meet a requirement.

    Attributes:
        c: Slope of the switching line, 1/s.
        gain: gamma of Theorem 2; 0 for Theorem 1, which has none.
        lowest: p, rad/s^2.
        highest: Highest level, rad/s^2.
        margin: Least share left of a hypothesis or of the thrust.
    """

    c: float
    gain: float
    lowest: float
    highest: float
    margin: float


def choose_local(
    *, max_delay: float, accuracy: float, disturbance: float, thrust: float, aim: Aim = "margin"
) -> Choice:
    """Chooses c for Theorem 1.

    Args:
        max_delay: h0, s.
        accuracy: eps, rad.
        disturbance: Bound of |f/J|, rad/s^2.
        thrust: Acceleration that the thrusters can give, rad/s^2.
        aim: The largest margin, or the least thrust.

    Raises:
        ValueError: If no c will do, saying which demands exclude each other.
    """
    positive(max_delay=max_delay, accuracy=accuracy, thrust=thrust)
    positive(disturbance=disturbance, zero=True)

    def slack(c: Array, _: Array) -> dict[str, Array]:
        p = 1.5 * c**2 * accuracy
        return {
            "c h0 < ln(6/5)": 1 - c * max_delay / math.log(6 / 5),
            "|f| < c^2 eps/4": 1 - disturbance / (c**2 * accuracy / 4),
            "p = (3/2) c^2 eps within the thrust": 1 - p / thrust,
        }

    limits = (math.log(6 / 5) / max_delay, (0.0, 0.0))
    c, gain, margin = _search(slack, lambda c, g: c**2, limits, aim)
    p = 1.5 * c**2 * accuracy
    return Choice(c=c, gain=gain, lowest=p, highest=p, margin=margin)


def choose_nonlocal(
    *,
    max_delay: float,
    accuracy: float,
    radius: float,
    disturbance: float,
    thrust: float,
    aim: Aim = "margin",
) -> Choice:
    """Chooses c and gamma for Theorem 2.

    Args:
        max_delay: h0, s.
        accuracy: eps, rad.
        radius: R, rad and rad/s.
        disturbance: Bound of |f/J|, rad/s^2.
        thrust: Acceleration that the thrusters can give, rad/s^2.
        aim: The largest margin, or the least thrust.

    Raises:
        ValueError: If no pair will do, saying which demands exclude each other.
    """
    positive(max_delay=max_delay, accuracy=accuracy, radius=radius, thrust=thrust)
    positive(disturbance=disturbance, zero=True)
    if radius <= accuracy:
        raise ValueError(f"eps < R: {accuracy} rad is not below R = {radius} rad")

    def lowest(c: Array, g: Array) -> Array:
        return (15 / 4) * c**2 * accuracy * g

    def highest(c: Array, g: Array) -> Array:
        N = np.maximum(0, np.ceil(np.log((c + 1) * radius / (0.75 * c * accuracy)) / math.log(3)))
        return lowest(c, g) * 3.0**N

    def slack(c: Array, g: Array) -> dict[str, Array]:
        E = np.exp(c * max_delay)
        return {
            "c h0 < ln(15/14)": 1 - c * max_delay / math.log(15 / 14),
            "gamma > E/(10 - 9E)": 1 - E / (10 - 9 * E) / g,
            "gamma < 3": 1 - g / 3,
            "|f| < v1 c/2": 1 - disturbance / (3 / 8 * c**2 * accuracy * g),
            "p 3^N within the thrust": 1 - highest(c, g) / thrust,
        }

    limits = (math.log(15 / 14) / max_delay, (1.0, 3.0))
    c, gain, margin = _search(slack, highest, limits, aim)
    at = np.array(c), np.array(gain)
    return Choice(
        c=c, gain=gain, lowest=float(lowest(*at)), highest=float(highest(*at)), margin=margin
    )


def _search(
    slack: Callable[[Array, Array], dict[str, Array]],
    cost: Callable[[Array, Array], Array],
    limits: tuple[float, tuple[float, float]],
    aim: Aim,
) -> tuple[float, float, float]:
    """Best (c, gain, margin) over a grid that is refined around the best point."""
    highest_c, (low_g, high_g) = limits
    low_c, high_c = 1e-4 * highest_c, highest_c
    best = (math.nan, math.nan, -math.inf)
    for refinement in range(4):
        c, g = np.meshgrid(np.linspace(low_c, high_c, _GRID), np.linspace(low_g, high_g, _GRID))
        slacks = slack(c, g)
        margin = np.min(np.stack(list(slacks.values())), axis=0)
        score = margin if aim == "margin" else np.where(margin > 0, -cost(c, g), -np.inf)
        k = np.unravel_index(np.argmax(score), score.shape)
        if refinement == 0 and not margin.max() > 0:
            raise ValueError(_why_none(slacks))
        best = float(c[k]), float(g[k]), float(margin[k])
        reach_c, reach_g = (high_c - low_c) / 50, (high_g - low_g) / 50
        low_c, high_c = max(best[0] - reach_c, 1e-9), min(best[0] + reach_c, highest_c)
        low_g, high_g = max(best[1] - reach_g, limits[1][0]), min(best[1] + reach_g, limits[1][1])
    return best


def _why_none(slacks: dict[str, Array]) -> str:
    """Names a demand that nothing meets, or the ones that fail at the best compromise."""
    alone = [name for name, s in slacks.items() if not (s > 0).any()]
    if alone:
        return f"no parameters meet the requirement: nothing satisfies {'; '.join(alone)}"
    margin = np.min(np.stack(list(slacks.values())), axis=0)
    k = np.unravel_index(np.argmax(margin), margin.shape)
    short = [f"{name} (short by {-s[k]:.3g})" for name, s in slacks.items() if s[k] <= 1e-9]
    return (
        "no parameters meet the requirement: these exclude each other, at the best compromise "
        f"{'; '.join(short)}; ask for less accuracy or reach, or allow more thrust or less delay"
    )
