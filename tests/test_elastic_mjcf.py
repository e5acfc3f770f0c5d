"""Elastic structure of a compiled MJCF: against the formulas of the paper, and what is refused."""

import functools
import re

import mujoco
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spacecraft_sim import library, linearize, mjcf
from spacecraft_sim.elastic_influence import elastic_model, influence
from spacecraft_sim.spacecraft import load

FREE = ("two_boom_3d", "two_boom_light", "four_boom", "asymmetric_booms")


@functools.cache
def structure(name):
    return elastic_model(mujoco.MjModel.from_xml_path(str(load(name).xml)))


def two_booms():
    return load("two_boom_3d").xml.with_name("two_boom_3d.xml").read_text(encoding="utf-8")


# -- the matrices as the paper writes them ---------------------------------------------------------


def cross(a):
    return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])


def printed(bus, points):
    """D, G, H, J of Sokolov (2004), (16)-(17), from masses, places and displacements.

    bus is (mass, centre, inertia about it), points are (mass, place, d place/d q); all in the frame
    of the bus.
    """
    mass, centre, inertia = bus
    whole = mass + sum(m for m, _, _ in points)
    origin = (mass * centre + sum(m * x for m, x, _ in points)) / whole
    off = centre - origin
    J = inertia + mass * (off @ off * np.eye(3) - np.outer(off, off))
    A = S = H = 0.0
    for m, x, K in points:
        rho = x - origin
        J = J - m * cross(rho) @ cross(rho)
        A, S, H = A + m * K.T @ K, S + m * K, H + m * cross(rho) @ K
    G = np.linalg.solve(J, H).T
    return {"D": A - S.T @ S / whole - H.T @ np.linalg.solve(J, H), "G": G, "H": H, "J": J}


def quaternion(rotation):
    """Its text in the order of MJCF."""
    x, y, z, w = rotation.as_quat()
    return numbers([w, x, y, z])


def numbers(values):
    return " ".join(repr(float(v)) for v in values)


class RandomStructure:
    """A random tree of point masses on hinge, slide and ball joints: its MJCF and its points."""

    def __init__(self, seed):
        self.rng = rng = np.random.default_rng(seed)
        self.points, self.springs, self.dampers, self.axes = [], [], [], []
        axes = rng.uniform(50, 300, 3)
        principal = np.array([axes[1] + axes[2], axes[0] + axes[2], axes[0] + axes[1]])
        centre, turned = rng.uniform(-0.5, 0.5, 3), self.turn()
        R = turned.as_matrix()
        self.bus = (rng.uniform(50, 500), centre, R @ np.diag(principal) @ R.T)
        booms = "".join(
            self.link(np.zeros(3), np.eye(3), int(rng.integers(1, 4)), [])
            for _ in range(rng.integers(1, 5))
        )
        self.xml = f"""<mujoco><compiler autolimits="true"/><option gravity="0 0 0"/><worldbody>
<body name="craft" pos="{numbers(rng.normal(size=3))}" quat="{quaternion(self.turn())}">
<freejoint/><inertial pos="{numbers(centre)}" quat="{quaternion(turned)}" mass="{self.bus[0]!r}"
diaginertia="{numbers(principal)}"/>{booms}</body></worldbody></mujoco>"""

    def turn(self):
        return Rotation.random(random_state=self.rng)

    def link(self, place, R, depth, moved):
        """One body with its joints and three masses, and what it carries.

        moved lists (anchor, direction or None, axis) of the joints below: a hinge turns about its
        axis through the anchor, a slide has no anchor.
        """
        rng = self.rng
        offset, turned = rng.uniform(-2, 2, 3), self.turn()
        place, R = place + R @ offset, R @ turned.as_matrix()
        text = f'<body pos="{numbers(offset)}" quat="{quaternion(turned)}">'
        for kind in rng.choice(["hinge", "slide", "ball", "hinge hinge"]).split():
            k, d, axis, anchor = rng.uniform(1, 50), rng.uniform(0, 2), rng.normal(size=3), None
            text += f'<joint type="{kind}" stiffness="{k!r}" damping="{d!r}" '
            if kind != "slide":
                at = rng.uniform(-0.3, 0.3, 3)
                anchor = place + R @ at
                text += f'pos="{numbers(at)}" '
            if kind == "ball":
                new = [(anchor, column) for column in R.T]
            else:
                new = [(anchor, R @ axis / np.linalg.norm(axis))]
                text += f'axis="{numbers(axis)}" '
                if rng.random() < 0.5:  # a reference other than zero, at which the spring rests
                    text += (
                        'ref="0.2" springref="0.2" '
                        if kind == "slide"
                        else 'ref="20" springref="20" '
                    )
            text += "/>"
            moved = moved + [(len(self.springs) + i, *joint) for i, joint in enumerate(new)]
            self.springs += [k] * len(new)
            self.dampers += [d] * len(new)
        for i in range(3):
            m, at = rng.uniform(0.5, 3), rng.uniform(-1, 1, 3)
            self.points.append((m, place + R @ at, moved))
            mass = f'mass="{m!r}" diaginertia="1e-13 1e-13 1e-13"/>'
            if i == 0:
                text += f'<inertial pos="{numbers(at)}" {mass}'
            else:
                text += f'<body pos="{numbers(at)}"><inertial pos="0 0 0" {mass}</body>'
        if depth > 1:
            text += self.link(place, R, depth - 1, moved)
        return text + "</body>"

    def resolved(self):
        """The points with the derivatives of their places."""
        n, found = len(self.springs), []
        for m, x, moved in self.points:
            K = np.zeros((3, n))
            for k, anchor, axis in moved:
                K[:, k] = axis if anchor is None else np.cross(axis, x - anchor)
            found.append((m, x, K))
        return found


