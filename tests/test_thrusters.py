"""Relay thrusters: exact pulses, and laws that hold for every sequence of commands."""

import math
from itertools import pairwise

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.thrusters import Thrusters, nearest_level

LEVELS = (1.0, 2.5, 7.0)
TOP = max(LEVELS)
ROUNDING = 1e-9  # of thrust times of order 10 s at slopes up to 700 per s


def relay(**numbers):
    return Thruster.model_validate({"name": "jet", "levels": LEVELS, **numbers})


def flown(spec, commands, end=60.0):
    """Pieces (start, stop, thrust at start, slope) of a flight that lands on every edge.

    `commands` are (time, level) with ascending times; the thrust is zero before the first.
    """
    thrusters = Thrusters([spec])
    state, pieces, t = thrusters.init(), [], 0.0
    for issue, level in [*commands, (end, None)]:
        while t < issue:
            (thrust,), (slope,), edge = thrusters.line(t, state)
            assert edge > t
            stop = min(edge, issue)
            pieces.append((t, stop, thrust, slope))
            t = stop
        if level is not None:
            state = thrusters.command(issue, [level], state)
    return pieces


def merged(pieces):
    """Intervals (start, stop, level) of constant thrust of a flight without ramps."""
    assert all(slope == 0 for *_, slope in pieces)
    intervals = []
    for start, stop, thrust, _ in pieces:
        if intervals and intervals[-1][2] == thrust:
            intervals[-1] = (intervals[-1][0], stop, thrust)
        else:
            intervals.append((start, stop, thrust))
    return intervals


def commands(smallest_gap=1e-3):
    gaps = st.lists(st.floats(smallest_gap, 3.0), min_size=1, max_size=12)
    wanted = st.sampled_from([sign * level for level in (0.0, *LEVELS) for sign in (1, -1)])

    def timed(gaps_and_levels):
        t, sequence = 0.0, []
        for gap, level in gaps_and_levels:
            t += gap
            sequence.append((t, level))
        return sequence

    return gaps.flatmap(lambda g: st.tuples(*[st.tuples(st.just(x), wanted) for x in g]).map(timed))


def delays():
    """Constant and varying delays, none that goes negative or runs backwards."""
    constant = st.floats(0.0, 2.0).map(lambda mean: {"mean": mean})
    varying = st.tuples(st.floats(0.05, 1.0), st.floats(0, 0.99), st.floats(0, 6)).map(
        lambda x: {
            "mean": x[0],
            "amplitude": x[0] * x[1],
            "frequency": 0.95 / x[0],
            "phase": x[2],
        }
    )
    return constant | varying


specs = st.builds(
    lambda delay, on, rise, fall: relay(
        delay=delay, min_on_time=on, rise_time=rise, fall_time=fall
    ),
    delays(),
    st.just(0.0) | st.floats(0.01, 4.0),
    st.just(0.0) | st.floats(0.01, 2.0),
    st.just(0.0) | st.floats(0.01, 2.0),
)


# -- exact -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("wanted", "level"),
    [(0.4, 0), (0.6, 1), (-0.6, -1), (1.7, 1), (1.8, 2.5), (-40, -7), (7, 7), (0, 0), (-0.0, 0)],
)
def test_relay_delivers_the_nearest_of_its_levels(wanted, level):
    assert nearest_level(wanted, relay()) == level


@pytest.mark.parametrize("sign", [1, -1])
def test_relay_answers_an_unbounded_command_with_its_highest_level(sign):
    assert nearest_level(sign * math.inf, relay()) == sign * TOP


def test_command_that_is_not_a_number_is_refused():
    thrusters = Thrusters([relay()])
    with pytest.raises(ValueError, match="nan"):
        thrusters.command(0.0, [math.nan], thrusters.init())


