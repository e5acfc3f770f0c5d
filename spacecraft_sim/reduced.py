"""The reduced plant: the rigid motion and a few elastic modes, propagated exactly.

q'' = B_r u for the rigid coordinates, z' = lambda z + b u for each elastic eigenvalue; y is linear
in both.  The inputs are linear in time over a piece, for which the solution is a closed form.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from dm_control.rl import control

from spacecraft_sim.beam import Galerkin
from spacecraft_sim.checks import choices
from spacecraft_sim.scenario import Initial

Array = np.ndarray
Start = Callable[[Initial], tuple[Array, Array]]  # full coordinates and velocities, each (nv,)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReducedModel:
    """A truncated linear model.

    The state is (r, r', eta, eta'): rigid coordinates and modal coordinates of unit modal mass.

    Attributes:
        B: Accelerations of (r, eta) at unit input, shape (n, nu).
        D: Modal damping of eta, shape (k, k), 1/s.
        frequencies: Undamped frequencies of the modes kept, shape (k,), rad/s.
        C: Readings over the state, shape (ny, 2 n).
        y0: Readings at rest, shape (ny,).
        outputs: Reading names with their units.
        inputs: Input names.
        projection: Takes full coordinates or velocities to (r, eta), shape (n, nv).
        neglected: Frequencies of the modes left out, rad/s.
        inertia: Rigid inertia that belongs to each rigid coordinate, shape (n - k,).
    """

    B: Array
    D: Array
    frequencies: Array
    C: Array
    y0: Array
    outputs: dict[str, str]
    inputs: tuple[str, ...]
    projection: Array
    neglected: Array
    inertia: Array

    @property
    def slowest_decay(self) -> float:
        """Decay of the slowest elastic motion, 1/s; inf without elastic modes."""
        k = len(self.frequencies)
        if k == 0:
            return math.inf
        A = np.block([[np.zeros((k, k)), np.eye(k)], [-np.diag(self.frequencies**2), -self.D]])
        return float(-np.max(np.real(np.linalg.eigvals(A))))

    def gain(self, channel: str, output: str) -> float:
        """Returns how fast a unit input accelerates a rate reading, neglecting elasticity.

        Args:
            channel: Input name.
            output: Name of a rate reading, such as `quasi_rigid_rate_z`.

        Raises:
            ValueError: If a name does not exist.
        """
        if channel not in self.inputs:
            raise ValueError(choices("input", channel, self.inputs, where="the reduced model"))
        if output not in self.outputs:
            raise ValueError(choices("output", output, self.outputs, where="the reduced model"))
        n, rigid = len(self.B), len(self.B) - len(self.frequencies)
        row = self.C[list(self.outputs).index(output), n : n + rigid]
        return float(row @ self.B[:rigid, self.inputs.index(channel)])


def double_integrator(*, inertia: float = 1.0) -> ReducedModel:
    """Returns the plant on which the theorems are proved: J r'' = u + f, no elasticity.

    Args:
        inertia: J, kg m^2.
    """
    outputs = _planar_outputs([])
    return ReducedModel(
        B=np.full((1, 2), 1 / inertia),
        D=np.zeros((0, 0)),
        frequencies=np.zeros(0),
        C=np.array([[1, 0], [0, 1], [0, inertia], [1, 0], [0, 1]], dtype=float),
        y0=np.zeros(len(outputs)),
        outputs=outputs,
        inputs=("thruster_z", "disturbance_z"),
        projection=np.eye(1),
        neglected=np.zeros(0),
        inertia=np.array([inertia]),
    )


def truncate(
    *,
    M: Array,
    D: Array,
    K: Array,
    B: Array,
    C: Array,
    y0: Array,
    outputs: dict[str, str],
    inputs: tuple[str, ...],
    rigid: Sequence[int],
    modes: int,
) -> ReducedModel:
    """Keeps the rigid motion and the lowest elastic modes that the inputs can reach.

    The rigid coordinates are the quasi-rigid ones, q_b + M_bb^-1 M_bf q_f: the modes are
    M-orthogonal to them, so the elastic part falls out of their equation.

    Args:
        M: Mass matrix, shape (nv, nv).
        D: Damping matrix, shape (nv, nv).
        K: Stiffness matrix, shape (nv, nv).
        B: Generalised forces at unit input, shape (nv, nu).
        C: Readings over positions and velocities, shape (ny, 2 nv).
        y0: Readings at rest, shape (ny,).
        outputs: Reading names with their units, in the order of `C`.
        inputs: Input names, in the order of `B`.
        rigid: Indices of the rigid degrees of freedom.
        modes: How many elastic modes to keep.

    Raises:
        ValueError: If there are fewer modes, or the rigid motion is not free.
    """
    rigid = list(rigid)
    if not rigid or np.any(K[rigid]) or np.any(D[rigid]):
        raise ValueError("the bus must move freely: no joint, or a spring or damper on it")
    shapes_rigid = np.eye(len(M))[:, rigid]
    inertia = M[np.ix_(rigid, rigid)]
    squares, shapes = _eigenmodes(K, M)
    elastic = np.arange(len(rigid), len(M))  # eigh sorts; the rigid motion comes first
    participation = np.linalg.norm(shapes[:, elastic].T @ B, axis=1)
    reached = elastic[participation > 1e-9 * max(participation.max(initial=0.0), 1e-300)]
    if modes > len(reached):
        raise ValueError(
            f"reduced.modes = {modes}: the inputs reach {len(reached)} elastic modes of this model"
        )
    kept = reached[:modes]
    neglected = np.setdiff1d(elastic, kept)
    frequencies = np.sqrt(np.maximum(squares, 0.0))
    basis = np.hstack([shapes_rigid, shapes[:, kept]])
    projection = np.vstack([np.linalg.solve(inertia, M[rigid]), shapes[:, kept].T @ M])
    zero = np.zeros_like(basis)
    return ReducedModel(
        B=np.vstack([np.linalg.solve(inertia, B[rigid]), shapes[:, kept].T @ B]),
        D=shapes[:, kept].T @ D @ shapes[:, kept],
        frequencies=frequencies[kept],
        C=C @ np.block([[basis, zero], [zero, basis]]),
        y0=y0,
        outputs=outputs,
        inputs=inputs,
        projection=projection,
        neglected=frequencies[neglected],
        inertia=np.diag(inertia),
    )


def _eigenmodes(K: Array, M: Array) -> tuple[Array, Array]:
    """Ascending squares of frequencies and M-orthonormal shapes of K x = omega^2 M x."""
    L = np.linalg.cholesky(M)
    A = np.linalg.solve(L, np.linalg.solve(L, K).T)
    squares, shapes = np.linalg.eigh((A + A.T) / 2)
    return squares, np.linalg.solve(L.T, shapes)


def galerkin_model(
    coefficients: Galerkin, *, torques: Mapping[str, float], tips: Mapping[str, float]
) -> ReducedModel:
    """Builds the reduced model of Efremov (1.4)-(1.5) with the readings of the planar machines.

    Args:
        coefficients: J, p, a, b, c.
        torques: Torque on the bus about z at unit input, by input name, N m.
        tips: Boom lengths by boom name, m; both booms bend alike in their root frames.

    Returns:
        The model with all Galerkin modes.
    """
    g, n = coefficients, 1 + len(coefficients.p)
    M = np.zeros((n, n))
    M[0, 0], M[0, 1:], M[1:, 0] = g.J, 2 * g.p, 2 * g.p  # (1.5) doubled: M is symmetric
    M[1:, 1:] = np.diag(2 * g.a)
    D, K = np.diag(np.r_[0.0, 2 * g.b]), np.diag(np.r_[0.0, 2 * g.c])
    outputs = _planar_outputs(list(tips))
    rows = np.zeros((len(outputs), 2 * n))
    rows[0, 0] = rows[1, n] = 1.0
    rows[2, n:], rows[3, :n], rows[4, n:] = M[0], M[0] / g.J, M[0] / g.J
    rows[6::3, 1:n] = 2.0 * (-1.0) ** np.arange(n - 1)  # Phi_i(l) with kappa = l
    y0 = np.zeros(len(outputs))
    y0[5::3] = list(tips.values())
    B = np.zeros((n, len(torques)))
    B[0] = list(torques.values())
    return truncate(
        M=M, D=D, K=K, B=B, C=rows, y0=y0, outputs=outputs,
        inputs=tuple(torques), rigid=[0], modes=n - 1,
    )  # fmt: skip


def galerkin_start(modes: int) -> Start:
    """Returns what takes an initial state to the coordinates (gamma, q_1 .. q_modes).

    Args:
        modes: Number of Galerkin modes.
    """

    def start(initial: Initial) -> tuple[Array, Array]:
        if initial.boom_amplitude and initial.boom_mode > modes:
            raise ValueError(
                f"initial.boom_mode = {initial.boom_mode}, but the reduced model has {modes} modes"
            )
        position, velocity = np.zeros(1 + modes), np.zeros(1 + modes)
        position[0], velocity[0] = initial.attitude[2], initial.rate[2]
        if initial.boom_amplitude:
            position[initial.boom_mode] = initial.boom_amplitude
        return position, velocity

    return start


def _planar_outputs(booms: list[str]) -> dict[str, str]:
    outputs = {
        "attitude_z": "rad",
        "rate_z": "rad/s",
        "angular_momentum_z": "N m s",
        "quasi_rigid_angle_z": "rad",
        "quasi_rigid_rate_z": "rad/s",
    }
    return outputs | {f"{boom}_tip_{axis}": "m" for boom in booms for axis in "xyz"}


class ReducedPhysics(control.Physics):
    """A reduced model behind the interface that the MuJoCo plant has.

    Attributes:
        inputs: Input names.
        units: Reading names with their units.
        model: The reduced model.
    """

    def __init__(self, model: ReducedModel, *, start: Start, timestep: float):
        self.model = model
        self._start = start
        self.inputs, self.units = model.inputs, model.outputs
        self._timestep = timestep
        n, k, m = len(model.B), len(model.frequencies), len(model.inputs)
        rigid = n - k
        # The state here is x = (r, r', eta, eta'), its two parts together.
        self._order = np.r_[:rigid, n : n + rigid, rigid:n, n + rigid : 2 * n]
        self._rows = model.C[:, self._order]
        # x(h) = P (x, u, u'), u' being the rate of u; for the rigid part P is cubic in h.
        B, width = model.B[:rigid], 2 * n + 2 * m
        powers = np.zeros((4, 2 * rigid, width))
        powers[0, :, : 2 * rigid] = np.eye(2 * rigid)
        powers[1, :rigid, rigid : 2 * rigid] = np.eye(rigid)
        powers[1, rigid:, 2 * n : 2 * n + m] = B
        powers[2, :rigid, 2 * n : 2 * n + m] = powers[2, rigid:, 2 * n + m :] = B / 2
        powers[3, :rigid, 2 * n + m :] = B / 6
        self._powers = powers
        # The elastic part is diagonal in its complex modes.
        A = np.block([[np.zeros((k, k)), np.eye(k)], [-np.diag(model.frequencies**2), -model.D]])
        self._eigenvalues, self._shapes = np.linalg.eig(A)
        left = np.linalg.inv(self._shapes)
        drive = left[:, k:] @ model.B[rigid:]
        self._left = np.hstack([np.zeros((2 * k, 2 * rigid)), left, drive, drive])
        self._kind = np.repeat([0, 1, 2], [2 * n, m, m])  # which function of h a column takes
        self._propagator = lru_cache(maxsize=32)(self._compute_propagator)
        self.reset()

    def set_initial(self, initial: Initial) -> None:
        """Sets attitude, rate and boom deflection, projected on the motion that is kept.

        Args:
            initial: The initial state.
        """
        motion = [self.model.projection @ part for part in self._start(initial)]
        self._x = np.concatenate(motion)[self._order]

    def select(self, names: tuple[str, ...]) -> Callable[[], list[float]]:
        """Returns a function that reads the named readings.

        Args:
            names: Reading names.

        Raises:
            ValueError: If a name does not exist.
        """
        order = list(self.units)
        for name in names:
            if name not in order:
                raise ValueError(choices("sensor", name, order, where="the reduced model"))
        rows = [order.index(name) for name in names]
        y0, C = self.model.y0[rows], self._rows[rows]
        return lambda: (y0 + C.dot(self._x)).tolist()

    def begin(self, value: Sequence[float], slope: Sequence[float]) -> None:
        """Opens a smooth piece at the present instant.

        Args:
            value: Inputs at the opening, in the order of `inputs`, N or N m.
            slope: Their rates during the piece, per s.
        """
        self._opening = self._time
        self._opened = np.concatenate([self._x, value, slope])

    def advance(self, t: float) -> None:
        """Carries the plant from the opening of the piece to `t`, exactly.

        Args:
            t: End time, s.
        """
        span = t - self._opening
        # But for the rounding of the clock many pieces are alike: those of whole nanoseconds.
        whole = round(span, 9)
        span = whole if abs(span - whole) < 2e-13 else span
        self._x = self._propagator(span).dot(self._opened)
        self._time = t

    def _compute_propagator(self, h: float) -> Array:
        """P(h), shape (2 n, 2 n + 2 nu)."""
        P0, P1, P2, P3 = self._powers
        w = self._eigenvalues * h
        m = np.expm1(w)
        functions = np.array([m + 1, m / self._eigenvalues, (m - w) / self._eigenvalues**2])
        elastic = self._shapes @ (functions.T[:, self._kind] * self._left)
        return np.concatenate([P0 + h * (P1 + h * (P2 + h * P3)), elastic.real])

    def coordinates(self) -> list[float]:
        """Returns nothing: the readings say all that the reduced model knows."""
        return []

    def coordinate_units(self) -> dict[str, str]:
        """Returns no names, as `coordinates` returns no values."""
        return {}

    def check_divergence(self) -> None:
        """Checks that the state is finite.

        Raises:
            PhysicsError: Saying when it was found not to be.
        """
        if not np.all(np.isfinite(self._x)):
            raise control.PhysicsError(f"the reduced plant diverged before t = {self._time:.6g} s")

    def step(self, n_sub_steps: int = 1) -> None:
        """Advances by whole steps with the inputs held.

        Args:
            n_sub_steps: Number of steps.
        """
        for _ in range(n_sub_steps):
            time = self._time
            self.begin(self._held, [0.0] * len(self.inputs))
            self.advance(time + self._timestep)

    def set_control(self, control: Sequence[float]) -> None:
        """Holds the inputs at the given values for `step`.

        Args:
            control: Inputs in the order of `inputs`, N or N m.
        """
        self._held = [float(value) for value in control]

    def reset(self) -> None:
        """Returns to rest in the reference configuration at time 0, inputs zero."""
        self._time = 0.0
        self._held = [0.0] * len(self.inputs)
        self.set_initial(Initial())

    def after_reset(self) -> None:
        """Nothing is derived from the state."""

    def time(self) -> float:
        """Returns the simulated time, s."""
        return self._time

    def timestep(self) -> float:
        """Returns the longest piece, s."""
        return self._timestep
