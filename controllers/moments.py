"""The moment problem of a manoeuvre that leaves no vibration: moment functions, exact moments.

Yu. N. Gorelov, "Synthesis of null-finite optimal control for a double integrator with an attached
oscillator by the method of moments" (in Russian), equations (1) to (9).

Plant.  x'' = u, and for each mode y'' + b y' + w^2 y = u, at rest at first.  u is a torque in N m
if x is the angular momentum's integral, kg m^2 rad, or an acceleration in rad/s^2 if x is an angle.
A bus J with two booms, J g'' + 2 p q'' = u, p g'' + a q'' + b_q q' + c q = 0, is of this form with
x = J g + 2 p q, D = J a - 2 p^2, w^2 = J c/D, b = J b_q/D and q = -(p/D) y.

With s = T - t the time to go, u takes the plant to x(T), x'(T) and every y(T) = y'(T) = 0 if its
moments int h_k(s) u dt are the targets c_k, where

    h_1 = s,  h_2 = 1,  h_3 = e^(alpha s) sin(beta s)/beta,  h_4 = h_3'

with alpha = -b/2, beta = sqrt(w^2 - alpha^2), and h_3, h_4 again for each further mode.  The
targets are c_1 = x(T) - x(0) - T x'(0), c_2 = x'(T) - x'(0), and zero for the modes.  The moment
with h_3 is y(T) itself; the paper's c_3 = beta y(T) has a factor too many.
"""

import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.curve import Curve

Array = np.ndarray
Numbers = float | Sequence[float] | np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Modes:
    """Underdamped modes y'' + b y' + w^2 y = u.

    Attributes:
        omega: w of each mode, undamped, rad/s.
        damping: b of each mode, 1/s.
    """

    omega: tuple[float, ...]
    damping: tuple[float, ...]

    def __post_init__(self) -> None:
        if len(self.omega) != len(self.damping) or not self.omega:
            raise ValueError(
                f"omega has {len(self.omega)} values and damping {len(self.damping)}; they need "
                "one each for every mode, and there must be a mode"
            )
        for k, (w, b) in enumerate(zip(self.omega, self.damping, strict=True)):
            positive(omega=w)
            positive(damping=b, zero=True)
            if w <= b / 2:
                raise ValueError(
                    f"mode {k} is not underdamped: omega = {w} rad/s must exceed damping/2 = "
                    f"{b / 2} 1/s; leave it out, or take damping below {2 * w:.9g} 1/s"
                )

    @property
    def alpha(self) -> Array:
        """-b/2 of each mode, 1/s."""
        return np.array(self.damping) / -2

    @property
    def beta(self) -> Array:
        """Damped frequency of each mode, rad/s."""
        w, half = np.array(self.omega), np.array(self.damping) / 2
        return np.sqrt((w - half) * (w + half))

    def scaled(self, unit: float) -> "Modes":
        """Returns the modes in another unit of time.

        Args:
            unit: The unit, s.
        """
        return Modes(
            omega=tuple(w * unit for w in self.omega),
            damping=tuple(b * unit for b in self.damping),
        )

    def functions(self, s: Array | float) -> Array:
        """Returns h_1, h_2, then h_3, h_4 of each mode, (9), shape (2 + 2 modes, *s.shape).

        Args:
            s: Time to go, s.
        """
        s = np.asarray(s, dtype=float)
        h3, h4 = self._pairs(s)
        return _stacked(s, np.ones_like(s), h3, h4)

    def slopes(self, s: Array | float) -> Array:
        """Returns dh/ds of each moment function, like `functions`.

        Args:
            s: Time to go, s.
        """
        s = np.asarray(s, dtype=float)
        h3, h4 = self._pairs(s)
        w, b = _columns(s, self.omega), _columns(s, self.damping)
        return _stacked(np.ones_like(s), np.zeros_like(s), h4, -w * w * h3 - b * h4)

    def integrals(self, s: Array | float) -> Array:
        """Returns the integral of each moment function from 0 to s, like `functions`.

        That of h_3 is the response to a step, (1 - h_4 - b h_3)/w^2; while the mode has turned by
        less than 1 rad it comes from a series, for the difference would cancel.

        Args:
            s: Time to go, s.
        """
        s = np.asarray(s, dtype=float)
        h3, h4 = self._pairs(s)
        w, b = _columns(s, self.omega), _columns(s, self.damping)
        step = (1 - h4 - b * h3) / (w * w)
        early = w * s < 1
        if np.any(early & (w * np.max(s, initial=0.0) < 4)):  # else it is small beside the rest
            step[early] = _step_series(*(np.broadcast_to(x, step.shape)[early] for x in (w, b, s)))
        return _stacked(s * s / 2, s, step, h3)

    def curve(self, multipliers: Array) -> Curve:
        """Returns h_l = sum l_k h_k as a curve over the time to go.

        Args:
            multipliers: l, one for each moment.
        """
        rigid, slope = float(multipliers[1]), float(multipliers[0])
        return Curve(rigid, slope, 0.0, self._waves(multipliers))

    def integral_curve(self, multipliers: Array) -> Curve:
        """Returns the integral of h_l from 0 as a curve over the time to go.

        Args:
            multipliers: l, one for each moment.
        """
        waves = [(mu, a / mu) for mu, a in self._waves(multipliers)]
        start = -sum(2 * a.real for _, a in waves)
        return Curve(start, float(multipliers[1]), float(multipliers[0]) / 2, waves)

    def _waves(self, multipliers: Array) -> list[tuple[complex, complex]]:
        """h_3 = 2 Re e^(mu s)/(2 i beta) and h_4 = h_3'."""
        waves = []
        for k, (alpha, beta) in enumerate(zip(self.alpha, self.beta, strict=True)):
            mu = complex(alpha, beta)
            l3, l4 = float(multipliers[2 * k + 2]), float(multipliers[2 * k + 3])
            waves.append((mu, (l3 + l4 * mu) / (2j * beta)))
        return waves

    def _pairs(self, s: Array) -> tuple[Array, Array]:
        """h_3 and h_4 of the modes, shape (modes, *s.shape)."""
        alpha, beta = _columns(s, self.alpha), _columns(s, self.beta)
        decay = np.exp(alpha * s)
        h3 = decay * np.sin(beta * s) / beta
        return h3, alpha * h3 + decay * np.cos(beta * s)


