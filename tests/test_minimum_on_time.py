"""The law with a minimum on-time as an object: lock, events, units, against the exact arcs."""

import dataclasses
import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.contour import contour
from controllers.contour_rules import example_1, example_2, undisturbed_a, undisturbed_b
from controllers.dimensionless import UNIT, Scale
from controllers.ivanova_sokolov_search import FEEDBACKS, OUTER
from controllers.minimum_on_time import Memory, MinimumOnTimeRelay
from spacecraft_sim.controller import Controller
from spacecraft_sim.parabola_arcs import feedback, propagate

C = contour(0.8, 0.12)
RULES = {
    "example 1": example_1(C),
    "example 1 as printed": example_1(C, guarded=False),
    "example 1 in finite time": example_1(C, finite_time=True),
    "example 2": example_2(C),
    "example 2 in finite time": example_2(C, finite_time=True),
    "undisturbed, m = a": undisturbed_a(0.8),
    "undisturbed, m = b": undisturbed_b(0.1),
}
MIRRORED = Scale(sign=-1, acceleration=3e-4, time=0.5)


def law_of(relay, scale=UNIT, level=1.0):
    return MinimumOnTimeRelay(relay=relay, scale=scale, level=level)


def fly(law, *, start, bias, push, duration, memory=None):
    """Flies the object along exact arcs, bisecting its events: t, x, v, u of each switching."""
    u0 = law.scale.acceleration
    t, (x, v) = 0.0, start
    (u,), memory = law.step(t, (x, v), memory or law.init())
    switches = [(t, x, v, u)] if u else []
    while t < duration:
        n = round(u / law.level)
        rising = n + bias > 0
        a = u0 * (n + bias + push(v, n, rising))
        tau = min(0.002 * law.scale.time, duration - t)
        turns = v * a < 0 and -v / a <= tau
        tau = -v / a if turns else tau

        def at(s, t=t, x=x, v=v, a=a):
            return t + s, (x + s * (v + s * a / 2), v + s * a)

        def least(s, at=at, memory=memory):
            return min(law.events(*at(s), memory))

        if least(tau) <= 0:
            low, high = 0.0, tau
            while high - low > 4 * math.ulp(t + tau):
                middle = (low + high) / 2
                low, high = (middle, high) if least(middle) > 0 else (low, middle)
            tau, turns = high, False
        t, (x, v) = at(tau)
        v = 0.0 if turns else v
        if least(tau) <= 0:
            (new,), memory = law.step(t, (x, v), memory)
            if new != u:
                switches.append((t, x, v, new))
            u = new
    return np.array(switches)


# -- against the exact arcs ----------------------------------------------------------------------


@pytest.mark.parametrize("name", ["example 1", "example 1 in finite time", "example 2"])
@pytest.mark.parametrize("scale", [UNIT, MIRRORED], ids=["unit", "mirrored"])
def test_the_object_flies_as_the_exact_arcs_do(name, scale):
    relay, signs = RULES[name], FEEDBACKS[6]
    start = (-3 * C.p, 0.05)
    exact = propagate(
        relay, start=start, bias=0.8, disturbance=feedback(0.12, signs), duration=12.0
    )
    law = law_of(relay, scale, level=0.02)
    eps = feedback(0.12, signs)

    def push(v, n, rising):
        s = scale.sign
        return s * eps(0.0, s * v, s * n, rising if s > 0 else not rising, 0).eps

    found = fly(
        law, start=scale.physical(*start), bias=0.8 * scale.sign, push=push,
        duration=12.0 * scale.time,
    )  # fmt: skip
    k = exact.switch_arcs
    assert len(found) == len(k) > 6
    # Bisected to an ulp of the clock; where the state grazes a line an ulp of x counts for more.
    assert found[:, 0] / scale.time == pytest.approx(exact.times[k], abs=1e-9)
    x, v = np.array([scale.reduced(x, v) for _, x, v, _ in found]).T
    assert x == pytest.approx(exact.x[k], abs=1e-9)
    assert v == pytest.approx(exact.v[k], abs=1e-9)
    assert np.round(found[:, 3] * scale.sign / 0.02).tolist() == exact.levels[k].tolist()


# -- lock ------------------------------------------------------------------------------------------


