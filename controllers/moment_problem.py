"""A manoeuvre as a moment problem in its own units, with orthonormal moment functions.

Time is measured in durations and u in the root mean square of the control of least energy, so that
the peaks of good controls are between 1 and a few.

Where a manoeuvre is short beside the period of a mode, h_1 .. h_4 are nearly dependent.  Linear
programs, Newton's method and controls of least energy work in q = R^-T h, with G = R^T R the Gram
matrix, which are orthonormal over [0, 1].  Multipliers of q are l' = R l.
"""

from bisect import bisect_right
from dataclasses import dataclass, replace

import numpy as np

from controllers.moments import (
    Array,
    Modes,
    quadrature,
    share,
    switched_moments,
    targets,
)
from spacecraft_sim.curve import Curve


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Problem:
    """Moments that a control over [0, 1] shall have.

    Attributes:
        duration: T, s.
        unit: Unit of the control, N m or rad/s^2.
        modes: The modes, with T for the unit of time.
        W: R^-T, q = W h.
        moments: Moments wanted with h.
        target: Moments wanted with q; its length is 1.
    """

    duration: float
    unit: float
    modes: Modes
    W: Array
    moments: Array
    target: Array

    def grid(self) -> Array:
        """Returns nodes over [0, 1] for a first linear program."""
        return np.linspace(0, 1, 97 + min(int(max(self.modes.omega)), 400))

    def functions(self, s: Array | float) -> Array:
        """Returns q(s), shape (2 + 2 modes, *s.shape).

        Args:
            s: Time to go.
        """
        return np.tensordot(self.W, self.modes.functions(s), 1)

    def slopes(self, s: Array | float) -> Array:
        """Returns dq/ds, like `functions`.

        Args:
            s: Time to go.
        """
        return np.tensordot(self.W, self.modes.slopes(s), 1)

    def integrals(self, s: Array | float) -> Array:
        """Returns the integral of q from 0 to s, like `functions`.

        Args:
            s: Time to go.
        """
        return np.tensordot(self.W, self.modes.integrals(s), 1)

    def of_switched(self, edges: Array, levels: Array) -> Array:
        """Returns the moments with q of a control that is constant between edges.

        Args:
            edges: Times to go at which the level changes, ascending, in (0, 1).
            levels: The control between them, one more.
        """
        return np.diff(self.integrals(with_ends(edges))) @ levels

    def defect(self, edges: Array, levels: Array, target_size: float = 1.0) -> Array:
        """Returns what such a control has too much of the moments wanted with q.

        Args:
            edges: Times to go at which the level changes, ascending, in (0, 1).
            levels: The control between them, one more.
            target_size: By what the moments wanted are multiplied.
        """
        got = switched_moments(self.modes, edges=with_ends(edges), levels=levels)
        # Digits cancel here, before the large entries of W come in.
        return self.W @ (got - target_size * self.moments)

    def excess(self, s: Array, impulses: Array) -> Array:
        """Returns what impulses have too much of the moments wanted with q.

        Args:
            s: Times to go.
            impulses: Their sizes.
        """
        return self.W @ (self.modes.functions(s) @ impulses - self.moments)

    def curve(self, own: Array) -> Curve:
        """Returns the sum of l'_k q_k as a curve over the time to go.

        Args:
            own: l', the multipliers of q.
        """
        return self.modes.curve(self.W.T @ own)

    def crossings(
        self, own: Array, thresholds: tuple[float, ...], values: tuple[float, ...]
    ) -> tuple[Array, Array]:
        """Returns where the curve of l' crosses thresholds, see `crossings`.

        Args:
            own: l', the multipliers of q.
            thresholds: Ascending.
            values: What is returned for pieces below, between and above them.
        """
        return crossings(self.curve(own), thresholds, values)

    def error(self, edges: Array, levels: Array) -> float:
        """Returns the largest error of a moment as a share of the manoeuvre, see `share`.

        Args:
            edges: Times to go at which the level changes, ascending, in (0, 1).
            levels: The control between them, one more.
        """
        got = switched_moments(self.modes, edges=with_ends(edges), levels=levels)
        return share(self.modes, got - self.moments, self.moments, 1.0)

    def noise(self, peak: float) -> float:
        """Returns that error if the edges of a control are known to some rounding errors.

        Args:
            peak: Size of the levels.
        """
        fastest = max(1.0, *self.modes.omega)
        return 4 * np.finfo(float).eps * peak * fastest / float(np.max(np.abs(self.moments)))

    def shifted(self, *, sign: float, offset: float) -> "Problem":
        """Returns the problem for sign u - offset, in a unit of control that suits it.

        Args:
            sign: 1 or -1.
            offset: In this problem's unit.
        """
        moments = sign * self.moments - offset * self.modes.integrals(1.0)
        size = float(np.linalg.norm(self.W @ moments))
        moments /= size
        return replace(self, unit=self.unit * size, moments=moments, target=self.W @ moments)

    def multipliers(self, own: Array) -> Array:
        """Returns l for h_1, h_2, h_3, h_4 in s, 1, s, 1: h_l is the sum of l'_k q_k.

        Args:
            own: l', the multipliers of q.
        """
        times = np.ones_like(own)
        times[0], times[2::2] = self.duration, self.duration
        return (self.W.T @ own) / times

    def constant(self, value: float) -> Array:
        """Returns the multipliers of q for which h_l is constant.

        Args:
            value: The constant.
        """
        return np.linalg.solve(self.W.T, value * np.eye(len(self.target))[1])


