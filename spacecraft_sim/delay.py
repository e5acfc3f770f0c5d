"""Delays of an actuator: constant, sinusoidal, or any function of time."""

import math
from collections.abc import Callable
from itertools import pairwise

from pydantic import model_validator

from spacecraft_sim.checks import positive
from spacecraft_sim.config import Model, quantity


class Delay(Model):
    """Delay of an actuator: h(t) = mean + amplitude sin(frequency t + phase).

    A command issued at t takes effect at the time a with a - h(a) = t.
    """

    mean: float = quantity("mean delay", "s", ge=0)
    amplitude: float = quantity("amplitude of its variation", "s", 0.0)
    frequency: float = quantity("angular frequency of its variation", "rad/s", 0.0)
    phase: float = quantity("phase of its variation", "rad", 0.0)

    @model_validator(mode="after")
    def _runs_forwards(self) -> "Delay":
        if abs(self.amplitude) > self.mean:
            raise ValueError(
                f"the delay goes negative: amplitude {self.amplitude} s > mean {self.mean} s"
            )
        if (speed := abs(self.amplitude * self.frequency)) >= 1:
            raise ValueError(f"the delay runs backwards: amplitude * frequency = {speed} >= 1")
        return self

    @property
    def longest(self) -> float:
        """The upper bound of h, s."""
        return self.mean + abs(self.amplitude)

    def __call__(self, t: float) -> float:
        """Returns h(t), s."""
        return self.mean + self.amplitude * math.sin(self.frequency * t + self.phase)

    def arrival(self, t: float) -> float:
        """Returns the time at which a command issued at `t` takes effect, s.

        Args:
            t: Time of issue, s.
        """
        if self.amplitude == 0:
            return t + self.mean
        a = t + self.mean
        # a -> t + h(a) contracts, Newton on a - h(a) - t converges from anywhere near.
        for _ in range(50):
            rate = 1 - self.amplitude * self.frequency * math.cos(self.frequency * a + self.phase)
            step = (a - self(a) - t) / rate
            a -= step
            if abs(step) <= 1e-15 * max(1.0, abs(a)):
                return a
        return self._arrival_by_bisection(t)

    def _arrival_by_bisection(self, t: float) -> float:
        lo, hi = t + self.mean - abs(self.amplitude), t + self.longest
        while lo < (mid := (lo + hi) / 2) < hi:
            lo, hi = (mid, hi) if mid - self(mid) < t else (lo, mid)
        return hi


def arrival(delay: float | Delay | Callable[[float], float]) -> Callable[[float], float]:
    """Returns what takes a time of issue to the time of effect, checked as it goes.

    Args:
        delay: h, s: constant, sinusoidal, or any function with h > 0 and h' < 1.

    Raises:
        ValueError: At once or when called, if the delay is not positive or runs backwards.
    """
    if isinstance(delay, Delay):
        arrive = delay.arrival
    elif callable(delay):
        arrive = _solved(delay)
    else:
        positive(delay=delay)
        return lambda t: t + delay
    last = -math.inf

    def checked(t: float) -> float:
        nonlocal last
        a = arrive(t)
        if a <= t:
            raise ValueError(f"the delay must be positive; a command of t = {t} s acts at {a} s")
        if a < last:
            raise ValueError(
                f"the delay runs backwards: a command of t = {t} s overtakes an earlier one, "
                f"at {a} s before {last} s"
            )
        last = a
        return a

    return checked


def _solved(delay: Callable[[float], float]) -> Callable[[float], float]:
    """Solves a - h(a) = t for the time of effect a."""
    from scipy.optimize import brentq

    def arrive(t: float) -> float:
        if not (h := delay(t)) >= 0:
            raise ValueError(f"the delay goes negative, or is no number: h({t} s) = {h} s")
        ahead = max(h, 1e-9)
        while t + ahead - delay(t + ahead) < t:
            ahead *= 2
            if ahead > 1e9:
                raise ValueError(f"a command of t = {t} s never takes effect: h grows too fast")
        issued = [a - delay(a) for a in (t + k * ahead / 32 for k in range(33))]
        if any(later <= earlier for earlier, later in pairwise(issued)):
            raise ValueError(f"the delay runs backwards after t = {t} s: a - h(a) does not grow")
        return brentq(lambda a: a - delay(a) - t, t, t + ahead, xtol=1e-15)  # pyright: ignore

    return arrive
