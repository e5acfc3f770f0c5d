"""Compiled MJCF with a free joint -> bus with elastic parts.

The mass matrix at the reference configuration has the blocks bb (the free joint), bf and ff (all
other joints).  Eliminating the bus gives the matrices of Sokolov (2004), (17), as Schur
complements: D = ff - bf^T bb^-1 bf, G^T the angular rows of bb^-1 bf, J^-1 the angular block of
bb^-1.  They are those of the paper for point masses, and right for parts with inertia of their own;
the origin of the bus frame need not be the centre of mass.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo is a compiled module without type stubs)

import copy

import mujoco
import numpy as np

from spacecraft_sim.elastic_modes import ElasticModel
from spacecraft_sim.readings import undeformed_mass_matrix

Array = np.ndarray

_LEAST_LENGTH = 1e-3  # m: nothing that slides is nearer than that to the centre of mass
_LISTED = 4  # joints that an error names
_PROBE = 0.1  # rad or m, and per s: springs of joints are linear that far, others need not be


def elastic_model(model: mujoco.MjModel) -> ElasticModel:
    """Reads the elastic structure off a compiled model.

    Args:
        model: One free body that carries everything; each other joint (hinge, slide or ball) is
            elastic.  The reference configuration qpos0 is the undeformed one.

    Returns:
        The structure, in the axes of the body with the free joint.

    Raises:
        ValueError: If the model is not such a structure, naming everything at fault: no free joint
            or several, a joint without stiffness or with negative damping, springs that are not
            linear or not at rest, gravity, contacts, constraints, servos, other passive forces.
    """
    if found := faults(model):
        raise ValueError(f"the model is not a free bus with elastic parts: {'; '.join(found)}")
    stiffness, damping = _stiffness(model), model.dof_damping[6:].copy()
    _refuse_other_forces(model, stiffness, damping)
    M = undeformed_mass_matrix(model)
    bb, bf, ff = M[:6, :6], M[:6, 6:], M[6:, 6:]
    inverse = np.linalg.inv(bb)
    G = (inverse @ bf)[3:].T
    J = np.linalg.inv(inverse[3:, 3:])
    D = ff - bf.T @ inverse @ bf
    return ElasticModel(
        D=(D + D.T) / 2,
        B=np.diag(damping),
        C=np.diag(stiffness),
        G=G,
        H=J @ G.T,
        J=(J + J.T) / 2,
        coordinates=_coordinates(model),
        travel=_travel(model),
        scale=_scale(model),
    )


def faults(model: mujoco.MjModel) -> list[str]:
    """Returns what keeps a model from being a free bus with linear elastic parts.

    Args:
        model: A compiled model.
    """
    free = np.flatnonzero(model.jnt_type == mujoco.mjtJoint.mjJNT_FREE)
    if len(free) != 1:
        several = f"{len(free)}, of {', '.join(_body_of(model, j) for j in free)}"
        has = several if len(free) else _instead(model)
        return [f"it needs one free joint, on the bus; it has {has}"]
    bus = int(model.jnt_bodyid[free[0]])
    found = []
    loose = [j for j in range(model.njnt) if model.body_rootid[model.jnt_bodyid[j]] != bus]
    if loose or free[0] != 0:
        others = sorted({_body_of(model, j) for j in loose})
        found.append(
            f"the body with the free joint, {_body_of(model, free[0])}, must come first and carry "
            f"all joints; beside it move {others}"
        )
    if model.njnt == 1:
        found.append("no joint but the free one: nothing in it is elastic")
    return found or _joint_faults(model) + _world_faults(model)


def _instead(model: mujoco.MjModel) -> str:
    """What joints there are where none is free."""
    kinds = [mujoco.mjtJoint(kind).name.removeprefix("mjJNT_").lower() for kind in model.jnt_type]
    joints = [f"{kind} {_name(model, j)}" for j, kind in enumerate(kinds)]
    more = ", ..." if len(joints) > _LISTED else ""
    return f"none, but {', '.join(joints[:_LISTED])}{more}" if joints else "no joint at all"


def with_elastic_masses(model: mujoco.MjModel, factor: float) -> mujoco.MjModel:
    """Returns the model with other masses, and inertias, of all bodies that move elastically.

    Springs and dampers stay as they are, and so does the bus with what is welded to it.

    Args:
        model: A compiled model as `elastic_model` takes it.
        factor: What masses and inertias are multiplied by.
    """
    lighter = copy.copy(model)
    moving = elastic_bodies(model)
    lighter.body_mass[moving] *= factor
    lighter.body_inertia[moving] *= factor
    mujoco.mj_setConst(lighter, mujoco.MjData(lighter))
    return lighter


def elastic_bodies(model: mujoco.MjModel) -> Array:
    """Returns the bodies that move elastically: all that are not welded to the bus.

    Args:
        model: A compiled model as `elastic_model` takes it.
    """
    bus = int(model.jnt_bodyid[0])
    return np.flatnonzero((model.body_weldid != bus) & (model.body_rootid == bus))


def _joint_faults(model: mujoco.MjModel) -> list[str]:
    faults = []
    of_bus = [model.jnt_stiffness[0], *model.dof_damping[:6], *model.dof_armature[:6]]
    if np.any(np.array(of_bus) != 0):
        faults.append("the free joint has stiffness, damping or armature; a bus in flight has none")
    for j in range(1, model.njnt):
        if not model.jnt_stiffness[j] > 0:
            faults.append(
                f"joint {_name(model, j)} has stiffness {model.jnt_stiffness[j]}, needs > 0: what "
                "moves freely is not elastic; give it a spring, or remove the joint to weld it"
            )
    negative = [k for k in range(6, model.nv) if not model.dof_damping[k] >= 0]
    for k in negative:
        name = _name(model, int(model.dof_jntid[k]))
        faults.append(f"joint {name} has damping {model.dof_damping[k]}, needs >= 0")
    if np.any(model.jnt_stiffnesspoly) or np.any(model.dof_dampingpoly):
        faults.append("polynomial stiffness or damping; give one number each")
    if np.any(model.qpos_spring != model.qpos0):
        faults.append("springs that pull at the reference configuration; set springref = ref")
    blocked = sorted(
        {_name(model, int(model.dof_jntid[6 + k])) for k in np.flatnonzero(_travel(model) <= 0)}
    )
    if blocked:
        faults.append(f"joints at a limit in the reference configuration: {', '.join(blocked)}")
    if np.any(model.dof_frictionloss) or np.any(model.tendon_frictionloss):
        faults.append("dry friction (frictionloss)")
    return faults


def _world_faults(model: mujoco.MjModel) -> list[str]:
    faults, off = [], model.opt.disableflags
    if np.any(model.opt.gravity):
        faults.append(f'gravity is on: {model.opt.gravity}; set <option gravity="0 0 0"/>')
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    if not off & mujoco.mjtDisableBit.mjDSBL_CONTACT and np.count_nonzero(touching) > 1:
        faults.append('contacts are on; set <flag contact="disable"/> or contype = conaffinity = 0')
    if model.opt.density or model.opt.viscosity:
        faults.append("the medium has density or viscosity; a spacecraft flies in vacuum")
    if model.neq:
        faults.append(f"{model.neq} equality constraints")
    for flag, what in (("SPRING", "springs"), ("DAMPER", "dampers")):
        if off & getattr(mujoco.mjtDisableBit, f"mjDSBL_{flag}"):
            faults.append(f"{what} are disabled by <flag>")
    servos = np.any(model.actuator_biastype != mujoco.mjtBias.mjBIAS_NONE)
    if servos or np.any(model.actuator_damping) or np.any(model.actuator_armature):
        faults.append("actuators with a bias, damping or armature (servos); use <motor>")
    return faults


def _refuse_other_forces(model: mujoco.MjModel, stiffness: Array, damping: Array) -> None:
    """Moves one coordinate after the other and asks MuJoCo for the passive force.

    Tendons, flexes, plugins and whatever else may act pass no list of properties, but this does.
    """
    data, n = mujoco.MjData(model), model.nv - 6
    names = _coordinates(model)
    for k in range(n):
        for what, constant in (("displacement", stiffness[k]), ("rate", damping[k])):
            move = np.zeros(model.nv)
            move[6 + k] = _PROBE
            mujoco.mj_resetData(model, data)
            if what == "displacement":
                mujoco.mj_integratePos(model, data.qpos, move, 1.0)
            else:
                data.qvel[:] = move
            mujoco.mj_fwdPosition(model, data)
            mujoco.mj_fwdVelocity(model, data)
            expected = -constant * move
            off = np.abs(data.qfrc_passive - expected)
            if np.max(off) > 1e-9 * _PROBE * np.max(np.r_[stiffness, damping]):
                where = int(np.argmax(off))
                at = names[where - 6] if where >= 6 else "the bus"
                raise ValueError(
                    f"passive forces act beside the springs and dampers of the joints: a {what} of "
                    f"{_PROBE} of {names[k]} gives {data.qfrc_passive[where]:.6g} at {at}, not "
                    f"{expected[where]:.6g}; remove springs of tendons, flexes and plugins"
                )


def _stiffness(model: mujoco.MjModel) -> Array:
    return np.repeat(model.jnt_stiffness[1:], [_width(model, j) for j in _parts(model)])


def _coordinates(model: mujoco.MjModel) -> tuple[str, ...]:
    names = []
    for j in _parts(model):
        ball = _width(model, j) == 3
        names += [_name(model, j) + f"_{axis}" for axis in "xyz"] if ball else [_name(model, j)]
    return tuple(names)


def _travel(model: mujoco.MjModel) -> Array:
    """Deflection at which each coordinate meets a limit of its joint, shape (n,), rad or m."""
    travel = []
    for j in _parts(model):
        least = np.inf
        if model.jnt_limited[j]:
            low, high = model.jnt_range[j]
            at = model.qpos0[model.jnt_qposadr[j]]
            ball = _width(model, j) == 3
            turned = 2 * np.arccos(np.clip(abs(at), 0.0, 1.0))  # of a ball joint, from its zero
            least = high - turned if ball else min(at - low, high - at)
        travel += [least - model.jnt_margin[j]] * _width(model, j)
    return np.array(travel)


def _scale(model: mujoco.MjModel) -> Array:
    """1 rad for what turns; for what slides, how far its body is from the centre of mass, m."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    centre, scale = data.subtree_com[int(model.jnt_bodyid[0])], []
    for j in _parts(model):
        slides = model.jnt_type[j] == mujoco.mjtJoint.mjJNT_SLIDE
        away = np.linalg.norm(data.subtree_com[int(model.jnt_bodyid[j])] - centre)
        scale += [max(float(away), _LEAST_LENGTH) if slides else 1.0] * _width(model, j)
    return np.array(scale)


def _parts(model: mujoco.MjModel) -> range:
    return range(1, model.njnt)


def _width(model: mujoco.MjModel, joint: int) -> int:
    return 3 if model.jnt_type[joint] == mujoco.mjtJoint.mjJNT_BALL else 1


def _name(model: mujoco.MjModel, joint: int) -> str:
    """The joint's name, or its body's and its number where it has none."""
    body = int(model.jnt_bodyid[joint])
    given = model.joint(joint).name
    return given or f"{_body_of(model, joint)}.joint{joint - int(model.body_jntadr[body]) + 1}"


def _body_of(model: mujoco.MjModel, joint: int | np.integer) -> str:
    body = int(model.jnt_bodyid[joint])
    return model.body(body).name or f"body{body}"
