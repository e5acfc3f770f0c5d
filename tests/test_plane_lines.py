"""Lines of a plane: what is cut off, and names that stand clear of each other."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacecraft_sim import plane_lines
from spacecraft_sim.plane_lines import inside, pieces, spread

BOX = np.array([1.08, 1.2])


def box(place, name):
    """Middle and half size of a name."""
    half = np.array([len(name) * plane_lines.LETTER, plane_lines.HEIGHT]) / 2
    return place + np.array([0.0, plane_lines.BELOW]), half


def overlap(one, other):
    lap = one[1] + other[1] - np.abs(one[0] - other[0])
    return bool(np.all(lap > 1e-9))


@given(st.integers(2, 6), st.floats(2.0, 40.0))
def test_names_of_parallel_lines_do_not_cover_each_other(count, slope):
    y = np.linspace(-1, 1, 200)
    lines = [np.stack([y / slope + 0.1 * k, y], axis=1) for k in range(count)]
    names = [f"|s| = v{k}" for k in range(count)]
    found = spread(lines, names)
    boxes = [box(place, name) for place, name in zip(found, names, strict=True)]
    for k, one in enumerate(boxes):
        assert not any(overlap(one, other) for other in boxes[k + 1 :])
        assert np.all(np.abs(one[0]) + one[1] <= plane_lines.EDGE + 0.2)
        assert np.abs(lines[k] - found[k]).sum(axis=1).min() == 0.0  # on its line


def test_what_is_out_of_sight_or_too_small_has_no_name():
    far = np.stack([np.linspace(2, 3, 50), np.zeros(50)], axis=1)
    small = np.stack([np.linspace(0, 0.1, 50), np.zeros(50)], axis=1)
    line = np.stack([np.linspace(-1, 1, 50), np.zeros(50)], axis=1)
    found = spread([far, small, line], ["far", "small", "line"])
    assert found[0] is None
    assert found[1] is None
    assert found[2] is not None


@given(st.lists(st.tuples(*[st.floats(-5, 5)] * 2), min_size=2, max_size=9))
def test_cut_lines_are_inside_and_on_the_line(points):
    points = np.array(points)
    for start, end in inside(points, BOX):
        # Rounding of the cut of a segment of some ten units.
        assert np.all(np.abs([start, end]) <= BOX + 1e-9)
    middles = (points[1:] + points[:-1]) / 2
    seen = np.all(np.abs(middles) < BOX - 1e-6, axis=1) & np.any(np.diff(points, axis=0), axis=1)
    assert len(inside(points, BOX)) >= np.count_nonzero(seen)


def test_a_break_is_not_drawn():
    line = np.array([[0.0, 0.0], [0.5, 0.0], [np.nan, np.nan], [0.0, 0.5], [0.5, 0.5]])
    assert [len(piece) for piece in pieces(line)] == [2, 2]
    cut = inside(line, BOX)
    assert cut == pytest.approx(np.array([line[:2], line[3:]]))
