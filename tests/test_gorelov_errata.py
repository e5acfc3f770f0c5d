"""The misprints of Gorelov (1999), listed in controllers/ERRATA.md.

Each test shows that the corrected statement holds and that the printed one does not.

Yu. N. Gorelov, "Synthesis of null-finite optimal control for a double integrator with an attached
oscillator by the method of moments" (in Russian).
"""

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from controllers.gorelov import min_energy, min_fuel, min_peak
from controllers.impulse_limit import impulse_limit
from controllers.moments import gram, modes_of
from controllers.plans import SwitchedPlan

G2 = {"omega": 1.0, "damping": 0.02, "duration": 8.0, "x1": 1.0}
SPIN = {"omega": 1.0, "damping": 0.02, "duration": 10.0}


def least_error(multipliers, *, bound, cells):
    """Least error of the moments of u = m0 sign h_l where |h_l| >= h*, over h*, and that h*.

    Sampled at the middles of cells; each h* adds a cell to those that are on.
    """
    t = (np.arange(cells) + 0.5) * 8.0 / cells
    h = modes_of(1.0, 0.02).functions(8.0 - t)
    values = multipliers @ h
    order = np.argsort(-np.abs(values))
    moments = np.cumsum((h * np.sign(values))[:, order], axis=1) * bound * 8.0 / cells
    errors = np.linalg.norm(moments - np.array([[1.0], [0], [0], [0]]), axis=0)
    return errors.min(), np.abs(values)[order][np.argmin(errors)]


def test_g1_the_third_moment_is_y_and_not_beta_y():
    """(8): c_3 = beta y(T) is printed; h_3 of (9) has the 1/beta already."""
    w, b, T = 2.0, 0.1, 6.0
    levels = np.array([1.0, -0.4, 0.3, -1.2, 0.8, 0.5])
    plan = SwitchedPlan(
        duration=T, switch_times=np.arange(1.0, 6.0), levels=levels, residual=math.nan
    )
    state = np.zeros(2)
    for k, u in enumerate(levels):
        leg = solve_ivp(
            lambda t, y, u=u: [y[1], u - b * y[1] - w * w * y[0]], (k, k + 1.0), state,
            method="DOP853", rtol=1e-12, atol=1e-14,
        )  # fmt: skip
        state = leg.y[:, -1]
    third, fourth = plan.moments(modes_of(w, b))[2:]
    assert third == pytest.approx(state[0], abs=1e-11)  # tolerance of the integration
    assert fourth == pytest.approx(state[1], abs=1e-11)
    beta = math.sqrt(w * w - b * b / 4)
    assert abs(third - beta * state[0]) > 0.4 * abs(state[0])


def test_g2_rho_is_the_inverse_of_the_least_norm():
    """After (12), p = 2: rho_0 = sqrt(c G^-1 c) is printed, which is 1/rho_0."""
    c, G = np.array([1.0, 0, 0, 0]), gram(modes_of(1.0, 0.02), 8.0)
    printed = math.sqrt(c @ np.linalg.solve(G, c))
    assert printed == pytest.approx(0.1607428083, abs=1e-10)
    assert min_energy(**G2).energy == pytest.approx(printed, rel=1e-11)
    # (11): the least |h| on l . c = 1; no random l comes below 1/printed, and all above printed.
    random = np.random.default_rng(2).normal(size=(2000, 4))
    random[:, 0] = 1
    norms = np.sqrt(np.einsum("ij,jk,ik->i", random, G, random))
    assert norms.min() >= 1 / printed > printed
    best = np.linalg.solve(G, c)
    best /= best @ c
    assert math.sqrt(best @ G @ best) == pytest.approx(6.2211181343, abs=1e-9)


def test_g4_with_a_bound_the_multipliers_are_others():
    """After (12), p = infinity: u = m0 psi_0 sign h_0 is printed with the h_0 of (11)."""
    peak = min_peak(**G2)
    bound = 1.5 * peak.peak
    right = min_fuel(**G2, bound=bound)
    assert right.residual < 1e-13
    for multipliers in (impulse_limit(**G2).multipliers, peak.multipliers):  # p = infinity, p = 1
        error, _ = least_error(multipliers, bound=bound, cells=20_000)
        assert 0.07 < error < 0.09  # of a turn of 1 rad
    error, threshold = least_error(right.multipliers, bound=bound, cells=20_000)
    assert error < 1e-4  # a cell of 0.4 ms at each of six edges
    assert threshold == pytest.approx(1, abs=1e-3)  # and not in between


@pytest.mark.parametrize("turn", [1.0, -1.0])
@pytest.mark.parametrize(("ratio", "distance"), [(1.5, 0.03), (4, 0.1)])
def test_g5_the_optimal_function_may_be_constant(turn, ratio, distance):
    """The rule for u_0 takes h_0 not to be constant; for spin-ups it is, and fixes nothing."""
    ends = {"x1": turn * 1.0, "v1": turn * 0.2}
    bound = ratio * min_peak(**SPIN, **ends).peak
    plan = min_fuel(**SPIN, **ends, bound=bound)
    assert not plan.normal
    assert plan.fuel == pytest.approx(0.2, rel=1e-11)
    modes = modes_of(1.0, 0.02)
    h = plan.multipliers @ modes.functions(np.linspace(0, 10, 11))
    assert h == pytest.approx(turn, abs=1e-10)
    # Another control, soft, with the same moments and fuel, within the same bound.
    other = min_fuel(**SPIN, **ends, bound=1.2 * bound / ratio)
    assert other.fuel == pytest.approx(0.2, rel=1e-11)
    assert other.moments(modes) == pytest.approx(plan.moments(modes), abs=1e-13)
    t = np.linspace(0, 10, 20_001)
    assert math.sqrt(np.trapezoid((plan(t) - other(t)) ** 2, t)) > distance
