"""The switching rules of Ivanova & Sokolov (1999) as curves x = L(v) and x = R(v).

Left of L the thrust goes off (without disturbance and m = b: to +1), right of R to -1, in between
it stays.  Where both curves are one, the upper branch belongs to -1 and the lower one to the left
level; so do the corners above and below.  The extreme arcs run exactly along some of these lines:
L is moved by 3e-11 p to the left and R by 1e-11 p, so that no rounding ends what was just begun on
either, and no corner is met twice.

Example 1 as printed is fragile: it switches on again, for a full pulse, when after switching off
on A2 K2 the state drifts right of that line, which has no width.  With a disturbance of 1.001 e it
settles at 19 to 39 p0.  The guard, -1 only at v >= 0 and 0 only at v <= 0, changes nothing within
the bound and leaves 1.01 p0 there.
"""

import math

from controllers.contour import Contour, guaranteed_accuracy, kappa, undisturbed
from spacecraft_sim.switching_curves import Curve, Region, Relay, curve

TOLERANCE = 1e-11  # of the half width
REACH = 0.25  # |xF - xA| over p in the correction of Example 2; the paper leaves it open
_INTO = 100_000  # tolerances by which a triangle of finite time reaches into the contour
_TIP = 1e-9  # share of v by which a strip is longer than the edge that it covers

Part = tuple[float, float, float, float]  # low, x0, w, q as in `curve`


def _line(half: float, tolerances: int, *parts: Part) -> Curve:
    """A curve that is moved by some tolerances to the right."""
    # A shift in x alone: an arc that begins on a moved parabola runs along it.
    return curve(*((low, x0 + tolerances * TOLERANCE * half, w, q) for low, x0, w, q in parts))


def undisturbed_a(F: float) -> Relay:
    """Returns the rule with the levels 0 and -1 that settles on the contour of half width a.

    Args:
        F: Constant disturbance over the thrust, > 0.
    """
    return _undisturbed(undisturbed(F)[0], F, 1 - F, 0)


def undisturbed_b(F: float) -> Relay:
    """Returns the rule with the levels +1 and -1 that settles on the contour of half width b.

    Args:
        F: Constant disturbance over the thrust, >= 0.
    """
    return _undisturbed(undisturbed(F)[1], 1 + F, 1 - F, 1)


def _undisturbed(half: float, rise: float, fall: float, left_level: int) -> Relay:
    """Section 2: v' = rise on the left, -fall on the right; corners at v = +-v1."""
    if not math.isfinite(half):
        raise ValueError("F = 0: with thrust in one direction there is no contour; take m = b")
    v1 = 2 * math.sqrt(half * rise * fall / (rise + fall))
    at_left, at_right = (-half, 0.0, 1 / (2 * rise)), (half, 0.0, -1 / (2 * fall))
    return Relay(
        left=_line(half, -3, (-math.inf, *at_left), (v1, *at_right)),
        right=_line(half, -1, (-math.inf, *at_left), (-v1, *at_right)),
        left_level=left_level,
    )


def example_1(c: Contour, *, guarded: bool = True, finite_time: bool = False) -> Relay:
    """Returns the rule of Example 1, which contracts every turn by k; Remark 3.2 inside.

    Args:
        c: The contour.
        guarded: Whether 0 is kept while v < 0, and -1 while v > 0.
        finite_time: Whether the contour is reached in finite time.

    Raises:
        ValueError: If finite time is asked for on a contour that is not minimal.
    """
    ap, am, dm, dp = c.rates
    K1, K2 = (c.O1.x, 0.0, -1 / (2 * dp)), (c.O2.x, 0.0, 1 / (2 * ap))
    left = _line(
        c.p,
        -3,
        (-math.inf, *K2),
        (c.A2.v, -c.p, 0.0, 1 / (2 * am)),
        (0.0, -c.p, 0.0, 1 / (2 * ap)),
        (c.A1.v, *K1),
    )
    right = _line(
        c.p,
        -1,
        (-math.inf, *K2),
        (c.A2.v, c.p, 0.0, -1 / (2 * dp)),
        (0.0, c.p, 0.0, -1 / (2 * dm)),
        (c.A1.v, *K1),
    )
    regions = _capture(c, guarded) if finite_time else ()
    return Relay(left=left, right=right, left_level=0, guarded=guarded, regions=regions)


