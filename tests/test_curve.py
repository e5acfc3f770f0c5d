"""First exits of a closed-form curve against brute force, and where it only grazes its bounds."""

import cmath
import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from spacecraft_sim.curve import Curve
from spacecraft_sim.disturbance import Torque
from spacecraft_sim.relay_system import RelaySystem, Row, State, propagate

ULP = 2.0**-52
LOCATED = 1e-15  # the march stops within 1e-16 (1 + tau) of the exit; a few roundings of the clock
INF = math.inf


def size(curve, tau):
    """The sum of the magnitudes whose rounding the value carries."""
    polynomial = abs(curve.a0) + abs(curve.a1) * tau + abs(curve.a2) * tau**2
    return polynomial + sum(2 * abs(a) * (1 + abs(mu) * tau) for mu, a in curve.waves)


def sampled(curve, tau):
    """Values at many instants, by numpy rather than by the curve itself."""
    x = curve.a0 + tau * (curve.a1 + tau * curve.a2)
    return x + sum(2 * (a * np.exp(mu * tau)).real for mu, a in curve.waves)


def brute_exit(curve, end, low, high, n=4000):
    """The first sample outside the bounds, then bisection; None if every sample is inside."""
    tau = np.linspace(0.0, end, n + 1)[1:]
    x = sampled(curve, tau)
    outside = np.flatnonzero((x <= low) | (x >= high))
    if not len(outside):
        return None
    b = float(tau[outside[0]])
    a = b - end / n
    while a < (mid := (a + b) / 2) < b:
        a, b = (mid, b) if low < curve(mid)[0] < high else (a, mid)
    return b


coefficient = st.floats(-3, 3, allow_subnormal=False)
wave = st.tuples(
    st.builds(complex, st.floats(-2, 0, allow_subnormal=False), st.floats(0.1, 30)),
    st.builds(complex, st.floats(-0.5, 0.5), st.floats(-0.5, 0.5)),
)
curves = st.builds(Curve, coefficient, coefficient, coefficient, st.lists(wave, max_size=3))
room = st.one_of(st.floats(1e-9, 2), st.just(INF))


@settings(max_examples=400)
@given(curves, room, room, st.floats(0.05, 4))
@example(Curve(0.0, 0.0, 0.0, []), 1.0, 1.0, 1.0)
@example(Curve(0.0, -1.0, 1.0, []), 0.25, INF, 4.0)  # touches the bound at 1/2
def test_first_exit_is_the_first_and_lies_on_a_bound(curve, below, above, end):
    x0 = curve(0.0)[0]
    low, high = x0 - below, x0 + above
    assume(low < x0 < high)
    found = curve.first_exit(0.0, end, low, high)
    brute = brute_exit(curve, end, low, high)
    rounding = 8 * ULP * (size(curve, end) + sum(x for x in (below, above) if x < INF))
    inside = np.linspace(0.0, end if found is None else found, 2001)[:-1]
    x = sampled(curve, inside)
    assert np.all((x > low - rounding) & (x < high + rounding))
    if found is None:
        # A graze within the rounding of the value may be told either way.
        assert brute is None or min(abs(curve(brute)[0] - b) for b in (low, high)) <= rounding
        return
    assert 0 < found <= end
    value, rate = curve(found)
    # The instant is as good as the march's last step, and the value with it.
    near = rounding + abs(rate) * LOCATED * (1 + found)
    assert min(abs(value - low), abs(value - high)) <= near
    if brute is not None and abs(rate) > 1e-3:
        # Twice the rounding of the value over the rate is all that two roots may differ by; where
        # a bend brings the curve back within it (rate^2 < curvature x rounding) rate is too small.
        assert found <= brute + 2 * near / abs(rate)