@pytest.mark.parametrize("seed", range(30))
def test_random_structures_have_the_matrices_of_the_paper(seed):
    random = RandomStructure(seed)
    found = elastic_model(mujoco.MjModel.from_xml_string(random.xml))
    for name, matrix in printed(random.bus, random.resolved()).items():
        # Rounding, and the 1e-13 kg m^2 that MuJoCo asks of a point, against 1 kg m^2.
        off = np.abs(getattr(found, name) - matrix).max() / np.abs(matrix).max()
        assert off < 1e-10, name
    assert np.array_equal(found.C, np.diag(random.springs))
    assert np.array_equal(found.B, np.diag(random.dampers))


def test_points_with_inertia_of_their_own_differ_by_as_much():
    errors = []
    for inertia in (1e-9, 1e-3, 0.1):
        xml = two_booms()
        own = f"{inertia} {inertia} {inertia}"
        model = mujoco.MjModel.from_xml_string(xml.replace("1e-9 1e-9 1e-9", own))
        D = elastic_model(model).D
        errors.append(abs(D[0, 0] / structure("two_boom_3d").D[0, 0] - 1))
    # I/(m l^2) = I/32, less what the bus takes.
    assert errors == pytest.approx([0.0, 1e-3 / 32, 0.1 / 32], rel=0.3, abs=1e-12)


# -- the machines ----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", FREE)
def test_figures_of_the_readme_are_those_of_the_machine(name):
    text = (library.folder("models") / name / "README.md").read_text(encoding="utf-8")
    elastic = structure(name)
    mass = mujoco.MjModel.from_xml_path(str(load(name).xml)).body_mass.sum()
    eigenvalues = influence(elastic, torque=1, dwell=1).eigenvalues
    lines = {line.split("|")[1].strip(): line for line in text.splitlines() if line.count("|") > 3}
    assert f"{mass:g} kg" in lines["mass"]
    assert ", ".join(f"{J:.4f}" for J in np.diag(elastic.J)) in lines["inertia"]
    given = " ".join(line.split("|")[2] for key, line in lines.items() if "frequencies" in key)
    frequencies = sorted(float(x) for x in re.findall(r"\d[\d.]*", given))
    assert np.sort(np.abs(eigenvalues)) == pytest.approx(frequencies, abs=6e-7)  # digits given
    if "products" in lines["inertia"]:
        products = [elastic.J[0, 1], elastic.J[0, 2], elastic.J[1, 2]]
        assert ", ".join(f"{J:.4f}" for J in products) in lines["inertia"]


