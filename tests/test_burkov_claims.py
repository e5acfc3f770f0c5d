"""The guarantees of Burkov (1998) on flights: kept, broken, outside their hypotheses."""

import copy
import dataclasses
import math
import pickle
from dataclasses import replace

import burkov_cases as cases
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controllers import burkov
from controllers.burkov_claims import samples
from spacecraft_sim.controller import Controller
from spacecraft_sim.guarantee import Guarantee
from spacecraft_sim.smooth_flight import fly
from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.thrusters import Thrusters

ARM, BODY, FLEXIBLE = cases.ARM, cases.BODY, cases.FLEXIBLE


def turned(attitude, vector):
    return attitude @ Rotation.from_rotvec(vector).as_matrix()


def near_the_goal():
    return BODY.state(
        rate=np.array([0.2, -0.3, 0.1]), attitude=turned(cases.goal(), [0.5, -0.6, 0.3])
    )


def spinning(p):
    return BODY.state(rate=np.array([p, 0.1, 0.2]), attitude=turned(np.eye(3), [0.3, -0.4, 0.3]))


def spin(**changes):
    return burkov.permanent_rotation(BODY, **{"spin": 2.0, **cases.SPIN, **changes})


def two(**changes):
    gains = {"spin": 1.0, "beta": 1.0, "gamma": 1.0, "k": 1.6}
    return burkov.two_torques(BODY, **{**gains, **changes})


MOVING = np.array([0.2, 0.2, 1.2, 1.0])
STRETCHED = np.r_[0.3, -0.4, 0.2, 0.5, -0.6, 0.3, 0.5, -0.5, 0.3, 0.2, 0.1, -0.1]

# Design, plant, start, duration; periods of some ms, so that the flights are short to compute.
CASES = {
    "(2.1)": (lambda: cases.position(period=8e-3), ARM, np.array([2.5, -2.0, 1.0, -2.0]), 9.0),
    "(2.4)": (
        lambda: cases.position(gravity="at the target", period=8e-3),
        ARM, np.array([1.2, -0.5, 0.5, 0.5]), 9.0,
    ),
    "(3.1)": (lambda: cases.path(period=6e-3), ARM, MOVING, 9.0),
    "(3.7)": (lambda: cases.path(feedforward=False, period=6e-3), ARM, MOVING, 9.0),
    "(4.2)": (lambda: cases.flexible(period=5e-3), FLEXIBLE, STRETCHED, 13.0),
    "(5.4)": (lambda: cases.vectors(rated=True, period=4e-2), BODY, near_the_goal(), 36.0),
    "(5.8)": (lambda: cases.vectors(rated=False, period=4e-2), BODY, near_the_goal(), 46.0),
    "(5.18)": (lambda: spin(period=6e-2), BODY, spinning(1.5), 110.0),
    "(5.20)": (lambda: two(period=6e-2), BODY, spinning(0.4), 90.0),
}  # fmt: skip


@pytest.fixture(scope="module", params=CASES)
def flown(request):
    design, plant, start, duration = CASES[request.param]
    law, claims = design()
    (run,) = fly(plant, law, starts=start, duration=duration, tolerance=1e-8)
    return law, claims, plant, run


def test_every_claim_is_kept_where_its_hypotheses_hold(flown):
    _, claims, plant, run = flown
    assert claims
    assert len({claim.claim for claim in claims}) == len(claims)
    for claim in claims:
        assert isinstance(claim, Guarantee)
        assert set(claim.signals) <= set(plant.units)
        verdict = claim.check(run)
        assert verdict.holds, f"{verdict.claim}: {verdict.measured} > {verdict.bound}"
        assert not verdict.failed
        assert math.isfinite(verdict.measured)
        assert "Burkov 1998, Theorem" in verdict.source


def test_torques_that_are_not_delivered_void_every_claim(flown):
    law, claims, _, run = flown
    name = law.thrusters[0]
    short = dataclasses.replace(run, signals={**run.signals, name: 0.99 * run[name]})
    for claim in claims:
        verdict = claim.check(short)
        assert not verdict.holds
        assert any("delivered as commanded" in a.text for a in verdict.failed)


def test_a_flight_that_ends_too_soon_promises_nothing_of_its_end(flown):
    _, claims, _, run = flown
    cut = len(run.time) // 4
    short = dataclasses.replace(
        run, time=run.time[:cut], signals={k: x[:cut] for k, x in run.signals.items()}
    )
    ends = [c.check(short) for c in claims if "in the end" in c.claim or "settled" in c.claim]
    assert ends
    for verdict in ends:
        assert not verdict.holds
        assert any("settled" in a.text for a in verdict.failed)


