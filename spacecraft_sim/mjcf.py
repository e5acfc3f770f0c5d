"""Spacecraft -> MJCF: boom chains grown on the bus, and the two forms of the model.

`assemble` gives the machine itself, which `export` writes as one file for plain MuJoCo.  `compile`
adds what a flight needs: a time step, inputs that may change linearly in time, and disturbance
torques on the bus.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo is a compiled module without type stubs)

from collections.abc import Iterable, Mapping
from pathlib import Path
from xml.etree import ElementTree

import mujoco
import numpy as np

from spacecraft_sim import beam
from spacecraft_sim.checks import choices
from spacecraft_sim.spacecraft import Boom, Spacecraft, Thruster

BUS = "bus"  # the body that carries booms, thrusters and disturbances
AXES = ("x", "y", "z")
_THINNESS = 1e-6  # share of a link's bending inertia about its own axis: MuJoCo wants it positive
_RADIUS = 0.04  # drawn radius of a boom, m


def assemble(spacecraft: Spacecraft) -> mujoco.MjSpec:
    """Grows the booms of a spacecraft on its bus.

    Args:
        spacecraft: The machine.

    Returns:
        The complete model, with a site `<boom>_tip` and a position sensor of that name for each
        boom: the tip in the frame of the root site, m.

    Raises:
        ValueError: If the MJCF is missing or broken, or lacks a body, site or actuator.
    """
    try:
        spec = mujoco.MjSpec.from_file(str(spacecraft.xml))
    except (ValueError, OSError) as error:
        raise ValueError(f"{spacecraft.xml}: {error}") from error
    if spacecraft.booms:
        _bus(spec, spacecraft)
    for boom in spacecraft.booms:
        _grow(spec, boom, spacecraft)
    actuators = [actuator.name for actuator in spec.actuators]
    for name in (a for names in channels(spacecraft, ()).values() for a in names):
        if name not in actuators:
            raise ValueError(choices("actuator", name, actuators, where=spacecraft.xml.name))
    spec.modelname = spacecraft.name
    return spec


def _bus(spec: mujoco.MjSpec, spacecraft: Spacecraft):
    """The body that carries booms and disturbances; machines without either need none."""
    if (bus := spec.body(BUS)) is None:
        names = [body.name for body in spec.bodies if body.name != "world"]
        raise ValueError(choices("body", BUS, names, where=spacecraft.xml.name))
    return bus


def read(path: Path) -> mujoco.MjModel:
    """Compiles any MJCF file as it stands.

    Args:
        path: The file.

    Raises:
        ValueError: If it is missing or broken.
    """
    if not path.is_file():
        raise ValueError(f"{path}: no such file")
    try:
        return mujoco.MjModel.from_xml_path(str(path))
    except (ValueError, OSError) as error:
        raise ValueError(f"{path}: {error}") from error


def motors(thruster: Thruster) -> tuple[str, ...]:
    """Returns the names of the MJCF actuators that a thruster channel fires together.

    Args:
        thruster: The channel.
    """
    return thruster.actuators or (thruster.name,)


def channels(spacecraft: Spacecraft, disturbances: Iterable[str]) -> dict[str, tuple[str, ...]]:
    """Returns the inputs of a flight and the actuators that each of them drives.

    Args:
        spacecraft: The machine.
        disturbances: Names of disturbance inputs.
    """
    wiring = {thruster.name: motors(thruster) for thruster in spacecraft.thrusters}
    return wiring | {name: (name,) for name in disturbances}


def input_units(model: mujoco.MjModel, wiring: Mapping[str, tuple[str, ...]]) -> dict[str, str]:
    """Returns the units of inputs: N of those that push, N m of those that turn.

    Args:
        model: The compiled spacecraft.
        wiring: The actuators of each input.
    """
    return {
        name: "N" if any(_pushes(model, actuator) for actuator in actuators) else "N m"
        for name, actuators in wiring.items()
    }


def _pushes(model: mujoco.MjModel, name: str) -> bool:
    actuator = model.actuator(name)
    if actuator.trntype[0] == mujoco.mjtTrn.mjTRN_SITE:
        return bool(np.any(actuator.gear[:3]))
    return model.jnt_type[actuator.trnid[0]] == mujoco.mjtJoint.mjJNT_SLIDE


def compile(
    spacecraft: Spacecraft, *, timestep: float, disturbances: Iterable[str] = ()
) -> mujoco.MjModel:
    """Compiles the model of a flight.

    Every thruster motor becomes an integrator: its activation is the thrust and its control the
    slope of the thrust, so that the four stages of RK4 see a thrust that is linear in time.

    Args:
        spacecraft: The machine.
        timestep: Integration step, s.
        disturbances: Names `disturbance_<axis>` of torques on the bus to add as inputs.

    Returns:
        The model: RK4, without automatic reset.

    Raises:
        ValueError: If the machine has gravity or contacts on, or a thruster is not a plain motor.
    """
    spec, disturbances = assemble(spacecraft), tuple(disturbances)
    for name in disturbances:
        axis = _axis_of(name)
        site = _bus(spec, spacecraft).add_site(name=name)
        spec.add_actuator(
            name=name,
            target=site.name,
            trntype=mujoco.mjtTrn.mjTRN_SITE,
            gear=np.r_[0.0, 0.0, 0.0, np.eye(3)[axis]],
        )
    driven = {a for names in channels(spacecraft, disturbances).values() for a in names}
    for actuator in spec.actuators:
        if actuator.name in driven:
            _follow_lines(actuator, spacecraft)
    spec.option.timestep = timestep
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_RK4
    spec.option.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    try:
        model = spec.compile()
    except ValueError as error:
        raise ValueError(f"{spacecraft.xml}: {error}") from error
    _refuse_what_does_not_float(model, spacecraft)
    _refuse_other_masses(model, spacecraft)
    return model


def _axis_of(disturbance: str) -> int:
    known = {f"disturbance_{axis}": k for k, axis in enumerate(AXES)}
    if disturbance not in known:
        raise ValueError(choices("disturbance", disturbance, known, where="a flight"))
    return known[disturbance]


def export(spacecraft: Spacecraft, path: Path) -> None:
    """Writes the complete MJCF as one file that plain MuJoCo loads.

    Args:
        spacecraft: The machine.
        path: The file to write.
    """
    spec = assemble(spacecraft)
    spec.compile()
    root = ElementTree.fromstring(spec.to_xml())
    for element in root.iter("body"):
        _write_all_digits(element, spec)
    ElementTree.indent(root)
    path.write_text(ElementTree.tostring(root, encoding="unicode"), encoding="utf-8")


def _write_all_digits(element: ElementTree.Element, spec: mujoco.MjSpec) -> None:
    """Replaces the six digits that MuJoCo writes of a body and its joints by all that there are."""
    finders = {"body": spec.body, "joint": spec.joint, "site": spec.site}
    for part in (element, *element):
        owner = element if part.tag == "inertial" else part
        find, name = finders.get(owner.tag), owner.get("name")
        if find is None or not name:
            continue
        found = find(name)
        for key in _WRITTEN.intersection(part.keys()):
            value = getattr(found, _INERTIAL[key] if part.tag == "inertial" else key)
            # A stiffness has higher terms too, and an axis-aligned inertia no more than three.
            count = len(part.get(key, "").split())
            part.set(key, " ".join(repr(float(x)) for x in np.atleast_1d(value)[:count]))


_INERTIAL = {
    "pos": "ipos", "quat": "iquat", "mass": "mass", "diaginertia": "inertia",
    "fullinertia": "fullinertia",
}  # fmt: skip
_WRITTEN = {*_INERTIAL, "axis", "stiffness", "damping"}


def hinge_names(boom: Boom) -> list[str]:
    """Returns the joint names of a boom, from root to tip.

    Args:
        boom: The boom.
    """
    return [f"{boom.name}_{j + 1}" for j in range(boom.n_hinges)]


def bent(boom: Boom, order: int, amplitude: float) -> dict[str, float]:
    """Returns the joint angles of a boom bent into a cantilever mode.

    A hinge with weight w_j carries the bending moment EI y'' = (EI/w_j) theta_j.

    Args:
        boom: The boom.
        order: Mode number, from 1.
        amplitude: Modal coordinate q, m; the tip deflects by 2 q.

    Returns:
        Joint angles by name, rad.
    """
    s, w = beam.hinge_rule(boom.rule, boom.n_hinges)
    curvature = beam.mode_shape(order, s * boom.length, boom.length, derivative=2)
    return dict(zip(hinge_names(boom), amplitude * w * boom.length * curvature, strict=True))


def _grow(spec: mujoco.MjSpec, boom: Boom, spacecraft: Spacecraft) -> None:
    root = spec.site(boom.root)
    if root is None:
        sites = [site.name for site in spec.sites]
        raise ValueError(choices("site", boom.root, sites, where=spacecraft.xml.name))
    s, w = beam.hinge_rule(boom.rule, boom.n_hinges)
    ends = np.r_[0.0, s, 1.0] * boom.length
    stiffness = boom.bending_stiffness / (w * boom.length)
    # Where the site is after all that MJCF allows (euler, axes, frames): ask the compiled bus.
    site = spec.copy().compile().site(boom.root)
    body = root.parent.add_body(name=f"{boom.name}_0", pos=site.pos, quat=site.quat)
    _link(body, ends[1], boom)
    for j, name in enumerate(hinge_names(boom)):
        body = body.add_body(name=name, pos=[ends[j + 1] - ends[j], 0, 0])
        body.add_joint(
            name=name,
            type=mujoco.mjtJoint.mjJNT_HINGE,
            axis=[0, 0, 1],
            stiffness=np.r_[stiffness[j], 0, 0],
            damping=np.r_[boom.damping_time * stiffness[j], 0, 0],
            **_PLAIN_JOINT,
        )
        _link(body, ends[j + 2] - ends[j + 1], boom)
    tip = [ends[-1] - ends[-2], 0, 0]
    body.add_site(name=f"{boom.name}_tip", pos=tip)
    if boom.tip_mass:
        inertia = np.full(3, _THINNESS * boom.tip_mass)
        point = body.add_body(name=f"{boom.name}_tip_mass", pos=tip)
        _inertial(point, boom.tip_mass, [0, 0, 0], inertia)
        point.add_geom(
            type=mujoco.mjtGeom.mjGEOM_SPHERE,
            size=[3 * _RADIUS, 0, 0],
            **_drawn([0.8, 0.3, 0.2, 1]),
        )
    spec.add_sensor(
        name=f"{boom.name}_tip",
        type=mujoco.mjtSensor.mjSENS_FRAMEPOS,
        objtype=mujoco.mjtObj.mjOBJ_SITE,
        objname=f"{boom.name}_tip",
        reftype=mujoco.mjtObj.mjOBJ_SITE,
        refname=boom.root,
    )


# What a <default> of the user's file must not lend to the hinges of a boom.
_PLAIN_JOINT = {
    "armature": 0.0,
    "frictionloss": 0.0,
    "limited": mujoco.mjtLimited.mjLIMITED_FALSE,
    "actfrclimited": mujoco.mjtLimited.mjLIMITED_FALSE,
    "springref": 0.0,
    "ref": 0.0,
}


def _link(body, length: float, boom: Boom) -> None:
    """A uniform rod from the body's origin along its x axis; nothing where it has no length."""
    if length == 0:
        return
    mass = boom.linear_density * length
    bending = mass * length**2 / 12
    _inertial(body, mass, [length / 2, 0, 0], np.array([_THINNESS * bending, bending, bending]))
    body.add_geom(
        type=mujoco.mjtGeom.mjGEOM_CAPSULE,
        fromto=[0, 0, 0, length, 0, 0],
        size=[_RADIUS, 0, 0],
        **_drawn([0.75, 0.78, 0.82, 1]),
    )


