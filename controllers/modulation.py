"""Relay thrusters under a smooth law: a modulator for each channel turns torques into pulses.

The law is sampled with its period T and asks for a torque u; the thruster has one level U and a
minimum on-time t_min.  With r = u/U:

- Pulse width (PWM).  One pulse in every period, from the sample on, of the impulse asked for: as
  long as t_p = T min(|r|, 1), and none at all if t_p < t_min.  So |r| < t_min/T goes unanswered.
- Pulse width and frequency (PWPF).  A lag T_m f' = K_m (r - s) - f, s = -1, 0 or 1 for the thrust
  that flows, and a Schmitt trigger on f: s switches on at |f| = U_on, off at U_off, and not
  before t_min.  At rest f = K_m r, so |r| < U_on/K_m goes unanswered.  The lag is carried from
  sample to sample exactly, with r as it is at the later one.

What goes unanswered is the modulator's dead band, t_min/T or U_on/K_m of the level.

M. J. Sidi, "Spacecraft Dynamics and Control", Cambridge University Press 1997, chapter 9; G. Song,
N. V. Buck, B. N. Agrawal, "Spacecraft vibration reduction using pulse-width pulse-frequency
modulated input shaper", J. Guidance, Control, and Dynamics 22 (1999) 433-440.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal, NamedTuple

from pydantic import Field, TypeAdapter, model_validator

from controllers.axis import SIGNS, Ways
from spacecraft_sim.chart import Charts, charts_of
from spacecraft_sim.checks import positive
from spacecraft_sim.config import Model, quantity
from spacecraft_sim.controller import Controller
from spacecraft_sim.thrusters import Thrusters

_ROUNDING = 1e-9  # of a period, in which the clock may be late at a sample


class Channel(NamedTuple):
    """State of a modulator.

    Attributes:
        sign: Of the thrust; 0 if it is off.
        since: When that was decided, s.
        end: When the pulse ends if it does before the next sample, s; inf if not.
        lag: Output of the lag; 0 where there is none.
    """

    sign: int
    since: float
    end: float
    lag: float


OFF = Channel(0, -math.inf, math.inf, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PulseWidth:
    """Pulse-width modulator of one channel.

    Attributes:
        period: T, s.
        min_on_time: t_min, s.
        signs: Signs that the thrust may have.
    """

    period: float
    min_on_time: float
    signs: tuple[int, ...] = (-1, 1)

    @property
    def dead_band(self) -> float:
        """Share of the level below which nothing is answered."""
        return self.min_on_time / self.period

    @property
    def shortest(self) -> float:
        """The shortest pulse, s."""
        return self.min_on_time

    def sample(self, t: float, r: float, before: Channel) -> Channel:
        """Returns the pulse that begins at a sample.

        Args:
            t: Time of the sample, s.
            r: Torque asked for, over the level.
            before: State before the sample, of no effect.
        """
        sign = int(math.copysign(1, r))
        t_p = self.period * min(abs(r), 1.0)
        if sign not in self.signs or t_p < self.min_on_time or t_p == 0:
            return OFF
        # A pulse as long as the period goes on until the next sample decides.
        whole = t_p > (1 - _ROUNDING) * self.period
        return Channel(sign, t, math.inf if whole else t + t_p, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class PulseWidthPulseFrequency:
    """PWPF modulator of one channel.

    Attributes:
        period: Sampling period, s.
        min_on_time: t_min, s.
        gain: K_m.
        time_constant: T_m, s.
        on: U_on.
        off: U_off.
        signs: Signs that the thrust may have.
    """

    period: float
    min_on_time: float
    gain: float
    time_constant: float
    on: float
    off: float
    signs: tuple[int, ...] = (-1, 1)

    @property
    def dead_band(self) -> float:
        """Share of the level below which nothing is answered, at rest."""
        return self.on / self.gain

    @property
    def shortest(self) -> float:
        """The shortest pulse, s, in whole periods: at rest by itself, or what it must last."""
        K = self.gain
        # From f = U_on with r = U_on/K_m, f falls to U_off on its way to U_on - K_m.
        alone = self.time_constant * math.log(K / max(K - self.on + self.off, _ROUNDING))
        least = max(alone, self.min_on_time)
        return self.period * max(1, math.ceil(least / self.period - _ROUNDING))

    def sample(self, t: float, r: float, before: Channel) -> Channel:
        """Returns lag and thrust after a sample.

        Args:
            t: Time of the sample, s.
            r: Torque asked for, over the level; taken for that of the period which ends here.
            before: State before the sample, with the thrust of that period.
        """
        s, since = before.sign, before.since
        goal = self.gain * (r - s)
        f = goal + (before.lag - goal) * math.exp(-self.period / self.time_constant)
        if s and t - since < self.min_on_time - _ROUNDING * self.period:
            return before._replace(lag=f)
        if s and s * f <= self.off:
            s = 0
        for way in self.signs:
            if way * f >= self.on:
                s = way
        return Channel(s, since if s == before.sign else t, math.inf, f)


Modulator = PulseWidth | PulseWidthPulseFrequency


class Memory(NamedTuple):
    """What a modulated law remembers.

    Attributes:
        law: Memory of the law.
        channels: States of the modulators.
        samples: How many samples were taken.
    """

    law: Any
    channels: tuple[Channel, ...]
    samples: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Modulated:
    """A sampled law whose torques are turned into pulses.

    Pulses of a given width end between samples: with them it is a relay law in continuous time,
    which keeps the clock of its samples itself.

    Attributes:
        law: The law.
        sampling: Sampling period of law and modulators, s.
        modulators: One a channel.
        levels: Levels of the thrusters, one a channel, N or N m.
    """

    law: Controller
    sampling: float
    modulators: tuple[Modulator, ...]
    levels: tuple[float, ...]

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the readings."""
        return self.law.sensors

    @property
    def thrusters(self) -> tuple[str, ...]:
        """Names of the channels."""
        return self.law.thrusters

    @property
    def period(self) -> float | None:
        """Sampling period, s; None if pulses end between samples."""
        whole = not any(isinstance(m, PulseWidth) for m in self.modulators)
        return self.sampling if whole else None

    @property
    def charts(self) -> Charts:
        """Charts of the law."""
        return charts_of(self.law)

    def init(self) -> Memory:
        """Returns the memory of a law before its first sample, every channel off."""
        return Memory(self.law.init(), (OFF,) * len(self.modulators), 0)

    def step(
        self, t: float, y: Sequence[float], memory: Memory
    ) -> tuple[tuple[float, ...], Memory]:
        """Returns the thrusts and the new memory, at a sample or where a pulse ends.

        Args:
            t: Time, s.
            y: Readings, in the order of `sensors`.
            memory: What the last step returned.
        """
        if t >= memory.samples * self.sampling:
            u, own = self.law.step(t, y, memory.law)
            parts = zip(self.modulators, u, self.levels, memory.channels, strict=True)
            channels = tuple(m.sample(t, torque / U, c) for m, torque, U, c in parts)
            memory = Memory(own, channels, memory.samples + 1)
        else:
            memory = memory._replace(channels=tuple(_ended(t, c) for c in memory.channels))
        pairs = zip(self.levels, memory.channels, strict=True)
        return tuple(c.sign * U for U, c in pairs), memory

    def events(self, t: float, y: Sequence[float], memory: Memory) -> tuple[float, ...]:
        """Returns the time left to the next sample or end of a pulse, s; nothing with a period.

        Args:
            t: Time, s.
            y: Readings.
            memory: What the last step returned.
        """
        if self.period is not None:
            return ()
        ends = (c.end for c in memory.channels)
        return (min(memory.samples * self.sampling, *ends) - t,)