def test_delay_is_a_shift():
    sequence = [(0.25, 1.0), (0.5, -7.0), (0.75, 0.0)]
    # Dyadic numbers: the sums are exact.
    assert merged(flown(relay(delay=0.5), sequence, end=2.0)) == [
        (0.0, 0.75, 0.0), (0.75, 1.0, 1.0), (1.0, 1.25, -7.0), (1.25, 2.0, 0.0),
    ]  # fmt: skip


def test_thrust_just_after_an_edge_is_the_new_one():
    thrusters = Thrusters([relay(delay=0.5)])
    state = thrusters.command(0.0, [2.5], thrusters.init())
    assert thrusters.line(math.nextafter(0.5, 0), state)[0] == [0.0]
    assert thrusters.line(0.5, state)[0] == [2.5]
    assert thrusters.line(0.0, state)[2] == 0.5
    assert thrusters.line(0.5, state)[2] == math.inf


def test_minimum_on_time_postpones_the_end_of_a_pulse_and_the_last_word_counts():
    sequence = [(0.0, 1.0), (0.25, 0.0), (0.5, -2.5)]
    assert merged(flown(relay(min_on_time=2.0), sequence, end=3.0)) == [
        (0.0, 2.0, 1.0), (2.0, 3.0, -2.5),
    ]  # fmt: skip


def test_pulse_that_is_wanted_again_in_time_goes_on():
    sequence = [(0.0, 1.0), (0.25, 0.0), (0.5, 1.0)]
    assert merged(flown(relay(min_on_time=2.0), sequence, end=3.0)) == [(0.0, 3.0, 1.0)]


def test_rise_and_fall_are_straight_lines():
    spec = relay(rise_time=0.5, fall_time=0.25)
    assert flown(spec, [(1.0, 1.0), (2.0, 0.0)], end=3.0) == [
        (0.0, 1.0, 0.0, 0.0), (1.0, 1.5, 0.0, 2.0), (1.5, 2.0, 1.0, 0.0),
        (2.0, 2.25, 1.0, -4.0), (2.25, 3.0, 0.0, 0.0),
    ]  # fmt: skip


def test_reversal_falls_to_zero_before_it_rises():
    spec = relay(rise_time=0.5, fall_time=0.25)
    reversal = flown(spec, [(0.0, 1.0), (2.0, -2.5)], end=4.0)[2:]
    assert reversal == [
        (2.0, 2.25, 1.0, -4.0), (2.25, 2.75, 0.0, -5.0), (2.75, 4.0, -2.5, 0.0),
    ]  # fmt: skip


def test_pulse_cut_short_falls_from_where_it_had_come():
    spec = relay(rise_time=1.0, fall_time=0.5)
    assert flown(spec, [(0.0, 1.0), (0.25, 0.0)], end=1.0) == [
        (0.0, 0.25, 0.0, 1.0), (0.25, 0.75, 0.25, -0.5), (0.75, 1.0, 0.0, 0.0),
    ]  # fmt: skip


@pytest.mark.parametrize("level", [0.0, 2.5])
def test_failure_is_an_edge_and_the_end_of_obedience(level):
    spec = relay(delay=0.5, failure={"time": 1.25, "level": level})
    sequence = [(0.25, 1.0), (1.0, -7.0), (2.0, 7.0)]
    found = merged(flown(spec, sequence, end=4.0))
    assert found == [(0.0, 0.75, 0.0), (0.75, 1.25, 1.0), (1.25, 4.0, level)]


def test_pulse_that_waits_to_end_is_cut_by_the_failure_and_leaves_no_edge():
    spec = relay(min_on_time=4.0, failure={"time": 1.25, "level": 0.0})
    assert flown(spec, [(0.0, 1.0), (0.5, 0.0)], end=6.0) == [
        (0.0, 0.5, 1.0, 0.0), (0.5, 1.25, 1.0, 0.0), (1.25, 6.0, 0.0, 0.0),
    ]  # fmt: skip


