"""Attacks on the bound of the elastic moment: schedules flown on MuJoCo and held to it.

A flight on which an assumption fails is never said to keep the bound, whatever was measured; one on
which all hold and the bound is passed breaks it.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from spacecraft_sim.elastic_flight import fly
from spacecraft_sim.elastic_influence import Influence
from spacecraft_sim.elastic_modes import ElasticModel, find_modes
from spacecraft_sim.guarantee import Assumption, Guarantee, Measurement, Verdict
from spacecraft_sim.relay_channels import AXES
from spacecraft_sim.small_motion import LEFT_OUT, slow_rotation, small_deflection
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray

_CLOCK = 1e-9  # share of the dwell by which rounding may shorten it


@dataclass(frozen=True, slots=True, kw_only=True)
class Schedule:
    """Torques of the three channels.

    Attributes:
        switch_times: Times of the switchings of each channel, ascending, > 0, s.
        levels: Torque of each channel from t = 0 on and after each switching, N m.
        duration: How long it lasts, s.
        spin: Rate of the bus at t = 0, rad/s.
        disturbance: Constant torque, N m.
    """

    switch_times: tuple[Array, ...]
    levels: tuple[Array, ...]
    duration: float
    spin: tuple[float, ...] = (0.0, 0.0, 0.0)
    disturbance: tuple[float, ...] = (0.0, 0.0, 0.0)

    def fly(self, model: Any, timestep: float | None = None) -> Trajectory:
        """Flies it on MuJoCo.

        Args:
            model: The compiled model.
            timestep: Longest step, s; as `elastic_flight.fly` chooses it if left out.
        """
        return fly(
            model, switch_times=self.switch_times, levels=self.levels, duration=self.duration,
            spin=self.spin, disturbance=self.disturbance, timestep=timestep,
        )  # fmt: skip


def random_schedule(
    *, torque: Array, dwell: Array, duration: float, rng: np.random.Generator
) -> Schedule:
    """Returns relays that switch at random: after the dwell and as long again on average.

    Args:
        torque: M0 of each channel, shape (3,), N m.
        dwell: Least time between switchings of each, shape (3,), s.
        duration: How long, s.
        rng: Source of all that is random.
    """
    times, levels = [], []
    for M0, held in zip(torque, dwell, strict=True):
        count = int(duration / held) + 2
        at = np.cumsum(held * (1 + rng.exponential(size=count)))
        times.append(at[at < duration])
        signs = rng.choice([-1.0, 1.0]) * (-1.0) ** np.arange(len(times[-1]) + 1)
        levels.append(M0 * signs)
    return Schedule(switch_times=tuple(times), levels=tuple(levels), duration=duration)


# -- claims ----------------------------------------------------------------------------------------


def claim(elastic: ElasticModel, found: Influence, axis: str) -> Guarantee:
    """Returns the bound about an axis as a claim about flights of `elastic_flight.fly`.

    What small motion leaves out leaks from axis to axis: its share is of the largest bound.

    Args:
        elastic: The structure.
        found: Its bounds.
        axis: x, y or z.
    """
    bound = float(found.bound[AXES.index(axis)] + LEFT_OUT * found.bound.max())

    def measure(flight: Trajectory) -> Measurement:
        moment = np.abs(flight[f"moment_{axis}"])
        worst = int(np.argmax(moment))
        return Measurement(
            float(moment[worst]),
            float(flight.time[worst]),
            assumptions=(*small_motion(elastic, flight), *dwells(flight, found.dwell)),
        )

    return Guarantee(
        claim=f"moment of the elastic parts about {axis}, |M - J omega'| <= M_e",
        source="Sokolov 2004, (27), or the L1 norm",
        unit="N m",
        bound=bound,
        measure=measure,
    )


def small_motion(elastic: ElasticModel, flight: Trajectory) -> tuple[Assumption, ...]:
    """Returns what the linear theory takes for granted, as it was in a flight.

    Args:
        elastic: The structure.
        flight: A flight of `elastic_flight.fly`.
    """
    assert elastic.scale is not None
    bent = np.array([np.abs(flight[name]).max() for name in elastic.coordinates]) / elastic.scale
    worst = int(np.argmax(bent))
    rate = float(np.linalg.norm([flight[f"spin_{axis}"] for axis in AXES], axis=0).max())
    return (
        small_deflection(elastic.coordinates[worst], float(bent[worst])),
        slow_rotation(rate, find_modes(elastic).slowest_decay),
    )


def dwells(flight: Trajectory, dwell: Array) -> tuple[Assumption, ...]:
    """Returns that no channel switched sooner than it may, as it was in a flight.

    Args:
        flight: A flight of `elastic_flight.fly`.
        dwell: Least time between switchings of each channel, shape (3,), s.
    """
    found = []
    for axis, least in zip(AXES, dwell, strict=True):
        torque = flight[f"torque_{axis}"]
        rows = np.flatnonzero(np.diff(torque)) + 1
        held = np.diff(flight.time[np.r_[0, rows]])
        on = torque[np.r_[0, rows]][:-1] != 0  # off it may be for any time
        found.append(
            Assumption(
                text=f"channel {axis} holds its torque for the dwell",
                value=float(np.min(held[on], initial=np.inf)),
                limit=float(least) * (1 - _CLOCK),
                relation=">=",
                unit="s",
            )
        )
    return tuple(found)


def broken(verdict: Verdict) -> bool:
    """Returns whether a flight passed a bound though every assumption held.

    Args:
        verdict: The verdict.
    """
    return not verdict.holds and not verdict.failed


def word(verdict: Verdict) -> str:
    """Returns what a verdict comes to in a few words.

    Args:
        verdict: The verdict.
    """
    if verdict.holds:
        return "holds"
    if verdict.failed:
        return f"not guaranteed: {'; '.join(str(a) for a in verdict.failed)}"
    return "BROKEN"
