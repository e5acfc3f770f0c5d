"""The minimal contour: closed forms against raw geometry, the named points, sets and borders."""

import math

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from controllers.accuracy_map import equal_kappa, low_d, optimal_up_to, unit_contraction
from controllers.contour import (
    contour,
    contraction,
    guaranteed_accuracy,
    in_optimal_region,
    kappa,
    rates,
    undisturbed,
)
from controllers.contour_sets import in_w1, in_w2, in_w3, inside
from controllers.dimensionless import to_dimensionless
from controllers.ivanova_sokolov_search import FEEDBACKS, INNER
from spacecraft_sim.parabola_arcs import feedback, propagate
from spacecraft_sim.switching_curves import Relay, curve

GRID = [
    (F, share * min(F, 1 - F))
    for F in np.linspace(0.02, 0.98, 49).tolist()
    for share in np.linspace(0.02, 0.98, 50).tolist()
]


def near(value, expected, **tolerance):
    return value == pytest.approx(expected, **tolerance)


def crossing(x, v, a, x0, q):
    """Last time at which the arc from (x, v) with v' = a meets x = x0 + q v^2."""
    # Solved by companion matrix, not by the formulas that the closed forms were derived with.
    roots = np.roots([a / 2 - q * a * a, v - 2 * q * v * a, x - x0 - q * v * v])
    return max(float(t) for t in roots.real)


def raw_corners(r):
    """A1, A2 and B2 for p = 1, by intersecting parabolas x = x0 + q v^2."""

    def meet(x0, q0, x1, q1):
        v = math.sqrt((x1 - x0) / (q0 - q1))
        return x0 + q0 * v * v, v

    a1 = meet(-1, 1 / (2 * r.ap), 1, -1 / (2 * r.dm))
    x2, v2 = meet(-1, 1 / (2 * r.am), 1, -1 / (2 * r.dp))
    turn = x2 - v2 * v2 / (2 * r.ap)
    return a1, (x2, -v2), meet(turn, 1 / (2 * r.am), 1, -1 / (2 * r.dm))


# -- closed forms against geometry ---------------------------------------------------------------


def test_kappas_are_times_between_the_arcs_on_the_whole_region():
    worst = 0.0
    for F, e in GRID:
        r = rates(F, e)
        a1, _, b2 = raw_corners(r)
        for k, (x, v) in zip(kappa(F, e), (a1, b2), strict=True):
            time = crossing(x, v, -r.dp, -1, 1 / (2 * r.am))
            worst = max(worst, abs(time / k - 1))
    # Roots of a quadratic with coefficients up to 1e4 next to the borders: a dozen digits are left.
    assert worst < 1e-10


def test_the_contraction_is_that_of_the_outermost_turn_on_the_whole_region():
    worst = 0.0
    for F, e in GRID:
        r = rates(F, e)
        a1, a2, _ = raw_corners(r)
        k1 = a1[0] + a1[1] ** 2 / (2 * r.dp)  # the lines A1 K1, A2 K2 at v = 0
        k2 = a2[0] - a2[1] ** 2 / (2 * r.ap)
        start = -2.0
        v = math.sqrt((k1 - start) / (1 / (2 * r.ap) + 1 / (2 * r.dp)))
        top = start + v * v / (2 * r.ap) + v * v / (2 * r.dm)
        w = math.sqrt((top - k2) / (1 / (2 * r.dp) + 1 / (2 * r.ap)))
        end = top - w * w / (2 * r.dp) - w * w / (2 * r.am)
        left = -end - 1
        k = contraction(F, e)
        worst = max(worst, abs(left - k) / max(k, 1.0))
    assert worst < 1e-10  # a difference of lengths up to 1e3


def test_the_accuracy_tends_to_a_without_disturbance():
    for F in (0.1, 0.3, 0.5, 0.7, 0.9):
        a, _ = undisturbed(F)
        assert guaranteed_accuracy(F, 0.0) == pytest.approx(a, rel=1e-14)
        assert guaranteed_accuracy(F, 1e-9) == pytest.approx(a, rel=1e-6)  # of the order e/F


# -- figures ---------------------------------------------------------------------------------------


