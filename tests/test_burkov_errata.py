"""The misprints and errors of Burkov (1998), listed in controllers/ERRATA.md.

Each test shows that the corrected statement holds and that the printed one does not.
"""

import math
from dataclasses import replace

import burkov_cases as cases
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controllers import burkov
from controllers.burkov_lyapunov import (
    body_energy,
    flexible_energy,
    position_energy,
    position_loss,
    spin_condition,
)
from spacecraft_sim.dynamics import jacobian, linear_plant
from spacecraft_sim.euler_poisson import RigidBody
from spacecraft_sim.loop_margins import close
from spacecraft_sim.mechanisms import linear_mechanism
from spacecraft_sim.smooth_flight import closed_loop, fly

ARM, TARGET, BODY = cases.ARM, cases.TARGET, cases.BODY
K2, K3 = np.diag(cases.GAINS["K2"]), np.diag(cases.GAINS["K3"])
EXACT = 1e-6  # differences of V: 1e-12 of their fifth derivatives, some 1e5
WRONG = 1.0  # a residual that is no rounding, W


def rate_of(energy, rates, state):
    return float(jacobian(lambda z: [energy(z)], state)[0] @ rates)


# -- sections 2 to 4 ---------------------------------------------------------------------------


def residuals(rates, claim):
    """Largest |V' - claim| of the V of Theorem 2.1 over random states (q, q', qh)."""
    law, _ = cases.position()
    worst = 0.0
    for z in np.random.default_rng(1).normal(size=(20, 6)):

        def energy(z):
            return position_energy(law.formula, ARM, z[:2], z[2:4], z[:2] - z[4:])

        worst = max(worst, abs(rate_of(energy, rates(z), z) - claim(z)))
    return worst


def claimed(z):
    law, _ = cases.position()
    return -position_loss(law.formula, law.filter.cutoffs, z[:2] - z[4:])


def by_damping(damping):
    """Rates of the loop (2.1), (2.2) with one or another damping torque."""
    law, _ = cases.position()

    def rates(z):
        q, v, qh = z.reshape(3, 2)
        M = np.array(law.formula.command(0.0, q.tolist(), [0.0, 0.0])) + damping(q, v, qh)
        return np.r_[v, ARM.acceleration(q, v, M), K3 @ (q - qh)]

    return rates


def test_02_the_damping_acts_on_the_filtered_rate():
    corrected = by_damping(lambda q, v, qh: -K2 @ (q - qh))
    printed = by_damping(lambda q, v, qh: -K2 @ v)
    z = np.array([0.3, 0.1, 1.0, -2.0, 0.2, 0.4])
    assert corrected(z) == pytest.approx(closed_loop(ARM, cases.position()[0])(0.0, z), rel=1e-12)
    assert residuals(corrected, claimed) < EXACT
    assert residuals(printed, claimed) > 1e3 * WRONG
    # Both are stable: that a flight settles tells nothing.  The poles do.
    q, still = np.array(TARGET), np.zeros(2)
    A = jacobian(printed, np.r_[q, still, q])[:4, :4]
    known = [-1145.6, -119.4, -0.1736, -0.1199]
    assert np.sort(np.linalg.eigvals(A).real) == pytest.approx(known, rel=1e-3)  # digits known


def test_03_the_filter_is_driven_by_the_velocity():
    law, _ = cases.position()
    z = np.array([0.3, 0.1, 1.0, -2.0, 0.2, 0.4])
    rates = closed_loop(ARM, law)(0.0, z)
    w, rate_of_w = z[:2] - z[4:], rates[:2] - rates[4:]
    assert rate_of_w == pytest.approx(-K3 @ w + z[2:4], abs=1e-12)
    # As printed, qh' in the place of q': w would never change.
    assert -K3 @ w + rates[4:] == pytest.approx([0.0, 0.0], abs=1e-12)

    def printed(z):
        corrected = by_damping(lambda q, v, qh: -K2 @ (q - qh))(z)
        return np.r_[corrected[:4], z[2:4]]  # qh' = q', so w' = 0

    assert residuals(printed, claimed) > 1e3 * WRONG


def test_04_the_linear_approximation_of_theorem_2_2():
    law, _ = cases.position(gravity="at the target")
    A, g_q = ARM.mass_matrix(TARGET), jacobian(ARM.gravity, np.array(TARGET))
    one, zero = np.eye(2), np.zeros((2, 2))
    inverse = np.linalg.inv(A)
    corrected = np.block(
        [
            [zero, one, zero],  # x' = y
            [-inverse @ (np.array(law.formula.K1) + g_q), zero, -inverse @ K2],  # y', not x'
            [zero, one, -K3],
        ]
    )
    found = close(law, linear_mechanism(ARM, q=TARGET)).eigenvalues()
    assert np.sort_complex(np.linalg.eigvals(corrected)) == pytest.approx(
        np.sort_complex(found), abs=1e-7
    )  # differences


