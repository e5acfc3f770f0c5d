"""Verdicts at the edges: no disturbance, too short a flight, a failing thruster, nothing moving."""

import math

import dm_env
import numpy as np
import pytest

import spacecraft_sim
from spacecraft_sim import mission

NEAR = ("controller.attraction_level=0.0", "initial.attitude=[0.0, 0.0, 0.002]")
STILL = ("initial.rate=[0.0, 0.0, 0.0]", "initial.boom_amplitude=0.0")


def verdicts(*settings, plant="reduced", name="efremov-nonlocal"):
    ready = mission.assemble(mission.load_scenario(name, settings))
    track = ready.fly(plant)
    return {g.claim: g.check(track) for g in ready.guarantees}


@pytest.mark.parametrize("plant", ["reduced", "mujoco"])
def test_the_undisturbed_limit_cycle_is_found_to_hold(plant):
    settings = (*NEAR, *STILL, "disturbance={}", "duration=150.0")
    found = verdicts(*settings, plant=plant)
    for name in ("period", "|v/J|", "|beta/J|"):
        verdict = found[f"limit cycle: {name}"]
        assert verdict.holds, (verdict.measured, verdict.predicted, verdict.bound)


def test_a_flight_too_short_to_tell_says_so_and_claims_nothing():
    found = verdicts("duration=20.0")
    verdict = found["|beta/J| < eps from the predicted time on"]
    assert math.isnan(verdict.measured)
    assert not verdict.holds
    assert any("goes on after" in a.text for a in verdict.failed)


def test_a_limit_cycle_is_not_judged_in_its_transient():
    verdict = verdicts(*NEAR, "duration=30.0")["limit cycle: period"]
    assert not verdict.holds
    assert any("goes on after" in a.text for a in verdict.failed)


@pytest.mark.parametrize("level", [0.0, 8.2826625])
def test_a_thruster_that_fails_is_a_failed_assumption(level):
    failure = f"thrusters.thruster_z.failure={{time=70.0, level={level}}}"
    verdict = verdicts(*NEAR, failure, "duration=75.0")["|beta/J| in the end"]
    assert not verdict.holds
    assert any("thrust follows the commands" in a.text for a in verdict.failed)


def test_no_thrust_follows_a_sound_flight_unfaithfully():
    verdict = verdicts(*NEAR, "duration=75.0")["|beta/J| in the end"]
    assert verdict.holds, verdict.failed


def test_the_momentum_balance_of_a_quiet_machine_holds():
    # Nothing is given and the sum of all momenta stays near zero while the booms swing.
    found = verdicts(
        "disturbance={}", "initial.attitude=[0.0, 0.0, 0.0]", "initial.rate=[0.0, 0.0, 0.0]",
        "controller.attraction_level=0.0", "duration=0.15", plant="mujoco",
    )  # fmt: skip
    verdict = found["angular momentum about z is the impulse given"]
    assert verdict.holds, (verdict.measured, verdict.bound)


def test_specifications_are_there_before_the_first_reset():
    environment = spacecraft_sim.load("efremov-nonlocal", "duration=1.0")
    spec = environment.observation_spec()
    step = environment.reset()
    assert step.step_type is dm_env.StepType.FIRST
    assert list(spec) == list(step.observation)
    for name, value in step.observation.items():
        spec[name].validate(value)


def test_an_action_of_another_length_is_refused():
    environment = spacecraft_sim.load("efremov-nonlocal", "duration=1.0")
    environment.reset()
    with pytest.raises(ValueError, match=r"2 entries.*thruster_z"):
        environment.step(np.zeros(2))


def test_a_disturbance_that_the_relay_cannot_overcome_leaves_no_limit_cycle_to_judge():
    found = verdicts("disturbance.z.amplitude=50.0", "duration=150.0")
    for name in ("period", "|v/J|", "|beta/J|"):
        verdict = found[f"limit cycle: {name}"]
        assert not verdict.holds
        assert any("the relay overcomes the disturbance" in a.text for a in verdict.failed)
    calm = verdicts("disturbance.z.amplitude=0.001", "duration=150.0")["limit cycle: period"]
    assert any("overcomes" in a.text and a.holds for a in calm.assumptions)
