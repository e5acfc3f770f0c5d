"""Least peak and least fuel: duality, discretised rivals, degenerate cases and those close by."""

import math

import numpy as np
import pytest
from scipy.optimize import linprog

from controllers.extremal import GAP, least_fuel, least_peak, refined
from controllers.gorelov import min_fuel, min_peak
from controllers.moment_problem import problem_of, with_ends
from controllers.moments import modes_of, targets

ASKED = {"omega": 1.0, "damping": 0.02, "duration": 8.0, "x1": 1.0}
CASES = {
    "slow": ASKED,
    "fast": {"omega": 3.0, "damping": 0.06, "duration": 20.0, "x1": 1.0},
    "rates": {"omega": 1.0, "damping": 0.02, "duration": 10.0, "x1": 1.0, "v0": 0.1, "v1": -0.05},
    "two modes": {"omega": [1.0, 2.6], "damping": [0.02, 0.2], "duration": 9.0, "x1": 1.0},
    "three modes": {
        "omega": [0.74, 2.687, 6.166], "damping": [0.01, 0.05, 0.2], "duration": 14.0,
        "x1": -0.7, "v0": 0.02,
    },
}  # fmt: skip


def given(asked):
    """Modes, T and the moments wanted."""
    modes = modes_of(asked["omega"], asked["damping"])
    ends = {"x0": 0.0, "v0": 0.0, "v1": 0.0} | {k: asked[k] for k in asked if k[0] in "xv"}
    return modes, asked["duration"], targets(modes, duration=asked["duration"], **ends)


def sampled(asked, n=40_000):
    """Moment functions at the middles of n equal cells, and the length of a cell."""
    modes, T, _ = given(asked)
    t = (np.arange(n) + 0.5) * T / n
    return t, modes.functions(T - t), T / n


# -- duality ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_the_multipliers_prove_the_peak(name):
    asked = CASES[name]
    plan = min_peak(**asked)
    _, _, c = given(asked)
    t, h, step = sampled(asked)
    values = plan.multipliers @ h
    # peak >= l . c/int |h_l| for any l; the sum of middles is off by step^2.
    assert plan.multipliers @ c / (np.abs(values).sum() * step) == pytest.approx(
        plan.peak, rel=1e-6
    )
    clear = np.abs(values) > 1e-6 * np.max(np.abs(values))
    assert np.all((np.sign(plan(t)) == np.sign(values))[clear])  # u = m sign h_l
    assert plan.residual < 1e-11


@pytest.mark.parametrize("name", CASES)
def test_the_multipliers_prove_the_fuel(name):
    asked = CASES[name]
    bound = 1.3 * min_peak(**asked).peak
    plan = min_fuel(**asked, bound=bound)
    _, _, c = given(asked)
    t, h, step = sampled(asked)
    values = plan.multipliers @ h
    excess = np.maximum(np.abs(values) - 1, 0).sum() * step
    assert plan.multipliers @ c - bound * excess == pytest.approx(plan.fuel, rel=1e-6)
    clear = np.abs(np.abs(values) - 1) > 1e-6 * np.max(np.abs(values))
    on = np.abs(values) > 1
    assert np.all((plan(t) == bound * on * np.sign(values))[clear])
    assert plan.residual < 1e-11


@pytest.mark.parametrize("name", CASES)
def test_a_control_constant_on_cells_does_no_better(name):
    """1200 cells, their moments by two-point Gauss, in the weights of the problem alone."""
    asked = CASES[name]
    modes, T, c = given(asked)
    n = 1200
    step = T / n
    offsets = step / 2 * (1 + np.array([-1, 1]) / math.sqrt(3))
    t = np.arange(n)[:, None] * step + offsets
    A = modes.functions(T - t).mean(axis=2) * step
    size = np.max(np.abs(A), axis=1)
    peak, bound = min_peak(**asked).peak, 1.3 * min_peak(**asked).peak
    A, c = A / size[:, None], c / size
    best = linprog(
        np.append(np.zeros(n), -1.0), A_eq=np.column_stack([A, -c]), b_eq=np.zeros(len(c)),
        bounds=[(-1, 1)] * n + [(None, None)],
    )  # fmt: skip
    cells = linprog(np.full(2 * n, step), A_eq=np.column_stack([A, -A]), b_eq=c, bounds=(0, bound))
    fuel = min_fuel(**asked, bound=bound).fuel
    # What the grid costs; tolerance of HiGHS and of Gauss below.
    assert -1e-6 < -1 / best.fun / peak - 1 < 1e-4
    assert -1e-6 < cells.fun / fuel - 1 < 1e-4


