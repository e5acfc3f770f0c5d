"""Equations of motion of planar arms in Lagrange's form, independent of MuJoCo.

A(q) q'' + b(q, q') + g(q) = M.  Joints turn about one horizontal axis, each angle counted from the
link before; at q = 0 the arm hangs straight down.  In the absolute angles theta_i = q_1 + .. + q_i
the kinetic energy is sum (m_ij cos(theta_i - theta_j) + I_i delta_ij) theta_i' theta_j'/2 with
constants m_ij: closed forms for any number of links.

Every method takes arrays with leading axes, for many motions at once.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple, Protocol

import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.dynamics import LinearPlant, jacobian

Array = np.ndarray
Vector = Sequence[float] | Array


class Mechanism(Protocol):
    """What a law may know of the mechanism that it drives."""

    @property
    def count(self) -> int:
        """How many joints there are, n."""
        ...

    def gravity(self, q: Vector) -> Array:
        """Returns g(q), the torques that hold the mechanism still, shape (n,), N m.

        Args:
            q: Joint angles, shape (n,), rad.
        """
        ...

    def inverse_dynamics(self, q: Vector, v: Vector, a: Vector) -> Array:
        """Returns A(q) a + b(q, v) + g(q), the torques of a motion, shape (n,), N m.

        Args:
            q: Joint angles, shape (n,), rad.
            v: Their rates, shape (n,), rad/s.
            a: Their accelerations, shape (n,), rad/s^2.
        """
        ...


class FlexibleMechanism(Protocol):
    """Links that rotors drive through springs."""

    @property
    def links(self) -> Mechanism:
        """The links."""
        ...

    @property
    def rotors(self) -> tuple[float, ...]:
        """J, inertias of the rotors, kg m^2."""
        ...

    @property
    def stiffnesses(self) -> tuple[float, ...]:
        """k, stiffnesses of the springs, N m/rad."""
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class PlanarArm:
    """An arm of rigid links in a vertical plane.

    The state of its motion is (q, q').

    Attributes:
        lengths: Distance from each joint to the next, the last of no effect, m.
        centres: Distance from each joint to the centre of mass of its link, m.
        masses: Masses of the links, kg.
        inertias: Their inertias about their centres of mass, kg m^2.
        g: Acceleration of gravity, m/s^2; 0 for none.
    """

    lengths: tuple[float, ...]
    centres: tuple[float, ...]
    masses: tuple[float, ...]
    inertias: tuple[float, ...]
    g: float = 9.81

    def __post_init__(self) -> None:
        parts = ("lengths", "centres", "masses", "inertias")
        sizes = {name: len(getattr(self, name)) for name in parts}
        if len(set(sizes.values())) != 1 or not self.masses:
            raise ValueError(f"an arm has one of each number for every link; here: {sizes}")
        for name in ("lengths", "masses", "inertias"):
            positive(**{f"{name}[{k}]": x for k, x in enumerate(getattr(self, name))})
        positive(zero=True, g=self.g, **{f"centres[{k}]": x for k, x in enumerate(self.centres)})

    @property
    def count(self) -> int:
        """How many joints there are, n."""
        return len(self.masses)

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the torques: `motor_1` to `motor_n`."""
        return tuple(f"motor_{k}" for k in self._numbers)

    @property
    def units(self) -> dict[str, str]:
        """Names of the readings with their units: `joint_1` .., `joint_1_rate` .."""
        angles = {f"joint_{k}": "rad" for k in self._numbers}
        return angles | {f"joint_{k}_rate": "rad/s" for k in self._numbers}

    @property
    def _numbers(self) -> range:
        return range(1, len(self.masses) + 1)

    def rates(self, x: Array, u: Array) -> Array:
        """Returns the time derivative of the state, shape (..., 2 n).

        Args:
            x: State (q, q'), shape (..., 2 n), rad and rad/s.
            u: Torques, shape (..., n), N m.
        """
        n = len(self.masses)
        q, v = x[..., :n], x[..., n:]
        return np.concatenate([v, self.acceleration(q, v, u)], axis=-1)

    def readings(self, x: Array) -> Array:
        """Returns the readings, in the order of `units`: the state itself.

        Args:
            x: State, shape (..., 2 n).
        """
        return x

    def mass_matrix(self, q: Vector) -> Array:
        """Returns A(q), shape (..., n, n), kg m^2.

        Args:
            q: Joint angles, shape (..., n), rad.
        """
        c = _constants(self)
        return c.sums.T @ (c.coupling * np.cos(_differences(q @ c.sums.T)) + c.inertias) @ c.sums

    def bias(self, q: Vector, v: Vector) -> Array:
        """Returns b(q, q'), the terms quadratic in the rates, shape (..., n), N m.

        Args:
            q: Joint angles, shape (..., n), rad.
            v: Their rates, shape (..., n), rad/s.
        """
        c = _constants(self)
        turning = c.coupling * np.sin(_differences(q @ c.sums.T))
        return _applied(turning, (v @ c.sums.T) ** 2) @ c.sums

    def gravity(self, q: Vector) -> Array:
        """Returns g(q), shape (..., n), N m.

        Args:
            q: Joint angles, shape (..., n), rad.
        """
        c = _constants(self)
        return (c.weights * np.sin(q @ c.sums.T)) @ c.sums

    def potential(self, q: Vector) -> Array:
        """Returns Pi(q), zero where the arm hangs, shape (...), J.

        Args:
            q: Joint angles, shape (..., n), rad.
        """
        c = _constants(self)
        return (c.weights * (1 - np.cos(q @ c.sums.T))).sum(axis=-1)

    def inverse_dynamics(self, q: Vector, v: Vector, a: Vector) -> Array:
        """Returns A(q) a + b(q, v) + g(q), shape (..., n), N m.

        Args:
            q: Joint angles, shape (..., n), rad.
            v: Their rates, shape (..., n), rad/s.
            a: Their accelerations, shape (..., n), rad/s^2.
        """
        return _applied(self.mass_matrix(q), np.asarray(a)) + self.bias(q, v) + self.gravity(q)

    def acceleration(self, q: Vector, v: Vector, torque: Vector) -> Array:
        """Returns q'', shape (..., n), rad/s^2.

        Args:
            q: Joint angles, shape (..., n), rad.
            v: Their rates, shape (..., n), rad/s.
            torque: M, shape (..., n), N m.
        """
        c = _constants(self)  # in the absolute angles, where the matrices are simplest
        theta, omega = q @ c.sums.T, v @ c.sums.T
        differences = _differences(theta)
        turning = _applied(c.coupling * np.sin(differences), omega**2)
        free = torque @ c.parts - turning - c.weights * np.sin(theta)
        M = c.coupling * np.cos(differences) + c.inertias
        return np.linalg.solve(M, free[..., None])[..., 0] @ c.parts.T


def linear_mechanism(
    mechanism: Mechanism, *, q: Vector, v: Vector | None = None, a: Vector | None = None
) -> LinearPlant:
    """Linearises a mechanism about a position, or about an instant of a motion, frozen.

    A y' + R_v y + R_q x = u with R the torques of the motion, Burkov (1998), (3.5); the state is
    (x, y), deviations of angles and rates.

    Args:
        mechanism: The mechanism.
        q: Joint angles, shape (n,), rad.
        v: Their rates, rad/s; zero if left out.
        a: Their accelerations, rad/s^2; zero if left out.
    """
    q = np.asarray(q, dtype=float)
    n, zero = len(q), np.zeros(len(q))
    v, a = (zero if z is None else np.asarray(z, dtype=float) for z in (v, a))
    A = inertia_matrix(mechanism, q)
    by_angle = jacobian(lambda x: mechanism.inverse_dynamics(x, v, a), q)
    by_rate = jacobian(lambda y: mechanism.inverse_dynamics(q, y, a), v)
    names = [f"joint_{k}" for k in range(1, n + 1)]
    return LinearPlant(
        A=np.block(
            [[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(A, np.hstack([by_angle, by_rate]))]]
        ),
        B=np.vstack([np.zeros((n, n)), np.linalg.inv(A)]),
        C=np.eye(2 * n),
        y0=np.concatenate([q, v]),
        inputs=tuple(f"motor_{k}" for k in range(1, n + 1)),
        outputs=(*names, *(f"{name}_rate" for name in names)),
    )


def linear_flexible(mechanism: FlexibleMechanism, *, q: Vector) -> LinearPlant:
    """Linearises links with elastic joints about a position without load on the springs.

    The state is (x1, x2, x1', x2'), deviations of links and rotors.

    Args:
        mechanism: Links, rotors and springs.
        q: Angles of links and rotors, shape (n,), rad.
    """
    q = np.asarray(q, dtype=float)
    n, k = len(q), np.diag(mechanism.stiffnesses)
    softened = k + jacobian(mechanism.links.gravity, q)
    inverse = np.zeros((2 * n, 2 * n))
    inverse[:n, :n] = np.linalg.inv(inertia_matrix(mechanism.links, q))
    inverse[n:, n:] = np.diag(1 / np.array(mechanism.rotors))
    zero, one = np.zeros((2 * n, 2 * n)), np.eye(2 * n)
    names = [f"{part}_{i}" for part in ("link", "rotor") for i in range(1, n + 1)]
    return LinearPlant(
        A=np.block([[zero, one], [-inverse @ np.block([[softened, -k], [-k, k]]), zero]]),
        B=np.vstack([np.zeros((3 * n, n)), inverse[n:, n:]]),
        C=np.eye(4 * n),
        y0=np.concatenate([q, q, np.zeros(2 * n)]),
        inputs=tuple(f"motor_{i}" for i in range(1, n + 1)),
        outputs=(*names, *(f"{name}_rate" for name in names)),
    )


def inertia_matrix(mechanism: Mechanism, q: Vector) -> Array:
    """Returns A(q) of any mechanism, column by column, shape (n, n), kg m^2.

    Args:
        mechanism: The mechanism.
        q: Joint angles, shape (n,), rad.
    """
    zero, g = np.zeros(len(q)), mechanism.gravity(q)
    columns = [mechanism.inverse_dynamics(q, zero, e) - g for e in np.eye(len(q))]
    return np.stack(columns, axis=-1)


class _Constants(NamedTuple):
    """What the equations in absolute angles are made of.

    Attributes:
        coupling: m_ij, shape (n, n), kg m^2.
        inertias: Inertias of the links, on the diagonal, shape (n, n), kg m^2.
        weights: Torques at unit sine of each absolute angle, shape (n,), N m.
        sums: Takes joint angles to absolute angles, shape (n, n).
        parts: Its inverse.
    """

    coupling: Array
    inertias: Array
    weights: Array
    sums: Array
    parts: Array


@lru_cache(maxsize=64)
def _constants(arm: PlanarArm) -> _Constants:
    n, masses = len(arm.masses), np.array(arm.masses)
    # How far the centre of mass of link k moves at unit turn of absolute angle i.
    reach = np.tril(np.broadcast_to(arm.lengths, (n, n)), -1) + np.diag(arm.centres)
    return _Constants(
        coupling=reach.T @ (masses[:, None] * reach),
        inertias=np.diag(arm.inertias),
        weights=arm.g * masses @ reach,
        sums=np.tril(np.ones((n, n))),
        parts=np.eye(n) - np.eye(n, k=-1),
    )


def _differences(theta: Array) -> Array:
    return theta[..., :, None] - theta[..., None, :]


def _applied(matrix: Array, vector: Array) -> Array:
    return (matrix @ vector[..., None])[..., 0]


@dataclass(frozen=True, slots=True, kw_only=True)
class FlexibleJointArm:
    """A planar arm driven through elastic joints, Burkov (1998), (4.1).

    A(q1) q1'' + b + g + k (q1 - q2) = 0, J q2'' - k (q1 - q2) = M.
    The state is (q1, q2, q1', q2').

    Attributes:
        links: The links, whose angles are q1.
        rotors: J, inertias of the rotors on the links' side of the gears, kg m^2.
        stiffnesses: k, stiffnesses of the joints, N m/rad.
    """

    links: PlanarArm
    rotors: tuple[float, ...]
    stiffnesses: tuple[float, ...]

    def __post_init__(self) -> None:
        n = len(self.links.masses)
        for name in ("rotors", "stiffnesses"):
            values = getattr(self, name)
            if len(values) != n:
                raise ValueError(f"{name} has {len(values)} entries; the arm has {n} links")
            positive(**{f"{name}[{k}]": x for k, x in enumerate(values)})

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the torques on the rotors: `motor_1` to `motor_n`."""
        return self.links.inputs

    @property
    def units(self) -> dict[str, str]:
        """Names of the readings with their units: `link_1` .., `rotor_1` .., and their rates."""
        names = [f"{part}_{k + 1}" for part in ("link", "rotor") for k in range(len(self.rotors))]
        return dict.fromkeys(names, "rad") | {f"{name}_rate": "rad/s" for name in names}

    def rates(self, x: Array, u: Array) -> Array:
        """Returns the time derivative of the state, shape (..., 4 n).

        Args:
            x: State (q1, q2, q1', q2'), shape (..., 4 n), rad and rad/s.
            u: Torques on the rotors, shape (..., n), N m.
        """
        n = len(self.rotors)
        q1, q2, v1 = x[..., :n], x[..., n : 2 * n], x[..., 2 * n : 3 * n]
        pull = np.array(self.stiffnesses) * (q1 - q2)
        rotors = (u + pull) / np.array(self.rotors)
        links = self.links.acceleration(q1, v1, -pull)
        return np.concatenate([x[..., 2 * n :], links, rotors], axis=-1)

    def readings(self, x: Array) -> Array:
        """Returns the readings, in the order of `units`: the state itself.

        Args:
            x: State, shape (..., 4 n).
        """
        return x
