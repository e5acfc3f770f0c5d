"""The instants at which commands and thrusts change, and what they are called."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacecraft_sim.changes import Channel, changes, rows_to_show
from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.trajectory import Trajectory, selected

CHANNEL = Channel(thruster=Thruster(name="jet", levels=(1.0, 8.0)), unit="N m", largest=8.0)


def flight(command, thrust=None):
    value = np.array(command, dtype=float)
    signals = {"jet_command": value, "jet": value if thrust is None else np.array(thrust)}
    return Trajectory(time=0.5 * np.arange(len(value)), signals=signals, units={})


def told(found):
    """Instants and words of all changes."""
    return [(t, w) for c in found for t, w in zip(c.time, c.words(), strict=True)]


def test_every_new_value_is_a_change_and_the_first_value_too():
    command, thrust = changes(flight([1, 1, -1, -1, 0], [0, 1, 1, -1, -1]), [CHANNEL], {})
    assert (command.what, thrust.what) == ("command", "thrust")
    assert command.time.tolist() == [0.0, 1.0, 2.0]
    assert command.value.tolist() == [1.0, -1.0, 0.0]
    assert thrust.time.tolist() == [0.0, 0.5, 1.5]
    assert (command.end, command.last) == (2.0, 0.0)


def test_words_tell_switching_from_a_change_of_level():
    (command, _) = changes(flight([0, 1, -1, -8, 0, 8]), [CHANNEL], {})
    assert command.words() == [
        "jet command at first: off",
        "jet command begins: +1 N m",
        "jet command switches: -1 N m",
        "jet command changes level: -8 N m",
        "jet command ends: off",
        "jet command begins: +8 N m",
    ]


def test_a_part_without_a_change_keeps_its_value():
    (command, _) = changes(flight([1, 1]), [CHANNEL], {"jet_command": 1.0, "jet": 1.0})
    assert len(command.time) == 0
    assert command.last == 1.0
    assert command.words() == []


@given(
    st.lists(st.sampled_from([0.0, 1.0, -1.0, 8.0, -8.0]), min_size=1, max_size=30),
    st.integers(1, 30),
)
def test_a_flight_in_parts_has_the_changes_of_the_whole(values, size):
    whole, before, found = flight(values), {}, []
    for k in range(0, len(values), size):
        part = selected(whole, slice(k, k + size))
        found += told(changes(part, [CHANNEL], before))
        before = {name: value[-1] for name, value in part.signals.items()}
    assert sorted(found) == sorted(told(changes(whole, [CHANNEL], {})))


@pytest.mark.parametrize(
    ("value", "word"),
    [
        (0.0, "off"),
        (8.0, "+8 N m"),
        (-1.0, "-1 N m"),
        (-1.0 - 1e-9, "-1 N m"),  # a law's own level, rounded otherwise than the thruster's
        (0.4, "between levels, +"),
        (-7.0, "between levels, -"),
    ],
)
def test_states(value, word):
    assert CHANNEL.state(value) == word


def test_the_states_of_a_channel_are_its_levels_of_both_signs_and_off():
    assert list(CHANNEL.states) == ["-8 N m", "-1 N m", "off", "+1 N m", "+8 N m"]
    assert list(CHANNEL.states.values()) == [-8.0, -1.0, 0.0, 1.0, 8.0]


def test_before_a_flight_there_is_no_value():
    assert math.isnan(changes(flight([1]), [CHANNEL], {})[0].before)


def spun(times, *, proportional, command):
    thruster = Thruster(name="jet", levels=(1.0, 8.0), proportional=proportional)
    channel = Channel(thruster=thruster, unit="N m", largest=8.0)
    value = np.array(command, dtype=float)
    signals = {"jet_command": value, "jet": value}
    return Trajectory(time=np.array(times), signals=signals, units={}), [channel]


def test_rows_in_which_nothing_happens_are_shown_every_fiftieth_of_a_second():
    times = np.arange(1000) * 1e-3
    part, channels = spun(times, proportional=True, command=np.sin(times))
    shown = part.time[rows_to_show(part, channels, {})]
    np.testing.assert_allclose(shown, np.arange(50) * 0.02, atol=1e-12)


def test_rows_at_which_a_relay_acts_are_all_shown():
    times = np.arange(1000) * 1e-3
    command = np.where((times > 0.1) & (times < 0.105), 8.0, 1.0)
    part, channels = spun(times, proportional=False, command=command)
    chosen = rows_to_show(part, channels, {})
    changed = np.flatnonzero(np.diff(command)) + 1
    assert np.all(chosen[changed])
    assert np.count_nonzero(chosen) <= 50 + len(changed)


@given(st.integers(1, 200))
def test_a_flight_in_parts_shows_the_rows_of_the_whole(size):
    times = np.arange(500) * 3.1e-3
    part, channels = spun(times, proportional=False, command=np.sign(np.sin(9 * times)))
    whole, before, found = rows_to_show(part, channels, {}), {}, []
    for k in range(0, len(times), size):
        piece = selected(part, slice(k, k + size))
        chosen = rows_to_show(piece, channels, before)
        found += piece.time[chosen].tolist()
        if chosen.any():
            last = np.flatnonzero(chosen)[-1]
            before = {name: value[last] for name, value in piece.signals.items()}
            before["time"] = piece.time[last]
    assert found == part.time[whole].tolist()