def modes_of(omega: Numbers, damping: Numbers) -> Modes:
    """Returns the modes of one pair of numbers or of two sequences.

    Args:
        omega: w, one number or one a mode, rad/s.
        damping: b, one number or one a mode, 1/s.

    Raises:
        ValueError: If the lengths differ, a number is out of range, a mode is not underdamped, or
            one is given twice.
    """
    modes = Modes(omega=_numbers(omega), damping=_numbers(damping))
    pairs = list(zip(modes.omega, modes.damping, strict=True))
    if twice := sorted({pair for pair in pairs if pairs.count(pair) > 1}):
        raise ValueError(
            f"mode (omega, damping) = {twice[0]} is given {pairs.count(twice[0])} times; its "
            "moments are the same, give it once"
        )
    return modes


def targets(modes: Modes, *, duration: float, x0: float, v0: float, x1: float, v1: float) -> Array:
    """Returns the moments c that the manoeuvre needs, (8).

    Args:
        modes: The modes.
        duration: T, s.
        x0: x at the start.
        v0: x' at the start, per s.
        x1: x at the end.
        v1: x' at the end, per s.

    Raises:
        ValueError: If the duration is not positive, a number is not finite, or the manoeuvre is
            empty: no control at all would do.
    """
    positive(duration=duration)
    finite(x0=x0, v0=v0, x1=x1, v1=v1)
    c = np.zeros(2 + 2 * len(modes.omega))
    c[:2] = x1 - x0 - duration * v0, v1 - v0
    # Differences of equal numbers, to rounding.
    size = abs(x1) + abs(x0) + duration * (abs(v0) + abs(v1))
    if abs(c[0]) + duration * abs(c[1]) <= 8 * np.finfo(float).eps * size:
        raise ValueError(
            f"the manoeuvre is empty: coasting from x = {x0:.9g}, x' = {v0:.9g} already ends in "
            f"x = {x1:.9g}, x' = {v1:.9g} after {duration:.9g} s; change x1, v1 or the duration"
        )
    return c


