"""Total variation of damped sums: closed forms, brute force, awkward eigenvalues."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacecraft_sim.total_variation import total_variation


def one_mode(x, a):
    """Of Re a e^(x t), Im x > 0: the half periods shrink as a geometric series."""
    rate = a * x
    first = ((np.pi / 2 - np.angle(rate)) % np.pi) / x.imag

    def f(t):
        return (a * np.exp(x * t)).real

    swing = abs(f(first + np.pi / x.imag) - f(first))
    return abs(f(first) - f(0)) + swing / (1 - np.exp(x.real * np.pi / x.imag))


def brute(x, a, *, end, points=1_000_000):
    t = np.linspace(0, end, points)
    f = sum((w * np.exp(z * t)).real for z, w in zip(x, a, strict=True))
    return np.abs(np.diff(f)).sum()


@given(st.floats(2e-3, 3.0), st.floats(0.01, 50.0), st.floats(0, 6.3), st.floats(1e-6, 1e6))
@settings(max_examples=50)
def test_one_mode_is_the_closed_form(damping, frequency, phase, size):
    x, a = frequency * (-damping + 1j), size * np.exp(1j * phase)
    found = total_variation(np.array([x]), np.array([a]))
    # From above, to the 1e-9 of the interpolant and a few parts in 1e10 of what fades out.
    exact = one_mode(x, a)
    assert exact * (1 - 1e-13) <= found <= exact * (1 + 3e-9)


def test_a_real_eigenvalue_varies_by_its_amplitude():
    found = total_variation(np.array([-3.0 + 0j, -0.2]), np.array([[2.0, 0.0], [0.0, -5.0]]))
    assert found == pytest.approx([2.0, 5.0], rel=1e-9)


@pytest.mark.parametrize("seed", range(6))
def test_several_modes_are_what_a_dense_grid_gives(seed):
    rng = np.random.default_rng(seed)
    x = rng.uniform(0.3, 5.0, 4) * (1j - rng.uniform(0.05, 0.5, 4))
    x[3] = x[3].real
    a = rng.normal(size=4) + 1j * rng.normal(size=4)
    found = float(total_variation(x, a))
    end = 40 / np.min(-x.real)
    # A grid misses (omega step)^2/8 of each extremum, from below.
    dense = brute(x, a, end=end)
    assert dense <= found * (1 + 1e-13)
    assert found == pytest.approx(dense, rel=1e-8 + 2 * (5 * end / 1e6) ** 2)


@pytest.mark.parametrize("depth", [1e-5, 1e-4, 1e-3, 1e-2])
def test_two_extrema_within_a_step_are_found(depth):
    # f' = e^(-t/50) (cos t - 1 + depth): above zero for a moment once a period, 0.009 to 0.28 rad.
    x = np.array([-0.02 + 0j, -0.02 + 1j])
    a = np.array([-(1 - depth), 1.0]) / x
    half = np.arccos(1 - depth)
    turns = 2 * np.pi * np.arange(1, 300)
    extrema = np.sort(np.r_[0.0, half, turns - half, turns + half])
    f = sum((w * np.exp(z * extrema)).real for z, w in zip(x, a, strict=True))
    exact = np.abs(np.diff(f)).sum()
    # To the interpolant; a moment that is missed takes 4/3 depth sqrt(2 depth) of its 2 pi.
    assert float(total_variation(x, a)) == pytest.approx(exact, rel=3e-9)
    assert np.abs(f[-1]) < 1e-14


def test_critical_damping_is_the_limit_of_both_sides():
    # (1 + t) e^-t as two exponentials whose amplitudes run away; it falls from 1 to 0.
    for apart in (1e-3, 1e-5, 1e-3j, 1e-5j):
        x = np.array([-1 - apart, -1 + apart])
        a = np.array([(x[1]) / (x[1] - x[0]), -x[0] / (x[1] - x[0])])
        if isinstance(apart, complex):
            x, a = x[1:], 2 * a[1:]
        # Cancellation of amplitudes of 1/apart.
        assert float(total_variation(x, a)) == pytest.approx(1.0, abs=1e-13 / abs(apart) + 2e-9)


def test_stiff_and_slow_modes_together():
    x = np.array([-0.01 + 1.0j, -300 + 2000j, -5e4 + 0j])
    a = np.array([1.0, 0.3, 0.2 + 0j])
    found = float(total_variation(x, a))
    # The fast ones are gone before the slow one has moved: apart to the ratio of their times.
    apart = one_mode(x[0], 1.0 + 0j) + one_mode(x[1], 0.3 + 0j) + 0.2
    assert found == pytest.approx(apart, rel=1e-3)


def test_hardly_damped_modes_are_bounded_from_above():
    x = np.array([-1e-7 + 1.0j, -0.5 + 40j])
    found = float(total_variation(x, np.array([1.0, 1e-3])))
    slow = one_mode(x[0], 1.0)
    # Beyond the budget the mode counts with |a lambda|/sigma, pi/2 times its variation.
    assert slow < found < np.pi / 2 * slow * 1.01


def test_nothing_varies_by_nothing():
    assert total_variation(np.array([-1 + 1j]), np.zeros((1, 2, 3))).tolist() == [[0] * 3] * 2