def test_06_the_derivative_of_the_inverse_and_not_the_inverse_of_the_derivative():
    q, v, a = (np.array(x) for x in cases.PROGRAMME(0.7))
    plant = linear_mechanism(ARM, q=q, v=v, a=a)
    inverse = np.linalg.inv(ARM.mass_matrix(q))
    B_q = jacobian(lambda x: ARM.bias(x, v) + ARM.gravity(x), q)
    force = ARM.mass_matrix(q) @ a
    of_inverse = jacobian(lambda x: np.linalg.solve(ARM.mass_matrix(x), force), q)
    L = -inverse @ B_q + of_inverse
    assert plant.A[2:, :2] == pytest.approx(L, abs=1e-9)  # differences
    # A does not depend on q_1 at all: (A_q)^-1 does not exist.
    assert jacobian(lambda x: ARM.mass_matrix(x).ravel(), q)[:, 0] == pytest.approx(
        [0.0] * 4, abs=1e-9
    )


def test_07_the_filter_of_a_path_is_consistent_as_printed():
    law, _ = cases.path()
    t, nu = 0.4, 30.0
    motion = cases.PROGRAMME(t)
    q, v, qh = np.array([0.3, 0.9]), np.array([-1.0, 0.4]), np.array([5.0, 20.0])
    w = nu * q - qh  # K3 = K4 = 1
    rate_of_qh = nu * w + nu * np.array(motion.v)  # (3.2)
    assert nu * v - rate_of_qh == pytest.approx(-nu * w + nu * (v - motion.v), abs=1e-10)  # (3.3)
    zh = qh - nu * np.array(motion.q)  # what the loop keeps here
    rates = closed_loop(ARM, law)(t, np.r_[q, v, zh])
    assert rates[4:] + nu * np.array(motion.v) == pytest.approx(rate_of_qh, abs=1e-10)


def test_08_the_function_of_theorem_4_1_has_five_arguments():
    law, _ = cases.flexible()
    rates = closed_loop(cases.FLEXIBLE, law)
    for z in np.random.default_rng(2).normal(size=(5, 15)):

        def energy(z, w=None, q2=None):
            q1, own, v1, v2, zh = z.reshape(5, 3)
            w = own - zh if w is None else w
            return flexible_energy(law.formula, cases.FLEXIBLE, (q1, own), (v1, v2), w)

        loss = position_loss(law.formula, law.filter.cutoffs, z[3:6] - z[12:])
        assert rate_of(energy, rates(0.0, z), z) == pytest.approx(-loss, abs=EXACT, rel=1e-7)
        # Without w2 among its arguments it does not fall by the loss.
        fixed = rate_of(lambda z: energy(z, w=np.zeros(3)), rates(0.0, z), z)
        assert abs(fixed + loss) > WRONG


# -- section 5 ---------------------------------------------------------------------------------


def body_states(law, count=10):
    random, body = np.random.default_rng(3), replace(BODY, vectors=("s2", "s3"))
    rates = closed_loop(body, law)
    for seed in range(count):
        s = Rotation.random(random_state=seed).as_matrix()[1:].ravel()
        filters = s + random.normal(size=len(law.filter.cutoffs)) if law.filter.cutoffs else ()
        z = np.r_[random.normal(size=3), s, filters]
        yield z, rates(0.0, z)


def kinetic(z):
    return BODY.inertia @ z[:3] ** 2 / 2


def springs(law, z, side=1.0):
    """sum k_i |s_i - side r_i|^2 / 2."""
    return np.repeat(law.formula.k, 3) @ (z[3:9] - side * np.ravel(law.formula.r)) ** 2 / 2


def filters(law, z):
    """sum w_i G_i w_i / 2."""
    return np.ravel(law.formula.G) @ (z[3:9] - z[9:]) ** 2 / 2


def test_09_one_half_stands_before_the_stiffnesses():
    law, _ = cases.vectors(rated=True)
    for z, rates in body_states(law):
        loss = law.formula.G @ z[:3] ** 2
        assert body_energy(law.formula, BODY, z[3:9], z[:3], ()) == pytest.approx(
            kinetic(z) + springs(law, z)
        )
        halved = rate_of(lambda z: kinetic(z) + springs(law, z), rates, z)
        assert halved == pytest.approx(-loss, abs=EXACT)
        printed = rate_of(lambda z: kinetic(z) + 2 * springs(law, z), rates, z)
        attraction = np.array(law.formula.command(0.0, [*z[3:9], 0, 0, 0], []))
        assert printed + loss == pytest.approx(-z[:3] @ attraction, abs=EXACT)
        assert abs(z[:3] @ attraction) > 1e-3


def test_10_the_function_of_instability_has_the_other_vectors():
    law, _ = cases.vectors(rated=True)
    off = []
    for z, rates in body_states(law):
        loss = law.formula.G @ z[:3] ** 2
        corrected = rate_of(lambda z: kinetic(z) - springs(law, z, side=-1.0), rates, z)
        assert corrected == pytest.approx(-loss, abs=EXACT)
        off.append(abs(rate_of(lambda z: kinetic(z) - springs(law, z), rates, z) + loss))
    assert max(off) > WRONG


