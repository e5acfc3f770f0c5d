"""The flight of a law: exact switching, order 4 through it, samples, rows."""

import dataclasses
import functools
import itertools
import math

import numpy as np
import pytest

from spacecraft_sim import mission, spacecraft
from spacecraft_sim.disturbance import Disturbance, Torque
from spacecraft_sim.physics import MujocoPhysics
from spacecraft_sim.reduced import ReducedModel, ReducedPhysics, double_integrator, galerkin_start
from spacecraft_sim.scenario import Initial
from spacecraft_sim.simulate import Environment, simulate
from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.task import ControlTask
from spacecraft_sim.thrusters import Thrusters

QUASI_RIGID = ("quasi_rigid_angle_z", "quasi_rigid_rate_z")


@dataclasses.dataclass(frozen=True, kw_only=True)
class Script:
    """Levels in turn, changed at given times; notes when it was called."""

    times: tuple[float, ...]
    levels: tuple[float, ...]
    period: float | None = None
    sensors: tuple[str, ...] = ()
    thrusters: tuple[str, ...] = ("thruster_z",)
    calls: list = dataclasses.field(default_factory=list)

    def init(self):
        return 0

    def step(self, t, y, memory):
        self.calls.append(t)
        passed = sum(time <= t for time in self.times)
        return (self.levels[passed],), passed

    def events(self, t, y, memory):
        return tuple(time - t for time in self.times[memory:])


@dataclasses.dataclass(frozen=True, kw_only=True)
class Relay:
    """u = -level sign(s), s = slope x + x'; `once` stops it after the first switching."""

    level: float
    slope: float = 1.0
    once: bool = False
    period: float | None = None
    sensors: tuple[str, ...] = ("attitude_z", "rate_z")
    thrusters: tuple[str, ...] = ("thruster_z",)

    def _s(self, y):
        return self.slope * y[0] + sum(y[1:])

    def init(self):
        return 0.0

    def step(self, t, y, sign):
        sign = -sign if sign else math.copysign(1.0, self._s(y))
        return (-sign * self.level,), sign

    def events(self, t, y, sign):
        return () if self.once and sign < 0 else (sign * self._s(y),)


def engine(*, levels=(1.0,), delay=0.2, **changes):
    return Thrusters([Thruster(name="thruster_z", levels=levels, delay=delay, **changes)])


def fly(plant, law, thrusters, *, duration, initial=None, disturbance=None, substeps=1):
    task = ControlTask(
        law, thrusters, initial=initial or Initial(), disturbance=disturbance or Disturbance({})
    )
    return simulate(Environment(plant, task, duration=duration, substeps=substeps), meta={})


def on_double_integrator(law, *, duration, angle=0.0, rate=0.0, push=0.0, dt=0.05, **options):
    options = {"substeps": 1, **options}
    return fly(
        ReducedPhysics(double_integrator(), start=galerkin_start(0), timestep=dt),
        law,
        options.pop("thrusters", engine()),
        duration=duration,
        initial=Initial(attitude=(0, 0, angle), rate=(0, 0, rate)),
        disturbance=Disturbance({"z": Torque(constant=push)}),
        **options,
    )


def switchings(track):
    """When the command changes."""
    return track.time[1:][np.diff(track["thruster_z_command"]) != 0]


# -- order 4 --------------------------------------------------------------------------------------

STEPS = (0.05, 0.025, 0.0125, 0.00625, 0.003125)  # s; the limit of stability is 0.25 s
REFERENCE = 0.001
START = Initial(attitude=(0, 0, 0.3), rate=(0, 0, -0.01), boom_amplitude=0.1)
# Multiples of the square root of 2: no step of the table, and no sum of them, falls on these.
SCRIPT = Script(
    times=tuple(0.9 * math.sqrt(2) * k for k in range(1, 6)),
    levels=(8.2826625, -24.8479875, 0.0, 24.8479875, -8.2826625, 0.0),
)
RELAY = Relay(level=24.8479875, slope=0.5)
# Slow enough for pieces to end at control steps only, and so to shrink with the step.
WAVE = Torque(amplitude=5.0, frequency=1.2)
SQUARE = Torque(amplitude=5.0, frequency=1.2, waveform="square")


@functools.cache
def machine():
    booms = {"all": {"n_hinges": 4, "rule": "gauss_jacobi"}}
    return spacecraft.load("two_boom").with_parts(booms=booms, thrusters={})


def coupled(dt, torque):
    disturbance = Disturbance({"z": torque} if torque else {})
    plant = MujocoPhysics.fly(machine(), timestep=dt, disturbances=disturbance.names)
    return plant, disturbance