@given(
    st.lists(st.tuples(st.floats(0.0, 0.7), st.floats(-1, 1), st.floats(-1.5, 1.5)), max_size=60),
    st.sampled_from(sorted(RULES)),
    st.sampled_from([UNIT, MIRRORED]),
)
def test_no_commanded_pulse_is_short_whenever_it_is_asked(steps, name, scale):
    law = law_of(RULES[name], scale)
    memory, t, u, since = law.init(), 0.0, 0.0, -math.inf
    for wait, x, v in steps:
        t += wait * scale.time
        (new,), memory = law.step(t, scale.physical(x, v), memory)
        if new != u:
            if u:
                assert t >= since + scale.time
            u, since = new, t


@given(
    st.floats(-1, 1), st.floats(-1.5, 1.5), st.sampled_from([-1, 0, 1]), st.floats(0, 2),
    st.sampled_from(sorted(RULES)),
)  # fmt: skip
def test_the_command_changes_where_an_event_is_not_positive_and_only_there(x, v, n, tau, name):
    law, memory = law_of(RULES[name]), Memory(n, 5.0)
    t = 5.0 + tau
    (u,), after = law.step(t, (x, v), memory)
    event = min(law.events(t, (x, v), memory))
    if n and t < 6.0:
        assert event == 6.0 - t
        assert after == memory
        assert u == n
    else:
        assert (u != n) is (event <= 0)
        assert after == (memory if u == n else Memory(round(u), t))


def test_the_lock_ends_at_its_end():
    law = law_of(RULES["example 1"], MIRRORED)
    left = MIRRORED.physical(-C.p, -0.1)  # beyond L
    memory = Memory(-1, 7.3)
    end = 7.3 + 0.5
    before = math.nextafter(end, 0)
    assert law.step(before, left, memory)[0] == (1.0,)  # mirrored
    assert law.step(end, left, memory) == ((0.0,), Memory(0, end))
    assert law.events(before, left, memory)[0] > 0
    assert law.events(end, left, memory)[0] <= 0


# -- ties and the guard ----------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["example 1", "example 1 as printed", "example 2"])
def test_corners_belong_to_one_level(name):
    relay = RULES[name]
    assert relay.command(0, *C.A1) == -1
    # A2 is met by a pulse that runs along M2 A2; a rounding beyond it the thrust is off.
    x, v = C.A2
    beyond = v * (1 + 1e-9)
    assert relay.command(-1, C.p - beyond**2 / (2 * C.rates.dp), beyond) == 0
    assert relay.command(-1, x, v * (1 - 1e-9)) == -1


def test_the_guard_holds_what_goes_the_right_way():
    guarded, printed = RULES["example 1"], RULES["example 1 as printed"]
    right = (3 * C.p, -0.3)
    assert guarded.command(0, *right) == 0
    assert printed.command(0, *right) == -1
    left = (-3 * C.p, 0.1)
    assert guarded.command(-1, *left) == -1
    assert printed.command(-1, *left) == 0
    # Where v has turned, both act.
    assert guarded.command(0, 3 * C.p, 0.0) == -1
    assert guarded.command(-1, -3 * C.p, 0.0) == 0


def test_extreme_arcs_run_along_the_switching_lines():
    # As printed, with eps of the bound exactly: nothing fires again along A2 K2, from far away.
    f = propagate(
        RULES["example 1 as printed"], start=(-300 * C.p, 0), bias=0.8,
        disturbance=feedback(0.12, OUTER), switchings=60,
    )  # fmt: skip
    assert abs(f.peaks[-1]) == pytest.approx(C.p, rel=1e-9)
    assert np.diff(f.times[f.switch_arcs]).min() > 0.3


# -- the object ------------------------------------------------------------------------------------


def test_the_object_keeps_the_protocol_and_survives_pickling():
    for relay in RULES.values():
        law = law_of(relay)
        assert isinstance(law, Controller)
        assert pickle.loads(pickle.dumps(law)) == law
        assert law.step(0.0, (0.5, 0.1), law.init()) == law.step(0.0, (0.5, 0.1), law.init())
        with pytest.raises(dataclasses.FrozenInstanceError):
            law.level = 2.0  # pyright: ignore
