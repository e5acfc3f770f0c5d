"""Bound, exact worst case and measured peak of the elastic moment over the dwell, axis by axis."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from spacecraft_sim.attack import small_motion
from spacecraft_sim.elastic_flight import fly, longest_step
from spacecraft_sim.elastic_influence import WorstCase, influence, worst_case
from spacecraft_sim.elastic_modes import ElasticModel
from spacecraft_sim.relay_channels import AXES

Array = np.ndarray

_RANGE = 20.0  # the dwell is varied so far either way
_BOUNDS, _WORST = 81, 17  # points of the bounds, and of the exact worst case
_POINTS = 300_000  # of the grid of a worst case beside the certified dwell
_FLOWN = (1.0, 0.3, 3.0, 10.0)  # dwells at which the worst schedule is flown, over the given one
_STEPS = 120_000  # of all flights together at most
_COARSE = 2.5  # steps over those of an exact flight: the phase is good to 3e-3 rad while it counts
_SILENT = 1e-9  # share of the largest bound below which an axis is not disturbed at all


@dataclass(frozen=True, slots=True, kw_only=True)
class Curves:
    """The curves of one axis; moments in N m over the dwell of its channel in s.

    The dwells of all channels are scaled together.

    Attributes:
        axis: x, y or z.
        dwell: That which is certified, s.
        bound: Rows of dwell and printed bound, shape (n, 2).
        l1: The bound for any switching.
        worst: Rows of dwell and exact worst case, shape (m, 2).
        measured: Rows of dwell, largest |M - J omega'| of the worst schedule flown on MuJoCo, and
            whether its motion was small and slow, 1 or 0.
        here: The exact worst case at the certified dwell; 0 where nothing disturbs the axis.
        left_out: What was too long to compute or fly.
    """

    axis: str
    dwell: float
    bound: Array
    l1: float
    worst: Array
    measured: Array
    here: float
    left_out: tuple[str, ...]


def curves(
    model: Any,
    elastic: ElasticModel,
    *,
    torque: Array,
    dwell: Array,
    flown: Sequence[float] = _FLOWN,
) -> tuple[Curves, ...]:
    """Computes the curves of each axis.

    Args:
        model: The compiled model that is flown.
        elastic: Its structure.
        torque: M0 of each channel, shape (3,), N m.
        dwell: Least time between switchings of each, shape (3,), s.
        flown: Dwells at which the worst schedule is flown, over the given ones.
    """
    factors = np.geomspace(1 / _RANGE, _RANGE, _BOUNDS)
    found = [influence(elastic, torque=torque, dwell=dwell * f) for f in factors]
    l1 = found[0].moment_l1
    disturbed = [k for k in range(3) if l1[k] > _SILENT * l1.max()]
    left_out: dict[int, list[str]] = {k: [] for k in range(3)}
    cases: dict[tuple[int, float], WorstCase] = {}
    for k, f in product(
        disturbed, sorted({*np.geomspace(1 / _RANGE, _RANGE, _WORST), 1.0, *flown})
    ):
        try:
            points = None if f == 1.0 else _POINTS
            cases[k, f] = worst_case(elastic, torque=torque, dwell=dwell * f, axis=k, points=points)
        except ValueError as error:  # a grid beyond its limit
            left_out[k].append(f"worst case at {dwell[k] * f:.4g} s: {error}")
    peaks, spent, step = {}, 0, _COARSE * longest_step(elastic)
    for f, k in product(flown, disturbed):
        if (k, f) not in cases:
            continue
        case = cases[k, f]
        spent += round(case.duration / step)
        if spent > _STEPS:
            left_out[k].append(f"flight at {dwell[k] * f:.4g} s: over {_STEPS} steps in all")
            continue
        try:
            flight = fly(
                model, switch_times=case.switch_times, levels=case.levels, duration=case.duration,
                timestep=step,
            )  # fmt: skip
        except ValueError as error:  # so far beyond small motion that it diverges
            left_out[k].append(f"flight at {dwell[k] * f:.4g} s: {error}")
            continue
        small = all(a.holds for a in small_motion(elastic, flight))
        peaks[k, f] = (float(np.abs(flight[f"moment_{AXES[k]}"]).max()), float(small))
    return tuple(
        Curves(
            axis=axis,
            dwell=float(dwell[k]),
            bound=_rows(
                dwell[k], {f: (at.moment[k],) for f, at in zip(factors, found, strict=True)}
            ),
            l1=float(l1[k]),
            worst=_rows(dwell[k], {f: (case.moment,) for (i, f), case in cases.items() if i == k}),
            measured=_rows(dwell[k], {f: peak for (i, f), peak in peaks.items() if i == k}),
            here=cases[k, 1.0].moment if (k, 1.0) in cases else (math.nan if left_out[k] else 0.0),
            left_out=tuple(left_out[k]),
        )
        for k, axis in enumerate(AXES)
    )


def _rows(dwell: float, moments: Mapping[float, tuple[float, ...]]) -> Array:
    """Rows of dwell and what belongs to it, ascending."""
    return np.array([(dwell * f, *moments[f]) for f in sorted(moments)])
