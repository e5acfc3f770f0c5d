"""The anticipating sampled law: its contour against runs, delays, and what it never does."""

import dataclasses
import functools
import itertools
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.contour import contour, guaranteed_accuracy
from controllers.contour_rules import example_1, example_2
from controllers.dimensionless import UNIT, Scale
from controllers.ivanova_sokolov_sampled import (
    AnticipatingRelay,
    command_samples,
    early_state,
    early_states,
    sampled_accuracy,
    sampled_contour,
    time_to_left,
)
from controllers.ivanova_sokolov_search import FEEDBACKS, LEFTMOST, RIGHTMOST
from spacecraft_sim.controller import Controller
from spacecraft_sim.parabola_arcs import Signs, alternating, feedback
from spacecraft_sim.sampled_arcs import propagate_sampled

# Greatest |x| in the end over p0 as measured elsewhere, on a grid of phases, and predicted.
TABLE = {
    (2 / 3, 0.05, 0.005): (1.0410, 1.0413),
    (2 / 3, 0.05, 0.02): (1.1705, 1.1706),
    (2 / 3, 0.05, 0.05): (1.4394, 1.4448),
    (2 / 3, 0.05, 0.1): (1.9295, 1.9304),
    (0.8, 0.12, 0.005): (1.0570, 1.0571),
    (0.8, 0.12, 0.02): (1.2368, 1.2378),
    (0.8, 0.12, 0.05): (1.6416, 1.6419),
    (0.8, 0.12, 0.1): (2.4390, 2.4422),
}
UNEVEN = {(2 / 3, 0.05, 0.03): 1.304, (0.8, 0.12, 0.03): 1.411}  # 0.03 does not divide 1
ROWS = [*TABLE, *UNEVEN, (0.9, 0.05, 0.02), (0.5, 0.0, 0.05)]
# On-delay, off-delay, and what prediction with eps = 0 was measured to leave, over p0.
DELAYS = {
    (2 / 3, 0.05): {
        (0.02, 0.02): 1.090, (0.05, 0.05): 1.113, (0.1, 0.1): 1.161, (0.02, 0.0): 1.088,
        (0.0, 0.02): 1.072,
    },
    (0.8, 0.12): {(0.02, 0.02): 1.209, (0.05, 0.05): 1.385, (0.1, 0.1): 1.639},
}  # fmt: skip


def law_of(F, e, period, *, on=0.0, off=0.0, rule=example_1, half_width=None, scale=UNIT):
    c = sampled_contour(F, e, period, on_delay=on, off_delay=off)
    if half_width is not None:
        c = contour(F, e, half_width=half_width, on_time=c.on_time)
    samples = command_samples(period, on_delay=on, off_delay=off)
    return c, AnticipatingRelay(
        relay=rule(c), scale=scale, level=1.0, F=F, eps=e, command_time=samples * period,
        period=period, on_delay=on, off_delay=off,
    )  # fmt: skip


@functools.cache
def flights(F, e, period, on=0.0, off=0.0, rule=example_1, duration=60.0):
    """Runs of the 16 feedbacks and of pairs of them, two phases of the start each."""
    c, law = law_of(F, e, period, on=on, off=off, rule=rule)
    rng = np.random.default_rng(1)
    pushes = [feedback(e, s) for s in FEEDBACKS]
    pushes += [
        alternating([pushes[i], pushes[j]], switchings=k)
        for i, j, k in rng.integers((0, 0, 1), (16, 16, 6), size=(8, 3)).tolist()
    ]
    return c, [
        propagate_sampled(
            law, start=(-rng.uniform(0.2, 0.9) * c.p, 0.0), bias=F, disturbance=push,
            period=period, duration=duration, on_delay=on, off_delay=off,
        )
        for push, _ in itertools.product(pushes, range(2))
    ]  # fmt: skip


def keeps_the_contour(F, e, period, **more):
    c, found = flights(F, e, period, **more)
    # Until then what the first look-ahead came too late for has died out.
    largest = max(f.largest(after=f.times[-1] / 3) for f in found)
    shortest = min(f.pulses().min() for f in found)
    assert largest <= c.p * (1 + 1e-10)  # the switching lines are moved by 3e-11 p
    # The contour is not wider than it must be for the phases that were hit.
    assert largest > 0.99 * c.p
    assert shortest >= 1 - 1e-11  # sums of the clock, some 60 s long
    return c, found


# -- the widened contour -----------------------------------------------------------------------


