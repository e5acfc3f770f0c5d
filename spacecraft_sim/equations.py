"""The reduced plant of machines with equations of motion: of Lagrange, or of Euler and Poisson.

They are integrated by DOP853, an order and an author apart from MuJoCo's RK4, over pieces in which
every input is a straight line in time, so the same law object flies on both.  The numbers are those
of the machine's `[equations]`, not of its MJCF.
"""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from dm_control.rl import control

from spacecraft_sim import spacecraft
from spacecraft_sim.checks import choices
from spacecraft_sim.dynamics import Dynamics
from spacecraft_sim.euler_poisson import RigidBody
from spacecraft_sim.mechanisms import FlexibleJointArm, PlanarArm
from spacecraft_sim.scenario import Initial
from spacecraft_sim.spacecraft import Spacecraft

Array = np.ndarray
_RTOL, _ATOL = 1e-10, 1e-12
AXES = "xyz"


def dynamics_of(machine: Spacecraft) -> PlanarArm | FlexibleJointArm | RigidBody:
    """Returns the equations of motion of a machine.

    Args:
        machine: The machine.

    Raises:
        ValueError: If it has none, or they are not valid.
    """
    table = machine.equations
    if table is None:
        raise ValueError(
            f"{machine.name} has no [equations]; reduced.source may be: galerkin, mjcf"
        )
    if isinstance(table, spacecraft.RigidBodyEquations):
        return RigidBody(inertia=table.inertia)
    links = PlanarArm(
        lengths=table.lengths,
        centres=table.centres,
        masses=table.masses,
        inertias=table.inertias,
        g=table.g,
    )
    if isinstance(table, spacecraft.FlexibleJointEquations):
        return FlexibleJointArm(links=links, rotors=table.rotors, stiffnesses=table.stiffnesses)
    return links


class EquationsPhysics(control.Physics):
    """Equations of motion behind the interface that the MuJoCo plant has.

    Attributes:
        inputs: Input names: thruster channels, then disturbances.
        units: Reading names with their SI units.
        dynamics: The equations.
    """

    def __init__(self, machine: Spacecraft, *, disturbances: Sequence[str], timestep: float):
        self.dynamics: Dynamics = dynamics_of(machine)
        self._machine, self._timestep = machine, timestep
        self.units = self.dynamics.units
        self.inputs = (*(thruster.name for thruster in machine.thrusters), *disturbances)
        self._drive = _drive(machine, self.dynamics, disturbances)
        self.reset()

    def set_initial(self, initial: Initial) -> None:
        """Sets the state at time 0.

        Args:
            initial: Attitude and rate of a body, or angles and rates of joints.

        Raises:
            ValueError: If the machine has no such joint, or cannot turn that way.
        """
        self._x = start(self._machine, self.dynamics, initial)

    def select(self, names: tuple[str, ...]) -> Callable[[], list[float]]:
        """Returns a function that reads the named readings.

        Args:
            names: Reading names.

        Raises:
            ValueError: If a name does not exist.
        """
        known = list(self.units)
        for name in names:
            if name not in known:
                raise ValueError(choices("sensor", name, known, where="the equations of motion"))
        rows = [known.index(name) for name in names]
        return lambda: self.dynamics.readings(self._x)[rows].tolist()

    def begin(self, value: Sequence[float], slope: Sequence[float]) -> None:
        """Opens a smooth piece at the present instant.

        Args:
            value: Inputs at the opening, in the order of `inputs`, N or N m.
            slope: Their rates during the piece, per s.
        """
        self._opening, self._opened = self._time, self._x
        self._value, self._slope = self._drive @ value, self._drive @ slope

    def advance(self, t: float) -> None:
        """Carries the plant from the opening of the piece to `t`; again, if called again.

        Args:
            t: End time, s.

        Raises:
            PhysicsError: If the motion cannot be integrated on.
        """
        from scipy.integrate import DOP853

        def rates(s: float, x: Array) -> Array:
            return self.dynamics.rates(x, self._value + self._slope * (s - self._opening))

        span = t - self._opening
        if span > 0:
            solver = DOP853(
                rates, self._opening, self._opened, t, first_step=span, rtol=_RTOL, atol=_ATOL
            )
            while solver.status == "running":
                solver.step()
            if solver.status == "failed":
                raise control.PhysicsError(
                    f"the equations cannot be integrated beyond t = {solver.t:.6g} s"
                )
            self._x = solver.y
        else:
            self._x = self._opened
        self._time = t

    def coordinates(self) -> list[float]:
        """Returns nothing: the readings say all that the equations know."""
        return []

    def coordinate_units(self) -> dict[str, str]:
        """Returns no names, as `coordinates` returns no values."""
        return {}

    def check_divergence(self) -> None:
        """Checks that the state is finite.

        Raises:
            PhysicsError: Saying when it was found not to be.
        """
        if not np.all(np.abs(self._x) < _HUGE):
            raise control.PhysicsError(
                f"the equations of motion diverged before t = {self._time:.6g} s"
            )

    def step(self, n_sub_steps: int = 1) -> None:
        """Advances by whole steps with the inputs held.

        Args:
            n_sub_steps: Number of steps.
        """
        self.begin(self._held, [0.0] * len(self.inputs))
        self.advance(self._time + n_sub_steps * self._timestep)
        self.check_divergence()

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