def flexible_flight(law, dt, torque=None, substeps=1):
    plant, disturbance = coupled(dt, torque)
    thrusters = Thrusters(machine().thrusters)
    track = fly(
        plant, law, thrusters, duration=8.0, initial=START, disturbance=disturbance,
        substeps=substeps,
    )  # fmt: skip
    return np.r_[plant.data.qpos, plant.data.qvel], switchings(track)


def assert_order_4(errors):
    order = np.polyfit(np.log(STEPS), np.log(errors), 1)[0]
    # Over a factor of 16 the next term of the expansion bends the slope by some tenths, upwards too
    # where the leading one is small; a method of order 3 or an edge missed by any share of a step
    # is off by 1 and more.
    assert order > 3.7


@pytest.mark.parametrize("torque", [None, WAVE, SQUARE], ids=["quiet", "sine", "square"])
@pytest.mark.parametrize("substeps", [1, 4])
@pytest.mark.parametrize("law", [SCRIPT, RELAY], ids=["open loop", "closed loop"])
def test_state_and_switching_times_are_of_order_4(law, substeps, torque):
    reference, times = flexible_flight(law, REFERENCE, torque, substeps)
    assert len(times) >= 5
    flights = [flexible_flight(law, dt, torque, substeps) for dt in STEPS]
    assert_order_4([np.max(np.abs(state - reference)) for state, _ in flights])
    errors = [np.max(np.abs(found - times)) for _, found in flights]
    if law is SCRIPT:
        assert max(errors) < 1.1e-11  # the law's own times, to the width that a root is narrowed to
    else:
        assert_order_4(errors)


def test_without_landing_the_order_is_1():
    def final_state(dt):
        plant, _ = coupled(dt, None)
        plant.set_initial(START)
        arrivals = np.array(SCRIPT.times) + 0.2
        for k in range(round(8.0 / dt)):
            plant.begin([(0.0, *SCRIPT.levels)[_on(k * dt) and 1 + sum(arrivals <= k * dt)]], [0.0])
            plant.advance((k + 1) * dt)
        return np.r_[plant.data.qpos, plant.data.qvel]

    def _on(t):
        return t >= 0.2 - 1e-12  # the first command, of time 0

    reference, _ = flexible_flight(SCRIPT, REFERENCE)
    errors = [np.max(np.abs(final_state(dt) - reference)) for dt in STEPS]
    # The missed share of a step is anything from 0 to 1, so the single errors scatter.
    assert np.polyfit(np.log(STEPS), np.log(errors), 1)[0] == pytest.approx(1.0, abs=0.5)


# -- relays in continuous time --------------------------------------------------------------------


def test_a_switching_is_located_to_1e_11_s():
    # Until the first arrival x is at rest; then s = x + x' = 1 - T^2/2 - T, zero at T = 3^.5 - 1.
    # The next thrust acts 0.2 s after the first switching as it was found.
    track = on_double_integrator(Relay(level=1.0), duration=4.0, angle=1.0)
    first, second = switchings(track)[:2]
    assert first == pytest.approx(0.2 + math.sqrt(3) - 1, abs=1e-11)
    x, v = 1 - first**2 / 2, -first
    # s = (x + v) + (v + 1) t + t^2/2 from there on
    later = math.sqrt((v + 1) ** 2 - 2 * (x + v)) - (v + 1)
    assert second == pytest.approx(first + 0.2 + later, abs=1e-11)


@pytest.mark.parametrize("dt", [0.5, 0.05, 0.0037])
def test_on_an_exact_plant_switchings_do_not_depend_on_the_step(dt):
    found = [
        switchings(on_double_integrator(Relay(level=1.0), duration=6.0, angle=1.0, dt=step))[:6]
        for step in (dt, 0.01)
    ]
    # A root is narrowed to 1e-11 s; each of six hands on its error to the next, at most doubled.
    assert found[0] == pytest.approx(found[1], abs=64e-11)


def test_relay_on_an_unstable_plant_of_first_order():
    # Efremov et al. (4.1): x' = x - sign x(t - h), h = .4; amplitude e^h - 1, period
    # 2 (h - ln(2 - e^h)).  As a mode with eigenvalues 1 and mu, x = eta' - mu eta obeys it.
    mu = 1e-3
    model = ReducedModel(
        B=np.ones((1, 1)), D=np.array([[-1 - mu]]), frequencies=np.array([math.sqrt(mu)]),
        C=np.array([[-mu, 1.0]]), y0=np.zeros(1), outputs={"x": ""}, inputs=("thruster_z",),
        projection=np.eye(1), neglected=np.zeros(0), inertia=np.zeros(0),
    )  # fmt: skip

    def start(initial):
        return np.zeros(1), np.array([0.3])

    track = fly(
        ReducedPhysics(model, start=start, timestep=0.05),
        Relay(level=1.0, sensors=("x",)),
        engine(delay=0.4),
        duration=30.0,
    )
    late = track.time > 10.0  # symmetric from the first switching on: x has no other memory
    period = 2 * np.diff(switchings(track)[6:])  # of two equal halves
    # Two roots to 1e-11 s each.  x is read as a difference of modes, at 1/mu of the last bit.
    assert period == pytest.approx(2 * (0.4 - math.log(2 - math.exp(0.4))), abs=1e-10)
    assert period == pytest.approx(2.1538576, abs=1e-7)  # as printed
    assert np.max(np.abs(track["x"][late])) == pytest.approx(math.exp(0.4) - 1, abs=1e-10)


