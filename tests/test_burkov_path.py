"""Burkov (1998), section 3: paths, tubes, planning anew, programmes."""

import math
import pickle
from dataclasses import replace

import burkov_cases as cases
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers import burkov
from controllers.burkov_path import Replanning, frozen_loops
from controllers.programmes import Harmonic, Return
from spacecraft_sim.controller import Controller
from spacecraft_sim.smooth_flight import fly, fly_continuous

ARM, PROGRAMME = cases.ARM, cases.PROGRAMME
KNOWN = {
    0.1: (0.229506, -0.100001, -0.729929, 0.573177),
    0.3: (0.069268, -0.061221, -0.641346, 0.126029),
    0.6: (0.006088, -0.027986, -0.057001, 0.102446),
    1.0: (0.001456, -0.006364, -0.005288, 0.027258),
}


def start(x=(0.3, -0.2), *, programme=PROGRAMME):
    """The programme's own motion, off by x."""
    motion = programme(0.0)
    return np.r_[np.array(motion.q) + x, motion.v]


def deviations(run, programme=PROGRAMME):
    path = np.array([programme(t).q for t in run.time])
    return cases.named(run, ("joint_1", "joint_2")) - path


# -- trajectories ------------------------------------------------------------------------------


def test_a_flight_in_continuous_time():
    law, _ = cases.path()
    run = fly_continuous(ARM, law, start=start(), times=np.array([0.0, *KNOWN]))
    found = np.hstack([deviations(run), cases.named(run, ("w_1", "w_2"))])[1:]
    assert found == pytest.approx(np.array(list(KNOWN.values())), abs=1e-6)  # last digit


def test_a_flight_of_the_sampled_law():
    (run,) = fly(ARM, cases.path()[0], starts=start(), duration=1.0)
    found = deviations(run)[[round(1000 * t) for t in KNOWN]]
    known = np.array(list(KNOWN.values()))[:, :2]
    assert found == pytest.approx(known, abs=1e-3)  # what is asked for


@pytest.mark.slow
def test_random_starts_reach_the_path():
    law, _ = cases.path()
    random = np.random.default_rng(7)
    for _ in range(8):
        off = random.uniform(-1, 1, 4)
        run = fly_continuous(ARM, law, start=start((0, 0)) + off, times=np.linspace(0, 10, 101))
        assert np.max(np.abs(deviations(run)[-1])) < 3e-9


@pytest.mark.slow
@pytest.mark.parametrize(("gamma", "reached"), [(5.0, False), (8.0, False), (20.0, True)])
def test_an_upright_path_needs_enough_gain(gamma, reached):
    programme = replace(PROGRAMME, mean=(math.pi, 0.0))
    law, (claim,) = cases.path(programme=programme, gamma=gamma, period=5e-3)
    assert claim.assumptions[0].holds == reached  # poles frozen along the path
    (run,) = fly(ARM, law, starts=start(programme=programme), duration=11.0, tolerance=1e-8)
    assert (np.max(np.abs(deviations(run, programme)[-100:])) < 0.02) == reached
    verdict = claim.check(run)
    assert verdict.holds == reached
    assert bool(verdict.failed) != reached


@pytest.mark.slow
def test_gain_alone_does_not_help_a_slow_filter():
    for gamma in (1000.0, 50.0):
        law, (claim,) = cases.path(gamma=gamma, nu=1.0)
        assert claim.assumptions[0].value > 0.2
    run = fly_continuous(ARM, law, start=start(), times=np.array([0.0, 10.0]))
    assert np.linalg.norm(deviations(run)[-1]) > 1e-2


def test_the_hold_of_the_feedforward_is_counted():
    """What is left in the end is the torque's lag, half a period, over the stiffness."""
    for period in (5e-3, 7e-3):
        law, (claim,) = cases.path(period=period, accuracy=1e-9)
        (run,) = fly(ARM, law, starts=start((0, 0)), duration=7.0, tolerance=1e-8)
        verdict = claim.check(run)
        assert verdict.holds
        assert verdict.measured > 0.5 * verdict.bound


def test_a_path_that_stands_still_is_a_position():
    """(3.1) is (2.4) with K1 for gamma K0, K2 for gamma kappa nu K1 K4, K3 for nu K3."""
    still = Harmonic(
        mean=cases.TARGET, amplitude=(0.0,) * 2, frequency=(1.0,) * 2, phase=(0.0,) * 2
    )
    one, _ = cases.path(programme=still, kappa=1.5)
    two, _ = cases.position(
        K1=(200.0, 100.0), K2=(50 * 1.5 * 30, 50 * 1.5 * 30 * 0.5), K3=(30.0, 30.0),
        gravity="at the target",
    )  # fmt: skip
    runs = [fly(ARM, law, starts=np.r_[1.0, 0.2, 0, 0], duration=0.5)[0] for law in (one, two)]
    for name in ("joint_1", "joint_2", "motor_1"):
        # The same products in another order, under torques of 80 N m.
        assert runs[0][name] == pytest.approx(runs[1][name], abs=1e-9)


