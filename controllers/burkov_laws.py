"""The formulas of Burkov (1998), corrected; `burkov.py` says what they are for.

Each turns readings and filtered rates w into torques, in continuous time.  None of sections 2 to 4
and not (5.8) reads a velocity.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from controllers.gains import Matrix, Numbers
from controllers.programmes import Programme
from spacecraft_sim.mechanisms import Mechanism


@dataclass(frozen=True, slots=True, kw_only=True)
class Position:
    """Holds a position: M = -K1 (q - q_p) - K2 w + g, w' = -K3 w + q'.

    (2.1) with g = g(q) and (2.4) with g = g(q_p); printed is q' - q_p' for w.  With rotors for
    joints and without gravity it is (4.2), whose K0 is K1 here.

    Attributes:
        target: q_p, rad.
        K1: Stiffness, N m/rad.
        K2: Damping over cutoff: K2 w is K2 K3^-1 q' for slow motions, N m/rad.
        mechanism: Gives g(q); None where the torque against gravity is constant.
        bias: That constant torque, N m.
    """

    target: Numbers
    K1: Matrix
    K2: Numbers
    mechanism: Mechanism | None
    bias: Numbers

    def filtered(self, t: float, y: Sequence[float]) -> Sequence[float]:
        """Returns q.

        Args:
            t: Time, s.
            y: q, rad.
        """
        return y

    def command(self, t: float, y: Sequence[float], w: Sequence[float]) -> list[float]:
        """Returns M, N m.

        Args:
            t: Time, s.
            y: q, rad.
            w: Filtered q', rad.
        """
        x = [q - p for q, p in zip(y, self.target, strict=True)]
        g = self.bias if self.mechanism is None else self.mechanism.gravity(y).tolist()
        rows = zip(self.K1, self.K2, w, g, strict=True)
        return [
            gi - sum(k * xj for k, xj in zip(row, x, strict=True)) - k2 * wi
            for row, k2, wi, gi in rows
        ]


@dataclass(frozen=True, slots=True, kw_only=True)
class Path:
    """Follows a programme: M = M_p - gamma (K0 x + kappa K1 w), w' = -nu K3 w + nu K4 x'.

    x = q - q_p.  (3.1) with M_p the torque of the programme, (3.7) with none and kappa = 1.

    Attributes:
        programme: q_p(t).
        stiffness: gamma K0, N m/rad.
        damping: gamma kappa K1, N m/rad.
        scale: nu K4, of what is filtered.
        mechanism: Gives M_p; None for (3.7).
    """

    programme: Programme
    stiffness: Numbers
    damping: Numbers
    scale: Numbers
    mechanism: Mechanism | None

    def filtered(self, t: float, y: Sequence[float]) -> list[float]:
        """Returns nu K4 x.

        Args:
            t: Time, s.
            y: q, rad.
        """
        return [s * (q - p) for s, q, p in zip(self.scale, y, self.programme(t).q, strict=True)]

    def command(self, t: float, y: Sequence[float], w: Sequence[float]) -> list[float]:
        """Returns M, N m.

        Args:
            t: Time, s.
            y: q, rad.
            w: Filtered rate of nu K4 x.
        """
        motion = self.programme(t)
        M = [0.0] * len(y)
        if self.mechanism is not None:
            M = self.mechanism.inverse_dynamics(*motion).tolist()  # (1.3)
        rows = zip(M, self.stiffness, y, motion.q, self.damping, w, strict=True)
        return [m - k * (q - p) - d * wi for m, k, q, p, d, wi in rows]


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyVectors:
    """Turns a body until s2 = r2 and s3 = r3, by the vectors alone: (5.8) with (5.9).

    M = sum (s_i x G_i w_i + k_i r_i x s_i), w_i' = -D_i w_i + s_i'.

    Attributes:
        r: r2 and r3, in principal axes.
        k: k2 and k3, N m.
        G: Diagonals of G2 and G3, N m.
    """

    r: tuple[Numbers, Numbers]
    k: tuple[float, float]
    G: tuple[Numbers, Numbers]

    @property
    def stiffness(self) -> float:
        """Least stiffness at the goal: k2 + k3, k3, k2 about r1, r2, r3, N m/rad."""
        return min(self.k)

    def angle(self, y: Sequence[float]) -> float:
        """Returns the angle that the body is turned from the goal, rad.

        Args:
            y: s2 and s3, in principal axes, before whatever else is read.
        """
        return _angle(self.r, y)

    def filtered(self, t: float, y: Sequence[float]) -> Sequence[float]:
        """Returns s2 and s3.

        Args:
            t: Time, s.
            y: s2 and s3, in principal axes.
        """
        return y

    def command(self, t: float, y: Sequence[float], w: Sequence[float]) -> list[float]:
        """Returns M in principal axes, N m.

        Args:
            t: Time, s.
            y: s2 and s3, in principal axes.
            w: Filtered s2' and s3'.
        """
        M = _attraction(self.r, self.k, y)
        for i, G in enumerate(self.G):
            Gw = [g * x for g, x in zip(G, w[3 * i : 3 * i + 3], strict=True)]
            M = _sum(M, _cross(y[3 * i : 3 * i + 3], Gw))
        return M


@dataclass(frozen=True, slots=True, kw_only=True)
class BodyVectorsAndRates:
    """Turns a body until s2 = r2 and s3 = r3: M = -G om + k2 r2 x s2 + k3 r3 x s3, (5.4).

    Attributes:
        r: r2 and r3, in principal axes.
        k: k2 and k3, N m.
        G: Diagonal of G, N m s.
    """

    r: tuple[Numbers, Numbers]
    k: tuple[float, float]
    G: Numbers

    @property
    def stiffness(self) -> float:
        """Least stiffness at the goal: k2 + k3, k3, k2 about r1, r2, r3, N m/rad."""
        return min(self.k)

    def angle(self, y: Sequence[float]) -> float:
        """Returns the angle that the body is turned from the goal, rad.

        Args:
            y: s2 and s3, in principal axes, before whatever else is read.
        """
        return _angle(self.r, y)

    def filtered(self, t: float, y: Sequence[float]) -> tuple[float, ...]:
        """Returns nothing: the rates are measured.

        Args:
            t: Time, s.
            y: Readings.
        """
        return ()

    def command(self, t: float, y: Sequence[float], w: Sequence[float]) -> list[float]:
        """Returns M in principal axes, N m.

        Args:
            t: Time, s.
            y: s2, s3 and om, in principal axes, 1 and rad/s.
            w: Nothing.
        """
        M = _attraction(self.r, self.k, y)
        return [m - g * om for m, g, om in zip(M, self.G, y[6:], strict=True)]


@dataclass(frozen=True, slots=True, kw_only=True)
class Spin:
    """Turns the first principal axis along s1 and, with alpha, spins about it at p_p.

    M_x = -alpha (p - p_p), M_y = -beta q - k s_z, M_z = -gamma r + k s_y: (5.18), with M_x; (5.20),
    without.

    Attributes:
        alpha: Damping of the spin, N m s; None for two torques.
        beta: Damping about y, N m s.
        gamma: Damping about z, N m s.
        k: Stiffness, N m.
        spin: p_p, rad/s.
    """

    alpha: float | None
    beta: float
    gamma: float
    k: float
    spin: float

    def filtered(self, t: float, y: Sequence[float]) -> tuple[float, ...]:
        """Returns nothing: the rates are measured.

        Args:
            t: Time, s.
            y: Readings.
        """
        return ()

    def command(self, t: float, y: Sequence[float], w: Sequence[float]) -> list[float]:
        """Returns the torques about the principal axes, M_x only with alpha, N m.

        Args:
            t: Time, s.
            y: s_y, s_z of s1, q, r, and with alpha p; 1 and rad/s.
            w: Nothing.
        """
        s_y, s_z, q, r, *p = y
        across = [-self.beta * q - self.k * s_z, -self.gamma * r + self.k * s_y]
        return across if self.alpha is None else [-self.alpha * (p[0] - self.spin), *across]


def _attraction(
    r: tuple[Numbers, Numbers], k: tuple[float, float], s: Sequence[float]
) -> list[float]:
    """k2 r2 x s2 + k3 r3 x s3."""
    first, second = _cross(r[0], s[:3]), _cross(r[1], s[3:6])
    return [k[0] * a + k[1] * b for a, b in zip(first, second, strict=True)]


def _angle(r: tuple[Numbers, Numbers], s: Sequence[float]) -> float:
    """Angle of the rotation that takes s2, s3 to r2, r3, from its sine and cosine."""
    goal = (_cross(r[0], r[1]), *r)
    seen = (_cross(s[:3], s[3:6]), s[:3], s[3:6])
    sine, cosine = [0.0] * 3, -1.0
    for a, b in zip(goal, seen, strict=True):
        sine = _sum(sine, _cross(b, a))
        cosine += sum(x * y for x, y in zip(a, b, strict=True))
    return math.atan2(math.hypot(*sine), cosine)


def _cross(a: Sequence[float], b: Sequence[float]) -> list[float]:
    (ax, ay, az), (bx, by, bz) = a, b
    return [ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx]


def _sum(a: Sequence[float], b: Sequence[float]) -> list[float]:
    return [x + y for x, y in zip(a, b, strict=True)]
