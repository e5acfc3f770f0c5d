"""The pictures of a run: the line drawing of the spacecraft, the page, what covers what."""

from dataclasses import replace

import numpy as np
import pytest
from flown import FREE, ON_AN_AXIS, flown
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from matplotlib.image import imread
from matplotlib.patches import FancyArrowPatch

from spacecraft_sim import plots, plots_chart, plots_smooth, sketch, spans
from spacecraft_sim.chart import charts_of
from spacecraft_sim.drawing import Shape, turned
from spacecraft_sim.families import families, is_quasi_rigid
from spacecraft_sim.trajectory import Trajectory

PLANAR = ("duration=60.0",)
TUMBLING = (*ON_AN_AXIS, *FREE, "duration=5.0")
RIGID = (*ON_AN_AXIS, "spacecraft=rigid_bus", "reduced.source=mjcf", "reduced.modes=0",
         "initial.boom_amplitude=0.0", "duration=5.0")  # fmt: skip


def arm():
    return flown("duration=1.0", name="burkov-position")


def body():
    return flown("duration=1.0", name="burkov-body-vectors-free")


def shape(kind, size, position=(0, 0, 0), quaternion=(1, 0, 0, 0)):
    parts = {"size": size, "position": position, "quaternion": quaternion, "rgba": (1, 1, 1, 1)}
    return Shape(body="bus", kind=kind, **{k: np.array(v, float) for k, v in parts.items()})


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """Draws the summary of a flight, once; returns the figure and the pixels."""
    drawn, path = {}, tmp_path_factory.mktemp("pictures") / "summary.png"

    def draw(flight):
        if id(flight) not in drawn:
            kept, save = [], Figure.savefig
            with pytest.MonkeyPatch.context() as patch:
                patch.setattr(
                    Figure, "savefig", lambda f, *a, **k: (kept.append(f), save(f, *a, **k))
                )
                plots.summary(
                    path,
                    measured=flight.measured,
                    predicted=flight.predicted,
                    drawing=flight.drawing,
                    verdicts=flight.comparison.verdicts,
                    title="A flight",
                    bands=flight.mission.bands,
                    histories=None
                    if is_quasi_rigid(flight.predicted)
                    else plots_smooth.panels(flight.measured),
                )
            drawn[id(flight)] = flight, kept[0], imread(path)  # the flight too: ids are used again
        return drawn[id(flight)][1:]

    return draw


# -- the spacecraft as a line drawing --------------------------------------------------------------


@pytest.mark.parametrize("view", [sketch.TOP, sketch.ISOMETRIC], ids=lambda view: view.words)
def test_a_view_is_a_right_handed_frame(view):
    frame = np.stack([view.right, view.up, view.near])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)  # rounding
    assert np.linalg.det(frame) == pytest.approx(1.0)


def test_the_isometric_view_shows_all_axes_equally_long():
    lengths = np.linalg.norm(sketch.ISOMETRIC.project(np.eye(3)), axis=1)
    np.testing.assert_allclose(lengths, np.sqrt(2 / 3), rtol=1e-15)


def test_planar_flights_are_seen_from_above_and_others_from_aside():
    assert sketch.view_of(flown(*PLANAR).drawing) is sketch.TOP
    assert sketch.view_of(flown(*TUMBLING).drawing) is sketch.ISOMETRIC


def test_faces_of_a_box_look_outwards():
    points = sketch.surface(shape("box", (1, 2, 3)))
    for corners in sketch.BOX_FACES:
        a, b, c, d = points[list(corners)]
        normal, middle = np.cross(b - a, c - a), (a + b + c + d) / 4
        assert normal @ middle > 0
        np.testing.assert_allclose(np.cross(normal, middle), 0, atol=1e-12)
        np.testing.assert_allclose(a + c, b + d)  # in turn round the face, not across


@pytest.mark.parametrize(
    ("kind", "size", "reach"),
    [
        ("box", (1.0, 2.0, 3.0), (1, 2, 3)),
        ("sphere", (0.5, 0.0, 0.0), (0.5, 0.5, 0.5)),
        ("capsule", (0.5, 2.0, 0.0), (0.5, 0.5, 2.5)),
        ("cylinder", (0.5, 2.0, 0.0), (0.5, 0.5, 2.0)),
        ("ellipsoid", (1.0, 2.0, 3.0), (1, 2, 3)),
    ],
)
def test_surfaces_reach_as_far_as_the_shapes(kind, size, reach):
    np.testing.assert_allclose(np.abs(sketch.surface(shape(kind, size))).max(axis=0), reach)
    # A quarter turn about x sends z to -y; then everything is moved.
    turn = (np.sqrt(0.5), np.sqrt(0.5), 0, 0)
    moved = sketch.surface(shape(kind, size, (5, 0, 0), turn)) - [5, 0, 0]
    x, y, z = reach
    np.testing.assert_allclose(np.abs(moved).max(axis=0), (x, z, y), atol=1e-12)


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


