"""Lyapunov functions, equilibria and conditions of Burkov (1998), corrected.

V and its rate by the laws' formulas: in continuous time V' = -loss exactly; a held torque adds a
little to V now and then.
"""

import itertools
import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from controllers.burkov_energy import (
    Body,
    body_terms,
    flexible_terms,
    position_terms,
    spin_terms,
)
from controllers.burkov_laws import BodyVectors, BodyVectorsAndRates, Position, Spin
from spacecraft_sim.dynamics import jacobian
from spacecraft_sim.guarantee import Assumption
from spacecraft_sim.mechanisms import FlexibleMechanism, Mechanism

Array = np.ndarray
Vector = Sequence[float] | Array


# -- mechanisms --------------------------------------------------------------------------------


def position_energy(law: Position, mechanism: Mechanism, q: Vector, v: Vector, w: Vector) -> float:
    """Returns V of Theorems 2.1 and 2.2, J.

    Args:
        law: The law; one with a constant torque against gravity has the V of Theorem 2.2.
        mechanism: The mechanism.
        q: Joint angles, shape (n,), rad.
        v: Their rates, shape (n,), rad/s.
        w: Filtered rates, shape (n,), rad.
    """
    return sum(position_terms(law, mechanism, q, w, v).values())


def flexible_energy(
    law: Position,
    mechanism: FlexibleMechanism,
    q: tuple[Vector, Vector],
    v: tuple[Vector, Vector],
    w: Vector,
) -> float:
    """Returns V of Theorem 4.1, J.

    Args:
        law: The law, on the rotors.
        mechanism: Links, rotors and springs.
        q: Angles of links and rotors, rad.
        v: Their rates, rad/s.
        w: Filtered rates of the rotors, rad.
    """
    return sum(flexible_terms(law, mechanism, q[1], w, np.concatenate([q[0], *v])).values())


def position_loss(law: Position, cutoffs: Vector, w: Vector) -> float:
    """Returns -V' of Theorems 2.1, 2.2 and 4.1, w K2 K3 w, W.

    Args:
        law: The law.
        cutoffs: K3, 1/s.
        w: Filtered rates, shape (n,), rad.
    """
    return float(np.multiply(law.K2, cutoffs) @ np.asarray(w) ** 2)


def gravity_condition(law: Position, mechanism: Mechanism) -> Assumption:
    """Returns the condition of Theorem 2.2, K1 + g_q(q_p) > 0, by its least eigenvalue.

    Args:
        law: The law.
        mechanism: The mechanism.
    """
    stiffness = np.array(law.K1) + jacobian(mechanism.gravity, np.array(law.target))
    return Assumption(
        text="K1 + g_q(q_p) > 0: least eigenvalue",
        value=float(np.linalg.eigvalsh((stiffness + stiffness.T) / 2)[0]),
        limit=0.0,
        relation=">",
        unit="N m/rad",
    )


class Rest(NamedTuple):
    """An equilibrium of a mechanism under a law with a constant torque against gravity.

    Attributes:
        q: Joint angles, rad.
        energy: V there, J.
        unstable: Count of unstable directions.
    """

    q: tuple[float, ...]
    energy: float
    unstable: int


def rests(law: Position, mechanism: Mechanism, *, starts: int = 200) -> list[Rest]:
    """Finds equilibria K1 (q - q_p) + g(q) = g(q_p) of (2.4), lowest V first.

    Newton's method from points spread over the box that holds them all, |K1 x| <= 2 max |g|; some
    may be missed.  V has as many downward directions there as K1 + g_q has negative eigenvalues,
    and so many unstable ones has the motion.

    Args:
        law: The law.
        mechanism: The mechanism.
        starts: How many points.
    """
    from scipy.optimize import root

    K1, target = np.array(law.K1), np.array(law.target)
    n = len(target)
    spread = _spread(starts, n)
    largest = max(float(np.linalg.norm(mechanism.gravity(2 * math.pi * x))) for x in spread)
    reach = (1.2 * largest + float(np.linalg.norm(law.bias))) / float(np.linalg.eigvalsh(K1)[0])

    def pull(q: Array) -> Array:
        return K1 @ (q - target) + mechanism.gravity(q) - law.bias

    found: list[Rest] = []
    for x in [np.full(n, 0.5), *spread]:
        q = root(pull, target + (2 * x - 1) * reach, tol=1e-12).x
        if np.max(np.abs(pull(q))) > 1e-9 * (1 + largest):
            continue
        if all(np.max(np.abs(q - other.q)) > 1e-6 for other in found):
            stiffness = K1 + jacobian(mechanism.gravity, q)
            unstable = int(np.sum(np.linalg.eigvalsh((stiffness + stiffness.T) / 2) < 0))
            V = position_energy(law, mechanism, q, np.zeros(n), np.zeros(n))
            found.append(Rest(tuple(q.tolist()), V, unstable))
    return sorted(found, key=lambda rest: rest.energy)


def _spread(count: int, n: int) -> Array:
    """Points of the unit cube that fill it evenly: multiples of powers of a golden ratio, mod 1."""
    ratio = 2.0
    for _ in range(60):
        ratio = (1 + ratio) ** (1 / (n + 1))
    return np.outer(np.arange(1, count + 1), ratio ** -np.arange(1.0, n + 1)) % 1


