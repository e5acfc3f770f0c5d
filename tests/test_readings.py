"""Readings by name: fresh, in SI units, and the momentum that no boom can hide."""

import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacecraft_sim import mjcf
from spacecraft_sim.readings import Readings, undeformed_mass_matrix

PLANAR = ("angular_momentum_z", "quasi_rigid_angle_z", "quasi_rigid_rate_z")


def opened(spacecraft):
    model = mjcf.compile(spacecraft, timestep=0.01)
    data = mujoco.MjData(model)
    return model, data, Readings(model, data)


def moved(model, data, seed, size=0.3):
    random = np.random.default_rng(seed)
    data.qpos[:] = model.qpos0
    mujoco.mj_integratePos(model, data.qpos, size * random.normal(size=model.nv), 1.0)
    data.qvel[:] = size * random.normal(size=model.nv)
    mujoco.mj_step1(model, data)


def test_planar_machine_has_its_sensors_and_its_momentum(machine):
    _, _, readings = opened(machine())
    assert readings.units == {
        "attitude_z": "rad",
        "rate_z": "rad/s",
        "left_tip_x": "m", "left_tip_y": "m", "left_tip_z": "m",
        "right_tip_x": "m", "right_tip_y": "m", "right_tip_z": "m",
        "angular_momentum_z": "N m s",
        "quasi_rigid_angle_z": "rad",
        "quasi_rigid_rate_z": "rad/s",
    }  # fmt: skip


def test_free_machine_has_three_axes_of_each(machine):
    _, _, readings = opened(machine(free=True))
    for kind in ("attitude", "rate", "angular_momentum", "quasi_rigid_angle", "quasi_rigid_rate"):
        assert {f"{kind}_{axis}" for axis in "xyz"} <= set(readings.units)
    assert readings.units["attitude_x"] == "rad"
    assert readings.units["rate_x"] == "rad/s"


def test_selection_keeps_the_order_asked_for_and_reads_what_is_then(machine):
    model, data, readings = opened(machine())
    read = readings.select(("rate_z", "attitude_z"))
    for seed in (1, 2):
        moved(model, data, seed)
        assert read() == [data.qvel[0], data.qpos[0]]


def test_slide_joints_are_read_in_metres():
    model = mujoco.MjModel.from_xml_string(
        '<mujoco><worldbody><body><joint name="x" type="slide"/><geom size="1"/></body></worldbody>'
        '<sensor><jointpos name="x" joint="x"/><jointvel name="v" joint="x"/></sensor></mujoco>'
    )
    assert Readings(model, mujoco.MjData(model)).units == {"x": "m", "v": "m/s"}


@given(vector=st.tuples(*[st.floats(-1.8, 1.8)] * 3), flip=st.sampled_from([1, -1]))
def test_attitude_is_the_rotation_vector_whatever_the_sign_of_the_quaternion(
    machine_read, vector, flip
):
    data, read, model = machine_read
    angle = np.linalg.norm(vector)
    if angle > 3.1:
        return
    quaternion = np.zeros(4)
    mujoco.mju_axisAngle2Quat(quaternion, np.array(vector) / (angle or 1.0), angle)
    data.qpos[3:7] = flip * quaternion
    mujoco.mj_step1(model, data)
    # Rounding of a half-angle below 1.55 rad through sine and arctangent.
    np.testing.assert_allclose(read(), vector, atol=1e-14, rtol=1e-13)


@pytest.fixture(scope="module")
def machine_read(machine):
    model, data, readings = opened(machine(free=True, n_hinges=1))
    return data, readings.select(("attitude_x", "attitude_y", "attitude_z")), model


@pytest.mark.parametrize("seed", range(3))
def test_planar_momentum_is_that_of_every_link(machine, seed):
    model, data, readings = opened(machine(tip_mass=1.0))
    moved(model, data, seed)
    mujoco.mj_forward(model, data)
    momentum = 0.0
    for body in range(1, model.nbody):
        velocity = np.zeros(6)  # rotation, then translation of the centre of mass, world frame
        mujoco.mj_objectVelocity(model, data, mujoco.mjtObj.mjOBJ_BODY, body, velocity, 0)
        spin = (
            data.ximat[body].reshape(3, 3)
            * model.body_inertia[body]
            @ data.ximat[body].reshape(3, 3).T
        )
        momentum += (spin @ velocity[:3])[2]
        momentum += model.body_mass[body] * np.cross(data.xipos[body], velocity[3:])[2]
    found = readings.select(("angular_momentum_z",))()[0]
    assert found == pytest.approx(momentum, rel=1e-12)  # rounding of a sum over 20 bodies


