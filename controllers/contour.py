"""The minimal contour of a relay with a minimum on-time: where its guaranteed accuracy comes from.

V. F. Ivanova, B. N. Sokolov, "Maximal guaranteed accuracy of a relay regulator in a
one-dimensional stabilisation problem" (1999, in Russian), sections 2 and 3.

Plant x' = v, v' = u + F + eps, |eps| <= e, with u = 0 or -1 and at least the time 1 at u = -1; all
in units of the thrust's acceleration and the minimum on-time (`dimensionless`).  The contour
M1 A1 M2 A2 of half width p is made of the extreme parabolas: no trajectory that switches to -1
on A1 B2 and to 0 on A2 B1 leaves it, as long as -1 is wanted for the time 1 at least.  That asks
for p >= p0 = 1/min(kappa1, kappa2)^2, where sqrt(p) kappa1 and sqrt(p) kappa2 are the least times
between those arcs.

The printed kappa2 of (3.4) has 4 e where the geometry gives 4 e^2.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple


class Point(NamedTuple):
    """A point of the phase plane."""

    x: float
    v: float


class Rates(NamedTuple):
    """Extreme accelerations.

    Attributes:
        ap: v' with the thrust off and eps = +e.
        am: v' with the thrust off and eps = -e.
        dm: -v' with the thrust on and eps = +e.
        dp: -v' with the thrust on and eps = -e.
    """

    ap: float
    am: float
    dm: float
    dp: float


def rates(F: float, eps: float) -> Rates:
    """Returns the extreme accelerations.

    Args:
        F: Constant disturbance over the thrust, >= 0.
        eps: Bound e of what else disturbs over the thrust, >= 0.

    Raises:
        ValueError: If F or e is negative, F + e >= 1, or e >= F: the accuracy is then infinite.
    """
    if not (math.isfinite(F) and math.isfinite(eps) and F >= 0 and eps >= 0):
        raise ValueError(
            f"F and eps must be finite and >= 0, got F = {F}, eps = {eps}; a negative bias is "
            "mirrored by to_dimensionless"
        )
    if not F + eps < 1:
        raise ValueError(
            f"F + eps = {F + eps:.6g} must be < 1: the thrust does not master the disturbance; "
            f"at F = {F:.6g} the largest eps is below {max(1 - F, 0.0):.6g}"
        )
    if not eps < F:
        raise ValueError(
            f"eps = {eps:.6g} must be < F = {F:.6g}: the accuracy of a thrust in one direction is "
            "infinite where the disturbance may turn the bias over; without disturbance F = 0 has "
            "the accuracy b of undisturbed(F), with thrust both ways"
        )
    return Rates(F + eps, F - eps, 1 - F - eps, 1 - F + eps)


def kappa(F: float, eps: float) -> tuple[float, float]:
    """Returns kappa1 and kappa2: over sqrt(p), the least times from A1 and B2 to A2 B1, (3.4).

    Args:
        F: Constant disturbance over the thrust, >= 0.
        eps: Bound of what else disturbs over the thrust, < F and < 1 - F.

    Raises:
        ValueError: If F and eps are out of bounds.
    """
    ap, am, dm, dp = rates(F, eps)
    out, back = math.sqrt(am * (1 + 2 * eps)), math.sqrt(ap)
    from_a1 = 2 * math.sqrt(dm) / dp * (out + back)
    lower = math.sqrt(am / (ap * (1 - 2 * eps)))
    turn = math.sqrt(1 + 4 * eps**2 * am * dp / (ap * dm))  # printed with 4 eps
    return from_a1, 2 * math.sqrt(dm) / dp * lower * (out + back * turn)


def guaranteed_accuracy(F: float, eps: float) -> float:
    """Returns p0: limsup |x| <= p0 is guaranteed with the levels 0 and -1, (3.5).

    On (3.8) no law with the levels 0 and +-1 guarantees less.  At eps = 0 it is a of
    `undisturbed`.

    Args:
        F: Constant disturbance over the thrust, > 0.
        eps: Bound of what else disturbs over the thrust, < F and < 1 - F.

    Raises:
        ValueError: If F and eps are out of bounds; for eps >= F the accuracy is infinite.
    """
    return min(kappa(F, eps)) ** -2


def contraction(F: float, eps: float) -> float:
    """Returns k: at worst, the share of the excess over p0 that a turn of Example 1 leaves.

    Args:
        F: Constant disturbance over the thrust, > 0.
        eps: Bound of what else disturbs over the thrust, < F and < 1 - F.

    Raises:
        ValueError: If F and eps are out of bounds.
    """
    ap, am, dm, dp = rates(F, eps)
    return 4 * eps**2 * ap * dp / ((1 + 2 * eps) ** 2 * am * dm)


def undisturbed(F: float) -> tuple[float, float]:
    """Returns the accuracies a and b without disturbance, (2.1); the lesser is the best there is.

    Args:
        F: Constant disturbance over the thrust, 0 <= F < 1.

    Returns:
        a with the levels 0 and -1 (inf at F = 0), b with the levels +1 and -1.

    Raises:
        ValueError: If F is out of bounds.
    """
    if not 0 <= F < 1:
        raise ValueError(f"F must be in [0, 1), got {F}; a negative bias is mirrored")
    a = (1 - F) / (16 * F) if F else math.inf
    return a, (1 + F) / (8 * (1 - F))


def in_optimal_region(F: float, eps: float) -> bool:
    """Returns whether (F, eps) is in (3.8), where no law guarantees less than p0.

    Args:
        F: Constant disturbance over the thrust.
        eps: Bound of what else disturbs over the thrust.
    """
    # 2/3 and 3/4 (1 - F) are limits that people type in decimals.
    return F >= 2 / 3 - 1e-12 and 0 <= eps <= 0.75 * (1 - F) + 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Contour:
    """The contour of half width p with its named points; v >= 0 in the upper half plane.

    Attributes:
        F: Constant disturbance over the thrust.
        eps: Bound e of what else disturbs.
        p: Half width.
        on_time: Time for which -1 is kept at least; 1 but for a sampled law.
        M1: Left end.
        M2: Right end.
        A1: Upper corner.
        A2: Lower corner.
        B1: Where the inner line A1 O1 B1 meets A2 M1.
        B2: Where the inner line A2 O2 B2 meets A1 M2.
        O1: Where A1 O1 B1 turns.
        O2: Where A2 O2 B2 turns.
        N: End of A1 O1 continued with eps = -e.
        C: Where the line CDE, from which A2 M1 is the on-time away at least, meets M1 A1.
        D: Where it meets A1 M2 A2; nan, as L2 and K3, if p is too small for the on-time.
        L1: Where the fastest braking parabola through C meets A1 E1, A1 M2 continued upwards.
        L2: Where the inner parabola through D meets A2 E2, A2 M1 continued downwards.
        K3: Where that parabola meets M2 A2.
        d_low: Whether D lies on the lower arc M2 A2.
    """

    F: float
    eps: float
    p: float
    on_time: float
    M1: Point
    M2: Point
    A1: Point
    A2: Point
    B1: Point
    B2: Point
    O1: Point
    O2: Point
    N: Point
    C: Point
    D: Point
    L1: Point
    L2: Point
    K3: Point
    d_low: bool

    @property
    def rates(self) -> Rates:
        """The extreme accelerations."""
        F, e = self.F, self.eps
        return Rates(F + e, F - e, 1 - F - e, 1 - F + e)

    @property
    def inner_off(self) -> float:
        """X of D: the inner parabola with the thrust off, x = X + v^2/..., passes through D."""
        ap, am = self.rates.ap, self.rates.am
        return self.D.x - self.D.v**2 / (2 * (ap if self.d_low else am))

    def cde(self, v: float) -> float:
        """Returns x of the line CDE: from its right A2 M1 is the on-time away at least.

        Args:
            v: Rate.
        """
        T = self.on_time
        return -self.p - T * T / 2 + (v - T) ** 2 / (2 * self.rates.am)


def contour(
    F: float, eps: float, *, half_width: float | None = None, on_time: float = 1.0
) -> Contour:
    """Returns the contour M1 A1 M2 A2, the minimal one unless a half width is given.

    Args:
        F: Constant disturbance over the thrust, > 0.
        eps: Bound of what else disturbs over the thrust, < F and < 1 - F.
        half_width: p; p0 if left out.
        on_time: Time for which -1 is kept at least.

    Raises:
        ValueError: If F and eps are out of bounds, or a size is not positive.
    """
    ap, am, dm, dp = rates(F, eps)
    p = guaranteed_accuracy(F, eps) if half_width is None else half_width
    if not (p > 0 and on_time > 0):
        raise ValueError(f"half_width = {p} and on_time = {on_time} must be > 0")
    wide, T = 1 + 2 * eps, on_time
    A1 = Point(p * (1 - 2 * ap), 2 * math.sqrt(p * ap * dm))
    A2 = Point(p * (1 - 2 * am), -2 * math.sqrt(p * am * dp))
    O1 = Point(p * (-1 + 2 * dm * wide / dp), 0.0)
    O2 = Point(p * (1 - 2 * am * wide / ap), 0.0)
    low = -2 * math.sqrt(p * am * dm**2 * wide / (dp * (1 - 2 * eps)))
    high = 2 * math.sqrt(p * dm * am**2 * wide / (ap * (1 - 2 * eps)))
    end = -2 * math.sqrt(p * am * dm * wide)
    vC = T * dp / (1 + math.sqrt(1 - 2 * eps * dp / ap))
    C = Point(-p + vC**2 / (2 * ap), vC)
    # x = CDE and x = p - v^2/(2 d): (am + d) v^2/d - 2 T v + room = 0.
    room = T * T * dp - 4 * p * am
    d_low = room < 0
    d = dp if d_low else dm
    square = T * T - (am + d) / d * room
    vD = room / (T + math.sqrt(square)) if square >= 0 else math.nan
    D = Point(p - vD**2 / (2 * d), vD)
    X = D.x - vD**2 / (2 * (ap if d_low else am))
    vL1, vL2 = A1.v, A2.v
    if eps > 0:
        vL1 = math.sqrt(max(p - C.x - vC**2 / (2 * dp), 0.0) * dm * dp / eps)
        vL2 = -math.sqrt(max(0.0, X + p) * am * ap / eps) if square >= 0 else math.nan
    vK3 = -math.sqrt(max(0.0, 2 * (p - X)) * ap * dp / wide) if square >= 0 else math.nan
    return Contour(
        F=F,
        eps=eps,
        p=p,
        on_time=T,
        M1=Point(-p, 0.0),
        M2=Point(p, 0.0),
        A1=A1,
        A2=A2,
        B1=Point(-p + low**2 / (2 * am), low),
        B2=Point(p - high**2 / (2 * dm), high),
        O1=O1,
        O2=O2,
        N=Point(-p + end**2 / (2 * am), end),
        C=C,
        D=D,
        L1=Point(p - vL1**2 / (2 * dm), vL1),
        L2=Point(-p + vL2**2 / (2 * am), vL2),
        K3=Point(p - vK3**2 / (2 * dp), vK3),
        d_low=d_low,
    )