def example_2(c: Contour, *, finite_time: bool = False, reach: float = REACH) -> Relay:
    """Returns the rule of Example 2, which contracts for any e < F.

    Args:
        c: The contour.
        finite_time: Whether the contour is reached in finite time.
        reach: |xF - xA| over p of the triangle that this takes.

    Raises:
        ValueError: If the contour is too narrow for its on-time, finite time is asked for on one
            that is not minimal, or reach is not positive.
    """
    am, dm, dp = c.rates.am, c.rates.dm, c.rates.dp
    T = c.on_time
    if math.isnan(c.D.v):
        raise ValueError(
            f"half width {c.p:.6g} is too small for Example 2: nowhere in the contour is a pulse "
            f"of {T:.6g} safe; p0 = {guaranteed_accuracy(c.F, c.eps):.6g} at on-time 1"
        )
    left = _line(
        c.p, -3, (-math.inf, -c.p, 0.0, 1 / (2 * am)), (0.0, -c.p, 0.0, -1 / (2 * dm))
    )  # E2 A2 B1 M1 M
    CDE = (-c.p - T * T / 2, T, 1 / (2 * am))
    lower_arc = [(c.D.v, c.p, 0.0, -1 / (2 * dp))] if c.d_low else []
    right = _line(
        c.p,
        -1,
        (-math.inf, *CDE),
        *lower_arc,
        (max(c.D.v, 0.0), c.p, 0.0, -1 / (2 * dm)),
    )  # E D B2 A1 E1; if D is low, E D M2 B2 A1 E1
    regions = _delay(c, reach) if finite_time else ()
    return Relay(left=left, right=right, left_level=0, regions=regions)


def _capture(c: Contour, guarded: bool) -> tuple[Region, ...]:
    """The correction of Example 1: triangles from which W1 or W2 is reached with the right level.

    A1 L1 C gets -1 if kappa1 > kappa2, A2 L2 K3 gets 0 if kappa1 < kappa2; closed, since the
    extreme arcs run along C L1 and along L2 K3.  They run along the edges M1 A1 and M2 A2 too:
    there the triangles reach a little into W1 and W2, so that such arcs clearly enter.
    """
    ap, am, dm, dp = c.rates
    larger = _larger_kappa(c)
    if larger == 1:
        X = c.C.x + c.C.v**2 / (2 * dp)
        lower = _line(c.p, -2, (-math.inf, X, 0.0, -1 / (2 * dp)))
        upper = _line(
            c.p, _INTO, (-math.inf, -c.p, 0.0, 1 / (2 * ap)), (c.A1.v, c.p, 0.0, -1 / (2 * dm))
        )
        return (Region(c.C.v, c.L1.v, lower, upper, -1),)
    if larger == 2:
        E2, M2A2 = (-math.inf, -c.p, 0.0, 1 / (2 * am)), (c.A2.v, c.p, 0.0, -1 / (2 * dp))
        inner = (-math.inf, c.inner_off, 0.0, 1 / (2 * ap))
        upper = _line(c.p, 2, inner)
        if guarded:
            return (Region(c.L2.v, c.K3.v, _line(c.p, -_INTO, E2, M2A2), upper, 0),)
        # What has crossed L2 K3 or M2 A2 is not to change again: there the level stays.
        tip = (1 - _TIP) * c.K3.v
        along_inner = (_line(c.p, 1, inner), _line(c.p, 6, inner))
        arc = (-math.inf, *M2A2[1:])
        along_arc = (_line(c.p, -2, arc), _line(c.p, 100, arc))
        return (
            Region(c.L2.v, c.K3.v, _line(c.p, 3, E2, M2A2), upper, 0),
            Region(c.L2.v, tip, *along_inner, None),
            Region(c.A2.v, tip, *along_arc, None),
        )
    return ()


def _delay(c: Contour, reach: float) -> tuple[Region, ...]:
    """The correction of Example 2: in A_j F_j J_j, kappa_i > kappa_j, the level stays."""
    if not reach > 0:
        raise ValueError(f"reach = {reach} must be > 0: it is |xF - xA|/p")
    ap, am, dm, dp = c.rates
    larger = _larger_kappa(c)
    if larger == 1:  # j = 2
        xF = c.A2.x + reach * c.p
        vF, vJ = -math.sqrt(2 * am * (xF + c.p)), -math.sqrt(2 * ap * (xF - c.O2.x))
        lower = _line(c.p, -4, (-math.inf, c.O2.x, 0.0, 1 / (2 * ap)))
        upper = _line(c.p, 2, (-math.inf, xF, 0.0, 0.0), (vF, -c.p, 0.0, 1 / (2 * am)))
        return (Region(vJ, c.A2.v, lower, upper, None),)
    if larger == 2:  # j = 1
        xF = c.A1.x - reach * c.p
        vF, vJ = math.sqrt(2 * dm * (c.p - xF)), math.sqrt(2 * dp * (c.O1.x - xF))
        lower = _line(c.p, -2, (-math.inf, c.p, 0.0, -1 / (2 * dm)), (vF, xF, 0.0, 0.0))
        upper = _line(c.p, 2, (-math.inf, c.O1.x, 0.0, -1 / (2 * dp)))
        return (Region(c.A1.v, vJ, lower, upper, None),)
    return ()


def _larger_kappa(c: Contour) -> int:
    """1 or 2; 0 if they are the same, where there is nothing to correct."""
    if not (c.on_time == 1 and math.isclose(c.p, guaranteed_accuracy(c.F, c.eps), rel_tol=1e-12)):
        raise ValueError(
            f"finite_time needs the minimal contour, p0 = {guaranteed_accuracy(c.F, c.eps):.6g} "
            f"and on-time 1; got p = {c.p:.6g}, on-time {c.on_time:.6g}"
        )
    k1, k2 = kappa(c.F, c.eps)
    return 0 if math.isclose(k1, k2, rel_tol=1e-12) else 1 if k1 > k2 else 2
