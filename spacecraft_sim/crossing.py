"""Where a function of time that is known at a few instants first falls to zero.

A flight samples the functions of its law at the ends of smooth pieces.  From the last points
it foresees a crossing, suspects a dip between two positive ends, and narrows a change of sign.
"""

import math
from collections.abc import Callable, Sequence

Point = tuple[float, float]  # time, least function
WIDTH = 1e-11  # to which a switching instant is located, s, as long as the clock has the digits


def foreseen(points: Sequence[Point]) -> float:
    """Returns when the function will cross zero, extrapolated from its last points; inf if not.

    Cutting the piece there spares most of the repetitions that `first_not_positive` would need.
    The first cut falls just short of the crossing, the next one just behind it.

    Args:
        points: Points in the order of time; the last four are looked at.
    """
    if len(points) < 3:
        return math.inf
    t, before = points[-1][0], points[-2]
    least = _width(t) / 2
    ahead = _root_of_parabola(points[-1], before, points[-3])
    if ahead < math.inf and len(points) > 3:
        ahead = _on_cubic(ahead, points)
    if ahead < 0.05 * (t - before[0]):
        return t + ahead + least
    return t + max((1 - 3e-5) * ahead, least)


def _on_cubic(ahead: float, points: Sequence[Point]) -> float:
    """Moves a root of the parabola to the cubic through the last four points, by Newton steps."""
    (t0, f0), (t1, f1), (t2, f2), (t3, f3) = points[-4:]
    a, b, c = t3 - t2, t3 - t1, t3 - t0
    d1, d2, d3 = (f3 - f2) / a, (f2 - f1) / (t2 - t1), (f1 - f0) / (t1 - t0)
    e1, e2 = (d1 - d2) / b, (d2 - d3) / (t2 - t0)
    g = (e1 - e2) / c
    for _ in range(2):
        u, v, w = ahead, ahead + a, ahead + b
        value = f3 + u * (d1 + v * (e1 + w * g))
        slope = d1 + (u + v) * e1 + (u * v + v * w + w * u) * g
        if slope >= 0:
            return math.inf
        ahead -= value / slope
    return max(ahead, 0.0)


def suspected_dip(points: Sequence[Point]) -> float | None:
    """Returns where a parabola through the last points dips between two, if it may cross zero.

    While the function curves upwards its slope over the last piece was steeper than it is now: only
    if that slope leads below zero can there be a pair of zeros between two positive ends.

    Args:
        points: Points in the order of time; the last three are looked at.
    """
    if len(points) < 3:
        return None
    (t0, f0), (t1, f1), (t2, f2) = points[-3:]
    slope = (f1 - f0) / (t1 - t0)
    if slope >= 0 or f1 + slope * (t2 - t1) > 0:
        return None
    curvature = ((f2 - f1) / (t2 - t1) - slope) / (t2 - t0)
    dip = (t0 + t1) / 2 - slope / (2 * curvature)
    return dip if t1 < dip < t2 else None


def first_not_positive(function: Callable[[float], float], points: Sequence[Point]) -> Point:
    """Narrows a sign change to the last bits of the clock, from the side that is not positive.

    Args:
        function: The function.
        points: The last two bracket the sign change; an earlier one, if any, shows the curvature.

    Returns:
        A point within `WIDTH` after the sign change.
    """
    *earlier, a, b = points
    third = earlier[-1] if earlier else None
    width, before = _width(b[0]), math.inf
    for _ in range(100):
        span = b[0] - a[0]
        if span <= width or -b[1] <= width * (a[1] - b[1]) / span:
            break
        # Where the last step did not halve the bracket, the function is no parabola.
        step = span / 2 if span > before / 2 else _root_of_parabola(a, b, third)
        before = span
        t = a[0] + min(max(step + width / 2, width / 2), span - width / 2)
        point = (t, function(t))
        if point[1] > 0:
            a, third = point, a
        else:
            b, third = point, b
    return b


def _width(t: float) -> float:
    """The least time that can be told from none at `t`, s."""
    return max(WIDTH, 4 * math.ulp(t))


def _root_of_parabola(a: Point, b: Point, third: Point | None) -> float:
    """How far after a the parabola, or chord, through the points first falls to zero; or inf."""
    (ta, fa), (tb, fb) = a, b
    slope, curvature = (fb - fa) / (tb - ta), 0.0
    if third is not None:
        curvature = ((third[1] - fb) / (third[0] - tb) - slope) / (third[0] - ta)
    slope -= curvature * (tb - ta)  # at a
    discriminant = slope * slope - 4 * curvature * fa
    if discriminant < 0 or (fall := math.sqrt(discriminant) - slope) <= 0:
        return math.inf
    return 2 * fa / fall
