"""Delay margins and longest periods: closed forms, other methods, flights, known figures."""

import math
from dataclasses import replace

import burkov_cases as cases
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import eig

from controllers import burkov
from controllers.burkov_laws import Spin
from controllers.programmes import Harmonic
from controllers.velocity_filter import sampled, velocity_filter
from spacecraft_sim.dynamics import linear_plant
from spacecraft_sim.loop_margins import Loop, close, delay_margin, longest_period
from spacecraft_sim.mechanisms import linear_flexible, linear_mechanism
from spacecraft_sim.smooth_flight import fly

BLANK = velocity_filter(cutoffs=(), period=1.0)
HOLDS = ("zero-order hold", "euler", "first-order hold", "tustin")


def static(A, B, K):
    """x' = A x + B u, u = K x."""
    n = len(A)
    return Loop(
        A=np.array(A, dtype=float), B=np.array(B, dtype=float), C=np.eye(n),
        direct=np.array(K, dtype=float), damping=np.zeros((len(K), 0)),
        filtered=np.zeros((0, n)), filter=BLANK,
    )  # fmt: skip


# -- closed forms ------------------------------------------------------------------------------


@settings(max_examples=10)
@given(st.floats(0.01, 100))
def test_an_integrator(k):
    loop = static([[0.0]], [[1.0]], [[-k]])
    margin = delay_margin(loop)
    # Roots are found to 1e-13 of the frequency and 1e-10 of the period.
    assert margin.delay == pytest.approx(math.pi / (2 * k), rel=1e-9)
    assert margin.frequency == pytest.approx(k, rel=1e-9)
    assert longest_period(loop, upper=10 / k) == pytest.approx(2 / k, rel=1e-9)
    assert longest_period(loop, upper=10 / k, late=1) == pytest.approx(1 / k, rel=1e-9)
    assert longest_period(loop, upper=1.9 / k) == math.inf


@settings(max_examples=25)
@given(st.floats(0.1, 10), st.floats(0.1, 10))
def test_a_double_integrator(a, b):
    loop = static([[0, 1], [0, 0]], [[0], [1]], [[-a, -b]])
    w = math.sqrt((b**2 + math.sqrt(b**4 + 4 * a**2)) / 2)
    assert delay_margin(loop).delay == pytest.approx(math.atan2(b * w, a) / w, rel=1e-9)
    # Jury's conditions: T < 2 b/a and T < 2/b.
    exact = min(2 * b / a, 2 / b)
    assert longest_period(loop, upper=3 * exact) == pytest.approx(exact, rel=1e-8)


def test_a_loop_that_bears_any_delay():
    loop = static([[-2.0]], [[1.0]], [[-1.0]])  # |L| < 1 throughout
    assert delay_margin(loop).delay == math.inf


def test_a_narrow_window_is_found():
    """A swing of 1e-5 damping that the loop excites only near one frequency."""
    A = [[0, 1, 0], [-100.0, -1e-4, 0], [0, 0, -1.0]]
    loop = static(A, [[0], [1], [0.0]], [[0, -1.2e-4, 0]])
    margin = delay_margin(loop)
    assert margin.frequency == pytest.approx(10.0, rel=1e-5)  # half a width of 1e-4/10
    assert 0.1 < margin.delay < 2 * math.pi / 10


# -- the paper's laws --------------------------------------------------------------------------


def arm_loop(law):
    return close(law, linear_mechanism(cases.ARM, q=cases.TARGET))


def still(**changes):
    programme = Harmonic(
        mean=cases.TARGET, amplitude=(0.0, 0.0), frequency=(1.0, 1.0), phase=(0.0, 0.0)
    )
    return arm_loop(cases.path(programme=programme, **changes)[0])


def flexible_loop():
    plant = linear_flexible(cases.FLEXIBLE, q=cases.FLEXIBLE_TARGET)
    return close(cases.flexible()[0], plant)


def body_loop(rated):
    law, _ = cases.vectors(rated=rated)
    body = replace(cases.BODY, vectors=("s2", "s3"))
    state = np.r_[np.zeros(3), np.ravel(law.formula.r)]
    plant = linear_plant(body, state=state, torques=np.zeros(3), basis=body.tangent(state))
    return close(law, plant)


def spin_loop(law, p, *, free=False):
    body = replace(cases.BODY, vectors=("s1",))
    state = np.array([p, 0, 0, 1.0, 0, 0])
    basis = np.eye(6)[:, [1, 2, 4, 5]] if free else body.tangent(state)
    return close(law, linear_plant(body, state=state, torques=np.zeros(3), basis=basis))


