"""Relay systems against printed figures, 40 digits and other integrators."""

import math
from itertools import pairwise

import mpmath
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from controllers.efremov import attracting, limit_cycle
from spacecraft_sim import beam, curve
from spacecraft_sim.delay import Delay
from spacecraft_sim.disturbance import Torque
from spacecraft_sim.modal_form import modal_form, row_of, system_of
from spacecraft_sim.reduced import galerkin_model, galerkin_start
from spacecraft_sim.relay_system import RelaySystem, Row, State, propagate
from spacecraft_sim.scenario import Initial

ANGLE, RATE = "quasi_rigid_angle_z", "quasi_rigid_rate_z"
# Section 5 of Efremov et al. 2006: one mode, five levels, per unit of inertia.
TONE = {"p": 22.335, "a": 11.06, "b": 0.72, "c": 38.83}
PRINTED = beam.Galerkin(J=1183.24, **{name: np.array([x]) for name, x in TONE.items()})
THRESHOLDS = tuple(0.0045 * 3**i for i in range(4))
LEVELS = tuple(0.007 * 3**k for k in range(5))
RIGID = RelaySystem(switching=Row(angle=0.31, rate=1.0), levels=(0.007,))


C, LEVEL, DELAY, DURATION = 0.31, 0.007, 0.3664, 100.0


def flexible(modes):
    """A bus with the authors' booms under feedback of its own attitude and rate."""
    coefficients = beam.galerkin(
        bus_inertia=30.0, root_radius=3.0, length=7.5, linear_density=1.53,
        bending_stiffness=35.0, n_modes=modes,
        damping_time=0.018542 / max(1.0, modes / 3) ** 2,  # keeps every mode underdamped
    )  # fmt: skip
    model = galerkin_model(coefficients, torques={"u": 1.0}, tips={})
    return system_of(
        model, channel="u", switching={"attitude_z": C, "rate_z": 1.0}, levels=(LEVEL,)
    )


SYSTEMS = {0: RIGID} | {modes: flexible(modes) for modes in (1, 3, 10)}


def matrices(system):
    """Real A, b, c of x' = A x + b u, s = c x, with x = (beta, v, Re z, Im z, ...)."""
    n = 2 + 2 * len(system.eigenvalues)
    A, b, c = np.zeros((n, n)), np.zeros(n), np.zeros(n)
    A[0, 1], b[1], c[:2] = 1.0, 1.0, (system.switching.angle, system.switching.rate)
    rows = zip(system.eigenvalues, system.drive, system.switching.modes, strict=True)
    for k, (x, g, d) in enumerate(rows):
        i = slice(2 + 2 * k, 4 + 2 * k)
        A[i, i] = [[x.real, -x.imag], [x.imag, x.real]]
        b[i], c[i] = (g.real, g.imag), (2 * d.real, -2 * d.imag)
    return A, b, c


def at_rest(system, angle=0.001):
    return State(angle, 0.0, (0j,) * len(system.eigenvalues))


def multilevel(system):
    """The same plant under the five levels of section 5."""
    return RelaySystem(
        switching=system.switching, thresholds=THRESHOLDS, levels=LEVELS,
        eigenvalues=system.eigenvalues, drive=system.drive,
    )  # fmt: skip


