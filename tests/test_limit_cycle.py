"""Limit cycles: closed forms, cycles with modes against the simulator, the delay margin."""

import math

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from controllers.efremov import limit_cycle
from spacecraft_sim import beam
from spacecraft_sim.limit_cycle import delay_margin, limit_cycles
from spacecraft_sim.modal_form import system_of
from spacecraft_sim.reduced import galerkin_model
from spacecraft_sim.relay_system import RelaySystem, Row, State, propagate

ANGLE, RATE = Row(angle=1.0), Row(rate=1.0)
LEVEL = 0.007


def rigid(c=0.31, level=LEVEL):
    return RelaySystem(switching=Row(angle=c, rate=1.0), levels=(level,))


def flexible(modes):
    """A bus with the booms of Efremov et al. 2006 under feedback of its own attitude and rate."""
    coefficients = beam.galerkin(
        bus_inertia=30.0, root_radius=3.0, length=7.5, linear_density=1.53,
        bending_stiffness=35.0, damping_time=0.018542, n_modes=modes,
    )  # fmt: skip
    model = galerkin_model(coefficients, torques={"u": 1.0}, tips={})
    return system_of(
        model, channel="u", switching={"attitude_z": 0.31, "rate_z": 1.0}, levels=(LEVEL,)
    )


FLEXIBLE = {modes: flexible(modes) for modes in (1, 3)}


def vector(state):
    return np.array([state.angle, state.rate, *state.modes])


def half_periods(cycle, *, halves, push=0.0):
    """Times between zeros of s in a run that starts off the cycle by a share of its rate."""
    run = propagate(
        cycle.system,
        start=cycle.start._replace(rate=cycle.start.rate * (1 + push)),
        duration=halves * cycle.period / 2,
        delay=cycle.delay,
        acting=-cycle.system.levels[0],
        pending=cycle.pending,
    )
    return np.diff(run.switch_times)[1:]  # the first command is that of the start


# -- closed forms ------------------------------------------------------------------------------


@given(st.floats(0.01, 0.95), st.floats(0.01, 10), st.floats(1e-4, 100))
@example(0.75, 1.0, 1.0)  # the period falls on a round number
def test_without_modes_there_is_one_stable_cycle_in_closed_form(ch, delay, level):
    c = ch / delay
    (cycle,) = limit_cycles(rigid(c, level), delay=delay)
    exact = limit_cycle(c=c, delay=delay, level=level)
    # The root of s(P - h) = 0 loses digits as 1/(1 - ch), at most a factor of 20 here.
    assert cycle.period == pytest.approx(exact.period, rel=1e-12)
    assert cycle.peak(RATE) == pytest.approx(exact.v_max, rel=1e-12)
    assert cycle.peak(ANGLE) == pytest.approx(exact.beta_max, rel=1e-12)
    if ch < 2 - math.sqrt(2):  # V < p/c: |s| is largest where v turns, at beta = 0
        assert cycle.peak(cycle.system.switching) == pytest.approx(exact.v_max, rel=1e-12)
    assert cycle.stable


@pytest.mark.parametrize(("ch", "delay"), [(1.0, 0.5), (1.1, 0.5), (5.0, 2.0)])
def test_without_modes_there_is_none_beyond_one_over_c(ch, delay):
    assert limit_cycles(rigid(ch / delay), delay=delay) == []


@pytest.mark.parametrize("ch", [0.062, 0.3, 0.7])
def test_the_multiplier_is_the_rate_at_which_a_run_settles(ch):
    (cycle,) = limit_cycles(rigid(0.31), delay=ch / 0.31)
    error = half_periods(cycle, halves=14, push=1e-4) - cycle.period / 2
    ratio = np.abs(error[4:9] / error[3:8])
    # What is left is of second order in a push of 1e-4.
    assert ratio == pytest.approx(cycle.multiplier, rel=5e-3)


@pytest.mark.parametrize("ch", [0.9985, 0.9995, 0.99999])
def test_without_modes_the_cycle_is_stable_up_to_one_over_c(ch):
    # Its half period grows without bound, to 1e5 delays for the last.
    (cycle,) = limit_cycles(rigid(0.31), delay=ch / 0.31)
    exact = limit_cycle(c=0.31, delay=ch / 0.31, level=LEVEL)
    # s is the difference of c beta and v, both some p/(c (1 - ch)): an ulp of them over s' there.
    assert cycle.period == pytest.approx(exact.period, rel=2**-52 / (1 - ch) ** 2)
    assert cycle.stable