def parabola(*, centre, half_width, push=1.0):
    """Start of x(t) = push ((t - centre)^2 - half_width^2)/2 on the double integrator."""
    return {"angle": push * (centre**2 - half_width**2) / 2, "rate": -push * centre, "push": push}


WATCH = Relay(level=1.0, once=True, sensors=("attitude_z",))


@pytest.mark.parametrize("substeps", [1, 5])
@pytest.mark.parametrize("centre", [0.0301, 0.1234, 0.4711, 0.5249])
def test_a_dip_below_zero_and_back_within_one_step_is_found(centre, substeps):
    # x falls below zero for 0.01 s, a fifth of a step, and is positive at all ends of steps.
    start = parabola(centre=centre, half_width=0.005)
    late = engine(delay=9.0)  # what the law commands does not act within the flight
    track = on_double_integrator(WATCH, duration=1.0, thrusters=late, substeps=substeps, **start)
    assert switchings(track) == pytest.approx([centre - 0.005], abs=1e-11)


@pytest.mark.parametrize("lag", [0.0123, 0.0311])
def test_a_dip_just_after_a_thrust_edge_is_found(lag):
    # x' = -lag until the command of time 0, of the sign of -x0, acts at 0.25 and turns it back.
    angle = lag * 0.25 + lag**2 / 2 - 0.005**2 / 2
    track = on_double_integrator(
        dataclasses.replace(WATCH, level=-1.0),
        duration=0.5, angle=angle, rate=-lag, thrusters=engine(delay=0.25),
    )  # fmt: skip
    assert switchings(track) == pytest.approx([0.25 + lag - 0.005], abs=1e-11)


def test_a_touch_that_stays_above_zero_is_no_switching():
    start = parabola(centre=0.4711, half_width=0.0)
    start["angle"] += 1e-9
    track = on_double_integrator(WATCH, duration=1.0, thrusters=engine(delay=9.0), **start)
    assert len(switchings(track)) == 0


# -- ties ---------------------------------------------------------------------------------------


def test_switching_edge_and_control_step_may_fall_together():
    # Quarters are exact in binary: the second switching meets the edge of the first one.
    law = Script(times=(0.5, 0.75, 1.0), levels=(1.0, -1.0, 1.0, 0.0))
    track = on_double_integrator(law, duration=2.0, thrusters=engine(delay=0.25), dt=0.25)
    assert law.calls == [0.0, 0.5, 0.75, 1.0]
    assert np.all(np.diff(track.time) > 0)
    edges = track.time[1:][np.diff(track["thruster_z"]) != 0].tolist()
    assert edges == [0.25, 0.75, 1.0, 1.25]
    assert track["rate_z"][-1] == pytest.approx(0.5 - 0.25 + 0.25, abs=1e-14)  # a few roundings


def test_two_events_at_once_are_one_decision():
    law = Script(times=(0.3, 0.3, 0.7), levels=(1.0, -1.0, -1.0, 0.0))
    on_double_integrator(law, duration=1.0)
    assert law.calls == pytest.approx([0.0, 0.3, 0.7], abs=1e-11)


def test_an_event_that_is_zero_at_the_start_is_decided_once():
    track = on_double_integrator(Relay(level=1.0), duration=0.19, angle=0.0, rate=0.0)
    # s = 0 for as long as no thrust arrives: the law must not be called for ever at one instant.
    assert track.time[-1] == 0.19


# -- samples, delays, rows ----------------------------------------------------------------------


def test_a_relay_with_neither_delay_nor_period_is_refused():
    def task(period, delay):
        return ControlTask(
            Relay(level=1.0, period=period),
            engine(delay=delay),
            initial=Initial(),
            disturbance=Disturbance({}),
        )

    with pytest.raises(ValueError, match="'thruster_z' has neither delay nor minimum"):
        task(None, 0.0)
    task(0.1, 0.0)
    task(None, 1e-3)


