"""Where a function first falls to zero: smooth, kinked, flat and then kinked, foreseen, dipping."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacecraft_sim.crossing import WIDTH, first_not_positive, foreseen, suspected_dip

FUNCTIONS = {
    "line": (lambda t: 0.3 - t, 0.3),
    "parabola": (lambda t: 0.09 - t * t, 0.3),
    "kink": (lambda t: 1 - t if t < 0.29 else 0.71 - 71 * (t - 0.29), 0.3),
    # Flat at a rounding of zero, as the distance to a line along which the state slides.
    "flat, then a kink": (lambda t: 1e-12 if t < 0.3 else 1e-12 - (t - 0.3), 0.3),
    "jump": (lambda t: 1.0 if t < 0.3 else -1.0, 0.3),
    "root of third order": (lambda t: (0.3 - t) ** 3, 0.3),
}


@pytest.mark.parametrize("name", FUNCTIONS)
def test_a_sign_change_is_narrowed_from_the_side_that_is_not_positive(name):
    function, root = FUNCTIONS[name]
    calls = []

    def counted(t):
        calls.append(t)
        return function(t)

    t, value = first_not_positive(counted, [(0.0, function(0.0)), (1.0, function(1.0))])
    assert value <= 0
    # A root of third order is flat: within the width by its chord alone.
    assert root - 1e-15 <= t <= root + (1e-3 if "third" in name else 2 * WIDTH)
    assert len(calls) < 80  # every second step halves the bracket, at 1e-11 of 1: 37 of them


@given(st.floats(0.01, 0.99), st.floats(-5, 5), st.floats(0.1, 5))
def test_a_crossing_of_a_cubic_is_foreseen_from_four_points(root, bend, slope):
    def cubic(t):
        return (root - t) * (slope + bend**2 * (t - root) ** 2)

    step = root / 8
    points = [(t, cubic(t)) for t in (0.0, step, 2 * step, 3 * step)]
    found = foreseen(points)
    assert found >= points[-1][0]
    if abs(bend) < 0.5:  # then the parabola through the last points has its root near that
        # Two of Newton's steps on the cubic, short of its root by 3e-5 of the way.
        ahead = root - points[-1][0]
        assert found == pytest.approx(root - 3e-5 * ahead, abs=1e-7 + 1e-12)


def test_nothing_is_foreseen_of_a_function_that_rises():
    assert foreseen([(0.0, 1.0), (0.1, 1.1), (0.2, 1.3)]) == math.inf
    assert foreseen([(0.0, 1.0), (0.1, 0.9)]) == math.inf  # too little is known


def test_a_dip_between_positive_ends_is_suspected_where_the_parabola_dips():
    points = [(t, (t - 0.4) ** 2 - 0.001) for t in (0.0, 0.3, 0.6)]
    assert suspected_dip(points) == pytest.approx(0.4)
    assert suspected_dip([(0.0, 1.0), (0.3, 0.9), (0.6, 0.85)]) is None  # nowhere near zero


@pytest.mark.parametrize("start", [0.0, 1e3, 65536.3, 1e7])
@pytest.mark.parametrize("span", [1e-11, 1e-9, 1e-3])
def test_a_crossing_is_never_foreseen_at_the_instant_itself(start, span):
    step = max(span, 8 * math.ulp(start))
    times = [start + k * step for k in range(4)]
    for values in ([3.0, 2.0, 1.0, 1e-12], [1.0, 0.5, 0.2, 1e-18], [4.0, 2.5, 1.2, 0.1]):
        ahead = foreseen(list(zip(times, values, strict=True)))
        assert ahead > times[-1]
