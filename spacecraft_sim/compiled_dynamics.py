"""A compiled machine as a function near one of its motions, to be linearised by differences.

The state is (x, y): the tangent coordinates of the configuration from a reference, which may itself
turn steadily, and the velocities.  Translations of a free bus, which no attitude depends on, can be
left out by a basis.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo is a compiled module without type stubs)

from dataclasses import dataclass, field, replace
from typing import Any

import mujoco
import numpy as np

from spacecraft_sim.checks import choices
from spacecraft_sim.readings import Readings

Array = np.ndarray
RATES = ("rate_x", "rate_y", "rate_z")


@dataclass(frozen=True, slots=True, kw_only=True)
class CompiledDynamics:
    """The motion of a compiled machine about a reference.

    Attributes:
        model: The model of a flight, its motors integrators of one activation each.
        qpos: Reference configuration, shape (nq,).
        qvel: Velocities of the reference, steady in body axes, shape (nv,).
        wiring: Activations of each input, by its name.
    """

    model: Any
    qpos: Array
    qvel: Array
    wiring: dict[str, tuple[int, ...]]
    _data: Any = field(init=False, repr=False, compare=False)
    _readings: Any = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        data = mujoco.MjData(self.model)
        object.__setattr__(self, "_data", data)
        object.__setattr__(self, "_readings", Readings(self.model, data))

    @property
    def inputs(self) -> tuple[str, ...]:
        """Names of the inputs."""
        return tuple(self.wiring)

    @property
    def units(self) -> dict[str, str]:
        """Names of the readings with their units."""
        return self._readings.units

    def moved(self, x: Array) -> "CompiledDynamics":
        """Returns the motion about another reference.

        Args:
            x: Where it is, seen from this one, shape (2 nv,).
        """
        qpos, n = self.qpos.copy(), self.model.nv
        mujoco.mj_integratePos(self.model, qpos, np.ascontiguousarray(x[:n]), 1.0)
        return replace(self, qpos=qpos, qvel=self.qvel + x[n:])

    def rates(self, x: Array, u: Array) -> Array:
        """Returns the time derivative of the state, to first order in x, shape (2 nv,).

        Args:
            x: State, shape (2 nv,).
            u: Inputs, shape (nu,), N m.
        """
        self._place(x)
        for value, activations in zip(u, self.wiring.values(), strict=True):
            for k in activations:
                self._data.act[k] = value
        mujoco.mj_forward(self.model, self._data)
        n = self.model.nv
        drift = x[n:].copy()
        for turn in _turns(self.model):
            # Seen from a reference that turns, a turn x of the body turns the other way.
            drift[turn] += np.cross(x[turn], self.qvel[turn])
        return np.concatenate([drift, self._data.qacc])

    def readings(self, x: Array) -> Array:
        """Returns the readings, in the order of `units`, shape (ny,).

        Args:
            x: State, shape (2 nv,).
        """
        self._place(x)
        mujoco.mj_forward(self.model, self._data)
        return np.array(self._readings.select(tuple(self.units))())

    def _place(self, x: Array) -> None:
        n = self.model.nv
        self._data.qpos[:] = self.qpos
        mujoco.mj_integratePos(self.model, self._data.qpos, np.ascontiguousarray(x[:n]), 1.0)
        self._data.qvel[:] = self.qvel + x[n:]


def steady_spin(motion: CompiledDynamics, *, least: float = 1e-3) -> Array:
    """Returns the velocities of a machine without what is left of a swing; a spin stays.

    Args:
        motion: The machine, about a motion that has all but settled.
        least: Rate below which a turn of a free body is taken for the rest of a swing, rad/s.
    """
    qvel = np.zeros_like(motion.qvel)
    for turn in _turns(motion.model):  # a hinge swings, it does not spin
        rate = motion.qvel[turn]
        qvel[turn] = np.where(np.abs(rate) < least, 0.0, rate)
    return qvel


def _turns(model: Any) -> list[slice]:
    """Where the rotations of free and ball joints are among the velocities."""
    found = []
    for j in range(model.njnt):
        kind = mujoco.mjtJoint(model.jnt_type[j])
        if kind in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL):
            first = int(model.jnt_dofadr[j]) + 3 * (kind == mujoco.mjtJoint.mjJNT_FREE)
            found.append(slice(first, first + 3))
    return found


def dynamics_at(physics: Any, channels: tuple[str, ...]) -> CompiledDynamics:
    """Returns the motion of a MuJoCo plant about the state in which it is.

    Args:
        physics: The plant.
        channels: Inputs that are driven.

    Raises:
        ValueError: If the plant has no such input.
    """
    model, data = physics.model.ptr, physics.data.ptr
    wiring: dict[str, tuple[int, ...]] = {}
    for name in channels:
        if name not in physics.inputs:
            raise ValueError(choices("input", name, physics.inputs, where="the plant"))
        wiring[name] = physics.activations(name)
    return CompiledDynamics(
        model=model, qpos=data.qpos.copy(), qvel=data.qvel.copy(), wiring=wiring
    )


def inertias(physics: Any, channels: tuple[str, ...]) -> tuple[float, ...]:
    """Returns the moment of inertia that each torque meets at once, kg m^2.

    That is torque over the acceleration of the bus, |rate_x', rate_y', rate_z'|: elastic parts
    follow only later.

    Args:
        physics: A MuJoCo plant.
        channels: Inputs, each a torque on the bus.

    Raises:
        ValueError: If the plant has no such input, or its bus has no rates.
    """
    motion = dynamics_at(physics, channels)
    names = list(motion.units)
    for rate in RATES:
        if rate not in names:
            raise ValueError(choices("reading", rate, names, where="the plant"))
    rows, n = [names.index(rate) for rate in RATES], motion.model.nv

    def pace(qacc: Array) -> Array:  # readings of rates, linear in the velocities
        return motion.readings(np.r_[np.zeros(n), qacc])[rows]

    rest = np.zeros(2 * n)
    idle = motion.rates(rest, np.zeros(len(channels)))[n:]
    found = []
    for e in np.eye(len(channels)):
        push = motion.rates(rest, e)[n:] - idle
        found.append(1 / float(np.linalg.norm(pace(push) - pace(np.zeros(n)))))
    return tuple(found)


def basis(model: Any, *, without: tuple[int, ...] = ()) -> Array:
    """Returns the states but for translations of a free bus, shape (2 nv, k).

    Args:
        model: The model.
        without: Further components of the state to leave out.
    """
    left_out = set(without)
    for j in range(model.njnt):
        if mujoco.mjtJoint(model.jnt_type[j]) == mujoco.mjtJoint.mjJNT_FREE:
            first = int(model.jnt_dofadr[j])
            left_out |= {*range(first, first + 3), *range(model.nv + first, model.nv + first + 3)}
    kept = [k for k in range(2 * model.nv) if k not in left_out]
    return np.eye(2 * model.nv)[:, kept]
