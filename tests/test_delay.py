"""Delays: when a command takes effect, and delays that no actuator has."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacecraft_sim.delay import Delay, arrival


def waves():
    """Sinusoidal delays that stay positive and never run backwards."""
    return st.builds(
        lambda mean, depth, speed, phase: Delay(
            mean=mean, amplitude=depth * mean, frequency=speed / (depth * mean), phase=phase
        ),
        st.floats(0.01, 5),
        st.floats(0.01, 0.999),
        st.floats(-0.999, 0.999),
        st.floats(-7, 7),
    )


@given(waves(), st.floats(0, 1000))
def test_a_command_takes_effect_after_the_delay_at_its_effect(delay, t):
    a = arrival(delay)(t)
    assert t < a <= t + delay.longest * (1 + 1e-15) + math.ulp(t + delay.longest)
    # The clock's ulps at a, and those of the phase: the residual sees frequency x ulp < 1000 ulps.
    turns = abs(delay.amplitude) * (1 + abs(delay.frequency * a + delay.phase)) * 2**-52
    assert a - delay(a) == pytest.approx(t, abs=8 * math.ulp(a) + 4 * turns)


@given(waves(), st.lists(st.floats(0, 100), min_size=2, max_size=20))
def test_commands_keep_their_order(delay, times):
    arrive = arrival(delay)
    arrivals = [arrive(t) for t in sorted(times)]
    # One per issue, and an earlier one never later; the checked function would raise otherwise.
    assert arrivals == sorted(arrivals)


@given(waves(), st.floats(0, 100))
def test_a_callable_delay_agrees_with_the_sinusoidal_one(delay, t):
    exact = delay.arrival(t)
    found = arrival(lambda a: delay(a))(t)
    # Both stop at rounding of a - h(a) - t, magnified by 1/(1 - h') at most 1000 times.
    assert found == pytest.approx(exact, abs=4e3 * (math.ulp(exact) + 2**-52 * delay.mean))


def test_a_constant_delay_is_a_shift():
    assert arrival(0.2)(0.1) == 0.1 + 0.2
    assert arrival(Delay(mean=0.2))(0.1) == 0.1 + 0.2
    # brentq stops at four ulps of a root near 1.
    assert arrival(lambda t: 0.2)(0.8) == pytest.approx(1.0, abs=4 * 2**-52)


def test_the_variation_is_the_printed_one():
    delay = Delay(mean=0.1, amplitude=-0.04, frequency=3.0, phase=0.7)
    assert delay(2.0) == 0.1 - 0.04 * math.sin(3.0 * 2.0 + 0.7)
    assert delay.longest == pytest.approx(0.14, rel=1e-15)  # one sum
    # It is reached: the densest sampling comes within (frequency dt)^2/2 of the top.
    assert max(map(delay, np.linspace(0, 3, 30_001).tolist())) == pytest.approx(0.14, abs=1e-8)


@pytest.mark.parametrize("depth", [1e-6, 0.3, 0.999])
def test_delays_that_all_but_run_backwards_still_arrive(depth):
    delay = Delay(mean=0.5, amplitude=0.5 * depth, frequency=0.9999 / (0.5 * depth), phase=0.1)
    arrivals = [delay.arrival(t) for t in np.linspace(0, 20, 2001).tolist()]
    assert np.all(np.diff(arrivals) > 0)
    back = np.array(arrivals) - [delay(a) for a in arrivals]
    # Ulps of a clock of 20 s, and of a phase of up to 20/(depth/2) rad times the amplitude.
    assert back == pytest.approx(np.linspace(0, 20, 2001), abs=1e-13)


@pytest.mark.parametrize("bad", [0.0, -0.2, math.nan, math.inf])
def test_a_constant_delay_must_be_positive(bad):
    with pytest.raises(ValueError, match=f"finite and > 0: delay = {bad}"):
        arrival(bad)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"amplitude": 0.3}, r"negative: amplitude 0\.3 s > mean 0\.2 s"),
        ({"amplitude": -0.3}, r"negative: amplitude -0\.3 s > mean 0\.2 s"),
        ({"amplitude": 0.1, "frequency": 10.0}, r"backwards: amplitude \* frequency = 1\.0 >= 1"),
        ({"amplitude": -0.1, "frequency": 20.0}, r"backwards: amplitude \* frequency = 2\.0 >= 1"),
        ({"mean": -0.1}, "mean"),
        ({"mean": math.nan}, "mean"),
    ],
)
def test_a_delay_no_actuator_has_is_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        Delay(**({"mean": 0.2} | changes))


@pytest.mark.parametrize(
    ("delay", "message"),
    [
        (lambda t: 0.0, r"must be positive; a command of t = 0\.0 s acts at 0\.0 s"),
        (lambda t: -0.1, r"negative.*h\(0\.0 s\) = -0\.1 s"),
        (lambda t: 0.1 + 2 * t, r"t = 0\.0 s never takes effect: h grows too fast"),
    ],
)
def test_a_callable_delay_is_checked_when_it_is_used(delay, message):
    with pytest.raises(ValueError, match=message):
        arrival(delay)(0.0)


def test_a_callable_delay_that_runs_backwards_is_found_at_the_first_command():
    arrive = arrival(lambda t: 0.25 + 0.2 * math.sin(20 * t))  # h' up to 4
    with pytest.raises(ValueError, match=r"runs backwards"):
        list(map(arrive, np.linspace(0, 2, 200).tolist()))


def test_order_is_kept_apart_for_each_line():
    first = arrival(0.2)
    wave = arrival(Delay(mean=0.2, amplitude=0.1, frequency=1.0))
    assert wave(5.0) > 5.0
    assert first(1.0) == 1.2
    # A new line begins with no memory of the commands of another.
    assert arrival(Delay(mean=0.2, amplitude=0.1, frequency=1.0))(1.0) < 5.0