def adaptive(system, *, start, duration, arrive, force=lambda t: 0.0, breaks=(), pending=(), u=0.0):
    """DOP853 from effect to effect, stopped at every bound of s: switchings and final state."""
    A, b, c = matrices(system)
    z = [part for mode in start.modes for part in (mode.real, mode.imag)]
    x, t, queue, switches = np.array([start.angle, start.rate, *z]), 0.0, list(pending), []
    bounds = [*(-v for v in system.thresholds[::-1]), 0.0, *system.thresholds]
    levels = [*system.levels[::-1], *(-p for p in system.levels)]
    cell = sum(bound <= c @ x for bound in bounds)
    fresh = True
    while t < duration:
        if fresh:
            switches.append(t)
            queue.append((arrive(t), levels[cell]))
        end = min([duration, *(q[0] for q in queue[:1]), *(x for x in breaks if x > t)])
        events = []
        for side, k in ((1.0, cell - 1), (-1.0, cell)):
            if 0 <= k < len(bounds):
                event = lambda _, y, side=side, bound=bounds[k]: side * (c @ y - bound)  # noqa: E731
                event.terminal, event.direction, event.step = True, -1, -int(side)
                events.append(event)
        found = solve_ivp(
            lambda t, y, u=u: A @ y + b * (u + force(t)), (t, end), x, "DOP853",
            events=events, rtol=1e-12, atol=1e-17, max_step=0.5,
        )  # fmt: skip
        t, x = float(found.t[-1]), found.y[:, -1]
        if fresh := found.status == 1:
            (hit,) = [e for e, times in zip(events, found.t_events, strict=True) if len(times)]
            cell += hit.step
        while queue and queue[0][0] <= t:
            u = queue.pop(0)[1]
    return np.array(switches), x


def final(run):
    """The real state at the end of a run."""
    angle, rate, modes = run.at([run.times[-1]])
    return np.r_[angle, rate, np.c_[modes[0].real, modes[0].imag].ravel()]


# -- figures -----------------------------------------------------------------------------------


def section_5():
    """The system, the start and the pulses of the paper's run, recomputed for its own plant."""
    model = galerkin_model(PRINTED, torques={"u": 1.0}, tips={})
    feedback = {ANGLE: 0.31, RATE: 1.0}
    system = system_of(model, channel="u", switching=feedback, thresholds=THRESHOLDS, levels=LEVELS)
    _, _, shapes = modal_form(model, "u")
    initial = Initial(attitude=(0, 0, 0.7), rate=(0, 0, -0.01), boom_amplitude=0.1)
    position, velocity = galerkin_start(1)(initial)
    q, w = model.projection @ position, model.projection @ velocity
    z = np.linalg.solve(np.c_[shapes, shapes.conj()], np.r_[q[1:], w[1:]])[0]
    return model, system, shapes, State(float(q[0]), float(w[0]), (complex(z),))


def test_run_of_section_5():
    model, system, shapes, start = section_5()
    U = 1 / PRINTED.J
    pulses = attracting(start.angle, start.rate, U)
    assert pulses[1:] == pytest.approx((18.213196, 48.258792), abs=1e-6)  # as many digits as given
    run = propagate(
        system, start=start, duration=80.0, delay=0.2, feedback_from=pulses.T2,
        pending=[(0.2, pulses.sign * U), (pulses.T1 + 0.2, -pulses.sign * U)],
        disturbance=Torque(amplitude=0.001 / PRINTED.J, frequency=1.0),
    )  # fmt: skip
    expected = [48.458792, 48.744239, 49.167736, 49.572396, 49.993393, 50.400048]
    # Figures of another simulator, rounded to 1e-6 s; the plant's constants carry five digits.
    assert run.switch_times[:6] + 0.2 == pytest.approx(expected, abs=1e-5)
    angle, rate, modes = run.at([80.0])

    def reading(row):
        return row.angle * angle[0] + row.rate * rate[0] + 2 * (row.modes @ modes[0]).real

    gamma = reading(row_of(model, "attitude_z", shapes))
    q = (angle[0] - gamma) * PRINTED.J / (2 * PRINTED.p[0])
    # Rounded to 1e-9, and sensitive to the fifth digit of the constants.
    found = (gamma, q, angle[0], rate[0])
    expected = (-2.517972e-4, 2.953926e-3, -1.402798e-4, 3.587988e-4)
    assert found == pytest.approx(expected, abs=1e-6)


def test_limit_cycle_figures():
    run = propagate(RIGID, start=State(0.001, 0.0), duration=400.0, delay=0.2)
    late = run.switch_times[run.switch_times > 300]
    figures = (
        2 * np.diff(late),
        run.peak(Row(rate=1.0), after=300.0)[0],
        run.peak(Row(angle=1.0), after=300.0)[0],
    )
    exact = limit_cycle(c=0.31, delay=0.2, level=0.007)
    # The transient is gone (e^(-.31 x 300)); a clock of 400 s has 6e-14 s, 1e-13 of a period; beta
    # of 1.5e-4 gathers the rounding of a start of 1e-3 over 1000 switchings.
    for found, value in zip(figures, exact, strict=True):
        assert found == pytest.approx(value, rel=1e-11)
    # Ten digits of Efremov et al. 2006, closed form.
    assert exact == pytest.approx((0.826439232, 1.446268657e-3, 1.494066448e-4), rel=1e-9)


