"""Charts: pulses and the worst to come, from a flight; the page that shows them."""

import numpy as np
import pytest

from spacecraft_sim import chart, plots_chart
from spacecraft_sim.chart import Line, Map, Portrait, Region, charts_of, pulses, worst_to_come
from spacecraft_sim.trajectory import Trajectory

CIRCLE = np.stack([np.cos(np.linspace(0, 6.3, 60)), np.sin(np.linspace(0, 6.3, 60))], axis=1)
PORTRAIT = Portrait(
    name="axis_z",
    title="Phase plane of z",
    signals=("attitude_z", "rate_z"),
    channel="thruster_z",
    min_on_time=0.5,
    band=2e-3,
    lines=(
        Line(name="contour", points=2e-3 * CIRCLE, look="bound"),
        Line(name="switching", points=1e-3 * CIRCLE, look="switching"),
    ),
    regions=(Region(name="W1", outline=1e-3 * CIRCLE[:20]),),
)
MAP = Map(
    name="region_z",
    title="Where it works",
    labels=("F/u0", "e/u0"),
    point=(0.8, 0.1),
    lines=(Line(name="k = 1", points=np.array([[0.6, 0.2], [np.nan, np.nan], [0.7, 0.2]])),),
    regions=(Region(name="(3.8)", outline=np.array([[0.6, 0.0], [1.0, 0.0], [0.6, 0.3]])),),
)


def flight():
    time = np.linspace(0, 10, 201)
    thrust = np.where((time % 2 >= 1.0) & (time % 2 < 1.6), -0.02, 0.0)
    signals = {
        "attitude_z": 3e-3 * np.exp(-0.1 * time) * np.cos(3 * time),
        "rate_z": -9e-3 * np.exp(-0.1 * time) * np.sin(3 * time),
        "thruster_z": thrust,
    }
    units = {"attitude_z": "rad", "rate_z": "rad/s", "thruster_z": "N"}
    return Trajectory(time=time, signals=signals, units=units)


def test_pulses_are_completed_stretches_of_one_sign():
    time = np.arange(9.0)
    start, length = pulses(time, np.array([0, 1, 1, -1, 0, 0, 1, 1, 1]))
    assert start.tolist() == [1, 3]  # the last one has not ended
    assert length.tolist() == [2, 1]


def test_no_pulse_is_no_pulse():
    start, length = pulses(np.arange(3.0), np.zeros(3))
    assert start.size == length.size == 0


def test_the_worst_to_come_falls_to_the_last_value():
    assert worst_to_come(np.array([3.0, -5.0, 1.0, -2.0])).tolist() == [5, 5, 2, 2]


def test_a_law_without_charts_has_none():
    assert charts_of(object()) == ()


def test_page_shows_a_row_a_portrait(tmp_path):
    pytest.importorskip("PIL")
    from PIL import Image

    sizes = []
    for k, drawn in enumerate([(PORTRAIT, MAP), (PORTRAIT, MAP, PORTRAIT, MAP)]):
        path = tmp_path / f"{k}.png"
        plots_chart.page(path, measured=flight(), charts=drawn, title="A law")
        with Image.open(path) as picture:
            sizes.append(picture.size)
            assert np.asarray(picture.convert("L")).std() > 10  # not blank
    assert sizes[0][0] == sizes[1][0]
    assert sizes[1][1] > 1.8 * sizes[0][1]


def test_a_locked_stretch_is_the_first_minimum_on_time_of_a_pulse():
    locked = chart.locked(flight(), PORTRAIT)
    time = flight().time
    assert locked[np.isclose(time % 2, 1.3)].all()
    assert not locked[np.isclose(time % 2, 1.55)].any()  # on, but free to stop
    assert not locked[np.isclose(time % 2, 0.5)].any()
