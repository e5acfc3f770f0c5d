"""Schmitt trigger with a dead zone: the classic on/off regulator, for comparison.

Law.  s = x + T v of the angle x and its rate v.  The thruster switches on against s where |s|
reaches the threshold, and off where it has fallen to a share of it.

M. J. Sidi, "Spacecraft Dynamics and Control" (Cambridge, 1997), section 9.3.  Nothing is
guaranteed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from controllers.axis import SIGNS, Axis, Ways, channel
from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Guarantee
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.thrusters import Thrusters


@dataclass(frozen=True, slots=True, kw_only=True)
class SchmittTrigger:
    """The law.

    Attributes:
        lead: T, s.
        on: |s| at which the thruster switches on, rad.
        off: |s| at which it switches off, rad.
        level: Thrust, N or N m.
        signs: Signs that the thrust may have.
        sensors: Angle and rate.
        thrusters: The channel.
        period: None: a law in continuous time.
    """

    lead: float
    on: float
    off: float
    level: float
    signs: tuple[int, ...]
    sensors: tuple[str, ...]
    thrusters: tuple[str, ...]
    period: None = None

    def init(self) -> int:
        """Returns the sign of the thrust before the first step: off."""
        return 0

    def step(self, t: float, y: Sequence[float], memory: int) -> tuple[tuple[float], int]:
        """Returns the thrust and its sign.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            memory: The sign until now.
        """
        s = y[0] + self.lead * y[1]
        if memory and -memory * s <= self.off:
            memory = 0
        for sign in self.signs:
            if -sign * s >= self.on:
                memory = sign
        return (memory * self.level,), memory

    def events(self, t: float, y: Sequence[float], memory: int) -> tuple[float, ...]:
        """Returns how far s is from the next threshold, rad.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            memory: The sign of the thrust.
        """
        s = y[0] + self.lead * y[1]
        if memory:
            return (-memory * s - self.off,)
        return tuple(self.on + sign * s for sign in self.signs)


def design(
    model: ReducedModel | None = None,
    thrusters: Thrusters | None = None,
    *,
    threshold: float,
    lead: float,
    hysteresis: float = 0.2,
    level: float | None = None,
    ways: Ways = "both",
    axis: Axis = "z",
) -> tuple[SchmittTrigger, tuple[Guarantee, ...]]:
    """Designs a Schmitt trigger with a dead zone; nothing is guaranteed of it.

    Args:
        model: The plant; the double integrator if left out.
        thrusters: The thrusters; ideal if left out.
        threshold: |s| at which the thruster switches on, rad.
        lead: T of s = x + T v, s.
        hysteresis: Share of the threshold by which |s| must fall before it switches off.
        level: Thrust, N or N m; the thruster's highest if left out, 1 if there is no thruster.
        ways: Which way the thruster may push: against a steady torque one way is enough.
        axis: The axis.

    Returns:
        The law, and no guarantee.

    Raises:
        ValueError: If a number is not positive or the hysteresis is not below 1.
    """
    positive(threshold=threshold, lead=lead, hysteresis=hysteresis)
    if hysteresis >= 1:
        raise ValueError(f"hysteresis = {hysteresis} must be below 1: the thruster never went off")
    found = channel(model, thrusters, axis=axis)
    highest = found.spec.levels[-1] if found.spec else 1.0
    law = SchmittTrigger(
        lead=lead,
        on=threshold,
        off=threshold * (1 - hysteresis),
        level=highest if level is None else level,
        signs=SIGNS[ways],
        sensors=found.sensors,
        thrusters=(found.thruster,),
    )
    return law, ()