# -- degenerate cases ------------------------------------------------------------------------------


def test_one_switching_where_there_are_four_moments():
    """Bang-bang over two whole periods leaves nothing: m* = 4/T^2, and the Jacobian is singular."""
    for periods in (1, 2, 3):
        T = 4 * math.pi * periods
        plan = min_peak(omega=1.0, damping=0.0, duration=T, x1=1.0)
        assert plan.peak == pytest.approx(4 / T**2, rel=1e-12)
        assert plan.switch_times == pytest.approx([T / 2], abs=1e-9)
        assert plan.residual < 1e-14


@pytest.mark.parametrize("exponent", [2, 3, 4, 5, 6, 7, 8, 10, 12])
@pytest.mark.parametrize("sign", [-1, 1])
def test_close_to_the_degenerate_case(sign, exponent):
    # Pulses between those of the limit are as short as the distance from it to some power.
    T = 4 * math.pi * (1 + sign * 10.0**-exponent)
    plan = min_peak(omega=1.0, damping=0.0, duration=T, x1=1.0)
    assert plan.residual < 2e-11
    assert plan.peak >= 4 / T**2 * (1 - 2e-11)  # to the residual
    assert plan.peak == pytest.approx(4 / T**2, rel=10.0**-exponent)


@pytest.mark.parametrize("damping", [0.0, 1e-9, 1e-6])
@pytest.mark.parametrize("excess", [3e-12, 1e-10, 1e-8, 0.2])
def test_bounds_close_to_the_degenerate_case(damping, excess):
    asked = {"omega": 1.0, "damping": damping, "duration": 4 * math.pi, "x1": 1.0}
    peak = min_peak(**asked)
    assert peak.peak == pytest.approx(4 / asked["duration"] ** 2, rel=1e-10)
    plan = min_fuel(**asked, bound=peak.peak * (1 + excess))
    assert plan.residual < 1e-11
    # A rigid body needs thrust for a at either end, m0 a (T - a) = 1; the mode costs some more.
    rigid = (1 + excess) * (1 - math.sqrt(1 - 1 / (1 + excess)))
    assert rigid <= plan.fuel / peak.fuel < 1
    assert 1 - plan.fuel / peak.fuel > 0.3 * (1 - rigid)


def test_a_duration_typed_in_by_hand():
    for T in (12.56, 12.566, 12.5664, 12.56637):
        assert min_peak(omega=1.0, damping=0.0, duration=T, x1=1.0).residual < 2e-11


def test_a_constant_control_over_a_whole_period():
    T = 2 * math.pi
    plan = min_peak(omega=1.0, damping=0.0, duration=T, x1=T / 2, v1=1.0)
    assert len(plan.switch_times) == 0
    assert plan.levels == pytest.approx([1 / T])
    assert plan.residual < 1e-14


# -- bounds close to the least peak, and far -------------------------------------------------------


@pytest.mark.parametrize("name", CASES)
def test_little_more_than_the_least_peak(name):
    asked = CASES[name]
    peak = min_peak(**asked)
    saved = []
    for excess in (1e-11, 4e-11, 1e-9, 4e-9, 1e-7, 4e-7, 1e-5, 1e-4, 1e-3, 1e-2):
        plan = min_fuel(**asked, bound=peak.peak * (1 + excess))
        assert plan.residual < 1e-11
        saved.append(1 - plan.fuel / peak.fuel)
    assert np.all(np.diff(saved) > 0)
    # Pauses open as the root of the excess, to first order; there are digits for no more at 1e-11.
    assert saved[1] == pytest.approx(2 * saved[0], rel=1e-2)
    assert saved[3] == pytest.approx(2 * saved[2], rel=2e-3)


def test_little_more_than_the_least_peak_with_four_modes():
    omega = np.array([1.4139389795584567, 2.925922927995304, 5.009611269853789, 12.18049087095138])
    zeta = np.array([0.000233, 0.004153, 0.0825, 0.001466])
    asked = {
        "omega": omega, "damping": 2 * zeta * omega, "duration": 21.66292009683103,
        "x1": -0.3003, "v0": 0.00467, "v1": 0.03538,
    }  # fmt: skip
    peak = min_peak(**asked)
    plan = min_fuel(**asked, bound=peak.peak * (1 + 1e-9))
    assert plan.residual < 1e-11
    assert len(plan.switch_times) == 2 * len(peak.switch_times)


