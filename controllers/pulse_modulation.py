"""A smooth control turned into pulses of one level that give every moment of it."""

import numpy as np

from controllers.moments import Array, Modes
from controllers.plans import SmoothPlan, SwitchedPlan, read_only
from spacecraft_sim.checks import positive

_NEWTON = 30
_REST = 1e-13  # share of the moments, to which those of the pulses are brought


def modulated(plan: SmoothPlan, *, level: float, slots: int) -> SwitchedPlan:
    """Returns pulses of one level with the moments of a smooth plan.

    Each of the equal slots of the duration has one pulse about its middle with the impulse that the
    plan has in the slot.  What that leaves of the moments is taken up by the edges, each by as
    little as will do.

    Args:
        plan: The smooth control.
        level: Thrust of the pulses, above the plan's peak, in its unit.
        slots: How many pulses at most.

    Raises:
        ValueError: If the level is below the peak, or there are too few pulses for the moments.
    """
    positive(level=level, slots=slots)
    if level < plan.peak:
        raise ValueError(
            f"level = {level:.6g} is below the peak {plan.peak:.6g} of the plan: no pulse can have "
            "its impulse; take a higher level or a longer duration"
        )
    modes, T = plan.modes, plan.duration
    if slots < len(plan.multipliers):
        raise ValueError(
            f"slots = {slots}, but {len(plan.multipliers)} moments need as many pulses at least"
        )
    ends = np.linspace(0.0, T, slots + 1)
    inner = np.linspace(ends[:-1], ends[1:], 33)  # (33, slots)
    impulse = np.trapezoid(plan(inner), inner, axis=0)
    middle, half = (ends[1:] + ends[:-1]) / 2, np.abs(impulse) / level / 2
    sign = np.sign(impulse)
    edges = np.stack([middle - half, middle + half], axis=1)  # (slots, 2)
    jumps = level * np.stack([sign, -sign], axis=1).ravel()
    wanted = plan.moments(modes)
    size = np.abs(modes.functions(np.linspace(0, T, 257))).max(axis=1)
    weight = 1 / (size * plan.fuel)
    for _ in range(_NEWTON):
        error = weight * (_of_pulses(modes, T, edges, level * sign) - wanted)
        if np.max(np.abs(error)) < _REST:
            break
        # A positive jump later in time takes h(T - t) away.
        J = -weight[:, None] * modes.functions(T - edges.ravel()) * jumps
        edges = edges + np.linalg.lstsq(J, -error, rcond=None)[0].reshape(edges.shape)
    # A pulse of next to nothing may have come out with its ends exchanged: it is one of the other
    # sign.
    turned = edges[:, 1] < edges[:, 0]
    edges, sign = np.sort(edges, axis=1), np.where(turned, -sign, sign)
    flat = edges.ravel()
    if np.any(np.diff(flat) < 0) or flat[0] < 0 or flat[-1] > T:
        raise ValueError(
            f"{slots} pulses of {level:.6g} cannot have the moments of the plan: their edges "
            "cross; take more slots or a higher level"
        )
    levels = np.zeros(2 * slots + 1)
    levels[1::2] = level * sign
    residual = float(np.max(np.abs(weight * (_of_pulses(modes, T, edges, level * sign) - wanted))))
    return SwitchedPlan(
        duration=T, switch_times=read_only(flat), levels=read_only(levels), residual=residual
    )


def _of_pulses(modes: Modes, T: float, edges: Array, levels: Array) -> Array:
    """Moments of pulses, from the antiderivatives."""
    before, after = modes.integrals(T - edges[:, 0]), modes.integrals(T - edges[:, 1])
    return (before - after) @ levels
