"""Manoeuvres that leave no vibration: least energy, least peak, least fuel, least time.

Yu. N. Gorelov, "Synthesis of null-finite optimal control for a double integrator with an attached
oscillator by the method of moments" (in Russian).  Plant, moments and units are those of
`moments`; any number of modes is brought to rest, two moments a mode.

The multipliers l of the results, with h_l = sum l_k h_k:
- least energy: u = h_l, so l = G^-1 c with the Gram matrix G, and the energy is sqrt(c G^-1 c); the
  paper calls this rho_0, which by (11) is its inverse.
- least peak and least time: l . c = 1, peak = 1/int |h_l|, u = peak sign h_l.
- least fuel: u = m0 sign h_l where |h_l| >= 1, else zero.  Where the least fuel is |v1 - v0|, l is
  (0, +-1, 0, ...) and fixes nothing: many controls of one sign do; the one returned gathers its
  thrust about the middle, and its `normal` is false.

For a manoeuvre from rest to rest, more time needs less peak.  That is not so with rates at the
ends; `min_time` returns the *first* duration that will do.
"""

import math

import numpy as np

from controllers.extremal import Extremal, least_fuel, least_peak
from controllers.moment_problem import Problem, crossings, problem_of
from controllers.moments import Array, Modes, Numbers, finite, modes_of, switched_moments
from controllers.one_signed import one_signed
from controllers.plans import SmoothPlan, SwitchedPlan, smooth_plan, switched_plan
from spacecraft_sim.checks import positive
from spacecraft_sim.curve import Curve

_EQUAL = 1e-12  # two peaks this close, relative, are the same
_STEPS = 200  # towards the least time; some twenty are many


def min_energy(
    *,
    omega: Numbers,
    damping: Numbers,
    duration: float,
    x1: float,
    x0: float = 0.0,
    v0: float = 0.0,
    v1: float = 0.0,
) -> SmoothPlan:
    """Plans the control of least energy, int u^2 dt.

    Args:
        omega: w of the mode, or one a mode, rad/s.
        damping: b of the mode, the coefficient of y', or one a mode, 1/s.
        duration: T, s.
        x1: x at the end.
        x0: x at the start.
        v0: x' at the start, per s.
        v1: x' at the end, per s.

    Raises:
        ValueError: If a number is out of range, a mode is not underdamped, or the manoeuvre is
            empty.
        ArithmeticError: If the moments cannot be told apart in double precision.
    """
    return smooth_plan(_problem(omega, damping, duration, x0, v0, x1, v1))


def min_peak(
    *,
    omega: Numbers,
    damping: Numbers,
    duration: float,
    x1: float,
    x0: float = 0.0,
    v0: float = 0.0,
    v1: float = 0.0,
) -> SwitchedPlan:
    """Plans the control of least peak, max |u|: a relay.

    Args:
        omega: w of the mode, or one a mode, rad/s.
        damping: b of the mode, the coefficient of y', or one a mode, 1/s.
        duration: T, s.
        x1: x at the end.
        x0: x at the start.
        v0: x' at the start, per s.
        v1: x' at the end, per s.

    Raises:
        ValueError: If a number is out of range, a mode is not underdamped, or the manoeuvre is
            empty.
        ArithmeticError: If the moments cannot be told apart in double precision.
    """
    task = _problem(omega, damping, duration, x0, v0, x1, v1)
    best = least_peak(task)
    return _peak_plan(task, best, task.unit * best.peak)


def min_fuel(
    *,
    omega: Numbers,
    damping: Numbers,
    duration: float,
    bound: float,
    x1: float,
    x0: float = 0.0,
    v0: float = 0.0,
    v1: float = 0.0,
) -> SwitchedPlan:
    """Plans the control of least fuel, int |u| dt, with |u| <= m0: on and off.

    Args:
        omega: w of the mode, or one a mode, rad/s.
        damping: b of the mode, the coefficient of y', or one a mode, 1/s.
        duration: T, s.
        bound: m0, in the unit of u.
        x1: x at the end.
        x0: x at the start.
        v0: x' at the start, per s.
        v1: x' at the end, per s.

    Raises:
        ValueError: If a number is out of range, a mode is not underdamped, the manoeuvre is
            empty, or the bound is below the least peak for this duration.
        ArithmeticError: If the moments cannot be told apart in double precision.
    """
    positive(bound=bound)
    task = _problem(omega, damping, duration, x0, v0, x1, v1)
    least = least_peak(task)
    m0 = bound / task.unit
    if m0 < least.peak * (1 - _EQUAL):
        longer = min_time(omega=omega, damping=damping, bound=bound, x0=x0, v0=v0, x1=x1, v1=v1)
        raise ValueError(
            f"bound = {bound:.9g} is too small for a duration of {duration:.9g} s; the least peak "
            f"there is {task.unit * least.peak:.12g}, and {bound:.9g} first suffices for "
            f"{longer.duration:.12g} s"
        )
    if m0 <= least.peak * (1 + _EQUAL):
        return _peak_plan(task, least, bound)
    if (single := one_signed(task, m0)) is not None:
        edges, pattern = single
        lam = task.constant(math.copysign(1.0, task.moments[1]))
        return switched_plan(task, edges, pattern, lam, level=bound, normal=False)
    best = least_fuel(task, m0, peak=least)
    return switched_plan(task, best.edges, best.pattern, best.multipliers, level=bound)


