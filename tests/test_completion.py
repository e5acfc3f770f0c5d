"""Controls whose moments are brought right by their edges, and by short pulses."""

import math

import numpy as np
import pytest

from controllers.completion import RESIDUAL, completed, has_moments
from controllers.extremal import least_peak
from controllers.moment_problem import problem_of, with_ends
from controllers.moments import modes_of

PROBLEM = problem_of(modes_of(1.0, 0.02), duration=8.0, x0=0.0, v0=0.0, x1=1.0, v1=0.0)


def test_edges_alone_where_there_are_enough():
    best = least_peak(PROBLEM)
    levels = 1.1 * best.peak * best.pattern
    edges, after = completed(PROBLEM, best.edges, levels, (-1.0, 1.0), best.multipliers)
    # Three edges cannot make good for a wrong level; the moments stay off.
    assert not has_moments(PROBLEM, edges, after)
    moved = best.edges + np.array([1e-4, -2e-4, 1e-4])
    levels = best.peak * best.pattern
    edges, after = completed(PROBLEM, moved, levels, tuple(np.unique(levels)), best.multipliers)
    assert has_moments(PROBLEM, edges, after)
    # Four moments for three edges: the pulses that were added sum up to rounding.
    assert np.interp(best.edges, edges, edges) == pytest.approx(best.edges, abs=1e-8)


def test_pulses_where_one_edge_faces_four_moments():
    T = 4 * math.pi * (1 + 1e-5)
    problem = problem_of(modes_of(1.0, 0.0), duration=T, x0=0.0, v0=0.0, x1=1.0, v1=0.0)
    size = 4 / (problem.unit * T**2)
    multipliers = least_peak(problem).multipliers
    edges, levels = np.array([0.5]), np.array([-size, size])
    assert problem.error(edges, levels) > 1e3 * RESIDUAL
    edges, levels = completed(problem, edges, levels, (-size, size), multipliers)
    assert has_moments(problem, edges, levels)
    assert len(edges) > 1
    assert np.max(np.abs(levels)) == pytest.approx(size, rel=1e-5)
    short = np.diff(with_ends(edges)) < 1e-6
    assert np.any(short)  # the pulses


def test_a_control_far_off_is_left_alone():
    edges, levels = completed(
        PROBLEM, np.array([0.5]), np.array([-1.0, 1.0]), (-1.0, 1.0), PROBLEM.target
    )
    assert len(edges) == 1
    assert not has_moments(PROBLEM, edges, levels)


def test_edges_out_of_order_have_no_moments():
    assert not has_moments(PROBLEM, np.array([0.6, 0.4]), np.array([1.0, -1.0, 1.0]))
    assert not has_moments(PROBLEM, np.array([-0.1]), np.array([1.0, -1.0]))