def test_11_the_filters_keep_their_sign_in_the_function_of_instability():
    law, _ = cases.vectors(rated=False)
    off = []
    for z, rates in body_states(law):
        loss = (np.ravel(law.formula.G) * law.filter.cutoffs) @ (z[3:9] - z[9:]) ** 2
        opposite = rate_of(
            lambda z: kinetic(z) - springs(law, z, side=-1.0) + filters(law, z), rates, z
        )
        assert opposite == pytest.approx(-loss, abs=1e2 * EXACT)  # of some 1e3 W
        printed = rate_of(
            lambda z: kinetic(z) - springs(law, z, side=-1.0) - filters(law, z), rates, z
        )
        off.append(abs(printed + loss))
    assert max(off) > WRONG


def test_12_equal_stiffnesses_do_not_isolate_the_equilibria():
    law, _ = cases.vectors(rated=False)
    r2, r3 = map(np.array, law.formula.r)
    axis = (r2 + 2 * r3) / math.sqrt(5)
    turn = Rotation.from_rotvec(math.pi * axis).as_matrix()
    s = [*(turn @ r2), *(turn @ r3)]
    for k, balanced in (((1.5, 1.5), True), ((2.0, 1.2), False)):
        torque = replace(law.formula, k=k).command(0.0, s, [0.0] * 6)
        assert (np.linalg.norm(torque) < 1e-14) == balanced


def spin_values(c, side, *, inertia, beta, gamma, k):
    body = RigidBody(inertia=inertia, vectors=("s1",))
    slow, _ = burkov.two_torques(body, spin=0.0, beta=beta, gamma=gamma, k=k)
    state = np.array([c, 0, 0, side, 0, 0], dtype=float)
    plant = linear_plant(body, state=state, torques=np.zeros(3), basis=np.eye(6)[:, [1, 2, 4, 5]])
    return slow, max(close(slow, plant).eigenvalues().real)


def test_15_the_upside_down_spin_is_unstable_only_under_the_condition():
    random, broken = np.random.default_rng(4), 0
    for _ in range(150):
        inertia = np.sort(random.uniform(0.2, 2, 3))[random.permutation(3)]
        if 2 * inertia.max() > inertia.sum():
            continue
        beta, gamma = 10 ** random.uniform(-1.5, 0.5, 2)
        k, c = 10 ** random.uniform(-1, 1), random.uniform(0.3, 6)
        gains = {"inertia": tuple(inertia), "beta": beta, "gamma": gamma, "k": k}
        law, upside_down = spin_values(c, -1, **gains)
        _, upright = spin_values(c, 1, **gains)
        if spin_condition(law.formula, RigidBody(inertia=tuple(inertia)), c).holds:
            assert upright < 0 < upside_down
        else:
            broken += upside_down < 0
    assert broken > 0  # printed: unstable, whatever the gains
    example = {"inertia": (1.2383, 1.0444, 0.2469), "beta": 2.3483, "gamma": 0.1122, "k": 4.3756}
    assert spin_values(4.6886, -1, **example)[1] == pytest.approx(-0.545, abs=1e-3)


def test_16_fast_members_of_the_family_are_not_stable():
    gains = {"inertia": BODY.inertia, "beta": 0.3, "gamma": 0.3, "k": 1.6}
    law, growth = spin_values(2.0, 1, **gains)
    assert growth == pytest.approx(0.17818, abs=1e-5)  # printed: stable, for every c
    assert not spin_condition(law.formula, BODY, 2.0).holds
    slow = 0.99 * 2 * 0.3 / 0.6
    assert spin_condition(law.formula, BODY, slow).holds
    assert spin_values(slow, 1, **gains)[1] < 0
    _, claims = burkov.two_torques(BODY, spin=0.9, beta=0.3, gamma=0.3, k=1.6, period=3e-2)
    corrected, printed = claims[2:]
    for p, kept in ((0.9, True), (2.0, False)):
        attitude = Rotation.from_rotvec([0.0, 1e-3, 0.0]).as_matrix()
        start = BODY.state(rate=np.array([p, 0.0, 0.0]), attitude=attitude)
        fast = replace(law, filter=replace(law.filter, period=3e-2))
        (run,) = fly(BODY, fast, starts=start, duration=40.0, tolerance=1e-8)
        assert printed.check(run).holds == kept
        assert not printed.check(run).failed  # nothing that it asks for is missing
        assert corrected.check(run).holds == kept
        assert bool(corrected.check(run).failed) != kept


def test_17_the_laws_of_spin_need_a_bound_of_the_inertias():
    gains = {"beta": 0.3, "gamma": 0.3, "k": 1.6}
    assert spin_values(2.0, 1, inertia=(0.9, 1.3, 1.2), **gains)[1] < 0
    assert spin_values(2.0, 1, inertia=(0.9, 1.6, 1.0), **gains)[1] > 0
