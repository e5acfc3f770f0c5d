"""Each shipped scenario as a user runs it, some seconds of it: what stands in its folder."""

import json
import re

import numpy as np
import pytest
import rrd
from browser import CHROMIUM, MISSING, Page

from spacecraft_sim import cli, library, mission
from spacecraft_sim.chart import charts_of, vectors
from spacecraft_sim.signal_groups import groups
from spacecraft_sim.trajectory import Trajectory

pytestmark = pytest.mark.slow
NANOSECOND = 1.1e-9  # to which rerun rounds times
SECONDS = 3.0


@pytest.fixture(scope="module", params=library.scenario_names())
def ran(request, tmp_path_factory):
    """Name of a scenario and the folder of its run."""
    folder = tmp_path_factory.mktemp("runs") / request.param
    words = ["run", request.param, "--out", str(folder), "--set", f"duration={SECONDS}"]
    assert cli.main(words) in (0, 1)
    return request.param, folder


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    if CHROMIUM is None:
        pytest.skip(MISSING)
    page = Page(tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


def test_the_recording_is_whole_and_its_last_samples_are_the_flights(ran):
    _, folder = ran
    path = folder / "recording.rrd"
    assert rrd.stores(path) == (1, 1)  # with one blueprint
    assert rrd.chunks(path)
    entities = rrd.read(path)
    flights = [Trajectory.load(folder / f"{x}.parquet") for x in ("trajectory", "reduced")]
    ready = mission.assemble(mission.load_scenario(folder / "scenario.toml"))
    directions = vectors(charts_of(ready.controller), flights[0])
    plotted = groups(flights, [boom.name for boom in ready.machine.booms], directions)
    assert len(plotted) >= 2
    for group in plotted:
        for key, flight in zip(("simulated", "reduced"), flights, strict=True):
            entity = entities[f"/{group.name}/{key}"]
            assert entity.time[0] == 0.0
            assert entity.time[-1] == pytest.approx(flight.time[-1], abs=NANOSECOND)
            assert len(entity.time) == len(entity.values["Scalars:scalars"]) >= SECONDS / 0.1
            last = [flight[signal][-1] for signal in group.signals]
            np.testing.assert_array_equal(entity.values["Scalars:scalars"][-1], last)
    if "/events" in entities:
        assert max(entities["/events"].time) <= SECONDS + NANOSECOND


def test_all_that_is_plotted_has_its_unit(ran):
    entities = rrd.read(ran[1] / "recording.rrd")
    names = [n for e in entities.values() for n in e.static.get("SeriesLines:names", ())]
    assert names
    for name in names:
        assert re.search(r"\[[^\]]+\]$| rad$", name), name


def test_documents_tell_verdicts_and_scenario(ran):
    _, folder = ran
    entities = rrd.read(folder / "recording.rrd")
    (page,) = entities["/verdicts"].static["TextDocument:text"]
    (scenario,) = entities["/scenario"].static["TextDocument:text"]
    found = json.loads((folder / "verdict.json").read_text())["verdicts"]
    kept = sum(verdict["holds"] for verdict in found)
    assert page.startswith(f"# {kept} of {len(found)} claims hold")
    assert (folder / "scenario.toml").read_text().strip() in scenario


def test_the_report_loads_without_a_complaint_and_asks_for_nothing(ran, browser):
    _, folder = ran
    browser.open(folder / "report.html")
    browser.settle()
    assert browser.complaints() == []
    assert browser.requests() == [(folder / "report.html").resolve().as_uri()]
    found = json.loads((folder / "verdict.json").read_text())["verdicts"]
    shown = browser.evaluate("({...document.querySelector('.verdict').dataset})")
    kept = sum(verdict["holds"] for verdict in found)
    assert shown == {"kept": str(kept), "claims": str(len(found))}
    drawn = browser.evaluate("""Object.fromEntries([...document.querySelectorAll('figure')].map(
        f => [f.dataset.figure, [...f.querySelectorAll('path, line, polygon, circle, rect')].filter(
            e => e.tagName != 'path' || (e.getAttribute('d') ?? '').length > 8).length]))""")
    assert len(drawn) >= 5
    assert all(count > 3 for count in drawn.values()), drawn  # a craft may have three parts
    for tables in ("svg", "td"):
        words = browser.evaluate(
            f"[...document.querySelectorAll('{tables}')].map(e => e.outerHTML).join(' ')"
        )
        assert not re.search(r"\bNaN\b|\bInfinity\b", words)