@pytest.mark.parametrize("period", [0.07, 0.1, 0.0313, 1 / 3])
@pytest.mark.parametrize("plant", ["reduced", "mujoco"])
def test_a_sampled_law_is_called_at_the_multiples_of_its_period(period, plant):
    law = Script(times=(1.0,), levels=(1.0, -1.0), period=period)
    if plant == "reduced":
        on_double_integrator(law, duration=2.5, dt=0.02, substeps=5)
    else:
        full, _ = coupled(0.02, None)
        fly(full, law, Thrusters(machine().thrusters), duration=2.5, substeps=5)
    wanted = list(itertools.takewhile(lambda t: t <= 2.5, (k * period for k in range(100))))
    assert law.calls == wanted  # bit for bit


def test_an_undelayed_sampled_law_acts_from_its_sample_on():
    law = Script(times=(0.99,), levels=(1.0, -1.0), period=0.25)
    track = on_double_integrator(law, duration=2.0, thrusters=engine(delay=0.0))
    assert track["rate_z"][-1] == pytest.approx(1.0 - 1.0, abs=1e-14)  # a few roundings of 1
    assert np.max(track["rate_z"]) == pytest.approx(1.0, abs=1e-14)


@pytest.mark.parametrize("substeps", [1, 5])
def test_rows_stand_at_every_switching_and_every_edge(substeps):
    times = (math.sqrt(0.2), math.sqrt(0.9), math.sqrt(2.1))
    law = Script(times=times, levels=(1.0, -1.0, 0.0, 1.0))
    track = on_double_integrator(
        law,
        duration=2.5,
        thrusters=engine(delay=0.2, rise_time=0.03, fall_time=0.07),
        substeps=substeps,
    )
    assert track.time[0] == 0.0
    assert track.time[-1] == 2.5
    a, b, c = (t + 0.2 for t in times)
    edges = [0.2, 0.23, a, a + 0.07, a + 0.1, b, b + 0.07, c, c + 0.03]
    for instant in (*times, *edges, *np.arange(1, 2.5 / 0.25) * 0.25):
        # The root of the script's event to 1e-11 s, and roundings.
        assert np.min(np.abs(track.time - instant)) < 1.1e-11
    # Command and thrust of a row are those just after the instant.
    assert track["thruster_z_command"][0] == 1.0
    assert track["thruster_z_command"][np.argmin(np.abs(track.time - times[0]))] == -1.0
    # Impulse: area of the trapezoids, by hand, with six located ends; the plant has received it.
    up = (a - 0.2) - 0.03 / 2 + 0.07 / 2
    down = 0.03 / 2 + (b - a - 0.1) + 0.07 / 2
    last = 0.03 / 2 + (2.5 - c - 0.03)
    assert track["thruster_z_impulse"][-1] == pytest.approx(up - down + last, abs=1e-10)
    assert track["thruster_z_spent"][-1] == pytest.approx(up + down + last, abs=1e-10)
    assert track["rate_z"][-1] == pytest.approx(up - down + last, abs=1e-10)


def test_the_same_law_object_flies_on_both_plants():
    name = "efremov-nonlocal"
    ready = mission.assemble(mission.load_scenario(name, ("duration=10.0", "reduced.modes=3")))
    law, thrusters = (
        Relay(level=1.0, slope=0.3, sensors=QUASI_RIGID),
        Thrusters(machine().thrusters),
    )
    start = Initial(attitude=(0, 0, 0.001))
    found = [
        switchings(
            fly(p, law, thrusters, duration=10.0, initial=start, disturbance=ready.disturbance)
        )
        for p in (ready.mujoco, ready.reduced)
    ]
    assert len(found[0]) > 5
    # beta'' = u on both; the geometry of booms bent by 1 cm on 7.5 m adds 1e-6 of beta, over 25
    # switchings.
    assert found[0] == pytest.approx(found[1], abs=1e-4)


def test_a_thruster_or_a_sensor_that_is_not_there_is_refused_with_those_that_are():
    with pytest.raises(ValueError, match=r"'thruster_q' .*it has: thruster_z"):
        on_double_integrator(Relay(level=1.0, thrusters=("thruster_q",)), duration=1.0)
    with pytest.raises(ValueError, match=r"'yaw' .*attitude_z"):
        on_double_integrator(Relay(level=1.0, sensors=("yaw", "rate_z")), duration=1.0)


def test_inputs_of_plant_and_task_must_agree():
    plant = ReducedPhysics(double_integrator(), start=galerkin_start(0), timestep=0.05)
    with pytest.raises(ValueError, match=r"inputs are .*disturbance_z"):
        fly(plant, Relay(level=1.0), engine(), duration=1.0)  # the task has no disturbance