@given(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=1, max_size=30))
def test_an_outline_is_what_lies_furthest_out(points):
    points = np.array(points, float)
    kept = points[sketch.outline(points)]
    for angle in np.radians(np.arange(0, 360, 10)):
        way = np.array([np.cos(angle), np.sin(angle)])
        assert (kept @ way).max() >= (points @ way).max() - 1e-12


def test_exaggeration_is_round_and_leaves_booms_recognisable():
    straight = np.zeros((1, 2, 3))
    straight[0, 1, 0] = 10.0

    def factor(off):
        bent = straight.copy()
        bent[0, 1, 1] = off
        return sketch.exaggeration([(bent, straight)])

    assert [factor(x) for x in (3.0, 1.0, 0.5, 0.1, 0.001)] == [1.0, 2.0, 5.0, 20.0, 100.0]
    assert sketch.exaggeration([]) == 1.0


def test_boom_lines_start_at_the_roots_of_the_bus():
    drawing = flown(*PLANAR).drawing
    lines = sketch.boom_lines(drawing)
    for boom, place in (("left", 3.0), ("right", -3.0)):
        root = turned(drawing.quaternions["bus"], np.array([place, 0.0, 0.0]))
        for line in lines[boom]:
            np.testing.assert_allclose(line[:, 0], root, atol=1e-12)


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


def test_titles_stay_within_the_page_and_off_each_other(page):
    for flight in (flown(*PLANAR), flown(*TUMBLING), flown(*RIGID), arm(), body()):
        figure, _ = page(flight)
        found = [
            t for axes in figure.axes for t in (axes.title, axes._left_title, axes._right_title)
        ]
        boxes = [t.get_window_extent() for t in [*found, *figure.texts] if t.get_text()]
        assert max(box.x1 for box in boxes) <= figure.bbox.x1
        for k, one in enumerate(boxes):
            for other in boxes[k + 1 :]:
                assert not one.overlaps(other)


def test_a_tumbling_machine_is_drawn_isometrically(page):
    figure, _ = page(flown(*TUMBLING))
    assert any(text.startswith("Isometric") for text in words(figure))
    assert {"x", "y", "z"} <= set(words(figure))  # the dashes of the axes, in the key


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
    for flight, places, unit in ((arm(), "Joint angles", ", rad"), (body(), "Directions", "")):
        figure, _ = page(flight)
        found = titles(figure)
        assert sum(title.startswith(places + unit) for title in found) == 2
        for heading in ("Rates", "Torques", "MuJoCo minus reduced"):
            assert sum(title.startswith(heading) for title in found) == 2
        assert not any("Thrust" in title or "Phase plane" in title for title in found)


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


def test_bands_of_two_axes_have_the_dashes_of_the_axes(tmp_path):
    flight = flown(*TUMBLING)
    figure = Figure()
    bands = {"attitude_x": 0.02, "attitude_y": 0.01, "quasi_rigid_angle_x": 0.03}
    pair = flight.predicted, flight.measured
    plots._angle(own := figure.add_subplot(), pair, "attitude", bands, zoom=True)
    heights = [abs(line.get_ydata()[0]) for line in own.lines if len(set(line.get_ydata())) == 1]
    scale = 1e-3  # attitudes of 0.1 to 0.2 rad are drawn in mrad
    assert sorted(heights[-6:]) == pytest.approx(
        [h / scale for h in (0.01, 0.01, 0.02, 0.02, 0.03, 0.03)]
    )
    assert len(own.patches) == 2  # filled: the band of the other angle is none of this one


def test_charts_of_a_law_have_their_key_under_the_portrait(tmp_path):
    flight = flown(*ON_AN_AXIS, "duration=20.0")
    path = tmp_path / "charts.png"
    charts = charts_of(flight.mission.controller)
    plots_chart.page(path, measured=flight.measured, charts=charts, title="Charts")
    assert imread(path).shape[1] == 1800
