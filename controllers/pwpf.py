"""PD feedback through a pulse-width pulse-frequency modulator, for comparison.

Law.  r = -(k_p x + k_d v) drives a lag, T f' = K (r - u) - f, and f a Schmitt trigger, whose output
is the thrust u.  Sampled: the lag is carried exactly from sample to sample with its input held.

G. Song, N. V. Buck, B. N. Agrawal, "Spacecraft vibration reduction using pulse-width
pulse-frequency modulated input shaper", J. Guidance, Control, and Dynamics 22 (1999) 433-440.
Nothing is guaranteed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from controllers.axis import SIGNS, Axis, Ways, channel
from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Guarantee
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.thrusters import Thrusters


class Memory(NamedTuple):
    """Output of the lag and sign of the thrust."""

    lag: float
    sign: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Modulator:
    """The law; all signals are in units of the thrust.

    Attributes:
        proportional: k_p over the thrust, 1/rad.
        derivative: k_d over the thrust, s/rad.
        gain: K.
        decay: exp(-period/T).
        on: |f| at which the thruster switches on.
        off: |f| at which it switches off.
        level: Thrust, N or N m.
        signs: Signs that the thrust may have.
        period: Sampling period, s.
        sensors: Angle and rate.
        thrusters: The channel.
    """

    proportional: float
    derivative: float
    gain: float
    decay: float
    on: float
    off: float
    level: float
    signs: tuple[int, ...]
    period: float
    sensors: tuple[str, ...]
    thrusters: tuple[str, ...]

    def init(self) -> Memory:
        """Returns a lag at rest and the thruster off."""
        return Memory(0.0, 0)

    def step(self, t: float, y: Sequence[float], memory: Memory) -> tuple[tuple[float], Memory]:
        """Returns the thrust and the new memory.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            memory: What the last step returned.
        """
        wanted = -(self.proportional * y[0] + self.derivative * y[1])
        goal = self.gain * (wanted - memory.sign)
        lag = goal + (memory.lag - goal) * self.decay
        sign = memory.sign
        if sign and sign * lag <= self.off:
            sign = 0
        for way in self.signs:
            if way * lag >= self.on:
                sign = way
        return (sign * self.level,), Memory(lag, sign)

    def events(self, t: float, y: Sequence[float], memory: Memory) -> tuple[float, ...]:
        """Returns nothing: the law acts at its samples.

        Args:
            t: Time, s.
            y: Angle and rate.
            memory: What the last step returned.
        """
        return ()


def design(
    model: ReducedModel | None = None,
    thrusters: Thrusters | None = None,
    *,
    bandwidth: float,
    damping_ratio: float = 0.8,
    gain: float = 4.5,
    time_constant: float = 0.15,
    on: float = 0.45,
    off: float = 0.15,
    period: float = 0.02,
    ways: Ways = "both",
    axis: Axis = "z",
) -> tuple[Modulator, tuple[Guarantee, ...]]:
    """Designs PD feedback through a PWPF modulator; nothing is guaranteed of it.

    Args:
        model: The plant; the double integrator if left out.
        thrusters: The thrusters; ideal if left out.
        bandwidth: Natural frequency of the PD loop, rad/s.
        damping_ratio: Its damping ratio.
        gain: K of the lag.
        time_constant: T of the lag, s.
        on: Output of the lag, over the thrust, at which the thruster switches on.
        off: Output at which it switches off.
        period: Sampling period, s.
        ways: Which way the thruster may push: against a steady torque one way is enough.
        axis: The axis.

    Returns:
        The law, and no guarantee.

    Raises:
        ValueError: If a number is not positive, or `off` not below `on`.
    """
    positive(bandwidth=bandwidth, damping_ratio=damping_ratio, gain=gain, on=on, off=off)
    positive(time_constant=time_constant, period=period)
    if off >= on:
        raise ValueError(f"off = {off} must be below on = {on}: the trigger would chatter")
    found = channel(model, thrusters, axis=axis)
    level = found.spec.levels[-1] if found.spec else 1.0
    thrust = level * found.unit  # rad/s^2
    law = Modulator(
        proportional=bandwidth**2 / thrust,
        derivative=2 * damping_ratio * bandwidth / thrust,
        gain=gain,
        decay=math.exp(-period / time_constant),
        on=on,
        off=off,
        level=level,
        signs=SIGNS[ways],
        period=period,
        sensors=found.sensors,
        thrusters=(found.thruster,),
    )
    return law, ()
