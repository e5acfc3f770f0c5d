"""Thrusters between the controller's command and the force on the plant.

A command passes three stages: the delay line; the valve, which holds any level other than zero for
the minimum on-time; and the chamber, whose thrust follows the valve linearly in the rise or fall
time.  The thrust is piecewise linear in time; its corners are the *edges* on which both plants land
their integration steps.  Parameters are frozen, the state is explicit.
"""

import math
from bisect import bisect_right
from collections.abc import Sequence
from typing import NamedTuple

from spacecraft_sim.checks import choices
from spacecraft_sim.spacecraft import Thruster


class Knot(NamedTuple):
    """From `time` on the thrust is `thrust + slope (t - time)`, until the next knot."""

    time: float
    thrust: float
    slope: float


class Channel(NamedTuple):
    """State of one thruster.

    Attributes:
        thrust: Thrust at the first of the changes, N or N m.
        changes: Valve changes (time, level) in ascending order, the present one first.
        knots: The thrust that follows from them.
    """

    thrust: float
    changes: tuple[tuple[float, float], ...]
    knots: tuple[Knot, ...]


State = tuple[Channel, ...]


class Thrusters:
    """The thrusters of a spacecraft as one object that drives either plant.

    Attributes:
        names: Channel names, in the order of every command and output.
        specs: The thrusters.
    """

    def __init__(self, specs: Sequence[Thruster]):
        self.specs = tuple(specs)
        self.names = tuple(spec.name for spec in specs)

    def __getitem__(self, name: str) -> Thruster:
        if name not in self.names:
            raise ValueError(choices("thruster", name, self.names, where="the spacecraft"))
        return self.specs[self.names.index(name)]

    def init(self) -> State:
        """Returns the state with all valves closed and no command pending."""
        changes = ((-math.inf, 0.0),)
        return tuple(Channel(0.0, changes, _knots(0.0, changes, spec)) for spec in self.specs)

    def command(self, t: float, levels: Sequence[float], state: State) -> State:
        """Issues a command.

        Args:
            t: Time of issue, s; not before any earlier one.
            levels: Wanted thrust of each channel; a relay delivers the nearest of its levels.
            state: State of the thrusters.

        Returns:
            The state with the command pending.
        """
        return tuple(
            _commanded(t, nearest_level(level, spec), channel, spec)
            for level, channel, spec in zip(levels, state, self.specs, strict=True)
        )

    def line(self, t: float, state: State) -> tuple[list[float], list[float], float]:
        """Returns the straight lines that the thrusts follow just after `t`.

        Args:
            t: Time, s.
            state: State of the thrusters.

        Returns:
            Thrust by channel, N or N m; its rate, per s; and the time at which a thrust has its
            next corner, s, inf if none.
        """
        thrust, slope, edge = [], [], math.inf
        for channel in state:
            present = channel.knots[0]
            for knot in channel.knots:
                if knot.time > t:
                    edge = min(edge, knot.time)
                    break
                present = knot
            start, level, rate = present
            thrust.append(level + rate * (t - start) if rate else level)
            slope.append(rate)
        return thrust, slope, edge


def nearest_level(level: float, spec: Thruster) -> float:
    """Returns what a thruster makes of a wanted level, N or N m.

    A relay delivers zero or plus or minus one of its levels, a proportional thruster the wanted
    level itself, up to its highest.

    Args:
        level: Wanted thrust, N or N m.
        spec: The thruster.

    Raises:
        ValueError: If the level is not a number.
    """
    if math.isnan(level):
        raise ValueError(
            f"thruster {spec.name!r} is commanded nan; it has the levels {spec.levels}"
        )
    wanted = min(abs(level), spec.levels[-1])
    if spec.proportional:
        return math.copysign(wanted, level)
    amplitude = min((0.0, *spec.levels), key=lambda x: abs(x - wanted))
    return math.copysign(amplitude, level) if amplitude else 0.0


def _commanded(t: float, level: float, channel: Channel, spec: Thruster) -> Channel:
    arrival = spec.delay.arrival(t)
    if spec.failure and arrival >= spec.failure.time:
        return channel
    # A change that had to wait for the minimum on-time gives way to the later command, and so does
    # one of the same instant.
    changes = [change for change in channel.changes if change[0] < arrival]
    time, present = changes[-1] if changes else (-math.inf, math.nan)
    if level != present:
        locked = present != 0 and bool(changes)
        changes.append((max(arrival, time + spec.min_on_time) if locked else arrival, level))
    # What lies before t is history: keep the valve change in force at t and the thrust it met.
    first = bisect_right([time for time, _ in changes], t) - 1
    start = channel.thrust
    if first > 0:
        time = changes[first][0]
        knot = [k for k in channel.knots if k.time < time][-1]
        start = knot.thrust + knot.slope * (time - knot.time) if knot.slope else knot.thrust
    kept = tuple(changes[max(first, 0) :])
    return Channel(start, kept, _knots(start, kept, spec))


def _knots(
    thrust: float, changes: Sequence[tuple[float, float]], spec: Thruster
) -> tuple[Knot, ...]:
    """The thrust that follows the valve, from `thrust` at the first change."""
    if spec.failure:
        time, level = spec.failure.time, spec.failure.level
        changes = [*(change for change in changes if change[0] < time), (time, level)]
    ends = [time for time, _ in changes[1:]] + [math.inf]
    knots: list[Knot] = []
    for (time, level), end in zip(changes, ends, strict=True):
        for goal, duration in _ramps(thrust, level, spec):
            if duration == 0 or time == -math.inf:
                thrust = goal
                continue
            slope = (goal - thrust) / duration
            knots.append(Knot(time, thrust, slope))
            if time + duration >= end:
                thrust += slope * (end - time)
                break
            thrust, time = goal, time + duration
        else:
            knots.append(Knot(time, thrust, 0.0))
    return tuple(knots)


def _ramps(thrust: float, level: float, spec: Thruster) -> list[tuple[float, float]]:
    """(goal, duration) of the ramps from a thrust to a level; a reversal passes through zero."""
    if thrust == level:
        return []
    if thrust * level < 0:
        return [(0.0, spec.fall_time), (level, spec.rise_time)]
    return [(level, spec.rise_time if abs(level) > abs(thrust) else spec.fall_time)]
