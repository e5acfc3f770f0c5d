"""Two-pulse phase-plane logic: a pulse at either end of a dead band, for comparison.

Law.  Where the angle x leaves the dead band and the rate v leads further out, the thruster fires
until the rate leads back in at the drift rate; the spacecraft then coasts to the other end, or
falls back where a steady torque turns it.  A limit cycle has two pulses, or one under such torque.

B. Wie, "Space Vehicle Dynamics and Control" (AIAA, 2008), section 7.4.  Nothing is guaranteed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from controllers.axis import SIGNS, Axis, Ways, channel
from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Guarantee
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.thrusters import Thrusters


@dataclass(frozen=True, slots=True, kw_only=True)
class TwoPulse:
    """The law.

    Attributes:
        dead_band: Half-width of the dead band, rad.
        drift: Rate at which it is crossed, rad/s.
        level: Thrust, N or N m.
        signs: Signs that the thrust may have.
        sensors: Angle and rate.
        thrusters: The channel.
        period: None: a law in continuous time.
    """

    dead_band: float
    drift: float
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
        x, v = y
        if memory and memory * v >= self.drift:
            memory = 0
        for sign in self.signs:
            if -sign * x >= self.dead_band and sign * v < self.drift:
                memory = sign
        return (memory * self.level,), memory

    def events(self, t: float, y: Sequence[float], memory: int) -> tuple[float, ...]:
        """Returns how far the state is from where a pulse begins, or ends.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            memory: The sign of the thrust.
        """
        x, v = y
        if memory:
            return (self.drift - memory * v,)
        return tuple(max(self.dead_band + s * x, s * v - self.drift) for s in self.signs)


def design(
    model: ReducedModel | None = None,
    thrusters: Thrusters | None = None,
    *,
    dead_band: float,
    drift: float,
    level: float | None = None,
    ways: Ways = "both",
    axis: Axis = "z",
) -> tuple[TwoPulse, tuple[Guarantee, ...]]:
    """Designs two-pulse phase-plane logic; nothing is guaranteed of it.

    Args:
        model: The plant; the double integrator if left out.
        thrusters: The thrusters; ideal if left out.
        dead_band: Half-width of the dead band, rad.
        drift: Rate at which the dead band is crossed, rad/s.
        level: Thrust, N or N m; the thruster's highest if left out, 1 if there is no thruster.
        ways: Which way the thruster may push: against a steady torque one way is enough.
        axis: The axis.

    Returns:
        The law, and no guarantee.

    Raises:
        ValueError: If a number is not positive.
    """
    positive(dead_band=dead_band, drift=drift)
    found = channel(model, thrusters, axis=axis)
    highest = found.spec.levels[-1] if found.spec else 1.0
    law = TwoPulse(
        dead_band=dead_band,
        drift=drift,
        level=highest if level is None else level,
        signs=SIGNS[ways],
        sensors=found.sensors,
        thrusters=(found.thruster,),
    )
    return law, ()
