"""Programmes of motion q_p(t) for joints, and the way back to one from far off it."""

import math
from dataclasses import dataclass
from typing import NamedTuple, Protocol

from controllers.gains import Numbers, finite_entries, positive_entries
from spacecraft_sim.checks import positive


class Motion(NamedTuple):
    """A point of a programme: angles, rad; rates, rad/s; accelerations, rad/s^2."""

    q: Numbers
    v: Numbers
    a: Numbers


class Programme(Protocol):
    """A motion to follow, twice differentiable."""

    def __call__(self, t: float) -> Motion:
        """Returns the motion at an instant.

        Args:
            t: Time, s.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Harmonic:
    """q_p = mean + amplitude sin(frequency t + phase), joint by joint.

    Attributes:
        mean: Middle of the swing, rad.
        amplitude: Half the swing, rad.
        frequency: Angular frequency, rad/s.
        phase: Phase at t = 0, rad.
    """

    mean: tuple[float, ...]
    amplitude: tuple[float, ...]
    frequency: tuple[float, ...]
    phase: tuple[float, ...]

    def __post_init__(self) -> None:
        n = len(self.mean)
        for name in ("mean", "amplitude", "phase"):
            finite_entries(name, getattr(self, name), n)
        positive_entries("frequency", self.frequency, n)

    def __call__(self, t: float) -> Motion:
        """Returns the motion at an instant.

        Args:
            t: Time, s.
        """
        turns = [w * t + phase for w, phase in zip(self.frequency, self.phase, strict=True)]
        parts = list(zip(self.amplitude, self.frequency, turns, strict=True))
        swing = [a * math.sin(x) for a, _, x in parts]
        return Motion(
            tuple(m + s for m, s in zip(self.mean, swing, strict=True)),
            tuple(a * w * math.cos(x) for a, w, x in parts),
            tuple(-w * w * s for (_, w, _), s in zip(parts, swing, strict=True)),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Return:
    """A programme with a way back to it, after section 3 of Burkov (1998).

    Polynomials of the fifth degree lead from a given deviation and its rate at `start`, with no
    acceleration of their own, to the programme, which they meet at `end` to the second derivative.

    Attributes:
        programme: The programme to return to.
        start: t_x, s.
        end: t_y, s.
        deviation: q - q_p at the start, rad.
        rate: q' - q_p' at the start, rad/s.
    """

    programme: Programme
    start: float
    end: float
    deviation: tuple[float, ...]
    rate: tuple[float, ...]

    def __post_init__(self) -> None:
        positive(duration=self.end - self.start)

    def __call__(self, t: float) -> Motion:
        """Returns the motion at an instant; before the start that of the start's polynomial.

        Args:
            t: Time, s.
        """
        motion = self.programme(t)
        if t >= self.end:
            return motion
        span = self.end - self.start
        s = (t - self.start) / span
        # The two polynomials in s with unit value, or unit slope, at 0 and nothing else at 0 and 1.
        value = 1 + s**3 * (-10 + s * (15 - 6 * s)), s * (1 + s**2 * (-6 + s * (8 - 3 * s)))
        slope = s**2 * (-30 + s * (60 - 30 * s)), 1 + s**2 * (-18 + s * (32 - 15 * s))
        curve = s * (-60 + s * (180 - 120 * s)), s * (-36 + s * (96 - 60 * s))

        def added(x: Numbers, shape: tuple[float, float], scale: float) -> Numbers:
            pairs = zip(x, self.deviation, self.rate, strict=True)
            return tuple(p + (d * shape[0] + span * r * shape[1]) / scale for p, d, r in pairs)

        return Motion(
            added(motion.q, value, 1.0),
            added(motion.v, slope, span),
            added(motion.a, curve, span**2),
        )