@pytest.mark.parametrize("row", TABLE)
def test_the_prediction_is_near_what_was_predicted_elsewhere(row):
    F, e, period = row
    ratio = sampled_accuracy(F, e, period) / guaranteed_accuracy(F, e)
    # Where the lower end decides, the line of early states had been looked at on a grid that does
    # not hit its end: that falls short by up to 0.002, and is exceeded, see below.
    assert ratio == pytest.approx(TABLE[row][1], abs=5e-5 if F == 0.8 else 2.2e-3)
    assert ratio >= TABLE[row][1] - 5e-5
    assert ratio >= TABLE[row][0]


@pytest.mark.parametrize(("F", "e", "period"), ROWS)
@pytest.mark.parametrize(("on", "off"), [(0, 0), (0.05, 0.02), (0.2, 0.3)])
def test_the_ends_of_the_early_states_decide(F, e, period, on, off):
    c = sampled_contour(F, e, period, on_delay=on, off_delay=off)
    lower, upper = early_states(c, period, on_delay=on, off_delay=off)
    assert early_state(c, c.A1.v, period, on) == upper
    # Every state of the line in between wants -1 for longer; rates on it differ as what they see.
    seen = np.linspace(c.A1.v - (upper.v - lower.v), c.A1.v, 101).tolist()
    times = [time_to_left(c, early_state(c, v, period, on)) for v in seen]
    least = min(time_to_left(c, lower), time_to_left(c, upper))
    assert min(times) >= least - 1e-12  # rounding
    assert least >= c.on_time - 1e-12


def test_a_short_period_asks_for_little():
    p0 = guaranteed_accuracy(0.8, 0.12)
    excess = [sampled_accuracy(0.8, 0.12, Ts) / p0 - 1 for Ts in (1e-3, 1e-4)]
    assert excess[0] == pytest.approx(10 * excess[1], rel=2e-2)  # linear in Ts
    assert excess[1] == pytest.approx(11e-4, rel=0.1)


def test_a_pulse_is_commanded_for_whole_samples():
    assert command_samples(0.1) == 10  # not 11, although 10 * 0.1 < 1 might be
    assert command_samples(0.03) == 34
    assert command_samples(0.1, on_delay=0.25) == 13
    assert command_samples(0.1, off_delay=0.25) == 8
    assert command_samples(0.1, off_delay=2.0) == 1
    assert sampled_contour(0.8, 0.1, 0.1, off_delay=2.0).on_time == pytest.approx(2.1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((0.8, 0.1, 1.5), "1.5 minimum on-times: longer than the on-time"),
        ((0.8, 0.1, 0.0), "period = 0.0"),
        ((0.8, 0.3, 0.1), r"F \+ eps"),
        ((0.3, 0.3, 0.1), "infinite"),
    ],
)
def test_bad_input_is_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        sampled_accuracy(*arguments)
    with pytest.raises(ValueError, match="on_delay = -1"):
        sampled_accuracy(0.8, 0.1, 0.1, on_delay=-1)


# -- runs ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(("F", "e", "period"), [(2 / 3, 0.05, 0.1), (0.8, 0.12, 0.05)])
def test_runs_stay_within_the_contour(F, e, period):
    c, _ = keeps_the_contour(F, e, period)
    assert c.p > guaranteed_accuracy(F, e)


@pytest.mark.slow
@pytest.mark.parametrize(("F", "e", "period"), ROWS)
@pytest.mark.parametrize("rule", [example_1, example_2])
def test_runs_of_the_table_stay_within_the_contour(F, e, period, rule):
    _, found = keeps_the_contour(F, e, period, rule=rule)
    if (F, e, period) in TABLE:
        largest = max(f.largest(after=20.0) for f in found) / guaranteed_accuracy(F, e)
        # As far as elsewhere, where 32 runs were made.
        assert largest > TABLE[F, e, period][0] - 2e-3


@pytest.mark.slow
@pytest.mark.parametrize(
    ("F", "e", "on", "off"), [(*point, *delay) for point in DELAYS for delay in DELAYS[point]]
)
def test_runs_with_delays_stay_within_the_contour(F, e, on, off):
    c, _ = keeps_the_contour(F, e, 0.005, on=on, off=off)
    # To look ahead with eps = +-e is better at worst than to look ahead with eps = 0.
    assert c.p / guaranteed_accuracy(F, e) < DELAYS[F, e][on, off]


@pytest.mark.parametrize(
    ("F", "e", "period", "on", "off"),
    [
        (0.7, 0.2, 0.3, 0.0, 1.0),
        (0.92, 0.03, 0.05, 0.3, 0.3),
        (0.35, 0.05, 0.1, 1.0, 0.05),
    ],
)
def test_runs_with_long_delays_stay_within_the_contour(F, e, period, on, off):
    keeps_the_contour(F, e, period, on=on, off=off, duration=100.0)


