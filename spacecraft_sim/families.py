"""Signals of a flight that are drawn together, for machines without a quasi-rigid motion."""

from collections.abc import Sequence

from spacecraft_sim.trajectory import Trajectory


def is_quasi_rigid(flight: Trajectory) -> bool:
    """Returns whether a flight has a quasi-rigid angle, as a spacecraft with booms has.

    Args:
        flight: Of the reduced plant.
    """
    return any(name.startswith("quasi_rigid_angle") for name in flight.signals)


def families(
    flight: Trajectory, vectors: Sequence[str] = ("s2", "s3")
) -> dict[str, tuple[str, ...]]:
    """Returns the places, rates and torques of an arm or of a turning body, by heading.

    Args:
        flight: Of the full plant.
        vectors: Names of the fixed directions that are shown; of three orthogonal ones two say all.
    """
    names = list(flight.signals)
    directions = [n for n in names if n[:-2] in vectors and n[-2:] in ("_x", "_y", "_z")]
    angles = [n for n in names if f"{n}_rate" in flight.signals]
    rates = [n for n in names if n.endswith("_rate") or n.startswith("rate_")]
    torques = [n for n in names if f"{n}_command" in flight.signals]
    places = ("Directions", directions) if directions else ("Joint angles", angles)
    return {title: tuple(n) for title, n in (places, ("Rates", rates), ("Torques", torques))}
