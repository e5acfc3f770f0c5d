"""What would make a vacuous guarantee say something: a longer dwell, more damping, less mass.

Factors on dampings and masses are looked for from 1 on: found is one at which the guarantee says
something, next to one at which it does not.  Bounds need not be monotone in either; a factor beyond
may fail again.
"""

import functools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from spacecraft_sim.elastic_influence import least_dwell
from spacecraft_sim.elastic_modes import ElasticModel

Array = np.ndarray
Lighter = Callable[[float], ElasticModel]
Holds = Callable[[ElasticModel], Array]  # whether a structure does, by axis

_FINE = 1.01  # ratio of neighbouring factors
_STRIDE, _FARTHEST = 50, 850  # steps of the first stride, and in all: factors of 1.6 and 4700


@dataclass(frozen=True, slots=True, kw_only=True)
class Remedy:
    """What would help an axis, each with the rest unchanged.

    Attributes:
        dwell: The dwell, the same in all channels, beyond which it does, s; inf if there is none.
        damping: The factor on the damping of all elastic parts, to 1 %; inf if 4700 do not do.
        mass: The factor on the masses of all elastic parts, to 1 %, with springs and dampers as
            they are; 0 if a 4700th does not do, nan if there is no model to make lighter.
    """

    dwell: float
    damping: float
    mass: float


def remedies(
    elastic: ElasticModel,
    *,
    torque: Array,
    limits: Array,
    axes: Sequence[int],
    holds: Holds,
    lighter: Lighter | None,
) -> dict[int, Remedy]:
    """Returns what would help each of some axes.

    Args:
        elastic: The structure.
        torque: M0 of each channel, shape (3,), N m.
        limits: What M_e must stay below about each axis, shape (3,), N m.
        axes: Numbers of the axes that need help.
        holds: Tells of another structure, with the present dwells, about which axes all is well.
        lighter: Gives the structure with the masses of its elastic parts times a factor.
    """
    build = lighter or (lambda _: elastic)

    @functools.cache  # the axes share what is tried
    def damped(step: int) -> Array:
        return _holds(holds, lambda: replace(elastic, B=_FINE**step * elastic.B))

    @functools.cache
    def lightened(step: int) -> Array:
        return _holds(holds, lambda: build(_FINE**-step))

    found = {}
    for k in axes:
        limit = float(limits[k])
        damping = _least_step(lambda step, k=k: bool(damped(step)[k]))
        mass = _least_step(lambda step, k=k: bool(lightened(step)[k])) if lighter else math.nan
        found[k] = Remedy(
            dwell=least_dwell(elastic, torque=torque, axis=k, limit=limit)
            if limit > 0
            else math.inf,
            damping=_FINE**damping,
            mass=_FINE**-mass,
        )
    return found


def _holds(holds: Holds, build: Callable[[], ElasticModel]) -> Array:
    try:
        return holds(build())
    except ValueError:  # critical damping to the last digits: no modes, nothing shown
        return np.zeros(3, dtype=bool)


def _least_step(holds: Callable[[int], bool]) -> float:
    """A step > 0 that holds whose predecessor does not; inf if none is found."""
    low, high = 0, _STRIDE
    while not holds(high):
        if high == _FARTHEST:
            return math.inf
        low, high = high, min(2 * high, _FARTHEST)
    while high > low + 1:
        middle = (low + high) // 2
        low, high = (low, middle) if holds(middle) else (middle, high)
    return high
