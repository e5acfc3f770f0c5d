"""Bus with small elastic parts: its matrices, its complex modes, its response to torque steps.

D q'' + B q' + C q = -G M,  J omega' + H q'' = M, with H = (J G)^T in shape (3, n): q are n elastic
coordinates, M the torque in the axes of the bus, J the inertia of the undeformed structure about
its centre of mass.  H q'' is the moment with which the elastic parts disturb the bus, N m.

A jump dM of the torque adds 2 Re sum gamma_k xi_k e^(lambda_k t) to q, where
(lambda^2 D + lambda B + C) xi = 0 and gamma is linear in dM.  Products xi_k gamma_k do not depend
on the choice of eigenvectors; those of a repeated eigenvalue do so only in their sum, so they are
added up before anything is done with them.

Source: Sokolov (2004), Guaranteed estimate of the influence of elastic parts, (17), (22)-(24).
"""

import functools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

Array = np.ndarray

# Eigenvalues nearer to each other than this are one, relative.  A structure of equal booms splits
# them by 1e-13; taking two that differ by 1e-9 as one changes a response by 1e-9 |lambda|/sigma.
_REPEATED = 1e-9
_SINGULAR = 1e-9  # least eigenvalue of D over its coordinates' own masses
_SYMMETRY = 1e-9
_PARALLEL = 1e-6  # error of the start of the response when modes have run together
_PARALLEL_MODES = (
    "two motions have the same eigenvalue and the same shape (critical damping), so that modes do "
    "not tell them apart; change a damping or stiffness by a millionth"
)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ElasticModel:
    """A rigid bus with elastic parts, linear and at rest undeformed.

    Equal to itself alone, so that what has been computed of it may be kept.

    Attributes:
        D: Mass matrix of the elastic coordinates with the bus free, shape (n, n).
        B: Damping matrix, shape (n, n).
        C: Stiffness matrix, shape (n, n).
        G: Forcing of the elastic coordinates by the torque, shape (n, 3), no unit for angles.
        H: Moment of the elastic parts on the bus at unit q'', shape (3, n), kg m^2 for angles.
        J: Inertia of the undeformed structure about its centre of mass, shape (3, 3), kg m^2.
        coordinates: Names of the elastic coordinates; q1, q2, ... by default.
        travel: Least deflection at which a coordinate meets a limit, shape (n,), rad or m; inf,
            the default, where there is none.
        scale: What a deflection must be small beside, shape (n,): 1 rad, the default, or for what
            slides its distance from the centre of mass, m.
    """

    D: Array
    B: Array
    C: Array
    G: Array
    H: Array
    J: Array
    coordinates: tuple[str, ...] = ()
    travel: Array | None = None
    scale: Array | None = None

    def __post_init__(self) -> None:
        n = len(self.D)
        shapes = {"D": (n, n), "B": (n, n), "C": (n, n), "G": (n, 3), "H": (3, n), "J": (3, 3)}
        for name, shape in shapes.items():
            array = np.array(getattr(self, name), dtype=float)
            if array.shape != shape or not np.all(np.isfinite(array)):
                raise ValueError(f"{name} must be finite and of shape {shape}, got {array.shape}")
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        if n == 0:
            raise ValueError("there are no elastic coordinates: the bus is all there is")
        names = self.coordinates or tuple(f"q{k + 1}" for k in range(n))
        object.__setattr__(self, "coordinates", names)
        for name, default in (("travel", np.inf), ("scale", 1.0)):
            given = getattr(self, name)
            array = np.full(n, default) if given is None else np.array(given, dtype=float)
            if len(names) != n or array.shape != (n,) or not np.all(array > 0):
                raise ValueError(
                    f"{n} coordinates need {n} names, and {n} travels and scales > 0; got {names}, "
                    f"{name} = {array}"
                )
            array.flags.writeable = False
            object.__setattr__(self, name, array)
        _refuse_indefinite(self)

    @property
    def inertia_fraction(self) -> Array:
        """Share mu of the inertia about each axis that moves elastically, shape (3,).

        H D^-1 H^T/J = mu/(1 - mu) for one elastic coordinate with mu = H A^-1 H^T/J, A its mass
        with the bus held.
        """
        ratio = np.einsum("ei,ie->e", self.H, np.linalg.solve(self.D, self.G))
        return ratio / (1 + ratio)


