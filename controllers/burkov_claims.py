"""What Burkov (1998) guarantees, as claims that a flight can be held to.

The theorems are of continuous time.  A sampled law holds each torque for a period T, in which V may
rise by the work of what the torque should have changed, at most sum T |du| |v|; V is asked to fall
but for that.  The filter's w is found by feeding it the recorded readings again.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from controllers.velocity_filter import SampledLaw
from spacecraft_sim.guarantee import Assumption, Guarantee, Measurement
from spacecraft_sim.loop_margins import Loop
from spacecraft_sim.trajectory import Trajectory, sample_rows

Array = np.ndarray
Vector = Sequence[float] | Array
PAPER = "Burkov 1998"
WINDOW = 0.01  # over which V may not rise but for the hold, s
_GROWING = 1e-9  # real part above which an eigenvalue of differences is positive, 1/s
_NO_KICK = 1e-9  # share of the largest torque by which a delivered one may differ for rounding


class Samples(NamedTuple):
    """A flight at the samples of its law.

    Attributes:
        time: s, shape (n,).
        readings: Readings of the law, shape (n, ny).
        filtered: w, shape (n, nz).
        torques: Torques delivered after each sample, shape (n, nu), N m.
        moving: Further readings, such as true velocities, shape (n, k).
    """

    time: Array
    readings: Array
    filtered: Array
    torques: Array
    moving: Array


def samples(law: SampledLaw, trajectory: Trajectory, moving: Sequence[str]) -> Samples:
    """Takes the rows of a flight at which its law was sampled, and filters them again.

    Args:
        law: The law.
        trajectory: The flight.
        moving: Names of further readings.

    Raises:
        ValueError: If the flight has no row at some sample.
    """
    at, numbers = sample_rows(trajectory.time, law.period)
    if len(at) == 0 or np.any(np.diff(numbers) != 1):
        raise ValueError(
            f"the flight has no row at every sample of its law, {law.period:.6g} s apart: "
            "record them all"
        )

    def columns(names: Sequence[str]) -> Array:
        return np.array([trajectory[name][at] for name in names]).reshape(len(names), -1).T

    time, readings = trajectory.time[at], columns(law.sensors)
    memory, filtered = None, []
    for t, y in zip(time.tolist(), readings.tolist(), strict=True):
        memory = law.filter.step(law.formula.filtered(t, y), memory)
        filtered.append(memory.w)
    return Samples(time, readings, np.array(filtered), columns(law.thrusters), columns(moving))


class Start(NamedTuple):
    """The first sample of a flight: readings of the law, w, and further readings."""

    readings: Array
    filtered: Array
    moving: Array


Entry = Callable[[Start], tuple[Assumption, ...]]


def _anywhere(start: Start) -> tuple[Assumption, ...]:
    return ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Theorem:
    """One theorem with its numbers and its Lyapunov function.

    Attributes:
        source: Where it stands.
        law: The law.
        assumptions: Hypotheses that the design decides.
        moving: Readings of V beside those of the law.
        speeds: Those on which the torques do work, in the order of the torques.
        energy: Takes readings, w and `moving` to V, J.
        deviation: Takes readings and `moving` to the distance from the goal.
        unit: Its unit.
    """

    source: str
    law: SampledLaw
    assumptions: tuple[Assumption, ...]
    moving: tuple[str, ...]
    speeds: tuple[str, ...]
    energy: Callable[[Vector, Vector, Vector], float]
    deviation: Callable[[Vector, Vector], float]
    unit: str

    def falls(self) -> Guarantee:
        """Returns the claim that V falls, but for what the hold does."""
        stride = max(1, round(WINDOW / self.law.period))

        def rise(flown: Samples, trajectory: Trajectory) -> Measurement:
            at = range(0, len(flown.time), stride)
            if len(at) < 2:
                return Measurement(math.nan, bound=math.nan)
            rises = np.diff([self._energy(flown, k) for k in at])
            work = self._work_of_hold(flown, trajectory)
            allowed = max(float(work[k : k + stride].sum()) for k in at[:-1])
            worst = int(np.argmax(rises))
            time = float(flown.time[at[worst + 1]])
            return Measurement(max(float(rises[worst]), 0.0), time, bound=allowed)

        span = f"{stride * self.law.period * 1e3:.6g} ms"
        return self._claim(
            f"V rises within {span} by no more than the hold does work", "V' <= 0", "J", rise
        )

    def ends(
        self,
        *,
        accuracy: float,
        loops: Sequence[Loop],
        others: tuple[Assumption, ...] = (),
        entry: Entry = _anywhere,
    ) -> Guarantee:
        """Returns the claim that a flight ends at the goal once the loop there has settled.

        Args:
            accuracy: Distance that is asked for, in `unit`.
            loops: Linear loops at the goal, or at several of a family.
            others: What is known of the other equilibria.
            entry: Takes the first sample to hypotheses on it.
        """
        settling = max(map(settling_time, loops))

        def end(flown: Samples, trajectory: Trajectory) -> Measurement:
            last = len(flown.time) - 1
            settled = Assumption(
                text="flight lasts until the linear loop has settled",
                value=float(flown.time[last]),
                limit=settling,
                relation=">=",
                unit="s",
            )
            distance = self.deviation(flown.readings[last], flown.moving[last])
            hypotheses = (settled, *entry(_start(flown)))
            return Measurement(distance, float(flown.time[last]), None, accuracy, hypotheses)

        return self._claim(
            "distance from the goal in the end",
            "time from the linear loop",
            self.unit,
            end,
            assumptions=(decaying(loops, self.law.period), *others),
        )

    def stays(
        self,
        *,
        reach: Callable[[Start, float], float],
        entry: Entry = _anywhere,
        claim: str = "distance from the goal at all times",
        detail: str = "V <= V(0)",
    ) -> Guarantee:
        """Returns the claim that V(0) bounds the distance from the goal.

        Args:
            reach: Takes the first sample, and the work of the hold, J, to the bound.
            entry: Takes the first sample to hypotheses on it.
            claim: The claim in words.
            detail: What it rests on.
        """

        def reached(flown: Samples, trajectory: Trajectory) -> Measurement:
            distances = [
                self.deviation(y, z) for y, z in zip(flown.readings, flown.moving, strict=True)
            ]
            worst, start = int(np.argmax(distances)), _start(flown)
            bound = reach(start, float(self._work_of_hold(flown, trajectory).sum()))
            time = float(flown.time[worst])
            return Measurement(distances[worst], time, None, bound, entry(start))

        return self._claim(claim, detail, self.unit, reached)

    def _claim(
        self,
        claim: str,
        detail: str,
        unit: str,
        measure: Callable[[Samples, Trajectory], Measurement],
        *,
        assumptions: tuple[Assumption, ...] = (),
    ) -> Guarantee:
        def measured(trajectory: Trajectory) -> Measurement:
            m = measure(samples(self.law, trajectory, self.moving), trajectory)
            assumptions = (*m.assumptions, as_commanded(self.law, trajectory))
            return Measurement(m.value, m.t_worst, m.predicted, m.bound, assumptions)

        return Guarantee(
            claim=claim,
            source=f"{self.source}; {detail}",
            unit=unit,
            measure=measured,
            assumptions=(*self.assumptions, *assumptions),
            signals=tuple(dict.fromkeys((*self.moving, *self.speeds))),
        )

    def _energy(self, flown: Samples, k: int) -> float:
        return self.energy(flown.readings[k], flown.filtered[k], flown.moving[k])

    def _work_of_hold(self, flown: Samples, trajectory: Trajectory) -> Array:
        """Largest work in each period of the change that the hold withholds, J."""
        speeds = np.abs(samples(self.law, trajectory, self.speeds).moving)
        change = np.abs(np.diff(flown.torques, axis=0))
        return self.law.period * (change * np.maximum(speeds[:-1], speeds[1:])).sum(axis=1)


def _start(flown: Samples) -> Start:
    return Start(flown.readings[0], flown.filtered[0], flown.moving[0])


def as_commanded(law: SampledLaw, trajectory: Trajectory) -> Assumption:
    """Returns the hypothesis that every torque is delivered at once and in full.

    Args:
        law: The law.
        trajectory: The flight.
    """
    missing = largest = 0.0
    for name in law.thrusters:
        wanted = trajectory[f"{name}_command"]
        missing = max(missing, float(np.max(np.abs(trajectory[name] - wanted))))
        largest = max(largest, float(np.max(np.abs(wanted))))
    return Assumption(
        text="torques are delivered as commanded",
        value=missing,
        limit=_NO_KICK * largest,
        relation="<=",
        unit="N m",
    )


def settling_time(loop: Loop) -> float:
    """Returns 20 of the longest time constants of a linear loop, s; inf if it is not stable.

    Args:
        loop: The loop at the goal.
    """
    slowest = max(x.real for x in loop.eigenvalues().tolist())
    return 20 / -slowest if slowest < 0 else math.inf


def decaying(loops: Sequence[Loop], period: float) -> Assumption:
    """Returns the hypothesis that a law is sampled often enough: its sampled loops decay.

    Along a path that is more than it needs: there a loop may grow for some instants.

    Args:
        loops: Linear loops.
        period: Sampling period, s.
    """
    return Assumption(
        text=f"growth rate of the linear loop sampled every {period * 1e3:.6g} ms",
        value=max(float(loop.growth(period)) for loop in loops),
        limit=0.0,
        unit="1/s",
    )


def unstable(loop: Loop, place: str, energy: float) -> Assumption:
    """Returns the hypothesis that an equilibrium other than the goal is not stable.

    Args:
        loop: The linear loop there.
        place: The equilibrium.
        energy: V there, J.
    """
    return Assumption(
        text=f"unstable directions at {place}, V = {energy:.6g} J",
        value=sum(x.real > _GROWING for x in loop.eigenvalues().tolist()),
        limit=1,
        relation=">=",
    )
