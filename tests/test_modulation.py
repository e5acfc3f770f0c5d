"""Pulses in place of a smooth torque: widths in closed form, dead bands, flights, refusals."""

import copy
import dataclasses
import math
import pickle
from itertools import pairwise

import burkov_cases as cases
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from controllers.modulation import OFF, Pwm, Pwpf, asked_for, modulated
from controllers.modulation_claims import Pointing
from controllers.velocity_filter import sampled
from spacecraft_sim import compiled_dynamics, mission
from spacecraft_sim.chart import pulses
from spacecraft_sim.controller import Controller
from spacecraft_sim.disturbance import Disturbance, Torque
from spacecraft_sim.reduced import ReducedPhysics, double_integrator, galerkin_start
from spacecraft_sim.scenario import Initial
from spacecraft_sim.simulate import Environment, simulate
from spacecraft_sim.smooth_flight import fly as fly_held
from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.task import ControlTask
from spacecraft_sim.thrusters import Thrusters

T, LEAST, U = 0.1, 0.02, 2.0  # period and minimum on-time, s; level
QUIET = Disturbance({"z": Torque(constant=0.0)})
PWM, PWPF = Pwm(kind="pwm"), Pwpf(kind="pwpf")


@dataclasses.dataclass(frozen=True)
class Ask:
    """Torques by the number of the sample, whatever is read."""

    torques: tuple[float, ...]
    period: float

    def filtered(self, t, y):
        return ()

    def command(self, t, y, w):
        return (self.torques[round(t / self.period) % len(self.torques)],)


def asking(*torques, modulation=PWM, period=T, least=LEAST):
    law = sampled(
        Ask(torques, period), cutoffs=(), hold="tustin", period=period, sensors=("attitude_z",),
        channels=("thruster_z",), thrusters=None,
    )  # fmt: skip
    return modulated(law, modulation, relay(least))


def relay(least=LEAST, **changes):
    numbers = {"levels": (U,), "min_on_time": least, **changes}
    return Thrusters([Thruster(name="thruster_z", **numbers)])


def flight(law, duration, substeps=3):
    task = ControlTask(law, relay(), initial=Initial(), disturbance=QUIET)
    plant = ReducedPhysics(double_integrator(), start=galerkin_start(0), timestep=0.0131)
    return simulate(Environment(plant, task, duration=duration, substeps=substeps), meta={})


# -- pulse width -----------------------------------------------------------------------------------


def test_pulses_have_the_impulse_asked_for_and_end_between_samples():
    wanted = (0.0, -1.9, 0.5, 1.2, 0.0, -0.41)
    track = flight(asking(*wanted), T * len(wanted) + 0.01)
    start, length = pulses(track.time, track["thruster_z"])
    # Edges are located to 1e-11 s.
    np.testing.assert_allclose(start, [T, 2 * T, 3 * T, 5 * T], atol=3e-11)
    np.testing.assert_allclose(length, [T * abs(u) / U for u in wanted if u], atol=3e-11)
    at = [int(np.flatnonzero(np.abs(track.time - k * T) < 1e-9)[-1]) for k in range(7)]
    np.testing.assert_allclose(np.diff(track["rate_z"][at]), T * np.array(wanted), atol=1e-10)


def test_pulses_shorter_than_the_minimum_on_time_are_dropped():
    edge = U * LEAST / T
    track = flight(asking(0.999 * edge, -0.999 * edge, 1.001 * edge), 9 * T)
    start, length = pulses(track.time, track["thruster_z"])
    np.testing.assert_allclose(start, [2 * T, 5 * T, 8 * T], atol=3e-11)
    np.testing.assert_allclose(length, 1.001 * LEAST, atol=3e-11)


def test_a_torque_above_the_level_is_one_pulse_without_a_gap():
    track = flight(asking(0.0, 5.0, 2.0, 2.0, 1.0), 5 * T)
    start, length = pulses(track.time, track["thruster_z"])
    assert start == pytest.approx([T], abs=3e-11)
    assert length == pytest.approx([3.5 * T], abs=1e-10)