def permanent():
    law, _ = burkov.permanent_rotation(cases.BODY, spin=2.0, **cases.SPIN)
    return spin_loop(law, 2.0)


def two_torques():
    law, _ = burkov.two_torques(cases.BODY, spin=1.0, beta=1.0, gamma=1.0, k=1.6)
    return spin_loop(law, 1.0, free=True)


# Slowest pole, 1/s; delay margin, ms; longest period, ms, by hold: zero-order, Euler, first-order,
# Tustin.  Known to the digits shown.
TABLE = {
    "(2.1)": (lambda: arm_loop(cases.position()[0]), -2.69, 17.3, (25.9, 36.8, 32.5, 32.9)),
    "(2.4)": (
        lambda: arm_loop(cases.position(gravity="at the target")[0]),
        -3.25, 16.6, (25.3, 35.9, 31.2, 31.7),
    ),
    "(3.1)": (still, -3.79, 7.1, (12.0, 14.5, 13.7, 13.7)),
    "(4.2)": (flexible_loop, -1.54, 4.6, (8.7, 9.5, 8.9, 9.0)),
    "(5.4)": (lambda: body_loop(True), -0.603, 328.3, (769.5,) * 4),
    "(5.8)": (lambda: body_loop(False), -0.489, 219.7, (273.2, 333.3, 374.7, 411.2)),
    "(5.18)": (permanent, -0.185, 150.7, (310.2,) * 4),
    "(5.20)": (two_torques, -0.288, 281.8, (606.6,) * 4),
}  # fmt: skip


def with_hold(loop, hold):
    return replace(loop, filter=replace(loop.filter, hold=hold))


@pytest.mark.parametrize("name", TABLE)
def test_the_table_of_margins(name):
    build, slowest, delay, periods = TABLE[name]
    loop = build()
    assert max(loop.eigenvalues().real) == pytest.approx(slowest, abs=0.006)  # its last digit
    # A digit of the shortest, 0.05 in 4.6 ms; the demand is 3 %.
    assert 1e3 * delay_margin(loop).delay == pytest.approx(delay, rel=0.011)
    holds = dict(zip(HOLDS, periods, strict=True))
    for hold, period in list(holds.items())[:: 3 if len(set(periods)) == 1 else 1]:
        longest = longest_period(with_hold(loop, hold), upper=1.5e-3 * period)
        assert 1e3 * longest == pytest.approx(period, rel=0.006)


@pytest.mark.parametrize(
    ("gains", "delay"),
    [((20, 10), 10.9), ((50, 10), 4.5), ((50, 30), 7.1), ((50, 100), 9.1), ((200, 30), 1.7),
     ((200, 100), 2.1)],
)  # fmt: skip
def test_more_gain_costs_margin_and_a_faster_filter_gives_some_back(gains, delay):
    gamma, nu = map(float, gains)
    margin = delay_margin(still(gamma=gamma, nu=nu)).delay
    assert 1e3 * margin == pytest.approx(delay, abs=0.051)  # its last digit


@pytest.mark.parametrize(
    ("hold", "period"), [("zero-order hold", 10.4), ("euler", 12.0), ("first-order hold", 11.5)]
)
def test_one_late_sample_costs_more_than_half_of_the_period(hold, period):
    loop = with_hold(arm_loop(cases.position()[0]), hold)
    assert 1e3 * longest_period(loop, upper=0.05, late=1) == pytest.approx(period, abs=0.051)


@pytest.mark.parametrize(
    ("cutoff", "periods"),
    [
        (50, (23.1, 40.0, 36.0, 37.1)),
        (100, (18.6, 20.0, 37.2, 39.5)),
        (200, (14.0, 10.0, 37.4, 40.7)),
    ],
)
def test_fast_filters_want_the_first_order_hold(cutoff, periods):
    K2 = (30.0 * cutoff, 10.0 * cutoff)
    loop = arm_loop(cases.position(K2=K2, K3=(float(cutoff),) * 2)[0])
    found = [1e3 * longest_period(with_hold(loop, hold), upper=0.06) for hold in HOLDS]
    assert found == pytest.approx(periods, abs=0.06)  # last digits


@pytest.mark.parametrize(
    ("hold", "rate"),
    list(zip(HOLDS, (-2.366, -2.727, -2.676, -2.677), strict=True)),
)
def test_decay_at_ten_milliseconds(hold, rate):
    loop = with_hold(arm_loop(cases.position()[0]), hold)
    assert loop.growth(0.01) == pytest.approx(rate, abs=6e-4)


# -- other ways to the same figures ------------------------------------------------------------