# -- high precision ----------------------------------------------------------------------------


def high_precision(case, duration):
    """The rivals' case with 40 digits: a scan of s in small steps, then Newton by secants."""
    mp = mpmath.mp
    p, h = mp.mpf(LEVEL), mp.mpf(DELAY)
    lam, b, d = (mp.mpc(x) for x in (case.eigenvalues[0], case.drive[0], case.switching.modes[0]))
    ca, cv = mp.mpf(case.switching.angle), mp.mpf(case.switching.rate)
    t, beta, v, z, u = mp.mpf(0), mp.mpf(0.001), mp.mpf(0), mp.mpc(0), mp.mpf(0)
    queue, switches, sign = [(h, -p)], [mp.mpf(0)], 1
    while t < duration:
        end = min(queue[0][0], mp.mpf(duration)) if queue else mp.mpf(duration)

        def moved(tau, beta=beta, v=v, z=z, u=u):
            rest = -b * u / lam
            return (
                beta + tau * (v + tau * u / 2), v + tau * u, rest + (z - rest) * mp.exp(lam * tau)
            )  # fmt: skip

        def s(tau, moved=moved):
            x = moved(tau)
            return ca * x[0] + cv * x[1] + 2 * (d * x[2]).real

        # Sixteen digits are enough to bracket the zeros; s has no wave shorter than 2 s.
        grid = np.linspace(0.0, float(end - t), 65)
        signs = [sign, *(sign if x * sign > 0 else -sign for x in map(s, grid[1:].tolist()))]
        for (x0, s0), (x1, s1) in pairwise(zip(grid.tolist(), signs, strict=True)):
            if s0 != s1:
                root = mpmath.findroot(s, (x0, x1), tol=mp.mpf(10) ** -70)
                sign = -sign
                switches.append(t + root)
                queue.append((t + root + h, -sign * p))
                end = min(end, queue[0][0])
        beta, v, z = moved(end - t)
        t = end
        while queue and queue[0][0] <= t:
            u = queue.pop(0)[1]
    return switches


def test_switching_times_against_forty_digits():
    case = SYSTEMS[1]
    run = propagate(case, start=at_rest(case), duration=DURATION, delay=DELAY)
    with mpmath.workdps(40):
        exact = high_precision(case, DURATION)
        assert len(run.switch_times) == len(exact) == 130  # the first command and 129 switchings
        error = max(abs(a - b) for a, b in zip(run.switch_times.tolist(), exact, strict=True))
    # A clock of 100 s has 1.4e-14 s; the rounding of 129 segments adds up to a few dozen of them.
    assert error < 1e-12


# -- other integrators -------------------------------------------------------------------------


def delays():
    yield "constant", DELAY, lambda t: t + DELAY
    wave = Delay(mean=0.3, amplitude=0.15, frequency=3.0, phase=0.7)
    yield "sinusoidal", wave, wave.arrival

    def waves(t):
        return 0.3 + 0.08 * math.sin(2 * t) + 0.05 * math.sin(5 * t + 1)

    def arrive(t):
        a = t + 0.3
        for _ in range(200):  # contracts by h' <= .41 a time: 200 leave nothing
            a = t + waves(a)
        return a

    yield "callable", waves, arrive


DELAYS = {name: rest for name, *rest in delays()}
SINE = Torque(constant=2e-4, amplitude=5e-4, frequency=1.3, phase=0.4)
STEPS = ((0.0, 3e-4), (7.3, -6e-4), (21.0, 1e-4))


