"""Which readings of a flight belong in one plot: angles, rates, directions, boom tips."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from spacecraft_sim.trajectory import Trajectory

Role = Literal["position", "rate", "tip"]
STILL = 1e-3  # share of the largest swing of a group below which a signal is left out


@dataclass(frozen=True, slots=True, kw_only=True)
class Group:
    """Readings of one kind and unit, those that move at all.

    Attributes:
        name: One word, for paths.
        title: What they are.
        unit: Their unit; empty for a pure number.
        role: What they are to the motion.
        signals: Their names.
        labels: Their names in a key.
        size: The largest magnitude, or range of a tip, in flights that are known.
    """

    name: str
    title: str
    unit: str
    role: Role
    signals: tuple[str, ...]
    labels: tuple[str, ...]
    size: float


_VECTORS: tuple[tuple[str, str, Role], ...] = (
    ("attitude", "Attitude of the bus", "position"),
    ("quasi_rigid_angle", "Quasi-rigid angle", "position"),
    ("rate", "Rate of the bus", "rate"),
    ("quasi_rigid_rate", "Quasi-rigid rate", "rate"),
)


def groups(
    flights: Sequence[Trajectory], booms: Sequence[str], vectors: Sequence[str] = ("s2", "s3")
) -> tuple[Group, ...]:
    """Returns the groups of readings that all flights share.

    Args:
        flights: The flights.
        booms: Names of the booms.
        vectors: Names of the fixed directions that are shown; of three orthogonal ones two say all.
    """
    names = [n for n in flights[0].signals if all(n in flight.signals for flight in flights)]
    found = []
    for kind, title, role in _VECTORS:
        axes = {f"{kind}_{axis}": axis for axis in "xyz"}
        found.append((kind, title, role, {n: axes[n] for n in axes if n in names}))
    wanted = {f"{vector}_{axis}": f"{vector} {axis}" for vector in vectors for axis in "xyz"}
    directions = {n: label for n, label in wanted.items() if n in names}
    found.append(("direction", "Fixed directions in the body", "position", directions))
    joints = {n: n.replace("_", " ") for n in names if f"{n}_rate" in names}
    found.append(("joint_angle", "Joint angles", "position", joints))
    rates = {f"{n}_rate": label for n, label in joints.items()}
    found.append(("joint_rate", "Joint rates", "rate", rates))
    tips = {f"{boom}_tip_{axis}": f"{boom} {axis}" for boom in booms for axis in "yz"}
    known = {n: label for n, label in tips.items() if n in names}
    found.append(("tips", "Boom tips, deflection", "tip", known))
    made = (_group(flights, *part) for part in found)
    return tuple(group for group in made if group)


def _group(
    flights: Sequence[Trajectory], name: str, title: str, role: Role, labels: dict[str, str]
) -> Group | None:
    """The group of those signals that swing, or stand away from zero, beside the others."""
    size = np.ptp if role == "tip" else _peak
    largest = {n: max(float(size(flight[n])) for flight in flights) for n in labels}
    least = STILL * max(largest.values(), default=0.0)
    kept = {n: label for n, label in labels.items() if largest[n] >= least}
    if not kept:
        return None
    units = [flights[0].units[n] for n in kept]
    return Group(
        name=name,
        title=title,
        unit=units[0],
        role=role,
        signals=tuple(kept),
        labels=tuple(kept.values()),
        size=max(largest.values()),
    )


def _peak(value: np.ndarray) -> float:
    return float(np.abs(value).max())
