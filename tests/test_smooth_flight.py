"""Flights of smooth laws on equations of motion: sampling, limits, disturbances, refusals."""

import math
from dataclasses import dataclass, replace

import burkov_cases as cases
import numpy as np
import pytest

from controllers.burkov_laws import Spin
from controllers.velocity_filter import sampled
from spacecraft_sim.smooth_flight import closed_loop, fly, fly_continuous

START = np.array([1.5, -1.0, 0.0, 0.0])


@dataclass(frozen=True)
class Wheel:
    """x'' = u, both read."""

    inputs: tuple[str, ...] = ("torque",)

    @property
    def units(self):
        return {"angle": "rad", "rate": "rad/s"}

    def rates(self, x, u):
        return np.stack([x[..., 1], u[..., 0]], axis=-1)

    def readings(self, x):
        return x


@dataclass(frozen=True)
class Pull:
    """u = -x - 2 x'."""

    def filtered(self, t, y):
        return ()

    def command(self, t, y, w):
        return [-y[0] - 2 * y[1]]


def pull(period):
    return sampled(
        Pull(), cutoffs=(), hold="tustin", period=period, sensors=("angle", "rate"),
        channels=("torque",), thrusters=None,
    )  # fmt: skip


def test_a_held_torque_in_closed_form():
    T = 0.1
    (run,) = fly(Wheel(), pull(T), starts=[1.0, 0.0], duration=1.0)
    x, v = 1.0, 0.0
    for k in range(11):
        u = -x - 2 * v
        assert run["torque"][k] == pytest.approx(u, abs=1e-12)  # rounding of parabolas
        assert (run["angle"][k], run["rate"][k]) == pytest.approx((x, v), abs=1e-12)
        x, v = x + T * v + T * T / 2 * u, v + T * u
    assert run.time == pytest.approx(np.arange(11) * T)


def test_a_last_piece_may_be_shorter_than_a_period():
    (run,) = fly(Wheel(), pull(0.1), starts=[1.0, 0.0], duration=0.25)
    assert run.time == pytest.approx([0.0, 0.1, 0.2, 0.25])
    assert run["torque"][-1] == run["torque"][-2]  # still held


def test_the_continuous_loop_in_closed_form():
    times = np.linspace(0, 4, 9)
    run = fly_continuous(Wheel(), pull(1.0), start=np.array([1.0, 0.0]), times=times)
    # A double root at -1; rtol 1e-10.
    assert run["angle"] == pytest.approx((1 + times) * np.exp(-times), abs=1e-9)
    assert run["torque"] == pytest.approx((times - 1) * np.exp(-times), abs=1e-9)


def test_sampled_flights_converge_to_the_continuous_one():
    law, _ = cases.position()
    exact = fly_continuous(cases.ARM, law, start=START, times=np.array([0.0, 0.5]))
    errors = []
    for T in (4e-3, 2e-3, 1e-3):
        (run,) = fly(cases.ARM, cases.position(period=T)[0], starts=START, duration=0.5)
        errors.append(abs(run["joint_1"][-1] - exact["joint_1"][-1]))
    # A held torque is T/2 late: first order.
    assert errors[0] / errors[1] == pytest.approx(2, rel=0.05)
    assert errors[1] / errors[2] == pytest.approx(2, rel=0.05)


def test_flights_together_are_the_flights_alone():
    law, _ = cases.position()
    starts = np.array([START, [0.3, 0.2, 1.0, -1.0]])
    together = fly(cases.ARM, law, starts=starts, duration=0.3)
    for start, run in zip(starts, together, strict=True):
        (alone,) = fly(cases.ARM, law, starts=start, duration=0.3)
        for name, values in alone.signals.items():
            # Each chooses its own steps within a tolerance of 1e-10.
            assert run[name] == pytest.approx(values, abs=1e-7), name


def test_rows_may_be_thinned():
    law, _ = cases.position()
    (whole,) = fly(cases.ARM, law, starts=START, duration=0.1)
    (thin,) = fly(cases.ARM, law, starts=START, duration=0.1, every=30)
    assert thin.time == pytest.approx([0.0, 0.03, 0.06, 0.09, 0.1])
    assert thin["motor_1"] == pytest.approx(whole["motor_1"][[0, 30, 60, 90, 100]], rel=1e-12)


