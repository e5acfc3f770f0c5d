"""Named scalar readings of a compiled model: its MJCF sensors, and its quasi-rigid motion.

A vector sensor `rate` is read as `rate_x`, `rate_y`, `rate_z`; a quaternion sensor `attitude` as
the three components of its rotation vector.  Added to these, for the axes about which the bus can
turn:

- `angular_momentum_<axis>`: of the whole machine, about the axis of a hinged bus or about the
  centre of mass of a free one, world frame, N m s;
- `quasi_rigid_rate_<axis>`: that momentum over the undeformed inertia, v/J of Efremov (1.6), rad/s;
  with no external torque it is constant, whatever the booms do;
- `quasi_rigid_angle_<axis>`: beta/J, the attitude that the machine would have with its booms
  straight, linear in the joint coordinates, rad.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo is a compiled module without type stubs)

import math
import operator
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import mujoco
import numpy as np

from spacecraft_sim.checks import choices
from spacecraft_sim.mjcf import AXES, BUS

Array = np.ndarray

_S = mujoco.mjtSensor
_UNITS = {
    _S.mjSENS_JOINTPOS: "rad",
    _S.mjSENS_JOINTVEL: "rad/s",
    _S.mjSENS_FRAMEQUAT: "rad",
    _S.mjSENS_BALLQUAT: "rad",
    _S.mjSENS_GYRO: "rad/s",
    _S.mjSENS_FRAMEANGVEL: "rad/s",
    _S.mjSENS_FRAMEANGACC: "rad/s^2",
    _S.mjSENS_BALLANGVEL: "rad/s",
    _S.mjSENS_FRAMEPOS: "m",
    _S.mjSENS_SUBTREECOM: "m",
    _S.mjSENS_FRAMELINVEL: "m/s",
    _S.mjSENS_VELOCIMETER: "m/s",
    _S.mjSENS_SUBTREELINVEL: "m/s",
    _S.mjSENS_ACCELEROMETER: "m/s^2",
    _S.mjSENS_FRAMELINACC: "m/s^2",
    _S.mjSENS_SUBTREEANGMOM: "N m s",
    _S.mjSENS_TORQUE: "N m",
    _S.mjSENS_FORCE: "N",
}


@dataclass(frozen=True, slots=True)
class Block:
    """Readings that are computed together.

    Attributes:
        units: Their names and SI units.
        read: Gives their values from the data as it then is.
    """

    units: dict[str, str]
    read: Callable[[], list[float]]


class Readings:
    """The readings of one model and its data.

    Attributes:
        units: Reading names in their order, with their SI units.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData):
        self._blocks = [*_sensors(model, data), *_quasi_rigid(model, data)]
        self.units: dict[str, str] = {}
        for block in self._blocks:
            if twice := self.units.keys() & block.units.keys():
                raise ValueError(f"two sensors give the readings {sorted(twice)}; rename one")
            self.units |= block.units

    def select(self, names: tuple[str, ...]) -> Callable[[], list[float]]:
        """Returns a function that reads the named readings from the data as it then is.

        Args:
            names: Reading names.

        Raises:
            ValueError: If a name does not exist; the message lists those that do.
        """
        for name in names:
            if name not in self.units:
                raise ValueError(choices("sensor", name, self.units, where="the model"))
        used = [block for block in self._blocks if block.units.keys() & set(names)]
        order = [name for block in used for name in block.units]
        reads = [block.read for block in used]
        if len(names) < 2:  # itemgetter gives no sequence of one
            places = [order.index(name) for name in names]
            return lambda: [[x for read in reads for x in read()][k] for k in places]
        pick = operator.itemgetter(*(order.index(name) for name in names))
        if len(reads) == 1:
            return lambda read=reads[0]: list(pick(read()))
        return lambda: list(pick([x for read in reads for x in read()]))


def _sensors(model: mujoco.MjModel, data: mujoco.MjData) -> list[Block]:
    """One block a sensor, but all scalars and vectors that stand next to each other in one."""
    blocks: list[Block] = []
    units, start = {}, 0
    for i in range(model.nsensor):
        name, kind = model.sensor(i).name, _S(model.sensor_type[i])
        first, size = int(model.sensor_adr[i]), int(model.sensor_dim[i])
        unit = _UNITS.get(kind, "")
        if kind in (_S.mjSENS_JOINTPOS, _S.mjSENS_JOINTVEL) and _slides(model, i):
            unit = unit.replace("rad", "m")
        if kind in (_S.mjSENS_FRAMEQUAT, _S.mjSENS_BALLQUAT):
            blocks += _plain(units, data.sensordata[start:first])
            rotation = _rotation_vector(data.sensordata[first : first + size])
            blocks.append(Block({f"{name}_{axis}": unit for axis in AXES}, rotation))
            units, start = {}, first + size
        else:
            suffixes = {1: ("",), 3: ("_x", "_y", "_z")}.get(size) or [f"_{k}" for k in range(size)]
            for suffix in suffixes:
                if f"{name}{suffix}" in units:
                    raise ValueError(f"two sensors give the reading {name + suffix!r}; rename one")
                units[f"{name}{suffix}"] = unit
    return blocks + _plain(units, data.sensordata[start:])