# -- without the torque of the path ------------------------------------------------------------

TUBE = {25.0: 0.1607, 50.0: 0.0889, 100.0: 0.0468, 200.0: 0.0240, 400.0: 0.0121}


@pytest.mark.slow
@pytest.mark.parametrize("gamma", TUBE)
def test_the_tube_shrinks_as_the_gain_grows(gamma):
    law, (claim,) = cases.path(gamma=gamma, feedforward=False)
    times = np.linspace(0, 6, 1201)
    run = fly_continuous(ARM, law, start=start((0, 0)), times=times)
    # Known to its last digit, from rows that may miss the peak by another.
    assert np.max(np.abs(deviations(run)[times > 3])) == pytest.approx(TUBE[gamma], abs=1.1e-4)
    assert gamma * claim.bound == pytest.approx(6.44, abs=0.01)  # O(1/gamma)


def test_the_bound_of_the_tube():
    law, (claim,) = cases.path(gamma=100.0, feedforward=False, period=3.5e-3)
    (run,) = fly(ARM, law, starts=start((0, 0)), duration=10.0)
    verdict = claim.check(run)
    assert verdict.holds
    assert 0.6 * verdict.bound < verdict.measured  # the bound is of the first order, no more


DISTURBED = {50.0: 0.0933, 100.0: 0.0496, 200.0: 0.0256}


@pytest.mark.slow
@pytest.mark.parametrize("gamma", DISTURBED)
def test_the_tube_under_a_bounded_disturbance(gamma):
    law, _ = cases.path(gamma=gamma, feedforward=False)
    times = np.linspace(0, 6, 1201)
    run = fly_continuous(
        ARM, law, start=start((0, 0)), times=times,
        disturbance=lambda t: [5 * math.sin(20 * t), 3 * math.copysign(1, math.sin(7 * t))],
    )  # fmt: skip
    # Found with another integrator across the jumps.
    assert np.max(np.abs(deviations(run)[times > 3])) == pytest.approx(DISTURBED[gamma], abs=3e-4)


# -- planning anew -----------------------------------------------------------------------------

VECTOR = st.tuples(st.floats(-2, 2), st.floats(-2, 2))


@given(VECTOR, VECTOR, st.floats(0.2, 5), st.floats(0.0, 10))
def test_the_way_back_meets_both_ends(deviation, rate, span, t):
    way = Return(programme=PROGRAMME, start=t, end=t + span, deviation=deviation, rate=rate)
    first, programme = np.array(way(t)), np.array(PROGRAMME(t))
    # Rounding of the polynomials, over span^2 for accelerations.
    assert first[0] - programme[0] == pytest.approx(deviation, abs=1e-12)
    assert first[1] - programme[1] == pytest.approx(rate, abs=1e-11)
    assert first[2] == pytest.approx(programme[2], abs=1e-9)
    last = np.array(way(math.nextafter(t + span, 0))) - PROGRAMME(t + span)
    assert np.max(np.abs(last)) < 1e-9
    assert way(t + span + 1) == PROGRAMME(t + span + 1)


@given(VECTOR, VECTOR, st.floats(0.1, 0.9))
def test_the_way_back_is_consistent_with_its_derivatives(deviation, rate, share):
    way = Return(programme=PROGRAMME, start=1.0, end=3.0, deviation=deviation, rate=rate)
    t, h = 1.0 + 2 * share, 1e-5
    before, now, after = (np.array(way(t + k * h)) for k in (-1, 0, 1))
    # Central differences: h^2 of derivatives up to 500, and rounding over h.
    assert (after[:2] - before[:2]) / (2 * h) == pytest.approx(now[1:], abs=1e-6)


@pytest.mark.parametrize("x", [(-2.5, 0.0), (2.5, 0.0), (1.5, -2.0)])
def test_a_new_path_spares_the_motors(x):
    peaks, ends = [], []
    for above in (None, 0.5):
        law, _ = cases.path(replan_above=above, period=4e-3)
        (run,) = fly(ARM, law, starts=start(x), duration=3.0, tolerance=1e-8)
        peaks.append([np.max(np.abs(run[f"motor_{k}"])) for k in (1, 2)])
        ends.append(np.max(np.abs(deviations(run)[-1])))
    # gamma K0 |x| pulls at first on the old path; the new one asks for the torque of a motion.
    assert peaks[0][0] == pytest.approx(200 * abs(x[0]), rel=1e-3)
    assert peaks[1][0] < 0.17 * peaks[0][0]
    assert peaks[1][1] < 0.1 * peaks[0][1]
    if x == (-2.5, 0.0):  # known of a start as far off: 34.7 and 6.2 N m; half a N m for its way
        assert peaks[1] == pytest.approx([34.7, 6.2], abs=0.6)
    assert max(ends) < 2e-3  # what the hold leaves


