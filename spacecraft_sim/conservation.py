"""Laws of mechanics as guarantees: they hold for every controller and judge the simulation."""

import numpy as np

from spacecraft_sim.guarantee import Guarantee, Measurement
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray

# Of the largest momentum, the whole or that of a rigid machine at the rate of the bus. RK4 stays
# below it at any step that resolves the highest mode; a thrust edge missed by 1 ms does not.
_SHARE = 1e-6


def momentum_balances(model: ReducedModel) -> tuple[Guarantee, ...]:
    """Returns the balance of angular momentum H(t) - H(0) = impulse of all torques, by axis.

    Torques turn with the bus and momentum does not: on a bus that turns about three axes each
    impulse is turned by the attitude half-way, and what that may be off by is allowed for.

    Args:
        model: The plant, for the torque of each input.
    """
    axes = [axis for axis in "xyz" if f"angular_momentum_{axis}" in model.outputs]
    return tuple(_balance(model, axis) for axis in axes if axis == "z" or len(axes) == 1)


def _balance(model: ReducedModel, axis: str) -> Guarantee:
    name = f"angular_momentum_{axis}"
    J = float(model.inertia[-1])

    def measure(trajectory: Trajectory) -> Measurement:
        H = trajectory[name]
        impulse, off = _given(model, trajectory, axis)
        error = np.abs(H - H[0] - impulse)
        worst = int(np.argmax(error))
        spin = J * float(np.max(np.abs(trajectory.signals.get(f"rate_{axis}", H / J))))
        bound = _SHARE * max(float(np.max(np.abs(H))), spin) + off
        return Measurement(float(error[worst]), float(trajectory.time[worst]), bound=bound)

    return Guarantee(
        claim=f"angular momentum about {axis} is the impulse given",
        source="Efremov et al. 2006, (1.6): H' = u + f",
        unit="N m s",
        measure=measure,
        predicted=0.0,
    )


def _given(model: ReducedModel, trajectory: Trajectory, axis: str) -> tuple[Array, float]:
    """Impulse about an axis of the world at each row, and how far it may be off, N m s.

    The axes of the bus are those of the world for a machine that turns about this axis alone, and
    to the reduced plant, which is linear.
    """
    axes = [a for a in "xyz" if f"angular_momentum_{a}" in model.outputs]
    if len(axes) < 3 or trajectory.meta.get("plant") == "reduced":
        parts = [
            model.gain(c, f"angular_momentum_{axis}") * trajectory[f"{c}_impulse"]
            for c in model.inputs
        ]
        return np.sum(parts, axis=0), 0.0
    torques = np.array(
        [[model.gain(c, f"angular_momentum_{a}") for a in axes] for c in model.inputs]
    )
    spent = np.array([np.diff(trajectory[f"{c}_impulse"]) for c in model.inputs])
    given = spent.T @ torques  # in each row's span, in the axes of the bus
    phi, omega = (
        np.stack([trajectory[f"{kind}_{a}"] for a in axes], axis=1) for kind in ("attitude", "rate")
    )
    k = axes.index(axis)
    about = _rotated((phi[1:] + phi[:-1]) / 2, given)[:, k]
    # The rule of the middle leaves an eighth of the second derivative, which only tilting has.
    across = np.arange(3) != k
    turn, change = np.diff(phi, axis=0), np.diff(omega, axis=0)
    tilt = np.linalg.norm(turn[:, across], axis=1)
    bend = tilt * np.linalg.norm(turn, axis=1)
    bend += np.linalg.norm(change[:, across], axis=1) * np.diff(trajectory.time)
    off = float(np.sum(np.linalg.norm(given, axis=1) * bend)) / 8
    return np.r_[0.0, np.cumsum(about)], off


def _rotated(vectors: Array, parts: Array) -> Array:
    """Rows of `parts` turned by rotation vectors, shape (n, 3) each: Rodrigues' formula."""
    angle = np.linalg.norm(vectors, axis=1, keepdims=True)
    once = np.cross(vectors, parts)
    twice = np.cross(vectors, once)
    half = np.sinc(angle / (2 * np.pi))
    return parts + np.sinc(angle / np.pi) * once + half**2 / 2 * twice
