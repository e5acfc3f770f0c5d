"""Moment functions against the equations they solve, series against arbitrary precision."""

import math

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad

from controllers.moments import (
    gram,
    modes_of,
    quadrature,
    share,
    switched_moments,
    targets,
)

FREQUENCIES = st.floats(0.05, 30)
RATIOS = st.one_of(st.just(0.0), st.floats(1e-4, 0.95))


def precise_step(w, b, s):
    """Response of a mode to a step with 60 digits: (1 - h_4 - b h_3)/w^2."""
    with mpmath.workdps(60):
        w, b, s = mpmath.mpf(w), mpmath.mpf(b), mpmath.mpf(s)
        alpha = -b / 2
        beta = mpmath.sqrt(w**2 - alpha**2)
        h3 = mpmath.exp(alpha * s) * mpmath.sin(beta * s) / beta
        h4 = alpha * h3 + mpmath.exp(alpha * s) * mpmath.cos(beta * s)
        return float((1 - h4 - b * h3) / w**2)


# -- functions -----------------------------------------------------------------------------------


@settings(max_examples=30)
@given(FREQUENCIES, RATIOS)
def test_the_functions_of_a_mode_solve_its_equation(w, zeta):
    modes = modes_of(w, 2 * zeta * w)
    b, s, d = 2 * zeta * w, np.linspace(0.1, 5, 7) / w, 1e-3 / w
    h3, h4 = modes.functions(s)[2:]
    before, after = modes.functions(s - d)[2:], modes.functions(s + d)[2:]
    rates = (after - before) / (2 * d)
    # Central differences: (w d)^2/6 of the third derivative, and rounding over d.
    assert rates[0] == pytest.approx(h4, abs=1e-6)
    assert rates[1] == pytest.approx(-b * h4 - w * w * h3, abs=1e-5 * w)
    assert modes.functions(0.0) == pytest.approx([0, 1, 0, 1])


@settings(max_examples=25)
@given(FREQUENCIES, RATIOS, st.floats(0.01, 10))
def test_integrals_are_integrals(w, zeta, s):
    modes = modes_of(w, 2 * zeta * w)
    exact = [
        quad(lambda x, k=k: modes.functions(x)[k], 0, s, limit=400, epsabs=1e-13, epsrel=1e-12)[0]
        for k in range(4)
    ]
    # The quadrature's own tolerance over a few hundred panels.
    assert modes.integrals(s) == pytest.approx(exact, abs=1e-11, rel=1e-10)


@settings(max_examples=40)
@given(FREQUENCIES, RATIOS, st.floats(1e-6, 8))
def test_integrals_keep_their_digits_however_slow_the_mode(w, zeta, turns):
    s = turns / w
    got = modes_of(w, 2 * zeta * w).integrals(np.array([s / 9, s]))[2]
    # Near critical damping sin(beta s)/beta loses w/beta digits.
    for x, value in zip((s / 9, s), got, strict=True):
        limit = 1e-14 * min(x, 1 / w) ** 2 / math.sqrt(1 - zeta**2)
        if turns > 4:
            limit = 1e-14 / w**2 / math.sqrt(1 - zeta**2)  # small beside the rest
        assert abs(value - precise_step(w, 2 * zeta * w, x)) <= limit


def test_series_and_closed_form_meet():
    modes = modes_of(1.0, 0.3)
    y = modes.integrals(np.array([1 - 1e-12, 1 + 1e-12]))[2]  # w s = 1, where one takes over
    assert y[0] == pytest.approx(y[1], rel=1e-11)  # a rate of order one over 2e-12


def test_curves_are_the_same_functions():
    modes = modes_of([1.0, 2.7], [0.02, 0.3])
    multipliers = np.array([0.3, -1.0, 2.0, 0.7, -0.4, 0.9])
    curve, total = modes.curve(multipliers), modes.integral_curve(multipliers)
    for s in (0.0, 0.4, 3.3, 20.0):
        assert curve(s)[0] == pytest.approx(multipliers @ modes.functions(s), abs=1e-13)
        assert total(s)[0] == pytest.approx(multipliers @ modes.integrals(s), abs=1e-12)
        assert total(s)[1] == pytest.approx(curve(s)[0], abs=1e-13)


# -- Gram matrix (Gorelov, after (10)) -------------------------------------------------------------


def test_gram_matrix():
    G = gram(modes_of(1, 0.02), 8.0)
    # Reference figures, to 1e-12 of their size.
    assert G[0, 2] == pytest.approx(1.9344019918363, abs=1e-12)
    assert G[0, 3] == pytest.approx(6.1823225526757, abs=1e-12)
    assert G[2, 3] == pytest.approx(0.4171425589608, abs=1e-12)
    assert np.linalg.det(gram(modes_of(2, 0.1), 6.0)[:2, :2]) == pytest.approx(108, rel=1e-12)


