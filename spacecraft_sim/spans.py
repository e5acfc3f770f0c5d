"""Parts of a flight worth a closer look: until it has settled, and its last cycles."""

from collections.abc import Sequence

import numpy as np

from spacecraft_sim.trajectory import Trajectory, moving_axes


def settled(flight: Trajectory) -> float:
    """Returns when the quasi-rigid angle is last beyond a twentieth of its peak, s.

    Args:
        flight: The flight.
    """
    last, times = float(flight.time[-1]), [0.0]
    for axis in moving_axes(flight, "quasi_rigid_angle")[:1]:
        angle = np.abs(flight[f"quasi_rigid_angle_{axis}"])
        times += flight.time[angle > 0.05 * angle.max()].tolist()
    return min(times[-1] or last / 2, 0.8 * last)


def last_cycles(flight: Trajectory, cycles: int = 10) -> float:
    """Returns the start of the last cycles of the thrust, at most a tenth of the flight long, s.

    Args:
        flight: The flight.
        cycles: How many of them.
    """
    starts = [0.9 * float(flight.time[-1])]
    for channel in (s.removesuffix("_command") for s in flight.signals if "_command" in s):
        on = flight[channel] > 0
        starts += flight.time[1:][on[1:] & ~on[:-1]][-cycles - 1 : -cycles].tolist()
    return min(max(starts), float(flight.time[-min(20, len(flight.time))]))


def transient(flight: Trajectory, signals: Sequence[str]) -> float:
    """Returns until when signals are on their way to where they end, and a third longer, s.

    A signal is there once it stays within a fiftieth of its range.

    Args:
        flight: The flight.
        signals: Names of the signals; those that hardly move beside the others do not count.
    """
    ranges = {name: float(np.ptp(flight[name])) for name in signals}
    least, last = 1e-3 * max(ranges.values(), default=0.0), 0.0
    for name, span in ranges.items():
        off = np.abs(flight[name] - flight[name][-1]) > 0.02 * span
        if span > least and off.any():
            last = max(last, float(flight.time[np.flatnonzero(off)[-1]]))
    return min(1.35 * last, float(flight.time[-1]))
