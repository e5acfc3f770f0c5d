"""Random manoeuvres: moments, bounds and order of costs; refusals that say what would do."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given, settings
from hypothesis import strategies as st

from controllers.gorelov import min_energy, min_fuel, min_peak, min_time, rigid_time
from controllers.moments import modes_of, targets

RATES = st.one_of(st.just((0.0, 0.0)), st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)))


@st.composite
def manoeuvres(draw, modes=1):
    """Omega, damping, duration and ends; the slowest mode turns by 1 to 60 rad."""
    slowest = draw(st.floats(0.1, 10))
    ratios = draw(st.lists(st.floats(1.4, 4), min_size=modes - 1, max_size=modes - 1))
    omega = slowest * np.cumprod([1.0, *ratios])
    zeta = np.array(draw(st.lists(st.floats(0, 0.6), min_size=modes, max_size=modes)))
    T = draw(st.floats(1.0 if modes == 1 else 5.0, 60)) / slowest
    v0, v1 = draw(RATES)
    x1 = draw(st.floats(-3, 3))
    asked = {
        "omega": tuple(omega), "damping": tuple(2 * zeta * omega), "duration": T,
        "x1": x1, "v0": v0 / T, "v1": v1 / T,
    }  # fmt: skip
    assume(abs(x1 - v0) + abs(v1 - v0) > 1e-3)
    return asked


def check(asked, ratio):
    modes = modes_of(asked["omega"], asked["damping"])
    ends = {k: asked[k] for k in ("x1", "v0", "v1")}
    c = targets(modes, duration=asked["duration"], x0=0.0, **ends)
    energy, peak = min_energy(**asked), min_peak(**asked)
    fuel = min_fuel(**asked, bound=ratio * peak.peak)
    plans = (energy, peak, fuel)
    assert max(plan.residual for plan in plans) < 1e-10
    assert fuel.peak <= ratio * peak.peak
    # Each is least in what it is named after; gaps of 1e-10 are accepted.
    assert energy.energy <= min(peak.energy, fuel.energy) * (1 + 1e-9)
    assert peak.peak <= min(energy.peak, fuel.peak) * (1 + 1e-9)
    assert fuel.fuel <= peak.fuel * (1 + 1e-9)
    assert fuel.fuel >= abs(c[1]) * (1 - 1e-9)
    # By the closed forms of the moments, and of the norms.
    size = np.abs(modes.functions(np.linspace(0, asked["duration"], 65))).max(axis=1)
    for plan in plans:
        assert plan.moments(modes) == pytest.approx(c, abs=1e-9 * float(size.max()) * plan.fuel)
        assert plan.energy**2 <= plan.peak * plan.fuel * (1 + 1e-12)
        assert plan.fuel**2 <= plan.duration * plan.energy**2 * (1 + 1e-12)
    for plan in (peak, fuel):
        assert len(plan.levels) == len(plan.switch_times) + 1
        assert np.all(np.diff(plan.switch_times, prepend=0, append=plan.duration) > 0)
    return peak


@settings(max_examples=25)
@given(manoeuvres(), st.floats(1.0, 50))
def test_one_mode(asked, ratio):
    peak = check(asked, ratio)
    if asked["v0"] == asked["v1"] == 0 and len(peak.switch_times) >= 3:
        turns = max(asked["omega"]) * asked["duration"] / math.pi
        assert len(peak.switch_times) <= math.floor(turns) + 3


@settings(max_examples=8)
@given(manoeuvres(modes=2), st.floats(1.0, 50))
def test_two_modes(asked, ratio):
    check(asked, ratio)


@pytest.mark.slow
@settings(max_examples=80)
@given(st.integers(1, 4).flatmap(lambda n: manoeuvres(modes=n)), st.floats(1.0, 50))
def test_one_to_four_modes(asked, ratio):
    check(asked, ratio)


@settings(max_examples=8)
@given(manoeuvres())
def test_the_least_time_is_the_first_that_will_do(asked):
    peak = min_peak(**asked).peak
    free = {k: v for k, v in asked.items() if k != "duration"}
    plan = min_time(**free, bound=peak)
    assert plan.peak <= peak
    assert plan.residual < 1e-10
    assert plan.duration <= asked["duration"] * (1 + 1e-10)
    shortest = rigid_time(bound=peak, x0=0.0, v0=asked["v0"], x1=asked["x1"], v1=asked["v1"])
    assert plan.duration >= shortest * (1 - 1e-12)
    for share in (0.999, 0.9, 0.6):
        T = share * plan.duration
        assume(T * max(asked["omega"]) > 0.3)
        assert min_peak(**asked | {"duration": T}).peak > peak


def rigid_body_can(*, duration, bound, x1, v0, v1, slack=0.0):
    """Whether |u| <= m0 takes x'' = u there: thrust forward as early as possible goes farthest."""
    first, impulse = x1 - duration * v0, v1 - v0
    if abs(impulse) > bound * duration + slack:
        return False
    backward = (duration - impulse / bound) / 2
    reach = bound * (duration**2 / 2 - backward**2) - impulse * duration / 2
    return abs(first - impulse * duration / 2) <= reach + slack


@given(st.floats(-3, 3), RATES, st.floats(0.05, 5))
@example(0.5, (0.0, 1.0), 1.0)  # one pulse, in two ways
@example(-0.5, (1.0, 0.0), 1.0)
@example(1.5, (1.0, 2.0), 1.0)
def test_least_time_of_a_rigid_body(x1, rates, bound):
    v0, v1 = rates
    assume(abs(x1) + abs(v1 - v0) > 1e-3)
    T = rigid_time(bound=bound, x0=0.0, v0=v0, x1=x1, v1=v1)
    task = {"bound": bound, "x1": x1, "v0": v0, "v1": v1}
    # Where a pulse has no length the time is known to the root of the rounding error; just after
    # such a time the bound may not suffice again.
    assert rigid_body_can(duration=T, **task, slack=1e-6)
    earlier = np.linspace(0.01, 1, 60) * (T - 1e-6)
    assert not any(rigid_body_can(duration=float(x), **task) for x in earlier)


@pytest.mark.parametrize(("omega", "damping", "T"), [
    (0.2130754307579008, 0.000295, 1.1132916192893891),  # a quarter of a rad in all
    ([1.9550597567096597, 1.0467925881292086], [0.0, 0.0], 1.0720649272486091),
    ([1.0, 3.56, 2.37], [0.0, 0.0, 0.0], 4.510038763400545),
])  # fmt: skip
def test_least_time_of_short_manoeuvres(omega, damping, T):
    """The search sets out from the time of a rigid body, where the modes hardly turn at all."""
    peak = min_peak(omega=omega, damping=damping, duration=T, x1=-1.24).peak
    plan = min_time(omega=omega, damping=damping, bound=peak, x1=-1.24)
    assert plan.duration == pytest.approx(T, rel=1e-10)
    assert plan.peak == peak
    assert plan.residual < 1e-10


@pytest.mark.parametrize(("x1", "v0", "v1", "bound"), [
    (0.5, 0.0, 1.0, 1.0),
    (0.07777645942097768, 0.29, 0.86, 4.214),  # the other pulse starts at a square of -1e-17
    (-0.258066132264529, -0.76, -0.25, 0.998),  # the other pulse is -1e-16 s long
])  # fmt: skip
def test_one_pulse_is_a_rigid_bodys_fastest(x1, v0, v1, bound):
    time = rigid_time(bound=bound, x0=0.0, v0=v0, x1=x1, v1=v1)
    assert time == pytest.approx(abs(v1 - v0) / bound, abs=1e-6)  # the root of the rounding error


def test_least_time_from_where_the_mode_turns_by_a_twentieth_of_a_radian():
    asked = {
        "omega": 0.2085738479629738, "damping": 0.14132,
        "x1": -0.29488942970262855, "v0": 0.8297737742669226, "v1": 0.44140872633985717,
    }  # fmt: skip
    peak = min_peak(**asked, duration=1.8401354166626378).peak
    plan = min_time(**asked, bound=peak)
    assert plan.duration < 1.8401354166626378  # the first that will do, with rates
    assert min_peak(**asked, duration=plan.duration).peak == pytest.approx(peak, rel=1e-9)
    assert plan.residual < 1e-10


def test_more_modes_cost_more():
    asked = {"duration": 9.0, "x1": 1.0}
    omega, damping = [1.0, 2.6, 5.1], [0.02, 0.1, 0.3]
    peaks = [min_peak(omega=omega[:n], damping=damping[:n], **asked).peak for n in (1, 2, 3)]
    assert peaks == sorted(peaks)
    times = [
        min_time(omega=omega[:n], damping=damping[:n], x1=1.0, bound=0.2).duration
        for n in (1, 2, 3)
    ]
    assert times == sorted(times)


# -- refusals --------------------------------------------------------------------------------------

GOOD = {"omega": 1.0, "damping": 0.02, "duration": 8.0, "x1": 1.0}


def test_a_bound_below_the_least_peak_names_the_least_peak_and_the_least_time():
    with pytest.raises(ValueError, match=r"bound = 0\.05 is too small") as refusal:
        min_fuel(**GOOD, bound=0.05)
    assert "the least peak there is 0.0826698108258" in str(refusal.value)
    assert "first suffices for 9.42309698041 s" in str(refusal.value)


INFEASIBLE = [
    ({"omega": 1.0, "damping": 0.02, "duration": 8.0}, 0.0826698108258, 0.999),
    ({"omega": 1.0, "damping": 0.0, "duration": 5.0}, 0.520529672840, 0.9),
    ({"omega": 1.0, "damping": 0.02, "duration": 2.0}, 23.2280531851, 0.5),
]


@pytest.mark.parametrize(("asked", "least", "share"), INFEASIBLE)
def test_infeasible_bounds(asked, least, share):
    with pytest.raises(ValueError, match="is too small for a duration of"):
        min_fuel(**asked, x1=1.0, bound=share * least)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"damping": 2.0}, "not underdamped"),
        ({"damping": -0.02}, "damping = -0.02"),
        ({"omega": [1.0, 2.0]}, "omega has 2 values and damping 1"),
        ({"omega": math.nan}, "omega = nan"),
        ({"x1": math.inf}, "x1 = inf"),
        ({"v0": math.nan}, "v0 = nan"),
        ({"x1": 0.0}, "the manoeuvre is empty"),
    ],
)
def test_bad_input(change, words):
    asked = GOOD | change
    free = {k: v for k, v in asked.items() if k != "duration"}
    for law in (min_energy, min_peak):
        with pytest.raises(ValueError, match=words):
            law(**asked)
    with pytest.raises(ValueError, match=words):
        min_fuel(**asked, bound=1.0)
    with pytest.raises(ValueError, match=words):
        min_time(**free, bound=1.0)


@pytest.mark.parametrize("duration", [0.0, -1.0, math.nan])
def test_bad_durations(duration):
    for law in (min_energy, min_peak):
        with pytest.raises(ValueError, match="duration"):
            law(**GOOD | {"duration": duration})


@pytest.mark.parametrize("bound", [0.0, -1.0, math.nan, math.inf])
def test_bad_bounds(bound):
    with pytest.raises(ValueError, match="bound"):
        min_fuel(**GOOD, bound=bound)
    with pytest.raises(ValueError, match="bound"):
        min_time(omega=1.0, damping=0.02, x1=1.0, bound=bound)


def test_an_empty_manoeuvre_with_rates():
    with pytest.raises(ValueError, match="the manoeuvre is empty"):
        min_time(omega=1.0, damping=0.02, x0=0.3, x1=0.3, v0=0.1, v1=0.1, bound=1.0)
