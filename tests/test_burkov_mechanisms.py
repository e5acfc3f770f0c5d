"""Burkov (1998), sections 2 and 4: poles, flights, boundaries, equilibria, bad input."""

import math
from dataclasses import replace

import burkov_cases as cases
import numpy as np
import pytest

from controllers import burkov
from controllers.burkov_energy import potential_energy
from controllers.burkov_lyapunov import (
    flexible_energy,
    gravity_condition,
    position_energy,
    position_loss,
    rests,
)
from spacecraft_sim.dynamics import jacobian
from spacecraft_sim.loop_margins import close
from spacecraft_sim.mechanisms import linear_flexible, linear_mechanism
from spacecraft_sim.smooth_flight import closed_loop, fly, fly_continuous

ARM, TARGET, FLEXIBLE = cases.ARM, cases.TARGET, cases.FLEXIBLE


def sorted_poles(values):
    return np.array(sorted(values, key=lambda z: (round(z.real, 6), z.imag)))


def poles(*, real=(), pairs=()):
    both = [z for pair in pairs for z in (complex(pair), complex(pair).conjugate())]
    return sorted_poles([*map(complex, real), *both])


# -- linear figures ----------------------------------------------------------------------------


def test_poles_at_a_position():
    law, _ = cases.position()
    loop = close(law, linear_mechanism(ARM, q=TARGET))
    known = poles(
        real=[-11.804692, -2.692535], pairs=[-10.580797 + 33.557424j, -4.670590 + 3.793101j]
    )
    assert sorted_poles(loop.eigenvalues()) == pytest.approx(known, abs=1e-6)  # last digit


def test_poles_with_elastic_joints():
    law, _ = cases.flexible()
    loop = close(law, linear_flexible(FLEXIBLE, q=cases.FLEXIBLE_TARGET))
    known = poles(
        real=[-2.302530, -1.865099, -1.848259],
        pairs=[
            -7.131821 + 51.010254j, -6.875331 + 57.404989j, -4.812184 + 37.592240j,
            -4.278853 + 61.372762j, -2.348968 + 21.948427j, -1.544898 + 5.060023j,
        ],
    )  # fmt: skip
    assert sorted_poles(loop.eigenvalues()) == pytest.approx(known, abs=1e-6)  # last digit


@pytest.mark.parametrize(("scale", "slowest"), [(0.01, -0.020), (100.0, -0.0022)])
def test_soft_and_stiff_holding_of_elastic_joints_is_stable(scale, slowest):
    K0 = tuple(scale * k for k in cases.FLEXIBLE_GAINS["K0"])
    loop = close(cases.flexible(K0=K0)[0], linear_flexible(FLEXIBLE, q=cases.FLEXIBLE_TARGET))
    assert max(loop.eigenvalues().real) == pytest.approx(slowest, rel=0.05)  # two digits known


UPRIGHT = (math.pi, 0.0)


def upright(rho):
    return burkov.position(
        ARM, target=UPRIGHT, K1=(rho, rho / 2), K2=(600.0, 250.0), K3=(20.0, 25.0),
        gravity="at the target",
    )  # fmt: skip


CRITICAL = 46.21875  # K1 + g_q is singular for K1 = rho diag(1, 1/2)


@pytest.mark.parametrize(
    ("share", "pole"), [(0.97, 0.0478), (0.99, 0.0160), (1.01, -0.0161), (1.03, -0.0484)]
)
def test_the_boundary_of_theorem_2_2(share, pole):
    law, _ = upright(1.2 * CRITICAL)
    rho = share * CRITICAL
    formula = replace(law.formula, K1=((rho, 0.0), (0.0, rho / 2)))
    loop = close(replace(law, formula=formula), linear_mechanism(ARM, q=UPRIGHT))
    # Known to four decimals: within 1e-4 as asked.
    assert max(loop.eigenvalues().real) == pytest.approx(pole, abs=6e-5)
    assert gravity_condition(formula, ARM).holds == (share > 1)


