"""The law of Efremov, Polyakov & Strygin (2006) against its closed forms, and its hypotheses."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from controllers.efremov import (
    MultilevelRelay,
    attracting,
    design_local,
    design_nonlocal,
    limit_cycle,
)
from spacecraft_sim.disturbance import Disturbance, Torque
from spacecraft_sim.reduced import ReducedPhysics, double_integrator, galerkin_start
from spacecraft_sim.scenario import Initial
from spacecraft_sim.simulate import Environment, simulate
from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.task import ControlTask
from spacecraft_sim.thrusters import Thrusters

ANGLE, RATE = "quasi_rigid_angle_z", "quasi_rigid_rate_z"
# Section 5 of the paper, in rad, rad/s and rad/s^2.
PAPER = dict(
    max_delay=0.21, accuracy=0.007, radius=0.1, c=0.31, gain=2.765, level=0.007, threshold=0.0045
)
LEVELS = tuple(0.007 * 3.0**k for k in range(5))


def thrusters(*, levels=LEVELS, **changes):
    return Thrusters([Thruster(name="thruster_z", levels=levels, **{"delay": 0.2, **changes})])


def flight(law, engine, *, duration, angle=0.0, rate=0.0, torque=None):
    """A flight on the plant of the theorem, r'' = u + f, which is propagated exactly."""
    plant = ReducedPhysics(double_integrator(), start=galerkin_start(0), timestep=0.02)
    task = ControlTask(
        law,
        engine,
        initial=Initial(attitude=(0, 0, angle), rate=(0, 0, rate)),
        disturbance=Disturbance({"z": torque or Torque()}),
    )
    return simulate(Environment(plant, task, duration=duration, substeps=5), meta={})


def carried(beta, v, pulses, U):
    """The end of both pulses on beta'' = u, by the exact quadratics."""
    sign, T1, T2 = pulses
    for u, span in ((sign * U, T1), (-sign * U, T2 - T1)):
        beta, v = beta + v * span + u * span**2 / 2, v + u * span
    return beta, v


@pytest.mark.parametrize(
    ("J", "two_p", "T1", "T2"),
    [(1183.24, 44.67, 18.213196, 48.258792), (429.4875, 0.0, 13.308086, 30.911046)],
)
def test_attraction_times_of_section_5(J, two_p, T1, T2):
    beta = J * 0.7 + two_p * 0.1
    v = J * -0.01
    found = attracting(beta, v, 1.0)
    assert found.sign == -1.0
    # The figures are rounded to 1e-6 s.
    assert found[1:] == pytest.approx((T1, T2), abs=1e-6)


def test_two_pulses_end_at_the_origin():
    points = np.random.default_rng(1).uniform(-3, 3, size=(1000, 2))
    signs = set()
    for beta, v in points.tolist():
        pulses = attracting(beta, v, 1.0)
        assert 0 <= pulses.T1 <= pulses.T2
        signs.add(pulses.sign)
        # Sums of a dozen terms below 50 carry a rounding of some 1e-14 each.
        assert carried(beta, v, pulses, 1.0) == pytest.approx((0.0, 0.0), abs=1e-12)
    assert signs == {-1.0, 1.0}


finite = st.floats(-3, 3, allow_subnormal=False)


@given(finite, finite, st.floats(0.1, 10))
@example(-0.5, 1.0, 1.0)
@example(0.5, -1.0, 1.0)
def test_pulses_are_antisymmetric_and_scale_with_the_thrust(beta, v, U):
    here, mirrored = attracting(beta, v, U), attracting(-beta, -v, U)
    assert here[1:] == mirrored[1:]
    if (beta, v) != (0.0, 0.0):  # at the origin there is no pulse to have a sign
        assert here.sign == -mirrored.sign
    # A square root of a cancelled sum keeps half the digits: 1e-8 of T, squared in the position.
    end = carried(beta, v, here, U)
    assert end == pytest.approx((0.0, 0.0), abs=1e-12 * (1 + U))


@pytest.mark.parametrize("v", [0.25, 1.0, 3.0])
def test_on_the_boundary_curves_one_pulse_is_enough(v):
    # Gamma+ (v^2 + 2 beta = 0, v >= 0) belongs to G+, Gamma- to G-; all numbers are exact.
    assert attracting(-v * v / 2, v, 1.0) == (-1.0, v, v)
    assert attracting(v * v / 2, -v, 1.0) == (1.0, v, v)
    assert attracting(0.0, 0.0, v)[1:] == (0.0, 0.0)


@pytest.mark.parametrize("U", [0.0, -1.0, math.nan, math.inf])
def test_attraction_needs_a_positive_thrust(U):
    with pytest.raises(ValueError, match="acceleration"):
        attracting(1.0, 0.0, U)


def test_limit_cycle_figures():
    # Computed once with an event-exact simulator; rounded to ten digits.
    assert limit_cycle(c=0.31, delay=0.2, level=0.007) == pytest.approx(
        (0.826439232, 1.446268657e-3, 1.494066448e-4), rel=1e-9
    )


@pytest.mark.parametrize(("c", "delay"), [(0.31, 0.2), (1.0, 0.05), (0.5, 0.9)])
def test_flight_of_the_relay_ends_in_the_limit_cycle(c, delay):
    p = 0.007
    law = MultilevelRelay(
        c=c, thresholds=(), levels=(p,), lowest=p, attraction=0.0, attraction_level=0.0,
        compensated_delay=0.0, period=None,
    )  # fmt: skip
    # The transient falls as e^(-ct): after 40/c it is below rounding.
    end = 40 / c
    track = flight(law, thrusters(levels=(p,), delay=delay), duration=end + 20, angle=1e-4)
    late = track.time > end
    time, u, v = track.time[late], track["thruster_z"][late], track[RATE][late]
    beta = track[ANGLE][late]
    rising = time[1:][np.diff(u) > 0]
    exact = limit_cycle(c=c, delay=delay, level=p)
    # Switchings are located to 1e-12 s; over a shortest half period of 0.1 s that is 1e-11.
    assert np.diff(rising) == pytest.approx(exact.period, rel=1e-9)
    assert np.max(np.abs(v)) == pytest.approx(exact.v_max, rel=1e-9)  # a corner, where a row stands
    # Within a row's piece beta is a parabola; its extremum lies where v = 0.
    peaks = (np.abs(beta) + v**2 / (2 * p))[(beta * u < 0)]
    assert np.max(peaks) == pytest.approx(exact.beta_max, rel=1e-9)


@pytest.mark.parametrize(
    ("key", "value", "message"),
    [("delay", 4.0, "c h = 1.24"), ("c", -1.0, "c = -1.0"), ("level", math.nan, "level = nan")],
)
def test_limit_cycle_refuses_what_has_none(key, value, message):
    with pytest.raises(ValueError, match=message):
        limit_cycle(**{"c": 0.31, "delay": 0.2, "level": 0.007, key: value})


def test_steps_1_to_5_of_theorem_2():
    law, _ = design_nonlocal(max_delay=0.2, accuracy=0.007, radius=0.1, c=0.31, gain=2.76)
    p, epsilon_0 = 15 / 4 * 0.31**2 * 0.007 * 2.76, 3 * 0.31 * 0.007 / 4
    N = math.ceil(math.log(1.31 * 0.1 / epsilon_0) / math.log(3))
    assert N == 4
    # One or two roundings between two orders of the same products.
    assert law.thresholds == pytest.approx(
        [3 ** (n - 1) * 2.76 * epsilon_0 for n in range(1, N + 1)], rel=1e-14
    )
    assert law.levels == pytest.approx([p * 3**k for k in range(N + 1)], rel=1e-14)
    # The identity p 3^(k-1) = 5 c v_k of the theorem.
    assert law.levels[:-1] == pytest.approx([5 * 0.31 * v for v in law.thresholds], rel=1e-14)


@given(st.floats(-1, 1), st.floats(-1, 1))
def test_thrust_is_p_3_to_the_thresholds_passed_against_s(beta, v):
    law, _ = design_nonlocal(**PAPER)
    s = law.c * beta + v
    (u,), memory = law.step(0.0, (beta, v), law.init())
    if s != 0 and abs(s) not in law.thresholds:
        k = sum(threshold < abs(s) for threshold in law.thresholds)
        assert u == -math.copysign(law.levels[k], s)
    assert memory.low <= s <= memory.high
    assert min(law.events(0.0, (beta, v), memory)) >= 0


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("n", [0, 1, 2])
def test_on_a_bound_s_belongs_to_the_cell_that_it_enters(n, side):
    law, _ = design_nonlocal(**PAPER)
    bound = (0.0, *law.thresholds)[n]
    inner, outer = bound - 1e-3, bound + 1e-3  # the narrowest cell is 4.5e-3 wide
    for start, goal in ((inner, outer), (outer, inner)):
        _, memory = law.step(0.0, (0.0, side * start), law.init())
        u_on_bound, on_bound = law.step(1.0, (0.0, side * bound), memory)
        u_beyond, beyond = law.step(1.0, (0.0, side * goal), memory)
        assert u_on_bound == u_beyond
        assert on_bound == beyond


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("n", [1, 2, 3, 4])
def test_a_first_measurement_on_a_threshold_counts_as_over_it(n, side):
    # A = p 3^k with k the number of thresholds v_n <= |s|, on either side.
    law, _ = design_nonlocal(**PAPER)
    (u,), _ = law.step(0.0, (0.0, side * law.thresholds[n - 1]), law.init())
    assert u == -side * law.levels[n]


def test_a_mirrored_start_flies_the_mirrored_flight():
    law, _ = design_nonlocal(**PAPER, attraction_level=0.001)
    engine = thrusters(levels=(0.001, *LEVELS))
    one, other = (
        flight(law, engine, duration=60.0, angle=side * 0.3, rate=side * -0.01) for side in (1, -1)
    )
    # The equations are odd and rounding is symmetric: bit for bit.
    assert one.time.tolist() == other.time.tolist()
    for name in (ANGLE, RATE, "thruster_z", "thruster_z_command"):
        assert np.array_equal(one[name], -other[name]), name


def test_attracting_pulses_come_before_the_feedback():
    law, _ = design_nonlocal(**PAPER, attraction_level=0.001)
    y = (0.7, -0.01)
    sign, T1, T2 = attracting(*y, 0.001)
    u, memory = law.step(2.0, y, law.init())
    assert u == (sign * 0.001,)
    assert law.events(2.0, y, memory) == (T1,)
    u, memory = law.step(2.0 + T1, y, memory)
    assert u == (-sign * 0.001,)
    assert law.events(2.0 + T1, y, memory)[0] == pytest.approx(T2 - T1, rel=1e-12)  # a clock's ulp
    u, _ = law.step(2.0 + T2, y, memory)
    assert u[0] == -LEVELS[4]  # s = .207, over v_4 = .1215


@pytest.mark.parametrize(
    ("changes", "name", "value", "limit"),
    [
        ({"max_delay": 0.25}, "c h0", 0.31 * 0.25, math.log(15 / 14)),
        ({"c": 2.0}, "c h0", 0.42, math.log(15 / 14)),
        ({"gain": 3.0}, "gamma", 3.0, 3.0),
        ({"gain": 1.2}, "gamma", 1.2, math.exp(0.0651) / (10 - 9 * math.exp(0.0651))),
        ({"level": 0.001}, "p/", 0.001 / (3.75 * 0.31**2 * 0.007), None),
        ({"threshold": 0.1}, "v1/", 0.1 / (0.75 * 0.31 * 0.007), 3.0),
        ({"radius": 0.007}, "eps < R", 0.007, 0.007),
        ({"radius": 0.001}, "eps < R", 0.007, 0.001),
    ],
)
def test_outside_the_hypotheses_name_value_and_limit_are_given(changes, name, value, limit):
    with pytest.raises(ValueError, match="hypotheses") as caught:
        design_nonlocal(**{**PAPER, **changes})
    message = str(caught.value)
    assert name in message
    assert f"{value:.6g}" in message
    assert limit is None or f"{limit:.6g}" in message


@pytest.mark.parametrize("key", PAPER)
@pytest.mark.parametrize("value", [-1.0, 0.0, math.nan, math.inf])
def test_parameters_must_be_finite_and_positive(key, value):
    with pytest.raises(ValueError, match=rf"{key} = .*{value!r}"):
        design_nonlocal(**{**PAPER, key: value})


@pytest.mark.parametrize(
    ("key", "value"),
    [("attraction_level", -1.0), ("attraction_level", math.nan), ("period", -0.01), ("period", 0)],
)
def test_optional_parameters_are_checked_too(key, value):
    with pytest.raises(ValueError, match=key):
        design_nonlocal(**{**PAPER, key: value})


def test_a_missing_level_is_refused_with_the_list_to_paste():
    with pytest.raises(ValueError, match=r"thrusters\.thruster_z\.levels = \[") as caught:
        design_nonlocal(None, thrusters(levels=(0.007, 0.063)), **PAPER)
    message = str(caught.value)
    assert "lacks 0.021, 0.189, 0.567" in message
    pasted = message.rpartition("levels = [")[2].partition("]")[0]
    levels = tuple(float(x) for x in pasted.split(","))
    design_nonlocal(None, thrusters(levels=levels), **PAPER)


def test_a_sampled_law_adds_its_period_to_the_delay():
    for period, holds in ((None, True), (0.005, True), (0.02, False)):
        _, guarantees = design_nonlocal(None, thrusters(), **PAPER, period=period)
        (age,) = [a for a in guarantees[0].assumptions if "delay" in a.text]
        assert age.value == pytest.approx(0.2 + (period or 0.0), abs=1e-15)  # one rounding
        assert age.limit == 0.21
        assert age.holds is holds


def judged(guarantees, track):
    """Verdicts of what a theorem promises: everything but attraction, attitude, closed forms."""
    return [g.check(track) for g in guarantees if "Theorem" in g.source]


def assert_outcome(verdicts, failed):
    """All hold, or none does and each names the hypothesis that failed."""
    for verdict in verdicts:
        assert verdict.holds is (failed is None), verdict.claim
        assert failed is None or any(failed in a.text for a in verdict.failed), verdict.claim


@pytest.mark.parametrize("lag", ["rise_time", "fall_time", "min_on_time"])
def test_a_thruster_that_is_not_a_relay_is_outside_the_theorem(lag):
    engine = thrusters(**{lag: 0.5})
    law, guarantees = design_nonlocal(None, engine, **PAPER)
    verdicts = judged(guarantees, flight(law, engine, duration=20.0, angle=0.05))
    assert_outcome(verdicts, "follows the valve")
    assert len(verdicts) == 4


@pytest.mark.parametrize(
    ("delay", "changes", "failed"),
    [
        (0.2, {}, None),
        (0.22, {}, "delay"),
        # |f| < v1 c/2 = 6.975e-4 rad/s^2
        (0.2, {"torque": Torque(constant=6.9e-4)}, None),
        (0.2, {"torque": Torque(constant=7.1e-4)}, "f/J"),
        (0.2, {"torque": Torque(amplitude=7.1e-4, frequency=1.0)}, "f/J"),
        (0.2, {"angle": 0.09, "rate": 0.09}, None),
        (0.2, {"angle": 0.11}, "beta| < R"),
        (0.2, {"angle": 0.0, "rate": -0.11}, "v| < R"),
    ],
)
def test_theorem_2_holds_within_its_assumptions_and_never_outside(delay, changes, failed):
    engine = thrusters(delay=delay)
    law, guarantees = design_nonlocal(None, engine, **PAPER)
    track = flight(law, engine, **{"angle": 0.05, "duration": 100.0, **changes})
    assert_outcome(verdicts := judged(guarantees, track), failed)
    assert len(verdicts) == 4


# Theorem 1: p = (3/2) c^2 eps, |beta0| < eps/4, |s0| < delta0 = c eps (6 - 5 E)/(4 E).
LOCAL = {"max_delay": 0.21, "accuracy": 0.007, "c": 0.31}
E = math.exp(0.31 * 0.21)
DELTA = 0.31 * 0.007 * (6 - 5 * E) / (4 * E)
LEVEL = 1.5 * 0.31**2 * 0.007


@pytest.mark.parametrize(
    ("delay", "changes", "failed"),
    [
        (0.2, {}, None),
        (0.22, {}, "delay"),
        # |f| < c^2 eps/4
        (0.2, {"torque": Torque(constant=0.249 * 0.31**2 * 0.007)}, None),
        (0.2, {"torque": Torque(constant=0.251 * 0.31**2 * 0.007)}, "f/J"),
        (0.2, {"angle": -0.24 * 0.007, "rate": 0.31 * 0.24 * 0.007}, None),
        (0.2, {"angle": -0.26 * 0.007, "rate": 0.31 * 0.26 * 0.007}, "beta| < eps/4"),
        (0.2, {"rate": 0.99 * DELTA}, None),
        (0.2, {"rate": 1.01 * DELTA}, "s| < delta_0"),
    ],
)
def test_theorem_1_holds_within_its_assumptions_and_never_outside(delay, changes, failed):
    engine = thrusters(levels=(LEVEL,), delay=delay)
    law, guarantees = design_local(None, engine, **LOCAL)
    assert law.levels == pytest.approx((LEVEL,), rel=1e-14)  # two orders of one product
    track = flight(law, engine, **{"duration": 100.0, **changes})
    assert_outcome(verdicts := judged(guarantees, track), failed)
    assert len(verdicts) == 3


def test_theorem_1_refuses_a_delay_that_is_too_long():
    with pytest.raises(ValueError, match=r"Theorem 1: c h0 < ln\(6/5\): not 0.186 < 0.182322"):
        design_local(**{**LOCAL, "max_delay": 0.6})


def test_from_inside_the_accuracy_every_claim_holds():
    law, guarantees = design_nonlocal(None, thrusters(), **PAPER)
    torque = Torque(amplitude=8.5e-7, frequency=1.0)  # 0.001 N m over J = 1183.24 kg m^2
    track = flight(law, thrusters(), duration=120.0, angle=-0.002, torque=torque)
    assert [v.claim for g in guarantees if not (v := g.check(track)).holds] == []


def test_a_flight_that_is_too_short_proves_nothing():
    law, guarantees = design_nonlocal(None, thrusters(), **PAPER)
    verdicts = judged(guarantees, flight(law, thrusters(), duration=0.15, angle=0.001))
    assert [v.claim for v in verdicts if v.holds] == []


@pytest.mark.parametrize("compensated", [0.0, 0.2])
def test_the_delay_leaves_a_miss_unless_it_is_planned_for(compensated):
    engine = thrusters(levels=(0.001, *LEVELS))
    planned = {**PAPER, "attraction_level": 0.001, "compensated_delay": compensated}
    law, _ = design_nonlocal(None, engine, **planned)
    track = flight(law, engine, duration=80.0, angle=0.3, rate=-0.01)
    end = attracting(0.3 - 0.01 * compensated, -0.01, 0.001).T2 + 0.2
    miss = [np.interp(end, track.time, track[name]) for name in (ANGLE, RATE)]
    # h v0, then 0; two roots to 1e-11 s at 0.02 rad/s.
    assert miss == pytest.approx([(0.2 - compensated) * -0.01, 0.0], abs=1e-12)


def test_the_counterexample_to_the_printed_bound_on_v():
    # c = 2, h0 = .031, gamma = 2.76, eps = 1: |v| reaches 1.3244 eps for ever, with f = 0.
    wanted = {"max_delay": 0.031, "accuracy": 1.0, "radius": 1.5, "c": 2.0, "gain": 2.76}
    law, _ = design_nonlocal(**wanted)
    engine = thrusters(levels=law.levels, delay=0.999 * 0.031)
    _, guarantees = design_nonlocal(None, engine, **wanted)
    track = flight(law, engine, duration=80.0, angle=1.4)
    # Printed to five digits; the transient e^(-ct) is gone.
    assert np.max(np.abs(track[RATE][track.time > 60.0])) == pytest.approx(1.32444, abs=5e-6)
    verdicts = {v.claim: v for v in judged(guarantees, track)}
    assert verdicts["|v/J| in the end"].holds  # 2 S of the repaired proof
    printed = verdicts["|v/J| < eps in the end, as printed"]
    assert not printed.holds
    assert printed.measured > printed.bound
