"""report.html: its data, its tables, what it says of thinning and misprints; that it is whole."""

import base64
import json
import re
import time
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest
from flown import FREE, ON_AN_AXIS, flown
from hypothesis import given
from hypothesis import strategies as st

from spacecraft_sim import cli, report, report_columns, report_figures, report_tables, run_folder
from spacecraft_sim.chart import charts_of
from spacecraft_sim.errata import Section, sections

SHORT = ("duration=60.0",)
TYPES = {"f4": "<f4", "f8": "<f8"}
VOID = {"meta", "link", "br", "img", "input", "hr"}


def write(flight, path):
    report.write(
        path,
        mission=flight.mission,
        measured=flight.measured,
        predicted=flight.predicted,
        drawing=flight.drawing,
        comparison=flight.comparison,
        scenario_toml=run_folder.resolved(flight.mission.scenario),
    )
    return path.read_text(encoding="utf-8")


def figures(flight, limit=None, monkeypatch=None):
    """The figures by name, and a function that unpacks a column."""
    if limit:
        monkeypatch.setattr(report_columns, "LIMIT", limit)
    page = report_figures.page(
        (flight.predicted, flight.measured),
        flight.drawing,
        verdicts=flight.comparison.verdicts,
        bands=flight.mission.bands,
        charts=charts_of(flight.mission.controller),
    )
    page = json.loads(json.dumps(page, allow_nan=False))

    def column(key):
        packed = page["columns"][key]
        return np.frombuffer(base64.b64decode(packed["data"]), TYPES[packed["type"]])

    return {f["id"]: f for f in page["figures"]}, column


# -- data ------------------------------------------------------------------------------------------