@pytest.mark.parametrize(("share", "left"), [(0.97, 3.5e-3), (1.03, 3.2e-4)])
def test_flights_on_either_side_of_that_boundary(share, left):
    law, _ = upright(1.2 * CRITICAL)
    rho = share * CRITICAL
    law = replace(law, formula=replace(law.formula, K1=((rho, 0.0), (0.0, rho / 2))))
    start = np.array([math.pi + 1e-3, 0.0, 0.0, 0.0])
    run = fly_continuous(ARM, law, start=start, times=np.array([0.0, 25.0]))
    off = math.hypot(run["joint_1"][-1] - math.pi, run["joint_2"][-1])
    # The start is known to be 1e-3, not in which direction.
    assert off == pytest.approx(left, rel=0.25)


# -- equilibria --------------------------------------------------------------------------------


def test_a_constant_torque_against_gravity_has_other_equilibria():
    law, claims = cases.position(
        target=(0.0, 0.0), K1=(4.0, 4.0), gravity="at the target", period=5e-3
    )
    found = rests(law.formula, ARM)
    known = [(0.0, 0.0), (5.6321, 0.4301), (-5.6321, -0.4301), (3.3194, 1.8010), (-3.3194, -1.8010)]
    assert len(found) == 5
    for q in known:
        assert min(math.dist(q, rest.q) for rest in found) < 1e-4  # digits known
    assert [rest.unstable for rest in found] == [0, 0, 0, 1, 1]
    assert found[0].energy == pytest.approx(0.0, abs=1e-9)
    for rest in found:
        plant = linear_mechanism(ARM, q=rest.q)
        growing = np.sum(close(law, plant).eigenvalues().real > 0)
        assert growing == rest.unstable
    least = [
        np.linalg.eigvalsh(4 * np.eye(2) + jacobian(ARM.gravity, np.array(q)))[0]
        for q in known[1::2]
    ]
    assert least == pytest.approx([9.66, -27.0], rel=2e-3)  # three digits known
    # A start above the next equilibrium is outside the hypotheses, and ends elsewhere.
    (run,) = fly(ARM, law, starts=np.array([5.7, 0.4, 0.0, 0.0]), duration=12.0, tolerance=1e-8)
    verdict = claims[1].check(run)
    assert not verdict.holds
    assert any("every other equilibrium" in a.text for a in verdict.failed)
    assert run["joint_1"][-1] == pytest.approx(5.6321, abs=1e-3)


def test_gravity_at_the_position_leaves_one_equilibrium():
    law, _ = cases.position(K1=(4.0, 4.0))
    pull = jacobian(
        lambda q: law.formula.command(0.0, q.tolist(), [0.0, 0.0]), np.array([2.0, 1.0])
    )
    assert pull - jacobian(ARM.gravity, np.array([2.0, 1.0])) == pytest.approx(
        -4 * np.eye(2), abs=1e-8
    )


# -- trajectories ------------------------------------------------------------------------------

KNOWN = {
    0.25: (1.172838, -0.945070, -1.746509, -0.169078, 1.255377, -0.937362),
    0.5: (0.826621, -0.996277, -0.948470, -0.069597, 0.882968, -0.991588),
    1.0: (0.632251, -0.947309, -0.099069, 0.124273, 0.638658, -0.952574),
}
START = np.array([1.5, -1.0, 0.0, 0.0])
READINGS = ("joint_1", "joint_2", "joint_1_rate", "joint_2_rate")


def test_a_flight_in_continuous_time():
    law, _ = cases.position()
    run = fly_continuous(ARM, law, start=START, times=np.array([0.0, *KNOWN]))
    for k, known in enumerate(KNOWN.values(), 1):
        found = [run[name][k] for name in READINGS]
        found += [run[f"joint_{i}"][k] - run[f"w_{i}"][k] for i in (1, 2)]
        assert found == pytest.approx(known, abs=1e-6)  # last digit


# At 1 ms a held reading makes the damping 1.3 % too large, and 3 mrad: three times too much.
@pytest.mark.parametrize(
    ("hold", "off"), [("first-order hold", 1e-3), ("tustin", 1e-3), ("zero-order hold", 4e-3)]
)
def test_a_flight_of_the_sampled_law(hold, off):
    (run,) = fly(ARM, cases.position(hold=hold)[0], starts=START, duration=1.0)
    for t, known in KNOWN.items():
        found = [run[name][round(1000 * t)] for name in READINGS]
        assert found[:2] == pytest.approx(known[:2], abs=off)


