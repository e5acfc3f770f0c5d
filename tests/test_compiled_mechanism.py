"""What laws are told of compiled machines, against equations derived without MuJoCo."""

import pickle

import numpy as np
import pytest
from burkov_cases import ARM, FLEXIBLE

from spacecraft_sim import compiled_mechanism, equations, mission, mjcf, spacecraft
from spacecraft_sim.scenario import Initial, Scenario
from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.thrusters import Thrusters, nearest_level

ARMS = ("arm2", "arm7")
GROUNDED = (*ARMS, "flexible_joint_arm")
BODIES = ("rigid_body_ball", "rigid_body_free")


def compiled(name):
    return mjcf.compile(spacecraft.load(name), timestep=1e-3)


@pytest.mark.parametrize("name", ARMS)
def test_gravity_and_inverse_dynamics_are_those_of_lagrange(name):
    found = compiled_mechanism.mechanism(compiled(name))
    arm = equations.dynamics_of(spacecraft.load(name))
    random = np.random.default_rng(3)
    for _ in range(10):
        q, v, a = random.uniform(-3, 3, (3, len(found.joints)))
        # Sums of some hundred terms of up to 1e3 N m: rounding.
        np.testing.assert_allclose(found.gravity(q), arm.gravity(q), atol=1e-11)
        np.testing.assert_allclose(
            found.inverse_dynamics(q, v, a), arm.inverse_dynamics(q, v, a), atol=1e-10
        )


def test_the_numbers_of_the_machines_are_those_of_the_reference_cases():
    arm = equations.dynamics_of(spacecraft.load("arm2"))
    q, v, a = (0.3, -0.8), (1.0, 2.0), (-1.0, 0.5)
    np.testing.assert_allclose(
        arm.inverse_dynamics(q, v, a), ARM.inverse_dynamics(q, v, a), atol=1e-12
    )
    assert equations.dynamics_of(spacecraft.load("flexible_joint_arm")) == FLEXIBLE


def test_links_rotors_and_springs_are_found():
    found = compiled_mechanism.flexible_mechanism(compiled("flexible_joint_arm"))
    assert found.rotors == pytest.approx(FLEXIBLE.rotors, rel=1e-15)
    assert found.stiffnesses == FLEXIBLE.stiffnesses
    q, v, a = np.random.default_rng(4).uniform(-2, 2, (3, 3))
    np.testing.assert_allclose(
        found.links.inverse_dynamics(q, v, a), FLEXIBLE.links.inverse_dynamics(q, v, a), atol=1e-12
    )
    assert not np.any(found.links.gravity(q))


@pytest.mark.parametrize("name", BODIES)
def test_the_inertia_of_a_body_is_principal(name):
    found = compiled_mechanism.body(compiled(name))
    assert found.inertia == pytest.approx((0.9, 1.6, 1.0), rel=1e-12)


def test_a_hub_with_booms_counts_as_one_rigid_body():
    found = compiled_mechanism.body(compiled("hub_two_booms"))
    assert found.inertia == pytest.approx((1.4434, 1.6004, 1.5434), rel=1e-12)


def test_what_a_law_carries_is_a_value():
    found = compiled_mechanism.mechanism(compiled("arm2"))
    again = pickle.loads(pickle.dumps(found))
    assert again == found
    assert hash(again) == hash(found)
    assert np.array_equal(again.gravity((0.4, 0.5)), found.gravity((0.4, 0.5)))
    assert found != compiled_mechanism.mechanism(compiled("arm7"))


@pytest.mark.parametrize(
    ("build", "name", "says"),
    [
        ("mechanism", "rigid_bus", r"joint_1 \.\. joint_n; this machine has bus"),
        ("flexible_mechanism", "arm2", r"rotors rotor_1 \.\.; this machine has joint_1"),
        ("body", "arm2", r"site 'principal' .* has the joints joint_1, joint_2 and no site"),
        ("body", "rigid_bus", r"site 'principal' .* and the sites "),
    ],
)
def test_a_machine_of_another_kind_is_refused(build, name, says):
    with pytest.raises(ValueError, match=says):
        getattr(compiled_mechanism, build)(compiled(name))


# -- machines on the ground ------------------------------------------------------------------------


