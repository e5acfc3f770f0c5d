"""A double integrator under a relay with a minimum on-time, propagated exactly from arc to arc.

Plant x' = v, v' = u + F + eps, in units of the thrust: u is -1, 0 or +1.  A level other than 0 is
kept for the minimum on-time; when it is over the relay decides by the state.  Between two events
the acceleration is constant and (x, v) runs along a parabola; every event - the end of the lock, a
switching curve, v = 0, a step of eps - is a root of a polynomial of degree 2 or 1.
"""

import math
import sys
from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.switching_curves import Piece, Relay

Array = np.ndarray


class Push(NamedTuple):
    """What a disturbance does next: eps until a time or until v reaches a rate."""

    eps: float
    until: float = math.inf
    rate: float = math.nan


# Takes t, v, the level, whether v is rising, and the number of switchings so far.
Disturbance = Callable[[float, float, int, bool, int], Push]


class Signs(NamedTuple):
    """Signs of a feedback disturbance: thrust off or on (u = -1), v > 0 or v < 0."""

    off_up: float
    off_down: float
    on_up: float
    on_down: float


def feedback(bound: float, signs: Signs) -> Disturbance:
    """Returns eps = bound times the sign for the present level and sign of v.

    Args:
        bound: e, the size of the disturbance over the thrust.
        signs: The signs; a level of +1 has those of the thrust off.
    """
    off = Push(bound * signs.off_up), Push(bound * signs.off_down)
    on = Push(bound * signs.on_up), Push(bound * signs.on_down)

    def push(t: float, v: float, level: int, rising: bool, switchings: int) -> Push:
        up, down = on if level < 0 else off
        return down if v < 0 or (v == 0 and not rising) else up

    return push


def flipped(bound: float, signs: Signs, rates: Signs) -> Disturbance:
    """Returns a feedback that changes sign within its arcs: |v| beyond a rate flips it.

    Args:
        bound: e, the size of the disturbance over the thrust.
        signs: The signs at small |v|.
        rates: |v| from which on the sign is the other one, for each of the four cells.
    """

    def push(t: float, v: float, level: int, rising: bool, switchings: int) -> Push:
        down = v < 0 or (v == 0 and not rising)
        cell = (2 if level < 0 else 0) + down
        edge, growing = rates[cell], rising != down
        outer = abs(v) > edge or (abs(v) == edge and growing)
        eps = -bound * signs[cell] if outer else bound * signs[cell]
        return Push(eps, math.inf, -edge if down else edge)

    return push


