"""Guaranteed bounds of what the elastic parts do to a bus under relay torques with a dwell.

Each channel's torque is +-M0 and keeps a value for at least the dwell.  Whatever the controller
does, when all channels have switched for long:

- the moment H q'' of the elastic parts stays below
  M_e <= 2 sum_k |lambda_k|^2 |(H_e, xi_k)| beta_k*,
  beta_k* = sum_zeta |gamma_k(2 M0_zeta)| / (1 - e^(Re lambda_k dwell_zeta));
- a combination (l, q) of deflections swings by no more than
  A_m <= 2 sum_k |(l, xi_k)| beta_k* + sum_zeta |(l, C^-1 G e_zeta)| M0_zeta
  to either side.

By superposition both cover channels that switch in any order, and three-level relays {0, +-M0}
that stay on for the dwell and off for any time.  A bound that asks nothing of the switching is the
L1 norm of the response, |s(0)| + integral |s'| of a torque step; the smaller of the two holds.
From undeformed rest both hold for all t >= 0.

A bound of zero (an axis that nothing excites) is a statement of the linear theory: products of
small motions that it leaves out are not zero there.

Source: Sokolov (2004), Guaranteed estimate of the influence of elastic parts, (26), (27), with
H_e = (e, sum m_i rho_i x H_is) and contributions of a repeated eigenvalue added up before moduli
are taken; the L1 bound is not in the paper.
"""

import functools
from dataclasses import dataclass

import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.elastic_mjcf import elastic_model
from spacecraft_sim.elastic_modes import ElasticModel, Modes, find_modes
from spacecraft_sim.relay_channels import per_channel
from spacecraft_sim.total_variation import total_variation
from spacecraft_sim.worst_case import WorstCase, worst_case

Array = np.ndarray

__all__ = [
    "ElasticModel", "Influence", "WorstCase", "elastic_model", "influence", "least_dwell",
    "worst_case",
]  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Influence:
    """Bounds of the moment and of the deflections.

    Attributes:
        moment: M_e about each axis of the bus, shape (3,), N m; inf where `refused` says why.
        moment_l1: The same for any switching, shape (3,), N m.
        eigenvalues: lambda_k, one of each conjugate pair, and real ones, shape (k,), 1/s.
        refused: Why `moment` is inf, or nothing.
        torque: M0 of each channel, shape (3,), N m.
        dwell: Least time between switchings of each channel, shape (3,), s.
        modes: The modes.
    """

    moment: Array
    moment_l1: Array
    eigenvalues: Array
    refused: str
    torque: Array
    dwell: Array
    modes: Modes

    @property
    def bound(self) -> Array:
        """The smaller bound about each axis, shape (3,), N m."""
        return np.minimum(self.moment, self.moment_l1)

    def deflection(self, direction: Array | list[float]) -> float:
        """Returns A_m: half the range over which (direction, q) swings in the end, rad or m.

        Args:
            direction: l, coefficients of the elastic coordinates, shape (n,).

        Returns:
            The bound; inf where `refused` says why.

        Raises:
            ValueError: If the direction has another number of coefficients.
        """
        row = self._row(direction)
        swing = row @ self.modes.residues  # (k, 3)
        lean = np.abs(row @ self.modes.deflection) @ self.torque  # max_M |(l, C^-1 G M)|
        return float(_printed(self.modes.eigenvalues, swing, self.torque, self.dwell) + lean)

    def deflection_l1(self, direction: Array | list[float]) -> float:
        """Returns a bound of |(direction, q)| for any switching, rad or m.

        Args:
            direction: l, coefficients of the elastic coordinates, shape (n,).

        Raises:
            ValueError: If the direction has another number of coefficients.
        """
        swing = self._row(direction) @ self.modes.residues  # (k, 3); q = 0 at the step
        return float(total_variation(self.modes.eigenvalues, swing) @ self.torque)

    def deflections(self, rows: Array) -> Array:
        """Returns the smaller bound of |(row, q)| for each row, shape (m,), rad or m.

        Args:
            rows: Coefficients of the elastic coordinates, shape (m, n).
        """
        swings = rows @ self.modes.residues  # (k, m, 3)
        leans = np.abs(rows @ self.modes.deflection) @ self.torque
        printed = _printed(self.modes.eigenvalues, swings, self.torque, self.dwell) + leans
        return np.minimum(printed, total_variation(self.modes.eigenvalues, swings) @ self.torque)

    def bending_rates(self, rows: Array) -> Array:
        """Returns the smaller bound of |(row, q')| for each row, shape (m,), rad/s or m/s.

        Args:
            rows: Coefficients of the elastic coordinates, shape (m, n).
        """
        eigenvalues = self.modes.eigenvalues
        swings = eigenvalues[:, None, None] * (rows @ self.modes.residues)  # (k, m, 3)
        printed = _printed(eigenvalues, swings, self.torque, self.dwell)
        return np.minimum(printed, total_variation(eigenvalues, swings) @ self.torque)

    def _row(self, direction: Array | list[float]) -> Array:
        row, n = np.asarray(direction, dtype=float), len(self.modes.deflection)
        if row.shape != (n,):
            raise ValueError(f"a direction has one coefficient a coordinate, {n}; got {row.shape}")
        return row