@settings(max_examples=30)
@given(FREQUENCIES, RATIOS, st.floats(0.1, 30))
def test_gram_matrix_in_closed_form(w, zeta, T):
    modes = modes_of(w, 2 * zeta * w)
    G = gram(modes, T)
    h3, _ = modes.functions(T)[2:]
    # h_3 h_4 is the derivative of h_3^2/2; int s h_4 by parts; det H_11 = T^4/12.
    assert G[2, 3] == pytest.approx(h3**2 / 2, abs=1e-12 / w)
    assert G[0, 3] == pytest.approx(T * h3 - modes.integrals(T)[2], abs=1e-11 * T / w)
    assert np.linalg.det(G[:2, :2]) == pytest.approx(T**4 / 12, rel=1e-10)
    assert np.allclose(G, G.T, rtol=1e-13)


def test_quadrature_is_exact_for_fast_modes():
    modes = modes_of(200.0, 0.0)
    s, weights = quadrature(modes, 10.0)
    # int sin^2 = T/2 - sin(2 w T)/(4 w); rounding of some 7000 terms.
    exact = 5.0 - math.sin(4000.0) / 800
    assert weights @ np.sin(200 * s) ** 2 == pytest.approx(exact, abs=1e-12)


# -- moments ---------------------------------------------------------------------------------------


def test_moments_of_a_switched_control_are_its_integrals():
    modes = modes_of([1.3, 4.0], [0.1, 0.05])
    edges, levels = np.array([0.0, 0.4, 1.7, 2.0, 5.0]), np.array([1.0, -2.0, 0.0, 0.7])
    got = switched_moments(modes, edges=edges, levels=levels)
    for k in range(6):
        pieces = zip(edges, edges[1:], levels, strict=False)
        exact = sum(u * quad(lambda x, k=k: modes.functions(x)[k], a, b)[0] for a, b, u in pieces)
        assert got[k] == pytest.approx(exact, abs=1e-12)  # of the quadrature


def test_targets():
    c = targets(modes_of([1.0, 2.0], [0.0, 0.1]), duration=10.0, x0=0.5, v0=0.2, x1=1.5, v1=0.05)
    assert c == pytest.approx([1.5 - 0.5 - 2.0, -0.15, 0, 0, 0, 0])


def test_share_of_the_manoeuvre():
    modes = modes_of(2.0, 0.1)
    c = targets(modes, duration=5.0, x0=0.0, v0=0.0, x1=3.0, v1=0.0)
    unit = 3.0 / 25  # the level that goes half of the way in T
    assert share(modes, np.array([0.3, 0, 0, 0]), c, 5.0) == pytest.approx(0.1)
    assert share(modes, np.array([0, 0.1, 0, 0]), c, 5.0) == pytest.approx(0.1 / (5 * unit))
    assert share(modes, np.array([0, 0, 0.1, 0]), c, 5.0) == pytest.approx(0.1 * 4 / unit)
    assert share(modes, np.array([0, 0, 0, 0.1]), c, 5.0) == pytest.approx(0.1 * 2 / unit)


# -- bad input -------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("omega", "damping", "words"),
    [
        (1.0, 2.0, "mode 0 is not underdamped"),
        ([3.0, 1.0], [0.1, 2.5], "mode 1 is not underdamped: omega = 1.0 .* damping below 2 1/s"),
        (0.0, 0.0, "omega = 0.0"),
        (-1.0, 0.0, "omega = -1.0"),
        (math.nan, 0.0, "omega = nan"),
        (1.0, math.inf, "damping = inf"),
        (1.0, -0.1, "damping = -0.1"),
        ([1.0, 2.0], [0.1], "omega has 2 values and damping 1"),
        ([], [], "there must be a mode"),
        ([1.0, 2.0, 1.0], [0.1, 0.1, 0.1], "given 2 times"),
    ],
)
def test_modes_that_are_none(omega, damping, words):
    with pytest.raises(ValueError, match=words):
        modes_of(omega, damping)


@pytest.mark.parametrize("duration", [0.0, -1.0, math.nan, math.inf])
def test_durations_that_are_none(duration):
    with pytest.raises(ValueError, match="duration"):
        targets(modes_of(1, 0), duration=duration, x0=0, v0=0, x1=1, v1=0)


def test_empty_manoeuvres():
    modes = modes_of(1, 0)
    for ends in (
        {"x0": 0.3, "v0": 0.0, "x1": 0.3, "v1": 0.0},
        {"x0": 0.1, "v0": 0.1, "x1": 0.4, "v1": 0.1},
        {"x0": 0.3, "v0": 0.7, "x1": 2.4, "v1": 0.7},  # coasting, 4e-16 off
    ):
        with pytest.raises(ValueError, match="the manoeuvre is empty"):
            targets(modes, duration=3.0, **ends)
    assert np.any(targets(modes, duration=3.0, x0=0.0, v0=0.0, x1=1e-12, v1=0.0))


def test_ends_that_are_not_finite():
    with pytest.raises(ValueError, match="x1 = inf, v1 = nan"):
        targets(modes_of(1, 0), duration=1.0, x0=0.0, v0=0.0, x1=math.inf, v1=math.nan)