def test_laws_are_frozen_pure_and_picklable(flown):
    law, _, _, run = flown
    assert isinstance(law, Controller)
    with pytest.raises(dataclasses.FrozenInstanceError):
        law.thrusters = ()
    before, again = copy.deepcopy(law), pickle.loads(pickle.dumps(law))
    assert again == law == before
    memory = law.init()
    for k in range(4):
        y = [float(run[name][k]) for name in law.sensors]
        t = float(run.time[k])
        u, after = law.step(t, y, memory)
        assert (u, after) == again.step(t, y, pickle.loads(pickle.dumps(memory)))
        assert u == pytest.approx([run[f"{n}_command"][k] for n in law.thrusters], abs=1e-9)
        memory = after
    assert law == before


# -- what is broken shows ----------------------------------------------------------------------


def test_a_flight_that_gains_energy_breaks_the_claims():
    law, (falls, _, stays) = cases.position(period=8e-3)
    wrong = replace(law, formula=replace(law.formula, K2=(-60.0, -25.0)))
    start = np.array([*cases.TARGET, 0.5, -0.5])
    (run,) = fly(ARM, wrong, starts=start, duration=1.2)
    for verdict in (falls.check(run), stays.check(run)):
        assert not verdict.holds
        assert not verdict.failed
        assert verdict.measured > 1.2 * verdict.bound


def test_the_certified_basin_is_a_hypothesis_of_the_end_alone():
    law, claims = cases.vectors(rated=False, period=2e-2)
    attitude = turned(cases.goal(), [0.0, 0.0, 3.0])
    start = BODY.state(rate=np.array([0.5, 0.5, 0.5]), attitude=attitude)
    (run,) = fly(BODY, law, starts=start, duration=42.0, tolerance=1e-8)
    falls, ends, stays = (claim.check(run) for claim in claims)
    (failed,) = ends.failed
    assert failed.text.startswith("V(0) < 2 min(k2, k3)")
    assert failed.limit == pytest.approx(2.4)
    assert failed.value > 2.4
    assert falls.holds
    assert stays.holds


def test_starts_in_the_certified_basin_never_come_near_another_equilibrium():
    law, (_, _, stays) = cases.vectors(rated=False, period=2e-2)
    random = np.random.default_rng(13)
    attitudes = [turned(cases.goal(), v) for v in random.normal(size=(40, 3)) * 0.6]
    starts = BODY.state(rate=random.normal(size=(40, 3)) * 0.3, attitude=np.array(attitudes))
    count = 0
    for run in fly(BODY, law, starts=starts, duration=6.0, tolerance=1e-8):
        verdict = stays.check(run)
        assert verdict.holds
        if verdict.bound < math.sqrt(2 * 2.4 / 1.2):  # V(0) < 2 min(k2, k3)
            count += 1
            # |s - (s2, -s3)| at the nearest other equilibrium is 2.
            assert verdict.measured < 2
    assert 10 < count < 40


@pytest.mark.parametrize("hold", ["first-order hold", "zero-order hold"])
def test_how_much_v_may_rise_between_samples(hold):
    """At 1 ms a sampled V rises by 7e-5 V(0) in 10 ms at most: it need not fall at every sample."""
    law, (falls, *_) = cases.vectors(rated=False, hold=hold)
    random = np.random.default_rng(14)
    starts = BODY.state(
        rate=random.uniform(-1, 1, (4, 3)), attitude=Rotation.random(4, random_state=14).as_matrix()
    )
    shares = []
    for run in fly(BODY, law, starts=starts, duration=2.0):
        verdict = falls.check(run)
        assert verdict.holds
        om, s = (
            cases.named(run, ("rate_x", "rate_y", "rate_z"))[0],
            cases.named(run, law.sensors)[0],
        )
        V0 = BODY.inertia @ om**2 / 2
        V0 += np.repeat((1.0, 0.6), 3) @ (s - np.ravel(law.formula.r)) ** 2
        shares.append(verdict.measured / V0)
    assert 0 < max(shares) < 7e-5


# -- what the design decides -------------------------------------------------------------------

# Design by period, and the longest period that its loop bears, s; known to the digits shown.
SLOWEST = {
    "(2.1)": (cases.position, 32.5e-3),
    "(2.4)": (lambda **x: cases.position(gravity="at the target", **x), 31.2e-3),
    "(4.2)": (cases.flexible, 8.9e-3),
    "(5.4)": (lambda **x: cases.vectors(rated=True, **x), 0.7695),
    "(5.8)": (lambda **x: cases.vectors(rated=False, **x), 0.3747),
    "(5.18)": (spin, 0.3102),
    "(5.20)": (two, 0.6066),
}


