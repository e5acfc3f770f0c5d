"""Guaranteed accuracy of a two-level relay {-1, +1} that keeps each value for a dwell.

Plant: x'' = u + F + eps, |eps| <= e, in units of the torque's acceleration u0 = M0/J, the dwell and
the length u0 dwell^2.  F is a constant disturbance, e stands for whatever else disturbs: here the
moment of elastic parts, e = M_e/M0.

Law: switch to -1 on x = p - v^2/(2(1 - F - e)), v > 0, to +1 on x = -p + v^2/(2(1 + F - e)), v < 0.
From such a point the extreme disturbance just reaches p, or -p, so |x| <= p as long as the next
switching is not wanted before the dwell is over.  That asks for p >= p0: the fastest passage from
one arc to the other takes the dwell when p = p0.  It starts from an end of the reachable part of
the arc, with eps of the sign of u throughout.

A construction after Ivanova & Sokolov (1999), whose regulators have the levels {0, -1} under a
disturbance, and {-1, +1} without: there p0 = (1 + F)/(8(1 - F)) is theirs.  Required: |F| + e < 1.

With one elastic mode an axis, of inertia fraction mu and decay sigma, the guaranteed bound of its
moment is e = 2 mu/(1 - mu)/(1 - exp(-sigma dwell)) for light damping: the level of the thrust does
not enter, and no dwell is long enough once mu >= 1/3.
"""

import math

from spacecraft_sim.checks import positive


def guaranteed_accuracy(bias: float, disturbance: float) -> float:
    """Returns p0: |x| <= p0 u0 dwell^2 is guaranteed once the state is on a switching arc.

    Args:
        bias: F, the constant disturbance over the thrust; its sign does not matter.
        disturbance: e, the bound of what else disturbs over the thrust, >= 0.

    Raises:
        ValueError: If |F| + e >= 1: the thrust does not master the disturbance, and there is no
            such accuracy.
    """
    positive(zero=True, disturbance=disturbance)
    if not abs(bias) + disturbance < 1:
        raise ValueError(
            f"|bias| + disturbance must be < 1 for the thrust to win, got |{bias}| + {disturbance} "
            f"= {abs(bias) + disturbance}; the largest disturbance here is below "
            f"{max(1 - abs(bias), 0.0):.6g}"
        )
    shortest = min(_passage(bias, disturbance), _passage(-bias, disturbance))
    return 1 / shortest**2  # times grow as the square root of p


def _passage(F: float, e: float) -> float:
    """Least time from the arc of -1 to the arc of +1 under u = -1, p = 1."""
    brake, brake_fast = 1 - F - e, 1 - F + e  # |x''| under u = -1
    push, push_fast = 1 + F - e, 1 + F + e  # x'' under u = +1
    # Highest point of the arc: from (-1, 0) with the fastest push.
    v_top = math.sqrt(4 / (1 / brake + 1 / push_fast))
    # Lowest: from the lower end of the other arc, which the fastest brake reaches from (1, 0), the
    # disturbance holding back both ways: it turns at x_turn.
    w = math.sqrt(4 / (1 / brake_fast + 1 / push))
    x_turn = -1 + w * w / (2 * push) - w * w / (2 * push_fast)
    v_low = math.sqrt(2 * (1 - x_turn) / (1 / push + 1 / brake))
    times = []
    for v in (v_top, v_low):
        x_peak = 1 - v * v / (2 * brake) + v * v / (2 * brake_fast)
        w = math.sqrt(2 * (x_peak + 1) / (1 / brake_fast + 1 / push))
        times.append((v + w) / brake_fast)
    return min(times)


def one_mode_disturbance(*, inertia_fraction: float, decay: float, dwell: float) -> float:
    """Returns e = M_e/M0 of a single coupled mode with light damping.

    Args:
        inertia_fraction: mu = H A^-1 H^T/J, the share of the inertia that moves elastically.
        decay: sigma = -Re lambda of the coupled mode, 1/s.
        dwell: Least time between switchings, s.

    Raises:
        ValueError: If mu is not between 0 and 1, or decay or dwell is not positive.
    """
    positive(decay=decay, dwell=dwell)
    return _full_swing(inertia_fraction) / -math.expm1(-decay * dwell)


def one_mode_least_dwell(*, inertia_fraction: float, decay: float, bias: float = 0.0) -> float:
    """Returns the dwell above which the guarantee says something: e < 1 - |F|, s.

    Args:
        inertia_fraction: mu.
        decay: sigma, 1/s.
        bias: F, the constant disturbance over the thrust.

    Returns:
        The dwell; inf if none is long enough.

    Raises:
        ValueError: If mu is not between 0 and 1, decay is not positive, or |bias| >= 1.
    """
    positive(decay=decay)
    share = _full_swing(inertia_fraction) / _room(bias)
    return -math.log1p(-share) / decay if share < 1 else math.inf


def one_mode_largest_fraction(*, decay: float, dwell: float, bias: float = 0.0) -> float:
    """Returns the inertia fraction below which the guarantee says something.

    Args:
        decay: sigma, 1/s.
        dwell: Least time between switchings, s.
        bias: F, the constant disturbance over the thrust.

    Raises:
        ValueError: If decay or dwell is not positive, or |bias| >= 1.
    """
    positive(decay=decay, dwell=dwell)
    lost = -math.expm1(-decay * dwell) * _room(bias)  # 2 mu/(1 - mu) at the limit
    return lost / (2 + lost)


def one_mode_least_decay(*, inertia_fraction: float, dwell: float, bias: float = 0.0) -> float:
    """Returns the decay sigma above which the guarantee says something, 1/s.

    Args:
        inertia_fraction: mu.
        dwell: Least time between switchings, s.
        bias: F, the constant disturbance over the thrust.

    Returns:
        The decay; inf if none is enough.

    Raises:
        ValueError: If mu is not between 0 and 1, dwell is not positive, or |bias| >= 1.
    """
    positive(dwell=dwell)
    return one_mode_least_dwell(inertia_fraction=inertia_fraction, decay=1.0, bias=bias) / dwell


def _full_swing(mu: float) -> float:
    """Moment over torque of an undamped mode after a full reversal, less the static part."""
    if not 0 <= mu < 1:
        raise ValueError(f"inertia_fraction must be in [0, 1), got {mu}")
    return 2 * mu / (1 - mu)


def _room(bias: float) -> float:
    if not abs(bias) < 1:
        raise ValueError(f"|bias| must be < 1, got {bias}: the thrust does not master it")
    return 1 - abs(bias)
