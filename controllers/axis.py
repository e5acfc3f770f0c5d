"""What laws of one axis have in common: the names of its readings, and its thruster in rad/s^2."""

from dataclasses import dataclass
from typing import Literal

from spacecraft_sim.reduced import ReducedModel, double_integrator
from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.thrusters import Thrusters

Axis = Literal["x", "y", "z"]
Ways = Literal["both", "positive", "negative"]
SIGNS: dict[Ways, tuple[int, ...]] = {"both": (-1, 1), "positive": (1,), "negative": (-1,)}


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """One axis of a spacecraft with its thruster.

    Attributes:
        axis: x, y or z.
        thruster: Name of the thruster channel.
        sensors: Names of the angle, rad, and of its rate, rad/s.
        unit: Acceleration of the rigid machine at unit thrust, rad/s^2.
        spec: The thruster; None for an ideal one.
    """

    axis: Axis
    thruster: str
    sensors: tuple[str, str]
    unit: float
    spec: Thruster | None


def channel(
    model: ReducedModel | None,
    thrusters: Thrusters | None,
    *,
    axis: Axis = "z",
    feedback: Literal["attitude", "quasi_rigid"] = "attitude",
) -> Channel:
    """Returns an axis of a spacecraft.

    Args:
        model: The plant; the double integrator of unit inertia if left out.
        thrusters: The thrusters; ideal if left out.
        axis: The axis.
        feedback: What is fed back: the attitude of the bus and its rate, or the quasi-rigid angle
            of bus and booms and its rate.

    Raises:
        ValueError: If the plant has no such readings or no thruster about that axis.
    """
    model = model or double_integrator()
    name = f"thruster_{axis}"
    angle, rate = ("attitude", "rate") if feedback == "attitude" else (
        "quasi_rigid_angle", "quasi_rigid_rate"
    )  # fmt: skip
    return Channel(
        axis=axis,
        thruster=name,
        sensors=(f"{angle}_{axis}", f"{rate}_{axis}"),
        unit=model.gain(name, f"quasi_rigid_rate_{axis}"),
        spec=thrusters[name] if thrusters else None,
    )


def torque_gain(model: ReducedModel, axis: Axis) -> float:
    """Returns the acceleration of the rigid machine at a torque of 1 N m about an axis, rad/s^2.

    Args:
        model: The plant.
        axis: The axis.
    """
    name = f"disturbance_{axis}"
    if name in model.inputs:
        return model.gain(name, f"quasi_rigid_rate_{axis}")
    turning = {"x": -3, "y": -2, "z": -1}[axis]  # rotations come last
    return 1 / float(model.inertia[turning])
