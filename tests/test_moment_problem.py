"""Orthonormal moment functions, units and conversions of a manoeuvre's own problem."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.moment_problem import crossings, problem_of, with_ends
from controllers.moments import gram, modes_of, quadrature
from spacecraft_sim.curve import Curve

ENDS = {"x0": 0.2, "v0": 0.1, "x1": 1.5, "v1": -0.05}
MODES = [
    ((1.0,), (0.02,), 8.0),  # faster than 4 rad in the manoeuvre: h_3, h_4 themselves
    ((1.0,), (0.1,), 1.0),  # slower: their responses
    ((0.3, 2.0), (0.0, 0.5), 3.0),  # one of each
]


@pytest.mark.parametrize(("omega", "damping", "T"), MODES)
def test_functions_are_orthonormal_and_span_the_moment_functions(omega, damping, T):
    problem = problem_of(modes_of(omega, damping), duration=T, **ENDS)
    s, weights = quadrature(problem.modes, 1.0)
    q = problem.functions(s)
    # Rounding times the condition of the functions, here up to some 1e4.
    assert (q * weights) @ q.T == pytest.approx(np.eye(len(q)), abs=1e-11)
    own = np.arange(1.0, len(q) + 1)
    lam = problem.multipliers(own)
    h = modes_of(omega, damping).functions(T * s)
    assert lam @ h == pytest.approx(own @ q, abs=1e-9)
    assert problem.curve(own)(0.37)[0] == pytest.approx(own @ problem.functions(0.37), abs=1e-9)
    one = problem.constant(2.5)
    assert one @ q == pytest.approx(2.5, abs=1e-11)


@pytest.mark.parametrize(("omega", "damping", "T"), MODES)
def test_slopes_and_integrals(omega, damping, T):
    problem = problem_of(modes_of(omega, damping), duration=T, **ENDS)
    s, d = np.linspace(0.1, 0.9, 5), 1e-5
    rate = (problem.functions(s + d) - problem.functions(s - d)) / (2 * d)
    assert rate == pytest.approx(problem.slopes(s), abs=1e-5)  # d^2 and eps/d of values up to 1e3
    grown = (problem.integrals(s + d) - problem.integrals(s - d)) / (2 * d)
    assert grown == pytest.approx(problem.functions(s), abs=1e-5)
    assert problem.integrals(0.0) == pytest.approx(0, abs=1e-15)


@pytest.mark.parametrize(("omega", "damping", "T"), MODES)
def test_units(omega, damping, T):
    modes = modes_of(omega, damping)
    problem = problem_of(modes, duration=T, **ENDS)
    c = np.zeros(2 + 2 * len(omega))
    c[:2] = 1.5 - 0.2 - T * 0.1, -0.15
    energy = c @ np.linalg.solve(gram(modes, T), c)
    # The Gram matrix has the square of the condition of the functions.
    assert problem.unit == pytest.approx(np.sqrt(energy / T), rel=1e-7)
    assert np.linalg.norm(problem.target) == pytest.approx(1)
    assert problem.unit * problem.moments[:2] == pytest.approx(c[:2] / [T * T, T])


def test_moments_and_their_errors():
    problem = problem_of(modes_of(1.0, 0.02), duration=8.0, **ENDS)
    edges, levels = np.array([0.2, 0.7]), np.array([1.0, -0.5, 2.0])
    s, weights = quadrature(problem.modes, 1.0)
    exact = np.diff(problem.integrals(with_ends(edges))) @ levels
    assert problem.of_switched(edges, levels) == pytest.approx(exact, abs=1e-14)
    assert problem.defect(edges, levels, 0.3) == pytest.approx(
        exact - 0.3 * problem.target, abs=1e-13
    )
    assert problem.excess(s, weights * (problem.target @ problem.functions(s))) == pytest.approx(
        0, abs=1e-12
    )
    assert problem.error(edges, levels) > 0.1
    assert 0 < problem.noise(1.0) < 1e-12


def test_a_shifted_problem():
    problem = problem_of(modes_of(1.0, 0.02), duration=8.0, **ENDS)
    edges, levels = np.array([0.2, 0.7]), np.array([1.0, -0.5, 2.0])
    other = problem.shifted(sign=-1.0, offset=0.4)
    size = other.unit / problem.unit
    # If u misses c by d, -u - 0.4 misses what is asked of it by -d.
    got = other.defect(edges, (-levels - 0.4) / size)
    assert size * got == pytest.approx(-problem.defect(edges, levels), abs=1e-13)
    assert np.linalg.norm(other.target) == pytest.approx(1)


# -- crossings -------------------------------------------------------------------------------------


@settings(max_examples=50)
@given(st.lists(st.floats(-2, 2), min_size=6, max_size=6), st.floats(3.0, 40.0), st.floats(0, 0.3))
def test_no_crossing_is_missed(multipliers, w, zeta):
    modes = modes_of([w, 2.3 * w], [2 * zeta * w, 0.1 * w])
    curve = modes.curve(np.array(multipliers))
    edges, e = crossings(curve, (-1.0, 1.0), (-1.0, 0.0, 1.0))
    assert len(e) == len(edges) + 1
    assert np.all(np.diff(with_ends(edges)) >= 0)
    s = np.linspace(0, 1, 20_001)
    h = np.array(multipliers) @ modes.functions(s)
    cell = (h > 1).astype(float) - (h < -1)
    clear = np.min(np.abs(s[:, None] - with_ends(edges)), axis=1) > 1e-6
    touching = np.abs(np.abs(h) - 1) < 1e-9
    expected = e[np.searchsorted(edges, s)]
    assert np.all((expected == cell)[clear & ~touching])


def test_close_pairs_are_found():
    gap = 1e-5
    curve = Curve(0.25 - gap**2, -1.0, 1.0, [])  # (s - 1/2)^2 - gap^2
    edges, e = crossings(curve, (0.0,), (-1.0, 1.0))
    assert edges == pytest.approx([0.5 - gap, 0.5 + gap], abs=1e-10)  # eps/(2 gap)
    assert e.tolist() == [1.0, -1.0, 1.0]


def test_rounding_errors_about_a_threshold_are_no_crossings():
    flat = Curve(-1.0, 0.0, 0.0, [(1e-9j, 0.5)])  # cos(1e-9 s) - 1: zero to all digits
    with pytest.raises(ArithmeticError, match=r"crosses \(0.0,\) more than 100 times"):
        crossings(flat, (0.0,), (-1.0, 1.0))
