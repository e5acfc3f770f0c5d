"""The linear model read off the compiled one, against MuJoCo's own finite differences."""

import re

import mujoco
import numpy as np
import pytest

from spacecraft_sim import beam, linearize, mjcf
from spacecraft_sim.scenario import Initial

CHAIN = """
<mujoco>
  <option gravity="0 0 0" integrator="Euler" timestep="0.01">
    <flag eulerdamp="disable" contact="disable"/>
  </option>
  <worldbody>
    <body name="bus">
      {joint}
      <inertial pos="0.1 0 0" mass="3" diaginertia="1 2 2.5"/>
      <site name="here" pos="0.2 0.1 0"/>
      <body name="arm" pos="1 0 0">
        <joint name="shoulder" axis="0 0 1" stiffness="2" damping="0.3"/>
        <inertial pos="0.5 0 0" mass="0.4" diaginertia="0.01 0.05 0.05"/>
        <body name="hand" pos="1 0 0">
          <joint name="wrist" axis="0 1 0" stiffness="1" damping="0.1"/>
          <joint name="slide" type="slide" axis="1 0 0" stiffness="3" damping="0.2"/>
          <inertial pos="0.2 0 0.1" mass="0.2" diaginertia="0.01 0.01 0.01"/>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <motor name="torque" site="here" gear="0 0 0 0 0 2"/>
    <motor name="jet" site="here" gear="0 1 0 0 0 0"/>
    <motor name="wrist" joint="wrist" gear="0.5"/>
  </actuator>
  <sensor>
    <jointpos name="angle" joint="shoulder"/>
    <jointvel name="speed" joint="wrist"/>
    <jointpos name="length" joint="slide"/>
    <framepos name="place" objtype="body" objname="hand"/>
    <gyro name="rate" site="here"/>
  </sensor>
</mujoco>
"""
HINGE = '<joint name="turn" axis="0 0 1"/>'
FREE = '<freejoint name="float"/>'


def chain(joint=HINGE, replaced=("", "")):
    assert replaced[0] in CHAIN
    return mujoco.MjModel.from_xml_string(CHAIN.format(joint=joint).replace(*replaced, 1))


def transition(model):
    """A, B, C, D of one Euler step by MuJoCo's centred finite differences."""
    data, nx, ny = mujoco.MjData(model), 2 * model.nv, model.nsensordata
    A, B = np.zeros((nx, nx)), np.zeros((nx, model.nu))
    C, D = np.zeros((ny, nx)), np.zeros((ny, model.nu))
    mujoco.mjd_transitionFD(model, data, 1e-6, True, A, B, C, D)
    return A, B, C, D


@pytest.mark.parametrize(
    ("joint", "replaced"),
    [
        (HINGE, ("", "")),
        (FREE, ("", "")),
        (HINGE, ('gear="0.5"', 'gear="0.5" damping="0.4"')),
        (HINGE, ('gear="0.5"', 'gear="0.5" armature="0.4"')),
        (HINGE, ('name="wrist" axis', 'name="wrist" armature="0.4" axis')),
    ],
    ids=["hinge", "free", "actuator damping", "actuator armature", "joint armature"],
)
def test_linear_model_makes_the_step_that_mujoco_makes(joint, replaced):
    model = chain(joint, replaced)
    linear, h, n = linearize.linearize(model), 0.01, model.nv
    acceleration = -np.linalg.solve(linear.M, np.hstack([linear.K, linear.D]))
    # Semi-implicit Euler: v+ = v + h a(q, v, u), q+ = q + h v+.
    velocity = np.hstack([np.zeros((n, n)), np.eye(n)]) + h * acceleration
    drive = h * np.linalg.solve(linear.M, linear.B)
    position = np.hstack([np.eye(n), np.zeros((n, n))]) + h * velocity
    A, B, C, _ = transition(model)
    # Rounding 1e-16 over steps of 1e-6, and their square times third derivatives.
    close = {"rtol": 0, "atol": 1e-9}
    np.testing.assert_allclose(A, np.vstack([position, velocity]), **close)
    np.testing.assert_allclose(B, np.vstack([h * drive, drive]), **close)
    own = model.nsensordata  # readings without the quasi-rigid ones, in the order of the sensors
    np.testing.assert_allclose(linear.C[:own], C, **close)
    assert list(linear.outputs)[:own] == [
        "angle", "speed", "length", "place_x", "place_y", "place_z", "rate_x", "rate_y", "rate_z",
    ]  # fmt: skip


