"""What a manoeuvre promises, as claims that a flight can be held to.

After the last command has acted the spacecraft shall stand at the target, and its elastic parts
shall be still.  On the plant of the plan both hold to rounding; on the machine what is left comes
from the modes that the plan leaves out, from thrusters that are not as assumed, and from geometry.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from controllers.manoeuvre_law import SHAPERS, Manoeuvre
from spacecraft_sim.guarantee import Assumption, Guarantee, Measurement
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.thrusters import Thrusters, nearest_level
from spacecraft_sim.trajectory import Trajectory, peak

PAPER = "Gorelov (1999)"
_ROUNDING = 1e-10  # share of a moment: root finding and rounding

Measure = Callable[[Trajectory], Measurement]


@dataclass(frozen=True, slots=True, kw_only=True)
class Claims:
    """The claims of one design.

    Attributes:
        law: The law.
        model: The plant, for what the plan leaves out.
        thrusters: The thrusters; ideal if None.
        accuracy: What the angles shall keep when the manoeuvre is over, rad.
    """

    law: Manoeuvre
    model: ReducedModel
    thrusters: Thrusters | None
    accuracy: float

    def all(self) -> tuple[Guarantee, ...]:
        """Returns every claim."""
        law, accuracy = self.law, self.accuracy
        source = PAPER if law.profile not in SHAPERS else "input shaping"
        angle = law.sensors[0]
        bus = angle.replace("quasi_rigid_angle", "attitude")
        claims = [
            ("residual of the plan's moments", f"{source}, (6)-(9)", "", _ROUNDING, self._residual),
            ("quasi-rigid angle at the target, from the end on", source, "rad", accuracy,
             self._within(angle, law.sensors[1])),
        ]  # fmt: skip
        if bus in self.model.outputs:
            rate = bus.replace("attitude", "rate")
            claims += [
                ("attitude of the bus at the target, from the end on", source, "rad", accuracy,
                 self._within(bus, rate)),
                ("elastic swing of the bus, from the end on", source, "rad", accuracy,
                 self._swing(bus, angle)),
            ]  # fmt: skip
        return tuple(
            Guarantee(claim=claim, source=source, unit=unit, bound=bound, predicted=0.0,
                      measure=measure, assumptions=self._hardware())
            for claim, source, unit, bound, measure in claims
        )  # fmt: skip

    def end(self, trajectory: Trajectory) -> float:
        """Returns when the last command of the plan has acted, s.

        Args:
            trajectory: A flight.
        """
        return float(trajectory.time[0]) + self._plan(trajectory).duration + self.law.delay

    def _plan(self, trajectory: Trajectory):
        return self.law.plan(*(float(trajectory[name][0]) for name in self.law.sensors))

    def _residual(self, trajectory: Trajectory) -> Measurement:
        return Measurement(self._plan(trajectory).residual)

    def _within(self, angle: str, rate: str) -> Measure:
        def measure(trajectory: Trajectory) -> Measurement:
            late = trajectory.time >= self.end(trajectory) - 1e-9
            if not late.any():
                return Measurement(np.nan)
            time = trajectory.time[late]
            target = self.law.angle + self.law.rate * (time - time[0])
            error = trajectory[angle][late] - target
            value, when = peak(time, error, trajectory[rate][late] - self.law.rate)
            return Measurement(value, when, assumptions=self._levels(trajectory))

        return measure

    def _swing(self, bus: str, quasi_rigid: str) -> Measure:
        def measure(trajectory: Trajectory) -> Measurement:
            late = trajectory.time >= self.end(trajectory) - 1e-9
            if not late.any():
                return Measurement(np.nan)
            swing, slope = (
                trajectory[a][late] - trajectory[b][late]
                for a, b in ((bus, quasi_rigid), (bus.replace("attitude", "rate"),
                                                  self.law.sensors[1]))
            )  # fmt: skip
            value, when = peak(trajectory.time[late], swing, slope)
            return Measurement(value, when, assumptions=self._levels(trajectory))

        return measure

    def _levels(self, trajectory: Trajectory) -> tuple[Assumption, ...]:
        """That the thruster has the levels of the plan, and time enough for its pulses."""
        if self.thrusters is None:
            return ()
        spec, plan = self.thrusters[self.law.thrusters[0]], self._plan(trajectory)
        levels = np.unique(plan.levels / self.law.unit).tolist()
        error = max(abs(nearest_level(x, spec) - x) for x in levels) / max(map(abs, levels))
        lengths = np.diff(plan.switch_times, prepend=0.0, append=plan.duration)
        shortest = float(lengths[plan.levels != 0].min())
        return (
            Assumption(text="the thruster has the levels of the plan", value=error, limit=1e-6),
            Assumption(text="minimum on-time within the shortest pulse", value=spec.min_on_time,
                       limit=shortest, relation="<=", unit="s"),
        )  # fmt: skip

    def _hardware(self) -> tuple[Assumption, ...]:
        """What the plan takes for granted of modes and thrusters."""
        planned, present = len(self.law.omega), len(self.model.frequencies)
        found = [
            Assumption(text="modes of the reduced model that the plan leaves out",
                       value=present - planned, limit=0, relation="<=")
        ]  # fmt: skip
        if self.thrusters is not None:
            spec = self.thrusters[self.law.thrusters[0]]
            lag = max(spec.rise_time, spec.fall_time)
            off = abs(spec.delay.mean - self.law.delay) + abs(spec.delay.amplitude)
            found += [
                Assumption(text="thrust follows the valve at once", value=lag, limit=0.0,
                           relation="<=", unit="s"),
                Assumption(text="the delay is the planned one", value=off, limit=0.0,
                           relation="<=", unit="s"),
            ]  # fmt: skip
        return tuple(found)