def test_figures_at_two_thirds_and_a_quarter():
    k1, k2 = kappa(2 / 3, 1 / 4)
    # Eight digits are given.
    assert k1 == pytest.approx(1.7300679, abs=5e-8)
    assert k2 == pytest.approx(1.9566986, abs=1.1e-7)
    assert guaranteed_accuracy(2 / 3, 1 / 4) == pytest.approx(0.33409788, abs=5e-9)
    assert contraction(2 / 3, 1 / 4) == pytest.approx(1.7111111, abs=5e-8)


def test_accuracies_without_disturbance():
    a, b = undisturbed(math.sqrt(5) - 2)
    assert a == pytest.approx((1 + math.sqrt(5)) / 16, rel=1e-14)
    assert b == pytest.approx(a, rel=1e-14)
    assert undisturbed(0.0) == (math.inf, 0.125)


POINTS = {
    "A1": (-0.05173952, 0.15258698),
    "A2": (-0.02586976, -0.23308046),
    "B1": (-0.05820696, -0.09515470),
    "B2": (-0.04096046, 0.14535120),
    "O1": (-0.01293488, 0.0),
    "O2": (-0.05605115, 0.0),
    "N": (-0.04915255, -0.14741302),
    "D": (0.01722792, 0.09741302),
    "L2": (0.27338473, -0.68795551),
    "K3": (0.02400599, -0.15620841),
    "M1": (-0.06467440, 0.0),
    "M2": (0.06467440, 0.0),
}


@pytest.mark.parametrize("name", POINTS)
def test_named_points_at_eight_and_one_tenth(name):
    c = contour(0.8, 0.1)
    # Eight digits are given; the rate of K3 agrees with its own abscissa to 6e-8.
    assert near(getattr(c, name), POINTS[name], abs=6e-8 if name == "K3" else 1e-8)


def test_c_is_a1_where_kappa1_is_the_smaller():
    c = contour(0.8, 0.1)
    assert kappa(0.8, 0.1)[0] < kappa(0.8, 0.1)[1]
    assert near(c.C, c.A1, rel=1e-12)
    assert near(c.L1, c.A1, rel=1e-12)
    c = contour(2 / 3, 0.05)
    assert near(c.D, c.B2, rel=1e-12)
    assert near(c.L2, c.A2, rel=1e-9)  # e = 0.05 magnifies rounding of D


def test_d_low():
    c = contour(0.8, 0.14)
    assert c.d_low
    assert near(c.D, (0.134934, -0.008145), abs=5e-7)  # six digits are given
    assert not contour(0.8, 0.137).d_low


@given(st.floats(0.02, 0.98), st.floats(0.0, 0.98))
def test_points_lie_on_the_lines_that_name_them(F, share):
    e = share * min(F, 1 - F)
    c = contour(F, e)
    ap, am, dm, dp = c.rates
    p = c.p
    rounding = pytest.approx(0, abs=1e-12 * p * max(1 / ap, 1 / am, 1 / dm, 1 / dp))
    assert c.A1.x + p - c.A1.v**2 / (2 * ap) == rounding
    assert c.A1.x - p + c.A1.v**2 / (2 * dm) == rounding
    assert c.A2.x + p - c.A2.v**2 / (2 * am) == rounding
    assert c.A2.x - p + c.A2.v**2 / (2 * dp) == rounding
    assert c.B1.x - c.O1.x + c.B1.v**2 / (2 * dm) == rounding
    assert c.B1.x + p - c.B1.v**2 / (2 * am) == rounding
    assert c.B2.x - c.O2.x - c.B2.v**2 / (2 * am) == rounding
    assert c.N.x - c.O1.x + c.N.v**2 / (2 * dp) == rounding
    for point, d in ((c.D, dp if c.d_low else dm), (c.K3, dp)):
        assert point.x - p + point.v**2 / (2 * d) == rounding
    assert c.C.x + p - c.C.v**2 / (2 * ap) == rounding
    assert c.C.x - c.cde(c.C.v) == pytest.approx(0, abs=1e-12 / am)
    assert c.D.x - c.cde(c.D.v) == pytest.approx(0, abs=1e-12 / am)


@given(st.floats(0.02, 0.98), st.floats(0.0, 0.98), st.floats(0.1, 3.0), st.floats(-1, 0.999))
def test_from_cde_the_lower_left_arc_is_the_on_time_away(F, share, on_time, v):
    e = share * min(F, 1 - F)
    c = contour(F, e, on_time=on_time)
    v *= on_time * c.rates.dp  # up to where the line is meant
    time = crossing(c.cde(v), v, -c.rates.dp, -c.p, 1 / (2 * c.rates.am))
    # The quadratic loses digits where its roots are close, as 1 - v/(T dp) tells.
    assert time == pytest.approx(on_time, rel=1e-7)