@pytest.mark.parametrize("ratio", [10, 1e2, 1e3])
def test_much_more_than_the_least_peak(ratio):
    peak = min_peak(**ASKED)
    plan = min_fuel(**ASKED, bound=ratio * peak.peak)
    # An edge is known to an ulp of T, which counts with the level.
    assert plan.residual < 1e-14 * ratio + 1e-13
    assert 0.315328 < plan.fuel < 0.315669  # impulses, and ten times the least peak


@pytest.mark.parametrize("turns", [0.02, 0.1, 0.3, 1.0])
def test_short_beside_the_period(turns):
    """As w T goes to 0 there are four integrations of u: m* w^2 T^4 = 4^3 3!, Chebyshev edges."""
    plan = min_peak(omega=turns / 7, damping=0.0, duration=7.0, x1=1.0)
    assert plan.peak * 49 * turns**2 == pytest.approx(384, rel=turns**2 / 100)
    chebyshev = 7 / 2 * (1 - np.cos(np.pi * np.array([1, 2, 3]) / 4))
    assert plan.switch_times == pytest.approx(chebyshev, abs=turns**2 / 50 + 1e-7)
    fuel = min_fuel(omega=turns / 7, damping=0.0, duration=7.0, x1=1.0, bound=2 * plan.peak)
    # An ulp of an edge counts with the level, beside the 4/T^2 of a rigid body.
    assert max(plan.residual, fuel.residual) < 1e-15 * plan.peak * 49 + 1e-12


@pytest.mark.parametrize("turns", [300.0, 3000.0])
def test_long_beside_the_period(turns):
    plan = min_peak(omega=turns / 7, damping=0.02 * turns / 7, duration=7.0, x1=1.0)
    assert 4 / 49 < plan.peak < 4 / 49 * (1 + 4 / turns)  # almost that of a rigid body
    assert plan.residual < 1e-11


def test_modes_that_hardly_differ():
    plan = min_peak(omega=[1.0, 1.001], damping=[0.01, 0.01], duration=20.0, x1=1.0)
    assert plan.residual < 1e-11
    assert plan.peak > min_peak(omega=1.0, damping=0.01, duration=20.0, x1=1.0).peak


def test_modes_that_cannot_be_told_apart_are_refused():
    with pytest.raises(ArithmeticError, match="double precision"):
        min_peak(omega=[1.0, 1.0 + 1e-14], damping=[0.0, 0.0], duration=0.01, x1=1.0)


# -- the solver itself -----------------------------------------------------------------------------


def own(asked):
    modes, T, _ = given(asked)
    ends = {"x0": 0.0, "v0": 0.0, "v1": 0.0} | {k: asked[k] for k in asked if k[0] in "xv"}
    return problem_of(modes, duration=T, **ends)


def test_bounds_meet():
    for asked in CASES.values():
        problem = own(asked)
        peak = least_peak(problem)
        assert peak.gap < GAP
        assert peak.cost == peak.peak
        fuel = least_fuel(problem, 1.3 * peak.peak, peak=peak)
        assert fuel.gap < GAP
        lengths = np.diff(with_ends(fuel.edges))
        assert fuel.cost == pytest.approx(fuel.peak * (lengths @ np.abs(fuel.pattern)))


def test_a_start_from_a_neighbour_leads_to_the_same_optimum():
    near = least_peak(own(ASKED))
    problem = own(ASKED | {"duration": 8.2})
    warm, cold = least_peak(problem, near=near), least_peak(problem)
    assert warm.peak == pytest.approx(cold.peak, rel=1e-12)
    assert warm.edges == pytest.approx(cold.edges, abs=1e-10)
    far = least_peak(own(ASKED | {"duration": 30.0}), near=near)  # no use, but no harm
    assert far.gap < GAP


def test_grids_are_refined_where_it_is_asked():
    nodes = np.linspace(0, 1, 11)
    finer = refined(nodes, np.array([0.33, 0.33 + 1e-12, 0.0, 1.0]))
    assert set(nodes.tolist()) <= set(finer.tolist())
    assert np.min(np.diff(finer)) > 1e-7
    assert np.sum((finer > 0.3 + 1e-9) & (finer < 0.4 - 1e-9)) == 4
