"""Regulators for comparison: what they do is what their thresholds say."""

import math

import numpy as np
import pytest

from controllers import phase_plane, pwpf, schmitt_trigger
from controllers.channels import Channels
from spacecraft_sim.chart import pulses
from spacecraft_sim.disturbance import Disturbance, Torque
from spacecraft_sim.reduced import ReducedPhysics, double_integrator, galerkin_start
from spacecraft_sim.scenario import Initial
from spacecraft_sim.simulate import Environment, simulate
from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.task import ControlTask
from spacecraft_sim.thrusters import Thrusters

LEAST = 0.05  # minimum on-time, s


def fly(law, *, angle=0.0, rate=0.0, torque=0.0, duration=60.0):
    model = double_integrator()
    task = ControlTask(
        law,
        Thrusters([Thruster(name="thruster_z", levels=(1.0,), min_on_time=LEAST)]),
        initial=Initial(attitude=(0.0, 0.0, angle), rate=(0.0, 0.0, rate)),
        disturbance=Disturbance({"z": Torque(constant=torque)}),
    )
    plant = ReducedPhysics(model, start=galerkin_start(0), timestep=0.1)
    return simulate(Environment(plant, task, duration=duration, substeps=1), meta={})


def test_schmitt_trigger_switches_at_its_thresholds():
    law, guarantees = schmitt_trigger.design(threshold=0.1, lead=2.0, hysteresis=0.4)
    assert guarantees == ()
    track = fly(law, angle=0.5)
    s = track["attitude_z"] + 2.0 * track["rate_z"]
    on = np.flatnonzero(np.diff(np.abs(track["thruster_z_command"])) > 0) + 1
    off = np.flatnonzero(np.diff(np.abs(track["thruster_z_command"])) < 0) + 1
    assert len(on) > 5
    assert len(off) > 5
    # Located to 1e-11 s, at rates of s up to 2 per s.
    np.testing.assert_allclose(np.abs(s[on]), 0.1, atol=3e-11)
    np.testing.assert_allclose(np.abs(s[off]), 0.06, atol=3e-11)


def test_two_pulse_logic_drifts_at_its_rate_between_the_ends_of_the_dead_band():
    law, _ = phase_plane.design(dead_band=0.1, drift=0.06)
    track = fly(law, angle=0.05, rate=0.03)
    start, length = pulses(track.time, track["thruster_z"])
    late = track.time > start[1]
    coasting = late & (track["thruster_z"] == 0)
    np.testing.assert_allclose(np.abs(track["rate_z"][coasting]), 0.06, atol=1e-10)
    # Each pulse turns +drift into -drift: 2 drift over 1 rad/s^2.
    np.testing.assert_allclose(length[1:], 2 * 0.06, atol=1e-10)
    # A pulse carries the angle on by drift^2/2 beyond the dead band.
    assert np.abs(track["attitude_z"][late]).max() == pytest.approx(0.1 + 0.06**2 / 2, rel=1e-3)


def test_a_steady_torque_leaves_two_pulse_logic_one_pulse_a_cycle():
    law, _ = phase_plane.design(dead_band=0.1, drift=0.06)
    track = fly(law, torque=0.02, duration=120.0)
    assert set(np.sign(track["thruster_z"])) == {0.0, -1.0}


@pytest.mark.parametrize("angle", [3.0, -3.0])
def test_pwpf_brings_the_spacecraft_into_its_dead_zone(angle):
    law, _ = pwpf.design(bandwidth=0.4, on=0.45, gain=4.5)
    track = fly(law, angle=angle)
    late = track.time > 40
    # At rest the modulator stays silent while K k_p |x| < on.
    assert np.abs(track["attitude_z"][late]).max() < 0.45 / 4.5 / 0.4**2
    assert pulses(track.time, track["thruster_z"])[1].min() >= LEAST * (1 - 1e-9)


def test_pwpf_in_its_linear_range_gives_the_pd_torque_on_average():
    law, _ = pwpf.design(bandwidth=0.4, on=0.45, off=0.15, time_constant=0.15, period=0.001)
    memory, spent, y = law.init(), 0.0, (-0.5 / 0.4**2, 0.0)  # asks for half the thrust
    for k in range(20_000):
        (u,), memory = law.step(k * 1e-3, y, memory)
        spent += u * 1e-3
    # Its output falls short of the input by the mean of the trigger's thresholds over the gain.
    assert spent / 20 == pytest.approx(0.5 - (0.45 + 0.15) / 2 / 4.5, abs=0.02)


def test_lag_of_the_modulator_is_carried_exactly():
    law, _ = pwpf.design(bandwidth=0.4, time_constant=0.3, period=0.06, on=2.0, gain=1.0)
    _, memory = law.step(0.0, (-1.0 / 0.4**2, 0.0), law.init())
    (channel,) = memory.channels
    assert channel.lag == pytest.approx(1 - math.exp(-0.2), rel=1e-14)


@pytest.mark.parametrize(
    ("design", "numbers", "words"),
    [
        (schmitt_trigger.design, {"threshold": 0.1, "lead": 1.0, "hysteresis": 1.0}, "below 1"),
        (schmitt_trigger.design, {"threshold": -0.1, "lead": 1.0}, "threshold = -0.1"),
        (phase_plane.design, {"dead_band": 0.1, "drift": 0.0}, "drift = 0.0"),
        (pwpf.design, {"bandwidth": 1.0, "on": 0.2, "off": 0.3}, "off = 0.3 must be below on"),
    ],
)
def test_numbers_that_make_no_regulator_are_refused(design, numbers, words):
    with pytest.raises(ValueError, match=words):
        design(**numbers)


@pytest.mark.parametrize(
    ("design", "numbers"),
    [
        (schmitt_trigger.design, {"threshold": 0.1, "lead": 2.0}),
        (phase_plane.design, {"dead_band": 0.1, "drift": 0.06}),
        (pwpf.design, {"bandwidth": 0.8}),
    ],
)
def test_against_a_steady_torque_one_way_is_enough(design, numbers):
    track = fly(design(**numbers, ways="negative")[0], torque=0.3, angle=-0.2, rate=0.1)
    assert set(np.sign(track["thruster_z"])) == {0.0, -1.0}
    assert np.abs(track["attitude_z"][track.time > 40]).max() < 1.0


def test_laws_side_by_side_decide_each_for_itself():
    x, _ = schmitt_trigger.design(threshold=0.1, lead=1.0)
    laws = Channels(laws=(x, phase_plane.TwoPulse(
        dead_band=0.2, drift=0.1, level=2.0, signs=(-1, 1), sensors=("a", "b"), thrusters=("other",)
    )))  # fmt: skip
    assert laws.sensors == ("attitude_z", "rate_z", "a", "b")
    u, memory = laws.step(0.0, (0.05, 0.0, 0.1, 0.0), laws.init())
    assert u == (0.0, 0.0)
    assert min(laws.events(0.0, (0.05, 0.0, 0.1, 0.0), memory)) == pytest.approx(0.05)
    u, memory = laws.step(1.0, (0.05, 0.0, 0.3, 0.0), memory)
    assert u == (0.0, -2.0)  # the first one's instant was not come


def test_laws_side_by_side_must_fit():
    a, _ = schmitt_trigger.design(threshold=0.1, lead=1.0)
    b, _ = pwpf.design(bandwidth=1.0)
    with pytest.raises(ValueError, match="different periods"):
        Channels(laws=(a, b))
    with pytest.raises(ValueError, match="same channel"):
        Channels(laws=(a, a))
    with pytest.raises(ValueError, match="at least one"):
        Channels(laws=())
