"""Input shapers: what defines them, reference figures, shaped manoeuvres."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from controllers.gorelov import min_peak, min_time, rigid_time
from controllers.input_shaping import (
    NONE,
    bang_bang,
    ei,
    ei_shaper,
    zv,
    zv_shaper,
    zvd,
    zvd_shaper,
)
from controllers.moments import modes_of
from controllers.plans import residual_vibration

ASKED = {"omega": 1.0, "damping": 0.02, "x1": 1.0}
MODES = st.tuples(st.floats(0.1, 20), st.floats(0, 0.5))
PLANS = {"bang_bang": bang_bang, "zv": zv, "zvd": zvd, "ei": ei}


def left(shaper, *, omega, zeta):
    """Vibration of a mode after the impulses, as a share of what one at the end would leave."""
    omega = np.asarray(omega)[..., None]
    back = complex(zeta, math.sqrt(1 - zeta**2)) * shaper.times - zeta * shaper.length
    return np.abs(np.sum(shaper.amplitudes * np.exp(omega * back), axis=-1))


# -- shapers ---------------------------------------------------------------------------------------


@given(MODES)
def test_zv_leaves_nothing(mode):
    w, zeta = mode
    shaper = zv_shaper(omega=w, damping=2 * zeta * w)
    assert shaper.amplitudes.sum() == pytest.approx(1)
    assert left(shaper, omega=w, zeta=zeta) < 1e-14
    assert shaper.length == pytest.approx(math.pi / (w * math.sqrt(1 - zeta**2)))


@given(MODES)
def test_zvd_leaves_nothing_to_first_order(mode):
    w, zeta = mode
    shaper = zvd_shaper(omega=w, damping=2 * zeta * w)
    assert shaper.amplitudes.sum() == pytest.approx(1)
    assert left(shaper, omega=w, zeta=zeta) < 1e-14
    # The zero is double: a per cent off leaves a square of a per cent, ten times as far a hundred.
    near, far = (left(shaper, omega=w * (1 + d), zeta=zeta) for d in (1e-4, 1e-3))
    assert far / near == pytest.approx(100, rel=0.02)
    assert left(zv_shaper(omega=w, damping=2 * zeta * w), omega=w * 1.001, zeta=zeta) > 10 * far


@settings(max_examples=30)
@given(st.floats(0.1, 20), st.floats(0, 0.4), st.floats(0.01, 0.1))
def test_ei_leaves_what_is_tolerated_and_nothing_on_either_side(w, zeta, tolerance):
    shaper = ei_shaper(omega=w, damping=2 * zeta * w, tolerance=tolerance)
    assert shaper.amplitudes.sum() == pytest.approx(1)
    assert np.all(shaper.amplitudes > 0)
    assert left(shaper, omega=w, zeta=zeta) == pytest.approx(tolerance, abs=1e-10)
    d = np.linspace(-0.6, 1.0, 6001)
    curve = left(shaper, omega=w * (1 + d), zeta=zeta)
    # Sampled at 3e-4: the curve falls to zero with a slope of a few.
    assert curve[d < 0].min() < 3e-3
    assert curve[d > 0].min() < 3e-3
    below, above = d[d < 0][np.argmin(curve[d < 0])], d[d > 0][np.argmin(curve[d > 0])]
    between = curve[(d > below) & (d < above)]
    # With damping the hump leans over: its top is a little off the frequency made for.
    assert between.max() < tolerance * (1 + zeta) + 1e-12


def test_ei_in_closed_form_without_damping():
    shaper = ei_shaper(omega=2.0, damping=0.0, tolerance=0.05)
    assert shaper.amplitudes == pytest.approx([1.05 / 4, 0.95 / 2, 1.05 / 4])
    assert shaper.times == pytest.approx([0, math.pi / 2, math.pi])


@pytest.mark.parametrize("zeta", [0.01, 0.05, 0.1, 0.2])
def test_ei_is_that_of_the_published_fit(zeta):
    """Singhose, Seering & Singer (1994): amplitudes fitted in V and zeta, good to a few 1e-4."""
    V = 0.05
    first = 0.24968 + 0.24961 * V + 0.80008 * zeta + 1.23328 * V * zeta
    first += 0.49599 * zeta**2 + 3.17316 * V * zeta**2
    last = 0.25149 + 0.21474 * V - 0.83249 * zeta + 1.41498 * V * zeta
    last += 0.85181 * zeta**2 - 4.90094 * V * zeta**2
    shaper = ei_shaper(omega=1.0, damping=2 * zeta, tolerance=V)
    assert shaper.amplitudes[[0, 2]] == pytest.approx([first, last], abs=1e-3)


def test_ei_that_is_not_there():
    assert ei_shaper(omega=1.0, damping=1.2).amplitudes.sum() == pytest.approx(1)  # ratio 0.6
    with pytest.raises(ValueError, match=r"no EI shaper found .* ratio of 0.8 .* lost at .* 0\.6"):
        ei_shaper(omega=1.0, damping=1.6)
    with pytest.raises(ValueError, match="no EI shaper found"):
        ei_shaper(omega=1.0, damping=0.9, tolerance=0.2)
    for tolerance, words in ((0.0, "tolerance = 0.0"), (1.0, "take less than 1")):
        with pytest.raises(ValueError, match=words):
            ei_shaper(omega=1.0, damping=0.1, tolerance=tolerance)
    with pytest.raises(ValueError, match="not underdamped"):
        zv_shaper(omega=1.0, damping=2.0)


def test_shapers_combine():
    both = zv_shaper(omega=1.0, damping=0.1).convolved(zvd_shaper(omega=2.7, damping=0.2))
    assert len(both.times) == 6
    assert np.all(np.diff(both.times) >= 0)
    assert both.amplitudes.sum() == pytest.approx(1)
    for w, b in ((1.0, 0.1), (2.7, 0.2)):
        assert left(both, omega=w, zeta=b / 2 / w) < 1e-14
    alone = both.convolved(NONE)
    assert alone.amplitudes.tolist() == both.amplitudes.tolist()


# -- manoeuvres: reference figures -----------------------------------------------------------------

OFF = np.array([-0.2, -0.1, -0.05, 0.05, 0.1, 0.2])
FIGURES = [  # T, plan, peak, fuel, left at the frequency, left off it
    (9, "bang_bang", ".04938", ".44444", ".1144", ".2800 .1884 .1491 .0847 .0598 .0240"),
    (9, "zv", ".05919", ".37115", "", ".1827 .0807 .0375 .0317 .0575 .0924"),
    (9, "zvd", ".27096", "1.47248", "", ".0827 .0206 .0051 .0050 .0194 .0728"),
    (14, "bang_bang", ".02041", ".28571", ".00945", ".0135 .00012 .0029 .0179 .0267 .0402"),
    (14, "zv", ".03393", ".26347", "", ".0416 .0101 .0031 .00075 .00041 .00038"),
    (14, "zvd", ".05091", ".30727", "", ".0374 .0074 .0016 .0011 .0037 .0090"),
    (30, "bang_bang", ".00444", ".13333", ".01355", ".0020 .0039 .0095 .0140 .0108 .0019"),
    (30, "zv", ".00555", ".13178", "", ".0058 .00023 .00002 .0007 .0020 .0039"),
    (30, "zvd", ".00711", ".14631", "", ".0037 .00049 .00006 .0000009 .00003 .0009"),
]


def digits(text):
    return pytest.approx(float(text), abs=10.0 ** -len(text.split(".")[1]), rel=0)


@pytest.mark.parametrize(("T", "kind", "peak", "fuel", "nominal", "off"), FIGURES)
def test_figures(T, kind, peak, fuel, nominal, off):
    plan = PLANS[kind](**ASKED, duration=T)
    assert plan.duration == T
    assert plan.peak == digits(peak)
    assert plan.fuel == digits(fuel)
    at_nominal = float(residual_vibration(plan, omega=1.0, damping=0.02))
    assert at_nominal == digits(nominal) if nominal else at_nominal < 1e-15
    got = residual_vibration(plan, omega=1 + OFF, damping=0.02)
    for x, printed in zip(got, off.split(), strict=True):
        assert float(x) == digits(printed)


TIMES = [  # omega, damping, bound, ZV, ZVD
    (1, 0.02, 0.05, "12.08602", "15.22777"),
    (1, 0.02, 5, "4.03618", "7.17793"),
    (0.5, 0.005, 0.1, "12.60782", "18.89108"),
    (1, 1, 0.1, "9.95215", "13.57975"),
]


@pytest.mark.parametrize(("omega", "damping", "bound", "one", "two"), TIMES)
def test_durations_for_a_bound(omega, damping, bound, one, two):
    asked = {"omega": omega, "damping": damping, "x1": 1.0, "bound": bound}
    assert zv(**asked).duration == digits(one)
    assert zvd(**asked).duration == digits(two)
    rigid = rigid_time(bound=bound, x0=0.0, v0=0.0, x1=1.0, v1=0.0)
    assert bang_bang(**asked).duration == pytest.approx(rigid)
    assert bang_bang(**asked).peak == pytest.approx(bound)
    for plan in (zv(**asked), zvd(**asked)):
        assert plan.peak <= bound * (1 + 1e-12)
        assert plan.residual < 1e-12
        # What the shaper leaves still is slower than need be.
        assert min_time(**asked).duration < plan.duration


@pytest.mark.parametrize("kind", PLANS)
def test_the_turn_is_made_whatever_the_modes(kind):
    asked = {"omega": [1.0, 2.3], "damping": [0.02, 0.1], "x0": 0.5, "x1": -0.5}
    plan = PLANS[kind](**asked, duration=25.0)
    got = plan.moments(modes_of(asked["omega"], asked["damping"]))
    assert got[:2] == pytest.approx([-1.0, 0.0], abs=1e-12)
    assert len(plan.levels) == len(plan.switch_times) + 1
    assert np.all(np.diff(plan.switch_times) > 0)
    if kind in ("zv", "zvd"):
        assert plan.residual < 1e-12
        least = min_peak(**asked, duration=25.0)
        assert least.peak < plan.peak


def test_ei_leaves_a_share_of_what_the_command_would():
    w, b, V = 1.3, 0.1, 0.05
    shaper = ei_shaper(omega=w, damping=b, tolerance=V)
    command = bang_bang(omega=w, damping=b, x1=1.0, duration=9.0)
    shaped = ei(omega=w, damping=b, x1=1.0, duration=9.0 + shaper.length, tolerance=V)
    before, after = (residual_vibration(x, omega=w, damping=b) for x in (command, shaped))
    assert before > 1e-3
    assert after == pytest.approx(V * before, rel=1e-9)


def test_steps_that_meet_are_one():
    """Half the command as long as the shaper: the reversal of one and the end of another meet."""
    half = math.pi
    plan = zv(omega=1.0, damping=0.0, x1=1.0, duration=3 * half)
    assert plan.switch_times == pytest.approx([half, 2 * half], abs=1e-12)
    level = plan.levels[0]
    assert plan.levels == pytest.approx([level, 0.0, -level], abs=1e-12)
    assert plan.levels[1] == 0.0


def test_steps_that_cancel_are_none():
    """The reversal of the first quarter of the command meets the start of its half."""
    half = math.pi
    plan = zvd(omega=1.0, damping=0.0, x1=1.0, duration=4 * half)
    assert plan.switch_times == pytest.approx([2 * half], abs=1e-12)
    assert plan.levels[0] == -plan.levels[1]


# -- bad input -------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", PLANS)
def test_bad_input(kind):
    plan = PLANS[kind]
    for size in ({}, {"duration": 20.0, "bound": 1.0}):
        with pytest.raises(ValueError, match="give duration or bound, one of them"):
            plan(**ASKED, **size)
    for size in ({"duration": 20.0}, {"bound": 1.0}):
        with pytest.raises(ValueError, match="the manoeuvre is empty"):
            plan(**ASKED | {"x1": 0.0}, **size)
    with pytest.raises(ValueError, match="bound = -1"):
        plan(**ASKED, bound=-1.0)
    with pytest.raises(ValueError, match="x1 = nan"):
        plan(**ASKED | {"x1": math.nan}, bound=1.0)
    if kind != "bang_bang":
        with pytest.raises(ValueError, match=r"duration = 3 s is too short: .* alone take"):
            plan(**ASKED, duration=3.0)