@settings(max_examples=200)
@given(curves, st.floats(0.05, 4), st.floats(0.01, 0.99))
def test_an_exit_whose_time_is_known_is_found(curve, end, share):
    # The bound is put where the curve first reaches its value at a chosen instant.
    when = share * end
    bound, rate = curve(when)
    x0 = curve(0.0)[0]
    assume(abs(rate) > 1e-2)
    assume(abs(bound - x0) > 1e-6)
    before = sampled(curve, np.linspace(0.0, when, 4001)[:-1])
    low, high = (-INF, bound) if bound > x0 else (bound, INF)
    assume(np.all((before > low) & (before < high)))
    found = curve.first_exit(0.0, end, low, high)
    assert found is not None
    # The rounding of the value over the rate, and the march's last step.
    error = 16 * ULP * size(curve, when) / abs(rate) + LOCATED * (1 + when)
    assert found == pytest.approx(when, abs=error)


@pytest.mark.parametrize("depth", [-1e-3, -1e-6, -1e-9, -1e-12, 1e-12, 1e-9, 1e-6])
@pytest.mark.parametrize("side", [1, -1])
def test_a_parabola_that_grazes_a_bound(depth, side):
    # (tau - 1)^2 + depth: leaves at 1 - sqrt(-depth) or not at all.
    curve = Curve(side * (1 + depth), side * -2.0, side * 1.0, [])
    low, high = (0.0, INF) if side > 0 else (-INF, 0.0)
    found = curve.first_exit(0.0, 3.0, low, high)
    if depth > 0:
        assert found is None
    else:
        # The value is rounded to an ulp, the root to half an ulp over the slope 2 sqrt(-depth).
        assert found == pytest.approx(
            1 - math.sqrt(-depth), abs=2 * ULP / math.sqrt(-depth) + 4 * ULP
        )


@pytest.mark.parametrize("depth", [-1e-4, -1e-8, -1e-12, 1e-12, 1e-8, 1e-4])
def test_a_cosine_that_grazes_a_bound(depth):
    # 1 + depth + cos(5 tau): its lowest point lies at pi/5.
    curve = Curve(1 + depth, 0.0, 0.0, [(5j, 0.5 + 0j)])
    found = curve.first_exit(0.0, 1.2, 0.0, INF)
    if depth > 0:
        assert found is None
    else:
        exact = (math.pi - math.acos(1 + depth)) / 5  # cos(pi - x) = -(1 + depth)
        # acos of 1 + depth loses ulp/sqrt(-depth), and so does the root itself.
        assert found == pytest.approx(exact, abs=4 * ULP / math.sqrt(-depth) + 4 * ULP)


def test_a_march_along_a_touching_curve_ends():
    # Exactly tangent: whether the touch is an exit is rounding's affair, but it is at 1 if it is.
    found = Curve(1.0, -2.0, 1.0, []).first_exit(0.0, 3.0, 0.0, INF)
    # Rounding of 1 - 2 tau + tau^2 leaves sqrt(ulp) of the instant.
    assert found is None or found == pytest.approx(1.0, abs=2 * math.sqrt(ULP))


@pytest.mark.parametrize(
    ("curve", "low", "high"),
    [
        (Curve(0.0, -1.0, 0.0, []), 0.0, INF),
        (Curve(0.0, 1.0, 5.0, []), -INF, 0.0),
        (Curve(0.3, -1.0, 2.0, []), 0.3, 0.6),
        (Curve(0.0, -1e-6, 0.5, []), 0.0, 1.0),
        (Curve(1.0, 0.0, 0.0, [(4j, 0.5j)]), 1.0, 2.0),  # 1 - sin(4 tau)
    ],
)
def test_on_a_bound_and_moving_out_the_exit_is_now(curve, low, high):
    found = curve.first_exit(0.0, 10.0, low, high)
    assert found is not None
    assert found <= 4 * ULP  # the resolution of the clock near zero


@pytest.mark.parametrize("side", [1, -1])
def test_on_a_bound_at_rest_and_bending_out_the_exit_is_now(side):
    # -tau^2/2 leaves (0, inf) at once, although neither value nor rate says so.
    low, high = (0.0, INF) if side > 0 else (-INF, 0.0)
    assert Curve(0.0, 0.0, side * -0.5, []).first_exit(0.0, 1.0, low, high) == pytest.approx(
        0.0,
        abs=2e-8,  # at most the time in which a bend of 1 moves by an ulp of 1
    )


