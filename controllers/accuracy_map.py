"""Borders in the plane of F and e, the two parameters of Ivanova & Sokolov (1999).

Each function takes F and gives the e of the border, or nan where the border does not cross that F.
"""

import math
from collections.abc import Callable

from controllers.contour import contraction, guaranteed_accuracy, kappa, rates


def equal_kappa(F: float) -> float:
    """Returns e at which kappa1 = kappa2; below it kappa1 is the larger.

    Args:
        F: Constant disturbance over the thrust, 0 < F < 1.
    """

    def difference(e: float) -> float:
        k1, k2 = kappa(F, e)
        return k2 - k1

    return _root(F, difference)


def unit_contraction(F: float) -> float:
    """Returns e at which k = 1; Example 1 converges below it.

    Args:
        F: Constant disturbance over the thrust, 0 < F < 1.
    """
    return _root(F, lambda e: contraction(F, e) - 1)


def low_d(F: float) -> float:
    """Returns e above which D lies on the lower arc of the minimal contour.

    Args:
        F: Constant disturbance over the thrust, 0 < F < 1.
    """

    def above(e: float) -> float:
        r = rates(F, e)
        return 4 * r.am * guaranteed_accuracy(F, e) / r.dp - 1

    return _root(F, above)


def optimal_up_to(F: float) -> float:
    """Returns the largest e of (3.8), on which no law guarantees less than p0.

    Args:
        F: Constant disturbance over the thrust, 0 < F < 1.
    """
    return 0.75 * (1 - F) if F >= 2 / 3 else math.nan


def _root(F: float, function: Callable[[float], float]) -> float:
    """The e below min(F, 1 - F) at which a function turns from negative to positive."""
    if not 0 < F < 1:
        raise ValueError(f"F must be between 0 and 1, got {F}")
    end = min(F, 1 - F)
    low, high = 1e-9 * end, (1 - 1e-9) * end
    if not function(low) < 0 <= function(high):
        return math.nan
    while high - low > 4 * math.ulp(high):
        middle = (low + high) / 2
        low, high = (middle, high) if function(middle) < 0 else (low, middle)
    return high