@pytest.mark.parametrize("delay", DELAYS)
@pytest.mark.parametrize("modes", [0, 1, 3, 10])
def test_against_adaptive_integration(modes, delay):
    system = multilevel(SYSTEMS[modes])
    start = at_rest(system, 0.03)._replace(rate=0.01)
    given, arrive = DELAYS[delay]
    run = propagate(system, start=start, duration=20.0, delay=given)
    switches, x = adaptive(system, start=start, duration=20.0, arrive=arrive)
    assert len(run.switch_times) == len(switches) > 20
    # rtol 1e-12 of s over its rate, a few switchings of error at a time: 1e-12 s, ten times over.
    assert run.switch_times == pytest.approx(switches, abs=2e-11)
    # As long a time at frequencies of some rad/s.
    assert final(run) == pytest.approx(x, abs=1e-10 * max(np.abs(x)))


@pytest.mark.parametrize(
    ("torque", "steps"),
    [
        (Torque(constant=4e-4), ()),
        (SINE, ()),
        (None, STEPS),
        (SINE, STEPS),
        (Torque(amplitude=6e-4, frequency=0.05), ()),
    ],
)
@pytest.mark.parametrize("modes", [0, 1])
def test_disturbances_against_adaptive_integration(modes, torque, steps):
    system = SYSTEMS[modes]

    def force(t):
        step = [value for when, value in steps if when <= t]
        return (torque(t) if torque else 0.0) + (step[-1] if step else 0.0)

    start, breaks = at_rest(system), [when for when, _ in steps if when > 0]
    run = propagate(system, start=start, duration=30.0, delay=0.3, disturbance=torque, steps=steps)
    switches, x = adaptive(
        system, start=start, duration=30.0, arrive=lambda t: t + 0.3, breaks=breaks, force=force
    )
    # As above; approx compares the numbers of switchings too.
    assert run.switch_times == pytest.approx(switches, abs=2e-11)
    assert final(run) == pytest.approx(x, abs=1e-10 * max(np.abs(x)))


def test_pending_commands_and_the_acting_level_come_first():
    pending, start = [(0.05, 0.004), (0.21, -0.006), (0.3, 0.001)], State(0.001, 0.002)
    run = propagate(RIGID, start=start, duration=10.0, delay=0.35, pending=pending, acting=-0.002)
    assert run.times[:5].tolist() == [0.0, 0.05, 0.21, 0.3, 0.35]
    assert run.inputs[:5].tolist() == [-0.002, 0.004, -0.006, 0.001, -0.007]
    switches, x = adaptive(
        RIGID, start=start, duration=10.0, arrive=lambda t: t + 0.35, pending=pending, u=-0.002
    )
    assert run.switch_times == pytest.approx(switches, abs=1e-9)  # rtol 1e-12 over the rate of s
    # As long a time at frequencies of some rad/s.
    assert final(run) == pytest.approx(x, abs=1e-10 * max(np.abs(x)))


def test_a_square_wave_is_refused_or_flown_as_one():
    torque = Torque(amplitude=6e-4, frequency=1.0, waveform="square")
    steps = [(k * math.pi, 6e-4 * (-1) ** k) for k in range(10)]
    given = {"start": State(0.001, 0.0), "duration": 30.0, "delay": 0.2}
    exact = propagate(RIGID, **given, steps=steps)
    try:
        run = propagate(RIGID, **given, disturbance=torque)
    except ValueError as error:
        assert "square" in str(error)  # noqa: PT017
        return  # else the same run, but for the rounding of the edges, some 1e-15 s each
    assert run.switch_times == pytest.approx(exact.switch_times, abs=1e-11)


def test_feedback_begins_when_it_is_told_to():
    run = propagate(RIGID, start=State(0.001, 0.0), duration=5.0, delay=0.2, feedback_from=1.7)
    assert run.switch_times[0] == 1.7
    assert run.inputs[run.times[:-1] < 1.9].tolist() == [0.0, 0.0]  # the first acts at 1.9
    assert run.inputs[2] == -0.007
    never = propagate(
        RIGID, start=State(0.001, 0.002), duration=5.0, delay=0.2, feedback_from=math.inf,
        acting=0.003,
    )  # fmt: skip
    assert never.switch_times.size == 0  # one parabola, and a few roundings:
    assert final(never) == pytest.approx([0.001 + 0.01 + 0.003 * 12.5, 0.017], rel=1e-14)


