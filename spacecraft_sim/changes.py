"""The instants at which the command or the thrust of a channel takes a new value."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np

from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.thrusters import nearest_level
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray
SPACING = 0.02  # time between rows that are shown though nothing happens, s
What = Literal["command", "thrust"]
BETWEEN = ("between levels, +", "between levels, -")  # a thrust that rises or falls


@dataclass(frozen=True, slots=True, kw_only=True)
class Channel:
    """A thruster channel of a flight.

    Attributes:
        thruster: The thruster.
        unit: N or N m.
        largest: The largest thrust that is expected of it, N or N m.
    """

    thruster: Thruster
    unit: str
    largest: float

    @property
    def name(self) -> str:
        """Its name, which is also that of the signal of its thrust."""
        return self.thruster.name

    @property
    def states(self) -> dict[str, float]:
        """The thrusts that it delivers once it has switched, ascending, by their words."""
        levels = self.thruster.levels
        return {self.state(x): x for x in sorted({0.0, *levels, *(-x for x in levels)})}

    def signal(self, what: What) -> str:
        """Returns the name of a signal of the channel.

        Args:
            what: The command, or the thrust that is delivered.
        """
        return f"{self.name}_command" if what == "command" else self.name

    def state(self, value: float) -> str:
        """Returns a command or a thrust in words.

        Args:
            value: The command or thrust, N or N m.
        """
        # A law computes its own levels, which may differ from the thruster's in the last digits.
        near = nearest_level(value, self.thruster)
        if math.isclose(value, near, rel_tol=1e-6):
            return f"{near:+.4g} {self.unit}" if near else "off"
        return BETWEEN[value < 0]

    def state_by_state(self, values: Array) -> list[str]:
        """Returns commands or thrusts in words; they are many, and few of them different.

        Args:
            values: Shape (n,), N or N m.
        """
        words = {value: self.state(value) for value in set(values.tolist())}
        return [words[value] for value in values.tolist()]


@dataclass(frozen=True, slots=True, kw_only=True)
class Changes:
    """How a command or a thrust changes during a part of a flight.

    Attributes:
        channel: The channel.
        what: The command, or the thrust that is delivered.
        before: The value before the part; NaN at the start of a flight.
        time: When it takes a new value, shape (n,), s.
        value: The values just after, shape (n,), N or N m.
        end: Time of the last row of the part, s.
    """

    channel: Channel
    what: What
    before: float
    time: Array
    value: Array
    end: float

    @property
    def last(self) -> float:
        """The value at the end of the part."""
        return float(self.value[-1]) if len(self.value) else self.before

    def words(self) -> list[str]:
        """Returns what each change is, in words."""
        steps = pairwise([self.before, *self.value.tolist()])
        about, states = f"{self.channel.name} {self.what}", self.channel.state_by_state(self.value)
        return [
            f"{about} {_change(a, b)}: {state}" for (a, b), state in zip(steps, states, strict=True)
        ]


def changes(
    part: Trajectory, channels: Sequence[Channel], before: Mapping[str, float]
) -> list[Changes]:
    """Returns the changes of all commands and thrusts in a part of a flight.

    Args:
        part: The part, at least one row.
        channels: The channels.
        before: The signals in the row before the part; empty at the start of a flight.
    """
    found = []
    for channel in channels:
        for what in ("command", "thrust"):
            value = part[channel.signal(what)]
            last = before.get(channel.signal(what), math.nan)
            rows = np.flatnonzero(value != np.r_[last, value[:-1]])
            found.append(
                Changes(
                    channel=channel,
                    what=what,
                    before=last,
                    time=part.time[rows],
                    value=value[rows],
                    end=float(part.time[-1]),
                )
            )
    return found


def rows_to_show(
    part: Trajectory, channels: Sequence[Channel], before: Mapping[str, float]
) -> Array:
    """Returns which rows a plot needs: one a `SPACING`, and all at which a relay acts.

    Args:
        part: A part of a flight, at least one row.
        channels: The channels.
        before: Time and signals of the last row that was shown; empty at the start of a flight.

    Returns:
        Truth values, shape (n,).
    """
    place = np.floor(np.r_[before.get("time", -1.0), part.time] / SPACING + 1e-6)
    chosen = np.diff(place) > 0
    for channel in channels:
        if not channel.thruster.proportional:
            for what in ("command", "thrust"):
                signal = channel.signal(what)
                chosen |= np.diff(part[signal], prepend=before.get(signal, math.nan)) != 0
    return chosen


def _change(old: float, new: float) -> str:
    if math.isnan(old):
        return "at first"
    if not new:
        return "ends"
    if not old:
        return "begins"
    return "switches" if old * new < 0 else "changes level"
