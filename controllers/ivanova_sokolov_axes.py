"""The regulator of Ivanova & Sokolov (1999) about several axes at once, each channel on its own.

The theory is one-dimensional.  About the principal axes of a free body the axes are independent but
for gyroscopic torques, (J_y - J_z) w_y w_z and so on, which belong to each axis' disturbance.
"""

import dataclasses

from controllers import ivanova_sokolov
from controllers.axis import Axis
from controllers.channels import Channels
from spacecraft_sim.guarantee import Guarantee
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.thrusters import Thrusters


def design(
    model: ReducedModel | None = None,
    thrusters: Thrusters | None = None,
    *,
    axes: tuple[Axis, ...],
    bias: tuple[float, ...],
    disturbance: tuple[float, ...],
    rule: ivanova_sokolov.Rule = "example_1",
    guarded: bool = True,
    period: float | None = None,
) -> tuple[Channels, tuple[Guarantee, ...]]:
    """Designs a regulator for each of several axes, and what is guaranteed of each.

    Args:
        model: The plant.
        thrusters: The thrusters, `thruster_<axis>`.
        axes: The axes.
        bias: F of each, the steady torque, N m.
        disturbance: e of each, the bound of the rest of the torque, N m.
        rule: The switching curves, of all axes.
        guarded: Whether Example 1 keeps 0 while v < 0 and -1 while v > 0.
        period: Sampling period, s; in continuous time if left out.

    Returns:
        The law and its guarantees, each named after its axis.

    Raises:
        ValueError: If there is not one bias and one disturbance an axis, or an axis has no
            regulator; the message says which.
    """
    if not len(axes) == len(bias) == len(disturbance):
        raise ValueError(
            f"axes = {list(axes)} need one bias and one disturbance each; got bias = {list(bias)}, "
            f"disturbance = {list(disturbance)}"
        )
    laws, claims = [], []
    for axis, steady, rest in zip(axes, bias, disturbance, strict=True):
        try:
            law, found = ivanova_sokolov.design(
                model, thrusters, bias=steady, disturbance=rest, axis=axis, rule=rule,
                guarded=guarded, period=period,
            )  # fmt: skip
        except ValueError as error:
            raise ValueError(f"axis {axis}: {error}") from error
        laws.append(law)
        claims += [dataclasses.replace(g, claim=f"{axis}: {g.claim}") for g in found]
    return Channels(laws=tuple(laws)), tuple(claims)