@pytest.mark.parametrize("name", FREE)
def test_channels_are_pure_torques_about_their_axes(name):
    spacecraft = load(name)
    model = mjcf.compile(spacecraft, timestep=0.01)
    linear = linearize.linearize(model)
    for axis, thruster in enumerate(spacecraft.thrusters):
        columns = [linear.actuators.index(motor) for motor in mjcf.motors(thruster)]
        force = linear.B[:, columns].sum(axis=1)
        expected = np.zeros(len(force))
        expected[3 + axis] = 2.0  # two forces with arms of 1 m
        assert force == pytest.approx(expected, abs=1e-15)
        assert thruster.min_on_time > thruster.delay.mean


@pytest.mark.parametrize("name", ["two_boom_3d", "asymmetric_booms", "two_boom_free"])
def test_eigenvalues_are_those_of_the_whole_machine(name):
    model = mjcf.compile(load(name), timestep=0.01)
    whole = linearize.linearize(model).eigenvalues()
    elastic = whole[np.abs(whole) > 0.1]
    found = influence(elastic_model(model), torque=1, dwell=1).eigenvalues
    for value in found:
        # The zeros of the free body are defective and disturb the others to the root of rounding.
        assert np.min(np.abs(elastic - value)) < 1e-7 * abs(value)
    assert len(elastic) == 2 * len(found)


def test_coordinates_are_named_and_limits_told():
    assert structure("two_boom_3d").coordinates == ("left_x", "left_z", "right_x", "right_z")
    assert structure("four_boom").coordinates[:3] == ("front_x", "front_y", "front_z")
    assert np.all(structure("four_boom").travel == np.inf)
    limited = mujoco.MjModel.from_xml_string(craft(
        joint='type="hinge" axis="1 0 0" stiffness="9" damping="1" range="-20 30"',
    ))  # fmt: skip
    found = elastic_model(limited)
    assert found.coordinates == ("body2.joint1",)
    assert found.travel == pytest.approx([np.radians(20)], rel=1e-12)
    ball = mujoco.MjModel.from_xml_string(craft(
        joint='name="b" type="ball" stiffness="9" damping="1" range="0 40"',
    ))  # fmt: skip
    assert elastic_model(ball).travel == pytest.approx([np.radians(40)] * 3, rel=1e-12)


# -- what is refused -------------------------------------------------------------------------------


def craft(
    *,
    base='<freejoint name="root"/>',
    inertia="20 30 25",
    joint='name="hinge" type="hinge" axis="1 0 0" stiffness="9" damping="1"',
    option='gravity="0 0 0"',
    flag='contact="disable"',
    inside="",
    beside="",
    after="",
):
    """A bus with one boom of three masses."""
    return f"""<mujoco><option {option}><flag {flag}/></option><worldbody>{beside}
<body name="bus">{base}<inertial pos="0 0 0" mass="50" diaginertia="{inertia}"/>
<geom name="hull" size="0.5" mass="0"/><site name="hub"/>
<body pos="0 1 0"><joint {joint}/><inertial pos="0 2 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/>
<site name="end" pos="0 2 0"/><geom size="0.1" pos="0 2 0" mass="0"/>
<body pos="0.5 2 0"><inertial pos="0 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/></body>
<body pos="0 2 0.5"><inertial pos="0 0 0" mass="1" diaginertia="1e-9 1e-9 1e-9"/></body>{inside}
</body></body></worldbody>{after}</mujoco>"""


HINGED = '<body pos="9 0 0"><joint name="door" axis="0 0 1"/><geom size="1"/></body>'
LOOSE = '<body pos="9 0 0"><freejoint/><geom size="1"/></body>'
SPRING = (
    '<tendon><spatial name="guy" stiffness="5" springlength="0 1">'
    '<site site="hub"/><site site="end"/></spatial></tendon>'
)
SERVO = '<actuator><position joint="hinge" kp="4"/></actuator>'
WELD = '<equality><joint joint1="hinge" polycoef="0 0 0 0 0"/></equality>'


