"""Compiled MJCF -> linear model by name: M q'' + D q' + K q = B u, y = y0 + C [q; q'].

q are the tangent coordinates at the reference configuration.  What is not linear there is refused.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo is a compiled module without type stubs)

from dataclasses import dataclass

import mujoco
import numpy as np

from spacecraft_sim import beam, mjcf
from spacecraft_sim.checks import choices
from spacecraft_sim.readings import Readings, undeformed_mass_matrix
from spacecraft_sim.scenario import Initial
from spacecraft_sim.spacecraft import Boom, Spacecraft

Array = np.ndarray

_STEP = 1e-6  # of the central differences of the readings, rad or m, and per s


@dataclass(frozen=True, slots=True, kw_only=True)
class Linearization:
    """The motion near the reference configuration.

    Attributes:
        M: Mass matrix, shape (nv, nv).
        D: Damping matrix, shape (nv, nv).
        K: Stiffness matrix, shape (nv, nv).
        B: Generalised force of each actuator at unit control, shape (nv, nu).
        C: Readings over positions and velocities, shape (ny, 2 nv).
        y0: Readings at rest in the reference configuration, shape (ny,).
        outputs: Reading names with their units.
        actuators: Actuator names.
        rigid: Indices of the degrees of freedom of the bus's own joint.
    """

    M: Array
    D: Array
    K: Array
    B: Array
    C: Array
    y0: Array
    outputs: dict[str, str]
    actuators: tuple[str, ...]
    rigid: tuple[int, ...]

    def eigenvalues(self) -> Array:
        """Returns the eigenvalues of the first-order form, shape (2 nv,), 1/s."""
        n = len(self.M)
        stiffness, damping = np.linalg.solve(self.M, self.K), np.linalg.solve(self.M, self.D)
        return np.linalg.eigvals(np.block([[np.zeros((n, n)), np.eye(n)], [-stiffness, -damping]]))


def linearize(model: mujoco.MjModel) -> Linearization:
    """Reads the linear model off a compiled model.

    Args:
        model: The model.

    Raises:
        ValueError: If something in it is not linear at the reference configuration: constraints,
            friction, springs that are not linear or not at rest, actuators with a bias.
    """
    _refuse_nonlinear(model)
    outputs, y0, C = _linear_readings(model)
    return Linearization(
        M=undeformed_mass_matrix(model),
        D=np.diag(model.dof_damping) + _actuator_damping(model),
        K=np.diag(_dof_stiffness(model)),
        B=actuator_forces(model),
        C=C,
        y0=y0,
        outputs=outputs,
        actuators=tuple(model.actuator(i).name for i in range(model.nu)),
        rigid=_rigid_dofs(model),
    )


def linearize_bus(model: mujoco.MjModel) -> Linearization:
    """Reads the linear model off a machine whose bus has a joint of its own.

    Args:
        model: The compiled model.

    Raises:
        ValueError: As `linearize`; or if no body is called `bus`, or that body has no joint.
    """
    linear = linearize(model)
    bodies = [model.body(i).name for i in range(1, model.nbody)]
    if mjcf.BUS not in bodies:
        named = [name for name in bodies if name]
        raise ValueError(choices("body", mjcf.BUS, named, where="the MJCF of the machine"))
    if not linear.rigid:
        raise ValueError(
            f"the body {mjcf.BUS!r} has no joint; give it a free joint or a hinge to turn on"
        )
    return linear


def eigenvalues(model: mujoco.MjModel) -> Array:
    """Returns the eigenvalues of the free motion at the reference configuration, shape (2 nv,).

    Gravity, tendons and whatever else `linearize` refuses are differenced.

    Args:
        model: The compiled model.
    """
    data, n = mujoco.MjData(model), model.nv

    def accelerations(dq: Array, dv: Array) -> Array:
        data.qpos[:] = model.qpos0
        mujoco.mj_integratePos(model, data.qpos, dq, 1.0)
        data.qvel[:] = dv
        mujoco.mj_forward(model, data)
        return data.qacc.copy()

    none, unit = np.zeros(n), np.eye(n) * _STEP
    columns = [(accelerations(e, none) - accelerations(-e, none)) / (2 * _STEP) for e in unit]
    columns += [(accelerations(none, e) - accelerations(none, -e)) / (2 * _STEP) for e in unit]
    lower = np.array(columns).T.reshape(n, 2 * n)
    return np.linalg.eigvals(np.vstack([np.eye(n, 2 * n, n), lower]))


def initial_state(
    model: mujoco.MjModel, spacecraft: Spacecraft, initial: Initial
) -> tuple[Array, Array]:
    """Returns the tangent coordinates and velocities of an initial state, each of shape (nv,).

    Args:
        model: The compiled spacecraft.
        spacecraft: The machine, for the hinge rules of its booms.
        initial: Attitude, rate and boom deflection.

    Raises:
        ValueError: If the bus cannot turn the way that is asked for, or there is no such joint.
    """
    tangent, rate = np.zeros(model.nv), np.zeros(model.nv)
    _turn_bus(model, spacecraft, initial, tangent, rate)
    for boom in spacecraft.booms:
        for name, angle in mjcf.bent(boom, initial.boom_mode, initial.boom_amplitude).items():
            tangent[model.joint(name).dofadr[0]] = angle
    for name, start, values in (
        ("joints", tangent, initial.joints),
        ("joint_rates", rate, initial.joint_rates),
    ):
        for joint, value in values.items():
            start[_scalar_dof(model, joint, f"initial.{name}")] = value
    return tangent, rate


def _turn_bus(
    model: mujoco.MjModel, spacecraft: Spacecraft, initial: Initial, tangent: Array, rate: Array
) -> None:
    number = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, mjcf.BUS)
    if number < 0:
        for name, vector in (("attitude", initial.attitude), ("rate", initial.rate)):
            if any(vector):
                raise ValueError(
                    f"initial.{name} = {vector}: {spacecraft.name} has no {mjcf.BUS!r}; set "
                    "initial.joints and initial.joint_rates"
                )
        return
    joint = model.joint(int(model.body_jntadr[number]))
    kind, dof = mujoco.mjtJoint(joint.type[0]), int(joint.dofadr[0])
    if kind in (mujoco.mjtJoint.mjJNT_FREE, mujoco.mjtJoint.mjJNT_BALL):
        turn = dof + (3 if kind == mujoco.mjtJoint.mjJNT_FREE else 0)
        tangent[turn : turn + 3], rate[turn : turn + 3] = initial.attitude, initial.rate
    else:
        axis = joint.axis
        for name, vector in (("attitude", initial.attitude), ("rate", initial.rate)):
            across = np.array(vector) - np.dot(vector, axis) * axis
            if np.any(across != 0):
                raise ValueError(f"initial.{name} = {vector}: the bus turns about {axis} alone")
        tangent[dof], rate[dof] = np.dot(initial.attitude, axis), np.dot(initial.rate, axis)


def _scalar_dof(model: mujoco.MjModel, name: str, key: str) -> int:
    joints = [model.joint(j) for j in range(model.njnt)]
    scalar = (mujoco.mjtJoint.mjJNT_HINGE, mujoco.mjtJoint.mjJNT_SLIDE)
    known = {j.name: int(j.dofadr[0]) for j in joints if mujoco.mjtJoint(j.type[0]) in scalar}
    if name not in known:
        raise ValueError(choices("joint", name, known, where=key))
    return known[name]


def planar_bus(model: mujoco.MjModel, spacecraft: Spacecraft) -> tuple[float, float, Boom]:
    """Returns bus inertia about z, root radius and boom of a machine that (1.4)-(1.5) describe.

    Args:
        model: The compiled spacecraft.
        spacecraft: The machine.

    Returns:
        J0, kg m^2; r, m; one of the two booms.

    Raises:
        ValueError: If there are not two equal booms on opposite sides, without tip masses.
    """
    twins = {repr(boom.model_copy(update={"name": "", "root": ""})) for boom in spacecraft.booms}
    roots = [model.site(boom.root).pos for boom in spacecraft.booms]
    if len(roots) != 2 or len(twins) != 1 or np.any(np.abs(roots[0] + roots[1]) > 1e-9):
        raise ValueError(
            f"{spacecraft.name}: a Galerkin model needs two equal booms rooted on opposite sides; "
            'this has others: set reduced.source = "mjcf"'
        )
    boom, radius = spacecraft.booms[0], float(np.linalg.norm(roots[0]))
    if boom.tip_mass:
        raise ValueError(
            f"booms.*.tip_mass = {boom.tip_mass}: the cantilever shapes of the Galerkin model have "
            'none; set reduced.source = "mjcf"'
        )
    about_z = _rigid_dofs(model)[-1]
    booms = beam.total_inertia(
        bus_inertia=0.0,
        root_radius=radius,
        length=boom.length,
        linear_density=boom.linear_density,
    )
    return float(undeformed_mass_matrix(model)[about_z, about_z] - booms), radius, boom


def _refuse_nonlinear(model: mujoco.MjModel) -> None:
    faults = []
    if model.neq:
        faults.append("equality constraints")
    if np.any(model.jnt_limited) or model.ntendon:
        faults.append("joint limits or tendons")
    if np.any(model.dof_frictionloss):
        faults.append("dry friction")
    if np.any(model.jnt_stiffnesspoly):
        faults.append("polynomial joint stiffness")
    if np.any(model.dof_dampingpoly):
        faults.append("polynomial joint damping")
    if model.opt.density or model.opt.viscosity:
        faults.append("a medium with density or viscosity")
    if np.any(model.qpos_spring != model.qpos0):
        faults.append("springs that pull at the reference configuration (springref)")
    if np.any(model.actuator_biastype != mujoco.mjtBias.mjBIAS_NONE):
        faults.append("actuators with a bias (position or velocity servos)")
    if np.any(model.opt.gravity):
        faults.append("gravity")
    if faults:
        raise ValueError(f"the model is not linear at its reference: it has {'; '.join(faults)}")


def _dof_stiffness(model: mujoco.MjModel) -> Array:
    per_dof = np.zeros(model.nv)
    width = {int(mujoco.mjtJoint.mjJNT_FREE): 6, int(mujoco.mjtJoint.mjJNT_BALL): 3}
    for j in range(model.njnt):
        start = model.jnt_dofadr[j]
        per_dof[start : start + width.get(int(model.jnt_type[j]), 1)] = model.jnt_stiffness[j]
    return per_dof


def _rigid_dofs(model: mujoco.MjModel) -> tuple[int, ...]:
    bus = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, mjcf.BUS)
    if bus < 0:
        return ()
    start = int(model.body_dofadr[bus])
    return tuple(range(start, start + int(model.body_dofnum[bus])))


def actuator_forces(model: mujoco.MjModel) -> Array:
    """Returns the generalised force of each actuator at unit control, shape (nv, nu).

    Args:
        model: A compiled model, at its reference configuration.
    """
    data, B = mujoco.MjData(model), np.zeros((model.nv, model.nu))
    for i in range(model.nu):
        mujoco.mj_resetData(model, data)
        if model.actuator_dyntype[i] == mujoco.mjtDyn.mjDYN_NONE:
            data.ctrl[i] = 1.0
        else:
            data.act[model.actuator_actadr[i]] = 1.0
        mujoco.mj_forward(model, data)
        B[:, i] = data.qfrc_actuator
    return B


def _actuator_damping(model: mujoco.MjModel) -> Array:
    """Motors may carry viscous damping of their own, along their transmission."""
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    moment = np.zeros((model.nu, model.nv))
    if model.nu:
        mujoco.mju_sparse2dense(
            moment,
            data.actuator_moment.ravel(),
            data.moment_rownnz.ravel(),
            data.moment_rowadr.ravel(),
            data.moment_colind.ravel(),
        )
    return moment.T @ (model.actuator_damping[:, None] * moment)


def _linear_readings(model: mujoco.MjModel) -> tuple[dict[str, str], Array, Array]:
    data = mujoco.MjData(model)
    readings = Readings(model, data)
    read = readings.select(tuple(readings.units))

    def at(dq: Array, dv: Array) -> Array:
        data.qpos[:] = model.qpos0
        mujoco.mj_integratePos(model, data.qpos, dq, 1.0)
        data.qvel[:] = dv
        mujoco.mj_step1(model, data)
        return np.array(read())

    none, unit = np.zeros(model.nv), np.eye(model.nv) * _STEP
    columns = [(at(e, none) - at(-e, none)) / (2 * _STEP) for e in unit]
    columns += [(at(none, e) - at(none, -e)) / (2 * _STEP) for e in unit]
    return readings.units, at(none, none), np.array(columns).T.reshape(len(readings.units), -1)
