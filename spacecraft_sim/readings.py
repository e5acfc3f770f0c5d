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
from collections.abc import Callable

import mujoco
import numpy as np

from spacecraft_sim.checks import choices
from spacecraft_sim.mjcf import AXES, BUS

Array = np.ndarray
Getter = Callable[[], float]

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


class Readings:
    """The readings of one model and its data.

    Attributes:
        units: Reading names in their order, with their SI units.
    """

    def __init__(self, model: mujoco.MjModel, data: mujoco.MjData):

        self.units: dict[str, str] = {}
        self._getters: dict[str, Getter] = {}
        for i in range(model.nsensor):
            self._add_sensor(model, data, i)
        for name, unit, getter in _quasi_rigid(model, data):
            self._add(name, unit, getter)

    def select(self, names: tuple[str, ...]) -> Callable[[], list[float]]:
        """Returns a function that reads the named readings from the data as it then is.

        Args:
            names: Reading names.

        Raises:
            ValueError: If a name does not exist; the message lists those that do.
        """
        for name in names:
            if name not in self._getters:
                raise ValueError(choices("sensor", name, self._getters, where="the model"))
        getters = [self._getters[name] for name in names]
        return lambda: [getter() for getter in getters]

    def _add(self, name: str, unit: str, getter: Getter) -> None:
        if name in self.units:
            raise ValueError(f"two sensors give the reading {name!r}; rename one")
        self.units[name], self._getters[name] = unit, getter

    def _add_sensor(self, model: mujoco.MjModel, data: mujoco.MjData, i: int) -> None:
        name, kind = model.sensor(i).name, _S(model.sensor_type[i])
        start, size = int(model.sensor_adr[i]), int(model.sensor_dim[i])
        values = data.sensordata[start : start + size]
        unit = _UNITS.get(kind, "")
        if kind in (_S.mjSENS_JOINTPOS, _S.mjSENS_JOINTVEL) and _slides(model, i):
            unit = unit.replace("rad", "m")
        if kind in (_S.mjSENS_FRAMEQUAT, _S.mjSENS_BALLQUAT):
            for k, axis in enumerate(AXES):
                self._add(f"{name}_{axis}", unit, _rotation_component(values, k))
        elif size == 1:
            self._add(name, unit, lambda: values.item(0))
        else:
            suffixes = AXES if size == 3 else tuple(map(str, range(size)))
            for k, suffix in enumerate(suffixes):
                self._add(f"{name}_{suffix}", unit, lambda k=k: values.item(k))


def _slides(model: mujoco.MjModel, sensor: int) -> bool:
    joint = model.sensor_objid[sensor]
    return model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_SLIDE


def _rotation_component(quaternion: Array, k: int) -> Getter:
    """Component k of the rotation vector of a unit quaternion (w, x, y, z), shortest way round."""

    def getter() -> float:
        w, x, y, z = quaternion.tolist()
        sine = math.sqrt(x * x + y * y + z * z)
        angle = 2 * math.atan2(sine, abs(w))
        scale = angle / sine if sine > 1e-12 else 2.0
        return math.copysign(scale, w) * (x, y, z)[k]

    return getter


def _quasi_rigid(model: mujoco.MjModel, data: mujoco.MjData) -> list[tuple[str, str, Getter]]:
    """Readings of the momentum and of the rigid coordinates, if the bus turns on one joint."""
    bus = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, BUS)
    if bus < 0 or model.body_jntnum[bus] != 1:
        return []
    joint = int(model.body_jntadr[bus])
    kind = model.jnt_type[joint]
    if kind == mujoco.mjtJoint.mjJNT_HINGE:
        k = int(np.argmax(np.abs(model.jnt_axis[joint])))
        if model.jnt_axis[joint][k] == 1.0:
            return _about_hinge(model, data, int(model.jnt_dofadr[joint]), AXES[k])
    if kind == mujoco.mjtJoint.mjJNT_FREE:
        return _about_centre_of_mass(model, data, bus, int(model.jnt_dofadr[joint]))
    return []


def _about_hinge(
    model: mujoco.MjModel, data: mujoco.MjData, dof: int, axis: str
) -> list[tuple[str, str, Getter]]:
    M = undeformed_mass_matrix(model)
    J = float(M[dof, dof])
    momenta, qvel = np.zeros(model.nv), data.qvel

    def momentum() -> float:
        mujoco.mj_mulM(model, data, momenta, qvel)
        return momenta.item(dof)

    return [
        (f"angular_momentum_{axis}", "N m s", momentum),
        (f"quasi_rigid_angle_{axis}", "rad", _along(model, data, M[dof] / J)),
        (f"quasi_rigid_rate_{axis}", "rad/s", lambda: momentum() / J),
    ]


def _about_centre_of_mass(
    model: mujoco.MjModel, data: mujoco.MjData, bus: int, dof: int
) -> list[tuple[str, str, Getter]]:
    M = undeformed_mass_matrix(model)
    base = slice(dof, dof + 6)
    inverse = np.linalg.inv(M[base, base])
    rows = (inverse @ M[base])[3:]  # (3, nv): rotation of the bus plus G^T q of the flexible joints
    inverse_inertia = inverse[3:, 3:]
    momentum, rotation = data.subtree_angmom[bus], data.xmat[bus]

    def world(k: int) -> float:
        mujoco.mj_subtreeVel(model, data)
        return float(momentum[k])

    def rate(k: int) -> float:
        mujoco.mj_subtreeVel(model, data)
        return float(inverse_inertia[k] @ (momentum @ rotation.reshape(3, 3)))

    readings: list[tuple[str, str, Getter]] = []
    for k, axis in enumerate(AXES):
        readings += [
            (f"angular_momentum_{axis}", "N m s", lambda k=k: world(k)),
            (f"quasi_rigid_angle_{axis}", "rad", _along(model, data, rows[k])),
            (f"quasi_rigid_rate_{axis}", "rad/s", lambda k=k: rate(k)),
        ]
    return readings


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


def _along(model: mujoco.MjModel, data: mujoco.MjData, row: Array) -> Getter:
    """Returns a function that gives row . (qpos - qpos0), the difference in the tangent space."""
    qpos = data.qpos
    if model.nq == model.nv:
        offset = float(row @ model.qpos0)
        return lambda: float(row.dot(qpos)) - offset
    reference, difference = model.qpos0.copy(), np.zeros(model.nv)

    def getter() -> float:
        mujoco.mj_differentiatePos(model, difference, 1.0, reference, qpos)
        return float(row.dot(difference))

    return getter
