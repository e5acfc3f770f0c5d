"""Symmetric limit cycles of a delayed relay with elastic modes, their stability, the delay margin.

On a half period P the input is constant, -p after s has risen through zero a delay h earlier, and
the motion is antisymmetric: x(P) = -x(0).  That fixes x(0) in closed form, and P is a root of
s(P - h) = 0.  Small deviations from one zero of s to the next are multiplied by
W = (I - x' c/(c x')) e^(A P), x' the velocity at the zero (Tsypkin; Astrom): the cycle is stable if
the eigenvalues of W lie inside the unit circle.
"""

import cmath
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from spacecraft_sim.checks import positive
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
    system: RelaySystem, *, delay: float, longest: float | None = None
) -> list[LimitCycle]:
    """Finds the symmetric limit cycles at the relay's lowest level.

    Args:
        system: Plant and relay; thresholds are ignored.
        delay: h, s.
        longest: Longest half period that is looked for, s; by default well beyond that of the
            rigid body, or 1000 h where that has none.

    Returns:
        The cycles in the order of their periods; there may be several, or none.

    Raises:
        ValueError: If the delay is not positive.
    """
    positive(delay=delay)
    c = system.switching.angle / system.switching.rate if system.switching.rate else math.inf
    rigid = delay * (2 - c * delay) / (1 - c * delay) if c * delay < 1 else math.inf
    longest = longest or min(4 * rigid, 1000 * delay)
    fastest = max((abs(x) for x in system.eigenvalues), default=0.0)
    grid = np.linspace(delay, longest, 400 + math.ceil(2 * fastest * (longest - delay)))
    values = [_s_at_return(system, delay, P) for P in grid]
    found = []
    for k in np.flatnonzero(np.diff(np.sign(values))):
        P = _root(lambda P: _s_at_return(system, delay, P), grid[k], grid[k + 1])
        start = _antisymmetric(system, P)
        if _is_cycle(system, start, P, delay):
            multiplier = _multiplier(system, start, P, delay)
            found.append(LimitCycle(
                period=2 * P, start=start, multiplier=multiplier, delay=delay, system=system
            ))  # fmt: skip
    return found


def delay_margin(system: RelaySystem, *, upper: float) -> float:
    """Returns the delay up to which the relay settles in a stable symmetric limit cycle, s.

    Args:
        system: Plant and relay.
        upper: Delay that is surely too long, s.

    Raises:
        ValueError: If there is no stable cycle at small delays, or still one at `upper`.
    """

    def settles(h: float) -> bool:
        return any(cycle.stable for cycle in limit_cycles(system, delay=h))

    if settles(upper):
        raise ValueError(f"a stable limit cycle exists even at upper = {upper} s; raise it")
    ladder = np.geomspace(upper / 1000, upper, 60)
    held = list(map(settles, ladder))
    if not held[0]:
        raise ValueError(f"no stable limit cycle even at a delay of {ladder[0]:.3g} s")
    k = held.index(False)
    low, high = ladder[k - 1], ladder[k]
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


def _s(row: Row, x: State) -> float:
    modal = sum((d * z).real for d, z in zip(row.modes, x.modes, strict=False))
    return row.angle * x.angle + row.rate * x.rate + 2 * modal


def _s_at_return(system: RelaySystem, delay: float, P: float) -> float:
    """Returns s a delay before the input turns back: zero for a cycle."""
    return _s(system.switching, _state_at(system, _antisymmetric(system, P), P - delay))


def _is_cycle(system: RelaySystem, start: State, P: float, delay: float) -> bool:
    """Whether s, positive since a delay before the start, first falls to zero at P - h."""
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
    if run.commands[0] > 0:  # s already negative at the start
        return False
    first = run.switch_times[1] if len(run.switch_times) > 1 else math.inf
    # Over the delay before the start s must have been positive too: antisymmetry, s(P + t) = -s(t).
    return abs(first - (P - delay)) < 1e-7 * P and len(run.switch_times) == 2


def _multiplier(system: RelaySystem, start: State, P: float, delay: float) -> float:
    """Largest |eigenvalue| of the map of deviations from one zero of s to the next."""
    k, row = len(system.eigenvalues), system.switching
    x = _state_at(system, start, P - delay)
    values = np.array([*system.eigenvalues, *np.conj(system.eigenvalues)])
    modes = np.array([*x.modes, *np.conj(x.modes)])
    drive = np.array([*system.drive, *np.conj(system.drive)])
    p = system.levels[0]
    velocity = np.r_[x.rate, -p, values * modes - drive * p]
    d = np.array(row.modes) if row.modes else np.zeros(k)
    gradient = np.r_[row.angle, row.rate, d, np.conj(d)]
    flow = np.diag(np.r_[1, 1, np.exp(values * P)]).astype(complex)
    flow[0, 1] = P
    projector = np.eye(2 + 2 * k) - np.outer(velocity, gradient) / (gradient @ velocity)
    return float(np.max(np.abs(np.linalg.eigvals(projector @ flow))))


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import brentq

    return brentq(function, low, high, xtol=1e-15)  # pyright: ignore[reportReturnType]