def random_starts(count, n, angle, rate, seed):
    random = np.random.default_rng(seed)
    return np.hstack(
        [random.uniform(-angle, angle, (count, n)), random.uniform(-rate, rate, (count, n))]
    )


@pytest.mark.slow
def test_thirty_random_starts_reach_the_position():
    law, _ = cases.position()
    starts = random_starts(30, 2, math.pi, 3.0, seed=1)
    for run in fly(ARM, law, starts=starts, duration=12.0, every=1000):
        off = math.dist((run["joint_1"][-1], run["joint_2"][-1]), TARGET)
        # 32 of the longest time constants; the step's own tolerance is 1e-12.
        assert off < 1e-9


@pytest.mark.slow
def test_ten_random_starts_reach_the_position_with_elastic_joints():
    law, _ = cases.flexible()
    random = np.random.default_rng(2)
    q = random.uniform(-math.pi, math.pi, (10, 3))
    starts = np.hstack([q, q + random.uniform(-0.3, 0.3, (10, 3)), random.uniform(-2, 2, (10, 6))])
    for run in fly(FLEXIBLE, law, starts=starts, duration=30.0, every=1000):
        for part in ("link", "rotor"):
            q = [run[f"{part}_{k}"][-1] for k in (1, 2, 3)]
            assert math.dist(q, cases.FLEXIBLE_TARGET) < 1e-9  # 46 of the longest time constants


@pytest.mark.slow
@pytest.mark.parametrize(("share", "reached"), [(0.9, False), (1.0, True), (1.1, True)])
def test_torque_that_falls_short_of_gravity_does_not_hold(share, reached):
    target = (1.5, 0.5)
    law, _ = cases.position(target=target, period=1e-2)
    assert ARM.gravity(target) == pytest.approx([41.4, 7.14], abs=0.05)  # digits known
    largest = 9.81 * np.array([3.0 * 0.5 + 2.0 + 2.0 * 0.4, 2.0 * 0.4])  # of |g_i| anywhere
    starts = random_starts(8, 2, math.pi, 0.0, seed=6)
    for run in fly(
        ARM, law, starts=starts, duration=9.0, limits=share * largest, every=100, tolerance=1e-8
    ):
        off = math.dist((run["joint_1"][-1], run["joint_2"][-1]), target)
        assert (off < 0.01) == reached


# -- Lyapunov functions ------------------------------------------------------------------------


def rate_of(energy, rates, state):
    """dV/dt along a motion, by differences of V."""
    return float(jacobian(lambda z: [energy(z)], state)[0] @ rates(0.0, state))


@pytest.mark.parametrize("gravity", ["at the position", "at the target"])
def test_v_falls_by_the_loss_of_the_filter(gravity):
    law, _ = cases.position(gravity=gravity)
    rates, random = closed_loop(ARM, law), np.random.default_rng(4)
    for _ in range(20):
        z = random.normal(size=6) * [1.5, 1.5, 2, 2, 1, 1]  # (q, q', qh)

        def energy(z):
            return position_energy(law.formula, ARM, z[:2], z[2:4], z[:2] - z[4:])

        loss = position_loss(law.formula, law.filter.cutoffs, z[:2] - z[4:])
        # Differences leave 1e-12 of the fifth derivatives of V, some 1e3.
        assert rate_of(energy, rates, z) == pytest.approx(-loss, rel=1e-7, abs=1e-6)


def test_v_falls_by_the_loss_of_the_filter_with_elastic_joints():
    law, _ = cases.flexible()
    rates, random = closed_loop(FLEXIBLE, law), np.random.default_rng(5)
    for _ in range(10):
        z = random.normal(size=15)  # (q1, q2, q1', q2', qh)

        def energy(z):
            q1, q2, v1, v2, zh = z.reshape(5, 3)
            return flexible_energy(law.formula, FLEXIBLE, (q1, q2), (v1, v2), q2 - zh)

        loss = position_loss(law.formula, law.filter.cutoffs, z[3:6] - z[12:])
        assert rate_of(energy, rates, z) == pytest.approx(-loss, rel=1e-7, abs=1e-6)