# -- cost, input ----------------------------------------------------------------------


@pytest.mark.parametrize("modes", [0, 10])
def test_work_grows_in_proportion_to_the_switchings(modes, monkeypatch):
    system, counts = SYSTEMS[modes], []
    evaluate = curve.Curve.__call__

    def counted(self, tau):
        counts[-1] += 1
        return evaluate(self, tau)

    monkeypatch.setattr(curve.Curve, "__call__", counted)
    share, segments = [], []
    for duration in (50.0, 200.0, 800.0):
        counts.append(0)
        run = propagate(system, start=at_rest(system), duration=duration, delay=0.3664)
        share.append(counts[-1] / len(run.switch_times))
        segments.append((len(run.times) - 1) / len(run.switch_times))
    # The transient of 20 s differs from the limit cycle by a few evaluations a switching.
    assert max(share) < 1.3 * min(share)
    assert max(segments) <= 1.1  # one a command, and the last


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"delay": -0.2}, r"delay = -0\.2"),
        ({"delay": 0.0}, r"delay = 0\.0"),
        ({"delay": math.nan}, "delay = nan"),
        ({"delay": lambda t: 0.1 - t}, r"negative.*h\(0\.1\d* s\) = -\d"),
        ({"delay": lambda t: 0.1 + 2 * max(t - 1, 0)}, "grows too fast"),
        ({"duration": 0.0}, r"> 0: duration = 0\.0"),
        ({"duration": -1.0}, r"> 0: duration = -1\.0"),
        ({"pending": [(0.1, 0.0), (0.05, 0.0)]}, r"pending.*ascending.*\[0\.1, 0\.05\]"),
        ({"pending": [(-0.1, 0.0)]}, r"pending.*>= 0.*\[-0\.1\]"),
        ({"steps": [(3.0, 0.0), (2.0, 0.0)]}, r"steps.*ascending.*\[3\.0, 2\.0\]"),
        ({"start": State(0.0, 0.0, (0j,))}, "1 modal coordinates, the system 0"),
        ({"disturbance": Torque(amplitude=1.0)}, "frequency"),
    ],
)
def test_bad_input_is_refused_with_its_value(changes, message):
    given = {"start": State(0.001, 0.0), "duration": 30.0, "delay": 0.2} | changes
    with pytest.raises(ValueError, match=message):
        propagate(RIGID, **given)


def test_a_pending_command_behind_the_first_feedback_command_is_out_of_order():
    # A delay line keeps the order: what was under way at t = 0 cannot act after the first feedback.
    with pytest.raises(ValueError, match=r"pending.*0\.5"):
        propagate(RIGID, start=State(0.001, 0.0), duration=2.0, delay=0.2, pending=[(0.5, 0.007)])


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"levels": ()}, "0 thresholds need 1 levels, got 0"),
        ({"thresholds": (1.0,)}, "1 thresholds need 2 levels, got 1"),
        ({"thresholds": (2.0, 1.0), "levels": (1.0,) * 3}, r"ascending, got \(2\.0, 1\.0\)"),
        ({"thresholds": (0.0,), "levels": (1.0,) * 2}, r"positive.*got \(0\.0,\)"),
        ({"thresholds": (1.0, 1.0), "levels": (1.0,) * 3}, "ascending"),
        ({"eigenvalues": (-1 + 3j,), "drive": ()}, "drive"),
        ({"switching": Row(modes=(1j, 2j)), "eigenvalues": (-1 + 3j,), "drive": (1j,)}, "2"),
        # The curve's bound x'' <= ripple, on which no exit is missed, needs Re lambda <= 0.
        ({"switching": Row(modes=(1j,)), "eigenvalues": (1 + 3j,), "drive": (1j,)}, "1"),
    ],
)  # fmt: skip
def test_a_system_is_refused_at_construction(changes, message):
    with pytest.raises(ValueError, match=message):
        RelaySystem(**{"switching": Row(angle=0.31, rate=1.0), "levels": (0.007,)} | changes)
