"""Rigid bodies: integrals of the motion, closed forms, MuJoCo, principal axes."""

import math

import burkov_cases as cases
import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from controllers import burkov
from spacecraft_sim.dynamics import linear_plant
from spacecraft_sim.euler_poisson import RigidBody

BODY = cases.BODY
NUMBERS = st.lists(st.floats(-3, 3), min_size=12, max_size=12)


@given(NUMBERS)
def test_rates_are_those_of_euler_and_poisson(x):
    om, u, s1, s2 = np.array(x).reshape(4, 3)
    theta = np.array(BODY.inertia)
    body = RigidBody(inertia=BODY.inertia, vectors=("s1", "s2"))
    rates = body.rates(np.r_[om, s1, s2], u)
    # Rounding.
    assert theta * rates[:3] + np.cross(om, theta * om) == pytest.approx(u, abs=1e-13)
    assert rates[3:6] == pytest.approx(np.cross(s1, om), abs=1e-14)
    assert rates[6:] == pytest.approx(np.cross(s2, om), abs=1e-14)


def carried(body, x, duration, torque=(0.0, 0.0, 0.0)):
    run = solve_ivp(
        lambda t, z: body.rates(z, np.array(torque)), (0, duration), x, method="DOP853",
        rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    return run.y[:, -1]


def tilted():
    return Rotation.from_rotvec([0.4, -0.7, 1.1]).as_matrix()


def test_a_free_body_keeps_energy_momentum_and_right_angles():
    x = BODY.state(rate=np.array([0.5, 1.3, -0.8]), attitude=tilted())
    end = carried(BODY, x, 20.0)
    # rtol 1e-12 a step, some hundred steps.
    assert BODY.energy(end) == pytest.approx(BODY.energy(x), rel=1e-10)

    def momentum(x):  # in inertial axes
        return x[3:].reshape(3, 3) @ (np.array(BODY.inertia) * x[:3])

    assert momentum(end) == pytest.approx(momentum(x), abs=1e-9)
    s = end[3:].reshape(3, 3)
    assert s @ s.T == pytest.approx(np.eye(3), abs=1e-9)


def test_a_free_symmetric_top_in_closed_form():
    body = RigidBody(inertia=(1.0, 1.0, 1.6))
    x = body.state(rate=np.array([0.3, 0.0, 2.0]), attitude=np.eye(3))
    t = 7.0
    turn = (1.6 - 1.0) * 2.0 * t  # of the cross rate in body axes
    end = carried(body, x, t)
    assert end[:3] == pytest.approx([0.3 * math.cos(turn), 0.3 * math.sin(turn), 2.0], abs=1e-9)


def test_a_constant_rate_turns_the_vectors_backwards_in_body_axes():
    body = RigidBody(inertia=(1.0, 1.0, 1.0))
    om = np.array([0.2, -0.4, 0.7])
    end = carried(body, body.state(rate=om, attitude=tilted()), 5.0)
    expected = tilted() @ Rotation.from_rotvec(5.0 * om).as_matrix()
    assert end[3:].reshape(3, 3) == pytest.approx(expected, abs=1e-10)


def test_the_tangent_is_what_rotations_do():
    x = BODY.state(rate=np.zeros(3), attitude=tilted())
    basis = BODY.tangent(x)
    assert basis.T @ basis == pytest.approx(np.eye(6), abs=1e-12)
    change = BODY.rates(x + np.r_[0.3, -0.2, 0.5, np.zeros(9)], np.zeros(3))
    assert basis @ (basis.T @ change) == pytest.approx(change, abs=1e-12)
    single = RigidBody(inertia=BODY.inertia, vectors=("s1",))
    assert single.tangent(np.array([0, 0, 0, 0.6, 0.0, 0.8])).shape == (6, 5)


def test_a_free_spin_about_the_middle_axis_is_unstable():
    """p about the axis of A with C < A < B: L^2 = p^2 (A - C)(B - A)/(B C)."""
    body = RigidBody(inertia=(1.0, 1.2, 0.9), vectors=("s1",))
    x = np.array([2.0, 0, 0, 1.0, 0, 0])
    plant = linear_plant(body, state=x, torques=np.zeros(3), basis=body.tangent(x))
    growth = 2.0 * math.sqrt((1.0 - 0.9) * (1.2 - 1.0) / (1.2 * 0.9))
    assert max(np.linalg.eigvals(plant.A).real) == pytest.approx(growth, rel=1e-9)


# -- principal axes in MuJoCo ------------------------------------------------------------------

# Inertia frame and centre of mass off the body frame.
FREE = """
<mujoco>
  <option gravity="0 0 0" integrator="RK4" timestep="0.002"/>
  <worldbody><body name="hub"><freejoint/>
    <inertial pos="0.1 -0.2 0.05" quat="0.8 0.2 -0.4 0.4" mass="5" diaginertia="0.9 1.6 1.0"/>
  </body></worldbody>
</mujoco>
"""


def free_body(timestep=0.002):
    model = mujoco.MjModel.from_xml_string(FREE)
    model.opt.timestep = timestep
    data = mujoco.MjData(model)
    data.qpos[3:] = np.array([0.5, -0.5, 0.1, 0.7])  # MuJoCo normalises
    data.qvel[3:] = 0.3, -0.2, 0.5
    mujoco.mj_forward(model, data)
    return model, data


def test_body_axes_and_torques_of_a_body_with_a_turned_inertia():
    model, data = free_body()
    axes = burkov.body_axes(model, data, "hub")
    assert np.array_equal(axes, burkov.body_axes(model, data, 1))
    R_i = np.zeros(9)
    mujoco.mju_quat2Mat(R_i, model.body_iquat[1])
    R_i, R_wb = R_i.reshape(3, 3), data.xmat[1].reshape(3, 3)
    assert axes == pytest.approx(R_wb @ R_i, abs=1e-14)
    om = R_i.T @ data.qvel[3:]
    # Known figures, to their digits.
    assert axes[1] == pytest.approx([0.4976, -0.768, 0.4032], abs=1e-12)
    assert axes[2] == pytest.approx([-0.0768, 0.424, 0.9024], abs=1e-12)
    assert om == pytest.approx([0.412, -0.36, 0.284], abs=1e-12)
    law, _ = cases.vectors(rated=True)
    y = [*axes[1], *axes[2], *om]
    torque = law.formula.command(0.0, y, [])
    # r2 and r3 are given with eight digits.
    assert torque == pytest.approx([-1.244095, 1.842912, 0.188183], abs=1e-6)
    assert R_i @ torque == pytest.approx([-2.012532, 0.388145, -0.882366], abs=1e-6)
    law, _ = cases.vectors(rated=False)
    w = [0.1, 0.0, -0.05, 0.0, 0.2, 0.1]
    torque = law.formula.command(0.0, y[:6], w)
    assert torque == pytest.approx([-1.419535, 1.760752, 1.020503], abs=1e-6)


def test_motions_agree_with_mujoco():
    torque = np.array([0.4, -0.3, 0.6])  # held, in principal axes
    off = []
    for timestep in (1e-3, 5e-4):
        model, data = free_body(timestep)
        R_i = data.xmat[1].reshape(3, 3).T @ data.ximat[1].reshape(3, 3)
        x = BODY.state(rate=R_i.T @ data.qvel[3:], attitude=burkov.body_axes(model, data, 1))
        data.qfrc_applied[3:] = R_i @ torque
        while data.time < 1.0 - 1e-9:
            mujoco.mj_step(model, data)
        mujoco.mj_forward(model, data)
        end = BODY.state(rate=R_i.T @ data.qvel[3:], attitude=burkov.body_axes(model, data, 1))
        off.append(np.max(np.abs(end - carried(BODY, x, data.time, torque))))
    # MuJoCo's RK4 is of second order about a moving axis: a quarter at half the step.
    assert off[0] < 2e-6
    assert off[1] < 0.3 * off[0]


# -- bad input ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"inertia": (0.9, 0.0, 1.0)}, r"B = 0\.0"),
        ({"inertia": (0.9, 1.6, 3.0)}, r"C = 3: the largest may not exceed .* 2\.5"),
        ({"inertia": (0.9, 1.6)}, "not 2"),
        ({"vectors": ("s4",)}, r"vector 's4' is not in a rigid body; it has: s1, s2, s3"),
    ],
)
def test_impossible_bodies_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        RigidBody(**{"inertia": (0.9, 1.6, 1.0), **changes})


def test_an_attitude_that_is_no_rotation_is_refused():
    with pytest.raises(ValueError, match=r"not orthogonal unit vectors: off by 0\.1"):
        BODY.state(rate=np.zeros(3), attitude=np.diag([1.0, 1.0, 1.05]))
