"""Several laws of one channel each, flown as one law."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import Any

from spacecraft_sim.chart import Charts, charts_of
from spacecraft_sim.controller import Controller


@dataclass(frozen=True, slots=True, kw_only=True)
class Channels:
    """Laws side by side; each decides at instants of its own.

    Attributes:
        laws: The laws, all in continuous time or all of the same period.
    """

    laws: tuple[Controller, ...]

    def __post_init__(self) -> None:
        if not self.laws:
            raise ValueError("no law: name at least one axis")
        if len({law.period for law in self.laws}) > 1:
            raise ValueError(
                f"laws of different periods cannot fly as one: {[law.period for law in self.laws]}"
            )
        if len(set(self.thrusters)) < len(self.thrusters):
            raise ValueError(f"two laws command the same channel: {self.thrusters}")

    @property
    def sensors(self) -> tuple[str, ...]:
        """Readings of all laws, one after the other."""
        return tuple(name for law in self.laws for name in law.sensors)

    @property
    def thrusters(self) -> tuple[str, ...]:
        """Channels of all laws, one after the other."""
        return tuple(name for law in self.laws for name in law.thrusters)

    @property
    def period(self) -> float | None:
        """The common period, s, or None."""
        return self.laws[0].period

    @property
    def charts(self) -> Charts:
        """The charts of all laws."""
        return tuple(chart for law in self.laws for chart in charts_of(law))

    def init(self) -> None:
        """Returns no memory: the first step asks every law for its own."""
        return

    def step(
        self, t: float, y: Sequence[float], memory: tuple[Any, ...] | None
    ) -> tuple[tuple[float, ...], tuple[Any, ...]]:
        """Lets those laws decide whose instant it is; the commands of the others stand.

        Args:
            t: Time, s.
            y: Readings, in the order of `sensors`.
            memory: (command, memory) of each law; None at first.
        """
        decided = []
        for k, (law, part) in enumerate(zip(self.laws, self._parts(y), strict=True)):
            if memory is None:
                decided.append(law.step(t, part, law.init()))
            elif self.period is not None or min(law.events(t, part, memory[k][1])) <= 0:
                decided.append(law.step(t, part, memory[k][1]))
            else:
                decided.append(memory[k])
        return tuple(u for command, _ in decided for u in command), tuple(decided)

    def events(self, t: float, y: Sequence[float], memory: tuple[Any, ...]) -> tuple[float, ...]:
        """Returns the event functions of all laws.

        Args:
            t: Time, s.
            y: Readings, in the order of `sensors`.
            memory: What the last step returned.
        """
        return tuple(
            event
            for law, part, (_, own) in zip(self.laws, self._parts(y), memory, strict=True)
            for event in law.events(t, part, own)
        )

    def _parts(self, y: Sequence[float]) -> list[Sequence[float]]:
        ends = accumulate((len(law.sensors) for law in self.laws), initial=0)
        return [y[a:b] for a, b in pairwise(ends)]