def _plain(units: dict[str, str], values: Array) -> list[Block]:
    return [Block(units, values.tolist)] if units else []


def _slides(model: mujoco.MjModel, sensor: int) -> bool:
    joint = model.sensor_objid[sensor]
    return model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE


def _rotation_vector(quaternion: Array) -> Callable[[], list[float]]:
    """The rotation vector of a unit quaternion (w, x, y, z), the shortest way round."""

    def read() -> list[float]:
        w, x, y, z = quaternion.tolist()
        sine = math.sqrt(x * x + y * y + z * z)
        scale = 2 * math.atan2(sine, abs(w)) / sine if sine > 1e-12 else 2.0
        scale = math.copysign(scale, w)
        return [scale * x, scale * y, scale * z]

    return read


def _quasi_rigid(model: mujoco.MjModel, data: mujoco.MjData) -> list[Block]:
    """Readings of the momentum and of the rigid coordinates, if the bus turns on one joint."""
    bus = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, BUS)
    if bus < 0 or model.body_jntnum[bus] != 1:
        return []
    joint = int(model.body_jntadr[bus])
    dof = int(model.jnt_dofadr[joint])
    kind, axis = model.jnt_type[joint], model.jnt_axis[joint]
    if kind == mujoco.mjtJoint.mjJNT_HINGE and np.max(axis) == 1.0:
        return [_about_hinge(model, data, dof, AXES[int(np.argmax(axis))])]
    if kind == mujoco.mjtJoint.mjJNT_FREE:
        return [_about_centre_of_mass(model, data, bus, dof)]
    return []


def _units(axes: Sequence[str]) -> dict[str, str]:
    kinds = {"angular_momentum": "N m s", "quasi_rigid_angle": "rad", "quasi_rigid_rate": "rad/s"}
    return {f"{kind}_{axis}": unit for kind, unit in kinds.items() for axis in axes}


def _about_hinge(model: mujoco.MjModel, data: mujoco.MjData, dof: int, axis: str) -> Block:
    M = undeformed_mass_matrix(model)
    J = float(M[dof, dof])
    difference = _tangent(model, data)
    row, momenta, qvel = M[dof] / J, np.zeros(model.nv), data.qvel

    def read() -> list[float]:
        mujoco.mj_mulM(model, data, momenta, qvel)
        momentum = momenta.item(dof)
        return [momentum, float(row.dot(difference())), momentum / J]

    return Block(_units(axis), read)


def _about_centre_of_mass(model: mujoco.MjModel, data: mujoco.MjData, bus: int, dof: int) -> Block:
    M = undeformed_mass_matrix(model)
    base = slice(dof, dof + 6)
    inverse = np.linalg.inv(M[base, base])
    rows = (inverse @ M[base])[3:]  # (3, nv): rotation of the bus plus G^T q of the flexible joints
    inverse_inertia = inverse[3:, 3:]
    difference = _tangent(model, data)
    momentum, rotation = data.subtree_angmom[bus], data.xmat[bus].reshape(3, 3)

    def read() -> list[float]:
        mujoco.mj_subtreeVel(model, data)
        rate = inverse_inertia @ (momentum @ rotation)
        return [*momentum.tolist(), *(rows @ difference()).tolist(), *rate.tolist()]

    return Block(_units(AXES), read)


def undeformed_mass_matrix(model: mujoco.MjModel) -> Array:
    """Returns the mass matrix at the reference configuration, shape (nv, nv).

    Args:
        model: A compiled model.
    """
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    M = np.zeros((model.nv, model.nv))
    mujoco.mj_fullM(model, data, M)
    return M


def _tangent(model: mujoco.MjModel, data: mujoco.MjData) -> Callable[[], Array]:
    """Returns a function that gives qpos - qpos0 in the tangent space, shape (nv,)."""
    qpos, reference = data.qpos, model.qpos0.copy()
    if model.nq == model.nv:
        return (lambda: qpos - reference) if reference.any() else lambda: qpos
    difference = np.zeros(model.nv)

    def tangent() -> Array:
        mujoco.mj_differentiatePos(model, difference, 1.0, reference, qpos)
        return difference

    return tangent
