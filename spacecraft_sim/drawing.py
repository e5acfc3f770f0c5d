"""What a compiled spacecraft looks like: its shapes, its jets, and where its bodies are in time."""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo is a compiled module without type stubs)

from dataclasses import dataclass

import mujoco
import numpy as np

from spacecraft_sim import mjcf
from spacecraft_sim.spacecraft import Spacecraft
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Shape:
    """A solid fixed to a body.

    Attributes:
        body: Name of the body.
        kind: `box`, `capsule`, `cylinder`, `sphere` or `ellipsoid`.
        size: Half-lengths of a box or ellipsoid; radius and half-length along z of the others, m.
        position: Centre in the body frame, shape (3,), m.
        quaternion: Orientation in the body frame, (w, x, y, z).
        rgba: Colour, each from 0 to 1.
    """

    body: str
    kind: str
    size: Array
    position: Array
    quaternion: Array
    rgba: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Jet:
    """A place on a body where a thruster channel acts.

    Attributes:
        channel: Name of the thruster channel.
        body: Name of the body.
        position: Where, in the body frame, shape (3,), m.
        force: Force on the body at unit thrust, body frame, shape (3,).
        torque: Pure torque on the body at unit thrust, body frame, shape (3,), m.
    """

    channel: str
    body: str
    position: Array
    force: Array
    torque: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Drawing:
    """The shapes of a machine and the motion of its bodies.

    Attributes:
        shapes: Solids.
        jets: Places where thrusters act.
        time: Instants, shape (n,), s.
        positions: Body origins in the world by body name, each of shape (n, 3), m.
        quaternions: Body orientations (w, x, y, z) by body name, each of shape (n, 4).
        booms: Bodies of each boom from root to tip, by boom name.
        tips: Position of each boom's tip in its last body, by boom name, m.
        turned: How many times too far sprung joints are turned.
        bending: How many times too far booms, which are as they are, are to be drawn bent.
    """

    shapes: tuple[Shape, ...]
    jets: tuple[Jet, ...]
    time: Array
    positions: dict[str, Array]
    quaternions: dict[str, Array]
    booms: dict[str, tuple[str, ...]]
    tips: dict[str, Array]
    turned: float = 1.0
    bending: float = 1.0


def draw(
    model: mujoco.MjModel,
    spacecraft: Spacecraft,
    trajectory: Trajectory,
    *,
    frames: int = 2000,
    factor: float = 1.0,
) -> Drawing:
    """Draws a flight from its recorded coordinates.

    Args:
        model: The compiled spacecraft.
        spacecraft: The machine.
        trajectory: A flight of the MuJoCo plant.
        frames: How many instants at most; the rows are thinned evenly.
        factor: How many times too far elastic parts are drawn.

    Returns:
        Shapes and motion.
    """
    rows = np.unique(np.linspace(0, len(trajectory.time) - 1, frames).astype(int))
    names = list(trajectory.signals)[-model.nq :]
    coordinates = np.column_stack([trajectory[name][rows] for name in names])
    joints = sprung_joints(model, spacecraft)
    if factor != 1.0:
        _turn(model, joints, coordinates, factor)
    bodies = [model.body(b).name for b in range(1, model.nbody)]
    data = mujoco.MjData(model)
    positions, quaternions = np.zeros((2, len(rows), len(bodies), 4))
    places, qpos, xpos, xquat = positions[:, :, :3], data.qpos, data.xpos[1:], data.xquat[1:]
    for k in range(len(rows)):
        qpos[:] = coordinates[k]
        mujoco.mj_kinematics(model, data)
        places[k], quaternions[k] = xpos, xquat
    return Drawing(
        shapes=_shapes(model),
        jets=_jets(model, spacecraft),
        time=trajectory.time[rows],
        positions={name: positions[:, b, :3] for b, name in enumerate(bodies)},
        quaternions={name: quaternions[:, b] for b, name in enumerate(bodies)},
        booms={b.name: (f"{b.name}_0", *mjcf.hinge_names(b)) for b in spacecraft.booms},
        tips={b.name: model.site(f"{b.name}_tip").pos.copy() for b in spacecraft.booms},
        turned=factor if joints else 1.0,
        bending=factor if spacecraft.booms else 1.0,
    )


def sprung_joints(model: mujoco.MjModel, spacecraft: Spacecraft) -> list[int]:
    """Returns the joints of the elastic parts of a free machine; none if it has booms, which bend.

    Args:
        model: The compiled spacecraft.
        spacecraft: The machine.
    """
    free = model.njnt and model.jnt_type[0] == mujoco.mjtJoint.mjJNT_FREE
    if spacecraft.booms or not free:
        return []
    return np.flatnonzero(model.jnt_stiffness > 0).tolist()