@dataclass(frozen=True, slots=True, kw_only=True)
class Modes:
    """Complex modes: one of each conjugate pair with Im > 0, and all real eigenvalues.

    Attributes:
        eigenvalues: lambda_k, the slowest oscillation first, shape (k,), 1/s.
        residues: q after a unit jump of each torque is the static deflection plus
            Re sum residues_k e^(lambda_k t), shape (k, n, 3), per N m: 2 xi_k gamma_k for a pair.
            Those of repeated eigenvalues are added up.
        deflection: Static deflection C^-1 G under a unit torque, shape (n, 3), per N m.
    """

    eigenvalues: Array
    residues: Array
    deflection: Array

    @property
    def overdamped(self) -> int:
        """How many eigenvalues are real."""
        return int(np.count_nonzero(np.imag(self.eigenvalues) == 0))

    @property
    def slowest_decay(self) -> float:
        """Decay sigma of the slowest motion, 1/s."""
        return float(-np.max(np.real(self.eigenvalues)))

    def accelerations(self, rows: Array) -> Array:
        """Returns the amplitudes of rows @ q'' after unit jumps, shape (k, m, 3), 1/(N m s^2).

        Args:
            rows: Coefficients of the coordinates, shape (m, n).
        """
        return self.eigenvalues[:, None, None] ** 2 * (np.atleast_2d(rows) @ self.residues)


@functools.lru_cache(maxsize=32)
def find_modes(elastic: ElasticModel) -> Modes:
    """Solves the quadratic eigenproblem and the jumps (24).

    Args:
        elastic: The structure.

    Raises:
        ValueError: If a motion does not die out: the damping matrix leaves it alone; or if two
            modes are one and the same (critical damping to the last digits).
    """
    n = len(elastic.D)
    # In coordinates L^T q, D = L L^T, the mass matrix is the unit one.
    L = np.linalg.cholesky(elastic.D)
    inverse = np.linalg.inv(L)
    stiffness = inverse @ elastic.C @ inverse.T
    damping = inverse @ elastic.B @ inverse.T
    # Velocities over a typical frequency: both halves of an eigenvector are of one size.
    scale = float(np.sqrt(np.trace(stiffness) / n))
    A = np.block([[np.zeros((n, n)), scale * np.eye(n)], [-stiffness / scale, -damping]])
    values, vectors = np.linalg.eig(A)
    static = np.linalg.solve(elastic.C, elastic.G)
    try:
        jumps = np.linalg.solve(vectors, np.r_[L.T @ static, np.zeros((n, 3))].astype(complex))
    except np.linalg.LinAlgError as error:
        raise ValueError(_PARALLEL_MODES) from error
    shapes = inverse.T @ vectors[:n]
    slow = np.real(values) > -1e-12 * np.abs(values)
    if np.any(slow):
        raise ValueError(
            f"{np.count_nonzero(slow)} eigenvalues do not decay, as {values[slow][0]:.6g} 1/s: a "
            f"guaranteed bound needs damping in every motion; {_undamped(elastic)}"
        )
    residues = shapes.T[:, :, None] * jumps[:, None, :]
    pair = np.imag(values) > 0
    residues[pair] *= 2
    kept = np.imag(values) >= 0
    found = _merged(values[kept], residues[kept], static)
    _refuse_parallel_modes(elastic, found)
    return found


def _merged(values: Array, residues: Array, static: Array) -> Modes:
    order = np.lexsort((np.real(values), np.abs(values)))
    values, residues = values[order], residues[order]
    heads: list[int] = []
    for k, value in enumerate(values):
        # Sorted by size: the candidates are the last few.
        near = [h for h in heads[-20:] if abs(values[h] - value) <= _REPEATED * abs(value)]
        if near:
            residues[near[0]] += residues[k]
        else:
            heads.append(k)
    found = Modes(eigenvalues=values[heads], residues=residues[heads], deflection=static)
    for array in (found.eigenvalues, found.residues, found.deflection):
        array.flags.writeable = False
    return found