@pytest.mark.slow
@pytest.mark.parametrize("upper", [4.0, 10.0])
def test_the_rigid_delay_margin_is_one_over_c(upper):
    # Settled to 1e-9 by bisection; at 1 - 1e-5 the cycle is 1e5 delays long and still exists.
    assert 0.31 * delay_margin(rigid(0.31), upper=upper) == pytest.approx(1.0, abs=1e-5)


# -- cycles with modes -------------------------------------------------------------------------

CASES = [
    (modes, delay)
    for modes, delays in ((1, (0.02, 0.2, 0.5, 1.0, 2.5)), (3, (0.05, 0.2, 0.4, 0.5, 0.8, 1.0)))
    for delay in delays
]


@pytest.mark.parametrize(("modes", "delay"), CASES)
def test_what_is_found_is_a_cycle(modes, delay):
    cycles = limit_cycles(FLEXIBLE[modes], delay=delay)
    assert cycles
    for cycle in cycles:
        half = cycle.period / 2
        run = propagate(
            cycle.system, start=cycle.start, duration=half, delay=delay, acting=-LEVEL,
            pending=cycle.pending,
        )  # fmt: skip
        end = vector(run.states[-1])
        scale = np.max(np.abs(vector(cycle.start)))
        # brentq leaves 1e-15 s of the period, the flow a few roundings.
        assert end == pytest.approx(-vector(cycle.start), abs=1e-12 * scale)
        # The command of the start, and the turn that is a delay ahead of the end or its like.
        turn = 1 if math.floor(delay / half) % 2 == 0 else -1
        assert run.commands.tolist() == [-turn * LEVEL, turn * LEVEL]
        assert run.switch_times[1] == pytest.approx(half - delay % half, abs=1e-11)


@pytest.mark.parametrize(("modes", "delay"), CASES)
def test_stable_cycles_attract_and_unstable_ones_repel(modes, delay):
    for cycle in limit_cycles(FLEXIBLE[modes], delay=delay):
        n = 40 if not cycle.stable else math.ceil(3 / -math.log(cycle.multiplier))
        if n > 4000:  # a multiplier of .9999 shows too slowly
            continue
        push = 1e-6
        error = np.abs(half_periods(cycle, halves=n + 12, push=push) - cycle.period / 2)
        first, last = np.max(error[:6]), np.max(error[-6:])
        if cycle.stable:
            assert last < 0.5 * first  # three time constants: e^-3 and a beat
        elif cycle.multiplier > 1.1:
            assert last > 10 * first  # 40 half periods at 1.1 each: 45 times


def test_several_cycles_at_one_delay_differ_in_stability():
    cycles = limit_cycles(FLEXIBLE[3], delay=0.4)
    assert [cycle.stable for cycle in cycles] == [True, False, False]
    assert [c.period for c in cycles] == sorted(c.period for c in cycles)


@pytest.mark.parametrize("delay", [1.2, 1.5])
def test_a_cycle_faster_than_the_delay_is_found_too(delay):
    # From a hub at rest the run settles in a cycle whose half period is shorter than the delay.
    system = FLEXIBLE[3]
    run = propagate(system, start=State(0.001, 0.0, (0j,) * 3), duration=4000.0, delay=delay)
    settled = 2 * np.diff(run.switch_times[-8:])
    assert np.ptp(settled) < 1e-6  # a cycle it is, to what 4000 s leave of the transient
    assert settled.mean() / 2 < delay
    periods = [cycle.period for cycle in limit_cycles(system, delay=delay)]
    assert min(abs(p - settled.mean()) for p in periods) < 1e-6


@pytest.mark.slow
@pytest.mark.parametrize("upper", [5.0, 6.0])
def test_the_delay_margin_does_not_depend_on_where_the_search_ends(upper):
    # The loss at .5154 s is followed by another stable cycle, a tenth farther on.
    margin = delay_margin(FLEXIBLE[3], upper=upper)
    assert margin == pytest.approx(delay_margin(FLEXIBLE[3], upper=8.0), rel=1e-8)  # bisection


