"""A filter in place of a velocity sensor: the dirty derivative w' = -K w + z' of a reading z.

I. V. Burkov (1998), (2.2)-(2.3): with zh' = K (z - zh), w = z - zh.  K w follows z' below the
cutoff K and never asks for it.  Sampled, w_k = a w_{k-1} + b (z_k - z_{k-1}):

| between samples             | a                     | b                   |
|-----------------------------|-----------------------|---------------------|
| z a straight line (default) | e^{-KT}               | (1 - e^{-KT})/(KT)  |
| z held                      | e^{-KT}               | 1                   |
| Tustin                      | (1 - KT/2)/(1 + KT/2) | 1/(1 + KT/2)        |
| Euler                       | 1 - KT                | 1                   |

A held z makes the filter, and with it the damping of a loop, too large by KT/(1 - e^{-KT}); Euler
fails from KT = 2 on.  The filter starts at the measured value, w = 0: no kick at the first sample.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

from controllers.gains import Numbers, positive_entries
from spacecraft_sim.chart import Charts
from spacecraft_sim.checks import choices, positive
from spacecraft_sim.filtered_law import Formula
from spacecraft_sim.thrusters import Thrusters

Hold = Literal["first-order hold", "zero-order hold", "tustin", "euler"]


class Memory(NamedTuple):
    """The last sample: reading z and filtered rate w."""

    z: Numbers
    w: Numbers


@dataclass(frozen=True, slots=True, kw_only=True)
class VelocityFilter:
    """A bank of sampled filters.

    Attributes:
        cutoffs: K, one a channel, 1/s.
        period: Sampling period T, s.
        hold: What is assumed of z between samples.
        decay: a, one a channel.
        gain: b, one a channel.
    """

    cutoffs: Numbers
    period: float
    hold: Hold
    decay: Numbers
    gain: Numbers

    def step(self, z: Sequence[float], memory: Memory | None) -> Memory:
        """Returns the memory after a sample, in which is w.

        Args:
            z: Readings, in their own units.
            memory: What the last step returned; None at the first.
        """
        if memory is None:
            return Memory(tuple(z), (0.0,) * len(self.cutoffs))
        parts = zip(self.decay, self.gain, memory.w, z, memory.z, strict=True)
        return Memory(tuple(z), tuple(a * w + b * (new - old) for a, b, w, new, old in parts))

    def coefficients(self, period: float) -> tuple[Numbers, Numbers]:
        """Returns a and b, each one a channel, for another sampling period.

        Args:
            period: T, s.
        """
        pairs = [_COEFFICIENTS[self.hold](K * period) for K in self.cutoffs]
        return tuple(a for a, _ in pairs), tuple(b for _, b in pairs)


def velocity_filter(
    *, cutoffs: Sequence[float], period: float, hold: Hold = "first-order hold"
) -> VelocityFilter:
    """Designs the filter of a law.

    Args:
        cutoffs: K, one a channel, 1/s; none for a law without filters.
        period: Sampling period T, s.
        hold: What is assumed of z between samples.

    Raises:
        ValueError: If a number is not positive, there is no such hold, or the sampled filter would
            not be stable.
    """
    positive(period=period)
    K = positive_entries("cutoffs", cutoffs, len(cutoffs))
    if hold not in _COEFFICIENTS:
        raise ValueError(choices("hold", hold, _COEFFICIENTS, where="the velocity filter"))
    if hold == "euler" and K and max(K) * period >= 2:
        raise ValueError(
            f"an Euler filter needs K T < 2; here K = {max(K):.6g} 1/s and T = {period:.6g} s: "
            f"take T < {2 / max(K):.6g} s or another hold"
        )
    blank = VelocityFilter(cutoffs=K, period=period, hold=hold, decay=(), gain=())
    decay, gain = blank.coefficients(period)
    return replace(blank, decay=decay, gain=gain)


@dataclass(frozen=True, slots=True, kw_only=True)
class SampledLaw:
    """A formula with its filter, sampled: the torques are held from one sample to the next.

    Attributes:
        formula: The law.
        filter: Its filter; one without channels for a law that filters nothing.
        sensors: What it reads.
        thrusters: The channels that it commands.
        charts: What it would draw of a flight.
    """

    formula: Formula
    filter: VelocityFilter
    sensors: tuple[str, ...]
    thrusters: tuple[str, ...]
    charts: Charts = field(default=(), compare=False)

    @property
    def period(self) -> float:
        """Sampling period, s."""
        return self.filter.period

    def init(self) -> Memory | None:
        """Returns the memory before the first sample."""
        return None

    def step(
        self, t: float, y: Sequence[float], memory: Memory | None
    ) -> tuple[Sequence[float], Memory]:
        """Returns the torques and the new memory.

        Args:
            t: Time, s.
            y: Readings, in the order of `sensors`.
            memory: What the last step returned.
        """
        memory = self.after(t, y, memory)
        return self.formula.command(t, y, memory.w), memory

    def after(self, t: float, y: Sequence[float], memory: Memory | None) -> Memory:
        """Returns the new memory alone.

        Args:
            t: Time, s.
            y: Readings, in the order of `sensors`.
            memory: What the last step returned.
        """
        return self.filter.step(self.formula.filtered(t, y), memory)

    def events(self, t: float, y: Sequence[float], memory: Memory | None) -> tuple[float, ...]:
        """Returns nothing: the law is sampled.

        Args:
            t: Time, s.
            y: Readings.
            memory: Memory.
        """
        return ()


def sampled(
    formula: Formula,
    *,
    cutoffs: Sequence[float],
    hold: Hold,
    period: float,
    sensors: tuple[str, ...],
    channels: tuple[str, ...],
    thrusters: Thrusters | None,
) -> SampledLaw:
    """Puts a law together from its formula.

    Args:
        formula: The law in continuous time.
        cutoffs: K of its filters, 1/s; none for a law without filters.
        hold: What the filters assume between samples.
        period: Sampling period, s.
        sensors: What the law reads.
        channels: The channels that it commands.
        thrusters: The actuators there are; any if None.

    Raises:
        ValueError: If a number is not positive, or a channel does not exist.
    """
    if thrusters is not None:
        for name in channels:
            thrusters[name]  # raises if there is no such channel
    return SampledLaw(
        formula=formula,
        filter=velocity_filter(cutoffs=cutoffs, period=period, hold=hold),
        sensors=sensors,
        thrusters=channels,
    )


_COEFFICIENTS: dict[str, Callable[[float], tuple[float, float]]] = {  # (a, b) by K T
    "first-order hold": lambda x: (math.exp(-x), -math.expm1(-x) / x),
    "zero-order hold": lambda x: (math.exp(-x), 1.0),
    "tustin": lambda x: ((1 - x / 2) / (1 + x / 2), 1 / (1 + x / 2)),
    "euler": lambda x: (1 - x, 1.0),
}