def _ended(t: float, channel: Channel) -> Channel:
    return OFF if channel.end <= t else channel


class Pwm(Model):
    """Pulse-width modulation, as a scenario asks for it."""

    kind: Literal["pwm"] = quantity("pulse-width modulation")
    ways: Ways = quantity("which way the thrusters may push", "", "both")

    def modulator(self, period: float, min_on_time: float) -> PulseWidth:
        """Returns the modulator of one channel.

        Args:
            period: Sampling period of the law, s.
            min_on_time: Of the thruster, s.

        Raises:
            ValueError: If a pulse of the minimum on-time does not fit into the period.
        """
        positive(period=period)
        if min_on_time > period:
            raise ValueError(
                f"a pulse of the minimum on-time of {min_on_time:.6g} s does not fit into the "
                f"period of {period:.6g} s: set controller.period = {min_on_time:.6g} or longer"
            )
        return PulseWidth(period=period, min_on_time=min_on_time, signs=SIGNS[self.ways])


class Pwpf(Model):
    """Pulse-width pulse-frequency modulation, as a scenario asks for it."""

    kind: Literal["pwpf"] = quantity("pulse-width pulse-frequency modulation")
    gain: float = quantity("K_m of the lag", "", 4.0, gt=0)
    time_constant: float = quantity("T_m of the lag", "s", 0.15, gt=0)
    on: float = quantity(
        "U_on, output of the lag at which the thruster switches on", "", 0.45, gt=0
    )
    off: float = quantity("U_off, output at which it switches off", "", 0.15, gt=0)
    ways: Ways = quantity("which way the thrusters may push", "", "both")

    @model_validator(mode="after")
    def _does_not_chatter(self) -> "Pwpf":
        if self.off >= self.on:
            raise ValueError(
                f"off = {self.off} must be below on = {self.on}: the trigger would chatter"
            )
        return self

    def modulator(self, period: float, min_on_time: float) -> PulseWidthPulseFrequency:
        """Returns the modulator of one channel.

        Args:
            period: Sampling period of the law, s.
            min_on_time: Of the thruster, s.

        Raises:
            ValueError: If the least pulse carries the lag from U_on to -U_on: one pulse would bring
                on the opposite one, for ever.
        """
        positive(period=period)
        modulator = PulseWidthPulseFrequency(
            period=period,
            min_on_time=min_on_time,
            gain=self.gain,
            time_constant=self.time_constant,
            on=self.on,
            off=self.off,
            signs=SIGNS[self.ways],
        )
        # In the dead band a pulse carries f from U_on towards U_on - K_m.
        K, on = self.gain, self.on
        longest = self.time_constant * math.log(K / (K - 2 * on)) if 2 * on < K else math.inf
        if modulator.shortest >= longest:
            raise ValueError(
                f"a pulse lasts {modulator.shortest:.6g} s at least; from {longest:.6g} s on it "
                "takes the lag from on to -on, and pulses of both signs would follow each other "
                "for ever: set modulation.gain lower, modulation.on or .time_constant higher"
            )
        return modulator


