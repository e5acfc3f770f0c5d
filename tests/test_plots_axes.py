"""What tells axes and bounds apart in the pictures of a run, and one exaggeration in all."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from flown import FREE, ON_AN_AXIS, flown
from matplotlib.figure import Figure
from written import faults, summary_of

from spacecraft_sim import (
    beneath,
    plots,
    plots_film,
    report,
    report_columns,
    report_figures,
    run_folder,
)
from spacecraft_sim.trajectory import Trajectory

PLANAR = ("duration=60.0",)
TUMBLING = (*ON_AN_AXIS, *FREE, "duration=5.0")


def test_bands_of_two_axes_have_the_colours_and_the_names_of_the_axes():
    flight = flown(*TUMBLING)
    own = Figure().add_subplot()
    bands = {"attitude_x": 0.02, "attitude_y": 0.01, "quasi_rigid_angle_x": 0.03}
    pair = flight.predicted, flight.measured
    plots._angle(own, pair, "attitude", bands, zoom=True)
    level = [line for line in own.lines if len(set(np.asarray(line.get_ydata()))) == 1][-6:]
    found = [(abs(np.asarray(x.get_ydata())[0]), x.get_color(), x.get_linestyle()) for x in level]
    scale = 1e-3  # attitudes of 0.1 to 0.2 rad are drawn in mrad
    expected = [(0.02, plots.AXES["x"][0], "-"), (0.01, plots.AXES["y"][0], "-"),
                (0.03, plots.GOOD, ":")]  # fmt: skip
    for k, (half, *look) in enumerate(expected):
        for height, *drawn in found[2 * k : 2 * k + 2]:
            assert height == pytest.approx(half / scale)
            assert drawn == look
    names = {text.get_text(): text.get_position()[1] for text in own.texts}
    assert names == pytest.approx({"x ±20": 20.0, "y ±10": 10.0, "x quasi-rigid": 30.0})
    assert own.get_ylim()[1] > 30.0  # with room for the name
    assert len(own.patches) == 2  # filled: the band of the other angle is none of this one


@pytest.mark.parametrize(
    ("signal", "words"),
    [("estimated_quasi_rigid_angle_x", "x estimated quasi-rigid"), ("attitude_y", "y of the bus"),
     ("elbow_angle_1", "1 elbow angle")],
)  # fmt: skip
def test_a_bound_of_any_other_signal_has_its_name(signal, words):
    flight = flown(*TUMBLING)
    axes = Figure().add_subplot()
    pair = flight.predicted, flight.measured
    plots._angle(axes, pair, "quasi_rigid_angle", {signal: 0.02, "elbow_2": 0.01}, zoom=True)
    assert words in [text.get_text() for text in axes.texts]


def test_axes_are_told_apart_by_colours_that_are_those_of_the_report(tmp_path):
    figure = summary_of(flown(*TUMBLING), tmp_path / "summary.png")
    css = (Path(report.__file__).parent / "report.css").read_text()
    for axis, colors in plots.AXES.items():
        for plant, color in zip(("mujoco", "reduced"), colors, strict=True):
            assert f"--{axis}-{plant}: {color}" in css
    (panel, _) = (x for x in figure.axes if "Attitude of the bus" in x.get_title(loc="left"))
    drawn = [line.get_color() for line in panel.lines if len(np.asarray(line.get_xdata())) > 2]
    wide = [colors[1] for colors in plots.AXES.values()]
    thin = [colors[0] for colors in plots.AXES.values()]
    assert sorted(drawn[:3]) == sorted(wide)  # beneath all of the other plant
    assert sorted(drawn[3:6]) == sorted(thin)


def test_the_largest_swing_lies_beneath_the_others():
    time = np.linspace(0, 10, 101)
    signals = {
        f"rate_{axis}": size * np.sin(time) for axis, size in zip("xyz", (1, 3, 2), strict=True)
    }
    flight = Trajectory(time=time, signals=signals, units=dict.fromkeys(signals, "rad/s"))
    own = Figure().add_subplot()
    assert plots._histories(own, (flight, flight), "rate")[2] == "rad/s"
    assert [line.get_color() for line in own.lines[3:]] == [plots.AXES[a][0] for a in "yzx"]


def test_titles_stay_within_their_panels(tmp_path):
    flight = flown(*PLANAR)
    time = flight.measured.time
    signals = {**flight.measured.signals,
               "quasi_rigid_rate_z": -0.00038919 + 1e-10 * np.sin(time),
               "quasi_rigid_angle_z": 0.012345678 + 1e-10 * np.cos(time)}  # fmt: skip
    both = {name: replace(getattr(flight, name), signals=signals, time=time)
            for name in ("measured", "predicted")}  # fmt: skip
    figure = summary_of(replace(flight, **both), tmp_path / "summary.png")
    assert faults(figure) == []
    for axes in figure.axes:
        title = axes._left_title
        assert not title.get_text().endswith("…")
        assert title.get_window_extent().x1 <= axes.get_window_extent().x1 + 0.04 * axes.bbox.width
    labels = [
        axes.get_ylabel() for axes in figure.axes if axes.get_title(loc="left") == "Phase plane z"
    ]
    assert any("from -0.000389" in label for label in labels)


@pytest.mark.parametrize(
    "flight",
    [lambda: flown(*PLANAR), lambda: flown("duration=20.0", name="sokolov-attitude"),
     lambda: flown(*TUMBLING)],
    ids=["planar", "joints", "tumbling"],
)  # fmt: skip
def test_pictures_and_recording_exaggerate_alike(flight, monkeypatch, tmp_path):
    run, drawn = flight(), []
    monkeypatch.setattr(plots, "summary", lambda *_, drawing, **__: drawn.append(drawing))
    monkeypatch.setattr(report, "write", lambda *_, drawing, **__: drawn.append(drawing))
    parts = run.mission, run.measured, run.predicted, run.comparison
    run_folder.write_pictures(tmp_path, *parts)
    factor = beneath.reduced(run_folder.subject(run.mission), run.predicted).factor
    assert factor > 1
    assert [x.turned * x.bending for x in drawn] == [factor, factor]  # one of them is 1
    strip = Figure().subplots(1, 6)
    note = plots_film.film([*strip], drawn[0], run.measured)
    assert f"× {factor:g}" in note
    columns = report_columns.Columns()
    craft = report_figures._craft(columns, drawn[1])
    assert craft["factor"] == factor or f"× {factor:g}" in craft["seen"]
