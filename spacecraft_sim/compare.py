"""Full plant against reduced model, and both against the guarantees."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spacecraft_sim.guarantee import Guarantee, Verdict
from spacecraft_sim.trajectory import Trajectory


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """How far one signal of two flights differs at their common instants.

    Attributes:
        signal: Its name.
        unit: Its unit.
        max_error: Largest absolute difference.
        rms_error: Root mean square difference.
    """

    signal: str
    unit: str
    max_error: float
    rms_error: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """The outcome of a scenario.

    Attributes:
        verdicts: Of each guarantee on the full plant; where theory predicts no figure, `predicted`
            is the reduced model's.
        reduced: The same guarantees' verdicts on the reduced model.
        differences: Signal by signal.
    """

    verdicts: tuple[Verdict, ...]
    reduced: tuple[Verdict, ...]
    differences: tuple[Difference, ...]


def compare(
    measured: Trajectory, predicted: Trajectory, guarantees: Sequence[Guarantee]
) -> Comparison:
    """Checks the guarantees on both flights and takes the difference of their signals.

    Args:
        measured: Flight of the full plant.
        predicted: Flight of the reduced model.
        guarantees: What is claimed.
    """
    full = [guarantee.check(measured) for guarantee in guarantees]
    reduced = tuple(guarantee.check(predicted) for guarantee in guarantees)
    verdicts = tuple(
        v if v.predicted is not None else replace(v, predicted=r.measured)
        for v, r in zip(full, reduced, strict=True)
    )
    return Comparison(
        verdicts=verdicts, reduced=reduced, differences=differences(measured, predicted)
    )


def differences(measured: Trajectory, predicted: Trajectory) -> tuple[Difference, ...]:
    """Compares the signals that two flights share, at the instants that both have.

    Args:
        measured: One flight.
        predicted: The other.
    """
    _, i, j = np.intersect1d(measured.time, predicted.time, return_indices=True)
    found = []
    for name in measured.signals:
        if name in predicted.signals:
            error = measured[name][i] - predicted[name][j]
            found.append(
                Difference(
                    signal=name,
                    unit=measured.units[name],
                    max_error=float(np.max(np.abs(error))),
                    rms_error=float(np.sqrt(np.mean(error**2))),
                )
            )
    return tuple(found)