def pencil_margin(loop):
    """Delay margin by eigenvalues: x' = A0 x + A1 x(t - tau) has roots +-j w where with
    z = e^{-j w tau} the matrices A0 + A1 z and A0 + A1/z have opposite ones."""
    A1 = np.zeros_like(whole := loop.matrix())
    n = len(loop.A)
    Z = loop.filtered @ loop.C
    A1[:n] = loop.B @ np.hstack([loop.direct @ loop.C + loop.damping @ Z, -loop.damping])
    A0, one = whole - A1, np.eye(len(whole))
    first, second = np.kron(A1, one), np.kron(one, A1)
    zero = np.kron(A0, one) + np.kron(one, A0)
    none, all_ = np.zeros_like(zero), np.eye(len(zero))
    left, right = [[none, all_], [-second, -zero]], [[all_, none], [none, first]]
    roots = eig(np.block(left), np.block(right), right=False)
    delays = []
    for z in roots[np.isfinite(roots)]:
        if abs(abs(z) - 1) < 1e-6:
            for s in np.linalg.eigvals(A0 + A1 * z):
                if abs(s.real) < 1e-5 * abs(s) and s.imag > 1e-3:
                    delays.append((-np.angle(z) % (2 * math.pi)) / s.imag)
    return min(delays)


@pytest.mark.parametrize("build", [lambda: arm_loop(cases.position()[0]), permanent, two_torques])
def test_delay_margins_by_another_method(build):
    loop = build()
    # Double roots of the pencil are good to the root of rounding.
    assert delay_margin(loop).delay == pytest.approx(pencil_margin(loop), rel=1e-5)


def test_a_delay_of_many_samples_is_a_delay():
    loop = arm_loop(cases.position()[0])
    T = delay_margin(loop).delay / 200
    # A held torque is half a sample late on average.
    assert loop.growth(T, late=198) < 0 < loop.growth(T, late=201)


GROWTH = [("(2.1)", 0.0324726), ("(5.8)", 0.374748)]


@pytest.mark.parametrize(("name", "period"), GROWTH)
@pytest.mark.parametrize("share", [0.97, 1.03])
def test_flights_decay_or_grow_as_the_sampled_loop_says(name, period, share):
    T = share * period
    if name == "(2.1)":
        law, _ = cases.position(period=T)
        plant, start = cases.ARM, np.r_[np.array(cases.TARGET) + 1e-5, 0, 0]
        loop = arm_loop(law)
    else:
        law, _ = cases.vectors(rated=False, period=T)
        plant, loop = cases.BODY, body_loop(False)
        start = plant.state(rate=np.array([1e-5, 2e-5, -1e-5]), attitude=cases.goal())
    (run,) = fly(plant, law, starts=start, duration=240 * T)
    readings = cases.named(run, plant.units)
    goal = (
        np.r_[cases.TARGET, 0, 0] if name == "(2.1)" else np.r_[np.zeros(3), cases.goal().ravel()]
    )
    size = np.linalg.norm(readings - goal, axis=1)
    sizes = [np.max(size[k : k + 20]) for k in (80, 220)]
    # Beats within windows of 20 samples; the second mode has died by then.
    assert math.log(sizes[1] / sizes[0]) / 140 == pytest.approx(loop.growth(T) * T, abs=2e-3)
    assert (sizes[1] > sizes[0]) == (share > 1)


# -- refusals ----------------------------------------------------------------------------------


def test_an_unstable_loop_has_no_margins():
    loop = static([[1.0]], [[1.0]], [[-0.5]])
    for margin in (delay_margin, lambda x: longest_period(x, upper=1.0)):
        with pytest.raises(ValueError, match=r"not stable even without delay.* 0\.5 1/s"):
            margin(loop)


def test_a_plant_without_the_readings_is_refused():
    law, _ = cases.position()
    plant = linear_mechanism(cases.ARM, q=cases.TARGET)
    with pytest.raises(ValueError, match=r"sensor 'joint_2' is not in the linear plant"):
        close(law, plant._replace(outputs=("joint_1", "a", "b", "c")))
    spin = sampled(
        Spin(alpha=None, beta=1.0, gamma=1.0, k=1.0, spin=0.0), cutoffs=(), hold="tustin",
        period=1.0, sensors=("joint_1",) * 4, channels=("torque_y", "torque_z"), thrusters=None,
    )  # fmt: skip
    with pytest.raises(ValueError, match=r"input 'torque_y' is not in the linear plant"):
        close(spin, plant)


def test_margins_need_a_range():
    loop = static([[0.0]], [[1.0]], [[-1.0]])
    with pytest.raises(ValueError, match=r"upper = 0\.0"):
        longest_period(loop, upper=0.0)
    with pytest.raises(ValueError, match="not stable even at T"):
        longest_period(loop, upper=1.0, late=80)