Modulation = Annotated[Pwm | Pwpf, Field(discriminator="kind")]


def asked_for(table: Mapping[str, Any]) -> Modulation | None:
    """Returns the modulation that the controller table of a scenario asks for, if any.

    Args:
        table: The table.

    Raises:
        ValueError: If its `modulation` is not valid.
    """
    if "modulation" not in table:
        return None
    return TypeAdapter(Modulation).validate_python(table["modulation"])


def modulated(law: Controller, modulation: Modulation, thrusters: Thrusters) -> Modulated:
    """Puts a modulator between each torque of a sampled law and its relay thruster.

    Args:
        law: The law; its period is that of the modulators.
        modulation: Which modulators.
        thrusters: The thrusters; they say level and minimum on-time.

    Raises:
        ValueError: If the law is not sampled, or a thruster is no relay of one level.
    """
    if law.period is None:
        raise ValueError(
            "modulators turn the torques of a sampled law into pulses; this law has no period: it "
            "switches its thrusters itself"
        )
    specs = [thrusters[name] for name in law.thrusters]
    for spec in specs:
        if spec.proportional or len(spec.levels) != 1:
            kind = "proportional" if spec.proportional else f"of levels {spec.levels}"
            raise ValueError(
                f"thruster {spec.name!r} is {kind}; pulses are of a relay of one level: set "
                f"thrusters.{spec.name}.proportional = false and .levels = [{spec.levels[-1]}]"
            )
    return Modulated(
        law=law,
        sampling=law.period,
        modulators=tuple(modulation.modulator(law.period, spec.min_on_time) for spec in specs),
        levels=tuple(spec.levels[0] for spec in specs),
    )
