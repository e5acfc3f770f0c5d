"""What a manoeuvre planner returns: a control over time, what it costs, what it leaves behind."""

from dataclasses import dataclass, field

import numpy as np

from controllers.moment_problem import Problem, crossings, with_ends
from controllers.moments import Array, Modes, Numbers, quadrature, share, switched_moments


def _nothing() -> Array:
    return read_only(np.empty(0))


def read_only(values: Array) -> Array:
    """Returns a copy that cannot be written to.

    Args:
        values: The values.
    """
    values = np.array(values, dtype=float)
    values.setflags(write=False)
    return values


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SwitchedPlan:
    """A piecewise constant control.

    Attributes:
        duration: T, s.
        switch_times: When the level changes, ascending, inside (0, T), s.
        levels: The control between them, one more, N m or rad/s^2.
        residual: Largest error of a moment as a share of the manoeuvre, see `moments.share`.
        normal: Whether the multipliers fix the control; if not, other controls cost as little.
        multipliers: l, normalised as the planner says; empty if there are none.
    """

    duration: float
    switch_times: Array
    levels: Array
    residual: float
    normal: bool = True
    multipliers: Array = field(default_factory=_nothing)

    @property
    def peak(self) -> float:
        """Largest |u|."""
        return float(np.max(np.abs(self.levels)))

    @property
    def energy(self) -> float:
        """The L2 norm of u, the root of the integral of u^2."""
        return float(np.sqrt(self._lengths @ self.levels**2))

    @property
    def fuel(self) -> float:
        """The integral of |u|."""
        return float(self._lengths @ np.abs(self.levels))

    @property
    def _lengths(self) -> Array:
        return np.diff(self.switch_times, prepend=0.0, append=self.duration)

    def __call__(self, t: Array | float) -> Array:
        """Returns u(t), zero outside [0, T]; at a switching the level that follows.

        Args:
            t: Times, s.
        """
        t = np.asarray(t, dtype=float)
        level = self.levels[np.searchsorted(self.switch_times, t, side="right")]
        return np.where((t >= 0) & (t <= self.duration), level, 0.0)

    def moments(self, modes: Modes) -> Array:
        """Returns the moments of u, in closed form.

        Args:
            modes: The modes, which need not be those of the plan.
        """
        edges = np.concatenate([[0.0], self.duration - self.switch_times[::-1], [self.duration]])
        return switched_moments(modes, edges=edges, levels=self.levels[::-1])


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SmoothPlan:
    """A control that is a sum of moment functions, u = sum l_k h_k(T - t).

    Attributes:
        problem: The moments that are met.
        own: Multipliers of the problem's own functions, in its own unit.
        energy: The L2 norm of u.
        peak: Largest |u|.
        fuel: The integral of |u|.
        residual: Largest error of a moment as a share of the manoeuvre, see `moments.share`.
        normal: Always true: the control of least energy is unique.
        switch_times: Empty.
        levels: Empty.
    """

    problem: Problem
    own: Array
    energy: float
    peak: float
    fuel: float
    residual: float
    normal: bool = True
    switch_times: Array = field(default_factory=_nothing)
    levels: Array = field(default_factory=_nothing)

    @property
    def duration(self) -> float:
        """T, s."""
        return self.problem.duration

    @property
    def modes(self) -> Modes:
        """The modes that are left at rest."""
        return self.problem.modes.scaled(1 / self.duration)

    @property
    def multipliers(self) -> Array:
        """Coefficients l of u = sum l_k h_k(T - t)."""
        return read_only(self.problem.unit * self.problem.multipliers(self.own))

    def __call__(self, t: Array | float) -> Array:
        """Returns u(t), zero outside [0, T].

        Args:
            t: Times, s.
        """
        s = 1 - np.asarray(t, dtype=float) / self.duration
        q = self.problem.functions(np.clip(s, 0, 1))
        u = self.problem.unit * np.tensordot(self.own, q, 1)
        return np.where((s >= 0) & (s <= 1), u, 0.0)

    def moments(self, modes: Modes) -> Array:
        """Returns the moments of u, to rounding.

        Args:
            modes: The modes, which need not be those of the plan.
        """
        faster = max(modes, self.modes, key=lambda m: max(m.omega))
        s, weights = quadrature(faster, self.duration)
        return modes.functions(s) @ (weights * self(self.duration - s))


Plan = SwitchedPlan | SmoothPlan


def switched_plan(
    problem: Problem,
    edges: Array,
    pattern: Array,
    own: Array,
    *,
    level: float,
    normal: bool = True,
) -> SwitchedPlan:
    """Returns the plan of a control that is constant between edges.

    Args:
        problem: The moments that it shall have.
        edges: Times to go at which the level changes, ascending, in (0, 1).
        pattern: -1, 0 or 1 between them, one more.
        own: l', the multipliers of q.
        level: Size of the levels, N m or rad/s^2.
        normal: Whether the multipliers fix the control.
    """
    return SwitchedPlan(
        duration=problem.duration,
        switch_times=read_only(problem.duration * (1 - edges[::-1])),
        levels=read_only(level * pattern[::-1] + 0.0),  # no negative zero
        residual=problem.error(edges, level / problem.unit * pattern),
        normal=normal,
        multipliers=read_only(problem.multipliers(own)),
    )


def smooth_plan(problem: Problem) -> SmoothPlan:
    """Returns the plan of least energy, u = c . q with orthonormal q.

    Args:
        problem: The moments that it shall have.
    """
    s, weights = quadrature(problem.modes, 1.0)
    q, own = problem.functions(s), problem.target
    # q is orthonormal to rounding, times its condition; once more, and so are the moments right.
    own = own - problem.excess(s, weights * (own @ q))
    u = own @ q
    curve = problem.curve(own)
    edges, e = crossings(curve, (0.0,), (-1.0, 1.0))
    turns, _ = crossings(curve.derivative(), (0.0,), (-1.0, 1.0))
    error = problem.modes.functions(s) @ (weights * u) - problem.moments
    unit, T = problem.unit, problem.duration
    return SmoothPlan(
        problem=problem,
        own=read_only(own),
        peak=unit * float(np.max(np.abs(own @ problem.functions(with_ends(turns))))),
        energy=unit * float(np.sqrt(T * (weights @ u**2))),
        fuel=unit * T * float(own @ problem.of_switched(edges, e)),
        residual=share(problem.modes, error, problem.moments, 1.0),
    )


def residual_vibration(plan: Plan, *, omega: Numbers, damping: Numbers) -> Array:
    """Returns the amplitude that a plan leaves a mode with: sqrt(y^2 + ((y' + b y/2)/beta)^2).

    The mode y'' + b y' + w^2 y = u is at rest at first; left alone at the end, y e^(b t/2) swings
    with this amplitude.

    Args:
        plan: The control.
        omega: w of the modes that there really are, broadcast against damping, rad/s.
        damping: b of these modes, 1/s.

    Raises:
        ValueError: If a mode is not underdamped.
    """
    w, b = np.broadcast_arrays(np.asarray(omega, dtype=float), np.asarray(damping, dtype=float))
    modes = Modes(omega=tuple(w.ravel().tolist()), damping=tuple(b.ravel().tolist()))
    c = plan.moments(modes)
    y, rate = c[2::2], c[3::2]
    return np.hypot(y, (rate - modes.alpha * y) / modes.beta).reshape(w.shape)
