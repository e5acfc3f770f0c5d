"""The report of a run about three axes: charts axis by axis, each with its name, no words cut."""

import pytest
from browser import CHROMIUM, MISSING, Page
from flown import flown
from test_report import figures, write

AXES = ("duration=20.0",), "sokolov-attitude"
BOXES = """[...document.querySelectorAll('#charts figure')].map(f =>
    [f.dataset.figure, f.getBoundingClientRect().left, f.getBoundingClientRect().top])"""
CUT = """[...document.querySelectorAll('figcaption')].flatMap(c => [...c.children].filter(e =>
    e.getBoundingClientRect().right > c.getBoundingClientRect().right + 1
    || e.scrollWidth > e.clientWidth + 1 && e.clientWidth > 0).map(e => e.textContent))"""


def flight():
    return flown(*AXES[0], name=AXES[1])


def test_pulses_name_their_channel():
    found, _ = figures(flight())
    titles = [figure["title"] for name, figure in found.items() if name.startswith("pulses_")]
    assert len(titles) == 3
    for axis, title in zip(
        "xyz", sorted(titles, key=lambda t: t.split("thruster_")[1]), strict=True
    ):
        assert f" pulses of thruster_{axis}" in title


def test_phase_planes_name_their_axes_in_turn():
    found, _ = figures(flight())
    titles = [figure["title"] for name, figure in found.items() if name.startswith("phase_")]
    assert titles == [f"Phase plane {axis}, of the time shown" for axis in "xyz"]


@pytest.mark.skipif(CHROMIUM is None, reason=MISSING)
@pytest.mark.parametrize(("width", "columns"), [(1400, 3), (1000, 2), (420, 1)])
def test_each_axis_has_its_charts_below_each_other_and_captions_are_whole(width, columns, tmp_path):
    write(flight(), tmp_path / "report.html")
    page = Page(tmp_path / "profile", width=width)
    try:
        page.open(tmp_path / "report.html")
        page.settle()
        places = page.evaluate(BOXES)
        caption = page.evaluate("document.querySelector('[data-figure=craft]').textContent")
        cut = page.evaluate(CUT)
    finally:
        page.close()
    assert cut == []
    assert "sprung joints turned × " in caption
    by_axis = {}
    for name, left, top in places:
        by_axis.setdefault(name[-1], []).append((top, name.partition("_")[0], left))
    assert set(by_axis) == set("xyz")
    for drawn in by_axis.values():
        assert [kind for _, kind, _ in sorted(drawn)] == ["chart", "band", "pulses", "chart"]
        assert len({left for *_, left in drawn}) == 1
    assert len({left for drawn in by_axis.values() for *_, left in drawn}) == columns