@pytest.mark.parametrize("side", [1, -1])
def test_on_a_bound_at_rest_and_bending_in_there_is_no_exit(side):
    low, high = (0.0, INF) if side > 0 else (-INF, 0.0)
    assert Curve(0.0, 0.0, side * 0.5, []).first_exit(0.0, 1.0, low, high) is None


@pytest.mark.parametrize("gap", [0.0, -1e-18, -1e-16, 1e-18])
@pytest.mark.parametrize("rate", [1.0, 1e-3])
def test_just_after_a_crossing_the_next_exit_is_the_return(gap, rate):
    # Rounding leaves the value on either side of the bound that was crossed.
    curve = Curve(gap, rate, -0.5, [])
    # gap + rate tau - tau^2/2 = 0 at 2 rate, shifted by gap/rate; a few ulps of the clock.
    assert curve.first_exit(0.0, 10.0, 0.0, INF) == pytest.approx(
        2 * rate, abs=2 * abs(gap) / rate + 8 * ULP * (1 + rate)
    )


@pytest.mark.parametrize("rate", [1e-8, 1e-10, 1e-12])
def test_just_after_a_grazing_crossing_the_return_is_at_once(rate):
    # The bound is crossed by less than rounding has left of the gap: rate^2/2 < |gap|.
    found = Curve(-(rate**2), rate, -0.5, []).first_exit(0.0, 10.0, 0.0, 1.0)
    assert found is not None
    assert found <= 4 * rate  # the time in which the whole graze is over


@pytest.mark.parametrize("low", [0.0045, 1.0, 1e3])
def test_within_an_ulp_of_a_bound_the_exit_is_not_put_off(low):
    # gap + v tau - tau^2/2 = 0 at sqrt(2 gap) for tiny v; a chord along v would be years long.
    x = math.nextafter(low, INF)
    found = Curve(x, -1e-20, -0.5, []).first_exit(0.0, 1.0, low, INF)
    assert found is not None
    assert found <= math.sqrt(2 * (x - low)) * (1 + 1e-6)  # 1e-6: the march's own criterion


@pytest.mark.parametrize("rate", [1.0, 1e-2, 1e-4, 1e-6])
@pytest.mark.parametrize("bound", [1e-4, 1.0])
def test_resolution_at_a_bound(rate, bound):
    # 2 bound - rate tau reaches the bound at bound/rate.
    found = Curve(2 * bound, -rate, 0.0, []).first_exit(0.0, 1e7, bound, INF)
    # Two roundings of a value of 2 bound, over the rate; two ulps of the clock.
    assert found == pytest.approx(bound / rate, abs=4 * ULP * (bound / rate + 1))


@given(curves, st.floats(0, 3))
def test_value_rate_and_derivative(curve, tau):
    value, rate = curve(tau)
    assert value == pytest.approx(float(sampled(curve, tau)), abs=8 * ULP * size(curve, tau) + ULP)
    slope, bend = curve.derivative()(tau)
    terms = 1 + sum(2 * abs(mu * a) * (1 + abs(mu) * tau) for mu, a in curve.waves)
    bound = abs(curve.a1) + 2 * abs(curve.a2) * tau + terms
    assert rate == pytest.approx(slope, abs=8 * ULP * bound)
    exact = 2 * curve.a2 + sum(2 * (mu**2 * a * cmath.exp(mu * tau)).real for mu, a in curve.waves)
    terms = 1 + sum(2 * abs(mu**2 * a) * (1 + abs(mu) * tau) for mu, a in curve.waves)
    assert bend == pytest.approx(exact, abs=8 * ULP * (2 * abs(curve.a2) + terms))
    assert abs(bend - 2 * curve.a2) <= curve.ripple * (1 + 8 * ULP) + ULP


