"""Burkov (1998), section 5: equilibria, boundaries, flights of a rigid body, bad input."""

import math
from dataclasses import replace

import burkov_cases as cases
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controllers import burkov
from controllers.burkov_laws import Spin
from controllers.burkov_lyapunov import (
    attitudes,
    basin,
    body_energy,
    body_loss,
    spin_condition,
    spin_energy,
    spin_loss,
    transverse_polynomial,
)
from spacecraft_sim.dynamics import jacobian, linear_plant
from spacecraft_sim.euler_poisson import RigidBody
from spacecraft_sim.loop_margins import close
from spacecraft_sim.smooth_flight import closed_loop, fly, fly_continuous

BODY = cases.BODY
PAIR = replace(BODY, vectors=("s2", "s3"))
SINGLE = replace(BODY, vectors=("s1",))
S = [f"{s}_{axis}" for s in ("s2", "s3") for axis in "xyz"]


def pair_loop(law, signs=(1, 1)):
    state = np.r_[np.zeros(3), np.repeat(signs, 3) * np.ravel(law.formula.r)]
    plant = linear_plant(PAIR, state=state, torques=np.zeros(3), basis=PAIR.tangent(state))
    return close(law, plant)


def spin_law(c=2.0, *, free=False, inertia=BODY.inertia, **gains):
    """A law whatever (5.19) says, by way of one that meets it."""
    formula = Spin(alpha=None if free else 1.0, beta=1.0, gamma=1.0, k=1.6, spin=c)
    design = burkov.two_torques if free else burkov.permanent_rotation
    arguments = {"beta": 1.0, "gamma": 1.0, "k": 1.6, **({} if free else {"alpha": 1.0})}
    law, _ = design(RigidBody(inertia=inertia), spin=0.0, **arguments)
    return replace(law, formula=replace(formula, **gains))


def spin_loop(law, c, *, side=1, inertia=BODY.inertia):
    body = RigidBody(inertia=inertia, vectors=("s1",))
    state = np.array([c, 0, 0, side, 0, 0], dtype=float)
    basis = np.eye(6)[:, [1, 2, 4, 5]]
    return close(law, linear_plant(body, state=state, torques=np.zeros(3), basis=basis))


# -- equilibria --------------------------------------------------------------------------------


@pytest.mark.parametrize("rated", [True, False])
def test_the_four_equilibria_and_their_unstable_directions(rated):
    law, _ = cases.vectors(rated=rated)
    found = attitudes(law.formula)
    assert [a.signs for a in found] == [(1, 1), (1, -1), (-1, 1), (-1, -1)]
    assert [a.energy for a in found] == pytest.approx([0.0, 2.4, 4.0, 6.4])
    assert [a.unstable for a in found] == [0, 1, 2, 3]
    for attitude in found:
        s = np.repeat(attitude.signs, 3) * np.ravel(law.formula.r)
        assert law.formula.command(0.0, [*s, 0, 0, 0][: len(law.sensors)], [0.0] * 6) == (
            pytest.approx([0.0] * 3, abs=1e-15)
        )
        V = body_energy(law.formula, BODY, s, np.zeros(3), np.zeros(6))
        assert pytest.approx(attitude.energy, abs=1e-12) == V
        growing = np.sum(pair_loop(law, attitude.signs).eigenvalues().real > 1e-9)
        assert growing == attitude.unstable
    assert basin(law.formula) == pytest.approx(2.4)


@pytest.mark.parametrize(
    ("signs", "known"),
    [
        ((-1, -1), [0.486411, 0.864439, 0.913281]),
        ((-1, 1), [0.245810, 0.875824]),
        ((1, -1), [0.488710]),
    ],
)
def test_unstable_eigenvalues_without_rates(signs, known):
    values = pair_loop(cases.vectors(rated=False)[0], signs).eigenvalues()
    growing = np.sort(values[values.real > 0].real)
    assert growing == pytest.approx(known, abs=1e-6)  # last digit


