"""Laws of mechanics as guarantees: they hold for every controller and judge the simulation."""

import math

import numpy as np

from spacecraft_sim.guarantee import Guarantee, Measurement
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.trajectory import Trajectory

# Of the largest momentum, the whole or that of a rigid machine at the rate of the bus. RK4 stays
# below it at any step that resolves the highest mode; a thrust edge missed by 1 ms does not.
_SHARE = 1e-6


def momentum_balances(model: ReducedModel) -> tuple[Guarantee, ...]:
    """Returns the balance of angular momentum H(t) - H(0) = impulse of all torques, by axis.

    Torques turn with the bus and momentum does not: what a tilt of the bus may make of torques
    about other axes is allowed for.

    Args:
        model: The plant, for the torque of each input.
    """
    axes = [axis for axis in "xyz" if f"angular_momentum_{axis}" in model.outputs]
    return tuple(_balance(model, axis) for axis in axes if axis == "z" or len(axes) == 1)


def _balance(model: ReducedModel, axis: str) -> Guarantee:
    name = f"angular_momentum_{axis}"
    J = float(model.inertia[-1])
    torque = {channel: model.gain(channel, name) for channel in model.inputs}

    def measure(trajectory: Trajectory) -> Measurement:
        H = trajectory[name]
        impulse = sum(k * trajectory[f"{channel}_impulse"] for channel, k in torque.items())
        error = np.abs(H - H[0] - impulse)
        worst = int(np.argmax(error))
        spin = J * float(np.max(np.abs(trajectory.signals.get(f"rate_{axis}", H / J))))
        bound = _SHARE * max(float(np.max(np.abs(H))), spin) + _tilted(model, trajectory, axis)
        return Measurement(float(error[worst]), float(trajectory.time[worst]), bound=bound)

    return Guarantee(
        claim=f"angular momentum about {axis} is the impulse given",
        source="Efremov et al. 2006, (1.6): H' = u + f",
        unit="N m s",
        measure=measure,
        predicted=0.0,
    )


def _tilted(model: ReducedModel, trajectory: Trajectory, axis: str) -> float:
    """Bound of the impulse about an axis of the torques about the others, N m s."""
    others = [a for a in "xyz" if a != axis and f"angular_momentum_{a}" in model.outputs]
    if len(others) < 2:
        return 0.0  # it turns about this axis alone
    tilt = float(np.linalg.norm([trajectory[f"attitude_{a}"] for a in others], axis=0).max())
    total = 0.0
    for channel in model.inputs:
        spent = float(np.abs(np.diff(trajectory[f"{channel}_impulse"])).sum())
        own, *across = (model.gain(channel, f"angular_momentum_{a}") for a in (axis, *others))
        total += spent * (math.hypot(*across) + tilt * abs(own))
    return tilt * total