def _inertial(body, mass: float, centre, inertia) -> None:
    body.explicitinertial = True
    body.mass, body.ipos, body.inertia = mass, centre, inertia


def _drawn(rgba) -> dict:
    """A geom that is seen and nothing else."""
    return {"mass": 0, "contype": 0, "conaffinity": 0, "rgba": rgba}


def _follow_lines(actuator, spacecraft: Spacecraft) -> None:
    plain = (
        actuator.dyntype == mujoco.mjtDyn.mjDYN_NONE
        and actuator.gaintype == mujoco.mjtGain.mjGAIN_FIXED
        and actuator.biastype == mujoco.mjtBias.mjBIAS_NONE
    )
    if not plain:
        raise ValueError(
            f"{spacecraft.xml.name}: actuator {actuator.name!r} drives a thruster and must be a "
            "<motor>: fixed gain, no bias, no dynamics of its own"
        )
    if actuator.forcelimited == mujoco.mjtLimited.mjLIMITED_TRUE or any(actuator.forcerange):
        raise ValueError(
            f"{spacecraft.xml.name}: actuator {actuator.name!r} clips its force to "
            f"{actuator.forcerange}; a thruster's levels are its limits: remove forcerange"
        )
    if actuator.ctrllimited == mujoco.mjtLimited.mjLIMITED_TRUE or any(actuator.ctrlrange):
        _refuse_levels_out_of_range(actuator, spacecraft)
    actuator.dyntype = mujoco.mjtDyn.mjDYN_INTEGRATOR
    actuator.ctrllimited = mujoco.mjtLimited.mjLIMITED_FALSE