def test_equal_stiffnesses_leave_circles_of_equilibria():
    with pytest.raises(ValueError, match=r"k2 = k3 = 1\.5: .* circles"):
        cases.vectors(rated=False, k2=1.5, k3=1.5)
    law, _ = cases.vectors(rated=False)
    equal = replace(law.formula, k=(1.5, 1.5))
    r2, r3 = map(np.array, equal.r)
    for angle in np.linspace(0, 2 * math.pi, 7):
        axis = math.cos(angle) * r2 + math.sin(angle) * r3
        turn = Rotation.from_rotvec(math.pi * axis).as_matrix()
        s = np.r_[turn @ r2, turn @ r3]
        for formula, balanced in ((equal, True), (law.formula, abs(math.sin(2 * angle)) < 1e-9)):
            torque = np.linalg.norm(formula.command(0.0, s.tolist(), [0.0] * 6))
            assert (torque < 1e-14) == balanced
        V = body_energy(equal, BODY, s, np.zeros(3), np.zeros(6))
        assert pytest.approx(4 * 1.5, abs=1e-12) == V or pytest.approx(2 * 1.5, abs=1e-12) == V


def test_the_linear_springs_about_the_goal():
    law, _ = cases.vectors(rated=True)
    r2, r3 = law.formula.r
    r1 = np.cross(r2, r3)
    for axis, spring in ((r1, 3.2), (r2, 1.2), (r3, 2.0)):
        turn = Rotation.from_rotvec(1e-6 * np.array(axis)).as_matrix()
        s = [*(np.array(r2) @ turn), *(np.array(r3) @ turn)]
        torque = law.formula.command(0.0, [*s, 0.0, 0.0, 0.0], [])
        # Second order in 1e-6 rad.
        assert np.array(torque) @ axis == pytest.approx(-spring * 1e-6, rel=1e-5)


# -- Lyapunov functions ------------------------------------------------------------------------


def rate_of(energy, rates, state):
    return float(jacobian(lambda z: [energy(z)], state)[0] @ rates(0.0, state))


@pytest.mark.parametrize("rated", [True, False])
def test_v_falls_by_the_loss(rated):
    law, _ = cases.vectors(rated=rated)
    rates, random, formula = closed_loop(PAIR, law), np.random.default_rng(8), law.formula
    for seed in range(10):
        s = Rotation.random(random_state=seed).as_matrix()[1:].ravel()
        z = np.r_[random.normal(size=3), s, s + random.normal(size=6)][: 9 if rated else 15]

        def w(z):
            return z[3:9] - z[9:] if len(z) > 9 else ()

        loss = body_loss(formula, law.filter.cutoffs, z[:3], w(z))
        V = rate_of(lambda z: body_energy(formula, BODY, z[3:9], z[:3], w(z)), rates, z)
        assert pytest.approx(-loss, abs=1e-8) == V  # V is quadratic: rounding over 1e-3


@pytest.mark.parametrize("free", [True, False])
def test_v_of_a_spinning_body_falls_by_the_loss(free):
    law = spin_law(1.3, free=free)
    rates, random = closed_loop(SINGLE, law), np.random.default_rng(9)
    for seed in range(10):
        s = Rotation.random(random_state=seed).as_matrix()[0]
        z = np.r_[random.normal(size=3), s]
        for c in (0.0, 0.7, 1.3) if free else (1.3,):
            V = rate_of(lambda z, c=c: spin_energy(law.formula, BODY, z[3:], z[:3], c), rates, z)
            assert pytest.approx(-spin_loss(law.formula, BODY, z[:3], c), abs=1e-8) == V


# -- spin: boundaries --------------------------------------------------------------------------


def test_eigenvalues_either_side_of_the_boundary():
    for product, known in (
        (0.97, {-0.740690, -0.112454 + 2.611354j, -0.112454 - 2.611354j, 0.005336}),
        (1.03, {-0.752735, -0.115764 + 2.610345j, -0.115764 - 2.610345j, -0.005254}),
    ):
        damping = math.sqrt(0.36 * product)
        assert damping == pytest.approx({0.97: 0.590931, 1.03: 0.608933}[product], abs=1e-6)
        law = spin_law(beta=damping, gamma=damping)
        values = spin_loop(law, 2.0).eigenvalues()
        for value in known:
            assert np.min(np.abs(values - value)) < 2e-6  # last digits
        assert spin_condition(law.formula, BODY, 2.0).holds == (product > 1)