def test_pause_may_be_shorter_than_the_minimum_on_time():
    sequence = [(0.0, 1.0), (2.5, 0.0), (2.75, 1.0)]
    assert merged(flown(relay(min_on_time=2.0), sequence, end=4.0)) == [
        (0.0, 2.5, 1.0), (2.5, 2.75, 0.0), (2.75, 4.0, 1.0),
    ]  # fmt: skip


@pytest.mark.parametrize("on", [0.0, 2.0])
@pytest.mark.parametrize("delay", [0.0, 0.5])
def test_second_command_at_the_same_instant_replaces_the_first(delay, on):
    thrusters = Thrusters([relay(delay=delay, min_on_time=on)])
    state = thrusters.command(1.0, [1.0], thrusters.init())
    state = thrusters.command(1.0, [-2.5], state)
    assert thrusters.line(1.0 + delay, state)[0] == [-2.5]


def test_channels_do_not_disturb_each_other():
    thrusters = Thrusters([relay(delay=0.5), relay(name="other", delay=0.25)])
    state = thrusters.command(0.0, [1.0, -7.0], thrusters.init())
    assert thrusters.line(0.0, state)[2] == 0.25
    assert thrusters.line(0.25, state)[0] == [0.0, -7.0]
    assert thrusters.line(0.5, state)[0] == [1.0, -7.0]


def test_commanding_leaves_the_earlier_state_as_it_was():
    thrusters = Thrusters([relay()])
    before = thrusters.init()
    thrusters.command(0.0, [1.0], before)
    assert before == thrusters.init()
    assert thrusters.line(0.0, before)[0] == [0.0]


def test_unknown_thruster_is_refused_with_the_nearest():
    with pytest.raises(ValueError, match="thruster 'jett' is not in the spacecraft; did you mean"):
        Thrusters([relay()])["jett"]


def test_command_of_the_wrong_width_is_refused():
    thrusters = Thrusters([relay()])
    with pytest.raises(ValueError, match="argument"):
        thrusters.command(0.0, [1.0, 1.0], thrusters.init())


# -- laws --------------------------------------------------------------------------------------


@given(spec=specs, sequence=commands())
def test_thrust_never_exceeds_the_highest_level(spec, sequence):
    for start, stop, thrust, slope in flown(spec, sequence):
        assert abs(thrust) <= TOP + ROUNDING
        assert abs(thrust + slope * (stop - start)) <= TOP + ROUNDING


@given(spec=specs, sequence=commands())
def test_pieces_between_edges_are_straight_and_never_change_sign(spec, sequence):
    pieces = flown(spec, sequence)
    assert len(pieces) <= 1 + 5 * (1 + len(sequence))  # at most 4 knots and one issue a command
    for start, stop, thrust, slope in pieces:
        assert math.isfinite(thrust)
        assert thrust * (thrust + slope * (stop - start)) >= -ROUNDING


@given(spec=specs, sequence=commands(), share=st.floats(0.01, 0.99))
def test_output_inside_a_piece_lies_on_its_line(spec, sequence, share):
    thrusters = Thrusters([spec])
    state = thrusters.init()
    for issue, level in sequence:
        state = thrusters.command(issue, [level], state)
    t = sequence[-1][0]
    for _ in range(60):
        (thrust,), (slope,), edge = thrusters.line(t, state)
        if edge == math.inf:
            break
        inside = t + share * (edge - t)
        if t < inside < edge:
            (found,), (same,), _ = thrusters.line(inside, state)
            assert same == slope
            assert found == pytest.approx(thrust + slope * (inside - t), abs=ROUNDING)
        t = edge
    assert slope == 0  # it settles


@given(sequence=commands(), delay=delays(), on=st.just(0.0) | st.floats(0.01, 4.0),
       rise=st.floats(0.01, 2.0), fall=st.floats(0.01, 2.0))  # fmt: skip