# -- a rigid body ------------------------------------------------------------------------------


def body_energy(
    law: BodyVectors | BodyVectorsAndRates, body: Body, s: Vector, om: Vector, w: Vector
) -> float:
    """Returns V of Theorems 5.1 and 5.2, (5.15) with one half before k_i too, J.

    Args:
        law: The law.
        body: The body.
        s: s2 and s3, shape (6,).
        om: Rate in principal axes, shape (3,), rad/s.
        w: Filtered rates of s, shape (6,); none with a law that measures om.
    """
    return sum(body_terms(law, body, s, w, om).values())


def body_loss(
    law: BodyVectors | BodyVectorsAndRates, cutoffs: Vector, om: Vector, w: Vector
) -> float:
    """Returns -V': (5.6), om G om, or (5.16), sum w_i G_i D_i w_i, W.

    Args:
        law: The law.
        cutoffs: D2 and D3, 1/s; none with a law that measures om.
        om: Rate in principal axes, shape (3,), rad/s.
        w: Filtered rates of s, shape (6,); none with a law that measures om.
    """
    if isinstance(law, BodyVectors):
        return float((np.ravel(law.G) * cutoffs) @ np.asarray(w) ** 2)
    return float(law.G @ np.asarray(om) ** 2)


class Attitude(NamedTuple):
    """An equilibrium s2 = +-r2, s3 = +-r3 of a body.

    Attributes:
        signs: The two signs.
        energy: V there, J.
        unstable: Count of unstable directions.
    """

    signs: tuple[int, int]
    energy: float
    unstable: int


def attitudes(law: BodyVectors | BodyVectorsAndRates) -> list[Attitude]:
    """Returns the four equilibria (5.11)-(5.14), lowest V first.

    V near them is that of springs of k2 + k3 about r1, k3 about r2 and k2 about r3, each k with the
    sign of its vector; every negative one is one unstable direction of the motion.

    Args:
        law: The law, with k2 /= k3: else there are circles of equilibria.
    """
    k2, k3 = law.k
    found = []
    for a, b in itertools.product((1, -1), repeat=2):
        springs = (a * k2 + b * k3, b * k3, a * k2)
        V = 2 * (k2 * (a < 0) + k3 * (b < 0))
        found.append(Attitude((a, b), float(V), sum(spring < 0 for spring in springs)))
    return sorted(found, key=lambda attitude: attitude.energy)


def basin(law: BodyVectors | BodyVectorsAndRates) -> float:
    """Returns the V below which every motion ends at s2 = r2, s3 = r3: 2 min(k2, k3), J.

    Args:
        law: The law.
    """
    return attitudes(law)[1].energy


# -- spin --------------------------------------------------------------------------------------


def spin_energy(law: Spin, body: Body, s: Vector, om: Vector, c: float) -> float:
    """Returns V of Theorems 5.3 and 5.4 about the member p = c, J.

    Args:
        law: The law.
        body: The body.
        s: s1, shape (3,).
        om: Rate in principal axes, shape (3,), rad/s.
        c: Spin of the member: p_p under (5.18); under (5.20) any, 0 for the printed V, rad/s.
    """
    return sum(spin_terms(law, body, c, (), (), [*s, *om]).values())


def spin_loss(law: Spin, body: Body, om: Vector, c: float) -> float:
    """Returns -V' about the member p = c, which may be negative, W.

    Args:
        law: The law; c must be p_p where it has alpha.
        body: The body.
        om: Rate in principal axes, shape (3,), rad/s.
        c: Spin of the member, rad/s.
    """
    p, q, r = om
    _, B, C = body.inertia
    across = law.beta * q**2 + law.gamma * r**2 + c * (B - C) * q * r
    return float(across + (law.alpha or 0.0) * (p - c) ** 2)


def spin_condition(law: Spin, body: Body, c: float) -> Assumption:
    """Returns c^2 (B - C)^2 < 4 beta gamma: (5.19), and what Theorem 5.4 lacks.

    Args:
        law: The law.
        body: The body.
        c: The spin, rad/s.
    """
    _, B, C = body.inertia
    return Assumption(
        text="c^2 (B - C)^2 < 4 beta gamma",
        value=(c * (B - C)) ** 2,
        limit=4 * law.beta * law.gamma,
        unit="(N m s)^2",
    )


def transverse_polynomial(law: Spin, body: Body, c: float, *, side: int = 1) -> Array:
    """Returns the characteristic polynomial of (q, r, s_y, s_z) at s_x = side, p = c.

    Args:
        law: The law.
        body: The body.
        c: The spin, rad/s.
        side: +1 or -1.

    Returns:
        Its five coefficients, highest degree first, which is 1.
    """
    A, B, C = body.inertia
    beta, gamma, k = law.beta, law.gamma, law.k * side
    damped = B * gamma + C * beta
    coefficients = [
        B * C,
        damped,
        beta * gamma + k * (B + C) + c**2 * (A**2 - A * B - A * C + 2 * B * C),
        damped * c**2 + k * (beta + gamma),
        beta * gamma * c**2 + (k + (A - C) * c**2) * (k + (A - B) * c**2),
    ]
    return np.array(coefficients) / (B * C)