def influence(
    elastic: ElasticModel,
    *,
    torque: float | Array | list[float],
    dwell: float | Array | list[float],
) -> Influence:
    """Bounds what the elastic parts do to the bus.

    Args:
        elastic: The structure.
        torque: M0, the torque of each channel or of all, N m.
        dwell: Least time between switchings of each channel or of all, s; inf for one switching.

    Returns:
        The bounds.

    Raises:
        ValueError: If torque or dwell is not positive, or a motion does not die out.
    """
    M0 = per_channel("torque", torque)
    hold = per_channel("dwell", dwell, infinite=True)
    modes = find_modes(elastic)
    refused = (
        f"{modes.overdamped} real eigenvalues (overdamped parts): the printed bound needs "
        "conjugate pairs alone; use the L1 bound"
        if modes.overdamped
        else ""
    )
    return Influence(
        moment=_printed(modes.eigenvalues, modes.accelerations(elastic.H), M0, hold),
        moment_l1=_response_norms(elastic) @ M0,
        eigenvalues=modes.eigenvalues,
        refused=refused,
        torque=M0,
        dwell=hold,
        modes=modes,
    )


@functools.lru_cache(maxsize=32)
def _response_norms(elastic: ElasticModel) -> Array:
    """|s(0)| + integral |s'| of H q'' about each axis for a unit step of each torque, (3, 3)."""
    modes = find_modes(elastic)
    start = np.abs(elastic.H @ np.linalg.solve(elastic.D, elastic.G))
    return start + total_variation(modes.eigenvalues, modes.accelerations(elastic.H))


def least_dwell(
    elastic: ElasticModel, *, torque: float | Array | list[float], axis: int, limit: float
) -> float:
    """Returns the least dwell, the same in all channels, with M_e <= limit about an axis, s.

    Args:
        elastic: The structure.
        torque: M0, the torque of each channel or of all, N m.
        axis: 0, 1 or 2.
        limit: Moment that M_e may reach, N m.

    Returns:
        The dwell; inf if no dwell is enough, or parts are overdamped.

    Raises:
        ValueError: If torque or limit is not positive, or a motion does not die out.
    """
    from scipy.optimize import brentq  # slow to import, and seldom needed

    positive(limit=limit)
    M0, modes = per_channel("torque", torque), find_modes(elastic)
    acceleration = modes.accelerations(elastic.H[axis])  # (k, 1, 3)

    def excess(log_dwell: float) -> float:
        hold = np.full(3, np.exp(log_dwell))
        return float(_printed(modes.eigenvalues, acceleration, M0, hold)[0]) / limit - 1

    decay = -np.real(modes.eigenvalues)
    # M_e falls with the dwell: as 1/dwell at first, and not at all after e^-40.
    low, high = np.log(1e-9 / np.max(decay)), np.log(40 / np.min(decay))
    if modes.overdamped or excess(high) > 0:
        return np.inf
    if excess(low) <= 0:
        return 0.0
    return float(np.exp(brentq(excess, float(low), float(high), xtol=1e-13)))  # pyright: ignore


def _printed(eigenvalues: Array, amplitudes: Array, torque: Array, dwell: Array) -> Array:
    """Sum over modes of |a_k(2 M0)|/(1 - e^(Re lambda dwell)), (26); a of shape (k, ..., 3)."""
    if np.any(np.imag(eigenvalues) == 0):
        return np.full(amplitudes.shape[1:-1], np.inf)
    decay = -np.expm1(np.outer(np.real(eigenvalues), dwell))  # (k, 3)
    return np.einsum("k...c,kc,c->...", np.abs(amplitudes), 1 / decay, 2 * torque)
