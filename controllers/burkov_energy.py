"""The terms of the Lyapunov functions of Burkov (1998): what V is made of, by name.

They take, in this order, what a law reads, its filtered rates w, and what else moves.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from controllers.burkov_laws import BodyVectors, BodyVectorsAndRates, Position, Spin
from spacecraft_sim.mechanisms import FlexibleMechanism, Mechanism

Array = np.ndarray
Vector = Sequence[float] | Array
# Names of terms.
KINETIC, STIFFNESS, FILTER = "kinetic", "potential of the law", "filter"
GRAVITY, SPRINGS = "gravity, less its torque at the target", "springs"
_NODES = 24  # of the Gauss-Legendre rule along which gravity is summed to a potential


class Body(Protocol):
    """What conditions on a rigid body ask of it."""

    @property
    def inertia(self) -> tuple[float, float, float]:
        """A, B, C, principal moments of inertia, kg m^2."""
        ...


def kinetic_energy(mechanism: Mechanism, q: Vector, v: Vector) -> float:
    """Returns q' A(q) q'/2, J.

    Args:
        mechanism: The mechanism.
        q: Joint angles, shape (n,), rad.
        v: Their rates, shape (n,), rad/s.
    """
    momentum = mechanism.inverse_dynamics(q, np.zeros(len(v)), v) - mechanism.gravity(q)
    return float(np.asarray(v) @ momentum) / 2


def potential_energy(mechanism: Mechanism, q: Vector, start: Vector) -> float:
    """Returns Pi(q) - Pi(start), the work against gravity along a straight line, J.

    Args:
        mechanism: The mechanism.
        q: Joint angles, shape (n,), rad.
        start: Those from which it is counted, shape (n,), rad.
    """
    nodes, weights = np.polynomial.legendre.leggauss(_NODES)
    way = np.asarray(q, dtype=float) - start
    along = [mechanism.gravity(start + (1 + s) / 2 * way) @ way for s in nodes]
    return float(weights @ along) / 2


def position_terms(
    law: Position, mechanism: Mechanism, q: Vector, w: Vector, v: Vector
) -> dict[str, float]:
    """Returns the terms of V of Theorems 2.1 and 2.2 by name, J.

    Args:
        law: The law; one with a constant torque against gravity has the V of Theorem 2.2.
        mechanism: The mechanism.
        q: Joint angles, shape (n,), rad.
        w: Filtered rates, shape (n,), rad.
        v: Rates, shape (n,), rad/s.
    """
    x, w = np.asarray(q) - law.target, np.asarray(w)
    terms = {
        KINETIC: kinetic_energy(mechanism, q, v),
        STIFFNESS: float(x @ np.array(law.K1) @ x) / 2,
        FILTER: float(law.K2 @ w**2) / 2,
    }
    if law.mechanism is None:
        terms[GRAVITY] = potential_energy(mechanism, q, law.target) - float(law.bias @ x)
    return terms


def flexible_terms(
    law: Position, mechanism: FlexibleMechanism, q: Vector, w: Vector, moving: Vector
) -> dict[str, float]:
    """Returns the terms of V of Theorem 4.1 by name, J.

    Args:
        law: The law, on the rotors.
        mechanism: Links, rotors and springs.
        q: Angles of the rotors, shape (n,), rad.
        w: Filtered rates of the rotors, shape (n,), rad.
        moving: Angles of the links, their rates and those of the rotors, shape (3 n,).
    """
    links, v1, v2 = np.split(np.asarray(moving, dtype=float), 3)
    x2, w = np.asarray(q) - law.target, np.asarray(w)
    rotors = float(mechanism.rotors @ v2**2) / 2
    return {
        KINETIC: kinetic_energy(mechanism.links, links, v1) + rotors,
        STIFFNESS: float(x2 @ np.array(law.K1) @ x2) / 2,
        FILTER: float(law.K2 @ w**2) / 2,
        SPRINGS: float(mechanism.stiffnesses @ (links - q) ** 2) / 2,
    }


def body_terms(
    law: BodyVectors | BodyVectorsAndRates, body: Body, y: Vector, w: Vector, om: Vector
) -> dict[str, float]:
    """Returns the terms of V of Theorems 5.1 and 5.2 by name, (5.15) with one half before k_i, J.

    Args:
        law: The law.
        body: The body.
        y: s2 and s3, shape (6,); what follows has no effect.
        w: Filtered rates of s, shape (6,); none with a law that measures om.
        om: Rate in principal axes, shape (3,), rad/s.
    """
    off = (np.asarray(y[:6]) - np.ravel(law.r)) ** 2
    terms = {
        KINETIC: float(body.inertia @ np.asarray(om) ** 2) / 2,
        STIFFNESS: float(np.repeat(law.k, 3) @ off) / 2,
    }
    if isinstance(law, BodyVectors):
        terms[FILTER] = float(np.ravel(law.G) @ np.asarray(w) ** 2) / 2
    return terms


def spin_terms(
    law: Spin, body: Body, c: float, y: Vector, w: Vector, moving: Vector
) -> dict[str, float]:
    """Returns the terms of V of Theorems 5.3 and 5.4 about the member p = c by name, J.

    Args:
        law: The law.
        body: The body.
        c: Spin of the member: p_p under (5.18); under (5.20) any, 0 for the printed V, rad/s.
        y: What the law reads, of no effect.
        w: Nothing.
        moving: s1 and the rate in principal axes, shape (6,), 1 and rad/s.
    """
    s_x, s_y, s_z, p, q, r = moving
    return {
        KINETIC: float(body.inertia @ np.array([p - c, q, r]) ** 2) / 2,
        STIFFNESS: float(law.k * ((s_x - 1) ** 2 + s_y**2 + s_z**2)) / 2,
    }