# -- borders in the plane of F and e -------------------------------------------------------------


@pytest.mark.parametrize(
    ("border", "figures"),
    [
        (equal_kappa, {2 / 3: 0.17155, 0.7: 0.14491, 0.8: 0.08279, 0.9: 0.03674}),
        (unit_contraction, {2 / 3: 0.22490, 0.7: 0.21358}),
        (low_d, {0.7: 0.22222, 0.75: 0.17800, 0.8: 0.13724, 0.85: 0.09938, 0.9: 0.06404}),
    ],
)
def test_borders(border, figures):
    for F, e in figures.items():
        assert border(F) == pytest.approx(e, abs=5.1e-6)  # five digits are given


def test_borders_are_where_they_say():
    for F in (0.68, 0.75, 0.85, 0.95):
        k1, k2 = kappa(F, equal_kappa(F))
        assert k1 == pytest.approx(k2, rel=1e-13)
        assert contraction(F, unit_contraction(F)) == pytest.approx(1, rel=1e-13)
        assert not contour(F, low_d(F) * (1 - 1e-9)).d_low
        assert contour(F, low_d(F) * (1 + 1e-9)).d_low


def test_borders_that_are_not_there():
    assert math.isnan(equal_kappa(0.3))
    assert math.isnan(low_d(0.3))
    assert math.isnan(optimal_up_to(0.5))
    with pytest.raises(ValueError, match="between 0 and 1, got 1"):
        equal_kappa(1.0)


def test_the_borders_cut_off_what_counting_finds():
    F = 2 / 3 + (np.arange(200) + 0.5) / 600
    height = 0.75 * (1 - F)
    counted = {unit_contraction: 0.0, low_d: 0.0}
    for f, top in zip(F.tolist(), height.tolist(), strict=True):
        cells = top * (np.arange(100) + 0.5) / 100
        assert all(in_optimal_region(f, e) for e in cells)
        counted[unit_contraction] += top * np.mean([contraction(f, e) >= 1 for e in cells])
        counted[low_d] += top * np.mean([contour(f, e).d_low for e in cells])
    for border, area in counted.items():
        left = [max(optimal_up_to(f) - border(f), 0.0) for f in F.tolist()]
        # Half a cell in each column that the border crosses: 1/200 of its height at most.
        assert area == pytest.approx(np.sum(left), abs=np.sum(height) / 200)
    # D is low on 6.7 % of (3.8), so said to a tenth.
    assert counted[low_d] / np.sum(height) == pytest.approx(0.067, abs=1e-3)


@pytest.mark.parametrize(
    ("F", "e", "there"),
    [(2 / 3, 0.25, True), (0.6666666, 0.1, False), (0.8, 0.15, True), (0.8, 0.16, False)],
)
def test_the_optimal_region_is_closed(F, e, there):
    assert in_optimal_region(F, e) is there


# -- the sets W1, W2, W3 --------------------------------------------------------------------------

NEVER = Relay(
    left=curve((-math.inf, -math.inf, 0, 0)), right=curve((-math.inf, math.inf, 0, 0)), left_level=0
)


def scattered(c, rng, count):
    """Points in the contour."""
    points = []
    while len(points) < count:
        x, v = rng.uniform(-c.p, c.p), rng.uniform(c.A2.v, c.A1.v)
        if inside(c, x, v):
            points.append((x, v))
    return points


@pytest.mark.parametrize(("F", "e"), [(2 / 3, 0.2), (0.8, 0.14), (0.9, 0.07), (0.5, 0.3)])
def test_a_pulse_stays_in_the_contour_if_it_begins_in_w1_and_not_otherwise(F, e):
    c, rng = contour(F, e), np.random.default_rng(1)
    found = {True: 0, False: 0}
    for x, v in scattered(c, rng, 300):
        stays = True
        for signs in FEEDBACKS[:4]:  # all there are while the thrust is on
            f = propagate(
                NEVER, start=(x, v), level=-1, bias=F, disturbance=feedback(e, signs), duration=1
            )
            path = zip(*f.at(np.linspace(0, 1, 41)), strict=True)
            stays &= all(inside(c, *z, slack=1e-9) for z in path)  # rounding
        assert stays is in_w1(c, x, v), (x, v)
        found[stays] += 1
    assert min(found.values()) > 3


