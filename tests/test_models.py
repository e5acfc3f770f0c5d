"""Every shipped spacecraft: it loads, compiles, and is the machine that its README describes."""

import mujoco
import numpy as np
import pytest
from scipy.optimize import brentq

from spacecraft_sim import library, linearize, mjcf
from spacecraft_sim.physics import MujocoPhysics
from spacecraft_sim.readings import undeformed_mass_matrix
from spacecraft_sim.reduced import truncate
from spacecraft_sim.scenario import Initial
from spacecraft_sim.spacecraft import load

NAMES = library.spacecraft_names()
BUSES = [name for name in NAMES if load(name).equations is None]  # machines of relay laws

# The machine of Efremov et al. (2006), section 5, with 1.53 kg/m and 35 N m^2.
MASS = 122.95  # 100 + 2 * 7.5 * 1.53
INERTIA = 1183.2375  # 30 + 2 * 1.53 (10.5^3 - 3^3)/3
FREQUENCIES = (0.7396290, 2.686849, 6.165607)  # exact, seven digits, the bus free to turn
ERRORS = (2e-5, 3e-4, 1.8e-3)  # of eight Gauss-Jacobi hinges: -1.8e-5, -2.7e-4, -1.7e-3
# p J 3^k for p = 0.007 rad/s^2, after the attracting 1 N m.
TORQUES = (1.0, *(0.007 * INERTIA * 3.0**k for k in range(5)))

# Torque of a channel at unit level, N m; actuators; readings of the sensors.
TWINS = {
    "two_boom": (1.0, ("thruster_z",), ("attitude_z", "rate_z")),
    "two_boom_free": (
        5.0,  # two forces with an arm of 2.5 m each
        ("thruster_left", "thruster_right"),
        tuple(f"{kind}_{axis}" for kind in ("attitude", "rate") for axis in "xyz"),
    ),
}


def flight(name):
    return mjcf.compile(load(name), timestep=0.02)


def readme(name):
    return (library.folder("models") / name / "README.md").read_text(encoding="utf-8")


def reached(linear, inputs, modes):
    """Frequencies of the lowest modes that combinations of the actuators excite, rad/s."""
    return truncate(
        M=linear.M, D=linear.D, K=linear.K, B=linear.B @ inputs, C=linear.C, y0=linear.y0,
        outputs=linear.outputs, inputs=("input",), rigid=linear.rigid, modes=modes,
    ).frequencies  # fmt: skip


# -- any machine -------------------------------------------------------------------------------


@pytest.mark.parametrize("name", NAMES)
def test_machine_loads_under_its_own_name_with_title_and_readme(name):
    spacecraft = load(name)
    assert spacecraft.name == name
    assert spacecraft.title
    assert spacecraft.xml.is_file()
    assert spacecraft.thrusters
    for thruster in spacecraft.thrusters:
        assert f"`{thruster.name}`" in readme(name)


@pytest.mark.parametrize("name", BUSES)
def test_machine_has_the_readings_that_every_law_may_ask_for(name):
    linear = linearize.linearize(flight(name))
    tips = {f"{boom.name}_tip_{axis}" for boom in load(name).booms for axis in "xyz"}
    kinds = ("attitude", "rate", "angular_momentum", "quasi_rigid_angle", "quasi_rigid_rate")
    axes = "xyz" if len(linear.rigid) == 6 else "z"
    assert {*tips, *(f"{kind}_{axis}" for kind in kinds for axis in axes)} <= set(linear.outputs)
    assert all(unit for unit in linear.outputs.values())


@pytest.mark.parametrize("name", NAMES)
def test_machine_rests_where_it_is_left(name):
    physics = MujocoPhysics.fly(load(name), timestep=0.02)
    before = physics.read()
    physics.step(50)
    assert physics.read() == before
    assert physics.time() == pytest.approx(1.0, rel=1e-15)


@pytest.mark.parametrize("name", NAMES)
def test_scene_has_light_and_cameras(name):
    model = flight(name)
    assert model.nlight >= 1
    assert model.ncam >= 1


@pytest.mark.parametrize("name", NAMES)
def test_machine_is_exported_for_plain_mujoco_with_all_its_names(name, tmp_path):
    spacecraft = load(name)
    mjcf.export(spacecraft, tmp_path / f"{name}.xml")
    there = mujoco.MjModel.from_xml_path(str(tmp_path / f"{name}.xml"))
    here = mjcf.assemble(spacecraft).compile()
    for kind, count in (("sensor", "nsensor"), ("actuator", "nu"), ("joint", "njnt"),
                        ("body", "nbody"), ("site", "nsite"), ("camera", "ncam")):  # fmt: skip
        names = [
            [getattr(model, kind)(i).name for i in range(getattr(model, count))]
            for model in (there, here)
        ]
        assert names[0] == names[1]


# -- the machine of the paper, on a hinge and free ---------------------------------------------


@pytest.mark.parametrize("name", TWINS)
def test_mass_and_inertia_are_the_closed_forms(name):
    model = flight(name)
    dof = linearize.linearize(model).rigid[-1]
    assert model.body_mass.sum() == pytest.approx(MASS, rel=1e-14)  # rounding of the sum
    assert undeformed_mass_matrix(model)[dof, dof] == pytest.approx(INERTIA, rel=1e-13)