def problem_of(
    modes: Modes, *, duration: float, x0: float, v0: float, x1: float, v1: float
) -> Problem:
    """Brings a manoeuvre to its own units.

    Args:
        modes: The modes.
        duration: T, s.
        x0: x at the start.
        v0: x' at the start, per s.
        x1: x at the end.
        v1: x' at the end, per s.

    Raises:
        ValueError: If a number is out of range or the manoeuvre is empty.
    """
    c = targets(modes, duration=duration, x0=x0, v0=v0, x1=x1, v1=v1) / duration
    c[0] /= duration
    own = modes.scaled(duration)
    s, weights = quadrature(own, 1.0)
    # From the functions and not from their Gram matrix, whose root loses half of the digits.
    R = np.linalg.qr((own.functions(s) * np.sqrt(weights)).T, mode="r")
    W = np.linalg.inv(R).T
    unit = float(np.linalg.norm(W @ c))
    c /= unit
    return Problem(duration=duration, unit=unit, modes=own, W=W, moments=c, target=W @ c)


def crossings(
    curve: Curve, thresholds: tuple[float, ...], values: tuple[float, ...], end: float = 1.0
) -> tuple[Array, Array]:
    """Returns where a curve crosses thresholds, none missed, and a value for each piece between.

    Args:
        curve: h_l over the time to go.
        thresholds: Ascending.
        values: What is returned for pieces below, between and above them.
        end: End of the interval, which starts at 0.

    Raises:
        ArithmeticError: If there are so many that they must be rounding errors about a threshold.
    """
    most = 100 + 4 * sum(abs(mu) for mu, _ in curve.waves) * end
    limits = (-np.inf, *thresholds, np.inf)
    s, cell = 0.0, bisect_right(thresholds, curve(0.0)[0])
    edges, pieces = [], [values[cell]]
    while (s := curve.first_exit(s, end, limits[cell], limits[cell + 1])) is not None:
        x = curve(s)[0]
        cell += 1 if limits[cell + 1] - x < x - limits[cell] else -1
        edges.append(s)
        pieces.append(values[cell])
        if len(edges) > most:
            raise ArithmeticError(
                f"h_l crosses {thresholds} more than {most:.0f} times, which its terms cannot but "
                "their rounding errors can: omega T is too small, or two modes are too much alike, "
                "for the moments to differ in double precision"
            )
    return np.array(edges), np.array(pieces)


def with_ends(edges: Array) -> Array:
    """Returns 0, the edges, 1.

    Args:
        edges: Times to go in (0, 1).
    """
    return np.concatenate([[0.0], edges, [1.0]])
