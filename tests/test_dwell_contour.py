"""Contours under late switching and slip: adversaries, what attains them, axes that couple."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacecraft_sim.dwell_accuracy import guaranteed_accuracy
from spacecraft_sim.dwell_axes import RelayAxis, coupled
from spacecraft_sim.dwell_contour import contour

CASES = [(0.0, 0.0), (0.0, 0.388), (0.2, 0.5), (-0.3, 0.1), (0.0, 0.7)]


@pytest.mark.parametrize("case", CASES, ids=str)
def test_without_slip_and_lateness_it_is_the_closed_form(case):
    found = contour(*case)
    assert found.accuracy == pytest.approx(guaranteed_accuracy(*case), rel=1e-12)  # rounding
    assert found.half_width == found.accuracy


@pytest.mark.parametrize("late", [1e-4, 1e-3])
def test_late_switching_costs_what_sampling_is_known_to_cost(late):
    # Without a disturbance u0 dwell h to first order: 8 h/dwell of 1/8.
    assert contour(0.0, 0.0, late=late).accuracy - 0.125 == pytest.approx(late, rel=4 * late)
    # With one it is more: the rate at the arc is higher, and the braking slower.
    assert contour(0.0, 0.388, late=late).accuracy > guaranteed_accuracy(0.0, 0.388) + 3 * late


# -- the law in adverse hands ----------------------------------------------------------------------


def reached(x, v, a, s, half, p, side):
    """First t > 0 at which the path meets x = side (p - v^2/(2 b)) with v side > 0."""
    c = side / (2 * half.brake)
    k2, k1, k0 = a / 2 + c * a * a, v + s + 2 * c * v * a, x - side * p + c * v * v
    roots = np.roots([k2, k1, k0]) if k2 else np.array([-k0 / k1] if k1 else [])
    times = [t.real for t in roots if abs(t.imag) < 1e-12 and t.real > 1e-12]
    return min((t for t in times if (v + a * t) * side > 0), default=math.inf)


def flown(found, F, e, late, adversary, turns=40):
    """Largest |x| and |v|, and least time from a switching to the next arc, in exact pieces.

    The adversary gives signs of disturbance and slip and how long it keeps them, from the signs of
    u and v, and how late each switching is.
    """
    u, half = 1.0, found.upper
    v = half.fastest - (1 + F + e) * late
    x, seen, gaps = found.half_width - v * v / (2 * half.brake), [], []

    def moved(limit):
        nonlocal x, v
        eps, slip, until = adversary(u, v)
        a, s = u + F + e * eps, found.slip * slip
        turns_at = [-w / a for w in (v, v + s) if w * a < -1e-12]  # of v, and of x
        step = min(until, limit(a, s), *turns_at)
        x, v = x + (v + s) * step + a * step**2 / 2, v + a * step
        if turns_at and step == min(turns_at) and abs(v) < 1e-12:
            v = 0.0
        seen.append((abs(x), abs(v)))
        return step

    for _ in range(turns):
        wait = late * adversary(u, v, late=True)
        while wait > 1e-15:
            wait -= moved(lambda a, s, wait=wait: wait)
        u, gap = -u, 0.0
        half, side = (found.upper, 1.0) if u > 0 else (found.lower, -1.0)
        crossing = math.inf
        while True:

            def to_arc(a, s, half=half, side=side):
                nonlocal crossing
                crossing = reached(x, v, a, s, half, found.half_width, side)
                return crossing

            step = moved(to_arc)
            gap += step
            if step == crossing:
                break
        gaps.append(gap)
    return *np.max(seen, axis=0), min(gaps)


@given(data=st.data())
@settings(max_examples=60)
def test_no_adversary_leaves_the_contour_or_breaks_the_dwell(data):
    F = data.draw(st.floats(-0.6, 0.6))
    e = data.draw(st.floats(0, 0.9)) * (1 - abs(F))
    slip, late = (10 ** data.draw(st.floats(-4, -1)) for _ in range(2))
    signs = data.draw(st.lists(st.sampled_from([-1, 1]), min_size=8, max_size=8))
    seed = data.draw(st.integers(0, 99))
    rng = np.random.default_rng(seed)

    def adversary(u, v, late=False):
        if late:
            return rng.uniform() if seed % 2 else 1.0
        # A feedback on the signs of u and v, or, for odd seeds, one that changes its mind.
        flips = rng.choice([-1, 1], 2) if seed % 2 else (1, 1)
        k = int(u > 0) + 2 * int(v > 0)
        return signs[k] * flips[0], signs[4 + k] * flips[1], rng.exponential(0.3) + 1e-3

    found = contour(F, e, slip=slip, late=late)
    x, v, gap = flown(found, F, e, late, adversary)
    # Some hundred arcs, roots of quadratics that meet at a small angle.
    assert x <= found.accuracy * (1 + 1e-7)
    assert v <= found.fastest * (1 + 1e-7)
    assert gap >= 1 - 1e-7


@pytest.mark.parametrize("case", CASES, ids=str)
def test_accuracy_and_dwell_are_attained(case):
    F, e = case
    found = contour(F, e, slip=0.01, late=0.02)

    def outwards(u, v, late=False):
        return 1.0 if late else (1.0, 1.0, math.inf)

    # The first switching alone: from the end of the arc, as late as may be.
    x, _, _ = flown(found, F, e, 0.02, outwards, turns=1)
    assert x == pytest.approx(found.upper.end, rel=1e-9)  # a few sums
    gaps = []
    for half, other, sign in ((found.upper, found.lower, 1), (found.lower, found.upper, -1)):
        for v in (half.slowest, half.fastest):
            start = found.half_width - v * v / (2 * half.brake)
            brake = -(1 - sign * F + e)
            gaps.append(reached(start, v, brake, -0.01, other, found.half_width, -1.0))
    assert min(gaps) == pytest.approx(1.0, rel=1e-9)  # or p could be less


@given(st.floats(-0.6, 0.6), st.floats(0, 0.9), st.floats(1e-4, 0.1), st.floats(1e-4, 0.1))
@settings(max_examples=100)
def test_slip_and_lateness_only_widen(bias, share, slip, late):
    e = share * (1 - abs(bias))
    plain = contour(bias, e)
    for more in ({"slip": slip}, {"late": late}, {"slip": slip, "late": late}):
        found = contour(bias, e, **more)
        assert found.half_width >= plain.half_width * (1 - 1e-12)
        assert found.accuracy > plain.accuracy
        mirrored = contour(-bias, e, **more)
        assert mirrored.accuracy == pytest.approx(found.accuracy, rel=1e-9)  # of the root found


def test_a_contour_knows_what_enters_it():
    found = contour(0.1, 0.3, late=0.01)
    half = found.upper
    for v in np.linspace(half.slowest, half.fastest, 5):
        arc = found.half_width - v * v / (2 * half.brake)
        beyond = found.upper.end - v * v / (2 * half.brake)
        assert found.enters(arc + 1e-12, v, -1)
        assert not found.enters(arc - 1e-3, v, -1)  # too soon: the dwell might break
        assert not found.enters(beyond + 1e-3, v, -1)  # too late: it leads out
        assert not found.enters(arc, v, 1)
    assert not found.enters(found.half_width, half.slowest - 0.1, -1)
    assert not found.enters(0.0, half.fastest + 0.1, -1)
    low = found.lower
    mirrored = -found.half_width + low.slowest**2 / (2 * low.brake)
    assert found.enters(mirrored - 1e-12, -low.slowest, 1)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"bias": 0.5, "disturbance": 0.5}, r"\|bias\| \+ disturbance must be < 1"),
        ({"bias": 0.0, "disturbance": 0.1, "slip": -1e-3}, "slip = -0.001"),
        ({"bias": 0.0, "disturbance": 0.1, "late": math.nan}, "late = nan"),
    ],
)
def test_bad_numbers_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        contour(**arguments)


# -- axes of one bus -------------------------------------------------------------------------------


def axes(u0, **changes):
    inertias = {"x": 270.0, "y": 293.0, "z": 258.0}
    return {
        n: RelayAxis(acceleration=u0, inertia=J, dwell=2.0, disturbance=0.25, **changes)
        for n, J in inertias.items()
    }


def test_terms_add_up_to_the_contour():
    for band in coupled(axes(3e-3, late=0.02, slip=1e-6, lean=1e-4)).values():
        terms = band.accuracy
        inside = terms.contour + terms.sampling + terms.coupling
        assert inside == pytest.approx(band.contour.accuracy * band.axis.length, rel=1e-12)
        assert terms.total == pytest.approx(inside + 1e-4, rel=1e-12)
        assert min(terms.contour, terms.sampling, terms.coupling) > 0


def test_one_axis_alone_has_nothing_to_couple_with():
    (band,) = coupled({"z": axes(3e-3)["z"]}).values()
    assert band.accuracy.coupling == 0
    assert band.slip == band.gyroscopic == 0
    assert band.accuracy.total == pytest.approx(guaranteed_accuracy(0, 0.25) * 3e-3 * 4, rel=1e-12)


def test_coupling_is_of_second_order():
    # Slip over u0 dwell, and gyroscopic torque over the torque, grow with u0: bounds with u0^2.
    shares = []
    for u0 in (1e-6, 1e-5, 1e-4):
        band = coupled(axes(u0))["x"]
        shares.append(band.accuracy.coupling / band.accuracy.contour / u0)
    # To first order: at 1e-4 rad/s^2 the next term is some u0 dwell^2 of it.
    assert np.ptp(shares) < 2e-3 * np.mean(shares)
    assert band.slip == pytest.approx(
        (2 * band.contour.accuracy * band.axis.length * band.rate) / 2, rel=1e-3
    )
    J = {n: a.inertia for n, a in axes(1.0).items()}
    assert band.gyroscopic == pytest.approx(
        (J["y"] - J["z"]) / J["x"] * band.rate**2, rel=1e-2  # rates of the axes differ a little
    )  # fmt: skip


def test_axes_that_turn_too_fast_for_each_other_are_refused():
    with pytest.raises(ValueError, match=r"turn each other too fast .* x 4 rad, y 4 rad"):
        coupled(axes(1.0))
