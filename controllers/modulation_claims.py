"""What may be expected of a smooth law whose torques are turned into pulses.

Pulses take the theorems of the law away: its dead band leaves an angle, its least pulse a rate.
Two rules say how large they are, U the level, k and J the least stiffness and moment of inertia:

- The law turns the body back while k times the angle exceeds the dead band of the modulators, so
  an angle of some U t_min/(T k) is left under PWM, and U U_on/(K_m k) under PWPF.
- The least pulse changes the rate by U t_min/J; a limit cycle has about that rate.

They are of one axis at rest and no theorems: a body in a slow limit cycle coasts a little beyond,
and pulses about several axes may fall together.  A reference of Burkov's law (5.8) came within 35 %
of the first and 17 % of the second, and that much is granted here; of 64 flights of three minutes
from random slews of 1.2 rad, 63 kept to the first, and to the second 32 of 32 of a rigid body and
27 of 32 of a hub with booms, which swing along.  That no pulse is shorter than the minimum on-time
is certain.
"""

import math
from collections.abc import Callable, Sequence
from typing import Protocol, runtime_checkable

import numpy as np

from controllers.modulation import Modulated
from spacecraft_sim.chart import pulses
from spacecraft_sim.guarantee import Guarantee, Measurement
from spacecraft_sim.trajectory import Trajectory

ANGLE, RATE = 1.35, 1.17  # what is granted beyond the rules
SETTLED = 2 / 3  # share of a flight after which it is judged
RATES = ("rate_x", "rate_y", "rate_z")
_LANDING = 1e-9  # edges are located to 1e-11 s


@runtime_checkable
class Pointing(Protocol):
    """A formula that knows how far a body is turned from its goal."""

    @property
    def stiffness(self) -> float:
        """Least stiffness at the goal, N m/rad."""
        ...

    def angle(self, y: Sequence[float]) -> float:
        """Returns the angle from the goal, rad.

        Args:
            y: Readings of the law.
        """
        ...


def claims(law: Modulated, inertias: Callable[[], Sequence[float]]) -> tuple[Guarantee, ...]:
    """Returns what is claimed of a modulated law; angle and rate only of one that turns a body.

    Args:
        law: The law.
        inertias: Returns the moments of inertia that its torques meet at once, kg m^2.
    """
    on_times = _on_times(law)
    formula = getattr(law.law, "formula", None)
    if not isinstance(formula, Pointing):
        return (on_times,)
    parts = list(zip(law.levels, law.modulators, strict=True))
    dead_band = max(U * m.dead_band for U, m in parts) / formula.stiffness
    impulse = max(U * m.shortest / J for (U, m), J in zip(parts, inertias(), strict=True))

    def angles(track: Trajectory) -> list[float]:
        return [formula.angle(y) for y in zip(*(track[name] for name in law.sensors), strict=True)]

    def rates(track: Trajectory) -> list[float]:
        return [math.hypot(*om) for om in zip(*(track[name] for name in RATES), strict=True)]

    return (
        on_times,
        _residual("residual angle", "the dead band over the stiffness", "rad", angles, dead_band,
                  ANGLE),
        _residual("residual rate", "one least pulse over the inertia", "rad/s", rates, impulse,
                  RATE),
    )  # fmt: skip


def _residual(
    what: str,
    rule: str,
    unit: str,
    values: Callable[[Trajectory], list[float]],
    predicted: float,
    granted: float,
) -> Guarantee:
    """The claim that the last third of a flight keeps to a rule."""

    def largest(track: Trajectory) -> Measurement:
        late = track.time >= SETTLED * track.time[-1]
        found = np.where(late, values(track), -math.inf)
        worst = int(np.argmax(found))
        return Measurement(float(found[worst]), float(track.time[worst]))

    return Guarantee(
        claim=f"{what} in the last third, about {rule}",
        source=f"rule of one axis, no theorem; {100 * (granted - 1):.0f} % more is granted",
        unit=unit,
        measure=largest,
        predicted=predicted,
        bound=granted * predicted,
        signals=RATES,
    )


def _on_times(law: Modulated) -> Guarantee:
    """The claim that no completed pulse is shorter than the minimum on-time."""

    def missing(track: Trajectory) -> Measurement:
        worst, when = 0.0, 0.0
        for name, modulator in zip(law.thrusters, law.modulators, strict=True):
            start, length = pulses(track.time, track[name])
            if len(length) and (short := modulator.min_on_time - float(length.min())) > worst:
                worst, when = short, float(start[length.argmin()])
        return Measurement(worst, when)

    return Guarantee(
        claim="what the shortest pulse lacks of the minimum on-time",
        source="pulse modulation; how exactly edges are landed on",
        unit="s",
        measure=missing,
        bound=_LANDING,
    )
