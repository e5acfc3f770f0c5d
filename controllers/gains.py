"""What gains and reference vectors must be, said in the same words by every law."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from spacecraft_sim.checks import positive

Numbers = tuple[float, ...]
Matrix = tuple[Numbers, ...]
_RIGHT = 1e-6  # how far from unit length or right angles given vectors may be: six digits


def positive_entries(name: str, values: Sequence[float], n: int) -> Numbers:
    """Returns the diagonal of a gain matrix, n positive numbers.

    Args:
        name: Name of the gain.
        values: Its diagonal.
        n: How many there must be.

    Raises:
        ValueError: Saying which is not positive, or that there are more or fewer.
    """
    _counted(name, values, n)
    named: dict[str, Any] = {f"{name}[{k}]": x for k, x in enumerate(values)}
    positive(**named)
    return tuple(float(x) for x in values)


def finite_entries(name: str, values: Sequence[float], n: int) -> Numbers:
    """Returns n finite numbers.

    Args:
        name: Name of the vector.
        values: Its entries.
        n: How many there must be.

    Raises:
        ValueError: Saying which is not finite, or that there are more or fewer.
    """
    _counted(name, values, n)
    for k, x in enumerate(values):
        if not math.isfinite(x):
            raise ValueError(f"{name}[{k}] = {x!r} must be finite")
    return tuple(float(x) for x in values)


def positive_definite(
    name: str, values: Sequence[float] | Sequence[Sequence[float]], n: int
) -> Matrix:
    """Returns a symmetric positive definite gain matrix by rows.

    Args:
        name: Name of the gain.
        values: Its diagonal, or its rows.
        n: Its size.

    Raises:
        ValueError: If it is not symmetric or not positive definite, with the value at fault.
    """
    K = np.array(values, dtype=float)
    if K.ndim == 1:
        K = np.diag(positive_entries(name, K.tolist(), n))
    if K.shape != (n, n):
        raise ValueError(f"{name} has the shape {K.shape}; it must be {n} numbers or {n} x {n}")
    if not np.all(np.isfinite(K)):
        raise ValueError(f"{name} = {K.tolist()} must be finite")
    skew = np.abs(K - K.T)
    if np.max(skew) > 1e-12 * np.max(np.abs(K)):
        i, j = np.unravel_index(np.argmax(skew), skew.shape)
        raise ValueError(
            f"{name} must be symmetric: {name}[{i}][{j}] = {K[i, j]:.6g}, "
            f"{name}[{j}][{i}] = {K[j, i]:.6g}"
        )
    if (least := float(np.linalg.eigvalsh(K)[0])) <= 0:
        raise ValueError(f"{name} must be positive definite: its least eigenvalue is {least:.6g}")
    return tuple(map(tuple, ((K + K.T) / 2).tolist()))


def orthogonal_axes(**vectors: Sequence[float]) -> tuple[Numbers, ...]:
    """Returns orthogonal unit vectors, cleaned of the rounding of their digits.

    Args:
        **vectors: The vectors by name, each of three numbers.

    Raises:
        ValueError: Saying which is not a unit vector, or which two are not orthogonal.
    """
    rows = [np.array(finite_entries(name, v, 3)) for name, v in vectors.items()]
    for name, row in zip(vectors, rows, strict=True):
        if abs((length := math.hypot(*row)) - 1) > _RIGHT:
            unit = ", ".join(f"{x:.8f}" for x in row / length) if length else "none"
            raise ValueError(
                f"{name} must be a unit vector: its length is {length:.9g}; nearest: ({unit})"
            )
    names = list(vectors)
    for i, a in enumerate(rows):
        for j, b in enumerate(rows[:i]):
            if abs(product := float(a @ b)) > _RIGHT:
                raise ValueError(
                    f"{names[j]} and {names[i]} must be orthogonal: "
                    f"{names[j]} . {names[i]} = {product:.6g}"
                )
    # The nearest orthonormal set: the polar factor.
    U, _, Vt = np.linalg.svd(np.array(rows), full_matrices=False)
    return tuple(map(tuple, (U @ Vt).tolist()))


def _counted(name: str, values: Sequence[float], n: int) -> None:
    if len(values) != n:
        raise ValueError(f"{name} has {len(values)} entries; there must be {n}")
