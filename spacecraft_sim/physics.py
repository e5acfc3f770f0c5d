"""The full plant: MuJoCo behind the interface that the reduced plant has too.

A flight is a chain of *smooth pieces*: within a piece every input is a straight line in time.
`begin` opens a piece at the present instant, `advance(t)` carries the plant from there to t; called
again, it starts again from the opening, which is how a switching instant is located.  A piece is a
whole number of equal RK4 steps, so thrust edges fall on step ends and the order 4 survives them.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo is a compiled module without type stubs)

import math
import os
from collections.abc import Callable, Iterable, Sequence

if "MUJOCO_GL" not in os.environ and "DISPLAY" not in os.environ:
    os.environ["MUJOCO_GL"] = "disabled"  # before dm_control: it looks for a display on import

import mujoco
import numpy as np
from dm_control import mujoco as dm_mujoco
from dm_control.mujoco import wrapper
from dm_control.rl import control

from spacecraft_sim import linearize, mjcf
from spacecraft_sim.checks import positive
from spacecraft_sim.readings import Readings
from spacecraft_sim.scenario import Initial
from spacecraft_sim.spacecraft import Spacecraft

Array = np.ndarray

RK4_LIMIT = (
    2.5  # |lambda| dt on the left half plane's boundary; exactly 2.785 real, 2.828 imaginary
)


class MujocoPhysics(dm_mujoco.Physics):
    """A compiled spacecraft that lands on thrust edges.

    Attributes:
        inputs: Input names: thruster channels, then disturbances.
        input_units: Their units.
    """

    inputs: tuple[str, ...]
    input_units: dict[str, str]
    _value: Sequence[float]
    _slope: Sequence[float]

    @classmethod
    def fly(
        cls, spacecraft: Spacecraft, *, timestep: float, disturbances: Iterable[str] = ()
    ) -> "MujocoPhysics":
        """Builds the plant of a spacecraft.

        Args:
            spacecraft: The machine.
            timestep: Longest RK4 step, s.
            disturbances: Names `disturbance_<axis>` of the disturbance torques.

        Raises:
            ValueError: If the machine is not valid, or the step is over the limit of stability.
        """
        positive(timestep=timestep)
        disturbances = tuple(disturbances)
        model = mjcf.compile(spacecraft, timestep=timestep, disturbances=disturbances)
        require_stable_step(model, timestep)
        physics = cls.from_model(wrapper.MjModel(model))
        physics._connect(spacecraft, mjcf.channels(spacecraft, disturbances))
        return physics

    def _connect(self, spacecraft: Spacecraft, channels: dict[str, tuple[str, ...]]) -> None:
        model, data = self.model.ptr, self.data.ptr
        self.inputs = tuple(channels)
        self.input_units = mjcf.input_units(model, channels)
        self._spacecraft = spacecraft
        self._readings = Readings(model, data)
        self.units = self._readings.units
        self._all = self._readings.select(tuple(self.units))
        # Activation k follows input i.
        wiring = {
            int(model.actuator(a).actadr[0]): i
            for i, actuators in enumerate(channels.values())
            for a in actuators
        }
        self._wiring = sorted(wiring.items())
        self._pointers, self._option = (model, data), model.opt
        self._act, self._ctrl = data.act, data.ctrl
        self._qpos, self._qvel = data.qpos, data.qvel
        self._opened = np.zeros(mujoco.mj_stateSize(model, _STATE))
        self._moved = False
        self._acceleration_sensors = bool(
            np.any(model.sensor_needstage == mujoco.mjtStage.mjSTAGE_ACC)
        )
        self._held = [0.0] * len(self.inputs)
        self._timestep = model.opt.timestep

    def select(self, names: tuple[str, ...]) -> Callable[[], list[float]]:
        """Returns a function that reads the named readings.

        Args:
            names: Reading names.

        Raises:
            ValueError: If a name does not exist.
        """
        return self._readings.select(names)

    def activations(self, channel: str) -> tuple[int, ...]:
        """Returns the activations, thrusts of its motors, that an input sets.

        Args:
            channel: Input name.
        """
        place = self.inputs.index(channel)
        return tuple(k for k, i in self._wiring if i == place)

    def read(self) -> list[float]:
        """Returns all readings in the order of `units`."""
        return self._all()

    def coordinates(self) -> list[float]:
        """Returns the generalised coordinates, shape (nq,)."""
        return self._qpos.tolist()

    def coordinate_units(self) -> dict[str, str]:
        """Returns the names of the generalised coordinates, with their units."""
        model, units = self.model.ptr, {}
        for j in range(model.njnt):
            name = model.joint(j).name
            kind = mujoco.mjtJoint(model.jnt_type[j])
            if kind == mujoco.mjtJoint.mjJNT_FREE:
                units |= {f"{name}.{axis}": "m" for axis in mjcf.AXES}
            if kind in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL):
                units |= {f"{name}.q{axis}": "" for axis in ("w", *mjcf.AXES)}
            else:
                slides = kind == mujoco.mjtJoint.mjJNT_SLIDE
                units[f"{name}.angle"] = "m" if slides else "rad"
        return units

    def set_initial(self, initial: Initial) -> None:
        """Sets attitude, rate and boom deflection; the booms are at rest in the bus frame.

        Args:
            initial: The initial state.
        """
        model, data = self.model.ptr, self.data.ptr
        tangent, rate = linearize.initial_state(model, self._spacecraft, initial)
        np.copyto(data.qpos, model.qpos0)
        mujoco.mj_integratePos(model, data.qpos, tangent, 1.0)
        np.copyto(data.qvel, rate)
        mujoco.mj_step1(model, data)

    def begin(self, value: Sequence[float], slope: Sequence[float]) -> None:
        """Opens a smooth piece at the present instant.

        Args:
            value: Inputs at the opening, in the order of `inputs`, N or N m.
            slope: Their rates during the piece, per s.
        """
        model, data = self._pointers
        if value != self._value or slope != self._slope or any(slope):
            self._value, self._slope = list(value), list(slope)
            for k, i in self._wiring:
                self._act[k], self._ctrl[k] = value[i], slope[i]
        mujoco.mj_getState(model, data, self._opened, _STATE)
        self._opening, self._moved = data.time, False

    def advance(self, t: float) -> None:
        """Carries the plant from the opening of the piece to `t` by equal RK4 steps.

        Args:
            t: End time, s.
        """
        model, data = self._pointers
        if self._moved:
            mujoco.mj_setState(model, data, self._opened, _STATE)
            mujoco.mj_step1(model, data)
        self._moved = True
        span = t - self._opening
        steps = math.ceil(span / self._timestep - _STRETCH) or 1
        self._option.timestep = span / steps
        # What depends on position and velocity is up to date: the first step need not repeat it.
        mujoco.mj_forwardSkip(model, data, _VELOCITY_STAGE, 1)
        mujoco.mj_RungeKutta(model, data, 4)
        if steps > 1:
            mujoco.mj_step(model, data, steps - 1)
        self._option.timestep = self._timestep
        data.time = t
        mujoco.mj_step1(model, data)
        if self._acceleration_sensors:
            mujoco.mj_forward(model, data)

    def step(self, nstep: int = 1) -> None:
        """Advances by `nstep` whole steps with the inputs held.

        Args:
            nstep: Number of steps.

        Raises:
            PhysicsError: If the state is no longer finite.
        """
        self.begin(self._held, [0.0] * len(self.inputs))
        self.advance(self.time() + nstep * self._timestep)
        self.check_divergence()

    def set_control(self, control: Sequence[float]) -> None:
        """Holds the inputs at the given values for `step`.

        Args:
            control: Inputs in the order of `inputs`, N or N m.
        """
        self._held = [float(value) for value in control]

    def after_reset(self) -> None:
        """Brings every derived quantity up to date; all inputs are zero."""
        self._value = self._slope = ()
        mujoco.mj_forward(self.model.ptr, self.data.ptr)

    def timestep(self) -> float:
        """Returns the longest step, s; steps that land on an edge are shorter."""
        return self.model.ptr.opt.timestep

    def check_divergence(self) -> None:
        """Checks that the state is finite.

        Raises:
            PhysicsError: Saying when it was found not to be.
        """
        if not math.hypot(*self._qvel.tolist(), *self._qpos.tolist()) < _HUGE:  # NaN too
            raise control.PhysicsError(
                f"the MuJoCo plant diverged before t = {self.time():.6g} s: its state is not "
                f"finite or beyond {_HUGE:g}"
            )


# Share of a step by which the steps of a piece may be overdrawn rather than add one: 1.1 times the
# limit above is 2.75, still inside the region of stability.
_STRETCH = 0.1
_HUGE = 1e6  # rad/s or m/s: no spacecraft gets there
_VELOCITY_STAGE = int(mujoco.mjtStage.mjSTAGE_VEL)
_STATE = int(mujoco.mjtState.mjSTATE_PHYSICS | mujoco.mjtState.mjSTATE_TIME)


def require_stable_step(model: mujoco.MjModel, timestep: float) -> None:
    """Refuses a step at which RK4 is not stable; past the limit it may oscillate without a warning.

    Args:
        model: A compiled model.
        timestep: Step, s.

    Raises:
        ValueError: Giving the largest stable step, if |lambda|_max timestep >= 2.5.
    """
    grounded = np.any(model.opt.gravity) or model.ntendon
    values = linearize.eigenvalues(model) if grounded else linearize.linearize(model).eigenvalues()
    fastest = float(np.max(np.abs(values), initial=0.0))
    if fastest * timestep >= RK4_LIMIT:
        raise ValueError(
            f"timestep {timestep} s is over the stability limit {RK4_LIMIT / fastest:.4g} s of "
            f"RK4: the fastest eigenvalue of the model has |lambda| = {fastest:.4g} 1/s and "
            f"|lambda| dt must stay below {RK4_LIMIT}; take a smaller step or fewer hinges"
        )