def test_readings_at_rest_are_those_of_the_reference():
    linear = linearize.linearize(chain())
    rest = dict(zip(linear.outputs, linear.y0, strict=True))
    assert rest["place_x"] == pytest.approx(2.2, rel=1e-15)  # the hand's centre of mass
    assert rest["angle"] == rest["speed"] == rest["rate_z"] == 0.0


def test_quasi_rigid_readings_are_linear_in_the_momentum_row():
    linear = linearize.linearize(chain())
    rows = dict(zip(linear.outputs, linear.C, strict=True))
    n, J = len(linear.M), linear.M[0, 0]
    # Central differences of exactly linear functions: rounding over the step.
    close = {"rtol": 0, "atol": 1e-9}
    np.testing.assert_allclose(rows["angular_momentum_z"][n:], linear.M[0], **close)
    np.testing.assert_allclose(rows["quasi_rigid_angle_z"][:n], linear.M[0] / J, **close)
    np.testing.assert_allclose(rows["quasi_rigid_rate_z"][n:], linear.M[0] / J, **close)


def test_rigid_coordinates_are_those_of_the_joint_of_the_bus():
    assert linearize.linearize(chain(HINGE)).rigid == (0,)
    assert linearize.linearize(chain(FREE)).rigid == (0, 1, 2, 3, 4, 5)


def test_thrust_that_is_an_activation_has_the_force_of_the_plain_motor(machine):
    spacecraft = machine(n_hinges=2)
    plain = linearize.linearize(mjcf.assemble(spacecraft).compile())
    flying = linearize.linearize(mjcf.compile(spacecraft, timestep=0.01))
    assert flying.actuators == plain.actuators == ("thruster_z",)
    assert flying.B.tolist() == plain.B.tolist()
    assert plain.B[0, 0] == 1.0


def test_eigenvalues_are_those_of_the_damped_oscillators(machine):
    linear = linearize.linearize(
        mjcf.compile(machine(n_hinges=2, damping_time=0.02), timestep=0.01)
    )
    found = linear.eigenvalues()
    assert len(found) == 2 * len(linear.M)
    for value in found[np.abs(found) > 1e-3]:
        # det(M s^2 + D s + K) = 0 through its smallest singular value; rounding of the terms.
        matrix = linear.M * value**2 + linear.D * value + linear.K
        assert np.linalg.svd(matrix)[1][-1] < 1e-8 * np.abs(linear.K).max()


@pytest.mark.parametrize(
    ("replaced", "fault"),
    [
        (('gravity="0 0 0"', 'gravity="0 0 -9.81"'), "gravity"),
        (('name="wrist" axis', 'name="wrist" frictionloss="0.1" axis'), "dry friction"),
        (('name="wrist" axis', 'name="wrist" limited="true" range="-1 1" axis'), "joint limits"),
        (('name="wrist" axis', 'name="wrist" springref="10" axis'), "springref"),
        (('stiffness="1"', 'stiffness="1 2"'), "polynomial joint stiffness"),
        (('damping="0.1"', 'damping="0.1 2"'), "polynomial joint damping"),
        (('motor name="wrist" joint="wrist" gear="0.5"', 'position name="wrist" joint="wrist"'),
         "actuators with a bias"),
        (("<actuator>", '<equality><weld body1="bus"/></equality><actuator>'),
         "equality constraints"),
        (("<sensor>", '<tendon><fixed><joint joint="slide" coef="1"/></fixed></tendon><sensor>'),
         "tendons"),
        (('gravity="0 0 0"', 'gravity="0 0 0" density="1"'), "density"),
    ],
)  # fmt: skip
def test_what_is_not_linear_is_refused_by_its_kind(replaced, fault):
    with pytest.raises(ValueError, match=f"not linear at its reference: it has .*{fault}"):
        linearize.linearize(chain(replaced=replaced))


def test_all_that_is_not_linear_is_named_at_once():
    both = ('gravity="0 0 0" integrator', 'gravity="0 0 -1" integrator')
    model = chain(replaced=both)
    model.dof_frictionloss[0] = 0.1
    with pytest.raises(ValueError, match="dry friction; gravity"):
        linearize.linearize(model)


