"""The equations of Euler and Poisson of a rigid body about its centre of mass, free of MuJoCo.

Theta om' + om x Theta om = M and s' = s x om, Burkov (1998), (5.1)-(5.3), with om, M and the
vectors s in principal body axes.  s1, s2, s3 are unit vectors along inertial axes: together they
are the attitude, and each alone is what a sensor of one direction sees.

Every method takes arrays with leading axes, for many motions at once.
"""

from dataclasses import dataclass

import numpy as np

from spacecraft_sim.checks import choices, positive

Array = np.ndarray
AXES = "xyz"
# a x b = a @ (b @ _CROSS), the product as a matrix: one multiplication for several a.
_CROSS = np.array([np.cross(np.eye(3), b).ravel() for b in np.eye(3)])
_UNIT = 1e-9  # how far from unit length, or from right angles, vectors may be for rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class RigidBody:
    """A rigid body under torques about its principal axes.

    The state is (om, s of each of the vectors).

    Attributes:
        inertia: A, B, C, principal moments of inertia, kg m^2.
        vectors: Which of s1, s2, s3 belong to the state.
    """

    inertia: tuple[float, float, float]
    vectors: tuple[str, ...] = ("s1", "s2", "s3")

    def __post_init__(self) -> None:
        if len(self.inertia) != 3:
            raise ValueError(f"inertia has the three entries A, B, C, not {len(self.inertia)}")
        A, B, C = self.inertia
        positive(A=A, B=B, C=C)
        if 2 * max(A, B, C) > (A + B + C) * (1 + 1e-12):
            raise ValueError(
                f"no body has the principal inertias A = {A:.6g}, B = {B:.6g}, C = {C:.6g}: "
                f"the largest may not exceed the sum of the others, {A + B + C - max(A, B, C):.6g}"
            )
        for name in self.vectors:
            if name not in ("s1", "s2", "s3"):
                raise ValueError(choices("vector", name, ("s1", "s2", "s3"), where="a rigid body"))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the torques about the principal axes: `torque_x` to `torque_z`."""
        return tuple(f"torque_{axis}" for axis in AXES)

    @property
    def units(self) -> dict[str, str]:
        """Names of the readings with their units: `rate_x` .., and `s1_x` .. of each vector."""
        vectors = {f"{name}_{axis}": "" for name in self.vectors for axis in AXES}
        return {f"rate_{axis}": "rad/s" for axis in AXES} | vectors

    def rates(self, x: Array, u: Array) -> Array:
        """Returns the time derivative of the state, shape (..., 3 + 3 m).

        Args:
            x: State, shape (..., 3 + 3 m), rad/s and 1.
            u: Torques about the principal axes, shape (..., 3), N m.
        """
        theta, om = np.array(self.inertia), x[..., :3]
        rows = np.concatenate([theta * om, x[..., 3:]], axis=-1)
        across = (om @ _CROSS).reshape(*om.shape[:-1], 3, 3)
        turned = (rows.reshape(*rows.shape[:-1], -1, 3) @ across).reshape(rows.shape)
        turned[..., :3] = (turned[..., :3] + u) / theta  # (5.1)
        return turned  # and (5.2), (5.3)

    def readings(self, x: Array) -> Array:
        """Returns the readings, in the order of `units`: the state itself.

        Args:
            x: State, shape (..., 3 + 3 m).
        """
        return x

    def state(self, *, rate: Array, attitude: Array) -> Array:
        """Returns the state of a motion, shape (..., 3 + 3 m).

        Args:
            rate: Angular velocity in principal axes, shape (..., 3), rad/s.
            attitude: Rotation whose rows are s1, s2, s3, shape (..., 3, 3).

        Raises:
            ValueError: If the rows are not orthogonal unit vectors.
        """
        attitude = np.asarray(attitude, dtype=float)
        error = np.max(np.abs(attitude @ np.swapaxes(attitude, -1, -2) - np.eye(3)))
        if not error < _UNIT:
            raise ValueError(f"s1, s2, s3 are not orthogonal unit vectors: off by {error:.3g}")
        rows = [attitude[..., int(name[1]) - 1, :] for name in self.vectors]
        return np.concatenate([np.broadcast_to(rate, rows[0].shape), *rows], axis=-1)

    def tangent(self, x: Array) -> Array:
        """Returns a basis of what may change at a state, shape (3 + 3 m, k).

        The vectors move as a rotation moves them, so k is 6, or 5 with a single vector.

        Args:
            x: State, shape (3 + 3 m,).
        """
        s = x[3:].reshape(-1, 3)
        turned = np.concatenate([np.cross(row, np.eye(3)).T for row in s])  # s x phi by phi
        directions, sizes, _ = np.linalg.svd(turned, full_matrices=False)
        directions = directions[:, sizes > 1e-6 * sizes[0]]
        k = directions.shape[1]
        return np.block([[np.eye(3), np.zeros((3, k))], [np.zeros((len(turned), 3)), directions]])

    def energy(self, x: Array) -> Array:
        """Returns the kinetic energy, shape (...), J.

        Args:
            x: State, shape (..., 3 + 3 m).
        """
        return (np.array(self.inertia) * x[..., :3] ** 2).sum(axis=-1) / 2