def test_one_way_is_kept_to():
    track = flight(asking(1.0, -1.0, modulation=Pwm(kind="pwm", ways="negative")), 6 * T)
    assert set(np.sign(track["thruster_z"])) == {0.0, -1.0}


# -- lag and trigger -------------------------------------------------------------------------------


def run(modulator, r, samples):
    channel, found = OFF, []
    for k in range(samples):
        channel = modulator.sample(k * modulator.period, r, channel)
        found.append(channel)
    return found


@pytest.mark.parametrize(("share", "fires"), [(0.999, False), (1.01, True)])
@pytest.mark.parametrize("sign", [-1, 1])
def test_the_trigger_is_silent_in_its_dead_band_and_not_beyond(share, fires, sign):
    modulator = PWPF.modulator(0.01, LEAST)
    assert modulator.dead_band == pytest.approx(0.45 / 4)
    found = run(modulator, sign * share * modulator.dead_band, 2000)
    assert any(c.sign for c in found) is fires


def test_on_and_off_times_are_those_of_the_lag_in_closed_form():
    period, r = 1e-4, 0.4
    found = run(PWPF.modulator(period, 0.0), r, 60_000)
    sign = np.array([c.sign for c in found])
    edges = np.flatnonzero(np.diff(sign)) + 1
    lengths = period * np.diff(edges)[2:]
    on = sign[edges[2:-1]] == 1
    # From U_on down to U_off towards K_m (r - 1), and back up towards K_m r.
    K, tau, high, low = PWPF.gain, PWPF.time_constant, PWPF.on, PWPF.off
    burn = tau * math.log((high - K * (r - 1)) / (low - K * (r - 1)))
    coast = tau * math.log((K * r - low) / (K * r - high))
    # Sampled: either end is found up to one period late, and passed by what that is.
    np.testing.assert_allclose(lengths[on], burn, atol=3 * period)
    np.testing.assert_allclose(lengths[~on], coast, atol=3 * period)


def test_a_pulse_lasts_its_minimum_on_time_in_whole_periods():
    # By itself a pulse lasts tau log(K_m/(K_m - U_on + U_off)) = 1.9 ms with these thresholds, and
    # 12 ms with those above; at 100 Hz 20 ms are two periods, 25 ms three.
    assert PWPF.modulator(0.01, 0.0).shortest == pytest.approx(0.02)
    for least, whole in ((0.0, 0.01), (0.02, 0.02), (0.025, 0.03)):
        modulator = Pwpf(kind="pwpf", off=0.4).modulator(0.01, least)
        assert modulator.shortest == pytest.approx(whole)
        sign = [c.sign for c in run(modulator, 0.13, 3000)]
        edges = np.flatnonzero(np.diff(sign)) + 1
        assert np.diff(edges)[::2].min() == round(whole / 0.01)


def test_a_modulator_that_would_answer_its_own_pulses_is_refused():
    # tau log(K/(K - 2 U_on)) = 38 ms: a longer pulse carries the lag from U_on to -U_on.
    PWPF.modulator(0.001, 0.038)
    with pytest.raises(ValueError, match=r"lasts 0\.039 s at least; from 0\.0382338 s on it takes"):
        PWPF.modulator(0.001, 0.039)
    for least, answers in ((0.038, False), (0.039, True)):
        modulator = dataclasses.replace(PWPF.modulator(0.001, 0.0), min_on_time=least)
        fired = {c.sign for c in run(modulator, 1.001 * modulator.dead_band, 5000)}
        assert (-1 in fired) is answers


