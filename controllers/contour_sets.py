"""The sets of Ivanova & Sokolov (1999), section 3: where thrust may change and the contour holds.

Lemma 3.3: a trajectory stays within the contour whatever the disturbance does if and only if -1 is
switched on in W1 and off in W2 alone.  So it is there for good from the first such switching on,
provided the law goes on like that.
"""

from controllers.contour import Contour


def inside(c: Contour, x: float, v: float, *, slack: float = 0.0) -> bool:
    """Returns whether a state is in the closed region that the contour bounds.

    Args:
        c: The contour.
        x: Position.
        v: Rate.
        slack: Share of p by which it may be outside.
    """
    ap, am, dm, dp = c.rates
    left, right = (v * v / (2 * ap), v * v / (2 * dm)) if v >= 0 else (
        v * v / (2 * am), v * v / (2 * dp)
    )  # fmt: skip
    room = slack * c.p
    return -c.p + left - room <= x <= c.p - right + room


def in_w1(c: Contour, x: float, v: float, *, slack: float = 0.0) -> bool:
    """Returns whether -1 may be switched on: A2 M1 is the on-time away, whatever eps does.

    Args:
        c: The contour.
        x: Position.
        v: Rate.
        slack: Share of p by which it may be outside.
    """
    return inside(c, x, v, slack=slack) and x >= c.cde(v) - slack * c.p


def in_w3(c: Contour, x: float, v: float) -> bool:
    """Returns whether with 0 the state may miss W1: it is right of the inner parabola through D.

    Args:
        c: The contour.
        x: Position.
        v: Rate.
    """
    return inside(c, x, v) and not c.d_low and not _reaches_w1(c, x, v, 0.0)


def in_w2(c: Contour, x: float, v: float, *, slack: float = 0.0) -> bool:
    """Returns whether 0 may be switched on: what of the contour is not in W3.

    Args:
        c: The contour.
        x: Position.
        v: Rate.
        slack: Share of p by which it may be outside.
    """
    return inside(c, x, v, slack=slack) and (c.d_low or _reaches_w1(c, x, v, slack))


def _reaches_w1(c: Contour, x: float, v: float, slack: float) -> bool:
    d = c.rates.am if v >= 0 else c.rates.ap
    return x <= c.inner_off + v * v / (2 * d) + slack * c.p