def alternating(disturbances: Sequence[Disturbance], *, switchings: int) -> Disturbance:
    """Returns several disturbances in turn.

    Args:
        disturbances: The disturbances.
        switchings: After how many switchings the next one takes over.
    """
    many = len(disturbances)

    def push(t: float, v: float, level: int, rising: bool, count: int) -> Push:
        return disturbances[count // switchings % many](t, v, level, rising, count)

    return push


def program(times: Sequence[float], values: Sequence[float]) -> Disturbance:
    """Returns a step function of time.

    Args:
        times: Instants of the steps, ascending.
        values: Values before, between and after them, one more than `times`.

    Raises:
        ValueError: If the numbers do not fit.
    """
    if len(values) != len(times) + 1:
        raise ValueError(f"{len(times)} steps have {len(times) + 1} values, got {len(values)}")
    edges = (*times, math.inf)

    def push(t: float, v: float, level: int, rising: bool, switchings: int) -> Push:
        k = bisect_right(times, t)
        return Push(values[k], edges[k])

    return push


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """What a propagation found.

    Attributes:
        times: Starts of the arcs and the end, shape (m + 1,).
        x: Positions there, shape (m + 1,).
        v: Rates there, shape (m + 1,).
        accelerations: v' on each arc, shape (m,).
        levels: Level on each arc and at the end, shape (m + 1,).
        switch_arcs: Indices of the arcs that begin with a switching, shape (n,).
        peak_arcs: Indices of the arcs that begin at v = 0, shape (k,).
    """

    times: Array
    x: Array
    v: Array
    accelerations: Array
    levels: Array
    switch_arcs: Array
    peak_arcs: Array

    @property
    def peaks(self) -> Array:
        """Positions where v passes zero, shape (k,)."""
        return self.x[self.peak_arcs]

    def at(self, times: Sequence[float] | Array) -> tuple[Array, Array]:
        """Returns x and v, each of shape (n,).

        Args:
            times: Instants within the flight, shape (n,).
        """
        t = np.asarray(times, dtype=float)
        i = np.clip(
            np.searchsorted(self.times, t, side="right") - 1, 0, len(self.accelerations) - 1
        )
        tau, a = t - self.times[i], self.accelerations[i]
        return self.x[i] + tau * (self.v[i] + tau * a / 2), self.v[i] + tau * a

    def pulses(self) -> Array:
        """Returns the lengths of the pulses that both began and ended in the flight."""
        starts = self.times[self.switch_arcs]
        return np.diff(starts)[self.levels[self.switch_arcs[:-1]] != 0]

    def largest(self, *, after: float = 0.0) -> float:
        """Returns the largest |x| where v passes zero.

        Args:
            after: Time from which on peaks count.

        Raises:
            ValueError: If there is no such peak.
        """
        peaks = np.abs(self.peaks[self.times[self.peak_arcs] >= after])
        if not peaks.size:
            raise ValueError(f"no peak after t = {after}; the flight ends at {self.times[-1]}")
        return float(peaks.max())


def propagate(
    relay: Relay,
    *,
    start: tuple[float, float],
    bias: float,
    disturbance: Disturbance,
    level: int = 0,
    elapsed: float = math.inf,
    min_on_time: float = 1.0,
    duration: float = math.inf,
    switchings: int = sys.maxsize,
) -> Flight:
    """Propagates the closed loop from t = 0, for a duration or a number of switchings.

    Args:
        relay: The relay law.
        start: (x, v) at t = 0.
        bias: F, the constant disturbance over the thrust.
        disturbance: eps; |F| - |eps| and 1 - |F| - |eps| must stay positive.
        level: Level at t = 0.
        elapsed: Time for which that level has been on.
        min_on_time: Time for which a level other than 0 is kept at least.
        duration: Length of the flight.
        switchings: Number of switchings after which it ends.

    Raises:
        ValueError: If neither end is given, a number is not finite, or eps turns the bias or the
            thrust over.
    """
    positive(min_on_time=min_on_time)
    if not (math.isfinite(duration) or switchings < sys.maxsize):
        raise ValueError("a flight needs an end: give duration or switchings")
    x, v = map(float, start)
    if not all(map(math.isfinite, (x, v, bias))):
        raise ValueError(f"start and bias must be finite, got {start}, {bias}")
    lines = {n: relay.lines(n) for n in (-1, 0, 1)}
    arcs: list[tuple[float, float, float, float, int]] = []
    switched: list[int] = []
    peaked: list[int] = []
    t, count, n = 0.0, 0, level
    locked_until = min_on_time - elapsed if n else -math.inf
    decided = False
    while t < duration:
        if t >= locked_until and not decided:
            new = relay.command(n, x, v)
            if new != n:
                n, count = new, count + 1
                switched.append(len(arcs))
                locked_until = t + min_on_time if n else -math.inf
                if count >= switchings:
                    break
        decided = False
        rising = n + bias > 0
        eps, until, rate = disturbance(t, v, n, rising, count)
        a = n + bias + eps
        if (a > 0) != rising or a == 0:
            raise ValueError(
                f"eps = {eps} at level {n} turns the sign of v' over, with the bias {bias}: "
                "|eps| must be below |bias| and 1 - |bias|"
            )
        end = min(duration, until)
        if t < locked_until:
            end = min(end, locked_until)
        tau = end - t
        turns = reaches = False
        if v * a < 0 and -v / a <= tau:
            tau, turns = -v / a, True
        if (rate - v) * a > 0 and (rate - v) / a < tau:
            tau, turns, reaches = (rate - v) / a, False, True
        new = n
        if t >= locked_until:
            found = _first_change(relay, lines[n], n, x, v, a, tau)
            if found is not None:
                (tau, new), turns, reaches = found, False, False
        arcs.append((t, x, v, a, n))
        if tau == math.inf:
            raise ValueError(f"nothing happens after t = {t}: x = {x}, v = {v}, level {n}")
        x, v = x + tau * (v + tau * a / 2), v + tau * a
        t = end if tau == end - t else t + tau
        if turns:
            v = 0.0
            peaked.append(len(arcs))
        elif reaches:
            v = rate
        if new != n:
            n, count, decided = new, count + 1, True
            switched.append(len(arcs))
            locked_until = t + min_on_time if n else -math.inf
            if count >= switchings:
                break
    table = np.array([*arcs, (t, x, v, 0.0, n)], dtype=float).T
    return Flight(
        times=table[0],
        x=table[1],
        v=table[2],
        accelerations=table[3, :-1],
        levels=table[4],
        switch_arcs=np.array(switched, dtype=int),
        peak_arcs=np.array(peaked, dtype=int),
    )


def _first_change(
    relay: Relay,
    lines: tuple[tuple[Piece, ...], tuple[float, ...]],
    n: int,
    x: float,
    v: float,
    a: float,
    tau: float,
) -> tuple[float, int] | None:
    """First time up to tau at which the command changes, and the new one.

    Between two neighbouring roots of all boundaries the command is the same: it is asked for in the
    middle, so that no rounding at a boundary decides.
    """
    pieces, rates = lines
    last = v + a * tau
    low, high = (v, last) if a > 0 else (last, v)
    roots = [r for rate in rates if 0 < (r := (rate - v) / a) < tau]
    for v0, v1, x0, w, q in pieces:
        if v1 < low or v0 > high:
            continue
        s = v - w
        # x + v t + a t^2/2 = x0 + q (s + a t)^2
        A, B, C = a * (0.5 - q * a), v - 2 * q * s * a, x - x0 - q * s * s
        D = B * B - 4 * A * C
        if D < 0:
            continue
        h = -(B + math.copysign(math.sqrt(D), B)) / 2
        if A != 0 and 0 < (r := h / A) < tau:
            roots.append(r)
        if h != 0 and 0 < (r := C / h) < tau:
            roots.append(r)
    roots.sort()
    before = 0.0
    for r in [*roots, tau]:
        middle = (before + r) / 2 if r < math.inf else before + 1.0
        new = relay.command(n, x + middle * (v + middle * a / 2), v + middle * a)
        if new != n:
            return before, new
        before = r
    return None