def largest_turn(model: mujoco.MjModel, joints: list[int], trajectory: Trajectory) -> float:
    """Returns how far the joint goes that goes farthest from where its spring is at rest, rad or m.

    Args:
        model: The compiled spacecraft.
        joints: Joints.
        trajectory: A flight with the machine's coordinates as its last signals.
    """
    names, largest = list(trajectory.signals)[-model.nq :], 0.0
    for j in joints:
        a, rest = model.jnt_qposadr[j], model.qpos_spring
        if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_BALL:
            q = np.column_stack([trajectory[name] for name in names[a : a + 4]])
            largest = max(
                largest, float(2 * np.arccos(np.clip(np.abs(q @ rest[a : a + 4]), 0, 1)).max())
            )
        else:
            largest = max(largest, float(np.abs(trajectory[names[a]] - rest[a]).max()))
    return largest


def _turn(model: mujoco.MjModel, joints: list[int], coordinates: Array, factor: float) -> None:
    """Moves joints away from where their springs are at rest, in place."""
    rest = model.qpos_spring
    for j in joints:
        a = model.jnt_qposadr[j]
        if model.jnt_type[j] == mujoco.mjtJoint.mjJNT_BALL:
            for q in coordinates[:, a : a + 4]:
                velocity = np.zeros(3)
                mujoco.mju_subQuat(velocity, q, rest[a : a + 4])
                q[:] = rest[a : a + 4]
                mujoco.mju_quatIntegrate(q, velocity, factor)
        else:
            coordinates[:, a] = rest[a] + factor * (coordinates[:, a] - rest[a])


def boom_points(drawing: Drawing, boom: str) -> tuple[Array, Array]:
    """Returns where the hinges and the tip of a boom are, and where they would be without bending.

    Args:
        drawing: Shapes and motion.
        boom: Name of the boom.

    Returns:
        Two arrays of shape (n frames, n points, 3), world frame, m.
    """
    bodies, turns = drawing.booms[boom], drawing.quaternions
    end = drawing.positions[bodies[-1]] + turned(turns[bodies[-1]], drawing.tips[boom])
    points = np.stack([*(drawing.positions[body] for body in bodies), end], axis=1)
    reach = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(points[0], axis=0), axis=1))]
    axis = turned(turns[bodies[0]], np.array([1.0, 0.0, 0.0]))
    return points, points[:, :1] + reach[:, None] * axis[:, None]


def turned(quaternion: Array, vector: Array) -> Array:
    """Returns vectors turned by quaternions, whatever shapes broadcast.

    Args:
        quaternion: (w, x, y, z), shape (..., 4).
        vector: Shape (..., 3).
    """
    w, v = quaternion[..., :1], quaternion[..., 1:]
    turn = 2 * cross(v, vector)
    return vector + w * turn + cross(v, turn)


def cross(a: Array, b: Array) -> Array:
    """Returns vector products, whatever shapes broadcast; numpy's own takes longer to begin.

    Args:
        a: Shape (..., 3).
        b: Shape (..., 3).
    """
    ax, ay, az = a[..., 0], a[..., 1], a[..., 2]
    bx, by, bz = b[..., 0], b[..., 1], b[..., 2]
    return np.stack([ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx], axis=-1)


_KINDS = {
    int(mujoco.mjtGeom.mjGEOM_BOX): "box",
    int(mujoco.mjtGeom.mjGEOM_CAPSULE): "capsule",
    int(mujoco.mjtGeom.mjGEOM_CYLINDER): "cylinder",
    int(mujoco.mjtGeom.mjGEOM_SPHERE): "sphere",
    int(mujoco.mjtGeom.mjGEOM_ELLIPSOID): "ellipsoid",
}


def _shapes(model: mujoco.MjModel) -> tuple[Shape, ...]:
    return tuple(
        Shape(
            body=model.body(int(model.geom_bodyid[g])).name,
            kind=_KINDS[int(model.geom_type[g])],
            size=model.geom_size[g].copy(),
            position=model.geom_pos[g].copy(),
            quaternion=model.geom_quat[g].copy(),
            rgba=model.geom_rgba[g].copy(),
        )
        for g in range(model.ngeom)
        if int(model.geom_type[g]) in _KINDS and model.geom_bodyid[g]
    )


def _jets(model: mujoco.MjModel, spacecraft: Spacecraft) -> tuple[Jet, ...]:
    jets = []
    for thruster in spacecraft.thrusters:
        for name in mjcf.motors(thruster):
            actuator = model.actuator(name)
            if actuator.trntype[0] != mujoco.mjtTrn.mjTRN_SITE:
                continue  # a joint motor acts nowhere in particular
            site = int(actuator.trnid[0])
            rotation = np.zeros(9)
            mujoco.mju_quat2Mat(rotation, model.site_quat[site])
            gear = rotation.reshape(3, 3) @ actuator.gear.reshape(2, 3).T
            jets.append(
                Jet(
                    channel=thruster.name,
                    body=model.body(int(model.site_bodyid[site])).name,
                    position=model.site_pos[site].copy(),
                    force=gear[:, 0],
                    torque=gear[:, 1],
                )
            )
    return tuple(jets)
