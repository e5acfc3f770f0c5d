"""The observer: its estimate, its error bound, and the relay that steps on it."""

import dataclasses

import numpy as np
import pytest

from controllers import efremov_observer
from spacecraft_sim import mission

SCENARIO = "efremov-observed"
SHORT = ("duration=150.0",)


def flown(*settings, plant="reduced"):
    ready = mission.assemble(mission.load_scenario(SCENARIO, (*SHORT, *settings)))
    law = ready.controller
    estimates = []

    class Watched:
        """The law, with its estimates kept."""

        sensors, thrusters, period = law.sensors, law.thrusters, law.period
        init, events = staticmethod(law.init), staticmethod(law.events)

        def step(self, t, y, memory):
            u, memory = law.step(t, y, memory)
            estimates.append((t, memory.estimate.angle, memory.estimate.rate))
            return u, memory

    track = dataclasses.replace(ready, controller=Watched()).fly(plant)
    return ready, track, np.array(estimates)


def estimation_errors(track, estimates, after):
    """Largest errors of angle and rate after a time, at the samples that are rows too."""
    times, i, j = np.intersect1d(
        np.round(track.time, 9), np.round(estimates[:, 0], 9), return_indices=True
    )
    late = times > after
    true = np.column_stack([track["quasi_rigid_angle_z"], track["quasi_rigid_rate_z"]])[i][late]
    return np.max(np.abs(estimates[j][late, 1:] - true), axis=0)


@pytest.mark.parametrize("sensors", ["angle", "angle and rate"])
def test_estimate_is_exact_without_disturbance_noise_or_unknown_modes(sensors):
    settings = (
        f'controller.sensors="{sensors}"', "disturbance.z.amplitude=0.0",
        "controller.angle_noise=1e-9", "controller.rate_noise=1e-9",
    )  # fmt: skip
    _, track, estimates = flown(*settings)
    # The start of the booms is unknown; what it cost has died away.
    angle, rate = estimation_errors(track, estimates, after=120.0)
    assert angle < 1e-8
    assert rate < 1e-8


def test_error_stays_within_its_bound():
    ready, track, estimates = flown("initial.boom_amplitude=0.0")
    angle, rate = estimation_errors(track, estimates, after=0.0)
    law = ready.controller
    noise = np.array([2e-5])
    _, errors = efremov_observer._observer(law.model, law.rows, law.period, 8.6e-7, 0.0, noise)
    assert angle <= errors.angle
    assert rate <= errors.rate
    assert errors.angle < 0.007 / 4  # and says something: a quarter of eps


def test_pending_thrust_is_accounted_for():
    # An observer that believes in another delay is off by more than its bound for this one.
    _, track, estimates = flown("initial.boom_amplitude=0.0")
    right = estimation_errors(track, estimates, after=20.0)
    _, track, estimates = flown(
        "initial.boom_amplitude=0.0", "actual.thrusters.all.delay=0.15", plant="mujoco"
    )
    wrong = estimation_errors(track, estimates, after=20.0)
    assert wrong[1] > 3 * right[1]


@pytest.mark.parametrize("sensors", ["angle", "angle and rate"])
@pytest.mark.parametrize("plant", ["mujoco", "reduced"])
def test_claims_on_beta_hold_on_both_plants(sensors, plant):
    ready = mission.assemble(
        mission.load_scenario(SCENARIO, (*SHORT, f'controller.sensors="{sensors}"'))
    )
    track = ready.fly(plant)
    for guarantee in ready.guarantees:
        if "beta" in guarantee.claim or "v/J" in guarantee.claim:
            verdict = guarantee.check(track)
            assert verdict.holds, (verdict.claim, verdict.failed)


def test_law_reads_no_more_than_it_declares():
    ready = mission.assemble(mission.load_scenario(SCENARIO, SHORT))
    assert ready.controller.sensors == ("attitude_z",)


def test_a_disturbance_too_large_for_the_observer_is_said_to_fail():
    ready = mission.assemble(
        mission.load_scenario(SCENARIO, (*SHORT, "controller.disturbance=5e-4"))
    )
    verdict = ready.guarantees[0].check(ready.fly("reduced"))
    assert not verdict.holds
    assert any("observer costs" in a.text for a in verdict.failed)


@pytest.mark.parametrize(
    ("setting", "message"),
    [
        ("controller.period=0.0", "period = 0.0"),
        ("controller.disturbance=-1.0", "disturbance = -1.0"),
        ("controller.angle_noise=0.0", "angle_noise = 0.0"),
        ('controller.sensors="rate"', "controller.sensors"),
    ],
)
def test_bad_input_is_refused(setting, message):
    with pytest.raises(ValueError, match=message):
        mission.assemble(mission.load_scenario(SCENARIO, (setting,)))


def test_a_delay_other_than_the_one_assumed_is_said_to_fail():
    ready = mission.assemble(
        mission.load_scenario(SCENARIO, (*SHORT, "actual.thrusters.all.delay=0.16"))
    )
    verdict = ready.guarantees[0].check(ready.fly())
    assert not verdict.holds
    assert any("as the observer assumes" in a.text for a in verdict.failed)