@given(
    r=st.lists(st.floats(-1.5, 1.5), min_size=2, max_size=60),
    least=st.floats(0.0, 0.1),
    kind=st.sampled_from([PWM, Pwpf(kind="pwpf", time_constant=2.0)]),
)
def test_no_pulse_is_shorter_than_the_minimum_on_time(r, least, kind):
    modulator, channel, changes = kind.modulator(T, least), OFF, [(-math.inf, 0)]
    for k, x in enumerate(r):
        channel = modulator.sample(k * T, x, channel)
        changes.append((k * T, channel.sign))
        if channel.end < math.inf:
            changes.append((channel.end, 0))
    changes = [b for a, b in pairwise(changes) if a[1] != b[1]]
    on = [b[0] - a[0] for a, b in pairwise(changes) if a[1]]
    assert min(on, default=math.inf) >= least - 1e-9


# -- a law of Burkov -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "name", ["burkov-pwm", pytest.param("burkov-pwpf", marks=pytest.mark.slow)]
)
def test_relay_thrusters_settle_into_the_dead_band_on_both_plants(name):
    ready = mission.assemble(mission.load_scenario(name, ("duration=100.0",)))
    measured, predicted = ready.fly(), ready.fly("reduced")
    comparison = ready.judge(measured, predicted)
    assert [v.claim for v in (*comparison.verdicts, *comparison.reduced) if not v.holds] == []
    assert len(comparison.verdicts) == 3
    for name in ready.controller.thrusters:
        assert set(np.abs(measured[name])) <= {0.0, 1.5}
    # The same pulses on both: RK4 at 10 ms, and its error over minutes of coasting.
    errors = {d.signal: d.max_error for d in comparison.differences}
    assert max(errors[s] for s in ready.controller.sensors) < 1e-4
    # It does limit-cycle: the law alone would end some 1e-9 from the goal.
    for verdict in comparison.verdicts[1:]:
        assert verdict.predicted is not None
        assert verdict.measured > 0.3 * verdict.predicted


def test_the_charts_are_those_of_the_law_that_asks():
    law = mission.assemble(mission.load_scenario("burkov-pwm")).controller
    assert law.charts == law.law.charts
    assert {chart.name for chart in law.charts} >= {"energy", "vectors"}


def test_claims_fail_on_a_flight_that_breaks_them():
    ready = mission.assemble(mission.load_scenario("burkov-pwm", ("duration=30.0",)))
    track = ready.fly()
    on_times, angle, rate = ready.guarantees
    spread = dataclasses.replace(track, time=track.time * 0.9)
    assert not on_times.check(spread).holds
    assert on_times.check(spread).measured > 0
    turned = {f"s2_{a}": -track[f"s2_{a}"] for a in "xyz"}
    turned |= {f"s3_{a}": -track[f"s3_{a}"] for a in "xyz"}
    away = dataclasses.replace(track, signals={**track.signals, **turned})
    assert angle.check(away).measured > 3.0
    assert not angle.check(away).holds
    faster = {name: 10 * track[name] for name in ("rate_x", "rate_y", "rate_z")}
    assert not rate.check(dataclasses.replace(track, signals={**track.signals, **faster})).holds


def test_rules_are_the_reference_figures():
    # Reference: level 1.5 N m, least stiffness 1.2 N m, least moment of inertia 0.9 kg m^2.
    bounds = {}
    for least in (0.01, 0.02, 0.05):
        setting = f"thrusters.all.min_on_time={least}"
        ready = mission.assemble(mission.load_scenario("burkov-pwm", (setting,)))
        bounds[least] = [g.predicted for g in ready.guarantees[1:]]
    assert bounds[0.01] == pytest.approx([0.125, 0.0167], rel=3e-3)  # three figures printed
    assert bounds[0.02] == pytest.approx([0.250, 0.0333], rel=3e-3)
    assert bounds[0.05] == pytest.approx([0.625, 0.0833], rel=3e-3)
    ready = mission.assemble(mission.load_scenario("burkov-pwpf"))
    assert [g.predicted for g in ready.guarantees[1:]] == pytest.approx([0.141, 0.0333], rel=4e-3)


