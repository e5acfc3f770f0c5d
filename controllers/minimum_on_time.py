"""A relay law of the phase plane that keeps every thrust for the minimum on-time.

While a level other than zero is younger than the minimum on-time nothing is decided; after that,
and at any time with the thrust off, the switching curves are (`contour_rules`).  Angles and rates
are made dimensionless inside.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from controllers.dimensionless import Scale
from spacecraft_sim.chart import Charts
from spacecraft_sim.switching_curves import Relay


class Memory(NamedTuple):
    """What the law remembers.

    Attributes:
        level: n, the dimensionless level commanded last: -1, 0 or +1.
        since: Time of that command, s.
    """

    level: int
    since: float


@dataclass(frozen=True, slots=True, kw_only=True)
class MinimumOnTimeRelay:
    """The law in continuous time.

    Attributes:
        relay: Switching curves, dimensionless.
        scale: Units; the commanded thrust is mirrored with them.
        level: Thrust of the one level that accelerates to plus, N or N m.
        sensors: Names of angle and rate, rad and rad/s.
        thrusters: Name of the one channel.
        period: None: the law is in continuous time.
        charts: The figures of the paper for this law.
    """

    relay: Relay
    scale: Scale
    level: float
    sensors: tuple[str, ...] = ("attitude_z", "rate_z")
    thrusters: tuple[str, ...] = ("thruster_z",)
    period: float | None = None
    charts: Charts = field(default=(), compare=False)

    def init(self) -> Memory:
        """Returns the memory of a thruster that is off."""
        return Memory(0, -math.inf)

    def step(
        self, t: float, y: Sequence[float], memory: Memory
    ) -> tuple[tuple[float, ...], Memory]:
        """Returns the thrust and the new memory.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            memory: What the last step returned.
        """
        n = memory.level
        if n == 0 or memory.since + self.scale.time - t <= 0:
            n = self.relay.command(n, *self.scale.reduced(y[0], y[1]))
            if n != memory.level:
                memory = Memory(n, t)
        return (n * self.scale.sign * self.level,), memory

    def events(self, t: float, y: Sequence[float], memory: Memory) -> tuple[float, ...]:
        """Returns the time left of a pulse, s, or the distances to where the command changes.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            memory: What the last step returned.
        """
        n = memory.level
        left = memory.since + self.scale.time - t
        if n != 0 and left > 0:
            return (left,)
        return self.relay.distances(n, *self.scale.reduced(y[0], y[1]))
