"""The line drawing of the spacecraft: views, surfaces, outlines, booms bent too far."""

import numpy as np
import pytest
from flown import FREE, ON_AN_AXIS, flown
from hypothesis import given
from hypothesis import strategies as st

from spacecraft_sim import sketch
from spacecraft_sim.drawing import Shape, turned

PLANAR = ("duration=60.0",)
TUMBLING = (*ON_AN_AXIS, *FREE, "duration=5.0")


def shape(kind, size, position=(0, 0, 0), quaternion=(1, 0, 0, 0)):
    parts = {"size": size, "position": position, "quaternion": quaternion, "rgba": (1, 1, 1, 1)}
    return Shape(body="bus", kind=kind, **{k: np.array(v, float) for k, v in parts.items()})


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


@given(st.lists(st.tuples(st.integers(-9, 9), st.integers(-9, 9)), min_size=1, max_size=30))
def test_an_outline_is_what_lies_furthest_out(points):
    points = np.array(points, float)
    kept = points[sketch.outline(points)]
    for angle in np.radians(np.arange(0, 360, 10)):
        way = np.array([np.cos(angle), np.sin(angle)])
        assert (kept @ way).max() >= (points @ way).max() - 1e-12


def test_boom_lines_start_at_the_roots_of_the_bus():
    drawing = flown(*PLANAR).drawing
    lines = sketch.boom_lines(drawing)
    for boom, place in (("left", 3.0), ("right", -3.0)):
        root = turned(drawing.quaternions["bus"], np.array([place, 0.0, 0.0]))
        for line in lines[boom]:
            np.testing.assert_allclose(line[:, 0], root, atol=1e-12)