@pytest.mark.parametrize(("F", "e"), [(2 / 3, 0.05), (2 / 3, 0.2), (0.9, 0.05)])
def test_from_w3_the_thrust_off_may_miss_w1(F, e):
    c, rng = contour(F, e), np.random.default_rng(2)
    ends = Relay(
        left=NEVER.left,
        right=curve((-math.inf, c.p, 0, -1 / (2 * c.rates.dp)), (0, c.p, 0, -1 / (2 * c.rates.dm))),
        left_level=0,
    )
    found = {True: 0, False: 0}
    for x, v in scattered(c, rng, 400):
        f = propagate(ends, start=(x, v), bias=F, disturbance=feedback(e, INNER), switchings=1)
        misses = bool(f.v[-1] < c.D.v)  # leaves below D, the lowest point of W1
        assert in_w3(c, x, v) is misses, (x, v)
        assert in_w2(c, x, v) is not misses
        found[misses] += 1
    assert min(found.values()) > 3


def test_w3_is_empty_where_d_is_low():
    c = contour(0.8, 0.14)
    points = scattered(c, np.random.default_rng(3), 300)
    assert all(in_w2(c, *z) and not in_w3(c, *z) for z in points)


# -- units and bad input -------------------------------------------------------------------------


@given(
    st.floats(1e-6, 1e2), st.floats(1e-3, 1e3), st.floats(-0.9, 0.9), st.floats(0, 1),
    st.floats(-10, 10), st.floats(-10, 10),
)  # fmt: skip
def test_units_go_there_and_back(u0, dt, f, share, angle, rate):
    e = share * (1 - abs(f)) * 0.99
    F, eps, scale = to_dimensionless(
        thrust_acceleration=u0, min_on_time=dt, bias=f * u0, disturbance=e * u0
    )
    assert near(F, abs(f), rel=1e-12, abs=1e-300)
    assert eps == pytest.approx(e, rel=1e-12, abs=1e-300)
    assume(abs(angle) > 1e-100 or angle == 0)
    back = scale.physical(*scale.reduced(angle, rate))
    assert back == pytest.approx((angle, rate), rel=1e-14, abs=1e-300)
    # A second later the angle has grown by the rate: the units belong together.
    x, v = scale.reduced(angle, rate)
    moved, _ = scale.physical(x + v * (1 / dt), v)
    assert moved == pytest.approx(angle + rate, rel=1e-9, abs=1e-9 * (abs(angle) + abs(rate)))


def test_a_negative_bias_is_mirrored():
    _, _, scale = to_dimensionless(
        thrust_acceleration=2.0, min_on_time=0.5, bias=-1.0, disturbance=0.0
    )
    assert scale.reduced(1.0, 1.0) == (-2.0, -1.0)


@pytest.mark.parametrize(
    ("F", "e", "message"),
    [
        (0.8, 0.2, r"F \+ eps = 1 must be < 1.*largest eps is below 0.2"),
        (0.3, 0.3, r"eps = 0.3 must be < F = 0.3.*infinite"),
        (0.0, 0.0, "infinite.*undisturbed"),
        (-0.5, 0.1, "F = -0.5.*mirrored"),
        (math.nan, 0.1, "finite"),
    ],
)
def test_bad_parameters_are_refused(F, e, message):
    for function in (kappa, guaranteed_accuracy, contraction, contour):
        with pytest.raises(ValueError, match=message):
            function(F, e)


def test_bad_sizes_are_refused():
    with pytest.raises(ValueError, match="half_width = 0"):
        contour(0.8, 0.1, half_width=0.0)
    with pytest.raises(ValueError, match=r"must be in \[0, 1\), got 1"):
        undisturbed(1.0)
    with pytest.raises(ValueError, match=r"below the acceleration of the thrust, 2.*below 0.5"):
        to_dimensionless(thrust_acceleration=2, min_on_time=1, bias=-1.5, disturbance=0.6)
    with pytest.raises(ValueError, match="min_on_time = 0"):
        to_dimensionless(thrust_acceleration=2, min_on_time=0, bias=1, disturbance=0)