@pytest.mark.slow
def test_runs_with_a_delay_longer_than_a_coast_stay_within_the_contour():
    c, _ = keeps_the_contour(0.9, 0.07, 0.05, on=0.6, duration=400.0)
    assert c.p > 30 * guaranteed_accuracy(0.9, 0.07)  # wide enough for a decision in a coast


def test_the_lower_end_decides_at_small_disturbances():
    F, e, period = 2 / 3, 0.05, 0.005
    signs = (RIGHTMOST, Signs(-1, 1, -1, -1), LEFTMOST)
    push = alternating([feedback(e, s) for s in signs], switchings=2)

    def largest(half_width, start):
        c, law = law_of(F, e, period, half_width=half_width)
        f = propagate_sampled(
            law, start=(start * c.p, 0.0), bias=F, disturbance=push, period=period, duration=200.0
        )
        return f.largest(after=30.0) / c.p

    half = TABLE[F, e, period][1] * guaranteed_accuracy(F, e)  # predicted without the lower end
    assert half < sampled_accuracy(F, e, period)
    assert largest(half, -0.2) > 1.001
    for start in (-0.2, -0.5, -0.92):
        assert largest(None, start) <= 1 + 1e-10


@pytest.mark.parametrize(("on", "off"), [(0, 0), (0.12, 0.05), (0.0, 0.3)])
def test_thrust_never_changes_late(on, off):
    F, e, period = 0.75, 0.12, 0.05
    c, found = flights(F, e, period, on=on, off=off)
    relay = example_1(c)
    early = {-1: 0.0, 0: 0.0}
    for f in found:
        for k in f.switch_arcs.tolist():
            x, v, level = float(f.x[k]), float(f.v[k]), int(f.levels[k])
            if f.times[k] < 10:
                continue  # begun anywhere
            left = relay.to_right_level(0, x, v) if level else relay.to_left_level(-1, x, v)
            assert left > -1e-10 * c.p  # the lines are moved by 3e-11 p
            early[level] = max(early[level], left)
    # It does change early, by about |v| Ts; else nothing was looked ahead to.
    assert min(early.values()) > 0.1 * period * c.A1.v


# -- the object ------------------------------------------------------------------------------------


@functools.cache
def mirrored(on, off):
    """A law of 0.7, 0.1 and ten samples in an on-time of 0.5 s, against a negative bias."""
    scale = Scale(sign=-1, acceleration=2e-3, time=0.5)
    _, law = law_of(0.7, 0.1, 0.1, on=on, off=off)
    return dataclasses.replace(
        law, scale=scale, level=0.02, period=0.05, command_time=law.command_time / 2,
        on_delay=on / 2, off_delay=off / 2,
    )  # fmt: skip


@given(
    st.lists(st.tuples(st.floats(-1, 1), st.floats(-1.5, 1.5)), min_size=1, max_size=80),
    st.sampled_from([(0.0, 0.0), (0.3, 0.1), (0.0, 0.7)]),
)
def test_no_commanded_pulse_is_short(states, delays):
    law = mirrored(*delays)
    scale = law.scale
    memory, u, since = law.init(), 0.0, -math.inf
    for k, (x, v) in enumerate(states):
        t = k * law.period
        (new,), memory = law.step(t, scale.physical(x, v), memory)
        if new != u:
            if u:
                acts = (t + law.off_delay) - (since + law.on_delay)
                assert acts >= 0.5 - 1e-9 * law.period - 1e-15
            u, since = new, t
        assert list(memory.pending) == sorted(memory.pending)


def test_a_later_command_that_acts_first_stands():
    _, law = law_of(0.7, 0.1, 0.1, on=0.0, off=0.7)
    memory = law.init()
    (u,), memory = law.step(0.0, (1.0, 0.5), memory)
    assert u == -1
    assert memory.pending == ((0.0, -1),)
    (u,), memory = law.step(2.0, (-1.0, -0.5), memory)
    assert u == 0
    assert (memory.acting, memory.pending) == (-1, ((2.7, 0),))
    # Switched on again before it went off: it never does.
    (u,), memory = law.step(2.1, (1.0, 0.5), memory)
    assert u == -1
    assert memory.pending == ((2.1, -1),)


def test_the_object_keeps_the_protocol():
    _, law = law_of(0.7, 0.1, 0.1)
    assert isinstance(law, Controller)
    assert law.events(0.0, (0.1, 0.1), law.init()) == ()
    assert pickle.loads(pickle.dumps(law)) == law
