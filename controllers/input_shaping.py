"""Input shapers, the usual way to move a flexible body: a bang-bang command, convolved.

A shaper is a row of impulses whose sum is 1; the command convolved with it leaves a mode as still
as the impulses alone would.  With K = e^(-zeta pi/sqrt(1 - zeta^2)) and the damped period T_d:

- ZV: 1, K, half a period apart; leaves nothing (Singer & Seering 1990; Smith's posicast 1957).
- ZVD: 1, 2K, K^2; the derivative by the frequency vanishes too (Singer & Seering 1990).
- EI: three impulses over T_d; at the frequency it is made for it leaves the tolerated share V of
  what one impulse would, and nothing at a frequency on either side (Singhose, Derezinski & Singer
  1996).  Without damping (1 + V)/4, (1 - V)/2, (1 + V)/4, half a period apart; with damping these
  five conditions fix two amplitudes, the middle impulse and the two frequencies.

N. C. Singer & W. P. Seering, "Preshaping command inputs to reduce system vibration", J. Dyn. Syst.
Meas. Control 112 (1990) 76-82.  W. Singhose, S. Derezinski & N. Singer, "Extra-insensitive input
shapers for controlling flexible spacecraft", J. Guid. Control Dyn. 19 (1996) 385-391.

The manoeuvres are from rest to rest.  Several modes are shaped one after the other: the shapers are
convolved.  Units are those of `moments`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import reduce

import numpy as np

from controllers.moments import Array, Modes, Numbers, finite, modes_of, share, targets
from controllers.plans import SwitchedPlan, read_only
from spacecraft_sim.checks import positive


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shaper:
    """Impulses that a command is convolved with.

    Attributes:
        times: Ascending from 0, s.
        amplitudes: Their sum is 1.
    """

    times: Array
    amplitudes: Array

    @property
    def length(self) -> float:
        """By how much a command grows longer, s."""
        return float(self.times[-1])

    def convolved(self, other: "Shaper") -> "Shaper":
        """Returns the shaper that stands for both.

        Args:
            other: Another shaper.
        """
        times = np.add.outer(self.times, other.times).ravel()
        amplitudes = np.multiply.outer(self.amplitudes, other.amplitudes).ravel()
        order = np.argsort(times, kind="stable")
        return Shaper(times=read_only(times[order]), amplitudes=read_only(amplitudes[order]))


NONE = Shaper(times=read_only(np.zeros(1)), amplitudes=read_only(np.ones(1)))


def zv_shaper(*, omega: float, damping: float) -> Shaper:
    """Returns the ZV shaper of a mode.

    Args:
        omega: w, rad/s.
        damping: b, 1/s.

    Raises:
        ValueError: If the mode is not underdamped.
    """
    K, half = _decay(omega, damping)
    return Shaper(
        times=read_only(np.array([0.0, half])), amplitudes=read_only(np.array([1, K]) / (1 + K))
    )


def zvd_shaper(*, omega: float, damping: float) -> Shaper:
    """Returns the ZVD shaper of a mode.

    Args:
        omega: w, rad/s.
        damping: b, 1/s.

    Raises:
        ValueError: If the mode is not underdamped.
    """
    K, half = _decay(omega, damping)
    amplitudes = np.array([1, 2 * K, K * K]) / (1 + K) ** 2
    return Shaper(times=read_only(half * np.arange(3)), amplitudes=read_only(amplitudes))


def ei_shaper(*, omega: float, damping: float, tolerance: float = 0.05) -> Shaper:
    """Returns the EI shaper of a mode.

    Args:
        omega: w, rad/s.
        damping: b, 1/s.
        tolerance: V, the share of an impulse's vibration that may stay, below 1.

    Raises:
        ValueError: If the mode is not underdamped, the tolerance is out of range, or there is no
            such shaper: with a tolerance of 0.05 it exists for damping ratios up to 0.6.
    """
    positive(tolerance=tolerance)
    if tolerance >= 1:
        raise ValueError(f"tolerance = {tolerance} leaves all the vibration; take less than 1")
    _, half = _decay(omega, damping)
    V, zeta = tolerance, damping / (2 * omega)
    first, last, middle = (1 + V) / 4, (1 + V) / 4, 0.5
    if zeta > 0:
        first, last, middle = _damped_ei(V, zeta)
    return Shaper(
        times=read_only(2 * half * np.array([0.0, middle, 1.0])),
        amplitudes=read_only(np.array([first, 1 - first - last, last])),
    )


def bang_bang(
    *,
    omega: Numbers,
    damping: Numbers,
    x1: float,
    x0: float = 0.0,
    duration: float | None = None,
    bound: float | None = None,
) -> SwitchedPlan:
    """Plans a rigid body's fastest manoeuvre, full thrust forward and back, blind to the modes.

    Args:
        omega: w of the mode, or one a mode, rad/s; for the residual alone.
        damping: b of the mode, or one a mode, 1/s.
        x1: x at the end.
        x0: x at the start.
        duration: T, s; give this or the bound.
        bound: m0, the level, in the unit of u.

    Raises:
        ValueError: If a number is out of range, not one of duration and bound is given, or the
            manoeuvre is empty.
    """
    modes = modes_of(omega, damping)
    return _shaped([], modes, x0=x0, x1=x1, duration=duration, bound=bound)


def zv(
    *,
    omega: Numbers,
    damping: Numbers,
    x1: float,
    x0: float = 0.0,
    duration: float | None = None,
    bound: float | None = None,
) -> SwitchedPlan:
    """Plans a bang-bang command through the ZV shapers of the modes.

    Args:
        omega: w of the mode, or one a mode, rad/s.
        damping: b of the mode, or one a mode, 1/s.
        x1: x at the end.
        x0: x at the start.
        duration: T of the shaped command, s; give this or the bound.
        bound: Level of the command before it is shaped, which the shaped one does not exceed.

    Raises:
        ValueError: If a number is out of range, not one of duration and bound is given, the
            manoeuvre is empty, or the duration is shorter than the shapers.
    """
    modes = modes_of(omega, damping)
    return _shaped(_each(zv_shaper, modes), modes, x0=x0, x1=x1, duration=duration, bound=bound)


def zvd(
    *,
    omega: Numbers,
    damping: Numbers,
    x1: float,
    x0: float = 0.0,
    duration: float | None = None,
    bound: float | None = None,
) -> SwitchedPlan:
    """Plans a bang-bang command through the ZVD shapers of the modes.

    Args:
        omega: w of the mode, or one a mode, rad/s.
        damping: b of the mode, or one a mode, 1/s.
        x1: x at the end.
        x0: x at the start.
        duration: T of the shaped command, s; give this or the bound.
        bound: Level of the command before it is shaped, which the shaped one does not exceed.

    Raises:
        ValueError: If a number is out of range, not one of duration and bound is given, the
            manoeuvre is empty, or the duration is shorter than the shapers.
    """
    modes = modes_of(omega, damping)
    return _shaped(_each(zvd_shaper, modes), modes, x0=x0, x1=x1, duration=duration, bound=bound)


def ei(
    *,
    omega: Numbers,
    damping: Numbers,
    x1: float,
    x0: float = 0.0,
    duration: float | None = None,
    bound: float | None = None,
    tolerance: float = 0.05,
) -> SwitchedPlan:
    """Plans a bang-bang command through the EI shapers of the modes.

    Args:
        omega: w of the mode, or one a mode, rad/s.
        damping: b of the mode, or one a mode, 1/s.
        x1: x at the end.
        x0: x at the start.
        duration: T of the shaped command, s; give this or the bound.
        bound: Level of the command before it is shaped, which the shaped one does not exceed.
        tolerance: V, the share of the vibration that may stay.

    Raises:
        ValueError: If a number is out of range, not one of duration and bound is given, the
            manoeuvre is empty, the duration is shorter than the shapers, or a mode has none.
    """
    modes = modes_of(omega, damping)

    def tolerant(*, omega: float, damping: float) -> Shaper:
        return ei_shaper(omega=omega, damping=damping, tolerance=tolerance)

    return _shaped(_each(tolerant, modes), modes, x0=x0, x1=x1, duration=duration, bound=bound)


def _each(shaper: Callable[..., Shaper], modes: Modes) -> list[Shaper]:
    return [shaper(omega=w, damping=b) for w, b in zip(modes.omega, modes.damping, strict=True)]


def _shaped(
    shapers: list[Shaper],
    modes: Modes,
    *,
    x0: float,
    x1: float,
    duration: float | None,
    bound: float | None,
) -> SwitchedPlan:
    """The plan of a bang-bang command through shapers; residuals speak of these modes."""
    finite(x0=x0, x1=x1)
    shaper = reduce(Shaper.convolved, shapers, NONE)
    length, way = shaper.length, x1 - x0
    if duration is None and bound is not None:
        positive(bound=bound)
        duration = 2 * math.sqrt(abs(way) / bound) + length
    elif duration is None or bound is not None:
        raise ValueError(f"give duration or bound, one of them: got {duration!r} and {bound!r}")
    if way == 0:
        raise ValueError(f"the manoeuvre is empty: it goes from x = {x0:.9g} to x = {x1:.9g}")
    c = targets(modes, duration=duration, x0=x0, v0=0.0, x1=x1, v1=0.0)
    if duration <= length:
        raise ValueError(
            f"duration = {duration:.9g} s is too short: the shapers alone take {length:.9g} s; "
            "take more"
        )
    level = 4 * way / (duration - length) ** 2
    half = (duration - length) / 2
    times = np.add.outer(shaper.times, [0.0, half, 2 * half]).ravel()
    jumps = np.multiply.outer(shaper.amplitudes, [level, -2 * level, level]).ravel()
    plan = _steps(times, jumps, duration)
    error = share(modes, plan.moments(modes) - c, c, duration)
    return SwitchedPlan(
        duration=duration, switch_times=plan.switch_times, levels=plan.levels, residual=error
    )


def _steps(times: Array, jumps: Array, duration: float) -> SwitchedPlan:
    """A control from its jumps, those at one instant as one."""
    order = np.argsort(times, kind="stable")
    times, jumps = times[order], jumps[order]
    first = np.diff(times, prepend=-1.0) > 1e-12 * duration
    sums = np.bincount(np.cumsum(first) - 1, jumps)
    real = np.abs(sums) > 1e-12 * np.max(np.abs(sums))
    times, levels = times[first][real], np.cumsum(sums[real])
    levels[np.abs(levels) < 1e-12 * np.max(np.abs(levels))] = 0.0
    return SwitchedPlan(
        duration=duration,
        switch_times=read_only(times[1:-1]),
        levels=read_only(levels[:-1]),
        residual=math.nan,
    )


def _decay(omega: float, damping: float) -> tuple[float, float]:
    """K and half the damped period, s."""
    modes = modes_of(omega, damping)
    half = math.pi / float(modes.beta[0])
    return math.exp(float(modes.alpha[0]) * half), half


def _damped_ei(V: float, zeta: float) -> tuple[float, float, float]:
    """First and last amplitude, and the time of the middle impulse in damped periods."""
    from scipy.optimize import root

    spread = math.acos((1 - V) / (1 + V)) / math.pi
    x = np.array([(1 + V) / 4, (1 + V) / 4, 0.5, 1 - spread, 1 + spread])  # without damping
    for ratio in np.linspace(0, zeta, 2 + int(zeta / 0.02))[1:]:
        found = root(_ei_conditions, x, args=(V, float(ratio)), tol=1e-13)
        first, last, middle, below, above = x = found.x
        sound = min(first, last, 1 - first - last) > 0 and 0 < middle < 1 and below < 1 < above
        if not (sound and np.max(np.abs(found.fun)) < 1e-10):
            raise ValueError(
                f"no EI shaper found for a damping ratio of {zeta:.4g} with tolerance = {V}; it is "
                f"lost at a ratio of {ratio:.4g}: take ZVD, or a smaller tolerance"
            )
    return float(x[0]), float(x[1]), float(x[2])


def _ei_conditions(x: Array, V: float, zeta: float) -> Array:
    """Zero for an EI shaper; x are its amplitudes, middle and the two frequencies."""
    first, last, middle, below, above = x
    mu = complex(zeta, math.sqrt(1 - zeta**2))  # e^(mu w t) takes an impulse back to t = 0
    t = 2 * math.pi / mu.imag * np.array([0.0, middle, 1.0])
    amplitudes = np.array([first, 1 - first - last, last])
    low, high, made_for = (
        amplitudes @ np.exp(w * (mu * t - zeta * t[-1])) for w in (below, above, 1.0)
    )
    return np.array([low.real, low.imag, high.real, high.imag, abs(made_for) - V])
