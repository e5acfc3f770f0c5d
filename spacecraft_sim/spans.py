"""Parts of a flight worth a closer look: until it has settled, and its last cycles."""

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
