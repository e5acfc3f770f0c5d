"""Units of thrust and minimum on-time, in which a relay with a minimum on-time has two parameters.

Ivanova & Sokolov (1999), section 1: t' = t/Dt, x' = I x/(u0 Dt^2), v' = I v/(u0 Dt), u' = I u/u0,
I = sign F.  What is left are F' = |F|/u0 and e' = e/u0; a negative bias is mirrored.
"""

from dataclasses import dataclass

from spacecraft_sim.checks import positive


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """The units of one axis.

    Attributes:
        sign: I, +1 or -1, the sign of the bias.
        acceleration: u0, rad/s^2.
        time: Dt, the minimum on-time, s.
    """

    sign: int
    acceleration: float
    time: float

    @property
    def angle(self) -> float:
        """The unit of x, rad."""
        return self.acceleration * self.time**2

    @property
    def rate(self) -> float:
        """The unit of v, rad/s."""
        return self.acceleration * self.time

    def reduced(self, angle: float, rate: float) -> tuple[float, float]:
        """Returns (x, v), mirrored if the bias is negative.

        Args:
            angle: Angle, rad.
            rate: Its rate, rad/s.
        """
        unit = self.sign / self.rate
        return angle * unit / self.time, rate * unit

    def physical(self, x: float, v: float) -> tuple[float, float]:
        """Returns angle, rad, and rate, rad/s.

        Args:
            x: Dimensionless position.
            v: Dimensionless rate.
        """
        return self.sign * x * self.angle, self.sign * v * self.rate


UNIT = Scale(sign=1, acceleration=1.0, time=1.0)


def to_dimensionless(
    *, thrust_acceleration: float, min_on_time: float, bias: float, disturbance: float
) -> tuple[float, float, Scale]:
    """Returns F >= 0, e and the units.

    Args:
        thrust_acceleration: u0, rad/s^2.
        min_on_time: Dt, s.
        bias: Constant disturbance of either sign, rad/s^2.
        disturbance: Bound of what else disturbs, rad/s^2.

    Returns:
        F, e and the scale that takes angles and rates there and back.

    Raises:
        ValueError: If a number is out of bounds, or |bias| + disturbance >= u0: the thrust does not
            master them.
    """
    positive(thrust_acceleration=thrust_acceleration, min_on_time=min_on_time)
    positive(disturbance=disturbance, **{"|bias|": abs(bias)}, zero=True)
    total = abs(bias) + disturbance
    if not total < thrust_acceleration:
        raise ValueError(
            f"|bias| + disturbance = |{bias:.6g}| + {disturbance:.6g} = {total:.6g} rad/s^2 must "
            f"be below the acceleration of the thrust, {thrust_acceleration:.6g} rad/s^2: with "
            f"this bias the disturbance must stay below "
            f"{max(thrust_acceleration - abs(bias), 0.0):.6g}"
        )
    scale = Scale(sign=1 if bias >= 0 else -1, acceleration=thrust_acceleration, time=min_on_time)
    return abs(bias) / thrust_acceleration, disturbance / thrust_acceleration, scale