@pytest.mark.parametrize("free", [False, True])
def test_stiff_turn_is_the_quasi_rigid_motion_itself(machine, free):
    model, data, readings = opened(machine(free=free))
    names = ("quasi_rigid_angle_z", "quasi_rigid_rate_z", "angular_momentum_z")
    dof = 5 if free else 0
    turn = np.zeros(model.nv)
    turn[dof] = 0.4
    mujoco.mj_integratePos(model, data.qpos, turn, 1.0)
    data.qvel[dof] = 0.02
    mujoco.mj_step1(model, data)
    J = undeformed_mass_matrix(model)[dof, dof]
    assert readings.select(names)() == pytest.approx([0.4, 0.02, 0.02 * J], rel=1e-12)  # rounding


def test_straight_free_machine_has_the_quasi_rigid_rate_of_its_bus_in_any_attitude(machine):
    model, data, readings = opened(machine(free=True))
    turn, rate = np.zeros(model.nv), np.array([0.01, -0.02, 0.03])
    turn[3:6] = 0.9, -1.3, 0.4
    mujoco.mj_integratePos(model, data.qpos, turn, 1.0)
    data.qvel[3:6] = rate
    mujoco.mj_step1(model, data)
    body = readings.select(tuple(f"quasi_rigid_rate_{axis}" for axis in "xyz"))()
    world = readings.select(tuple(f"angular_momentum_{axis}" for axis in "xyz"))()
    inertia = undeformed_mass_matrix(model)[3:6, 3:6]
    rotation = data.body("bus").xmat.reshape(3, 3)
    # Rounding of frames; momenta are of the order of 30 N m s.
    np.testing.assert_allclose(body, rate, rtol=0, atol=1e-15)
    np.testing.assert_allclose(world, rotation @ inertia @ rate, rtol=0, atol=1e-12)


def test_quasi_rigid_angle_weighs_each_hinge_by_its_share_of_the_inertia(machine):
    model, data, readings = opened(machine())
    moved(model, data, 4)
    M = undeformed_mass_matrix(model)
    found = readings.select(("quasi_rigid_angle_z",))()[0]
    assert found == pytest.approx(M[0] @ data.qpos / M[0, 0], rel=1e-13)  # rounding


def test_quasi_rigid_rate_is_the_slope_of_the_angle_for_small_motion(machine):
    model, data, readings = opened(machine(free=True))
    names = [f"quasi_rigid_{kind}_{axis}" for axis in "xyz" for kind in ("angle", "rate")]
    read = readings.select(tuple(names))
    random = np.random.default_rng(0)
    velocity, h = 1e-6 * random.normal(size=model.nv), 1e-3
    sides = []
    for sign in (1, -1):
        data.qpos[:] = model.qpos0
        mujoco.mj_integratePos(model, data.qpos, velocity, sign * h)
        data.qvel[:] = velocity
        mujoco.mj_step1(model, data)
        sides.append(np.array(read()))
    slope = (sides[0] - sides[1])[::2] / (2 * h)
    # Terms of second order: displacement 1e-9 over 1; rounding of 1e-16 over 1e-9.
    np.testing.assert_allclose(slope, sides[0][1::2], rtol=1e-6)


def test_unknown_sensor_is_refused_with_the_nearest(machine):
    _, _, readings = opened(machine())
    with pytest.raises(ValueError, match=r"sensor 'yaw_rate' is not in the model; .*it has: ang"):
        readings.select(("yaw_rate",))
    with pytest.raises(ValueError, match="did you mean 'rate_z'"):
        readings.select(("rat_z",))


@pytest.mark.parametrize(
    "xml",
    [
        ('<jointvel name="rate_z"', '<jointvel name="quasi_rigid_rate_z"'),
        ("<gyro", '<frameangvel name="rate" objtype="body" objname="bus"/><gyro'),
        ("<gyro", '<clock name="rate_y"/><gyro'),
        ("<gyro", '<clock name="attitude_x"/><gyro'),
    ],
    ids=["momentum", "vectors", "component", "rotation"],
)
def test_two_sensors_that_give_the_same_reading_are_refused(machine, xml):
    spacecraft = machine(free="<gyro" in xml[0])
    text = spacecraft.xml.read_text(encoding="utf-8")
    spacecraft.xml.write_text(text.replace(*xml), encoding="utf-8")
    with pytest.raises(ValueError, match=r"two sensors|repeated name"):
        opened(spacecraft)


def test_name_belongs_to_its_own_value_beside_quaternions_and_vectors(machine):
    more = '<framepos name="place" objtype="site" objname="centre"/><clock name="now"/><gyro'
    model, data, readings = opened(machine(free=True, xml=("<gyro", more)))
    moved(model, data, 7)
    data.time = 2.5
    mujoco.mj_step1(model, data)
    names = ("now", "place_y", "rate_z", "place_x", "rate_x")
    expected = [2.5, data.qpos[1], data.qvel[5], data.qpos[0], data.qvel[3]]
    assert readings.select(names)() == pytest.approx(expected, rel=1e-14)  # frames: rounding
    everything = dict(zip(readings.units, readings.select(tuple(readings.units))(), strict=True))
    assert [everything[name] for name in names] == readings.select(names)()
