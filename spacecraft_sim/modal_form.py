"""Reduced model -> relay system: complex modes, and readings as rows over them."""

from collections.abc import Sequence

import numpy as np

from spacecraft_sim.checks import choices
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
    """Builds a relay system from a reduced model and the one rigid coordinate a channel drives.

    Args:
        model: The reduced model.
        channel: The input that is the relay's.
        switching: s as a combination of readings: coefficient by reading name.
        thresholds: Values of |s| at which the level changes, rad/s.
        levels: Acceleration of the rigid coordinate in each band, rad/s^2.

    Raises:
        ValueError: If the channel drives several rigid coordinates, or a mode is overdamped.
    """
    eigenvalues, drive, shapes = modal_form(model, channel)
    coordinate = driven_coordinate(model, channel)
    rows = {name: row_of(model, name, shapes, coordinate) for name in switching}
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
        model: The reduced model, underdamped.
        channel: The input.

    Raises:
        ValueError: If the channel drives several rigid coordinates, or a mode is overdamped.
    """
    k, coordinate = len(model.frequencies), driven_coordinate(model, channel)
    B = model.B[:, model.inputs.index(channel)]
    A = np.block([[np.zeros((k, k)), np.eye(k)], [-np.diag(model.frequencies**2), -model.D]])
    values, vectors = np.linalg.eig(A)
    upper = np.imag(values) > 0
    if np.count_nonzero(upper) != k:
        raise ValueError("an elastic mode is overdamped; the modal form needs conjugate pairs")
    drive = (np.linalg.inv(vectors) @ np.r_[np.zeros(k), B[len(B) - k :]])[upper] / B[coordinate]
    return tuple(values[upper].tolist()), tuple(drive.tolist()), vectors[:, upper]


def driven_coordinate(model: ReducedModel, channel: str) -> int:
    """Returns the index of the rigid coordinate that a channel drives.

    Args:
        model: The reduced model.
        channel: The input.

    Raises:
        ValueError: If it drives none, or several.
    """
    if channel not in model.inputs:
        raise ValueError(choices("input", channel, model.inputs, where="the reduced model"))
    rigid = len(model.B) - len(model.frequencies)
    push = np.abs(model.B[:rigid, model.inputs.index(channel)])
    driven = np.flatnonzero(push > 1e-9 * push.max(initial=0.0))
    if len(driven) != 1:
        raise ValueError(
            f"{channel!r} drives {len(driven)} rigid coordinates of {rigid}; a relay system has one"
        )
    return int(driven[0])


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


def row_of(model: ReducedModel, reading: str, shapes: Array, coordinate: int = 0) -> Row:
    """Returns a reading as a row over the states of a relay system.

    Args:
        model: The reduced model.
        reading: Name of the reading.
        shapes: Complex modal shapes, as `modal_form` gives them.
        coordinate: Index of the rigid coordinate, as `driven_coordinate` gives it.

    Raises:
        ValueError: If there is no such reading.
    """
    n, k = len(model.B), len(model.frequencies)
    if reading not in model.outputs:
        raise ValueError(choices("reading", reading, model.outputs, where="the reduced model"))
    C = model.C[list(model.outputs).index(reading)]
    return Row(
        angle=float(C[coordinate]),
        rate=float(C[n + coordinate]),
        modes=tuple((np.r_[C[n - k : n], C[2 * n - k :]] @ shapes).tolist()),
    )
