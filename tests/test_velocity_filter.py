"""The sampled filter in place of a velocity sensor: exact cases, orders, margins of its own."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from controllers.velocity_filter import SampledLaw, sampled, velocity_filter
from spacecraft_sim.controller import Controller

HOLDS = ("first-order hold", "zero-order hold", "tustin", "euler")
K = 7.0


def run(z, *, hold, period, cutoff=K):
    """w after every sample of a scalar reading."""
    bank = velocity_filter(cutoffs=[cutoff], period=period, hold=hold)
    memory, found = None, []
    for value in z:
        memory = bank.step([value], memory)
        found.append(memory.w[0])
    return np.array(found)


@pytest.mark.parametrize("hold", HOLDS)
def test_it_starts_at_the_measured_value(hold):
    assert run([123.0], hold=hold, period=0.01)[0] == 0.0


@given(
    st.lists(st.floats(-1, 1), min_size=2, max_size=20),
    st.floats(1e-4, 0.5),
    st.floats(-100, 100),
)
def test_only_changes_count(z, period, offset):
    for hold in ("first-order hold", "zero-order hold", "tustin"):
        shifted = run([offset + x for x in z], hold=hold, period=period)
        # Rounding of z + offset, summed over the samples.
        assert shifted == pytest.approx(run(z, hold=hold, period=period), abs=1e-12)


def test_a_line_is_followed_exactly_by_the_first_order_hold():
    t = np.arange(40) * 0.05
    w = run(3.0 * t, hold="first-order hold", period=0.05)
    # w' = -K w + 3 from w = 0; rounding.
    assert w == pytest.approx(3.0 * (1 - np.exp(-K * t)) / K, rel=1e-13)


def test_a_staircase_is_followed_exactly_by_the_zero_order_hold():
    steps, T = [0.0, 1.0, 1.0, -2.0, 0.5, 0.5], 0.05
    exact, w = [], 0.0
    for change in np.diff(steps, prepend=steps[0]):  # w decays, and jumps with z
        w = w * math.exp(-K * T) + change
        exact.append(w)
    assert run(steps, hold="zero-order hold", period=T) == pytest.approx(exact, rel=1e-13)


@pytest.mark.parametrize("hold", HOLDS)
def test_what_a_steady_rate_reads(hold):
    T = 0.02
    w = run(3.0 * T * np.arange(2000), hold=hold, period=T)[-1]
    inflated = K * T / (1 - math.exp(-K * T)) if hold == "zero-order hold" else 1.0
    # e^(-K t) has died; 1e-11 is the rounding of 3 T k over its difference.
    assert K * w == pytest.approx(3.0 * inflated, rel=1e-10)


@pytest.mark.parametrize(
    ("hold", "order"),
    [("first-order hold", 2), ("tustin", 2), ("zero-order hold", 1), ("euler", 1)],
)
def test_orders_of_convergence(hold, order):
    errors = []
    for n in (200, 400):
        t = np.linspace(0, 2, n + 1)
        exact = (K * np.cos(3 * t) + 3 * np.sin(3 * t) - K * np.exp(-K * t)) * 3 / (K**2 + 9)
        errors.append(np.max(np.abs(run(np.sin(3 * t), hold=hold, period=2 / n) - exact)))
    # The next order shows by some T K, 0.07 and less.
    assert math.log2(errors[0] / errors[1]) == pytest.approx(order, abs=0.08)


@pytest.mark.parametrize("hold", HOLDS)
def test_slow_swings_pass_as_through_the_washout(hold):
    # s/(s + K) at 2 rad/s, from a run long after its start.
    T, w = 1e-3, 2.0
    t = T * np.arange(8000)
    out = run(np.sin(w * t), hold=hold, period=T)[4000:]
    basis = np.array([np.sin(w * t), np.cos(w * t)]).T[4000:]
    sine, cosine = np.linalg.lstsq(basis, out, rcond=None)[0]
    # Half a period of delay at most: w T/2 and K T/2, 3.5e-3.
    assert complex(sine, cosine) == pytest.approx(1j * w / (1j * w + K), rel=5e-3)


def test_resampling_is_designing_anew():
    bank = velocity_filter(cutoffs=[K, 2 * K], period=0.01, hold="tustin")
    again = velocity_filter(cutoffs=[K, 2 * K], period=0.03, hold="tustin")
    assert bank.coefficients(0.03) == (again.decay, again.gain)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"cutoffs": [3.0, -2.0]}, r"cutoffs\[1\] = -2\.0"),
        ({"cutoffs": [3.0, math.nan]}, r"cutoffs\[1\] = nan"),
        ({"period": 0.0}, r"period = 0\.0"),
        ({"hold": "zero-order"}, r"did you mean 'zero-order hold'\?"),
        ({"hold": "euler", "period": 0.7}, r"K T < 2; .* T < 0\.666667 s"),
    ],
)
def test_bad_input(changes, words):
    with pytest.raises(ValueError, match=words):
        velocity_filter(**{"cutoffs": [3.0, 2.0], "period": 1e-3, "hold": "tustin", **changes})


class Slope:
    """u = -2 z - w."""

    def filtered(self, t, y):
        return y

    def command(self, t, y, w):
        return [-2 * y[0] - w[0]]


def slope_law(**changes):
    arguments = {
        "cutoffs": [K], "hold": "tustin", "period": 0.01, "sensors": ("z",), "channels": ("u",),
        "thrusters": None, **changes,
    }  # fmt: skip
    return sampled(Slope(), **arguments)


def test_a_sampled_law_is_a_controller_and_pure():
    law = slope_law()
    assert isinstance(law, SampledLaw)
    assert isinstance(law, Controller)
    assert law.period == 0.01
    u, memory = law.step(0.0, [1.0], law.init())
    assert list(u) == [-2.0]  # no kick from the filter
    one = law.step(0.01, [1.5], memory)
    assert one == law.step(0.01, [1.5], pickle.loads(pickle.dumps(memory)))
    assert one[0][0] == pytest.approx(-3.0 - one[1].w[0])
    assert list(law.events(0.0, [1.0], memory)) == []
