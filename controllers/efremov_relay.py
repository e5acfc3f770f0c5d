"""The relay law of Efremov, Polyakov & Strygin (2006): attracting pulses, then a staircase of s.

Used by both theorems; `efremov.py` says what is guaranteed for which parameters.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from spacecraft_sim.chart import Charts, Line, Portrait
from spacecraft_sim.checks import positive

ANGLE, RATE = "quasi_rigid_angle_z", "quasi_rigid_rate_z"
FAR = 2 * math.pi  # how far the switching lines are drawn, rad


class Attraction(NamedTuple):
    """The two pulses of section 2: `sign` U until T1, -`sign` U until T2, both from now, s."""

    sign: float
    T1: float
    T2: float


class LimitCycle(NamedTuple):
    """The symmetric limit cycle of beta'' = -p sign s(t - h): s, rad/s and rad."""

    period: float
    v_max: float
    beta_max: float


def attracting(beta: float, v: float, acceleration: float) -> Attraction:
    """Returns the time-optimal pair of pulses that brings beta'' = +-U to the origin.

    Args:
        beta: Quasi-rigid angle, rad.
        v: Its rate, rad/s.
        acceleration: U, rad/s^2.

    Returns:
        Sign of the first pulse and the ends of both, s.

    Raises:
        ValueError: If U is not positive.
    """
    positive(acceleration=acceleration)
    b, w = beta / acceleration, v / acceleration
    # (2.2) with erratum 1: on G+ the first pulse is -1.  Erratum 2: Gamma+ belongs to G+.
    plus = (w * w + 2 * b >= 0 and w >= 0) or (w * w - 2 * b < 0 and b > 0)
    side = 1.0 if plus else -1.0
    root = math.sqrt(max(w * w + 2 * side * b, 0.0) / 2)  # sqrt(G/2)
    return Attraction(-side, side * w + root, side * w + 2 * root)


def limit_cycle(*, c: float, delay: float, level: float) -> LimitCycle:
    """Returns the limit cycle of the undisturbed relay with a constant delay, in closed form.

    Args:
        c: Slope of the switching line s = c beta + v, 1/s.
        delay: h, s.
        level: p, rad/s^2.

    Raises:
        ValueError: If an argument is not positive, or c h >= 1: there is no such cycle.
    """
    positive(c=c, delay=delay, level=level)
    x = c * delay
    if x >= 1:
        raise ValueError(f"c h = {x} must be below 1 for a limit cycle")
    v = level * delay * (1 - x / 2) / (1 - x)
    return LimitCycle(2 * delay * (2 - x) / (1 - x), v, v * v / (2 * level))


class Memory(NamedTuple):
    """What the law remembers.

    Attributes:
        sign: Sign of the first pulse.
        ends: Ends of both pulses, s.
        until: End of the pulse that is on, s; inf under feedback.
        low: Lower end of the cell that s is in under feedback, rad/s.
        high: Upper end of the cell, rad/s.
    """

    sign: float
    ends: tuple[float, float]
    until: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MultilevelRelay:
    """Attraction by two pulses, then u = -A(|s|) sign s with s = c beta + v.

    Attributes:
        c: Slope of the switching line, 1/s.
        thresholds: v_1 .. v_N, rad/s; none for the relay of Theorem 1.
        levels: Thrust of each band of |s|, N + 1 of them, N or N m.
        attraction: Acceleration U of the pulses, rad/s^2; 0 for no attraction.
        attraction_level: The thrust that gives it, N or N m.
        compensated_delay: Delay for which the pulses are planned ahead, s.
        lowest: p, the acceleration of the lowest level, rad/s^2.
        period: Sampling period, s; None for continuous time.
        accuracy: eps, rad; None if none is promised.
        contour: Corners of the region of (beta, v) in which the theorem ends, rad and rad/s.
        sensors: beta/J and v/J.
        thrusters: The one channel.
    """

    c: float
    thresholds: tuple[float, ...]
    levels: tuple[float, ...]
    attraction: float
    attraction_level: float
    compensated_delay: float
    lowest: float
    period: float | None
    accuracy: float | None = None
    contour: tuple[tuple[float, float], ...] = ()
    sensors: tuple[str, ...] = (ANGLE, RATE)
    thrusters: tuple[str, ...] = ("thruster_z",)

    @property
    def charts(self) -> Charts:
        """The phase plane with s = 0, the thresholds and the region in which the theorem ends."""
        lines = [Line(name="s = c beta + v = 0", points=self._where(0.0), look="switching")]
        for n, v in enumerate(self.thresholds, start=1):
            points = np.vstack([self._where(v), [[math.nan, math.nan]], self._where(-v)])
            lines.append(Line(name=f"|s| = v{n}", points=points))
        if self.contour:
            closed = np.array([*self.contour, self.contour[0]])
            lines.append(Line(name="in the end", points=closed, look="bound"))
        portrait = Portrait(
            name="relay",
            title="Where the relay switches",
            signals=(ANGLE, RATE),
            channel=self.thrusters[0],
            band=self.accuracy,
            lines=tuple(lines),
        )
        return (portrait,)

    def _where(self, s: float) -> np.ndarray:
        """The line c beta + v = s."""
        return np.array([[-FAR, s + self.c * FAR], [FAR, s - self.c * FAR]])

    def init(self) -> None:
        """Returns no memory: the pulses follow from the first measurement."""
        return

    def step(
        self, t: float, y: Sequence[float], memory: Memory | None
    ) -> tuple[tuple[float], Memory]:
        """Returns the thrust and the new memory.

        Args:
            t: Time, s.
            y: beta/J and v/J, rad and rad/s.
            memory: What the last step returned.
        """
        if memory is None:
            memory = self._first(t, y)
        for sign, end in zip((memory.sign, -memory.sign), memory.ends, strict=True):
            if t < end:
                return (sign * self.attraction_level,), memory._replace(until=end)
        s, n = self.c * y[0] + y[1], len(self.thresholds)
        bounds = (-math.inf, *(-v for v in reversed(self.thresholds)), 0.0, *self.thresholds)
        # On a bound s belongs to the cell that it has come into, at first to the outer one.
        falling = s < memory.high and (s <= memory.low or s < 0)
        i = bisect_left(bounds, s) if falling else bisect_right(bounds, s)
        # Cells 1 .. n+1 lie below zero, n+2 .. 2n+2 above; A grows outwards.
        level = self.levels[n + 1 - i] if i <= n + 1 else -self.levels[i - n - 2]
        low, high = (*bounds, math.inf)[i - 1 : i + 1]
        return (level,), memory._replace(until=math.inf, low=low, high=high)

    def events(self, t: float, y: Sequence[float], memory: Memory) -> tuple[float, ...]:
        """Returns the time left to the end of a pulse, or the distances of s to its cell's ends.

        Args:
            t: Time, s.
            y: beta/J and v/J, rad and rad/s.
            memory: What the last step returned.
        """
        if memory.until < math.inf:
            return (memory.until - t,)
        s = self.c * y[0] + y[1]
        return s - memory.low, memory.high - s

    def _first(self, t: float, y: Sequence[float]) -> Memory:
        """The pulses that the first measurement asks for."""
        sign, T1, T2 = (0.0, 0.0, 0.0)
        if self.attraction:
            sign, T1, T2 = attracting(y[0] + y[1] * self.compensated_delay, y[1], self.attraction)
        return Memory(sign, (t + T1, t + T2), math.inf, -math.inf, math.inf)