def hinge(attributes):
    return {"joint": f'name="hinge" type="hinge" axis="1 0 0" {attributes}'}


REFUSED = {
    "no free joint": ({"base": '<joint name="yaw" axis="0 0 1"/>'}, "it has none, but hinge yaw"),
    "welded": ({"base": ""}, "it needs one free joint, on the bus; it has none, but hinge"),
    "two free": ({"beside": LOOSE}, "it has 2, of body1, bus"),
    "another root": ({"beside": HINGED}, r"beside it move \['body1'\]"),
    "rigid": ({"joint": 'type="hinge" stiffness="0"'}, r"joint body2.joint1 has stiffness 0\.0"),
    "no spring": (hinge('damping="1"'), r"joint hinge has stiffness 0\.0, needs > 0"),
    "polynomial": (hinge('stiffness="9 0 2" damping="1"'), "polynomial stiffness"),
    "polynomial damping": (hinge('stiffness="9" damping="1 2"'), "polynomial stiffness or damping"),
    "preloaded": (hinge('stiffness="9" damping="1" springref="10"'), "set springref = ref"),
    "dry friction": (hinge('stiffness="9" damping="1" frictionloss="1"'), "dry friction"),
    "at its limit": (
        hinge('stiffness="9" damping="1" range="0 30"'),
        "at a limit in the reference configuration: hinge",
    ),
    "undamped": (hinge('stiffness="9"'), "eigenvalues do not decay.* without damping: hinge"),
    "damped bus": ({"base": '<joint type="free" damping="1"/>'}, "the free joint has stiffness"),
    "gravity": ({"option": ""}, "gravity is on"),
    "medium": ({"option": 'gravity="0 0 0" density="1.2"'}, "flies in vacuum"),
    "contacts": ({"flag": 'contact="enable"'}, "contacts are on"),
    "springs off": ({"flag": 'contact="disable" spring="disable"'}, "springs are disabled"),
    "servo": ({"after": SERVO}, "actuators with a bias"),
    "constraint": ({"after": WELD}, "1 equality constraints"),
    "tendon": ({"after": SPRING}, "passive forces act beside the springs .* of hinge gives"),
}


@pytest.mark.parametrize("case", REFUSED)
def test_what_is_not_a_free_elastic_structure_is_refused(case):
    changes, message = REFUSED[case]
    model = mujoco.MjModel.from_xml_string(craft(**changes))
    with pytest.raises(ValueError, match=message):
        influence(elastic_model(model), torque=1.0, dwell=1.0)


def test_a_bus_that_is_a_collinear_rod_is_refused():
    # It turns about itself as the booms turn the other way, and nothing has moved but the booms.
    bus = "266.6666666666667 293.33333333333337 253.33333333333334"
    model = mujoco.MjModel.from_xml_string(two_booms().replace(bus, "1e-8 293 293"))
    with pytest.raises(ValueError, match=r"D is not positive definite: .* \(a collinear rod\)"):
        elastic_model(model)


def test_negative_stiffness_and_damping_are_refused():
    model = mujoco.MjModel.from_xml_string(craft())
    model.jnt_stiffness[1] = -2.0
    model.dof_damping[6] = -0.5
    with pytest.raises(ValueError, match=r"hinge has stiffness -2\.0.*hinge has damping -0\.5"):
        elastic_model(model)


def test_the_craft_of_these_tests_is_accepted_as_it_stands():
    found = influence(elastic_model(mujoco.MjModel.from_xml_string(craft())), torque=1, dwell=1)
    assert np.all(np.isfinite(found.bound))


def test_a_bus_with_nothing_elastic_is_refused():
    bare = '<mujoco><option gravity="0 0 0"/><worldbody><body><freejoint/><geom size="1"/></body>'
    model = mujoco.MjModel.from_xml_string(bare + "</worldbody></mujoco>")
    with pytest.raises(ValueError, match="nothing in it is elastic"):
        elastic_model(model)