def test_thrust_is_continuous_where_rise_and_fall_take_time(sequence, delay, on, rise, fall):
    spec = relay(delay=delay, min_on_time=on, rise_time=rise, fall_time=fall)
    for (start, stop, thrust, slope), (_, _, following, _) in pairwise(flown(spec, sequence)):
        assert following == pytest.approx(thrust + slope * (stop - start), abs=ROUNDING)


@given(sequence=commands(), delay=delays(), on=st.floats(0.01, 4.0))
def test_valve_never_leaves_a_level_before_the_minimum_on_time(sequence, delay, on):
    for start, stop, level in merged(flown(relay(delay=delay, min_on_time=on), sequence))[:-1]:
        if level:
            assert stop - start >= on - 1e-12  # rounding of clock sums of order 100


@given(sequence=commands(), delay=delays())
def test_output_is_the_command_shifted_by_the_delay(sequence, delay):
    spec = relay(delay=delay)
    arrivals = [(spec.delay.arrival(t), level) for t, level in sequence]
    for start, _, thrust, slope in flown(spec, sequence, end=sequence[-1][0] + 5):
        due = [level for arrival, level in arrivals if arrival <= start]
        assert thrust == (due[-1] if due else 0.0)
        assert slope == 0


@given(spec=specs, sequence=commands(), time=st.floats(0, 40), level=st.sampled_from((0.0, 1.0)))
def test_failure_freezes_the_thrust_and_changes_nothing_before(spec, sequence, time, level):
    failed = spec.model_validate(spec.model_dump() | {"failure": {"time": time, "level": level}})
    sound = [piece for piece in flown(spec, sequence) if piece[1] < time]
    broken = flown(failed, sequence)
    assert broken[: len(sound)] == sound
    settled = time + spec.rise_time + spec.fall_time
    for start, _, thrust, slope in broken:
        if start > settled + 1e-9:  # a later command cuts no ramp: there is none any more
            assert (thrust, slope) == (level, 0.0)


@given(spec=specs, sequence=commands(), time=st.floats(0, 20), late=st.floats(0, 5))
def test_command_that_arrives_after_the_failure_changes_nothing(spec, sequence, time, late):
    failed = spec.model_validate(spec.model_dump() | {"failure": {"time": time, "level": 1.0}})
    thrusters = Thrusters([failed])
    state = thrusters.init()
    for issue, level in sequence:
        state = thrusters.command(issue, [level], state)
    issue = max(time, sequence[-1][0]) + late
    for level in (0.0, -TOP):
        assert thrusters.command(issue, [level], state) == state


@given(spec=specs, sequence=commands(), pick=st.integers(0, 20))
def test_command_issued_on_an_edge_keeps_thrust_within_its_limits(spec, sequence, pick):
    edges = [stop for _, stop, *_ in flown(spec, sequence)]
    at = edges[pick % len(edges)]
    earlier = [command for command in sequence if command[0] < at]
    for start, stop, thrust, slope in flown(spec, [*earlier, (at, -TOP), (at + 0.5, 1.0)], 99.0):
        assert abs(thrust + slope * (stop - start)) <= TOP + ROUNDING
        if start > spec.delay.arrival(at + 0.5) + spec.min_on_time + 5:
            assert (thrust, slope) == (1.0, 0.0)


@given(spec=specs, sequence=commands())
def test_later_commands_never_change_the_past(spec, sequence):
    whole = flown(spec, sequence)
    for n in range(1, len(sequence)):
        issue = sequence[n][0]
        head = [piece for piece in flown(spec, sequence[:n]) if piece[1] < issue]
        assert whole[: len(head)] == head


@given(spec=specs, sequence=commands())
def test_mirrored_commands_give_mirrored_thrust(spec, sequence):
    mirrored = flown(spec, [(t, -level) for t, level in sequence])
    assert [(a, b, -thrust, -slope) for a, b, thrust, slope in mirrored] == flown(spec, sequence)