@given(
    values=st.lists(st.integers(-50, 50), min_size=1, max_size=400),
    limit=st.integers(4, 120),
)
def test_thinning_keeps_ends_and_extremes_of_every_group(values, limit):
    values = np.array(values, dtype=float)
    rows = report_columns.extremes(values, limit)
    assert np.all(np.diff(rows) > 0)
    assert rows[0] == 0
    assert rows[-1] == len(values) - 1
    if len(values) <= limit:
        assert len(rows) == len(values)
        return
    size = -(-2 * len(values) // limit)
    assert len(rows) <= limit + size + 2  # two a group, the ends, and a last group left whole
    for k in range(0, len(values) // size * size, size):
        kept = values[rows[(rows >= k) & (rows < k + size)]]
        group = values[k : k + size]
        assert kept.min() == group.min()
        assert kept.max() == group.max()


def test_curves_are_the_recorded_rows():
    flight = flown(*SHORT)
    found, column = figures(flight)
    assert [t["name"] for t in found["quasi_rigid_angle"]["traces"]] == ["z, reduced", "z, MuJoCo"]
    for kind in ("quasi_rigid_angle", "attitude", "rate", "quasi_rigid_rate", "disturbance"):
        for trace, track in zip(
            found[kind]["traces"], (flight.predicted, flight.measured), strict=True
        ):
            np.testing.assert_array_equal(column(trace["t"]), track.time)
            values = track[f"{kind}_z"]
            np.testing.assert_array_equal(column(trace["y"]), values.astype("f4"))
    tips = {t["name"]: column(t["y"]) for t in found["tips"]["traces"]}
    assert set(tips) == {"left, reduced", "left, MuJoCo", "right, MuJoCo"}
    last = flight.measured["right_tip_y"][-1]
    assert tips["right, MuJoCo"][-1] == np.float32(last)


def test_lanes_hold_every_switching_at_its_exact_time():
    flight = flown(*SHORT)
    found, column = figures(flight)
    (lane,) = found["thrust"]["channels"]
    for signal, packed in (
        ("thruster_z", lane["delivered"]),
        ("thruster_z_command", lane["command"]),
    ):
        time, value = column(packed["t"]), column(packed["y"])
        rows = np.searchsorted(time, flight.measured.time, side="right") - 1
        np.testing.assert_array_equal(value[rows], flight.measured[signal].astype("f4"))
    levels = np.abs(flight.measured["thruster_z"])
    assert lane["levels"] == np.unique(levels[levels > 0]).tolist()


def test_bands_marks_and_spans_are_those_of_the_run():
    flight = flown(*SHORT)
    found, _ = figures(flight)
    (band,) = found["quasi_rigid_angle"]["bands"]
    assert (band["low"], band["high"]) == (-0.007, 0.007)
    assert found["attitude"]["bands"][0]["faint"]  # the theorem promises nothing about it
    (strip,) = found["phase_z"]["bands"]
    assert (strip["low"], strip["high"]) == (-0.007, 0.007)
    worst = {v.t_worst for v in flight.comparison.verdicts if v.t_worst is not None}
    assert {mark["t"] for mark in found["quasi_rigid_angle"]["marks"]} == worst


def test_each_axis_has_its_own_band_and_none_where_nothing_is_promised():
    found = report_figures._bands("attitude", {"attitude_x": 1e-3, "quasi_rigid_angle_z": 2e-3})
    assert [(b["high"], b.get("faint", False)) for b in found] == [(1e-3, False), (2e-3, True)]
    assert found[0]["name"] == "x: ±0.001 rad"
    assert found[1]["name"] == "asked of the quasi-rigid angle z"
    assert report_figures._bands("rate", {"attitude_x": 1e-3}) == []


def test_a_long_flight_is_thinned_and_the_page_says_so(tmp_path, monkeypatch):
    flight = flown(*SHORT)
    rows = len(flight.measured.time)
    limit = -(-rows // 3)
    found, column = figures(flight, limit, monkeypatch)
    for trace in found["attitude"]["traces"]:
        values = column(trace["y"])
        assert len(values) < 1.1 * limit
        track = flight.measured if "MuJoCo" in trace["name"] else flight.predicted
        full = track["attitude_z"].astype("f4")
        assert (values.min(), values.max(), values[-1]) == (full.min(), full.max(), full[-1])
    shown = write(flight, tmp_path / "report.html")
    assert f"Of the {rows} rows the curves keep the least and the largest of every 6" in shown
    monkeypatch.undo()
    assert f"Every one of the {rows} rows" in write(flight, tmp_path / "report.html")


def test_the_drawn_craft_is_the_recorded_one():
    flight = flown(*SHORT)
    found, column = figures(flight)
    craft = found["craft"]
    time = column(craft["t"])
    assert (time[0], time[-1]) == (0.0, flight.measured.time[-1])
    assert craft["seen"] == "seen from +z"
    (left, _) = craft["booms"]
    points = column(left["key"]).reshape(len(time), -1, 3)
    # The tip sensor speaks in the frame of the root, 3 m out on a bus turned by the attitude.
    frame = len(time) // 2
    row = int(np.argmin(np.abs(flight.measured.time - time[frame])))
    angle, tip = (
        flight.measured["attitude_z"][row],
        [flight.measured[f"left_tip_{a}"][row] for a in "xy"],
    )
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    expected = turn @ (np.array([3.0, 0.0]) + tip)
    np.testing.assert_allclose(points[frame, -2, :2], expected, atol=1e-5)  # single precision
    # Unbent, the tip is 10.5 m out along the turned bus.
    np.testing.assert_allclose(points[frame, -1, :2], turn @ [10.5, 0.0], atol=1e-5)


def test_a_machine_that_tumbles_is_seen_from_aside():
    flight = flown(*ON_AN_AXIS, *FREE, "duration=5.0")
    found, _ = figures(flight)
    assert found["craft"]["seen"].startswith("isometric")
    assert len(found["attitude"]["traces"]) == 6  # three axes on two plants


def test_an_arm_shows_joints_rates_torques_and_the_difference():
    flight = flown("duration=1.0", name="burkov-position")
    found, column = figures(flight)
    assert list(found)[:4] == ["joint_angles", "rates", "torques", "difference"]
    traces = found["joint_angles"]["traces"]
    assert [t["name"] for t in traces] == ["reduced", "joint 1", "reduced", "joint 2"]
    np.testing.assert_array_equal(column(traces[1]["y"]), flight.measured["joint_1"].astype("f4"))
    gap = flight.measured["joint_2"] - flight.predicted["joint_2"]
    np.testing.assert_allclose(column(found["difference"]["traces"][1]["y"]), gap, rtol=1e-6)
    assert "thrust" not in found  # torques that vary all the time have no lanes


def test_charts_of_a_law_are_there():
    flight = flown(*ON_AN_AXIS, "duration=20.0")
    found, column = figures(flight)
    plane = found["chart_plane"]
    assert [line["name"] for line in plane["lines"]] == ["contour", "switching"]
    assert plane["lines"][1]["points"] == [[-1, 0.1], [None, None], [1, -0.1]]
    assert plane["window"] == pytest.approx([-0.029, 0.029, -0.0145, 0.0145])  # 1.45 x the contour
    flight_track, hot = plane["tracks"]
    assert len(column(flight_track["x"])) == len(flight.measured.time)
    assert np.isnan(column(hot["x"])[-1]) or flight.measured["thruster_z"][-1]
    pulses = found["pulses_plane"]
    assert pulses["title"].split()[0] == str(sum(len(column(t["t"])) for t in pulses["traces"]))
    assert found["chart_map"]["points"][0]["x"] == 0.2


# -- the page --------------------------------------------------------------------------------------


class Balance(HTMLParser):
    """Finds tags that are not closed in turn, and addresses outside the page."""

    def __init__(self):
        super().__init__()
        self.open, self.faults, self.addresses = [], [], []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        self.addresses += [value for name, value in attrs if name in ("href", "src")]

    def handle_endtag(self, tag):
        if not self.open or self.open.pop() != tag:
            self.faults.append(tag)


def checked(text):
    parser = Balance()
    parser.feed(text)
    assert parser.faults == []
    assert parser.open == []
    return parser


def test_the_page_stands_alone(tmp_path):
    text = write(flown(*SHORT), tmp_path / "report.html")
    parser = checked(text)
    assert all(address.startswith(("#", "data:")) for address in parser.addresses)
    outside = set(re.findall(r"https?://[^\s\"')]+", text))
    assert outside == {"http://www.w3.org/2000/svg"}  # a name, not an address
    assert "@import" not in text
    assert "url(" not in text.replace("url(#clip-", "")


def test_every_run_leaves_one(tmp_path, capsys):
    assert (
        cli.main(
            ["run", "efremov-nonlocal", "--out", str(tmp_path / "run"), "--set", "duration=2.0"]
        )
        == 1
    )
    checked((tmp_path / "run" / "report.html").read_text(encoding="utf-8"))


def test_the_page_says_what_the_verdicts_say(tmp_path):
    flight = flown(*SHORT)
    text = write(flight, tmp_path / "report.html")
    verdicts = flight.comparison.verdicts
    kept = sum(v.holds for v in verdicts)
    assert f">{kept} of {len(verdicts)} claims hold<" in text
    table = text[text.index('id="verdicts"') : text.index('id="flight"')]
    assert re.findall(r'<tr class="(\w+)">', table) == [
        "holds" if v.holds else "fails" for v in verdicts
    ]
    assert flight.mission.scenario.title in text
    assert "|beta/J| &lt; eps from" in table
    for heading in ("Assumptions", "Scenario", "Replay", "Errata of the sources"):
        assert f"<h2>{heading}</h2>" in text
    for command, _ in report.COMMANDS:
        assert command in text
    assert "max_delay = 0.21" in text  # the scenario itself
    assert "never exceeded" in text  # and what its parameters mean


def test_an_assumption_that_fails_is_named_with_its_numbers(tmp_path):
    flight = flown("duration=20.0", "actual.thrusters.all.delay=0.3")
    failed = {a for v in flight.comparison.verdicts for a in v.failed}
    assert failed
    text = write(flight, tmp_path / "report.html")
    checked(text)
    words = {v.outcome for v in flight.comparison.verdicts}
    assert "not judged" in words  # the flight is too short
    assert all(f">{word}</td>" in text for word in words)
    rows = re.findall(
        r'<tr class="fails">.*?</tr>', report_tables.assumptions(flight.comparison.verdicts)
    )
    assert len(rows) == len(failed)
    assert any('<td class="number">0.3</td>' in row and "0.21" in row for row in rows)


def test_text_of_the_user_cannot_break_the_page(tmp_path):
    flight = flown("duration=2.0")
    scenario = flight.mission.scenario.model_copy(
        update={"title": 'A </script><b>"bold" & rash', "description": "<i>so</i>"}
    )
    text = write(
        replace(flight, mission=replace(flight.mission, scenario=scenario)), tmp_path / "r.html"
    )
    checked(text)
    assert '<b>"bold"' not in text
    assert "A &lt;/script&gt;&lt;b&gt;" in text
    assert "<i>so" not in text


def test_a_machine_without_any_law_figure_still_has_a_page(tmp_path):
    flight = flown(*ON_AN_AXIS, *FREE, "duration=5.0")
    text = write(flight, tmp_path / "report.html")
    checked(text)
    assert "Charts of the law" in text
    assert "No misprints are listed" in text
    assert "Contour &amp; &lt;flight&gt;" in text or "Contour & \\u003cflight>" in text


def test_it_is_small(tmp_path):
    flight = flown(*SHORT)
    size = len(write(flight, tmp_path / "report.html"))
    # Some 16 columns of 4 bytes, two of time, 4/3 for base64; script, style and tables; the craft.
    assert size < 16 * 6 * len(flight.measured.time) + 400_000


@pytest.mark.slow
def test_the_flagship_costs_little(tmp_path):
    flight = flown()
    spent = []
    for _ in range(3):
        start = time.process_time()
        write(flight, tmp_path / "report.html")
        spent.append(time.process_time() - start)
    assert min(spent) < 0.15  # s of processor time


# -- errata ----------------------------------------------------------------------------------------

TEXT = """Preface.

# Misprints in Efremov, Polyakov & Strygin (2006)

First paper, *in italics*.

| # | printed |
|--:|---|
| 1 | \\|s\\| < `a\\|b` |

# Errata of Gorelov (1999)

Second.
"""


def test_errata_are_split_by_paper():
    one, two = sections(TEXT)
    assert one.authors == ("Efremov", "Polyakov", "Strygin")
    assert two.authors == ("Gorelov",)
    assert two.text == "Second."


@pytest.mark.parametrize(
    ("citation", "concerned"),
    [
        ("Efremov et al. 2006, Theorem 2", True),
        ("M. S. Efremov, A. E. Polyakov, V. V. Strygin, J. Appl. Math. Mech. 70 (2006) 723", True),
        ("Efremov et al. 2007", False),  # another year
        ("Polyakov et al. 2006", False),  # another first author
        ("Efremov 2006", False),  # of one author alone
        ("", False),
    ],
)
def test_a_paper_is_known_by_authors_and_year(citation, concerned):
    one, _ = sections(TEXT)
    assert one.concerns(citation) is concerned


def test_a_section_without_authors_concerns_nothing():
    assert not Section(heading="of the", text="").concerns("Efremov et al. 2006")


def test_a_law_gets_the_errata_of_what_it_cites():
    (own,) = flown("duration=2.0").mission.errata
    assert "Efremov" in own.heading
    # The momentum balance cites (1.6), and holds for any law: it is no source of this one.
    assert flown(*ON_AN_AXIS, "duration=5.0").mission.errata == ()


def test_markdown_becomes_html():
    found = report_tables.markdown(sections(TEXT)[0].text)
    assert "<em>in italics</em>" in found
    assert "<td>|s| &lt; <code>a|b</code></td>" in found
    assert (
        report_tables.markdown("2 * 3 * 4 and **so**") == "<p>2 * 3 * 4 and <strong>so</strong></p>"
    )