def _refuse_parallel_modes(elastic: ElasticModel, modes: Modes) -> None:
    """A double eigenvalue with one eigenvector moves as t e^(lambda t), which no sum of modes does.

    The step response must start with q = q' = 0 and q'' = -D^-1 G.
    """
    start = np.linalg.solve(elastic.D, elastic.G)
    for order, expected in ((0, modes.deflection), (2, -start)):
        found = np.einsum("k,knc->nc", modes.eigenvalues**order, modes.residues).real
        if np.max(np.abs(found - expected)) > _PARALLEL * np.max(np.abs(expected)):
            raise ValueError(_PARALLEL_MODES)


def moment_history(
    elastic: ElasticModel,
    *,
    switch_times: Sequence[Array | Sequence[float]],
    levels: Sequence[Array | Sequence[float]],
    times: Array | Sequence[float],
) -> Array:
    """Returns the moment H q'' of the elastic parts under given torques, exactly.

    Args:
        elastic: The structure, undeformed and at rest at t = 0.
        switch_times: Times of the switchings of each of the three channels, ascending, >= 0, s.
        levels: Torque of each channel from t = 0 on and after each switching, one more, N m.
        times: Instants >= 0, shape (m,), s; at a switching the value after it counts.

    Returns:
        Moments in the axes of the bus, shape (m, 3), N m.

    Raises:
        ValueError: If times and levels do not fit together.
    """
    found = find_modes(elastic)
    amplitudes = found.accelerations(elastic.H)  # (k, 3, 3)
    t = np.asarray(times, dtype=float)
    moment = np.zeros((len(t), 3))
    for channel, (at, values) in enumerate(zip(switch_times, levels, strict=True)):
        starts, torque = np.r_[0.0, np.asarray(at, float)], np.asarray(values, float)
        if len(starts) != len(torque) or np.any(np.diff(starts) < 0):
            raise ValueError(
                f"channel {channel}: {len(starts) - 1} switch times, ascending and >= 0, need "
                f"{len(starts)} levels; got {len(torque)}, times {starts[1:]}"
            )
        jumps = np.diff(torque, prepend=0.0)
        # beta of (24): what rings since the latest switching, with all before it.
        beta = np.zeros((len(starts), len(found.eigenvalues)), dtype=complex)
        last = np.zeros(len(found.eigenvalues), dtype=complex)
        for j, jump in enumerate(jumps):
            held = starts[j] - starts[j - 1] if j else 0.0
            last = last * np.exp(found.eigenvalues * held) + jump
            beta[j] = last
        i = np.searchsorted(starts, t, side="right") - 1
        ringing = beta[i] * np.exp(np.outer(t - starts[i], found.eigenvalues))
        moment += np.real(ringing @ amplitudes[:, :, channel])
    return moment


def _refuse_indefinite(elastic: ElasticModel) -> None:
    for name in ("D", "B", "C", "J"):
        matrix = getattr(elastic, name)
        if np.max(np.abs(matrix - matrix.T)) > _SYMMETRY * np.max(np.abs(matrix)):
            raise ValueError(f"{name} must be symmetric")
    # H A^-1 H^T/J -> 1 as the bus loses its inertia: D against the masses with the bus held.
    masses = np.diag(elastic.D + elastic.G @ elastic.H)
    scale = np.sqrt(np.maximum(masses, np.finfo(float).tiny))
    least = float(np.linalg.eigvalsh(elastic.D / np.outer(scale, scale))[0])
    if least <= _SINGULAR:
        raise ValueError(
            f"D is not positive definite: its least eigenvalue is {least:.2g} of the masses, limit "
            f"{_SINGULAR}; the bus has no inertia of its own about some axis (a collinear rod), or "
            "two elastic coordinates move the same masses"
        )
    for name, limit in (("J", _SINGULAR), ("C", 0.0)):
        matrix = getattr(elastic, name)
        least = float(np.linalg.eigvalsh(matrix)[0])
        if least <= limit * np.max(np.abs(matrix)):
            raise ValueError(f"{name} must be positive definite; its least eigenvalue is {least}")
    least = float(np.linalg.eigvalsh(elastic.B)[0])
    if least < -_SYMMETRY * np.max(np.abs(elastic.B)):
        raise ValueError(f"B must not drive the motion; its least eigenvalue is {least}")


def _undamped(elastic: ElasticModel) -> str:
    none = np.diag(elastic.B) == 0
    names = [name for name, bare in zip(elastic.coordinates, none, strict=True) if bare]
    return f"without damping: {', '.join(names)}" if names else "its damping is too small"