def test_the_upside_down_spin_is_unstable_under_the_condition():
    values = spin_loop(spin_law(), 2.0, side=-1).eigenvalues()
    for value in (-1.420795 + 0.913023j, 0.608295 + 1.560372j):
        assert np.min(np.abs(values - value)) < 2e-6  # last digits


def test_the_polynomial_is_that_of_the_loop():
    random = np.random.default_rng(10)
    for _ in range(50):
        inertia = tuple(random.uniform(0.8, 1.5, 3))
        c, side = float(random.uniform(-4, 4)), int(random.choice([-1, 1]))
        beta, gamma, k = random.uniform(0.1, 2, 3)
        law = spin_law(c, free=True, inertia=inertia, beta=beta, gamma=gamma, k=k)
        exact = transverse_polynomial(law.formula, RigidBody(inertia=inertia), c, side=side)
        found = np.poly(spin_loop(law, c, side=side, inertia=inertia).matrix())
        assert found == pytest.approx(exact, abs=1e-8)  # the differences' 1e-11, times sums


@pytest.mark.parametrize(
    ("product", "rate"),
    [(0.94, 0.010757), (0.97, 0.005336), (1.03, -0.005254), (1.06, -0.010429)],
)
def test_flights_grow_or_decay_as_the_linear_loop_says(product, rate):
    damping = math.sqrt(0.36 * product)
    law = spin_law(beta=damping, gamma=damping)
    values = spin_loop(law, 2.0).eigenvalues()
    assert max(values.real) == pytest.approx(rate, abs=2e-6)  # last digit
    start = np.array([2.0, 0, 0, math.cos(1e-5), math.sin(1e-5), 0.0])
    run = fly_continuous(SINGLE, law, start=start, times=np.linspace(0, 240, 13))
    size = np.log(np.hypot(run["s1_y"], run["s1_z"]))
    growth = np.polyfit(run.time[6:], size[6:], 1)[0]  # the swing has died by e^-13
    assert growth == pytest.approx(rate, abs=1e-4)  # what is asked for


@pytest.mark.parametrize(("k", "boundary"), [(0.8, 0.2), (1.6, 0.36), (2.4, 0.2)])
def test_the_condition_is_sufficient_and_tight(k, boundary):
    """k* = ((B + C)/2 - A) p_p^2 = 1.6 meets (5.19) exactly; others are stable beyond it."""
    for share, stable in ((0.99, False), (1.01, True)):
        damping = math.sqrt(share * boundary)
        values = spin_loop(spin_law(beta=damping, gamma=damping, k=k), 2.0).eigenvalues()
        assert (max(values.real) < 0) == stable


# -- spin without the third torque: a false theorem --------------------------------------------


def tilted(spin, tilt):
    return np.array([spin, 0, 0, math.cos(tilt), math.sin(tilt), 0.0])


def fast(k=1.6, damping=0.3, inertia=BODY.inertia):
    return spin_law(0.0, free=True, inertia=inertia, beta=damping, gamma=damping, k=k)


def test_fast_members_of_the_family_are_unstable():
    law = fast()
    for c, stable in ((1.58, True), (1.60, False), (3.79, False), (3.82, True)):
        assert (max(spin_loop(law, c).eigenvalues().real) < 0) == stable
    assert max(spin_loop(law, 2.0).eigenvalues().real) == pytest.approx(0.17818, abs=1e-5)


