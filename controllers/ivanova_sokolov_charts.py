"""The figures of Ivanova & Sokolov (1999) from the formulas: contour, sets, map of (F, e)."""

import math
from collections.abc import Callable

import numpy as np

from controllers.accuracy_map import equal_kappa, low_d, unit_contraction
from controllers.contour import Contour, guaranteed_accuracy
from controllers.dimensionless import Scale
from spacecraft_sim.chart import Line, Map, Portrait, Region
from spacecraft_sim.switching_curves import Curve, Relay, position

Array = np.ndarray
_POINTS = 81  # of a line


def phase_portrait(
    c: Contour, relay: Relay, scale: Scale, *, axis: str, signals: tuple[str, str], channel: str
) -> Portrait:
    """Returns the phase plane with contour, inner lines, switching curves and the sets W1, W2.

    Args:
        c: The contour.
        relay: The switching curves.
        scale: Units.
        axis: x, y or z.
        signals: Names of angle and rate.
        channel: Name of the thruster.
    """
    ap, am, dm, dp = c.rates
    top, bottom = c.A1.v, c.A2.v

    def physical(x: Array, v: Array) -> Array:
        return scale.sign * np.stack([x * scale.angle, v * scale.rate], axis=1)

    v = np.linspace(bottom, top, 2 * _POINTS)
    left, right = _left(c, v), _right(c, v)
    cde = np.array([c.cde(x) for x in v.tolist()])
    outline = physical(np.r_[left, right[::-1]], np.r_[v, v[::-1]])
    up, down = np.linspace(0, top, _POINTS), np.linspace(0, bottom, _POINTS)
    beyond_1, beyond_2 = np.linspace(c.B1.v, 0, _POINTS), np.linspace(0, c.B2.v, _POINTS)
    first = np.r_[beyond_1, up]
    second = np.r_[down[::-1], beyond_2]
    inner_1 = c.O1.x - first**2 / np.where(first < 0, 2 * dm, 2 * dp)
    inner_2 = c.O2.x + second**2 / np.where(second < 0, 2 * ap, 2 * am)
    wide = np.linspace(1.45 * bottom, 1.45 * top, 4 * _POINTS)
    return Portrait(
        name=f"contour_{axis}",
        title=f"Contour of the guaranteed accuracy about {axis}, and the flight",
        signals=signals,
        channel=channel,
        min_on_time=scale.time,
        band=c.p * scale.angle,
        lines=(
            Line(name="contour", points=np.vstack([outline, outline[:1]]), look="bound"),
            Line(name="inner lines", points=physical(inner_1, first)),
            Line(name="inner lines", points=physical(inner_2, second)),
            Line(name="off, left of", points=_drawn(relay.left, wide, physical), look="switching"),
            Line(name="on, right of", points=_drawn(relay.right, wide, physical),
                 look="switching"),
        ),
        regions=(
            Region(name="W1: a pulse may begin", outline=_between(
                v, np.maximum(left, np.where(v <= _safe(c), cde, left)), right, physical,
                v >= (c.D.v if c.d_low else 0.0))),
            Region(name="W2: the thrust may go off",
                   outline=_between(v, left, np.minimum(right, _w3(c, v)), physical, v > -np.inf)),
        ),
    )  # fmt: skip


def _safe(c: Contour) -> float:
    """The rate up to which a pulse of the least length reaches A2 M1 no sooner."""
    return c.on_time * c.rates.dp


def _left(c: Contour, v: Array) -> Array:
    return -c.p + v**2 / (2 * np.where(v >= 0, c.rates.ap, c.rates.am))


def _right(c: Contour, v: Array) -> Array:
    return c.p - v**2 / (2 * np.where(v >= 0, c.rates.dm, c.rates.dp))


def _w3(c: Contour, v: Array) -> Array:
    """Left border of W3, the parabola with the thrust off through D; none if D is low."""
    if c.d_low or math.isnan(c.D.v):
        return np.full_like(v, np.inf)
    return c.inner_off + v**2 / (2 * np.where(v >= 0, c.rates.am, c.rates.ap))


def _between(
    v: Array, left: Array, right: Array, physical: Callable[[Array, Array], Array], where: Array
) -> Array:
    """Outline of left(v) <= x <= right(v) where both the order and the condition allow it."""
    inside = where & (left <= right)
    v, left, right = v[inside], left[inside], right[inside]
    return physical(np.r_[left, right[::-1]], np.r_[v, v[::-1]])


def _drawn(line: Curve, v: Array, physical: Callable[[Array, Array], Array]) -> Array:
    return physical(np.array([position(line, x) for x in v.tolist()]), v)


def parameter_map(F: float, eps: float, *, axis: str) -> Map:
    """Returns the plane of (F, e) with the region of optimality and its borders.

    Args:
        F: Constant disturbance over the thrust.
        eps: Bound of what else disturbs over the thrust.
        axis: x, y or z.
    """
    optimal = Region(
        name="(3.8): no law guarantees less",
        outline=np.array([[2 / 3, 0.0], [1.0, 0.0], [2 / 3, 0.25]]),
    )
    mastered = Region(
        name="finite accuracy: e < F, F + e < 1", outline=np.array([[0, 0], [1, 0], [0.5, 0.5]])
    )
    borders = {"k = 1": unit_contraction, "kappa1 = kappa2": equal_kappa, "D low above": low_d}
    across = np.linspace(0.02, 0.98, 97).tolist()
    return Map(
        name=f"parameters_{axis}",
        title=f"Parameters of the axis {axis}: p0 = {guaranteed_accuracy(F, eps):.4g} u0 Dt²"
        if 0 <= eps < F
        else f"Parameters of the axis {axis}",
        labels=("F/u0, steady disturbance over thrust", "e/u0, unsteady disturbance over thrust"),
        point=(F, eps),
        lines=tuple(
            Line(name=name, points=np.array([(x, border(x)) for x in across]))
            for name, border in borders.items()
        ),
        regions=(mastered, optimal),
    )
