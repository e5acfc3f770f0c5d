"""Disturbance torques on the bus: functions of time, and torques that follow the motion.

A torque that follows the rate of its axis is the worst that can happen to a regulator; Ivanova &
Sokolov (1999), (3.2), (3.3), (3.6), (3.7), prove it of these four.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal

from spacecraft_sim.config import Model, quantity

_GAUSS = math.sqrt(3) / 6  # the Gauss nodes of [0, 1] are 1/2 -+ this
_RESOLVED = 0.25  # rad of phase a line may span: its mean is then exact to 0.25^4/4320 = 1e-6


# Signs of a torque beside a positive constant: thruster off and rate up, off and down, on and up,
# on and down.  Beside a negative constant all is mirrored.
_FOLLOWS = {
    "with_rate": (1, -1, 1, -1),  # (3.2)
    "against_rate": (-1, 1, -1, 1),  # (3.3)
    "leftmost": (1, -1, -1, -1),  # (3.6), the furthest against the constant
    "rightmost": (-1, 1, 1, -1),  # (3.7), the furthest along with it
}


class Torque(Model):
    """A torque about one bus axis: constant + amplitude w, w(frequency t + phase) or a sign."""

    constant: float = quantity("constant part", "N m", 0.0)
    amplitude: float = quantity("amplitude of the periodic part", "N m", 0.0)
    frequency: float = quantity("angular frequency of the periodic part", "rad/s", 0.0)
    phase: float = quantity("phase of the periodic part", "rad", 0.0)
    waveform: Literal["sine", "square", "with_rate", "against_rate", "leftmost", "rightmost"] = (
        quantity("w: a sine, its sign, or a sign that follows rate and thrust", "", "sine")
    )

    def __call__(self, t: float) -> float:
        """Returns the torque at `t`, N m, less the part that follows the motion."""
        return self.function()(t)

    def function(self) -> Callable[[float], float]:
        """Returns what `__call__` does as a plain function, for the inner loop."""
        constant, amplitude, omega, phase = (
            self.constant, self.amplitude, self.frequency, self.phase
        )  # fmt: skip
        sin, copysign = math.sin, math.copysign
        if self.waveform == "square":
            return lambda t: constant + amplitude * copysign(1.0, sin(omega * t + phase))
        if self.waveform in _FOLLOWS:
            return lambda t: constant
        return lambda t: constant + amplitude * sin(omega * t + phase)

    def next_edge(self, t: float) -> float:
        """Returns the first time after `t` at which a square wave turns over, s; inf if none.

        Args:
            t: Time, s.
        """
        if self.waveform != "square" or self.frequency == 0:
            return math.inf
        half = math.pi / abs(self.frequency)
        first = -self.phase / self.frequency
        turns = math.floor((t - first) / half + 1e-9) + 1
        return first + turns * half


Ways = tuple[float, ...]  # the sign of the rate of each axis whose torque follows it


class Disturbance:
    """The disturbance torques of a scenario, by axis.

    Attributes:
        names: Input names `disturbance_<axis>`, in order.
        sensors: Rate readings that the torques follow.
        longest: Longest interval over which a line stands for the torques, s.
    """

    def __init__(self, torques: Mapping[Any, Torque]):
        self.names = tuple(f"disturbance_{axis}" for axis in torques)
        self._torques = tuple(torques.values())
        self._calls = tuple(torque.function() for torque in self._torques)
        self._steady = tuple(torque.waveform != "sine" for torque in self._torques)
        self._jumping = tuple(t for t in self._torques if t.waveform == "square")
        following = [axis for axis, torque in torques.items() if torque.waveform in _FOLLOWS]
        self.sensors = tuple(f"rate_{axis}" for axis in following)
        self._following = tuple(
            (
                list(torques).index(axis),
                f"_{axis}",
                math.copysign(torques[axis].amplitude, torques[axis].constant),
                math.copysign(1.0, torques[axis].constant),
                _FOLLOWS[torques[axis].waveform],
            )
            for axis in following
        )
        smooth = [t for t in self._torques if t.amplitude and t.waveform == "sine"]
        fastest = max((abs(t.frequency) for t in smooth), default=0.0)
        self.longest = _RESOLVED / fastest if fastest else math.inf

    def init(self, rates: Sequence[float]) -> Ways:
        """Returns the signs of the rates at the start; from rest that of the constant part.

        Args:
            rates: Readings, in the order of `sensors`, rad/s.
        """
        return tuple(
            math.copysign(1.0, rate or mirror)
            for rate, (_, _, _, mirror, _) in zip(rates, self._following, strict=True)
        )

    def events(self, rates: Sequence[float], ways: Ways) -> list[float]:
        """Returns functions that are positive while each rate keeps its sign.

        Args:
            rates: Readings, in the order of `sensors`, rad/s.
            ways: The signs.
        """
        return [way * rate for way, rate in zip(ways, rates, strict=True)]

    def turned(self, rates: Sequence[float], ways: Ways) -> Ways:
        """Returns the signs with those turned over whose rate has lost them.

        Args:
            rates: Readings, in the order of `sensors`, rad/s.
            ways: The signs until now.
        """
        return tuple(way if way * rate > 0 else -way for way, rate in zip(ways, rates, strict=True))

    def push(self, ways: Ways, thrust: Mapping[str, float]) -> list[float]:
        """Returns the part of the torques that follows the motion, N m.

        Args:
            ways: The signs of the rates.
            thrust: Present thrust by channel; one whose name ends in `_<axis>` acts on that axis.
        """
        push = [0.0] * len(self.names)
        for way, (k, axis, size, mirror, signs) in zip(ways, self._following, strict=True):
            firing = any(level for name, level in thrust.items() if name.endswith(axis))
            push[k] = size * signs[2 * firing + (way * mirror < 0)]
        return push

    def value(self, t: float) -> list[float]:
        """Returns the part of the torques that is a function of time, at `t`, N m.

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
        """Returns value at `t0` and rate of the line that stands for the torques of time.

        The line passes through the torque at the two Gauss nodes and so has the same mean and first
        moment up to (t1 - t0)^5: an integrator of order 4 keeps its order.

        Args:
            t0: Start of the interval, s.
            t1: End of the interval, s.
        """
        span = t1 - t0
        value, rate = [], []
        early, late = t0 + (0.5 - _GAUSS) * span, t0 + (0.5 + _GAUSS) * span
        for torque, steady in zip(self._calls, self._steady, strict=True):
            if steady:  # between its edges; one within rounding must not be seen as a slope
                value.append(torque(t0 + 0.5 * span))
                rate.append(0.0)
                continue
            a, b = torque(early), torque(late)
            slope = (b - a) / (2 * _GAUSS * span)
            value.append((a + b - slope * span) / 2)
            rate.append(slope)
        return value, rate
