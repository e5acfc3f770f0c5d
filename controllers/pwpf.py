"""PD feedback through a pulse-width pulse-frequency modulator, for comparison.

Law.  u = -(k_p x + k_d v), sampled, through the modulator of `modulation.py`.

G. Song, N. V. Buck, B. N. Agrawal, "Spacecraft vibration reduction using pulse-width
pulse-frequency modulated input shaper", J. Guidance, Control, and Dynamics 22 (1999) 433-440.
Nothing is guaranteed.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from controllers.axis import Axis, Ways, channel
from controllers.modulation import Modulated, Pwpf
from controllers.velocity_filter import sampled
from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Guarantee
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.thrusters import Thrusters


@dataclass(frozen=True, slots=True, kw_only=True)
class ProportionalDerivative:
    """u = -(k_p x + k_d v).

    Attributes:
        proportional: k_p, N/rad or N m/rad.
        derivative: k_d, N s/rad or N m s/rad.
    """

    proportional: float
    derivative: float

    def filtered(self, t: float, y: Sequence[float]) -> tuple[float, ...]:
        """Returns nothing: the rate is measured.

        Args:
            t: Time, s.
            y: Readings.
        """
        return ()

    def command(self, t: float, y: Sequence[float], w: Sequence[float]) -> tuple[float]:
        """Returns the thrust, N or N m.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            w: Nothing.
        """
        return (-(self.proportional * y[0] + self.derivative * y[1]),)


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
) -> tuple[Modulated, tuple[Guarantee, ...]]:
    """Designs PD feedback through a PWPF modulator; nothing is guaranteed of it.

    Args:
        model: The plant; the double integrator if left out.
        thrusters: The thrusters; ideal if left out.
        bandwidth: Natural frequency of the PD loop, rad/s.
        damping_ratio: Its damping ratio.
        gain: K_m of the lag.
        time_constant: T_m of the lag, s.
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
    positive(bandwidth=bandwidth, damping_ratio=damping_ratio)
    modulation = Pwpf(
        kind="pwpf", gain=gain, time_constant=time_constant, on=on, off=off, ways=ways
    )
    found = channel(model, thrusters, axis=axis)
    law = sampled(
        ProportionalDerivative(
            proportional=bandwidth**2 / found.unit,
            derivative=2 * damping_ratio * bandwidth / found.unit,
        ),
        cutoffs=(),
        hold="first-order hold",
        period=period,
        sensors=found.sensors,
        channels=(found.thruster,),
        thrusters=thrusters,
    )
    pulsed = Modulated(
        law=law,
        sampling=period,
        # The valve keeps to its minimum on-time unasked; the modulator knows nothing of it.
        modulators=(modulation.modulator(period, 0.0),),
        levels=(found.spec.levels[-1] if found.spec else 1.0,),
    )
    return pulsed, ()
