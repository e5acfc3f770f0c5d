"""Equations of motion with named inputs and readings, and what is linear about them."""

from collections.abc import Callable, Sequence
from typing import NamedTuple, Protocol

import numpy as np

Array = np.ndarray
_STEP = 1e-3  # of the differences of fourth order: 1e-12 of their error, 1e-13 of rounding


class Dynamics(Protocol):
    """A plant as a function; its arrays may have leading axes, for many motions at once."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the torques."""
        ...

    @property
    def units(self) -> dict[str, str]:
        """Names of the readings with their SI units."""
        ...

    def rates(self, x: Array, u: Array) -> Array:
        """Returns the time derivative of the state, shape (..., n).

        Args:
            x: State, shape (..., n).
            u: Torques, shape (..., nu), N m.
        """
        ...

    def readings(self, x: Array) -> Array:
        """Returns the readings, in the order of `units`, shape (..., ny).

        Args:
            x: State, shape (..., n).
        """
        ...


class LinearPlant(NamedTuple):
    """x' = A x + B u, y = y0 + C x near an equilibrium; x counts from there.

    Attributes:
        A: Shape (n, n), 1/s.
        B: Shape (n, nu).
        C: Shape (ny, n).
        y0: Readings at the equilibrium, shape (ny,).
        inputs: Names of the inputs.
        outputs: Names of the readings.
    """

    A: Array
    B: Array
    C: Array
    y0: Array
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]


def linear_plant(
    dynamics: Dynamics, *, state: Array, torques: Array, basis: Array | None = None
) -> LinearPlant:
    """Linearises a plant at an equilibrium by differencing its equations.

    Args:
        dynamics: The plant.
        state: The equilibrium, shape (n,).
        torques: The torques that hold it there, shape (nu,), N m.
        basis: Columns that span what may change, shape (n, k), where the state has more numbers
            than freedoms; everything if left out.

    Raises:
        ValueError: If it is no equilibrium.
    """
    x, u = np.asarray(state, dtype=float), np.asarray(torques, dtype=float)
    N = np.eye(len(x)) if basis is None else basis
    inverse = np.linalg.pinv(N)
    drift = inverse @ dynamics.rates(x, u)
    if np.max(np.abs(drift)) > 1e-6 * (1 + np.max(np.abs(x))):
        raise ValueError(f"no equilibrium: the state moves at {np.max(np.abs(drift)):.3g} 1/s")
    k = N.shape[1]
    return LinearPlant(
        A=inverse @ jacobian(lambda z: dynamics.rates(x + N @ z, u), np.zeros(k)),
        B=inverse @ jacobian(lambda v: dynamics.rates(x, v), u),
        C=jacobian(lambda z: dynamics.readings(x + N @ z), np.zeros(k)),
        y0=dynamics.readings(x),
        inputs=dynamics.inputs,
        outputs=tuple(dynamics.units),
    )


def jacobian(function: Callable[[Array], Sequence[float] | Array], x: Array) -> Array:
    """Returns the derivative of a smooth function of order-one scale, shape (m, n).

    Args:
        function: Takes an array of shape (n,) to one of shape (m,).
        x: Where, shape (n,).
    """
    columns = []
    for e in _STEP * np.eye(len(x)):
        near, far = (
            np.asarray(function(x + k * e)) - np.asarray(function(x - k * e)) for k in (1, 2)
        )
        columns.append((8 * near - far) / (12 * _STEP))
    if not columns:
        return np.zeros((len(function(x)), 0))
    return np.stack(columns, axis=-1)
