"""Symmetric limit cycles of a delayed relay with elastic modes, their stability, the delay margin.

On a half period P the input is constant, -p, and the motion is antisymmetric: x(P) = -x(0).  That
fixes x(0) in closed form.  With the delay h = m P + theta, 0 <= theta < P, the command of each turn
was given m half periods and theta earlier, so P is a root of s(P - theta) = 0, where s falls if m
is even and rises if m is odd.

A deviation xi at a zero of s shifts it by tau = -c xi/(c x'), and the turn that it commands by as
much: xi(n+1) = -(e^(A P) xi(n) + (-1)^m 2 p e^(A (P - theta)) b tau(n - m)).  The cycle is stable
if all eigenvalues of this map but the one of a mere shift in time lie inside the unit circle.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.modal_form import real_form
from spacecraft_sim.relay_system import RelaySystem, Row, State, propagate

Array = np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitCycle:
    """A symmetric limit cycle at the lowest level of the relay.

    Attributes:
        period: Full period, s.
        start: State when the input turns to -p.
        multiplier: Largest |eigenvalue| of the map of deviations over half a period.
        delay: h, s.
        system: The system.
    """

    period: float
    start: State
    multiplier: float
    delay: float
    system: RelaySystem

    @property
    def stable(self) -> bool:
        """Whether small deviations die out."""
        return self.multiplier < 1

    @property
    def pending(self) -> list[tuple[float, float]]:
        """Commands under way at the start: (time of effect, s, acceleration, rad/s^2)."""
        P, p = self.period / 2, self.system.levels[0]
        turns = math.floor(self.delay / P)
        return [(k * P, p if k % 2 else -p) for k in range(1, turns + 1)]

    def peak(self, row: Row) -> float:
        """Returns the largest |row . state| over the cycle, found and not sampled.

        Args:
            row: The function of the state.
        """
        p = self.system.levels[0]
        half = propagate(
            self.system,
            start=self.start,
            duration=self.period / 2,
            delay=self.delay,
            acting=-p,
            feedback_from=math.inf,
        )
        return half.peak(row)[0]


def limit_cycles(
    system: RelaySystem,
    *,
    delay: float,
    shortest: float | None = None,
    longest: float | None = None,
) -> list[LimitCycle]:
    """Finds the symmetric limit cycles at the relay's lowest level.

    Args:
        system: Plant and relay; thresholds are ignored.
        delay: h, s.
        shortest: Shortest half period that is looked for, s; by default the delay, or, if that is
            less, half the half period of the fastest mode.
        longest: Longest half period, s; by default well beyond that of the rigid body, with modes
            at most 1000 h.

    Returns:
        The cycles in the order of their periods; there may be several, or none.

    Raises:
        ValueError: If the delay is not positive.
    """
    positive(delay=delay)
    fastest = max((abs(x) for x in system.eigenvalues), default=0.0)
    c = system.switching.angle / system.switching.rate if system.switching.rate else math.inf
    rigid = delay * (2 - c * delay) / (1 - c * delay) if c * delay < 1 else math.inf
    cap = 1000 * delay if fastest or rigid == math.inf else math.inf
    longest = longest or min(4 * rigid, cap)
    shortest = shortest or (min(delay, math.pi / (2 * fastest)) if fastest else delay)
    points = 400 + math.ceil(2 * fastest * (longest - shortest))
    turns = [delay / m for m in range(1, math.floor(delay / shortest) + 1)]  # theta jumps there
    edges = sorted({shortest, longest, *(P for P in turns if shortest < P < longest)})
    found: list[LimitCycle] = []
    for low, high in pairwise(edges):
        share = max(20, math.ceil(points * (high - low) / (longest - shortest)))
        # Just off the jumps, each smooth stretch on its own.
        grid = np.linspace(low * (1 + 1e-12), high * (1 - 1e-12), share)
        values = _s_at_return(system, delay, grid)
        for k in np.flatnonzero(np.diff(np.signbit(values))):
            P = _root(partial(_s_at_return, system, delay), grid[k], grid[k + 1])
            start = _antisymmetric(system, P)
            if _is_cycle(system, start, P, delay):
                multiplier = _multiplier(system, start, P, delay)
                found.append(LimitCycle(
                    period=2 * P, start=start, multiplier=multiplier, delay=delay, system=system
                ))  # fmt: skip
    return found


def delay_margin(system: RelaySystem, *, upper: float) -> float:
    """Returns the delay up to which the relay has a stable symmetric limit cycle, s.

    Longer delays may have one again; the margin is where it is first lost.

    Args:
        system: Plant and relay.
        upper: Longest delay that is tried, s.

    Raises:
        ValueError: If there is no stable cycle at small delays, or one at every delay tried.
    """

    def settles(h: float) -> bool:
        return any(cycle.stable for cycle in limit_cycles(system, delay=h))

    ladder = np.geomspace(upper / 1000, upper, 200)
    lost = next((k for k, h in enumerate(ladder) if not settles(h)), None)
    if lost is None:
        raise ValueError(f"a stable limit cycle exists at every delay up to {upper} s; raise upper")
    if lost == 0:
        raise ValueError(f"no stable limit cycle even at a delay of {ladder[0]:.3g} s")
    low, high = ladder[lost - 1], ladder[lost]
    while high - low > 1e-9 * high:
        low, high = (mid, high) if settles(mid := (low + high) / 2) else (low, mid)
    return float(low)


def _antisymmetric(system: RelaySystem, P: float) -> State:
    """The state from which -p leads to its own negative after P."""
    p = system.levels[0]
    modes = []
    for exponent, b in zip(system.eigenvalues, system.drive, strict=True):
        growth, rest = cmath.exp(exponent * P), b * p / exponent
        modes.append(rest * (growth - 1) / (growth + 1))
    return State(0.0, p * P / 2, tuple(modes))


def _state_at(system: RelaySystem, start: State, tau: float) -> State:
    """The state after a time under -p."""
    p, modes = system.levels[0], []
    for z, exponent, b in zip(start.modes, system.eigenvalues, system.drive, strict=True):
        rest = b * p / exponent
        modes.append(rest + (z - rest) * cmath.exp(exponent * tau))
    return State(start.angle + tau * (start.rate - tau * p / 2), start.rate - p * tau, tuple(modes))


def _turns_under_way(P: float, delay: float) -> tuple[int, float]:
    """M and theta of h = m P + theta."""
    m = math.floor(delay / P)
    return m, delay - m * P


def _s_at_return(system: RelaySystem, delay: float, P: Array | float) -> Array | float:
    """S at the instant P - theta, at which the turn m half periods later was commanded."""
    tau, p, row = P - delay % P, system.levels[0], system.switching
    s = row.angle * tau * (p * P / 2 - tau * p / 2) + row.rate * (p * P / 2 - p * tau)
    for d, exponent, b in zip(row.modes, system.eigenvalues, system.drive, strict=False):
        rest, growth = b * p / exponent, np.exp(exponent * P)
        start = rest * (growth - 1) / (growth + 1)
        s = s + 2 * (d * (rest + (start - rest) * np.exp(exponent * tau))).real
    return s


def _is_cycle(system: RelaySystem, start: State, P: float, delay: float) -> bool:
    """Whether s has the right sign at the start and changes it at P - theta alone."""
    m, theta = _turns_under_way(P, delay)
    run = propagate(
        RelaySystem(
            switching=system.switching,
            levels=system.levels[:1],
            eigenvalues=system.eigenvalues,
            drive=system.drive,
        ),
        start=start,
        duration=P,
        delay=2 * P,
        acting=-system.levels[0],
    )
    if len(run.switch_times) != 2 or (run.commands[0] < 0) != (m % 2 == 0):
        return False
    return abs(run.switch_times[1] - (P - theta)) < 1e-7 * P


def _multiplier(system: RelaySystem, start: State, P: float, delay: float) -> float:
    """Largest |eigenvalue| of the map of deviations from one zero of s to the next."""
    import scipy.linalg  # slow to import, and seldom needed

    (m, theta), row, p = _turns_under_way(P, delay), system.switching, system.levels[0]
    A, b, (c,) = real_form(system, [row])
    x = _state_at(system, start, P - theta)
    parts = [part for z in x.modes for part in (z.real, z.imag)]
    velocity = A @ np.array([x.angle, x.rate, *parts]) - b * p
    velocity *= -1 if m % 2 == 0 else 1  # at a rising zero
    n = len(b)
    step = np.zeros((n + m, n + m))  # (xi, tau of the last m zeros, the latest first)
    late = -((-1) ** m) * 2 * p * scipy.linalg.expm(A * (P - theta)) @ b
    shift = -c / (c @ velocity)
    step[:n, :n] = -scipy.linalg.expm(A * P)
    if m == 0:
        step[:n, :n] += np.outer(late, shift)
    else:
        step[:n, -1] = late
        step[n, :n] = shift
        step[n + 1 :, n:-1] = np.eye(m - 1)
    values = np.linalg.eigvals(step)
    return float(np.max(np.abs(np.delete(values, np.argmin(np.abs(values - 1))))))


def _root(function: Callable[[float], Any], low: float, high: float) -> float:
    from scipy.optimize import brentq

    return brentq(function, low, high, xtol=1e-15)  # pyright: ignore[reportReturnType]