@pytest.mark.parametrize("tilt", [1e-3, 1e-4, 1e-6])
def test_the_excursion_does_not_shrink_with_the_disturbance(tilt):
    times = np.linspace(0, 250, 25001)
    run = fly_continuous(SINGLE, fast(), start=tilted(2.0, tilt), times=times)
    across = np.hypot(run["s1_y"], run["s1_z"])
    assert np.max(across) == pytest.approx(0.348, abs=1e-3)  # three digits known
    assert np.min(run["s1_x"]) == pytest.approx(0.937, abs=1e-3)
    assert run["rate_x"][-1] == pytest.approx(1.380273, abs=2e-3 if tilt > 1e-4 else 2e-5)


def test_a_fast_member_tumbles():
    inertia = (1.25, 1.6, 0.9)
    body = RigidBody(inertia=inertia, vectors=("s1",))
    law = fast(k=0.2, damping=0.05, inertia=inertia)
    run = fly_continuous(body, law, start=tilted(3.0, 1e-4), times=np.linspace(0, 400, 8001))
    assert np.min(run["s1_x"]) == pytest.approx(-0.794, abs=2e-3)  # three digits known
    assert run["rate_x"][-1] == pytest.approx(0.548, abs=2e-3)


def test_an_upside_down_member_may_be_stable():
    inertia = (1.2383, 1.0444, 0.2469)
    gains = {"beta": 2.3483, "gamma": 0.1122, "k": 4.3756}
    body = RigidBody(inertia=inertia, vectors=("s1",))
    law = spin_law(4.6886, inertia=inertia, **gains)
    assert not spin_condition(law.formula, body, 4.6886).holds
    values = spin_loop(law, 4.6886, side=-1, inertia=inertia).eigenvalues()
    assert max(values.real) == pytest.approx(-0.545, abs=1e-3)
    law = spin_law(0.0, free=True, inertia=inertia, **gains)
    start = tilted(4.6886, math.pi - 0.021)
    run = fly_continuous(body, law, start=start, times=np.array([0.0, 60.0]))
    assert run["s1_x"][-1] == pytest.approx(-1.0, abs=1e-9)
    assert math.hypot(run["s1_y"][-1], run["s1_z"][-1]) < 1e-8
    assert 4.6 < run["rate_x"][-1] < 4.6886  # another member, not far


# -- random starts -----------------------------------------------------------------------------


def random_states(count, seed):
    random = np.random.default_rng(seed)
    return BODY.state(
        rate=random.uniform(-1, 1, (count, 3)),
        attitude=Rotation.random(count, random_state=seed).as_matrix(),
    )


@pytest.mark.slow
@pytest.mark.parametrize(("rated", "off"), [(True, 3.5e-5), (False, 8.3e-4)])
def test_random_starts_reach_the_attitude(rated, off):
    law, _ = cases.vectors(rated=rated)
    runs = fly(BODY, law, starts=random_states(25, 11), duration=25.0, every=1000)
    goal = np.ravel(law.formula.r)
    ends = [np.max(np.abs(cases.named(run, S)[-1] - goal)) for run in runs]
    # The worst of 25 other starts, and room for a slower one: 25 s are 12 or 15 time constants.
    assert max(ends) < 10 * off


@pytest.mark.slow
def test_random_starts_reach_the_spin():
    law, _ = burkov.permanent_rotation(BODY, spin=2.0, **cases.SPIN)
    for run in fly(BODY, law, starts=random_states(12, 12), duration=60.0, every=1000):
        # 12 starts reached 1.1e-3 at 40 s; 3.7 time constants more.
        assert abs(run["s1_x"][-1] - 1) < 1e-3
        assert abs(run["rate_x"][-1] - 2) < 1e-3


@pytest.mark.parametrize("rated", [True, False])
@pytest.mark.parametrize("signs", [(1, -1), (-1, 1), (-1, -1)])
def test_unstable_equilibria_are_left(rated, signs):
    law, _ = cases.vectors(rated=rated)
    r2, r3 = (a * np.array(r) for a, r in zip(signs, law.formula.r, strict=True))
    turned = (
        np.array([np.cross(r2, r3), r2, r3]) @ Rotation.from_rotvec([1e-4, 1e-4, 1e-4]).as_matrix()
    )
    start = BODY.state(rate=np.zeros(3), attitude=turned)
    run = fly_continuous(BODY, law, start=start, times=np.array([0.0, 60.0]))
    assert np.max(np.abs(cases.named(run, S)[-1] - np.ravel(law.formula.r))) < 1e-3


