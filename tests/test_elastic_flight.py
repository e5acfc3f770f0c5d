"""Flights of given torques on MuJoCo: the exact linear motion, order, momentum, refusals."""

import mujoco
import numpy as np
import pytest
from relatives import relative, shipped

from spacecraft_sim.elastic_flight import fly, longest_step
from spacecraft_sim.elastic_modes import moment_history

NAMES = ("two_boom_3d", "four_boom", "asymmetric_booms")
SCHEDULE = {
    "switch_times": ([1.0, 3.7, 4.4], [2.2, 3.7], [0.9]),
    "levels": ([1.0, -1.0, 1.0, -1.0], [-0.5, 0.0, 0.5], [0.3, -0.3]),
}


def scaled(factor):
    levels = tuple(factor * np.array(level) for level in SCHEDULE["levels"])
    return {"switch_times": SCHEDULE["switch_times"], "levels": levels}


@pytest.mark.parametrize("name", NAMES)
def test_small_motion_is_the_exact_linear_one(name):
    model, elastic = shipped(name)
    flight = fly(model, **scaled(1e-5), duration=12.0)
    rows = np.flatnonzero(np.diff(flight.time, append=99.0) > 0)  # after a switching, not before
    exact = moment_history(elastic, **scaled(1e-5), times=flight.time[rows])
    found = np.stack([flight[f"moment_{axis}"][rows] for axis in "xyz"], axis=1)
    # Steps of 0.1 rad: (0.1)^4/120 a radian, some 20 rad; products of motions are 1e-6.
    assert found == pytest.approx(exact, rel=1e-4, abs=2e-5 * np.abs(exact).max())


def test_the_order_is_four_across_switchings():
    model, _ = shipped("two_boom_3d")
    finals = [
        fly(model, **scaled(1.0), duration=12.0, timestep=h)["left_x"][-1]
        for h in (0.1, 0.05, 0.0125)  # every piece is a multiple of 0.1 s
    ]
    errors = np.abs(np.array(finals[:2]) - finals[2])
    assert errors[0] / errors[1] > 13  # 16, and the finest is no exact solution


def test_momentum_is_what_the_torques_gave():
    model, elastic = shipped("two_boom_3d")
    flight = fly(model, **scaled(1e-4), duration=12.0, disturbance=(1e-4, 0, -1e-4))
    for k, (axis, push) in enumerate(zip("xyz", (1e-4, 0, -1e-4), strict=True)):
        time, torque = flight.time, flight[f"torque_{axis}"] + push
        impulse = np.sum(torque[:-1] * np.diff(time))
        # Of products of motions, at deflections of 2e-5 rad.
        spin = flight[f"spin_{axis}"][-1] * elastic.J[k, k]
        assert spin == pytest.approx(impulse, rel=1e-5, abs=1e-9)


def test_a_spin_without_torque_is_gyroscopic():
    model, elastic = shipped("two_boom_3d")
    spin = np.array([0.01, 0.02, -0.01])
    flight = fly(
        model, switch_times=([], [], []), levels=([0.0], [0.0], [0.0]), duration=1.0, spin=spin
    )
    start = np.array([flight[f"gyroscopic_{axis}"][0] for axis in "xyz"])
    np.testing.assert_allclose(start, np.cross(spin, elastic.J @ spin), rtol=1e-12)
    moment = np.array([flight[f"moment_{axis}"][0] for axis in "xyz"])
    assert np.abs(moment).max() > 0.5 * np.abs(start).max()  # M - J omega' sees it


def test_rows_stand_before_and_after_a_switching():
    model, _ = relative(0.1, 0.05)
    flight = fly(model, **SCHEDULE, duration=5.0)
    for axis, at in zip("xyz", SCHEDULE["switch_times"], strict=True):
        jumps = np.flatnonzero(np.diff(flight[f"torque_{axis}"]) != 0)
        np.testing.assert_allclose(flight.time[jumps], at, rtol=1e-15)
        np.testing.assert_allclose(flight.time[jumps + 1], at, rtol=1e-15)
    assert flight.time[-1] == flight.time[-2] == 5.0
    # A switching at the very end counts: the moment jumps by H D^-1 G dM.
    late = fly(
        model, switch_times=([5.0], [], []), levels=([1.0, -1.0], [0.0], [0.0]), duration=5.0
    )
    elastic = relative(0.1, 0.05)[1]
    jump = (elastic.H @ np.linalg.solve(elastic.D, elastic.G))[0, 0] * 2
    moment = late["moment_x"]
    # Bent joints have turned a little: 1e-3.
    assert moment[-1] - moment[-2] == pytest.approx(jump, rel=1e-3)


def test_the_model_is_left_as_it_is():
    model, _ = shipped("four_boom")
    before = (model.opt.timestep, model.qpos0.tobytes())
    first = fly(model, **SCHEDULE, duration=3.0)
    again = fly(model, **SCHEDULE, duration=3.0)
    assert (model.opt.timestep, model.qpos0.tobytes()) == before
    for name, signal in first.signals.items():
        assert signal.tobytes() == again[name].tobytes()
    assert set(first.units) == set(first.signals)


def test_steps_follow_what_rings_and_stay_stable_with_what_does_not():
    _, elastic = shipped("two_boom_3d")
    assert longest_step(elastic) == pytest.approx(0.1 / 1.5352867, rel=1e-6)
    # Overdamped: the fastest real eigenvalue decides.
    fast = relative(0.1, 50.0)[1]
    assert longest_step(fast) < 1.5 / 100
    flight = fly(relative(0.1, 50.0)[0], **scaled(1e-3), duration=3.0)
    assert np.abs(flight["left_x"]).max() < 1.0


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"levels": ([1.0], [0.0], [0.0])}, r"channel x: 3 switch times.* need 4 levels; got 1"),
        ({"switch_times": ([3.0, 1.0, 4.0], [2, 3], [1])}, "channel x: .* ascending and > 0"),
        ({"switch_times": ([0.0, 1.0, 4.0], [2, 3], [1])}, "channel x: .* ascending and > 0"),
        ({"duration": 0.0}, r"duration = 0\.0"),
        ({"timestep": -0.1}, r"timestep = -0\.1"),
        ({"timestep": 10.0, "duration": 2000.0}, "the motion is not finite with a step of 10 s"),
    ],
)
def test_bad_schedules_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        fly(shipped("two_boom_3d")[0], **{**SCHEDULE, "duration": 5.0, **changes})


def test_what_is_no_free_structure_is_refused():
    with pytest.raises(ValueError, match="it needs one free joint"):
        fly(mujoco.MjModel.from_xml_string("<mujoco/>"), **SCHEDULE, duration=1.0)