def test_a_search_begins_at_its_own_start():
    curve = Curve(0.0, 0.0, 0.0, [(1j, -0.5j)])  # sin(tau)
    # Roots of a sine to a few ulps of pi.
    assert curve.first_exit(0.5, 10.0, 0.0, INF) == pytest.approx(math.pi, abs=8 * ULP)
    assert curve.first_exit(4.0, 10.0, -INF, 0.0) == pytest.approx(2 * math.pi, abs=16 * ULP)
    assert curve.first_exit(0.5, 3.0, 0.0, INF) is None


# -- the curves of a relay system ----------------------------------------------------------------


def shaken(modes):
    """A relay with modes at frequencies 1.5 k^1.2, driven and felt the less the faster they are."""
    k = np.arange(1, modes + 1)
    poles = (-0.02 + 1.5j) * k**1.2
    return RelaySystem(
        switching=Row(angle=0.31, rate=1.0, modes=tuple((0.1 / k + 0j).tolist())),
        levels=(0.007,),
        eigenvalues=tuple(poles.tolist()),
        drive=tuple((0.5 / k + 0j).tolist()),
    )


@pytest.mark.parametrize("modes", [0, 1, 3, 10])
def test_peaks_against_dense_sampling(modes):
    system = shaken(modes)
    torque = Torque(constant=2e-4, amplitude=5e-4, frequency=1.3, phase=0.4)
    run = propagate(
        system, start=State(0.001, 0.0, (0j,) * modes), duration=30.0, delay=0.3, disturbance=torque
    )
    t = np.linspace(0.0, 30.0, 300_001)
    angle, rate, z = run.at(t)
    for row in (Row(angle=1.0), Row(rate=1.0), system.switching):
        modal = 2 * (z @ np.array(row.modes)).real if row.modes else 0.0
        x = np.abs(row.angle * angle + row.rate * rate + modal)
        for after in (0.0, 12.34):
            value, when = run.peak(row, after=after)
            dense = np.max(x[t >= after])
            # Half a sample, 5e-5 s, of a rate below .1 at a corner, where samples fall short.
            assert dense * (1 - 1e-13) <= value <= dense + 5e-6
            assert when >= after
            at = [float(y[0]) for y in run.at([when])[:2]]
            own = 2 * (run.at([when])[2][0] @ np.array(row.modes)).real if row.modes else 0.0
            assert abs(row.angle * at[0] + row.rate * at[1] + own) == pytest.approx(
                value, rel=1e-11
            )


def test_a_start_on_the_switching_line_that_bends_away_switches_at_once():
    # beta = -1, v = 1, c = 1, u = -1: s = -t^2/2 exactly.  A command of +2 must leave at t = 0.
    system = RelaySystem(switching=Row(angle=1.0, rate=1.0), levels=(2.0,))
    run = propagate(system, start=State(-1.0, 1.0), duration=0.45, delay=0.5, acting=-1.0)
    assert run.commands[-1] == 2.0
    assert run.switch_times[-1] <= 2e-8  # s falls by an ulp in this time


@pytest.mark.parametrize("ulps", range(-3, 4))
def test_a_grazed_threshold_never_leaves_the_relay_in_the_wrong_cell(ulps):
    # s rises to its top (v - 1)^2/2 + beta + v and falls on for ever, over every bound on its way.
    rng = np.random.default_rng(7)
    for _ in range(300):
        v = 1 + rng.uniform(0.1, 3)
        beta = -v - rng.uniform(0, 0.49) * (v - 1) ** 2
        top = beta + v + (v - 1) ** 2 / 2
        threshold = top + ulps * math.ulp(top)
        system = RelaySystem(
            switching=Row(angle=1.0, rate=1.0), thresholds=(threshold,), levels=(2.0, 6.0)
        )
        run = propagate(system, start=State(beta, v), duration=20.0, delay=30.0, acting=-1.0)
        assert run.commands[-1] == 6.0  # far below -threshold in the end