def _refuse_levels_out_of_range(actuator, spacecraft: Spacecraft) -> None:
    lowest, highest = actuator.ctrlrange
    for thruster in spacecraft.thrusters:
        top = max(thruster.levels)
        if actuator.name in motors(thruster) and not (lowest <= -top and top <= highest):
            raise ValueError(
                f"thruster {thruster.name!r} has the level {top}, outside the ctrlrange "
                f"[{lowest}, {highest}] of actuator {actuator.name!r}"
            )


def _refuse_other_masses(model: mujoco.MjModel, spacecraft: Spacecraft) -> None:
    """A compiler setting of the bus, such as settotalmass, must not rescale the booms on it."""
    for boom in spacecraft.booms:
        wanted = boom.linear_density * boom.length + boom.tip_mass
        grown = float(model.body_subtreemass[model.body(f"{boom.name}_0").id])
        if abs(grown - wanted) > 1e-9 * wanted:
            raise ValueError(
                f"{spacecraft.xml}: boom {boom.name!r} weighs {grown} kg once compiled, not "
                f"{wanted} kg; remove settotalmass, boundmass or inertiafromgeom from <compiler>"
            )


def _refuse_what_does_not_float(model: mujoco.MjModel, spacecraft: Spacecraft) -> None:
    """A spacecraft floats: no gravity, unless its file says so, no contacts, no medium."""
    faults = []
    if np.any(model.opt.gravity) and not spacecraft.gravity:
        faults.append(
            f'gravity is on: {model.opt.gravity}; set <option gravity="0 0 0"/>, or, for a machine '
            "on the ground, gravity = true in its TOML file"
        )
    contacts_off = model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_CONTACT
    if not contacts_off and _can_touch(model):
        faults.append('contacts are on; set <flag contact="disable"/> or contype = conaffinity = 0')
    if model.opt.density or model.opt.viscosity:
        faults.append("the medium has density or viscosity; a spacecraft flies in vacuum")
    if faults:
        raise ValueError(f"{spacecraft.xml}: {'; '.join(faults)}")


def _can_touch(model: mujoco.MjModel) -> bool:
    touching = (model.geom_contype != 0) | (model.geom_conaffinity != 0)
    return int(np.count_nonzero(touching)) > 1