@pytest.mark.parametrize(
    ("joint", "replaced", "message"),
    [
        (FREE, ('body name="bus"', 'body name="buss"'),
         "body 'bus' is not in the MJCF of the machine; did you mean 'buss'? it has: arm, buss"),
        (FREE, ('body name="bus"', "body"), "it has: arm, hand"),
        ("", ("", ""), "the body 'bus' has no joint; give it a free joint or a hinge"),
    ],
)  # fmt: skip
def test_a_machine_without_a_bus_that_moves_is_told_which_bodies_it_has(joint, replaced, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        linearize.linearize_bus(chain(joint, replaced))


def test_the_linear_model_of_a_bus_is_that_of_the_machine():
    found, plain = linearize.linearize_bus(chain(FREE)), linearize.linearize(chain(FREE))
    np.testing.assert_array_equal(found.M, plain.M)
    assert found.rigid == plain.rigid


# -- initial states and the planar machine -----------------------------------------------------


def test_initial_state_of_a_hinged_bus_is_its_angle_and_the_bent_booms(machine):
    spacecraft = machine(n_hinges=3)
    model = mjcf.compile(spacecraft, timestep=0.01)
    initial = Initial(attitude=(0, 0, 0.7), rate=(0, 0, -0.01), boom_mode=2, boom_amplitude=0.1)
    tangent, rate = linearize.initial_state(model, spacecraft, initial)
    assert tangent[0] == 0.7
    assert rate.tolist() == [-0.01, *[0.0] * 6]
    for boom in spacecraft.booms:
        for name, angle in mjcf.bent(boom, 2, 0.1).items():
            assert tangent[model.joint(name).dofadr[0]] == angle


def test_initial_state_of_a_free_bus_turns_it_about_any_axis(machine):
    spacecraft = machine(free=True, n_hinges=1)
    model = mjcf.compile(spacecraft, timestep=0.01)
    initial = Initial(attitude=(0.1, 0.2, 0.3), rate=(1, 2, 3))
    tangent, rate = linearize.initial_state(model, spacecraft, initial)
    assert tangent.tolist() == [0, 0, 0, 0.1, 0.2, 0.3, 0, 0]
    assert rate.tolist() == [0, 0, 0, 1, 2, 3, 0, 0]


@pytest.mark.parametrize("name", ["attitude", "rate"])
def test_turn_that_the_bus_cannot_make_is_refused(machine, name):
    spacecraft = machine(n_hinges=1)
    model = mjcf.compile(spacecraft, timestep=0.01)
    with pytest.raises(ValueError, match=rf"initial\.{name} = .*0\.1.*: the bus turns about"):
        linearize.initial_state(model, spacecraft, Initial(**{name: (0.1, 0, 0)}))


@pytest.mark.parametrize("rule", ["equal", "gauss_jacobi"])
def test_planar_bus_gives_back_inertia_and_radius_of_the_hub(machine, rule):
    spacecraft = machine(rule=rule)
    model = mjcf.compile(spacecraft, timestep=0.01)
    J0, radius, boom = linearize.planar_bus(model, spacecraft)
    # A difference of 1183 and 1153 keeps thirteen digits.
    assert pytest.approx(30.0, rel=1e-11) == J0
    assert radius == 3.0
    assert boom.length == 7.5
    assert beam.total_inertia(
        bus_inertia=J0, root_radius=radius, length=7.5, linear_density=1.53
    ) == pytest.approx(1183.2375, rel=1e-13)


@pytest.mark.parametrize(
    ("changes", "fault"),
    [
        ({"booms": ("left",)}, "two equal booms rooted on opposite sides"),
        ({"tip_mass": 1.0}, r"tip_mass = 1\.0"),
        ({"xml": ('pos="-3 0 0"', 'pos="-2 0 0"')}, "two equal booms rooted on opposite sides"),
    ],
)
def test_machine_that_is_not_planar_and_even_is_refused(machine, changes, fault):
    spacecraft = machine(**changes)
    model = mjcf.compile(spacecraft, timestep=0.01)
    with pytest.raises(ValueError, match=rf'{fault}.*reduced.source = "mjcf"'):
        linearize.planar_bus(model, spacecraft)
