"""Spin-ups: where thrust of one sign does, the least fuel is the change of rate."""

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from controllers.gorelov import min_fuel, min_peak
from controllers.moment_problem import problem_of
from controllers.moments import modes_of
from controllers.one_signed import one_signed

SPIN = {"omega": 1.0, "damping": 0.02, "duration": 10.0, "x1": 1.0, "v1": 0.2}


@pytest.mark.parametrize("ratio", [1.0005, 1.01, 1.2, 1.5, 2, 4, 30, 1000])
@pytest.mark.parametrize("turn", [1.0, -1.0])
def test_a_spin_up_costs_its_change_of_rate(ratio, turn):
    asked = SPIN | {"x1": turn * 1.0, "v1": turn * 0.2}
    bound = ratio * min_peak(**asked).peak
    plan = min_fuel(**asked, bound=bound)
    if ratio < 1.001:  # both signs are needed
        assert plan.normal
        assert plan.fuel > 0.2
        return
    assert not plan.normal
    assert plan.fuel == pytest.approx(0.2, rel=1e-11)
    assert set(np.round(turn * plan.levels / bound, 12)) == {0.0, 1.0}
    assert not np.any(np.signbit(plan.levels[plan.levels == 0]))
    assert plan.residual < 1e-13 * ratio + 1e-13  # an ulp of an edge counts with the level
    assert plan.multipliers == pytest.approx([0, turn, 0, 0], abs=1e-12)


def test_another_control_costs_as_little():
    """A soft one of the same moments: half the bound, all the time that it takes."""
    bound = 4 * min_peak(**SPIN).peak
    hard, soft = min_fuel(**SPIN, bound=bound), min_fuel(**SPIN, bound=bound / 2)
    assert hard.fuel == pytest.approx(soft.fuel, rel=1e-11)
    t = np.linspace(0, 10, 20_001)
    distance = np.sqrt(np.trapezoid((hard(t) - soft(t)) ** 2, t))
    assert distance > 0.05


def test_thrust_is_gathered_about_the_middle():
    """No on-off control of the same moments has a smaller int (t - T/2)^2 |u|."""
    bound = 2 * min_peak(**SPIN).peak
    plan = min_fuel(**SPIN, bound=bound)
    t = (np.arange(4000) + 0.5) * 10 / 4000
    modes = modes_of(1.0, 0.02)
    h = modes.functions(10 - t)
    on = plan(t) > 0
    # Where the thrust is on, and only there, some combination of h exceeds the weight.
    edge = np.flatnonzero(np.diff(on))
    spread = (t - 5) ** 2
    fit = np.linalg.lstsq(h[:, edge].T, spread[edge], rcond=None)[0]
    inside = fit @ h > spread
    assert np.mean(inside == on) > 0.99


@settings(max_examples=12)
@given(
    st.floats(0.5, 5), st.floats(0, 0.5), st.floats(3, 15), st.floats(0.2, 0.8), st.floats(1.05, 20)
)
def test_of_one_sign_exactly_if_there_is_one(w, zeta, T, part, ratio):
    """u in [0, m0] exists if and only if u - m0/2 of peak m0/2 does."""
    ends = {"x1": part * T, "v1": 1.0}
    asked = {"omega": w, "damping": 2 * zeta * w, "duration": T} | ends
    bound = ratio * min_peak(**asked).peak
    problem = problem_of(modes_of(w, 2 * zeta * w), duration=T, x0=0.0, v0=0.0, **ends)
    found = one_signed(problem, bound / problem.unit)
    plan = min_fuel(**asked, bound=bound)
    assert plan.residual < 1e-10
    assert plan.fuel >= 1 - 1e-10  # |c_2|
    assume(abs(plan.fuel - 1) > 1e-7 or found is not None)
    assert plan.normal == (found is None)
    assert (plan.fuel < 1 + 1e-9) == (found is not None)


def test_from_rest_to_rest_there_is_none():
    problem = problem_of(modes_of(1.0, 0.02), duration=8.0, x0=0.0, v0=0.0, x1=1.0, v1=0.0)
    assert one_signed(problem, 100.0) is None