def test_the_delay_margin_with_modes_is_where_runs_stop_settling():
    system = FLEXIBLE[3]
    margin = delay_margin(system, upper=5.0)
    shown = []
    for share in (0.99, 1.01):
        below = limit_cycles(system, delay=min(share, 0.999) * margin)
        cycle = next(c for c in below if c.stable)
        late = max(share * margin - cycle.period / 2, 0.0)
        run = propagate(
            system, start=cycle.start, duration=600.0, delay=share * margin, acting=-LEVEL,
            pending=[(cycle.period / 2, LEVEL)] if late else [],
        )  # fmt: skip
        shown.append(np.ptp(np.diff(run.switch_times)[-50:]) / cycle.period)
    # 1200 half periods of a multiplier of .992 leave 1e-4 of the start's own error; an unstable
    # cycle wanders by a share of its period.
    assert shown[0] < 1e-5
    assert shown[1] > 1e-2


def test_a_margin_outside_the_search_is_refused():
    with pytest.raises(ValueError, match=r"up to 1\.0 s; raise upper"):
        delay_margin(rigid(0.31), upper=1.0)
    with pytest.raises(ValueError, match=r"no stable limit cycle even at a delay of"):
        delay_margin(rigid(0.31), upper=1e4)


@pytest.mark.parametrize("delay", [0.0, -1.0, math.nan])
def test_a_limit_cycle_needs_a_delay(delay):
    with pytest.raises(ValueError, match=f"> 0: delay = {delay}"):
        limit_cycles(rigid(), delay=delay)


# -- the scalar equation (4.1), x' = lambda x - p sign x(t - h) ------------------------------------


def scalar(rate, delay, p, *, x, history, switchings):
    """Exact propagation: zeros of x and the extremes between them; stops when x cannot return."""
    t, u, queue, sign = 0.0, -history * p, [], math.copysign(1.0, x)
    if sign != history:
        queue.append((delay, -sign * p))
    zeros, extremes = [], []
    while len(zeros) < switchings:
        end = queue[0][0] if queue else math.inf
        rest = -u / rate  # x = rest + (x - rest) e^(rate t)
        ratio = rest / (rest - x)
        tau = math.log(ratio) / rate if ratio > 1 and x != 0 else math.inf
        if tau < end - t:
            t, x, sign = t + tau, 0.0, -sign
            zeros.append(t)
            queue.append((t + delay, -sign * p))
            continue
        if end == math.inf:
            return zeros, extremes, False  # moves away under a torque that will not change
        x = rest + (x - rest) * math.exp(rate * (end - t))
        t, u = queue.pop(0)
        extremes.append(abs(x))
    return zeros, extremes, True


@pytest.mark.parametrize("p", [1.0, 5.0])
@pytest.mark.parametrize("product", [0.1, 0.4, 0.69, 0.6925])
def test_the_scalar_cycle_has_the_amplitude_and_period_of_the_closed_form(product, p):
    rate = 2.0
    zeros, extremes, returns = scalar(rate, product / rate, p, x=1e-3, history=1, switchings=60)
    assert returns
    growth = math.exp(product)
    # Each half period is a closed form of the last: rounding, magnified by 1/(2 - e^(lambda h)).
    loss = 1e-14 / (2 - growth)
    assert extremes[-20:] == pytest.approx([p * (growth - 1) / rate] * 20, rel=loss)
    period = 2 * (product - math.log(2 - growth)) / rate
    assert 2 * np.diff(zeros[-20:]) == pytest.approx(period, rel=max(loss, 1e-13))  # clock of 60 T


def test_the_scalar_figures():
    zeros, extremes, _ = scalar(1.0, 0.4, 1.0, x=0.1, history=1, switchings=60)
    # Eight digits are given.
    assert extremes[-1] == pytest.approx(0.4918247, abs=5e-8)
    assert 2 * (zeros[-1] - zeros[-2]) == pytest.approx(2.1538576, abs=5e-8)


@pytest.mark.parametrize("product", [0.694, 0.75, 2.0])
def test_the_scalar_equation_diverges_from_ln_2_on(product):
    _, extremes, returns = scalar(1.0, product, 1.0, x=1e-3, history=1, switchings=60)
    assert not returns
    assert extremes[-1] > 1.0  # beyond p/lambda the torque is too weak


@pytest.mark.parametrize(("share", "stays"), [(0.99, True), (1.01, False)])
def test_the_scalar_equation_is_stable_only_locally(share, stays):
    zeros, _, returns = scalar(1.0, 0.4, 1.0, x=share, history=1, switchings=60)
    assert returns is stays
    assert (len(zeros) == 60) is stays
