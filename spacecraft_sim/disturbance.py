"""Disturbance torques on the bus, as known functions of time."""

import math
from collections.abc import Callable, Mapping
from typing import Any, Literal

from spacecraft_sim.config import Model, quantity

_GAUSS = math.sqrt(3) / 6  # the Gauss nodes of [0, 1] are 1/2 -+ this
_RESOLVED = 0.25  # rad of phase a line may span: its mean is then exact to 0.25^4/4320 = 1e-6


class Torque(Model):
    """A torque about one bus axis: constant + amplitude w(frequency t + phase)."""

    constant: float = quantity("constant part", "N m", 0.0)
    amplitude: float = quantity("amplitude of the periodic part", "N m", 0.0)
    frequency: float = quantity("angular frequency of the periodic part", "rad/s", 0.0)
    phase: float = quantity("phase of the periodic part", "rad", 0.0)
    waveform: Literal["sine", "square"] = quantity("w, a sine or its sign", "", "sine")

    def __call__(self, t: float) -> float:
        """Returns the torque at `t`, N m."""
        return self.function()(t)

    def function(self) -> Callable[[float], float]:
        """Returns the torque as a plain function of time, for the inner loop."""
        constant, amplitude, omega, phase = (
            self.constant, self.amplitude, self.frequency, self.phase
        )  # fmt: skip
        sin, copysign = math.sin, math.copysign
        if self.waveform == "square":
            return lambda t: constant + amplitude * copysign(1.0, sin(omega * t + phase))
        return lambda t: constant + amplitude * sin(omega * t + phase)

    def next_edge(self, t: float) -> float:
        """Returns the first time after `t` at which a square wave turns over, s; inf if none.

        Args:
            t: Time, s.
        """
        if self.waveform == "sine" or self.frequency == 0:
            return math.inf
        half = math.pi / abs(self.frequency)
        first = -self.phase / self.frequency
        turns = math.floor((t - first) / half + 1e-9) + 1
        return first + turns * half


class Disturbance:
    """The disturbance torques of a scenario, by axis.

    Attributes:
        names: Input names `disturbance_<axis>`, in order.
        longest: Longest interval over which a line stands for the torques, s.
    """

    def __init__(self, torques: Mapping[Any, Torque]):
        self.names = tuple(f"disturbance_{axis}" for axis in torques)
        self._torques = tuple(torques.values())
        self._calls = tuple(torque.function() for torque in self._torques)
        self._jumping = tuple(t for t in self._torques if t.waveform == "square")
        smooth = [t for t in self._torques if t.amplitude and t.waveform == "sine"]
        fastest = max((abs(t.frequency) for t in smooth), default=0.0)
        self.longest = _RESOLVED / fastest if fastest else math.inf

    def value(self, t: float) -> list[float]:
        """Returns the torques at `t`, N m.

        Args:
            t: Time, s.
        """
        return [torque(t) for torque in self._calls]

    def next_edge(self, t: float) -> float:
        """Returns the first time after `t` at which a torque jumps, s; inf if none.

        Args:
            t: Time, s.
        """
        if not self._jumping:
            return math.inf
        return min(torque.next_edge(t) for torque in self._jumping)

    def line(self, t0: float, t1: float) -> tuple[list[float], list[float]]:
        """Returns value at `t0` and rate of the straight line that stands for the torque.

        The line passes through the torque at the two Gauss nodes and so has the same mean and first
        moment up to (t1 - t0)^5: an integrator of order 4 keeps its order.

        Args:
            t0: Start of the interval, s.
            t1: End of the interval, s.
        """
        span = t1 - t0
        value, rate = [], []
        early, late = t0 + (0.5 - _GAUSS) * span, t0 + (0.5 + _GAUSS) * span
        for torque in self._calls:
            a, b = torque(early), torque(late)
            slope = (b - a) / (2 * _GAUSS * span)
            value.append((a + b - slope * span) / 2)
            rate.append(slope)
        return value, rate
