"""The pictures of a run: the line drawing of the spacecraft, the page, what covers what."""

from dataclasses import replace

import numpy as np
import pytest
from flown import FREE, ON_AN_AXIS, flown
from matplotlib.image import imread
from matplotlib.patches import FancyArrowPatch
from written import faults, summary_of, texts

from spacecraft_sim import (
    plots,
    plots_chart,
    plots_film,
    plots_panel,
    plots_smooth,
    spans,
    sphere,
)
from spacecraft_sim.chart import charts_of
from spacecraft_sim.families import families
from spacecraft_sim.trajectory import Trajectory

PLANAR = ("duration=60.0",)
TUMBLING = (*ON_AN_AXIS, *FREE, "duration=5.0")
RIGID = (*ON_AN_AXIS, "spacecraft=rigid_bus", "reduced.source=mjcf", "reduced.modes=0",
         "initial.boom_amplitude=0.0", "duration=5.0")  # fmt: skip


def arm():
    return flown("duration=1.0", name="burkov-position")


def body():
    return flown("duration=1.0", name="burkov-body-vectors-free")


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Draws the summary of a flight, once; returns the figure and the pixels."""
    drawn, path = {}, tmp_path_factory.mktemp("pictures") / "summary.png"

    def draw(flight):
        if id(flight) not in drawn:
            figure = summary_of(flight, path)
            drawn[id(flight)] = flight, figure, imread(path)  # the flight too: ids are used again
        return drawn[id(flight)][1:]

    return draw


# -- parts of a flight -----------------------------------------------------------------------------


def decaying(end=100.0):
    time = np.linspace(0.0, end, round(10 * end) + 1)
    pulses = np.sign(np.sin(2 * np.pi * time / 2.0))
    signals = {
        "quasi_rigid_angle_z": np.exp(-time / 10.0),
        "thruster_z": pulses,
        "thruster_z_command": pulses,
    }
    return Trajectory(time=time, signals=signals, units=dict.fromkeys(signals, "rad"))


def test_a_flight_has_settled_at_a_twentieth_of_its_peak():
    # exp(-t/10) = 1/20 at t = 10 ln 20 = 29.96; rows stand every 0.1 s.
    assert spans.settled(decaying()) == pytest.approx(10 * np.log(20.0), abs=0.1)
    assert spans.settled(decaying(20.0)) == pytest.approx(16.0)  # never more than four fifths


def test_last_cycles_are_ten_periods_at_most_a_tenth():
    assert spans.last_cycles(decaying()) == pytest.approx(90.0, abs=0.15)  # a tenth of 100 s
    # Ten periods of 2 s before the last switch-on, which is at 998 s.
    assert spans.last_cycles(decaying(1000.0)) == pytest.approx(978.0, abs=2.1)


# -- the page --------------------------------------------------------------------------------------


def titles(figure):
    return [axes.get_title(loc="left") for axes in figure.axes]


def words(figure):
    return [text.get_text() for text in figure.texts]


def test_the_page_of_a_planar_flight(page):
    figure, pixels = page(flown(*PLANAR))
    assert pixels.shape[1] == 1800
    assert 1000 < pixels.shape[0] < 1500
    assert any(text.startswith("Seen from +z; bending drawn × ") for text in words(figure))
    assert "asked: z ±0.007 rad" in words(figure)
    assert sum("Boom tips" in title for title in titles(figure)) == 2
    assert {"WHOLE FLIGHT", "END OF THE FLIGHT"} <= set(words(figure))


def test_no_key_covers_a_curve(page):
    for flight in (flown(*PLANAR), flown(*TUMBLING)):
        figure, _ = page(flight)
        assert [axes.get_legend() for axes in figure.axes] == [None] * len(figure.axes)


def coasting():
    """A flight whose rate differs from a round figure by very little."""
    flight = flown(*PLANAR)
    time = flight.measured.time
    signals = {
        **flight.measured.signals,
        "quasi_rigid_rate_z": 0.02 + 1e-12 * np.sin(time),
        "quasi_rigid_angle_z": 0.02 * time,
    }
    both = {name: replace(getattr(flight, name), signals=signals, time=time)
            for name in ("measured", "predicted")}  # fmt: skip
    return replace(flight, **both)


@pytest.mark.parametrize(
    "flight",
    [lambda: flown(*PLANAR), lambda: flown(*TUMBLING), lambda: flown(*RIGID), arm, body, coasting],
    ids=["planar", "tumbling", "rigid", "arm", "body", "coasting"],
)
def test_all_that_is_written_stays_on_the_page_and_off_each_other(flight, page):
    figure, _ = page(flight())
    assert len(texts(figure)) > 80
    assert faults(figure) == []


@pytest.mark.parametrize(
    ("values", "base"),
    [
        ([0.7, 0.70005], 0.7),
        ([0.70012, 0.70005], 0.7001),
        ([0.7, 0.71], 0.0),  # it can be read as it is
        ([-1e-6, 1e-6], 0.0),
        ([0.0], 0.0),
        ([], 0.0),
        ([-0.7], -0.7),
    ],
)
def test_what_differs_little_is_measured_from_a_round_number(values, base):
    found = plots._base([np.array([value]) for value in values])
    assert found == pytest.approx(base, abs=1e-12)


def test_the_curves_of_a_panel_differ_in_colour():
    assert len(set(plots_smooth.COLORS)) == len(plots_smooth.COLORS) >= 9


@pytest.mark.parametrize(
    ("now", "words"),
    [
        ({}, "thrust off"),
        ({"a": 1.0}, "+1 N"),
        ({"a": 0.75512, "b": -2.0}, "+0.755, -2 N"),
        ({"a": 1.0, "c": -2.0}, "+1 N, -2 N m"),
        ({"a": 1.0, "b": 1.0, "c": 1.0}, "3 of 4 channels on"),
    ],
)
def test_thrust_is_told_in_few_words(now, words):
    assert plots_film._thrust(now, {"a": "N", "b": "N", "c": "N m", "d": "N"}) == words


def test_a_torque_that_has_faded_is_drawn_as_off(page):
    flight = body()
    faded = {
        name: value * (np.exp(-50 * flight.measured.time) if name.startswith("torque") else 1.0)
        for name, value in flight.measured.signals.items()
    }
    figure, _ = page(replace(flight, measured=replace(flight.measured, signals=faded)))
    told = [axes.get_title(loc="right") for axes in figure.axes]
    strip = [words for words in told if "on" in words or "off" in words]
    assert strip[0] == "3 of 3 channels on"
    assert strip[-1] == "thrust off"  # e^-50 of it is left


@pytest.mark.parametrize(
    ("peak", "scale", "letter"),
    [(2.0, 1.0, ""), (0.5, 1.0, ""), (0.4, 1e-3, "m"), (3e-12, 1e-12, "p"), (1e-15, 1e-15, "f"),
     (0.0, 1.0, "")],
)  # fmt: skip
def test_a_prefix_brings_the_peak_above_a_half(peak, scale, letter):
    assert plots_panel.prefix(peak) == (scale, letter)


@pytest.mark.parametrize("length", [10, 60, 88, 200])
def test_a_long_claim_is_written_smaller_before_it_is_cut(length, page):
    flight = flown(*PLANAR)
    claim = ("an average claim " * 20)[:length]
    verdicts = tuple(replace(v, claim=claim) for v in flight.comparison.verdicts)
    own = replace(flight, comparison=replace(flight.comparison, verdicts=verdicts))
    figure, _ = page(own)
    found = [x for axes in figure.axes for x in axes.texts if x.get_text().startswith("an av")]
    assert found
    assert {x.get_text().endswith("…") for x in found} == {length == 200}
    assert (found[0].get_fontsize() < 9) == (length > 80)


def test_a_tumbling_machine_is_drawn_isometrically(page):
    figure, _ = page(flown(*TUMBLING))
    assert any(text.startswith("Isometric") for text in words(figure))
    named = {f"{axis} {plant}" for axis in "xyz" for plant in ("reduced", "MuJoCo")}
    assert named <= set(words(figure))  # the colours of the axes, in the key


def test_a_machine_without_booms_has_its_rate_instead(page):
    figure, _ = page(flown(*RIGID))
    assert not any("bending" in text for text in words(figure))
    assert sum("Rate of the bus" in title for title in titles(figure)) == 2
    lanes = [t.get_text() for t in figure.axes[-1].texts]
    assert [lane.split()[0].rstrip(":") for lane in lanes] == [
        "thruster_x", "thruster_y", "thruster_z",
    ]  # fmt: skip
    assert lanes[0] == "thruster_x: never on"


def test_thrust_is_drawn_as_an_arrow_that_turns_the_right_way(page):
    flight = flown(*PLANAR)
    figure, _ = page(flight)
    arrows = [
        (axes.get_title(loc="right"), patch)
        for axes in figure.axes
        for patch in axes.patches
        if isinstance(patch, FancyArrowPatch)
    ]
    assert arrows
    for thrust, arrow in arrows:
        # As seen from +z a positive torque goes round anticlockwise.
        x, y = arrow._path_original.vertices.T
        turned_by = x[:-1] * y[1:] - x[1:] * y[:-1]
        assert np.all(np.sign(turned_by) == np.sign(float(thrust.split()[0])))


def test_commands_too_dense_to_draw_are_said_to_be(page):
    flight = flown(*PLANAR)
    time = flight.measured.time
    fast = np.where(np.arange(len(time)) % 2, 1.0, -1.0)
    signals = {**flight.measured.signals, "thruster_z_command": fast, "thruster_z": fast}
    figure, _ = page(replace(flight, measured=replace(flight.measured, signals=signals)))
    assert any("commands too dense" in title for title in titles(figure))


def test_arms_and_bodies_show_places_rates_and_torques(page):
    unit_vectors = "Directions, of unit vectors"
    for flight, places in ((arm(), "Joint angles, rad"), (body(), unit_vectors)):
        figure, _ = page(flight)
        found = titles(figure)
        for heading in (places, "Rates", "Torques", "MuJoCo minus reduced"):
            # Once: the figures of the law stand where others have the end of the flight.
            assert sum(title.startswith(heading) for title in found) == 1
        assert not any("Thrust" in title or "Phase plane" in title for title in found)


def test_what_a_law_computes_is_drawn_on_a_logarithmic_axis_and_a_sphere(page):
    figure, _ = page(body())
    by_title = {axes.get_title(loc="left"): axes for axes in figure.axes}
    energy = by_title["V and its terms, J"]
    assert energy.get_yscale() == "log"
    names = [text.get_text() for text in energy.get_legend().get_texts()]
    assert names == ["V", "kinetic", "potential of the law", "filter"]
    globe = by_title["s2, s3 on the unit sphere"]
    points = np.vstack([line.get_xydata() for line in globe.lines])
    reach = np.nanmax(np.hypot(*points.T))
    assert reach == pytest.approx(1.0, abs=1e-3)  # the rim, of which some points are drawn
    stars = [line for line in globe.lines if line.get_marker() == "*" and len(line.get_xydata())]
    law = body().mission.controller
    view = sphere.view(next(c for c in law.charts if c.name == "vectors"))
    places = np.array([star.get_xydata()[0] for star in stars])
    np.testing.assert_allclose(places, view.project(np.array(law.formula.r)), atol=1e-12)


def test_pictures_of_a_machine_without_booms_lie_evenly_along_its_way():
    flight = arm()
    frames = plots_film._frames(flight.drawing, flight.measured, 6)
    assert frames[0] == 0
    assert frames[-1] == len(flight.drawing.time) - 1
    assert frames == sorted(frames)
    # One joint's share is the share of the whole way where the other hardly moves.
    turns = [
        np.linalg.norm(np.diff(q, axis=0), axis=1) for q in flight.drawing.quaternions.values()
    ]
    way = np.cumsum(np.sum(turns, axis=0))
    steps = np.diff(np.r_[0.0, way[np.array(frames[1:-1]) - 1]]) / way[-1]
    np.testing.assert_allclose(steps, 0.98 / 4, atol=0.03)  # a frame is some hundredths of the way


def test_a_decay_is_over_once_it_is_within_a_fiftieth():
    time = np.linspace(0, 40, 40_001)
    signals = {"x": np.exp(-time), "still": 1e-5 * np.sin(time)}
    flight = Trajectory(time=time, signals=signals, units={"x": "", "still": ""})
    # exp(-t) = 1/50; a third longer is 1.35 of it; rows are a millisecond apart.
    assert spans.transient(flight, ["x", "still"]) == pytest.approx(1.35 * np.log(50), abs=3e-3)


def test_families_name_the_signals_once():
    assert families(arm().measured) == {
        "Joint angles": ("joint_1", "joint_2"),
        "Rates": ("joint_1_rate", "joint_2_rate"),
        "Torques": ("motor_1", "motor_2"),
    }
    found = families(body().measured)
    assert found["Directions"][:2] == ("s2_x", "s2_y")
    assert found["Rates"] == ("rate_x", "rate_y", "rate_z")


def test_a_craft_that_is_at_rest_is_said_to_be(page):
    flight = flown(*PLANAR)
    names = ("quasi_rigid_angle_z", "quasi_rigid_rate_z")
    still = dict(
        zip(names, (np.full_like(flight.measured.time, v) for v in (0.7, 0.0)), strict=True)
    )
    signals = {**flight.measured.signals, **still}
    figure, _ = page(replace(flight, measured=replace(flight.measured, signals=signals)))
    assert titles(figure).count("Phase plane z: at rest at 0.7 rad") == 2


def test_charts_of_a_law_have_their_key_under_the_portrait(tmp_path):
    flight = flown(*ON_AN_AXIS, "duration=20.0")
    path = tmp_path / "charts.png"
    charts = charts_of(flight.mission.controller)
    plots_chart.page(path, measured=flight.measured, charts=charts, title="Charts")
    assert imread(path).shape[1] == 1800
