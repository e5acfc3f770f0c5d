"""The limit of impulses: bounds, approach, moments."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.gorelov import min_fuel, min_peak
from controllers.impulse_limit import impulse_limit
from controllers.moments import modes_of

ASKED = {"omega": 1.0, "damping": 0.02, "duration": 8.0, "x1": 1.0}


def moments(limit, modes):
    return modes.functions(limit.duration - limit.times) @ limit.impulses


def test_fuel_comes_down_to_it_as_the_bound_grows():
    limit = impulse_limit(**ASKED)
    peak = min_peak(**ASKED).peak
    above = [min_fuel(**ASKED, bound=r * peak).fuel - limit.fuel for r in (10, 20, 40, 80)]
    assert min(above) > 0
    # A pulse of finite length loses a share of the first order in it, so of 1/m0.
    assert above[2] / above[3] == pytest.approx(2, rel=0.02)


def test_one_impulse_each_way_over_whole_periods():
    T = 4 * math.pi
    limit = impulse_limit(omega=1.0, damping=0.0, duration=T, x1=1.0)
    assert limit.times == pytest.approx([0, T], abs=1e-9)
    assert limit.impulses == pytest.approx([1 / T, -1 / T], rel=1e-10)
    assert limit.fuel == pytest.approx(2 / T, rel=1e-10)


@settings(max_examples=12)
@given(
    st.floats(0.3, 6), st.floats(0, 0.8), st.floats(2, 15), st.floats(-0.2, 0.2),
    st.floats(-0.2, 0.2),
)  # fmt: skip
def test_bound_and_impulses_meet(w, zeta, T, v0, v1):
    limit = impulse_limit(omega=w, damping=2 * zeta * w, duration=T, x1=1.0, v0=v0, v1=v1)
    modes = modes_of(w, 2 * zeta * w)
    c = np.array([1 - T * v0, v1 - v0, 0, 0])
    assert limit.residual < 1e-10
    assert moments(limit, modes)[:2] == pytest.approx(c[:2], abs=1e-9 * (1 + limit.fuel * T))
    assert limit.fuel == pytest.approx(np.abs(limit.impulses).sum())
    assert limit.multipliers @ c == pytest.approx(limit.fuel, rel=1e-8)
    h = limit.multipliers @ modes.functions(np.linspace(0, T, 2001))
    assert np.max(np.abs(h)) < 1 + 1e-8  # so that no control needs less
    assert limit.normal or limit.fuel == pytest.approx(abs(c[1]), rel=1e-9)


def test_several_modes():
    asked = {"omega": [1.0, 2.7], "damping": [0.02, 0.1], "duration": 8.0, "x1": 1.0}
    limit = impulse_limit(**asked)
    assert limit.residual < 1e-12
    assert limit.fuel > impulse_limit(**ASKED).fuel
    assert limit.fuel < min_fuel(**asked, bound=3 * min_peak(**asked).peak).fuel


HARD = [
    # Two impulses of one sign a thirtieth of a period apart, and others that are one.
    ([5.568764623084885], [0.0], 13.59765625, 0.0, 0.0),
    ([3.0], [0.01], 20.0, 0.0, 0.0),
    (
        [0.7003765801299274, 2.5399394369504185, 6.268795879354048],
        [0.10933819135702172, 0.13729786499705152, 0.39740156160509765],
        41.07632995839695, 0.011323049658171703, 0.02382806213235525,
    ),
    ([1.958, 3.921, 13.99], [0.2038, 0.2044, 0.3012], 3.136, 0.0, 0.0),
]  # fmt: skip


@pytest.mark.parametrize(("omega", "zeta", "T", "v0", "v1"), HARD)
def test_hard_cases(omega, zeta, T, v0, v1):
    damping = [2 * z * w for z, w in zip(zeta, omega, strict=True)]
    limit = impulse_limit(omega=omega, damping=damping, duration=T, x1=1.0, v0=v0, v1=v1)
    modes = modes_of(omega, damping)
    h = limit.multipliers @ modes.functions(np.linspace(0, T, 4001))
    assert np.max(np.abs(h)) < 1 + 1e-8
    value = limit.multipliers[:2] @ [1 - T * v0, v1 - v0]
    assert value == pytest.approx(limit.fuel, rel=1e-8)
    assert limit.residual < 1e-10


def test_empty_manoeuvres_are_refused():
    with pytest.raises(ValueError, match="the manoeuvre is empty"):
        impulse_limit(omega=1.0, damping=0.0, duration=8.0, x1=0.0)
