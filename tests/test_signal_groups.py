"""Which readings are plotted together."""

import numpy as np

from spacecraft_sim.signal_groups import groups
from spacecraft_sim.trajectory import Trajectory


def flight(units, **values):
    time = np.linspace(0.0, 1.0, 5)
    signals = {name: scale * np.sin(7 * time) for name, scale in values.items()}
    return Trajectory(time=time, signals=signals, units=dict.fromkeys(values, "") | units)


def test_vectors_are_grouped_by_kind_and_what_hardly_moves_is_left_out():
    units = {"attitude_x": "rad", "attitude_z": "rad", "rate_z": "rad/s"}
    one = flight(units, attitude_x=1e-5, attitude_z=0.5, rate_z=1.0, angular_momentum_z=3.0)
    attitude, rate = groups([one], [])
    assert (attitude.name, attitude.unit, attitude.role) == ("attitude", "rad", "position")
    assert attitude.signals == ("attitude_z",)
    assert attitude.labels == ("z",)
    assert (rate.name, rate.unit, rate.role) == ("rate", "rad/s", "rate")


def test_an_axis_that_moves_in_any_flight_is_shown():
    still = flight({"attitude_x": "rad"}, attitude_x=0.0, attitude_z=1.0)
    moving = flight({"attitude_x": "rad"}, attitude_x=0.5, attitude_z=1.0)
    assert groups([still, moving], [])[0].signals == ("attitude_x", "attitude_z")
    assert groups([still], [])[0].signals == ("attitude_z",)


def test_only_what_all_flights_read_is_shown():
    one = flight({}, attitude_z=1.0, rate_z=1.0)
    other = flight({}, rate_z=1.0)
    assert [group.name for group in groups([one, other], [])] == ["rate"]


def test_joints_are_readings_with_a_rate():
    units = {"elbow": "rad", "elbow_rate": "rad/s"}
    angles, rates = groups([flight(units, elbow=1.0, elbow_rate=2.0, torque=9.0)], [])
    assert (angles.name, angles.signals, angles.unit) == ("joint_angle", ("elbow",), "rad")
    assert (rates.name, rates.signals, rates.unit) == ("joint_rate", ("elbow_rate",), "rad/s")
    assert angles.labels == rates.labels == ("elbow",)


def test_tips_are_judged_by_their_swing_not_by_where_they_are():
    time = np.linspace(0.0, 1.0, 5)
    signals = {
        "left_tip_x": np.full(5, 7.5),
        "left_tip_y": 0.1 * np.sin(7 * time),
        "left_tip_z": np.full(5, 2.0),  # bent for good, not swinging
    }
    one = Trajectory(time=time, signals=signals, units=dict.fromkeys(signals, "m"))
    (tips,) = groups([one], ["left"])
    assert tips.signals == ("left_tip_y",)
    assert tips.labels == ("left y",)
    assert tips.role == "tip"
    assert groups([one], []) == ()