@pytest.mark.parametrize("rated", [True, False])
def test_the_angle_from_the_goal_is_that_of_the_rotation(rated):
    law, _ = cases.vectors(rated=rated)
    formula = law.formula
    assert isinstance(formula, Pointing)
    for size in (1e-9, 0.3, 2.0, 3.1):
        vector = size * np.array([0.6, -0.48, 0.64])
        s = cases.goal() @ Rotation.from_rotvec(vector).as_matrix()
        y = [*s[1], *s[2], 0.1, 0.2, 0.3]
        # r2 and r3 have eight decimals and are orthogonalised.
        assert formula.angle(y) == pytest.approx(size, rel=1e-7)
    assert formula.stiffness == 1.2


def test_the_inertia_that_a_torque_meets_at_once():
    free = mission.assemble(mission.load_scenario("burkov-pwm"))
    found = compiled_dynamics.inertias(free.mujoco, free.controller.thrusters)
    assert found == pytest.approx((0.9, 1.6, 1.0), rel=1e-9)  # rounding of RK4's mass matrix
    booms = mission.assemble(mission.load_scenario("burkov-hub-two-booms"))
    hub = compiled_dynamics.inertias(booms.mujoco, booms.controller.thrusters)
    # An appendage of mass m and inertia I about its centre, c from its hinge and that a from the
    # middle: its hinge force takes part with m a^2 I/(I + m c^2), and about y it is rigid.
    m, moment, a, c = 0.5, 0.0267, 0.3, 0.4
    share = 2 * m * a**2 * moment / (moment + m * c**2)
    assert hub == pytest.approx((0.9 + share, 1.6004, 1.0 + share), rel=1e-6)


# -- the object ------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["burkov-pwm", "burkov-pwpf"])
def test_a_modulated_law_is_frozen_pure_and_picklable(name):
    law = mission.assemble(mission.load_scenario(name)).controller
    assert isinstance(law, Controller)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(law, "levels", ())  # noqa: B010
    before, again = copy.deepcopy(law), pickle.loads(pickle.dumps(law))
    memory = law.init()
    for k in range(40):
        y = (0.6, -0.8, 0.0, 0.0, 0.1 * math.sin(k), 1.0)
        after = law.step(0.01 * k, y, memory)
        assert after == again.step(0.01 * k, y, pickle.loads(pickle.dumps(memory)))
        memory = after[1]
        assert all(left > 0 for left in law.events(0.01 * k, y, memory))
    assert law == before


def test_what_cannot_be_modulated_is_refused():
    smooth, _ = cases.vectors(rated=False)
    motors = [Thruster(name=f"torque_{a}", levels=(1.5,), proportional=True) for a in "xyz"]
    plain = asking(1.0).law
    with pytest.raises(ValueError, match="'torque_x' is proportional; pulses are of a relay"):
        modulated(smooth, PWM, Thrusters(motors))
    with pytest.raises(ValueError, match=r"\(1.0, 2.0\); pulses are of a relay of one level"):
        modulated(plain, PWM, relay(levels=(1.0, 2.0)))
    with pytest.raises(ValueError, match=r"set controller.period = 0\.2 or longer"):
        asking(1.0, least=0.2)
    with pytest.raises(ValueError, match="this law has no period"):
        modulated(asking(1.0), PWM, relay())
    with pytest.raises(ValueError, match="no sampling period: a relay law is not flown here"):
        fly_held(cases.BODY, asking(1.0), starts=np.zeros(9), duration=1.0)


def test_faults_of_the_table_are_named():
    assert asked_for({"law": "burkov_position"}) is None
    for value, words in (
        ('{kind="pwn"}', "'pwm', 'pwpf'"),
        ('{kind="pwm", gain=4.0}', "gain: unknown key"),
        ('{kind="pwpf", off=0.5}', "off = 0.5 must be below on = 0.45"),
        ('{kind="pwpf", time_constant=0.0}', "greater than 0"),
    ):
        with pytest.raises(ValueError, match=words):
            mission.load_scenario("burkov-pwm", (f"controller.modulation={value}",))