def test_limits_bind_the_torque_and_not_the_command():
    law, _ = cases.position()
    (run,) = fly(cases.ARM, law, starts=START, duration=0.2, limits=(20.0, math.inf))
    assert np.max(np.abs(run["motor_1_command"])) > 20.0
    assert np.max(np.abs(run["motor_1"])) == 20.0
    assert np.array_equal(run["motor_2"], run["motor_2_command"])


def test_a_disturbance_adds_to_the_torque():
    for fly_one in (
        lambda d: fly(Wheel(), pull(1e-2), starts=[0.0, 0.0], duration=20.0, disturbance=d)[0],
        lambda d: fly_continuous(
            Wheel(), pull(1.0), start=np.zeros(2), times=np.array([0.0, 20.0]), disturbance=d
        ),
    ):
        run = fly_one(lambda t: [0.3])
        # The spring of 1 N m/rad gives way by 0.3; what is left is 20 e^-20.
        assert run["angle"][-1] == pytest.approx(0.3, abs=1e-6)


def test_filtered_rates_are_recorded_in_continuous_time():
    law, _ = cases.position()
    times = np.linspace(0, 2, 201)
    run = fly_continuous(cases.ARM, law, start=START, times=times)
    w, K = run["w_1"], 20.0
    assert w[0] == 0.0
    slope = np.gradient(w, times, edge_order=2)
    # w' = -K w + q'; differences over 10 ms leave (K dt)^2/6 of 1 rad/s.
    assert slope[5:] == pytest.approx((run["joint_1_rate"] - K * w)[5:], abs=0.02)
    assert run.units["w_1"] == ""


def test_laws_get_what_they_name_in_their_order():
    law = sampled(
        Spin(alpha=None, beta=1.0, gamma=2.0, k=3.0, spin=0.0), cutoffs=(), hold="tustin",
        period=0.1, sensors=("s1_y", "s1_z", "rate_y", "rate_z"),
        channels=("torque_y", "torque_z"), thrusters=None,
    )  # fmt: skip
    start = np.r_[0.1, 0.2, 0.3, np.eye(3).ravel()]
    start[4], start[5] = 0.01, 0.02
    (run,) = fly(cases.BODY, law, starts=start, duration=0.05)
    assert run["torque_x"][0] == 0.0
    assert run["torque_y"][0] == pytest.approx(-0.2 - 3 * 0.02)
    assert run["torque_z"][0] == pytest.approx(-2 * 0.3 + 3 * 0.01)


def test_missing_sensors_and_inputs_are_named():
    law, _ = cases.position()
    with pytest.raises(ValueError, match=r"sensor 'joint_1' is not in RigidBody; .*it has: rate_x"):
        fly(cases.BODY, law, starts=np.zeros(12), duration=0.1)
    with pytest.raises(ValueError, match=r"input 'motor_1' is not in Wheel; .*it has: torque"):
        fly(Wheel(), replace(law, sensors=("angle", "rate")), starts=np.zeros(2), duration=0.1)
    with pytest.raises(ValueError, match="sensor 'joint_1'"):
        closed_loop(cases.BODY, law)


def test_a_law_without_a_period_is_refused():
    class Relay:
        sensors, thrusters, period = ("angle",), ("torque",), None

    with pytest.raises(ValueError, match="no sampling period"):
        fly(Wheel(), Relay(), starts=np.zeros(2), duration=0.1)  # pyright: ignore


def test_a_motion_that_blows_up_is_caught():
    law = pull(0.5)
    with pytest.raises(ArithmeticError, match="cannot be integrated beyond t ="):
        fly(Blowing(), law, starts=[1.0, 0.0], duration=5.0)


class Blowing(Wheel):
    """x' = x^3: out of bounds at t = 1/2."""

    def rates(self, x, u):
        return np.stack([x[..., 0] ** 3, 0 * x[..., 1]], axis=-1)
