"""Flights that try to pass the bound of the elastic moment, as rows of a table."""

import dataclasses
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from spacecraft_sim import mjcf, spacecraft
from spacecraft_sim.attack import Schedule, claim, random_schedule, word
from spacecraft_sim.attack_search import search
from spacecraft_sim.elastic_influence import Influence, elastic_model, influence, worst_case
from spacecraft_sim.elastic_modes import ElasticModel
from spacecraft_sim.relay_channels import AXES

# Machine, axis, dwell, torques, length: the worst schedule that exists, flown.
WORST = (
    ("two_boom_3d", "x", 2.66, (0.002, 0.02, 0.2, 1.0, 2.0, 5.0), 400.0),
    ("two_boom_3d", "z", 2.04, (0.02,), 400.0),
    ("two_boom_3d", "x", 1.0, (0.02,), 400.0),
    ("two_boom_3d", "z", 10.0, (0.02,), 400.0),
    ("four_boom", "x", 2.0, (0.02, 1.0, 5.0), 300.0),
    ("four_boom", "z", 2.0, (0.02,), 300.0),
    ("asymmetric_booms", "z", 2.0, (0.02, 2.0), 400.0),
    ("asymmetric_booms", "x", 2.0, (0.02,), 400.0),
)
RANDOM = (
    ("two_boom_3d", 2.66),
    ("two_boom_3d", 1.0),
    ("four_boom", 2.0),
    ("asymmetric_booms", 2.0),
)
SPINS = (0.0, 0.01, 0.03, 0.1, 0.3)  # about all axes at t = 0, relays at random, rad/s
TUMBLES = (0.003, 0.01, 0.03)  # about y, under the worst schedule about x, rad/s
STEP = 0.05  # s: 1e-6 of the phase of the fastest mode that rings


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """One flight held to one bound.

    Attributes:
        what: What was flown.
        torque: M0 of all channels, N m.
        bound: M_e, N m.
        worst: The worst case that exists in the linear theory; nan if it was not asked for.
        measured: Largest |M - J omega'|, N m.
        word: What the verdict comes to.
    """

    what: str
    torque: float
    bound: float
    worst: float
    measured: float
    word: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Target:
    """A machine with its bounds.

    Attributes:
        model: The compiled model.
        elastic: Its structure.
        bounds: Its bounds.
    """

    model: Any
    elastic: ElasticModel
    bounds: Influence

    def row(self, what: str, schedule: Schedule, axis: str, worst: float = np.nan) -> Row:
        """Flies a schedule and holds it to the bound.

        Args:
            what: What it is.
            schedule: The schedule.
            axis: About which axis.
            worst: The worst case that exists, N m.
        """
        verdict = claim(self.elastic, self.bounds, axis).check(schedule.fly(self.model, STEP))
        return Row(
            what=what, torque=float(self.bounds.torque[0]),
            bound=float(self.bounds.bound[AXES.index(axis)]), worst=worst,
            measured=verdict.measured, word=word(verdict),
        )  # fmt: skip


def target(name: str, *, torque: float, dwell: float) -> Target:
    """Returns a shipped machine with its bounds.

    Args:
        name: The machine.
        torque: M0 of all channels, N m.
        dwell: Least time between switchings of all, s.
    """
    model = mjcf.assemble(spacecraft.load(name)).compile()
    elastic = elastic_model(model)
    return Target(
        model=model, elastic=elastic, bounds=influence(elastic, torque=torque, dwell=dwell)
    )


def worst_phase(longest: float) -> Iterator[Row]:
    """Flies the worst schedules.

    Args:
        longest: Flights are cut to this length, s.
    """
    for name, axis, dwell, torques, duration in WORST:
        for torque in torques:
            craft = target(name, torque=torque, dwell=dwell)
            schedule, worst = _worst(craft, axis, min(duration, longest))
            yield craft.row(f"worst {name} {axis}, dwell {dwell:g} s", schedule, axis, worst)


def at_random(longest: float) -> Iterator[Row]:
    """Flies relays that switch at random, three seeds each; the worst of them counts.

    Args:
        longest: Flights are cut to this length, s.
    """
    for name, dwell in RANDOM:
        craft = target(name, torque=0.02, dwell=dwell)
        drawn = [_random(craft, seed, min(200.0, longest)) for seed in range(3)]
        for axis in AXES:
            rows = [craft.row(f"random {name} {axis}, dwell {dwell:g} s", s, axis) for s in drawn]
            yield max(rows, key=lambda row: row.measured)


def spinning(longest: float) -> Iterator[Row]:
    """Flies a bus that turns.

    Args:
        longest: Flights are cut to this length, s.
    """
    craft = target("two_boom_3d", torque=0.02, dwell=2.66)
    drawn = _random(craft, 0, min(200.0, longest))
    for spin in SPINS:
        schedule = dataclasses.replace(drawn, spin=(spin,) * 3)
        yield craft.row(f"random two_boom_3d x, {spin:g} rad/s about all", schedule, "x")
    schedule, worst = _worst(craft, "x", min(400.0, longest))
    for spin in TUMBLES:
        tumbling = dataclasses.replace(schedule, spin=(0.0, spin, 0.0))
        yield craft.row(f"worst two_boom_3d x, {spin:g} rad/s about y", tumbling, "x", worst)


def searched(evaluations: int, longest: float) -> Iterator[Row]:
    """Lets the search look for the worst, within small motion and beyond it.

    Args:
        evaluations: Flights of each search.
        longest: Flights are cut to this length, s.
    """
    for torque, push, spin in (
        (0.02, 0.0, 0.0),
        (0.02, 0.9, 0.0),
        (0.02, 0.0, 0.1),
        (5.0, 0.9, 0.0),
    ):
        craft = target("two_boom_3d", torque=torque, dwell=2.66)
        schedule, _ = search(
            craft.model, craft.elastic, craft.bounds, axis="x", evaluations=evaluations,
            rng=np.random.default_rng(0), disturbance=push, spin=spin,
            duration=min(400.0, longest),
        )  # fmt: skip
        yield craft.row(f"search two_boom_3d x, M1 to {push:g} M0, spin to {spin:g}", schedule, "x")


def _worst(craft: Target, axis: str, duration: float) -> tuple[Schedule, float]:
    found = craft.bounds
    case = worst_case(
        craft.elastic, torque=found.torque, dwell=found.dwell, axis=axis, step=0.02,
        horizon=duration,
    )  # fmt: skip
    times, levels = case.switch_times, case.levels
    return Schedule(switch_times=times, levels=levels, duration=case.duration), case.moment


def _random(craft: Target, seed: int, duration: float) -> Schedule:
    found = craft.bounds
    rng = np.random.default_rng(seed)
    return random_schedule(torque=found.torque, dwell=found.dwell, duration=duration, rng=rng)
