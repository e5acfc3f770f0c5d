"""Reduced model -> relay system: complex modes, and readings as rows over them."""

from collections.abc import Sequence

import numpy as np

from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.relay_system import RelaySystem, Row

Array = np.ndarray


def system_of(
    model: ReducedModel,
    *,
    channel: str,
    switching: dict[str, float],
    thresholds: tuple[float, ...] = (),
    levels: tuple[float, ...],
) -> RelaySystem:
    """Builds a relay system from a reduced model with one rigid coordinate.

    Args:
        model: The reduced model.
        channel: The input that is the relay's.
        switching: s as a combination of readings: coefficient by reading name.
        thresholds: Values of |s| at which the level changes, rad/s.
        levels: Acceleration of the rigid coordinate in each band, rad/s^2.

    Raises:
        ValueError: If the model has several rigid coordinates.
    """
    eigenvalues, drive, shapes = modal_form(model, channel)
    rows = {name: row_of(model, name, shapes) for name in switching}
    s = Row(
        angle=sum(k * rows[name].angle for name, k in switching.items()),
        rate=sum(k * rows[name].rate for name, k in switching.items()),
        modes=tuple(
            np.sum(
                [k * np.array(rows[name].modes) for name, k in switching.items()], axis=0
            ).tolist()
        ),
    )
    return RelaySystem(
        switching=s, thresholds=thresholds, levels=levels, eigenvalues=eigenvalues, drive=drive
    )


def modal_form(
    model: ReducedModel, channel: str
) -> tuple[tuple[complex, ...], tuple[complex, ...], Array]:
    """Returns eigenvalues, drive at unit rigid acceleration, and complex shapes of the modes.

    Args:
        model: The reduced model, underdamped, with one rigid coordinate.
        channel: The input.

    Raises:
        ValueError: If the model has several rigid coordinates or an overdamped mode.
    """
    k = len(model.frequencies)
    if len(model.B) - k != 1:
        raise ValueError(f"a relay system has one rigid coordinate, the model {len(model.B) - k}")
    B = model.B[:, model.inputs.index(channel)]
    A = np.block([[np.zeros((k, k)), np.eye(k)], [-np.diag(model.frequencies**2), -model.D]])
    values, vectors = np.linalg.eig(A)
    upper = np.imag(values) > 0
    if np.count_nonzero(upper) != k:
        raise ValueError("an elastic mode is overdamped; the modal form needs conjugate pairs")
    drive = (np.linalg.inv(vectors) @ np.r_[np.zeros(k), B[1:]])[upper] / B[0]
    return tuple(values[upper].tolist()), tuple(drive.tolist()), vectors[:, upper]


def real_form(system: RelaySystem, rows: Sequence[Row]) -> tuple[Array, Array, Array]:
    """Returns A, b, C of x' = A x + b u, y = C x over x = (beta, beta', Re z_1, Im z_1, ...).

    Args:
        system: The system.
        rows: The rows of C.
    """
    n = 2 + 2 * len(system.eigenvalues)
    A, b, C = np.zeros((n, n)), np.zeros(n), np.zeros((len(rows), n))
    A[0, 1], b[1] = 1.0, 1.0
    for k, (x, g) in enumerate(zip(system.eigenvalues, system.drive, strict=True)):
        i = slice(2 + 2 * k, 4 + 2 * k)
        A[i, i] = [[x.real, -x.imag], [x.imag, x.real]]
        b[i] = g.real, g.imag
    for i, row in enumerate(rows):
        C[i, :2] = row.angle, row.rate
        for k, d in enumerate(row.modes):
            C[i, 2 + 2 * k : 4 + 2 * k] = 2 * d.real, -2 * d.imag
    return A, b, C


def row_of(model: ReducedModel, reading: str, shapes: Array) -> Row:
    """Returns a reading as a row over the states of a relay system.

    Args:
        model: The reduced model.
        reading: Name of the reading.
        shapes: Complex modal shapes, as `modal_form` gives them.
    """
    n = len(model.B)
    C = model.C[list(model.outputs).index(reading)]
    return Row(
        angle=float(C[0]),
        rate=float(C[n]),
        modes=tuple((np.r_[C[1:n], C[n + 1 :]] @ shapes).tolist()),
    )