def test_gravity_is_refused_unless_the_machine_says_so():
    grounded = spacecraft.load("arm2")
    floating = grounded.model_copy(update={"gravity": False})
    assert np.any(mjcf.compile(grounded, timestep=1e-3).opt.gravity)
    with pytest.raises(ValueError, match=r"gravity is on: .*gravity = true in its TOML"):
        mjcf.compile(floating, timestep=1e-3)


@pytest.mark.parametrize("name", [*GROUNDED, *BODIES])
def test_equations_and_mujoco_move_alike_under_torques_that_change(name):
    machine = spacecraft.load(name)
    law = {"law": "schmitt_trigger", "threshold": 1.0, "lead": 1.0}  # not flown here
    scenario = Scenario.model_validate(
        {"name": "x", "title": "x", "spacecraft": name, "duration": 1.0, "controller": law,
         "simulation": {"timestep": 1e-3}, "reduced": {"source": "equations"}}
    )  # fmt: skip
    plants = [mission.MujocoPhysics.fly(machine, timestep=2.5e-4)]
    plants.append(mission.reduced_plant(scenario, machine, plants[0]))
    joints = {"arm2": "joint", "arm7": "joint", "flexible_joint_arm": "link"}.get(name)
    start = Initial(attitude=(0.5, -1.0, 0.3), rate=(0.4, 0.2, -0.6))
    if joints:
        start = Initial(joints={f"{joints}_1": 1.0}, joint_rates={f"{joints}_2": -0.5})
    readings = []
    for plant in plants:
        plant.set_initial(start)
        n = len(plant.inputs)
        plant.begin([0.7, -0.2, *[0.1] * (n - 2)], [-1.0, 0.5, *[0.0] * (n - 2)])
        plant.advance(0.4)
        readings.append(plant.select(tuple(plants[1].units))())
    # RK4 of 1600 steps: 2e-5 at four times the step in the stiffest arm, an order 4 below that.
    np.testing.assert_allclose(readings[0], readings[1], rtol=0, atol=2e-7)


@pytest.mark.parametrize(
    ("initial", "says"),
    [
        ({"attitude": (0.0, 0.0, 0.1)}, "initial.attitude"),
        ({"joints": {"joint_3": 0.1}}, "joint 'joint_3' .*initial.joints.*joint_1, joint_2"),
        ({"joint_rates": {"elbow": 0.1}}, "joint 'elbow' .*initial.joint_rates"),
    ],
)
def test_a_start_that_an_arm_cannot_have_is_refused_by_both_plants(initial, says):
    machine = spacecraft.load("arm2")
    plants = (
        mission.MujocoPhysics.fly(machine, timestep=1e-3),
        equations.EquationsPhysics(machine, disturbances=(), timestep=1e-3),
    )
    for plant in plants:
        with pytest.raises(ValueError, match=says):
            plant.set_initial(Initial.model_validate(initial))


def test_a_machine_without_equations_says_what_else_there_is():
    with pytest.raises(ValueError, match=r"two_boom has no \[equations\].*galerkin, mjcf"):
        equations.dynamics_of(spacecraft.load("two_boom"))


# -- actuators that follow a command ---------------------------------------------------------------


def test_a_proportional_thruster_delivers_what_is_asked_for_up_to_its_limit():
    motor = Thruster(name="motor", levels=(2.0, 5.0), proportional=True, delay=0.1)
    wanted = (0.0, 1.234, -3.3, 5.0, 7.0, -8.0)
    assert [nearest_level(x, motor) for x in wanted] == [0.0, 1.234, -3.3, 5.0, 5.0, -5.0]
    thrusters = Thrusters([motor])
    state = thrusters.command(0.0, [1.234], thrusters.init())
    assert thrusters.line(0.05, state)[0] == [0.0]  # the same delay line
    assert thrusters.line(0.1, state)[0] == [1.234]
    with pytest.raises(ValueError, match="commanded nan"):
        nearest_level(float("nan"), motor)


def test_a_proportional_thruster_has_no_minimum_on_time():
    with pytest.raises(ValueError, match=r"min_on_time = 0\.1 s is of a relay"):
        Thruster(name="motor", levels=(1.0,), proportional=True, min_on_time=0.1)