@pytest.mark.parametrize("name", TWINS)
def test_frequencies_are_those_of_the_beam_to_the_error_of_eight_hinges(name):
    linear = linearize.linearize(flight(name))
    couple = np.ones((len(linear.actuators), 1))  # the jets of a pair together
    errors = reached(linear, couple, 3) / FREQUENCIES - 1
    assert np.all(np.abs(errors) < ERRORS)


def test_symmetric_frequencies_of_the_free_machine_are_those_of_its_readme():
    linear = linearize.linearize(flight("two_boom_free"))
    push = np.array([[1.0], [-1.0]])  # both jets along +y
    found = reached(linear, push, 2)
    ratio = 100 / (2 * 7.5 * 1.53)

    def balance(z):
        # A (cos + cosh) + B (sin + sinh) from the free tip, no slope at the root, no momentum.
        a, b = np.cosh(z) + np.cos(z), np.sin(z) - np.sinh(z)
        w = a * (np.cos(z) + np.cosh(z)) + b * (np.sin(z) + np.sinh(z))
        mean = (a * (np.sin(z) + np.sinh(z)) + b * (np.cosh(z) - np.cos(z))) / z
        return ratio * w + mean

    z = np.array([brentq(balance, 1.5, 2.5), brentq(balance, 4.0, 5.2)])
    exact = z**2 * np.sqrt(35.0 / 1.53) / 7.5**2
    assert np.all(np.abs(found / exact - 1) < (2e-5, 3e-4))  # as the other modes of eight hinges
    assert ", ".join(f"{omega:.4f}" for omega in found) in readme("two_boom_free")


def test_figures_of_the_readme_are_those_of_the_compiled_machine():
    linear, text = linearize.linearize(flight("two_boom")), readme("two_boom")
    eigenvalues = linear.eigenvalues()
    fastest = np.abs(eigenvalues).max()
    assert f"fastest eigenvalue | {fastest:.1f} 1/s" in text
    assert f"up to {np.floor(2.5 / fastest * 1e4) / 1e4} s" in text
    first = eigenvalues[np.argmin(np.abs(np.abs(eigenvalues) - FREQUENCIES[0]))]
    assert f"{-first.real / abs(first):.4f} in the first coupled mode" in text
    for figure in (INERTIA, MASS):
        assert f"= {figure} kg" in text
    assert ", ".join(f"{omega:.6f}" for omega in FREQUENCIES) in text


def test_first_mode_of_the_twin_has_the_printed_coefficients():
    linear = linearize.linearize(flight("two_boom_twin"))
    model = truncate(
        M=linear.M, D=linear.D, K=linear.K, B=linear.B, C=linear.C, y0=linear.y0,
        outputs=linear.outputs, inputs=linear.actuators, rigid=linear.rigid, modes=1,
    )  # fmt: skip
    text = readme("two_boom_twin")
    assert f"{model.inertia[0]:.4f} kg m^2" in text
    assert f"{flight('two_boom_twin').body_mass.sum():.5f} kg" in text
    # Printed (5.1): omega^2 = J c/(J a - 2 p^2) and damping b/c, with digits of 1e-4.
    J, p, a, b, c = 1183.24, 22.335, 11.06, 0.72, 38.83
    omega = np.sqrt(J * c / (J * a - 2 * p**2))
    assert model.frequencies[0] == pytest.approx(omega, rel=2e-4)
    assert model.D[0, 0] / model.frequencies[0] ** 2 == pytest.approx(b / c, rel=2e-4)


@pytest.mark.parametrize("name", TWINS)
def test_actuators_and_sensors_are_named_as_described(name):
    _, actuators, sensors = TWINS[name]
    linear = linearize.linearize(flight(name))
    assert linear.actuators == actuators
    assert tuple(linear.outputs)[: len(sensors)] == sensors


@pytest.mark.parametrize("name", TWINS)
def test_channel_is_a_pure_torque_about_z_with_the_levels_of_the_paper(name):
    spacecraft, linear = load(name), linearize.linearize(flight(name))
    (thruster,) = spacecraft.thrusters
    columns = [linear.actuators.index(motor) for motor in mjcf.motors(thruster)]
    force = linear.B[list(linear.rigid)][:, columns].sum(axis=1)
    assert not np.any(force[:-1])
    assert force[-1] == TWINS[name][0]
    # Written with all their digits: rounding.
    np.testing.assert_allclose(force[-1] * np.array(thruster.levels), TORQUES, rtol=1e-14)
    assert thruster.delay.mean == 0.2


def test_free_and_hinged_machine_fly_alike_while_the_booms_bend_antisymmetrically():
    flights = []
    for name, (torque, *_) in TWINS.items():
        physics = MujocoPhysics.fly(load(name), timestep=0.02)
        physics.set_initial(Initial(attitude=(0, 0, 0.7), rate=(0, 0, -0.01), boom_amplitude=0.1))
        physics.begin([8.0 / torque], [-1.0 / torque])
        physics.advance(10.0)
        read = physics.select(("attitude_z", "rate_z", "left_tip_y", "quasi_rigid_angle_z"))
        flights.append(read())
    # 500 steps of rounding, magnified some hundred times by links of 0.1 m.
    np.testing.assert_allclose(flights[0], flights[1], rtol=0, atol=1e-11)


@pytest.mark.parametrize("name", TWINS)
def test_tips_stand_where_the_booms_end(name):
    model = flight(name)
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    for side, x in (("left", 10.5), ("right", -10.5)):
        np.testing.assert_allclose(data.site(f"{side}_tip").xpos, [x, 0, 0], atol=1e-14)
