"""The linear programs that Newton's method starts from."""

import numpy as np
import pytest

from controllers.extremal import least_fuel, least_peak
from controllers.extremal_lp import least_fuel_guess, least_peak_guess, one_signed_guess, solved
from controllers.gorelov import min_peak
from controllers.moment_problem import problem_of, with_ends
from controllers.moments import modes_of

REST = problem_of(modes_of(1.0, 0.02), duration=8.0, x0=0.0, v0=0.0, x1=1.0, v1=0.0)
SPIN = problem_of(modes_of(1.0, 0.02), duration=10.0, x0=0.0, v0=0.0, x1=1.0, v1=0.2)
NODES = np.linspace(0, 1, 201)


def moments(problem, guess):
    return guess.peak * problem.of_switched(guess.edges, guess.pattern)


def test_a_grid_costs_peak_and_gives_multipliers():
    exact = least_peak(REST)
    rough = least_peak_guess(REST, NODES)
    # A cell in two hundred, to the second power, for two roundings of edges that matter.
    assert exact.peak < rough.peak < exact.peak * (1 + 1e-3)
    assert rough.multipliers @ REST.target == pytest.approx(1)
    scaled = exact.multipliers / (exact.multipliers @ REST.target)
    assert rough.multipliers == pytest.approx(scaled, abs=0.02)
    assert moments(REST, rough) == pytest.approx(REST.target, abs=1e-3)  # switched inside cells


def test_the_edges_as_nodes_give_the_optimum():
    exact = least_peak(REST)
    rough = least_peak_guess(REST, np.union1d(NODES, exact.edges))
    assert rough.peak == pytest.approx(exact.peak, rel=1e-9)  # tolerance of HiGHS
    assert rough.edges == pytest.approx(exact.edges, abs=1e-9)


def test_fuel_on_a_grid():
    peak = least_peak(REST)
    exact = least_fuel(REST, 1.5 * peak.peak, peak=peak)
    rough = least_fuel_guess(REST, 1.5 * peak.peak, NODES)
    fuel = rough.peak * (np.diff(with_ends(rough.edges)) @ np.abs(rough.pattern))
    # Cells between levels are switched inside, with the same fuel.
    assert exact.cost < fuel < exact.cost * (1 + 1e-3)
    assert set(rough.pattern) <= {-1.0, 0.0, 1.0}
    assert rough.edges == pytest.approx(exact.edges, abs=1 / 200)


def test_one_sign_on_a_grid():
    bound = 1.5 * least_peak(SPIN).peak
    rough = one_signed_guess(SPIN, bound, NODES)
    assert set(rough.pattern) == {0.0, 1.0}
    assert moments(SPIN, rough) == pytest.approx(SPIN.target, abs=1e-3)
    fuel = SPIN.unit * SPIN.duration * bound * (np.diff(with_ends(rough.edges)) @ rough.pattern)
    assert fuel == pytest.approx(0.2, rel=1e-9)  # |c_2|; tolerance of HiGHS


def test_a_bound_that_no_control_keeps():
    with pytest.raises(ArithmeticError, match="infeasible"):
        least_fuel_guess(REST, 0.9 * min_peak(**{
            "omega": 1.0, "damping": 0.02, "duration": 8.0, "x1": 1.0,
        }).peak / REST.unit, NODES)  # fmt: skip


def test_dual_values_are_rates_of_the_cost():
    cost, equations = np.array([1.0, 2.0]), np.array([[1.0, 1.0]])
    low, high = np.zeros(2), np.array([1.0, 5.0])
    x, dual = solved(cost=cost, equations=equations, right=np.array([3.0]), low=low, high=high)
    assert x == pytest.approx([1, 2])
    assert dual == pytest.approx([2])
