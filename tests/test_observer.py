"""The observer: its estimate, its error bound, and the relay that steps on it."""

import numpy as np
import pytest

from controllers.observer import Unknown, design_observer
from spacecraft_sim import mission
from spacecraft_sim.trajectory import sample_rows

SCENARIO = "efremov-observed"
SHORT = ("duration=150.0",)


def flown(*settings, plant="reduced"):
    ready = mission.assemble(mission.load_scenario(SCENARIO, (*SHORT, *settings)))
    return ready, ready.fly(plant)


def estimation_errors(track, after):
    """Largest errors of angle and rate at the samples after a time."""
    rows, _ = sample_rows(track.time, 0.01)
    late = rows[track.time[rows] > after]
    kinds = ("quasi_rigid_angle_z", "quasi_rigid_rate_z")
    return [np.max(np.abs(track[f"estimated_{x}"][late] - track[x][late])) for x in kinds]


@pytest.mark.parametrize("sensors", ["angle", "angle and rate"])
def test_estimate_is_exact_without_disturbance_noise_or_unknown_modes(sensors):
    settings = (
        f'controller.sensors="{sensors}"', "disturbance.z.amplitude=0.0",
        "controller.angle_noise=1e-9", "controller.rate_noise=1e-9", "reduced.modes=3",
    )  # fmt: skip
    _, track = flown(*settings)
    # The start of the booms is unknown; what it cost has died away.
    angle, rate = estimation_errors(track, after=120.0)
    assert angle < 1e-8
    assert rate < 1e-8


def test_error_stays_within_its_bound():
    ready, track = flown("initial.boom_amplitude=0.0")
    angle, rate = estimation_errors(track, after=0.0)
    model = ready.reduced.model
    unit = model.gain("thruster_z", "quasi_rigid_rate_z")
    relay = ready.controller.law
    _, bounds = design_observer(
        model, ready.thrusters["reduced"], channels=relay.thrusters, sensors=("attitude_z",),
        fed=relay.sensors, period=0.01,
        unknown=Unknown(thrust=(8.6e-7 / unit,), impulse=(0.0,), noise=(2e-5,), steady=(0.0,)),
    )  # fmt: skip
    assert angle <= bounds.error[0]
    assert rate <= bounds.error[1]
    assert bounds.error[0] < 0.007 / 4  # and says something: a quarter of eps


def test_the_bound_of_the_error_is_nearly_attained():
    ready = mission.assemble(mission.load_scenario("sokolov-estimated"))
    channels = [law.thrusters[0] for law in ready.controller.law.laws]
    w, noise = 1e-4, 1e-8
    observer, bounds = design_observer(
        ready.reduced.model, None, channels=tuple(channels),
        sensors=ready.controller.sensors, fed=ready.controller.law.sensors, period=0.05,
        unknown=Unknown(thrust=(w,) * 3, impulse=(0.0,) * 3, noise=(noise,) * 3, steady=(0.0,) * 3),
    )  # fmt: skip
    settle = np.eye(len(observer.step)) - observer.gain @ observer.C
    # A thrust held over each period and noise at each sample, of the signs that add up.
    driven = np.hstack([settle @ observer.after * w, observer.gain * noise])
    attained, jump, term = np.zeros(6), np.zeros(3), driven
    for _ in range(4000):
        attained += np.abs(observer.fed @ term).sum(axis=1)
        jump += np.abs(observer.C @ observer.step @ term).sum(axis=1)
        term = settle @ observer.step @ term
    assert np.abs(term).max() < 1e-9 * np.abs(driven).max()
    # The bound lets an impulse fall anywhere within a period, on each state as it likes.
    assert np.all(attained <= bounds.error)
    assert np.all(attained > 0.5 * bounds.error)
    corrections = np.abs(observer.fed @ observer.gain) @ (jump + noise) / 0.05
    assert np.all(corrections <= bounds.jumps)
    assert np.all(corrections > 0.5 * bounds.jumps)


def test_pending_thrust_is_accounted_for():
    # An observer that believes in another delay is off by more than its bound for this one.
    _, track = flown("initial.boom_amplitude=0.0")
    right = estimation_errors(track, after=20.0)
    _, track = flown(
        "initial.boom_amplitude=0.0", "actual.thrusters.all.delay=0.15", plant="mujoco"
    )
    wrong = estimation_errors(track, after=20.0)
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
        ("controller.angle_noise=1e-8", "observer of 14 states .* fewer modes"),
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


@pytest.mark.parametrize("modes", [3, 6])
def test_modes_that_the_observer_does_not_know_are_said_to_break_its_bounds(modes):
    ready, track = flown(f"reduced.modes={modes}", plant="mujoco")
    for verdict in (g.check(track) for g in ready.guarantees[:3]):
        failed = [a for a in verdict.failed if "estimates keep their bounds" in a.text]
        assert verdict.holds == (modes == 6)
        assert bool(failed) == (modes == 3)
        assert verdict.margin > 0  # the figures alone would not tell


def test_the_theorem_speaks_from_when_the_start_is_forgotten():
    ready, track = flown()
    verdict = ready.guarantees[0].check(track)
    (since,) = [a.value for a in verdict.assumptions if "estimates keep" in a.text]
    assert 5.0 < since < 20.0  # the booms swing at the start, which the observer does not know
    rows = sample_rows(track.time, 0.01)[0]
    late, over = track.time[rows] >= since, []
    for name in ("quasi_rigid_angle_z", "quasi_rigid_rate_z"):
        error = np.abs(track[f"estimated_{name}"] - track[name])[rows]
        over.append(error[~late][-1] > error[late].max())
    assert any(over)  # the last sample before is over a bound, and none after
    # Its entry condition is that of the state then, not of the one at first.
    (entry,) = [a.value for a in verdict.assumptions if a.text == "|beta| + error < R"]
    beta = np.abs(track["quasi_rigid_angle_z"])
    assert np.interp(since, track.time, beta) < entry < beta[0]