def test_upside_down_spin_rights_itself():
    law, _ = burkov.permanent_rotation(BODY, spin=2.0, **cases.SPIN)
    times = np.array([0.0, 10.0, 20.0, 30.0, 60.0])
    run = fly_continuous(SINGLE, law, start=tilted(2.0, math.pi - 1e-4), times=times)
    # Known for another direction of the first 1e-4 rad, which shifts the fall a little.
    assert run["s1_x"][1] == pytest.approx(-0.99929, abs=1e-3)
    assert run["s1_x"][-1] == pytest.approx(1.0, abs=1e-3)


# -- bad input ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"k2": -2.0}, r"k2 = -2\.0"),
        ({"G": (1.5, 0.0, 1.2)}, r"G\[1\] = 0\.0"),
        ({"r2": (1.0, 0.1, 0.0), "r3": (0.0, 0.0, 1.0)}, r"r2 must be a unit vector: .* 1\.00498"),
        (
            {"r2": (1.0, 0.0, 0.0), "r3": (0.6, 0.8, 0.0)},
            r"r2 and r3 must be orthogonal: .* = 0\.6",
        ),
        ({"r2": (0.0, 0.0, 0.0)}, r"r2 must be a unit vector: its length is 0; nearest: \(none\)"),
        ({"r3": (1.0, 0.0)}, "r3 has 2 entries; there must be 3"),
        ({"G": None}, "here: nothing"),
        ({"D2": (1.0, 1.0, 1.0)}, "here: G, D2"),
        ({"accuracy": 0.0}, r"accuracy = 0\.0"),
    ],
)
def test_bad_input_is_named(changes, words):
    with pytest.raises(ValueError, match=words):
        cases.vectors(rated=True, **changes)


def test_filters_need_all_their_gains():
    with pytest.raises(ValueError, match=r"D3\[2\] = -4\.0"):
        cases.vectors(rated=False, D3=(6.0, 5.0, -4.0))
    with pytest.raises(ValueError, match=r"here: G2, G3, D2$"):
        cases.vectors(rated=False, D3=None)


def test_a_spin_outside_the_condition_is_refused():
    gains = {"beta": 0.590931, "gamma": 0.590931, "k": 1.6}
    words = r"\(5\.19\).* not 1\.44 < 1\.3968.* below 1\.96977 rad/s.* beta gamma above 0\.36"
    with pytest.raises(ValueError, match=words):
        burkov.permanent_rotation(BODY, spin=2.0, alpha=1.0, **gains)
    with pytest.raises(ValueError, match=r"Theorem 5\.4 as corrected"):
        burkov.two_torques(BODY, spin=2.0, **gains)
    burkov.two_torques(BODY, spin=-1.9, **gains)
    with pytest.raises(ValueError, match="spin = nan must be finite"):
        burkov.two_torques(BODY, spin=math.nan, **gains)
    with pytest.raises(ValueError, match=r"alpha = 0\.0"):
        burkov.permanent_rotation(BODY, spin=1.0, alpha=0.0, **gains)


def test_no_rate_is_read_without_g():
    law, _ = cases.vectors(rated=False)
    assert list(law.sensors) == S
    blind = replace(law, sensors=(*S, "rate_x"))

    class Vectors:  # the body without rate sensors
        inputs, rates = BODY.inputs, staticmethod(BODY.rates)

        @property
        def units(self):
            return {name: "" for name in BODY.units if not name.startswith("rate")}

        def readings(self, x):
            return x[..., 3:]

    start = BODY.state(rate=np.ones(3), attitude=np.eye(3))
    (run,) = fly(Vectors(), law, starts=start, duration=0.02)
    assert np.all(np.isfinite(run["torque_x"]))
    with pytest.raises(ValueError, match="sensor 'rate_x' is not in Vectors"):
        fly(Vectors(), blind, starts=start, duration=0.02)
