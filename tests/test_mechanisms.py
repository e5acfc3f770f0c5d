"""Planar arms: textbook formulas, MuJoCo, conservation, elastic joints, linear models."""

import math
from dataclasses import replace

import burkov_cases as cases
import mujoco
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from spacecraft_sim.dynamics import jacobian, linear_plant
from spacecraft_sim.mechanisms import (
    FlexibleJointArm,
    PlanarArm,
    inertia_matrix,
    linear_flexible,
    linear_mechanism,
)

ARM, LINKS, FLEXIBLE = cases.ARM, cases.LINKS, cases.FLEXIBLE
ANGLES = st.lists(st.floats(-7, 7), min_size=6, max_size=6)


def textbook(q, v):
    """A, b, g of two links, written out."""
    (reach, _), (c1, c2), (m1, m2) = ARM.lengths, ARM.centres, ARM.masses
    I1, I2 = ARM.inertias
    h = m2 * reach * c2
    far = I2 + m2 * c2**2
    A = [
        [I1 + m1 * c1**2 + m2 * reach**2 + far + 2 * h * math.cos(q[1]), far + h * math.cos(q[1])],
        [far + h * math.cos(q[1]), far],
    ]
    b = h * math.sin(q[1]) * np.array([-v[1] * (2 * v[0] + v[1]), v[0] ** 2])
    tip = m2 * c2 * math.sin(q[0] + q[1])
    g = 9.81 * np.array([(m1 * c1 + m2 * reach) * math.sin(q[0]) + tip, tip])
    return np.array(A), b, g


@given(ANGLES)
def test_two_links_by_the_textbook(x):
    q, v, a = np.array(x).reshape(3, 2)
    A, b, g = textbook(q, v)
    # Rounding of numbers up to some hundred.
    assert ARM.mass_matrix(q) == pytest.approx(A, abs=1e-13)
    assert ARM.bias(q, v) == pytest.approx(b, abs=1e-12)
    assert ARM.gravity(q) == pytest.approx(g, abs=1e-12)
    assert ARM.inverse_dynamics(q, v, a) == pytest.approx(A @ a + b + g, abs=1e-11)
    assert ARM.acceleration(q, v, A @ a + b + g) == pytest.approx(a, abs=1e-11)
    assert inertia_matrix(ARM, q) == pytest.approx(A, abs=1e-12)


def chain(arm):
    """The same arm in MJCF: hinges about -y, links hanging down."""
    text = ""
    for k, (c, m, J) in enumerate(zip(arm.centres, arm.masses, arm.inertias, strict=True)):
        down = arm.lengths[k - 1] if k else 0.0
        text += (
            f'<body pos="0 0 {-down}"><joint axis="0 -1 0"/>'
            f'<inertial pos="0 0 {-c}" mass="{m}" diaginertia="{J} {J} {J}"/>'
        )
    text += "</body>" * len(arm.masses)
    xml = f'<mujoco><option gravity="0 0 {-arm.g}"/><worldbody>{text}</worldbody></mujoco>'
    return mujoco.MjModel.from_xml_string(xml)


@pytest.mark.parametrize("arm", [ARM, replace(LINKS, g=9.81)], ids=["two", "three"])
def test_arms_agree_with_mujoco(arm):
    model = chain(arm)
    data, random = mujoco.MjData(model), np.random.default_rng(3)
    for _ in range(20):
        q, v, a = random.uniform(-3, 3, (3, model.nv))
        data.qpos[:], data.qvel[:], data.qacc[:] = q, v, a
        mujoco.mj_forward(model, data)
        M = np.zeros((model.nv, model.nv))
        mujoco.mj_fullM(model, data, M)
        data.qacc[:] = a
        mujoco.mj_inverse(model, data)
        # Two formulations of the same numbers: rounding.
        assert arm.mass_matrix(q) == pytest.approx(M, abs=1e-12)
        assert arm.bias(q, v) + arm.gravity(q) == pytest.approx(data.qfrc_bias, abs=1e-11)
        assert arm.inverse_dynamics(q, v, a) == pytest.approx(data.qfrc_inverse, abs=1e-10)


@given(ANGLES)
def test_gravity_is_the_slope_of_the_potential(x):
    arm = replace(LINKS, g=9.81)
    slope = jacobian(lambda q: [arm.potential(q)], np.array(x[:3]))[0]
    assert arm.gravity(x[:3]) == pytest.approx(slope, abs=1e-9)  # 1e-12 of 20 N m over a step


def carried(dynamics, x, duration):
    n = len(dynamics.inputs)
    run = solve_ivp(
        lambda t, z: dynamics.rates(z, np.zeros(n)), (0, duration), x, method="DOP853",
        rtol=1e-12, atol=1e-13,
    )  # fmt: skip
    return run.y[:, -1]


