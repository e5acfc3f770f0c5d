"""Torques that follow the rate: turned over at the exact instant, told whether a thruster is on."""

import dataclasses

import numpy as np
import pytest

from spacecraft_sim.disturbance import Disturbance, Torque
from spacecraft_sim.reduced import ReducedPhysics, double_integrator, galerkin_start
from spacecraft_sim.scenario import Initial
from spacecraft_sim.simulate import Environment, simulate
from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.task import ControlTask
from spacecraft_sim.thrusters import Thrusters

F, E = 0.5, 0.2  # steady torque and the one that follows, N m, on 1 kg m^2


@dataclasses.dataclass(frozen=True, kw_only=True)
class Pulse:
    """One pulse between two instants."""

    start: float
    end: float
    level: float = -1.0
    period: float | None = None
    sensors: tuple[str, ...] = ()
    thrusters: tuple[str, ...] = ("thruster_z",)

    def init(self):
        return ()

    def step(self, t, y, memory):
        return (self.level if self.start <= t < self.end else 0.0,), (t,)

    def events(self, t, y, memory):
        return tuple(x - t for x in (self.start, self.end) if x > memory[0])


def flight(waveform, law, *, rate, duration=5.0, constant=F):
    model = double_integrator()
    task = ControlTask(
        law,
        Thrusters([Thruster(name="thruster_z", levels=(1.0,), min_on_time=0.1)]),
        initial=Initial(rate=(0.0, 0.0, rate)),
        disturbance=Disturbance({"z": Torque(constant=constant, amplitude=E, waveform=waveform)}),
    )
    plant = ReducedPhysics(model, start=galerkin_start(0), timestep=0.1)
    return simulate(Environment(plant, task, duration=duration, substeps=1), meta={})


IDLE = Pulse(start=9.0, end=10.0)


@pytest.mark.parametrize(("waveform", "sign"), [("with_rate", 1), ("against_rate", -1)])
def test_a_torque_that_follows_the_rate_turns_over_where_the_rate_does(waveform, sign):
    track = flight(waveform, IDLE, rate=-1.0)
    slow, fast = F - sign * E, F + sign * E  # accelerations before and after the rate is zero
    turn = 1 / slow
    assert np.min(np.abs(track.time - turn)) < 1e-11  # a row stands at the turning point
    t = track.time
    rate = np.where(t < turn, -1 + slow * t, fast * (t - turn))
    angle = np.where(
        t < turn, -t + slow * t**2 / 2, -turn + slow * turn**2 / 2 + fast * (t - turn) ** 2 / 2
    )
    # 1e-11 s late at the turn, once.
    np.testing.assert_allclose(track["rate_z"], rate, atol=1e-11)
    np.testing.assert_allclose(track["attitude_z"], angle, atol=5e-11)
    np.testing.assert_allclose(track["disturbance_z"][t > turn + 1e-10], fast, atol=1e-15)


@pytest.mark.parametrize("mirror", [1, -1])
@pytest.mark.parametrize("rate", [2.0, -4.0])
@pytest.mark.parametrize(("waveform", "off", "on"), [("leftmost", 1, -1), ("rightmost", -1, 1)])
def test_a_torque_may_tell_a_thruster_that_is_on(waveform, off, on, rate, mirror):
    pulse = Pulse(start=0.35, end=1.05, level=-mirror)
    track = flight(waveform, pulse, rate=mirror * rate, duration=2.0, constant=mirror * F)
    firing = track["thruster_z"] != 0
    assert firing.sum() > 5
    side = np.sign(rate)
    assert (mirror * side * track["rate_z"] > 0).all()
    when_on = -1 if waveform == "leftmost" else on * side  # (3.6) has no sign of v there
    torque = F + E * np.where(firing, when_on, off * side)
    np.testing.assert_allclose(track["disturbance_z"], mirror * torque)
    change = 1.3 * (F + off * side * E) + 0.7 * (F + when_on * E - 1)
    assert track["rate_z"][-1] == pytest.approx(mirror * (rate + change), abs=1e-12)  # roundings


def test_from_rest_the_torque_follows_where_the_rate_goes():
    track = flight("with_rate", IDLE, rate=0.0, duration=1.0)
    assert track["rate_z"][-1] == pytest.approx(F + E, abs=1e-11)


def test_a_sampled_law_has_its_disturbance_turned_over_between_samples_too():
    law = dataclasses.replace(IDLE, period=0.5)
    track = flight("with_rate", law, rate=-1.0)
    assert np.min(np.abs(track.time - 1 / (F - E))) < 1e-11
    assert track["rate_z"][-1] == pytest.approx((5 - 1 / (F - E)) * (F + E), abs=1e-10)


def test_only_torques_that_follow_a_rate_read_it():
    torques = {"x": Torque(amplitude=E), "z": Torque(amplitude=E, waveform="with_rate")}
    assert Disturbance(torques).sensors == ("rate_z",)