def finite(**values: float) -> None:
    """Refuses values that are not finite.

    Args:
        **values: The values by the name the user knows them by.

    Raises:
        ValueError: Naming every value at fault.
    """
    if bad := [f"{name} = {x!r}" for name, x in values.items() if not math.isfinite(x)]:
        raise ValueError(f"must be finite: {', '.join(bad)}")


def gram(modes: Modes, duration: float) -> Array:
    """Returns G = int h h^T dt over the manoeuvre; its first block has the determinant T^4/12.

    Args:
        modes: The modes.
        duration: T, s.
    """
    s, weights = quadrature(modes, duration)
    h = modes.functions(s)
    return (h * weights) @ h.T


def quadrature(modes: Modes, duration: float) -> tuple[Array, Array]:
    """Returns Gauss-Legendre nodes, s, and weights, exact to rounding for products of two h.

    Args:
        modes: The modes, fastest of which sets the number of nodes.
        duration: T, s.
    """
    # A product turns by at most 12 rad a panel: 20 nodes leave some 6^40/40! = 2e-17 of it.
    panels = 1 + math.ceil(max(modes.omega) * duration / 6)
    x, weights = _legendre()
    starts = np.arange(panels)[:, None]
    step = duration / panels
    return (step * (starts + x)).ravel(), np.tile(step * weights, panels)


def switched_moments(modes: Modes, *, edges: Array, levels: Array) -> Array:
    """Returns the moments of a piecewise constant control, in closed form.

    Args:
        modes: The modes.
        edges: Times to go between which the control is constant, ascending, ends included, s.
        levels: The control between them, one fewer.
    """
    return np.diff(modes.integrals(edges)) @ levels


def share(modes: Modes, error: Array, c: Array, duration: float) -> float:
    """Returns the largest error of a moment as a share of the manoeuvre.

    x is measured by U T^2 and x' by U T, each mode y by U min(T, 1/w)^2 and y' by U min(T, 1/w),
    which is what a control U would do; U is such that the largest of the moments wanted is 1.

    Args:
        modes: The modes.
        error: Errors of the moments.
        c: Moments that were asked for.
        duration: T, s.
    """
    times = np.minimum(duration, 1 / np.array(modes.omega))
    scale = _stacked(np.array(duration**2), np.array(duration), times**2, times)
    return float(np.max(np.abs(error) / scale) / np.max(np.abs(c) / scale))


@functools.cache
def _legendre() -> tuple[Array, Array]:
    """Nodes and weights on (0, 1)."""
    x, weights = np.polynomial.legendre.leggauss(20)
    return (1 + x) / 2, weights / 2


def _step_series(w: Array, b: Array, s: Array) -> Array:
    """Response to a step as the series of a_j s^j, for w s < 1 and b < 2 w."""
    a = [np.full_like(s, 0.5), -b / 6]
    for j in range(4, 24):  # |a_j s^j| < 2^j/j!
        a.append(-(b * (j - 1) * a[-1] + w * w * a[-2]) / (j * (j - 1)))
    value = np.zeros_like(s)
    for coefficient in reversed(a):
        value = value * s + coefficient
    return value * s * s


def _numbers(values: Numbers) -> tuple[float, ...]:
    return tuple(np.asarray(values, dtype=float).ravel().tolist())


def _columns(s: Array, values: Sequence[float] | Array) -> Array:
    """One value a mode, broadcast against s."""
    return np.asarray(values, dtype=float).reshape(-1, *(1,) * s.ndim)


def _stacked(first: Array, second: Array, thirds: Array, fourths: Array) -> Array:
    """The rows of x and x', then two rows for each mode in turn."""
    out = np.empty((2 + 2 * len(thirds), *first.shape))
    out[0], out[1], out[2::2], out[3::2] = first, second, thirds, fourths
    return out
