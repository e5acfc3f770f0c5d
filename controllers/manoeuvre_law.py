"""The law that flies a planned manoeuvre, pulse by pulse, and then hands over to a closing law."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

from controllers import gorelov, input_shaping
from controllers.efremov_relay import MultilevelRelay
from controllers.plans import SmoothPlan, SwitchedPlan
from controllers.pulse_modulation import modulated

Profile = Literal["min_time", "min_fuel", "min_peak", "min_energy", "bang_bang", "zv", "zvd", "ei"]
_SHAPED = {
    "bang_bang": input_shaping.bang_bang,
    "zv": input_shaping.zv,
    "zvd": input_shaping.zvd,
    "ei": input_shaping.ei,
}
SHAPERS = tuple(_SHAPED)
_AT_REST = 1e-12  # rad/s


class Memory(NamedTuple):
    """What the law remembers.

    Attributes:
        changes: Instants of the plan at which the level changes, its start and end included, s.
        levels: Thrust from each of them on, N or N m.
        passed: How many of them are past.
        closing: Memory of the closing law, once it flies.
    """

    changes: tuple[float, ...]
    levels: tuple[float, ...]
    passed: int
    closing: Any


@dataclass(frozen=True, slots=True, kw_only=True)
class Manoeuvre:
    """The law.

    Attributes:
        profile: How the manoeuvre is planned.
        angle: Quasi-rigid angle at the end, rad.
        rate: Its rate at the end, rad/s.
        omega: Frequencies of the modes to be left at rest, rad/s.
        damping: Coefficients of their rates, 1/s.
        unit: Acceleration at unit thrust, rad/s^2.
        level: Thrust of the pulses, N or N m.
        duration: T, s; None for the least time, and for shapers that use the whole level.
        slots: Pulses that stand for a smooth plan.
        delay: After which every command acts, s.
        closing: The law that flies when the plan has acted; None for thrust off.
        sensors: Quasi-rigid angle and rate.
        thrusters: The channel.
        period: None: a law in continuous time.
    """

    profile: Profile
    angle: float
    rate: float
    omega: tuple[float, ...]
    damping: tuple[float, ...]
    unit: float
    level: float
    duration: float | None
    slots: int
    delay: float
    closing: MultilevelRelay | None
    sensors: tuple[str, ...]
    thrusters: tuple[str, ...]
    period: None = None

    def plan(self, angle: float, rate: float) -> SwitchedPlan:
        """Returns the plan from a start, in rad/s^2.

        Args:
            angle: Quasi-rigid angle when the plan is made, rad.
            rate: Its rate, rad/s.

        Raises:
            ValueError: If there is no such manoeuvre; the planner says why.
        """
        smooth = self._planned(angle + rate * self.delay, rate)
        if isinstance(smooth, SmoothPlan):
            return modulated(smooth, level=self.level * self.unit, slots=self.slots)
        return smooth

    def _planned(self, x0: float, v0: float) -> SwitchedPlan | SmoothPlan:
        ends = {"x0": x0, "v0": v0, "x1": self.angle, "v1": self.rate}
        modes = {"omega": self.omega, "damping": self.damping}
        bound = self.level * self.unit
        if self.profile == "min_time":
            return gorelov.min_time(**modes, **ends, bound=bound)
        if self.profile in SHAPERS:
            return self._shaped(x0, v0)
        duration = self._duration()
        if self.profile == "min_fuel":
            return gorelov.min_fuel(**modes, **ends, bound=bound, duration=duration)
        if self.profile == "min_peak":
            return gorelov.min_peak(**modes, **ends, duration=duration)
        return gorelov.min_energy(**modes, **ends, duration=duration)

    def _shaped(self, x0: float, v0: float) -> SwitchedPlan:
        if abs(v0) > _AT_REST or self.rate:
            raise ValueError(
                f"profile {self.profile!r} goes from rest to rest; the rate is {v0:.6g} rad/s at "
                f"the start and to be {self.rate:.6g} at the end: take min_time, min_fuel, "
                "min_peak or min_energy"
            )
        size = {"duration": self.duration}
        if self.duration is None:
            size = {"bound": self.level * self.unit}
        ends = {"x0": x0, "x1": self.angle}
        return _SHAPED[self.profile](omega=self.omega, damping=self.damping, **ends, **size)

    def _duration(self) -> float:
        if self.duration is None:
            raise ValueError(f"profile {self.profile!r} needs controller.duration, s")
        return self.duration

    def init(self) -> None:
        """Returns no memory: the plan follows from the first measurement."""
        return

    def step(
        self, t: float, y: Sequence[float], memory: Memory | None
    ) -> tuple[Sequence[float], Memory]:
        """Returns the thrust and the new memory.

        Args:
            t: Time, s.
            y: Quasi-rigid angle and rate, rad and rad/s.
            memory: What the last step returned.
        """
        if memory is None:
            plan = self.plan(y[0], y[1])
            changes = [t, *(t + plan.switch_times), t + plan.duration, t + plan.duration]
            changes[-1] += self.delay  # when the last command has acted
            levels = [*(plan.levels / self.unit), 0.0, 0.0]
            memory = Memory(tuple(map(float, changes)), tuple(map(float, levels)), 0, None)
        passed = sum(change <= t for change in memory.changes)
        memory = memory._replace(passed=passed)
        if passed < len(memory.changes) or self.closing is None:
            return (memory.levels[passed - 1],), memory
        own = self.closing.init() if memory.closing is None else memory.closing
        u, own = self.closing.step(t, self._from_target(y), own)
        return u, memory._replace(closing=own)

    def events(self, t: float, y: Sequence[float], memory: Memory) -> Sequence[float]:
        """Returns the time left to the next change of the plan, or the events of the closing law.

        Args:
            t: Time, s.
            y: Quasi-rigid angle and rate, rad and rad/s.
            memory: What the last step returned.
        """
        if memory.closing is not None and self.closing is not None:
            return self.closing.events(t, self._from_target(y), memory.closing)
        return [change - t for change in memory.changes[memory.passed :][:1]]

    def _from_target(self, y: Sequence[float]) -> tuple[float, float]:
        return y[0] - self.angle, y[1] - self.rate