@pytest.mark.parametrize("name", SLOWEST)
def test_a_period_beyond_what_the_loop_bears_fails_a_hypothesis(name):
    design, longest = SLOWEST[name]
    for share, kept in ((0.99, True), (1.01, False)):
        _, claims = design(period=share * longest)
        (ends,) = (claim for claim in claims if "in the end" in claim.claim)
        (sampled,) = (a for a in ends.assumptions if "growth rate" in a.text)
        assert sampled.holds == kept


def test_a_path_sampled_too_slowly_fails_a_hypothesis():
    for period, kept in ((1e-3, True), (0.05, False)):
        _, (claim,) = cases.path(period=period)
        assert claim.assumptions[0].holds
        assert claim.assumptions[1].holds == kept


def test_other_equilibria_are_named_with_their_unstable_directions():
    for rated in (True, False):
        _, (_, ends, _) = cases.vectors(rated=rated)
        others = [str(a) for a in ends.assumptions if "unstable" in a.text]
        assert others == [
            "unstable directions at (+r2, -r3), V = 2.4 J: 1 >= 1",
            "unstable directions at (-r2, +r3), V = 4 J: 2 >= 1",
            "unstable directions at (-r2, -r3), V = 6.4 J: 3 >= 1",
        ]
    _, (_, ends, _) = spin()
    # Eigenvalues 0.608 +- 1.560j there.
    assert str(ends.assumptions[-1]) == (
        "unstable directions at s_x = -1, p = 2 rad/s, V = 3.2 J: 2 >= 1"
    )
    _, (_, ends) = cases.position(target=(0.0, 0.0), K1=(4.0, 4.0), gravity="at the target")
    assert any("4 other equilibria that were found, with 0, 0, 1, 1" in a.text
               for a in ends.assumptions)  # fmt: skip


# -- what a flight must have -------------------------------------------------------------------


def test_thinned_rows_are_refused():
    law, claims = cases.position()
    (run,) = fly(ARM, law, starts=np.zeros(4), duration=0.1, every=7)
    with pytest.raises(ValueError, match=r"no row at every sample of its law, 0\.001 s apart"):
        claims[0].check(run)


def test_rows_between_samples_do_not_count():
    law, _ = cases.position(period=0.01)
    (run,) = fly(ARM, law, starts=np.zeros(4), duration=0.1)
    doubled = dataclasses.replace(
        run,
        time=np.sort(np.r_[run.time, run.time[:-1] + 0.0037]),
        signals={k: np.repeat(x, 2)[:-1] for k, x in run.signals.items()},
    )
    one, two_ = (samples(law, x, ("joint_1_rate",)) for x in (run, doubled))
    assert all(np.array_equal(a, b) for a, b in zip(one, two_, strict=True))
    assert one.filtered.shape == (11, 2)
    assert one.filtered[0] == pytest.approx([0.0, 0.0])


def test_of_several_rows_at_a_sample_the_last_counts():
    law, claims = cases.position(period=0.01)
    (run,) = fly(ARM, law, starts=np.zeros(4), duration=0.1)
    # Rows a hair before each sample, as an edge there leaves them: torque of the sample before.
    stale = {k: np.repeat(x, 2)[1:] for k, x in run.signals.items()}
    for name in (*law.thrusters, *(f"{name}_command" for name in law.thrusters)):
        stale[name] = np.repeat(run[name], 2)[:-1]
    time = np.sort(np.r_[run.time, run.time[1:] - 1e-10])
    twice = dataclasses.replace(run, time=time, signals=stale)
    one, two_ = (samples(law, x, ("joint_1_rate",)) for x in (run, twice))
    assert all(np.array_equal(a, b) for a, b in zip(one, two_, strict=True))
    assert claims[0].check(twice).holds == claims[0].check(run).holds


def test_a_flight_too_short_to_judge_is_not_a_number():
    law, (falls, *_) = cases.position()
    (run,) = fly(ARM, law, starts=np.zeros(4), duration=0.005)
    verdict = falls.check(run)
    assert math.isnan(verdict.measured)
    assert not verdict.holds


def test_channels_must_exist():
    motors = Thrusters([Thruster(name="motor_1", levels=(1.0,), delay=0.1)])  # pyright: ignore
    with pytest.raises(ValueError, match="thruster 'motor_2' is not in the spacecraft"):
        burkov.position(ARM, motors, target=cases.TARGET, **cases.GAINS)