_HUGE = 1e6  # rad or rad/s: no machine gets there


def start(machine: Spacecraft, dynamics: Dynamics, initial: Initial) -> Array:
    """Returns the state in which a machine starts, shape (n,).

    Args:
        machine: The machine.
        dynamics: Its equations of motion.
        initial: The initial state.

    Raises:
        ValueError: If the machine has no such joint, or has no attitude.
    """
    if isinstance(dynamics, RigidBody):
        for name, values in (("joints", initial.joints), ("joint_rates", initial.joint_rates)):
            if values:
                raise ValueError(f"initial.{name} = {values}: a rigid body has no joints")
        to_body = _principal_axes(machine)
        attitude = rotation(np.array(initial.attitude)) @ to_body
        return dynamics.state(rate=np.array(initial.rate) @ to_body, attitude=attitude)
    for name, vector in (("attitude", initial.attitude), ("rate", initial.rate)):
        if any(vector):
            raise ValueError(
                f"initial.{name} = {vector}: {machine.name} has no attitude; set initial.joints "
                "and initial.joint_rates"
            )
    angles = [name for name in dynamics.units if not name.endswith("_rate")]
    for key, values in (("joints", initial.joints), ("joint_rates", initial.joint_rates)):
        for name in values:
            if name not in angles:
                raise ValueError(choices("joint", name, angles, where=f"initial.{key}"))

    def filled(values: Mapping[str, float]) -> list[float]:
        return [values.get(name, 0.0) for name in angles]

    return np.array([*filled(initial.joints), *filled(initial.joint_rates)])


def rotation(vector: Array) -> Array:
    """Returns the rotation matrix of a rotation vector, shape (3, 3), by Rodrigues's formula.

    Args:
        vector: Shape (3,), rad.
    """
    angle = float(np.linalg.norm(vector))
    x, y, z = vector
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    half = np.sinc(angle / (2 * np.pi))
    return np.eye(3) + np.sinc(angle / np.pi) * across + half**2 / 2 * across @ across


def _principal_axes(machine: Spacecraft) -> Array:
    """Takes vectors in principal axes to body axes."""
    table = machine.equations
    if not isinstance(table, spacecraft.RigidBodyEquations):
        raise ValueError(f"{machine.name} is no rigid body: it has no principal axes")
    w, *v = np.array(table.axes) / np.linalg.norm(table.axes)
    x, y, z = v
    across = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + 2 * w * across + 2 * across @ across


def _drive(machine: Spacecraft, dynamics: Dynamics, disturbances: Sequence[str]) -> Array:
    """Takes the inputs of a flight to those of the equations."""
    columns = []
    for thruster in machine.thrusters:
        if thruster.name not in dynamics.inputs or thruster.actuators not in ((), (thruster.name,)):
            raise ValueError(choices("input", thruster.name, dynamics.inputs, where="[equations]"))
        columns.append([float(name == thruster.name) for name in dynamics.inputs])
    for name in disturbances:
        if not isinstance(dynamics, RigidBody):
            raise ValueError(f"{name} acts on a bus; {machine.name} has none: leave it out")
        columns.append(_principal_axes(machine)[AXES.index(name[-1])].tolist())
    return np.array(columns).reshape(-1, len(dynamics.inputs)).T