def test_free_arms_keep_their_energy():
    x = np.array([2.0, -1.0, 0.7, -1.2])

    def energy(x):
        return x[2:] @ ARM.mass_matrix(x[:2]) @ x[2:] / 2 + ARM.potential(x[:2])

    # rtol 1e-12 a step, some hundred steps.
    assert energy(carried(ARM, x, 5.0)) == pytest.approx(energy(x), rel=1e-9)


def test_free_arms_with_elastic_joints_keep_energy_and_momentum():
    x = np.array([0.5, -0.8, 0.6, 0.4, -0.5, 0.9, 0.3, 0.1, -0.2, 0.5, 0.4, -0.7])

    def energy(x):
        q1, q2, v1, v2 = x.reshape(4, 3)
        springs = np.array(FLEXIBLE.stiffnesses) @ (q1 - q2) ** 2
        return (v1 @ LINKS.mass_matrix(q1) @ v1 + FLEXIBLE.rotors @ v2**2 + springs) / 2

    def momentum(x):  # of all about the base: the first joint angle is cyclic
        q1, _, v1, v2 = x.reshape(4, 3)
        return (LINKS.mass_matrix(q1) @ v1)[0] + FLEXIBLE.rotors[0] * v2[0]

    end = carried(FLEXIBLE, x, 3.0)
    assert energy(end) == pytest.approx(energy(x), rel=1e-9)
    assert momentum(end) == pytest.approx(momentum(x), rel=1e-8)


def test_many_motions_at_once_are_the_single_ones():
    random = np.random.default_rng(0)
    for dynamics, width in ((ARM, 4), (FLEXIBLE, 12)):
        x, u = random.normal(size=(5, width)), random.normal(size=(5, len(dynamics.inputs)))
        single = [dynamics.rates(a, b) for a, b in zip(x, u, strict=True)]
        assert np.max(np.abs(dynamics.rates(x, u) - single)) < 1e-12
        assert dynamics.readings(x).shape[-1] == len(dynamics.units)


# -- linear models -----------------------------------------------------------------------------


def test_linear_models_of_callables_are_those_of_the_equations():
    q = np.array(cases.TARGET)
    one = linear_mechanism(ARM, q=q)
    two = linear_plant(ARM, state=np.r_[q, 0, 0], torques=ARM.gravity(q))
    q = np.array(cases.FLEXIBLE_TARGET)
    three = linear_flexible(FLEXIBLE, q=q)
    four = linear_plant(FLEXIBLE, state=np.r_[q, q, np.zeros(6)], torques=np.zeros(3))
    for a, b in ((one, two), (three, four)):
        # Differences of fourth order, 1e-12 of stiffnesses up to 1e4.
        assert np.max(np.abs(a.A - b.A)) < 1e-8
        assert np.max(np.abs(a.B - b.B)) < 1e-8
        assert a.inputs == b.inputs
        assert a.outputs == b.outputs
        assert np.array_equal(a.y0, b.y0)


def test_the_linear_model_about_a_path():
    """Deviations from a motion, against two runs that start a little apart."""
    q, v, a = (np.array(x) for x in cases.PROGRAMME(0.4))
    u = ARM.inverse_dynamics(q, v, a)
    plant = linear_mechanism(ARM, q=q, v=v, a=a)
    for direction in np.eye(4):
        e = 1e-4 * direction
        apart = ARM.rates(np.r_[q, v] + e, u) - ARM.rates(np.r_[q, v] - e, u)
        # Second differences leave e^2 of third derivatives of order 100.
        assert apart / 2e-4 == pytest.approx(plant.A @ direction, abs=1e-5)


def test_what_is_no_equilibrium_is_refused():
    with pytest.raises(ValueError, match="no equilibrium"):
        linear_plant(ARM, state=np.array([0.5, 0, 0, 0]), torques=np.zeros(2))


# -- bad input ---------------------------------------------------------------------------------

NUMBERS = {
    "lengths": (1.0, 1.0),
    "centres": (0.5, 0.4),
    "masses": (3.0, 2.0),
    "inertias": (0.3, 0.1),
}


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"masses": (3.0, -2.0)}, r"masses\[1\] = -2\.0"),
        ({"lengths": (0.0, 1.0)}, r"lengths\[0\] = 0\.0"),
        ({"centres": (0.5, -0.1)}, r"centres\[1\] = -0\.1"),
        ({"g": -9.81}, r"g = -9\.81"),
        ({"inertias": (0.3,)}, r"'inertias': 1"),
    ],
)
def test_impossible_arms_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        PlanarArm(**{**NUMBERS, **changes})


def test_impossible_joints_are_refused():
    with pytest.raises(ValueError, match=r"rotors\[2\] = 0\.0"):
        replace(FLEXIBLE, rotors=(0.2, 0.1, 0.0))
    with pytest.raises(ValueError, match="stiffnesses has 2 entries; the arm has 3 links"):
        FlexibleJointArm(links=LINKS, rotors=(0.2, 0.1, 0.1), stiffnesses=(1.0, 2.0))
