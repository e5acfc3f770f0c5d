"""What a law may know of a machine, from its compiled MJCF: gravity, inverse dynamics, inertia.

A law carries these with it, so they are plain values: they hold the compiled model as bytes, can be
pickled and compared, and load it when it is first asked for.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo is a compiled module without type stubs)

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import mujoco
import numpy as np

from spacecraft_sim import mjcf
from spacecraft_sim.checks import choices
from spacecraft_sim.readings import undeformed_mass_matrix

Array = np.ndarray
Vector = Sequence[float] | Array
_ROUNDING = 1e-9  # share of the largest inertia that a product of inertia may have for rounding


@dataclass(frozen=True, slots=True, kw_only=True)
class CompiledMechanism:
    """A mechanism in joint coordinates; whatever else the machine has is at rest.

    Attributes:
        binary: The compiled model.
        joints: Joints, in the order of the coordinates.
    """

    binary: bytes
    joints: tuple[str, ...]

    @property
    def count(self) -> int:
        """How many joints there are, n."""
        return len(self.joints)

    def gravity(self, q: Vector) -> Array:
        """Returns g(q), the torques that hold the mechanism still, shape (n,), N m.

        Args:
            q: Joint angles, shape (n,), rad.
        """
        zero = np.zeros(len(self.joints))
        return self.inverse_dynamics(q, zero, zero)

    def inverse_dynamics(self, q: Vector, v: Vector, a: Vector) -> Array:
        """Returns A(q) a + b(q, v) + g(q), without springs and dampers, shape (n,), N m.

        Args:
            q: Joint angles, shape (n,), rad.
            v: Their rates, shape (n,), rad/s.
            a: Their accelerations, shape (n,), rad/s^2.
        """
        model, data, positions, dofs = _loaded(self.binary, self.joints)
        data.qpos[positions], data.qvel[dofs], data.qacc[dofs] = q, v, a
        mujoco.mj_kinematics(model, data)
        mujoco.mj_comPos(model, data)
        mujoco.mj_comVel(model, data)
        torques = np.zeros(model.nv)
        mujoco.mj_rne(model, data, 1, torques)
        return torques[dofs]


@dataclass(frozen=True, slots=True, kw_only=True)
class CompiledFlexibleMechanism:
    """Links that rotors drive through springs.

    Attributes:
        links: The links.
        rotors: Inertias of the rotors, kg m^2.
        stiffnesses: Of the springs, N m/rad.
    """

    links: CompiledMechanism
    rotors: tuple[float, ...]
    stiffnesses: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class CompiledBody:
    """A machine as one rigid body about its centre of mass.

    Attributes:
        inertia: Principal moments of inertia A, B, C, kg m^2.
    """

    inertia: tuple[float, float, float]


@lru_cache(maxsize=16)
def _loaded(
    binary: bytes, joints: tuple[str, ...]
) -> tuple[mujoco.MjModel, mujoco.MjData, Array, Array]:
    model = mujoco.MjModel.from_binary_path("model.mjb", {"model.mjb": binary})
    found = [model.joint(name) for name in joints]
    positions = np.array([int(joint.qposadr[0]) for joint in found])
    return model, mujoco.MjData(model), positions, np.array([int(j.dofadr[0]) for j in found])


def mechanism(model: mujoco.MjModel) -> CompiledMechanism:
    """Returns the mechanism whose joints are called `joint_1` .. `joint_n`.

    Args:
        model: A compiled machine.

    Raises:
        ValueError: If it has none, or further joints.
    """
    names = _numbered(model, "joint")
    if len(names) != model.njnt:
        raise ValueError(
            f"the law needs an arm with the joints joint_1 .. joint_n; this machine has "
            f"{', '.join(_joints(model))}"
        )
    return CompiledMechanism(binary=_binary(model), joints=names)


def flexible_mechanism(model: mujoco.MjModel) -> CompiledFlexibleMechanism:
    """Returns the links `link_k` with the rotors `rotor_k` and the springs `spring_k`.

    Args:
        model: A compiled machine whose springs are fixed tendons of the length q1 - q2.

    Raises:
        ValueError: If the machine is not of that form.
    """
    links, rotors = _numbered(model, "link"), _numbered(model, "rotor")
    if not links or len(links) != len(rotors) or len(links) + len(rotors) != model.njnt:
        raise ValueError(
            "the law needs links link_1 .. link_n and as many rotors rotor_1 ..; this machine has "
            f"{', '.join(_joints(model))}"
        )
    M = undeformed_mass_matrix(model)
    dofs = [int(model.joint(name).dofadr[0]) for name in rotors]
    alone = M[dofs].copy()
    alone[range(len(dofs)), dofs] = 0.0
    if np.any(np.abs(alone) > _ROUNDING * M.max()):
        raise ValueError(
            "the rotors must not be coupled to the links by inertia: hang them on the world"
        )
    springs = [model.tendon(k).name for k in range(model.ntendon)]
    stiffnesses = []
    for k, (link, rotor) in enumerate(zip(links, rotors, strict=True), start=1):
        if f"spring_{k}" not in springs:
            raise ValueError(choices("tendon", f"spring_{k}", springs, where="the machine"))
        tendon = model.tendon(f"spring_{k}")
        first, count = int(model.tendon_adr[tendon.id]), int(model.tendon_num[tendon.id])
        ends = {
            model.joint(int(model.wrap_objid[w])).name: float(model.wrap_prm[w])
            for w in range(first, first + count)
        }
        if ends != {link: 1.0, rotor: -1.0} or np.any(model.tendon_lengthspring[tendon.id]):
            raise ValueError(f"spring_{k} must be of the length {link} - {rotor}, zero unloaded")
        stiffnesses.append(float(model.tendon_stiffness[tendon.id]))
    return CompiledFlexibleMechanism(
        links=CompiledMechanism(binary=_binary(model), joints=links),
        rotors=tuple(M[dofs, dofs].tolist()),
        stiffnesses=tuple(stiffnesses),
    )


def body(model: mujoco.MjModel) -> CompiledBody:
    """Returns a machine as one rigid body, its joints at the reference configuration.

    Args:
        model: A compiled machine with a bus, and a site `principal` aligned with the principal axes
            of the whole.

    Raises:
        ValueError: If there is no such site, or its axes are not principal.
    """
    sites = [model.site(k).name for k in range(model.nsite)]
    if "principal" not in sites:
        raise ValueError(
            f"the law needs a body '{mjcf.BUS}' with a site 'principal' along its principal axes; "
            f"this machine has the joints {', '.join(_joints(model))} and "
            f"{'the sites ' + ', '.join(sites) if sites else 'no site'}"
        )
    bus = mujoco.mj_name2id(model, mujoco.mjtObj.mjOBJ_BODY, mjcf.BUS)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    axes = data.site("principal").xmat.reshape(3, 3)
    tensor = np.zeros((3, 3))
    for k in range(bus, model.nbody):
        r = data.xipos[k] - data.subtree_com[bus]
        R = data.ximat[k].reshape(3, 3)
        tensor += R @ np.diag(model.body_inertia[k]) @ R.T
        tensor += model.body_mass[k] * (r @ r * np.eye(3) - np.outer(r, r))
    inertia = axes.T @ tensor @ axes
    products = inertia - np.diag(np.diag(inertia))
    if np.max(np.abs(products)) > _ROUNDING * np.max(inertia):
        raise ValueError(
            "the axes of the site 'principal' are not principal: largest product of inertia "
            f"{np.max(np.abs(products)):.6g} kg m^2"
        )
    A, B, C = np.diag(inertia).tolist()
    return CompiledBody(inertia=(A, B, C))


def _joints(model: mujoco.MjModel) -> list[str]:
    return [model.joint(k).name for k in range(model.njnt)]


def _numbered(model: mujoco.MjModel, prefix: str) -> tuple[str, ...]:
    """prefix_1, prefix_2, .. as far as there are such joints."""
    names = _joints(model)
    count = next(k for k in range(len(names) + 1) if f"{prefix}_{k + 1}" not in names)
    return tuple(f"{prefix}_{k + 1}" for k in range(count))


def _binary(model: mujoco.MjModel) -> bytes:
    buffer = np.zeros(mujoco.mj_sizeModel(model), dtype=np.uint8)
    mujoco.mj_saveModel(model, None, buffer)
    return buffer.tobytes()
