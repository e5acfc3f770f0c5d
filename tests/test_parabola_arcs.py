"""Exact arcs of a relay with a minimum on-time: closed forms, a second numerics, disturbances."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from controllers.contour import contour
from controllers.contour_rules import example_1, example_2, undisturbed_a, undisturbed_b
from controllers.ivanova_sokolov_search import FEEDBACKS, INNER, LEFTMOST, OUTER, RIGHTMOST
from spacecraft_sim.parabola_arcs import (
    Push,
    Signs,
    alternating,
    feedback,
    flipped,
    program,
    propagate,
)
from spacecraft_sim.sampled_arcs import propagate_sampled
from spacecraft_sim.switching_curves import Region, Relay, curve, position

QUIET = feedback(0.0, OUTER)
# Switching lines are moved by up to 3e-11 p, which the times between them show magnified.
MOVED = 1e-9


# -- closed forms --------------------------------------------------------------------------------


@pytest.mark.parametrize("F", [0.25, 0.5, 0.9])
def test_without_disturbance_the_contour_a_is_a_cycle_of_period_1_over_f(F):
    f = propagate(undisturbed_a(F), start=(-0.4, 0.3), bias=F, disturbance=QUIET, switchings=60)
    a = (1 - F) / (16 * F)
    assert np.abs(f.peaks[-6:]) == pytest.approx(a, rel=MOVED)
    starts = f.times[f.switch_arcs]
    assert starts[-1] - starts[-3] == pytest.approx(1 / F, rel=MOVED)
    assert f.pulses()[-5:] == pytest.approx(1.0, rel=MOVED)


@pytest.mark.parametrize("F", [0.0, 0.1, 0.6])
def test_without_disturbance_the_contour_b_is_a_cycle_without_a_pause(F):
    f = propagate(undisturbed_b(F), start=(-0.4, 0.3), bias=F, disturbance=QUIET, switchings=60)
    assert np.abs(f.peaks[-6:]) == pytest.approx((1 + F) / (8 * (1 - F)), rel=MOVED)
    starts = f.times[f.switch_arcs]
    assert starts[-1] - starts[-3] == pytest.approx(2 / (1 - F), rel=MOVED)
    assert set(f.levels[f.switch_arcs][-8:]) == {-1, 1}


@pytest.mark.parametrize("F", [0.05, 0.2, 0.5, 0.8])
@pytest.mark.parametrize("rule", [undisturbed_a, undisturbed_b])
def test_without_disturbance_three_peaks_settle_it(F, rule):
    rng = np.random.default_rng(1)
    half = (1 - F) / (16 * F) if rule is undisturbed_a else (1 + F) / (8 * (1 - F))
    for _ in range(15):
        start = tuple(rng.uniform(-20, 20, size=2) * half)
        n, tau = int(rng.integers(-1, 2)), rng.uniform(0, 1)
        f = propagate(
            rule(F), start=start, level=n, elapsed=tau, bias=F, disturbance=QUIET, switchings=40
        )
        assert np.abs(f.peaks[4:]) == pytest.approx(half, rel=MOVED)


def test_peaks_of_a_turn_of_example_1():
    c = contour(0.8, 0.1)
    f = propagate(
        example_1(c),
        start=(-1.5 * c.p, 0),
        bias=0.8,
        disturbance=feedback(0.1, OUTER),
        switchings=6,
    )
    # Six digits are given.
    assert f.peaks[:4] / c.p == pytest.approx([1.75, -1.053571, 1.080357, -1.005740], abs=5e-7)


@pytest.mark.parametrize(
    ("signs", "left", "right", "period"),
    [
        (OUTER, -1, 1, 1.880089),
        (INNER, -0.927277, 0.655511, 1.672534),
        (LEFTMOST, -1, 0.626087, 1.608760),
        (RIGHTMOST, -0.893023, 1, 1.826827),
    ],
)
def test_steady_peaks_and_periods_under_the_four_feedbacks(signs, left, right, period):
    c = contour(2 / 3, 0.05)
    f = propagate(
        example_1(c), start=(-6 * c.p, 0), bias=2 / 3, disturbance=feedback(0.05, signs),
        switchings=80,
    )  # fmt: skip
    peaks = f.peaks[-2:] / c.p
    starts = f.times[f.switch_arcs]
    # Seven digits are given.
    assert (peaks.min(), peaks.max()) == pytest.approx((left, right), abs=6e-7)
    assert starts[-1] - starts[-3] == pytest.approx(period, abs=6e-7)
    assert f.pulses().min() >= 1 - 1e-14  # sums of the clock


# -- a second numerics ---------------------------------------------------------------------------


@pytest.mark.parametrize("signs", [OUTER, RIGHTMOST])
@pytest.mark.parametrize("rule", [example_1, example_2])
def test_a_flight_solves_the_equation_and_switches_where_the_rule_says(rule, signs):
    F, e = 0.8, 0.12
    c, push = contour(F, e), feedback(e, signs)
    relay = rule(c)
    f = propagate(relay, start=(-3 * c.p, 0.1), bias=F, disturbance=push, switchings=12)
    z, level, locked = np.array([f.x[0], f.v[0]]), 0, -math.inf
    for k in range(len(f.accelerations)):
        t, end = float(f.times[k]), float(f.times[k + 1])
        if k in f.switch_arcs:
            level = int(f.levels[k])
            locked = t + 1 if level else -math.inf
        side = 1.0 if z[1] > 0 or (z[1] == 0 and level + F > 0) else -1.0

        def slope(_, z, level=level, side=side):
            return [z[1], level + F + push(0.0, side, level, True, 0).eps]

        s = solve_ivp(slope, (t, end), z, "DOP853", rtol=1e-12, atol=1e-14, max_step=0.02)
        for ti, x, v in zip(s.t[:-1], *s.y[:, :-1], strict=True):
            if locked <= ti < end - 1e-9:
                assert relay.command(level, x, v) == level
        z = s.y[:, -1]
        assert z == pytest.approx([f.x[k + 1], f.v[k + 1]], abs=1e-11)  # the integrator's tolerance
        if f.v[k + 1] == 0:
            z[1] = 0.0
        if k + 1 in f.switch_arcs and end > locked:
            # The first instant at which the rule says so.
            assert min(np.abs(relay.distances(level, *z))) < 1e-10


@given(st.floats(-5, 5), st.floats(-2, 2), st.integers(0, 15), st.sampled_from([-1, 0, 1]))
def test_no_pulse_is_short_wherever_it_starts(x, v, k, level):
    c = contour(0.75, 0.1)
    for relay in (example_1(c), example_2(c, finite_time=True), example_1(c, guarded=False)):
        f = propagate(
            relay, start=(x, v), level=level, elapsed=0.3, bias=0.75,
            disturbance=feedback(0.15, FEEDBACKS[k]), switchings=30,
        )  # fmt: skip
        assert np.all(f.pulses() >= 1 - 1e-12)  # sums of the clock, some 100
        if level:
            assert f.times[f.switch_arcs[0]] >= 0.7 - 1e-15


def test_states_between_the_arcs():
    f = propagate(undisturbed_a(0.5), start=(-0.4, 0.3), bias=0.5, disturbance=QUIET, switchings=8)
    times = np.linspace(0, f.times[-1], 500)
    x, v = f.at(times)
    assert f.at([0.0]) == (pytest.approx(-0.4), pytest.approx(0.3))
    # Trapezoidal rule: exact for v, linear on each arc, but for the steps with a corner.
    assert np.diff(x) == pytest.approx((v[1:] + v[:-1]) / 2 * np.diff(times), abs=1e-3)
    assert f.largest() == pytest.approx(np.abs(f.peaks).max())


# -- disturbances ----------------------------------------------------------------------------------


def test_a_feedback_follows_thrust_and_rate():
    push = feedback(0.1, Signs(1, -1, -1, 1))
    assert [push(0, v, n, n == 0, 0).eps for n in (0, -1) for v in (1.0, -1.0)] == [
        0.1, -0.1, -0.1, 0.1,
    ]  # fmt: skip
    # At v = 0 it is the side to which v goes.
    assert push(0, 0.0, 0, True, 0).eps == 0.1
    assert push(0, 0.0, -1, False, 0).eps == 0.1


@pytest.mark.parametrize("level", [0, -1])
@pytest.mark.parametrize("up", [True, False])
def test_a_flip_turns_the_sign_beyond_its_rate(level, up):
    push, side = flipped(0.1, Signs(1, 1, 1, 1), Signs(0.2, 0.3, 0.4, 0.5)), 1 if up else -1
    edge = {(0, True): 0.2, (0, False): 0.3, (-1, True): 0.4, (-1, False): 0.5}[level, up]
    rising = level == 0
    assert push(0, side * edge * 0.9, level, rising, 0) == Push(0.1, math.inf, side * edge)
    assert push(0, side * edge * 1.1, level, rising, 0).eps == -0.1
    # At the edge it is the sign of the side that comes.
    growing = rising == up
    assert push(0, side * edge, level, rising, 0).eps == (-0.1 if growing else 0.1)


def test_a_flip_ends_an_arc_at_its_rate():
    c = contour(0.8, 0.1)
    f = propagate(
        example_1(c), start=(-c.p, 0), bias=0.8, switchings=4,
        disturbance=flipped(0.1, OUTER, Signs(0.1, 0.05, 0.08, 0.07)),
    )  # fmt: skip
    assert {0.1, -0.05, 0.08, -0.07} <= set(f.v.tolist())
    fall = f.accelerations[np.flatnonzero(f.v == 0.08)[0]]
    assert fall == pytest.approx(-1 + 0.8 + 0.1)  # below its edge on_up is +1


def test_a_programme_steps_at_its_times():
    f = propagate(
        undisturbed_a(0.5), start=(0.0, 0.0), bias=0.5, duration=0.4,
        disturbance=program([0.1, 0.3], [0.1, -0.2, 0.0]),
    )  # fmt: skip
    at = np.searchsorted(f.times, [0.05, 0.2, 0.35], side="right") - 1
    assert f.accelerations[at] == pytest.approx([0.6, 0.3, 0.5])
    assert {0.1, 0.3, 0.4} <= set(f.times.tolist())


def test_disturbances_take_turns_by_switchings():
    push = alternating([feedback(0.1, OUTER), feedback(0.2, OUTER)], switchings=3)
    assert [push(0, 1.0, 0, True, k).eps for k in range(8)] == [0.1] * 3 + [0.2] * 3 + [0.1] * 2


# -- curves and regions ----------------------------------------------------------------------------


def test_a_curve_covers_all_rates():
    line = curve((-math.inf, 1, 0, 1), (0, 1, 2, 0.25), (2, 1, 0, 0))
    assert [position(line, v) for v in (-2, 0, 1, 2, 50)] == [5, 1, 1.25, 1, 1]
    with pytest.raises(ValueError, match="ascend from v = -inf"):
        curve((0, 1, 0, 1))
    with pytest.raises(ValueError, match="no position at v = nan"):
        position(line, math.nan)


def flat(x):
    return curve((-math.inf, x, 0, 0))


def test_regions_override_the_curves():
    box = Region(-1, 1, flat(1.5), flat(2.5), None)
    relay = Relay(left=flat(-1), right=flat(1), left_level=0, regions=(box,))
    assert [relay.command(0, x, 0) for x in (0, 1.2, 2, 3)] == [0, -1, 0, -1]
    assert relay.command(0, 2, 1.5) == -1  # beside it
    box = box._replace(level=0)
    relay = Relay(left=flat(-1), right=flat(1), left_level=0, regions=(box,))
    assert [relay.command(-1, x, 0) for x in (0, 2, 3)] == [-1, 0, -1]
    box = Region(-1, 1, flat(-2.5), flat(-1.5), -1)
    relay = Relay(left=flat(-1), right=flat(1), left_level=0, regions=(box,))
    assert [relay.command(-1, x, 0) for x in (-1.2, -2, -3)] == [0, -1, 0]
    assert [relay.command(0, x, 0) for x in (-1.2, -2, -3)] == [0, -1, 0]


@given(
    st.floats(-3, 3), st.floats(-3, 3), st.sampled_from([-1, 0, 1]), st.booleans(),
    st.sampled_from([0, 1]),
)  # fmt: skip
def test_distances_are_positive_while_the_command_stands(x, v, level, guarded, left_level):
    box = Region(-0.5, 1, flat(0.2), flat(2.5), None)
    relay = Relay(
        left=curve((-math.inf, -1, 0, 0.5), (0, -1, 0, -0.5)),
        right=curve((-math.inf, 1, 0, 0.3)),
        left_level=left_level,
        guarded=guarded,
        regions=(box,),
    )
    stands = min(relay.distances(level, x, v)) > 0
    assert (relay.command(level, x, v) == level) is stands


def test_where_both_curves_meet_the_sign_of_v_decides():
    relay = Relay(left=flat(0), right=flat(0), left_level=1)
    assert relay.command(0, 0.0, 1.0) == -1
    assert relay.command(0, 0.0, -1.0) == 1


# -- bad input -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"switchings": 10**9, "duration": math.inf}, None),
        ({"start": (math.nan, 0.0)}, "start and bias must be finite"),
        ({"min_on_time": 0.0}, "min_on_time = 0.0"),
        ({"disturbance": feedback(0.6, OUTER)}, "turns the sign of v' over"),
    ],
)
def test_bad_flights_are_refused(changes, message):
    arguments = {
        "start": (0.1, 0.0), "bias": 0.5, "disturbance": QUIET, "duration": 5.0, **changes,
    }  # fmt: skip
    if message is None:
        arguments.pop("switchings")
        message = "give duration or switchings"
    with pytest.raises(ValueError, match=message):
        propagate(undisturbed_a(0.5), **arguments)


def test_other_bad_input_is_refused():
    with pytest.raises(ValueError, match="2 steps have 3 values, got 2"):
        program([1.0, 2.0], [0.1, 0.2])
    endless = Relay(left=flat(-math.inf), right=flat(math.inf), left_level=0)
    with pytest.raises(ValueError, match="nothing happens after t = 0"):
        propagate(endless, start=(0, 0.1), bias=0.5, disturbance=QUIET, switchings=1)
    f = propagate(undisturbed_a(0.5), start=(0, 0.1), bias=0.5, disturbance=QUIET, duration=1)
    with pytest.raises(ValueError, match="no peak after t = 2"):
        f.largest(after=2.0)
    with pytest.raises(ValueError, match="period = 0"):
        propagate_sampled(
            None, start=(0, 0), bias=0.5, disturbance=QUIET, period=0, duration=1
        )  # fmt: skip