def min_time(
    *,
    omega: Numbers,
    damping: Numbers,
    bound: float,
    x1: float,
    x0: float = 0.0,
    v0: float = 0.0,
    v1: float = 0.0,
) -> SwitchedPlan:
    """Plans the fastest control with |u| <= m0: a relay.

    Args:
        omega: w of the mode, or one a mode, rad/s.
        damping: b of the mode, the coefficient of y', or one a mode, 1/s.
        bound: m0, in the unit of u.
        x1: x at the end.
        x0: x at the start.
        v0: x' at the start, per s.
        v1: x' at the end, per s.

    Raises:
        ValueError: If a number is out of range, a mode is not underdamped, or the manoeuvre is
            empty.
        ArithmeticError: If the moments cannot be told apart in double precision.
    """
    positive(bound=bound)
    finite(x0=x0, v0=v0, x1=x1, v1=v1)
    modes = modes_of(omega, damping)
    T = rigid_time(bound=bound, x0=x0, v0=v0, x1=x1, v1=v1)
    if T == 0:
        raise ValueError(f"the manoeuvre is empty: it starts where it ends, x = {x0:.9g}")
    slowest_first = sorted(zip(modes.omega, modes.damping, strict=True))
    # With fewer modes at rest it takes less time, so each problem starts where the last one ends.
    for k in range(1, len(slowest_first)):
        some = modes_of(*zip(*slowest_first[:k], strict=True))
        T = _first_time(some, T, bound, x0, v0, x1, v1)[0].duration
    task, best = _first_time(modes, T, bound, x0, v0, x1, v1)
    return _peak_plan(task, best, bound)


def _first_time(
    modes: Modes, T: float, bound: float, x0: float, v0: float, x1: float, v1: float
) -> tuple[Problem, Extremal]:
    """First duration from T on for which the bound suffices; T itself must not be beyond it."""
    near = None
    for _ in range(_STEPS):
        task = problem_of(modes, duration=T, x0=x0, v0=v0, x1=x1, v1=v1)
        lam = task.target
        if task.unit <= bound:  # else the control of least energy shows that T is too short
            near = least_peak(task, near=near)
            if task.unit * near.peak <= bound * (1 + _EQUAL):
                return task, near
            lam = near.multipliers
        following = _next_time(modes, task.multipliers(lam), T, bound, x1 - x0, v0, v1)
        T = max(float(following), math.nextafter(T, math.inf))
    raise ArithmeticError(f"no duration found in {_STEPS} steps; the last was {T} s")


def _problem(
    omega: Numbers, damping: Numbers, T: float, x0: float, v0: float, x1: float, v1: float
) -> Problem:
    return problem_of(modes_of(omega, damping), duration=T, x0=x0, v0=v0, x1=x1, v1=v1)


def _peak_plan(task: Problem, best: Extremal, level: float) -> SwitchedPlan:
    """The plan at a level, to rounding that of the optimum, with l . c = 1."""
    value = task.unit * task.duration * (best.multipliers @ task.target)
    return switched_plan(task, best.edges, best.pattern, best.multipliers / value, level=level)


def rigid_time(*, bound: float, x0: float, v0: float, x1: float, v1: float) -> float:
    """Returns the least time of x'' = u, |u| <= m0 alone, s.

    Args:
        bound: m0.
        x0: x at the start.
        v0: x' at the start, per s.
        x1: x at the end.
        v1: x' at the end, per s.
    """
    times = []
    scale = bound * abs(x1 - x0) + v0**2 + v1**2
    for sign in (1.0, -1.0):  # of the first pulse
        square = sign * bound * (x1 - x0) + (v0**2 + v1**2) / 2  # of the rate where it turns
        if square < -1e-15 * scale:
            continue
        root = math.sqrt(max(square, 0.0))
        for turn in (root, -root):  # the rate may turn short of zero
            pulses = sign * (turn - v0) / bound, sign * (turn - v1) / bound
            # A pulse of no length may come out negative, by the root of the rounding error.
            if min(pulses) * bound >= -1e-7 * math.sqrt(scale):
                times.append(sum(max(x, 0.0) for x in pulses))
    return min(times)


def _next_time(
    modes: Modes, lam: Array, T: float, bound: float, x: float, v0: float, v1: float
) -> float:
    """First duration that l does not exclude: where l . c(T) = m0 int_0^T |h_l| ds again.

    h_l(s) does not depend on T, so one solution excludes a whole interval of durations, and the
    steps never pass a duration that will do; near the first they converge as Newton's.
    """
    h, H = modes.curve(lam), modes.integral_curve(lam)
    edges, e = crossings(h, (0.0,), (-1.0, 1.0), T)
    full = np.concatenate([[0.0], edges, [T]])
    area = float(lam @ switched_moments(modes, edges=full, levels=e))
    sign, s, window = e[-1], T, T / 8
    while True:
        low, high = (0.0, math.inf) if sign > 0 else (-math.inf, 0.0)
        zero = h.first_exit(s, s + window, low, high)
        end = s + window if zero is None else zero
        # area + sign (H(S) - H(s)) - l . c(S)/m0 as a curve in S.
        c0, c1 = lam[0] * x + lam[1] * (v1 - v0), -lam[0] * v0
        gap = Curve(
            area - sign * (H(s)[0] - H.a0) - c0 / bound,
            sign * H.a1 - c1 / bound,
            sign * H.a2,
            [(mu, sign * a) for mu, a in H.waves],
        )
        found = gap.first_exit(s, end, -math.inf, 0.0)
        if found is not None:
            return found
        area += sign * (H(end)[0] - H(s)[0])
        s, window, sign = end, 2 * window, sign if zero is None else -sign
