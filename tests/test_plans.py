"""Plans: values, norms and moments against integration of the equations of motion."""

import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from controllers.gorelov import min_energy, min_peak
from controllers.moments import modes_of
from controllers.plans import SwitchedPlan, read_only, residual_vibration

PLAN = SwitchedPlan(
    duration=6.0,
    switch_times=np.array([1.0, 2.5, 4.0]),
    levels=np.array([2.0, 0.0, -1.0, 0.5]),
    residual=0.0,
)


def flown(plan, *, omega, damping, x0=0.0, v0=0.0):
    """x, x', then y, y' of each mode at the end, integrated from switching to switching."""

    def rates(t, state, u):
        x = np.empty_like(state)
        x[0], x[1] = state[1], u
        for k, (w, b) in enumerate(zip(omega, damping, strict=True)):
            y, rate = state[2 * k + 2 : 2 * k + 4]
            x[2 * k + 2 : 2 * k + 4] = rate, u - b * rate - w * w * y
        return x

    state = np.array([x0, v0, *np.zeros(2 * len(omega))])
    times = [0.0, *plan.switch_times, plan.duration]
    for a, b, u in zip(times, times[1:], plan.levels, strict=False):
        leg = solve_ivp(
            rates, (a, b), state, method="DOP853", rtol=1e-12, atol=1e-14, args=(float(u),)
        )
        state = leg.y[:, -1]
    return state


# -- values and norms ------------------------------------------------------------------------------


def test_a_switched_control_over_time():
    assert PLAN([0.0, 0.999, 1.0, 3.0, 4.0, 6.0]) == pytest.approx([2, 2, 0, -1, 0.5, 0.5])
    assert PLAN([-1e-9, 6.0 + 1e-9]) == pytest.approx([0, 0])
    assert PLAN(2.6) == -1.0


def test_norms_of_a_switched_control():
    assert PLAN.peak == 2.0
    assert PLAN.fuel == pytest.approx(2.0 + 1.5 + 1.0)
    assert PLAN.energy == pytest.approx(math.sqrt(4.0 + 1.5 + 0.5))


def test_norms_of_a_smooth_control():
    plan = min_energy(omega=1.0, damping=0.2, duration=9.0, x1=1.0, v0=0.2)
    t = np.linspace(0, 9.0, 200_001)
    u = plan(t)
    # Trapezoids of 45 us: (h^2/12) T |u''|, and 1/n at the kinks of |u|.
    assert plan.energy == pytest.approx(math.sqrt(np.trapezoid(u * u, t)), rel=1e-9)
    assert plan.fuel == pytest.approx(np.trapezoid(np.abs(u), t), rel=1e-8)
    assert plan.peak == pytest.approx(np.max(np.abs(u)), rel=1e-9)
    assert plan([-1e-6, 9.0 + 1e-6]) == pytest.approx([0, 0])
    assert len(plan.switch_times) == len(plan.levels) == 0
    assert plan.normal


def test_a_smooth_control_is_the_sum_of_its_moment_functions():
    plan = min_energy(omega=[1.0, 3.0], damping=[0.2, 0.1], duration=9.0, x1=1.0, v0=0.2)
    t = np.linspace(0, 9.0, 13)
    assert plan(t) == pytest.approx(plan.multipliers @ plan.modes.functions(9.0 - t), abs=1e-13)
    assert plan.modes.omega == pytest.approx((1.0, 3.0))


def test_plans_cannot_be_written_to_and_can_be_pickled():
    plan = min_peak(omega=1.0, damping=0.02, duration=8.0, x1=1.0)
    with pytest.raises(ValueError, match="read-only"):
        plan.levels[0] = 0.0
    copy = pickle.loads(pickle.dumps(plan))
    assert copy.levels.tolist() == plan.levels.tolist()
    values = np.ones(2)
    kept = read_only(values)
    values[0] = 5.0
    assert kept.tolist() == [1.0, 1.0]


# -- moments and what is left ----------------------------------------------------------------------


def test_moments_are_what_the_equations_of_motion_give():
    omega, damping = (1.3, 4.0), (0.1, 0.05)
    end = flown(PLAN, omega=omega, damping=damping)
    # Tolerance of the integration.
    assert PLAN.moments(modes_of(omega, damping)) == pytest.approx(end, abs=1e-10)


def test_moments_of_a_smooth_control_for_other_modes():
    plan = min_energy(omega=1.0, damping=0.02, duration=8.0, x1=1.0)
    other = modes_of([1.1, 7.0], [0.02, 0.3])

    def rates(t, state):
        u = float(plan(t))
        y, ry, z, rz = state
        return [ry, u - 0.02 * ry - 1.21 * y, rz, u - 0.3 * rz - 49 * z]

    leg = solve_ivp(rates, (0, 8.0), np.zeros(4), method="DOP853", rtol=1e-12, atol=1e-14)
    got = plan.moments(other)
    assert got[:2] == pytest.approx([1.0, 0.0], abs=1e-13)
    assert got[2:] == pytest.approx(leg.y[:, -1], abs=1e-10)


def test_residual_vibration_is_the_amplitude_that_rings_on():
    omega, damping = 2.3, 0.4
    y, rate = flown(PLAN, omega=[omega], damping=[damping])[2:]
    amplitude = float(residual_vibration(PLAN, omega=omega, damping=damping))
    t = np.linspace(0, 6, 60_001)
    beta = math.sqrt(omega**2 - 0.04)
    ringing = np.exp(-0.2 * t) * (y * np.cos(beta * t) + (rate + 0.2 * y) / beta * np.sin(beta * t))
    # Sampled at 1e-4 s: (beta h)^2/8 of the amplitude.
    assert np.max(np.abs(ringing) * np.exp(0.2 * t)) == pytest.approx(amplitude, rel=1e-7)


@settings(max_examples=30)
@given(st.floats(0.2, 20), st.floats(0, 0.9))
def test_residual_vibration_of_one_pulse(w, zeta):
    """A pulse of length d leaves |int e^(mu s) ds|/beta."""
    plan = SwitchedPlan(
        duration=2.0, switch_times=np.empty(0), levels=np.array([3.0]), residual=0.0
    )
    mu = complex(-zeta * w, w * math.sqrt(1 - zeta**2))
    exact = 3.0 * abs((np.exp(2.0 * mu) - 1) / mu) / mu.imag
    got = residual_vibration(plan, omega=w, damping=2 * zeta * w)
    assert got == pytest.approx(exact, rel=1e-10, abs=1e-13)


def test_residual_vibration_of_many_modes_at_once():
    got = residual_vibration(PLAN, omega=[[1.0, 1.5], [2.0, 1.0]], damping=0.1)
    assert got.shape == (2, 2)
    assert got[0, 0] == got[1, 1] == residual_vibration(PLAN, omega=1.0, damping=0.1)
    with pytest.raises(ValueError, match="not underdamped"):
        residual_vibration(PLAN, omega=1.0, damping=2.0)