def test_the_potential_is_the_work_against_gravity():
    q, start = np.array([4.0, -5.0]), np.array([-2.0, 1.0])
    exact = float(ARM.potential(q) - ARM.potential(start))
    assert potential_energy(ARM, q, start) == pytest.approx(exact, abs=1e-10)  # a smooth integrand


# -- bad input ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"K2": (600.0, -250.0)}, r"K2\[1\] = -250\.0"),
        ({"K3": (0.0, 25.0)}, r"K3\[0\] = 0\.0"),
        ({"K1": (80.0, math.nan)}, r"K1\[1\] = nan"),
        (
            {"K1": ((80.0, 9.0), (8.0, 40.0))},
            r"symmetric: K1\[\d\]\[\d\] = \d, K1\[\d\]\[\d\] = \d",
        ),
        ({"K1": ((1.0, 9.0), (9.0, 40.0))}, r"K1 must be positive definite: .* -0\.97"),
        ({"K1": (80.0,)}, "K1 has 1 entries; there must be 2"),
        ({"K2": (600.0,) * 3}, "K2 has 3 entries; there must be 2"),
        ({"target": (0.6, math.inf)}, r"target\[1\] = inf"),
        ({"period": -1e-3}, r"period = -0\.001"),
        ({"accuracy": 0.0}, r"accuracy = 0\.0"),
        ({"hold": "euler", "period": 0.09}, r"K T < 2"),
    ],
)
def test_bad_gains_are_named(changes, words):
    with pytest.raises(ValueError, match=words):
        cases.position(**changes)


def test_gains_of_another_arm_are_told():
    with pytest.raises(ValueError, match="target has 1 entries; there must be 2"):
        cases.position(target=(0.6,), K1=(80.0,), K2=(600.0,), K3=(20.0,))
    with pytest.raises(ValueError, match="target has 2 entries; there must be 3"):
        cases.flexible(target=(0.5, -0.8), K0=(40.0,) * 2, K2=(400.0,) * 2, K3=(20.0,) * 2)


def test_a_stiffness_below_that_of_gravity_is_refused():
    with pytest.raises(ValueError, match=r"Theorem 2\.2: K1 \+ g_q\(q_p\) > 0.* not -1\.24"):
        upright(0.97 * CRITICAL)


def test_gravity_needs_a_mechanism():
    with pytest.raises(ValueError, match='gravity = "at the position" needs a mechanism'):
        burkov.position(None, target=TARGET, **cases.GAINS)
    law, claims = burkov.position(None, target=TARGET, **cases.GAINS, gravity="none")
    assert claims == ()
    assert law.formula.command(0.0, TARGET, [0.0, 0.0]) == pytest.approx([0.0, 0.0], abs=1e-12)


def test_bad_gains_of_elastic_joints_are_named():
    with pytest.raises(ValueError, match=r"K0\[2\] = -12\.0"):
        cases.flexible(K0=(40.0, 25.0, -12.0))


# -- no velocities -----------------------------------------------------------------------------


@pytest.mark.parametrize("design", [cases.position, cases.path, cases.flexible])
def test_no_velocity_is_read(design):
    law, _ = design()
    plant = FLEXIBLE if design is cases.flexible else ARM

    class Blind:  # the same plant with its velocities hidden
        inputs = plant.inputs
        rates = staticmethod(plant.rates)

        @property
        def units(self):
            return {name: unit for name, unit in plant.units.items() if unit == "rad"}

        def readings(self, x):
            return plant.readings(x)[..., : len(self.units)]

    start = np.full(2 * len(plant.units), 0.1)[: 12 if design is cases.flexible else 4]
    (seen,) = fly(plant, law, starts=start, duration=0.05)
    (blind,) = fly(Blind(), law, starts=start, duration=0.05)
    assert np.array_equal(seen["motor_1"], blind["motor_1"])
    wanting = replace(law, sensors=(*law.sensors, next(n for n in plant.units if "rate" in n)))
    with pytest.raises(ValueError, match="_rate' is not in Blind"):
        fly(Blind(), wanting, starts=start, duration=0.05)