def test_the_rate_of_the_new_path_is_that_of_the_filter():
    """A push from t = 2 s on carries the arm off; no velocity is read, and the new path fits it."""
    law, _ = cases.path(replan_above=0.2, period=4e-3)
    assert isinstance(law, Replanning)
    assert isinstance(law, Controller)
    (run,) = fly(
        ARM, law, starts=start((0, 0)), duration=6.0, tolerance=1e-8,
        disturbance=lambda t: [100.0 if 2.0 <= t < 2.4 else 0.0, 0.0],
    )  # fmt: skip
    memory, found = law.init(), None
    readings = cases.named(run, law.sensors)
    for k, t in enumerate(run.time.tolist()):
        _, memory = law.step(t, readings[k].tolist(), memory)
        if found is None and memory.formula is not law.formula:
            found = k, memory.formula.programme
    assert found is not None
    k, way = found
    assert isinstance(way, Return)
    assert 2.0 < way.start < 2.4
    true = cases.named(run, ("joint_1_rate", "joint_2_rate"))[k]
    old, new = (np.array(p(way.start).v) for p in (PROGRAMME, way))
    assert np.linalg.norm(true - old) > 1.0  # it is carried off
    # The filter lags by 1/(nu K3) = 33 ms.
    assert np.linalg.norm(true - new) < 0.5 * np.linalg.norm(true - old)
    assert np.max(np.abs(deviations(run)[-1])) < 2e-3
    assert pickle.loads(pickle.dumps(memory)) == memory


def test_it_plans_nothing_while_near():
    near, _ = cases.path(replan_above=0.5)
    plain, _ = cases.path()
    one, two = (fly(ARM, law, starts=start(), duration=0.3)[0] for law in (near, plain))
    assert np.array_equal(one["motor_1"], two["motor_1"])


# -- bad input ---------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"gamma": 0.0}, r"gamma = 0\.0"),
        ({"nu": -30.0}, r"nu = -30\.0"),
        ({"K4": (1.0, -1.0)}, r"K4\[1\] = -1\.0"),
        ({"K1": (1.0,)}, "K1 has 1 entries; there must be 2"),
        ({"feedforward": False, "kappa": 2.0}, r"kappa = 2: \(3\.7\)"),
        ({"replan_above": 0.0}, r"replan_above = 0\.0"),
        ({"blend": 0.0}, r"blend = 0\.0"),
    ],
)
def test_bad_gains_are_named(changes, words):
    with pytest.raises(ValueError, match=words):
        cases.path(**changes)


def test_a_programme_of_another_arm_is_told():
    longer = Harmonic(mean=(0.0,) * 3, amplitude=(0.1,) * 3, frequency=(1.0,) * 3, phase=(0.0,) * 3)
    gains = {name: (1.0,) * 3 for name in ("K0", "K1", "K3", "K4")}
    for feedforward in (True, False):
        with pytest.raises(ValueError, match="programme is of 3 joints; the machine has 2"):
            cases.path(programme=longer, feedforward=feedforward, **gains)


def test_feedforward_needs_a_mechanism():
    gains = {**cases.PATH_GAINS, "gamma": 50.0, "nu": 30.0}
    with pytest.raises(ValueError, match="feedforward needs a mechanism"):
        burkov.path(None, programme=PROGRAMME, **gains)
    law, claims = burkov.path(None, programme=PROGRAMME, feedforward=False, **gains)
    assert claims == ()
    assert law.formula.command(0.0, PROGRAMME(0.0).q, [0.0, 0.0]) == [0.0, 0.0]


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"frequency": (1.0, 0.0)}, r"frequency\[1\] = 0\.0"),
        ({"phase": (0.0,)}, "phase has 1 entries; there must be 2"),
        ({"amplitude": (math.nan, 0.0)}, r"amplitude\[0\] = nan"),
    ],
)
def test_bad_programmes_are_refused(changes, words):
    with pytest.raises(ValueError, match=words):
        replace(PROGRAMME, **changes)


def test_frozen_loops_are_of_paths_alone():
    law, _ = cases.path()
    assert len(frozen_loops(law, ARM, [0.0, 1.0])) == 2
    with pytest.raises(ValueError, match="follows no path: it is a Position"):
        frozen_loops(cases.position()[0], ARM, [0.0])
