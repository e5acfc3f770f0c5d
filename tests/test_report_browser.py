"""report.html in a browser without a window: it loads, draws every figure, zooms, reads out."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from browser import CHROMIUM, MISSING, Page
from flown import ON_AN_AXIS, flown
from test_report import figures, write

from spacecraft_sim.chart import series

pytestmark = pytest.mark.skipif(CHROMIUM is None, reason=MISSING)
SETTINGS = (*ON_AN_AXIS, "duration=60.0")
PANE = "document.querySelector('[data-figure=attitude] .pane').getBoundingClientRect().toJSON()"
VIEW = "({...document.getElementById('flight').dataset})"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    page = Page(tmp_path_factory.mktemp("profile"))
    yield page
    page.close()


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    path = tmp_path_factory.mktemp("run") / "report.html"
    write(flown(*SETTINGS), path)
    return path


@pytest.fixture
def page(browser, report):
    """The report, freshly opened."""
    browser.open(report)
    browser.settle()
    return browser


def view(page):
    page.settle()
    shown = page.evaluate(VIEW)
    return float(shown["from"]), float(shown["to"])


def pane(page):
    """Left, top, width and height of a pane, scrolled into sight."""
    page.evaluate(
        "document.querySelector('[data-figure=attitude]').scrollIntoView({behavior: 'instant'})"
    )
    page.settle()
    box = json.loads(page.evaluate(f"JSON.stringify({PANE})"))
    return box["left"], box["top"], box["width"], box["height"]


def test_it_loads_without_a_complaint_and_asks_for_nothing(page, report):
    assert page.complaints() == []
    assert page.requests() == [report.resolve().as_uri()]


def test_complaints_are_heard(browser, tmp_path):
    path = tmp_path / "wrong.html"
    path.write_text("<script>console.error('no'); fetch('file:///none'); oops()</script>")
    browser.open(path)
    browser.settle()
    assert len(browser.complaints()) >= 2
    assert path.resolve().as_uri() in browser.requests()


def hidden(part, column):
    """Whether a line has nothing to draw, as one all at the front of a sphere has at its back."""
    if "points" in part:
        return sum(x is not None for x, _ in part["points"]) < 2
    return "x" in part and np.isfinite(column(part["x"])).sum() < 2


@pytest.mark.parametrize("name", ["efremov-nonlocal", "burkov-body-vectors", "burkov-position"])
def test_every_figure_has_its_traces(browser, tmp_path, name):
    flight = flown(*SETTINGS) if name == "efremov-nonlocal" else flown("duration=1.0", name=name)
    write(flight, tmp_path / "report.html")
    page, (found, column) = browser, figures(flight)
    page.open(tmp_path / "report.html")
    page.settle()
    assert page.complaints() == []
    broken = page.evaluate("[...document.querySelectorAll('svg *')].map(e => e.outerHTML).join('')")
    assert not any(word in broken for word in ("NaN", "Infinity", "undefined", "null"))
    drawn = page.evaluate("""Object.fromEntries([...document.querySelectorAll('figure')].map(f =>
        [f.dataset.figure, [...f.querySelectorAll('[data-name]')].filter(p =>
            (p.getAttribute('d') ?? '').length > 8).map(p => p.dataset.name)]))""")
    assert set(drawn) == set(found)
    for name, figure in found.items():
        parts = [p for kind in ("traces", "tracks", "lines", "regions", "booms")
                 for p in figure.get(kind, ())]  # fmt: skip
        wanted = [part["name"] for part in parts if not hidden(part, column)]
        wanted += [f"{c['name']} {part}" for c in figure.get("channels", ())
                   for part in ("plus", "minus", "command")]  # fmt: skip
        assert sorted(drawn[name]) == sorted(wanted), name
        assert wanted or figure["kind"] == "craft", name  # which has no booms


def test_the_verdict_is_that_of_the_run(page):
    verdicts = flown(*SETTINGS).comparison.verdicts
    shown = page.evaluate("({...document.querySelector('.verdict').dataset})")
    assert shown == {"kept": str(sum(v.holds for v in verdicts)), "claims": str(len(verdicts))}
    assert page.evaluate("document.title") == flown(*SETTINGS).mission.scenario.title


def test_no_number_is_broken(page):
    paths = page.evaluate("[...document.querySelectorAll('svg *')].map(e => e.outerHTML).join('')")
    for word in ("NaN", "Infinity", "undefined", "null"):
        assert word not in paths


def test_dragging_zooms_all_time_axes_and_a_double_click_resets(page):
    left, top, width, _ = pane(page)
    assert view(page) == (0.0, 60.0)
    page.mouse("mousePressed", left + 0.25 * width, top + 30, button="left", clickCount=1)
    page.mouse("mouseMoved", left + 0.5 * width, top + 40, button="left")
    page.mouse("mouseReleased", left + 0.5 * width, top + 40, button="left", clickCount=1)
    # A pixel is 60 s / 800: a tenth of a second.
    assert view(page) == pytest.approx((15.0, 30.0), abs=0.15)
    labels = page.evaluate("""[...document.querySelectorAll('[data-figure=thrust] text')]
        .map(t => t.textContent).filter(t => t.endsWith(' s'))""")
    assert labels[0] == "16 s"  # the lanes followed
    for count in (1, 2):
        page.mouse("mousePressed", left + 50, top + 30, button="left", clickCount=count)
        page.mouse("mouseReleased", left + 50, top + 30, button="left", clickCount=count)
    assert view(page) == (0.0, 60.0)


def test_the_wheel_zooms_about_the_pointer_and_only_after_it_moved(page):
    left, top, width, _ = pane(page)
    x = left + 0.5 * width
    page.evaluate("dispatchEvent(new Event('scroll'))")
    page.mouse("mouseWheel", x, top + 30, deltaX=0, deltaY=-200)
    assert view(page) == (0.0, 60.0)  # the page went by under a resting pointer
    page.settle()
    left, top, width, _ = pane(page)
    page.mouse("mouseMoved", x - 5, top + 30)
    page.mouse("mouseMoved", x, top + 32)
    page.mouse("mouseWheel", x, top + 32, deltaX=0, deltaY=-400)
    start, end = view(page)
    assert end - start == pytest.approx(60.0 / 1.0015**400, rel=1e-6)
    assert (start + end) / 2 == pytest.approx(30.0, abs=0.1)


def test_hovering_reads_out_what_was_recorded(page):
    flight = flown(*SETTINGS).measured
    left, top, width, height = pane(page)
    page.mouse("mouseMoved", left + 10, top + 10)
    page.mouse("mouseMoved", left + 0.4 * width, top + height / 2)
    page.settle()
    t = float(page.evaluate(VIEW)["cursor"])
    assert t == pytest.approx(24.0, abs=0.1)
    row = int(flight.time.searchsorted(t, side="right")) - 1
    expected = flight["attitude_z"][row] * 1e3
    read = page.evaluate("""[...document.querySelectorAll('[data-figure=attitude] .key')]
        .find(k => k.textContent.includes('MuJoCo')).querySelector('.value').textContent""")
    value, unit = read.replace("−", "-").split()
    scale = {"mrad": 1.0, "µrad": 1e3, "rad": 1e-3}[unit]
    assert float(value) == pytest.approx(expected * scale, rel=1e-3)  # four digits are shown
    # The same instant everywhere: the dot on the phase plane stands where the flight was.
    assert page.evaluate("document.querySelectorAll('[data-figure=phase_z] .dot').length") == 1
    assert f"t = {t:.3f} s" in page.evaluate("document.querySelector('.now').textContent")


def test_a_logarithmic_axis_has_powers_of_ten_and_reads_out_the_value(browser, tmp_path):
    flight = flown("duration=1.0", name="burkov-body-vectors")
    write(flight, tmp_path / "report.html")
    browser.open(tmp_path / "report.html")
    browser.settle()
    figure = "document.querySelector('[data-figure=chart_energy]')"
    ticks = browser.evaluate(f"[...{figure}.querySelectorAll('text')].map(t => t.textContent)")
    assert any(re.fullmatch(r"1e-?\d+", tick) for tick in ticks)
    browser.evaluate(f"{figure}.scrollIntoView({{behavior: 'instant'}})")
    browser.settle()
    place = f"{figure}.querySelector('.pane').getBoundingClientRect().toJSON()"
    box = json.loads(browser.evaluate(f"JSON.stringify({place})"))
    for share in (0.1, 0.5):
        place = box["left"] + share * box["width"], box["top"] + box["height"] / 2
        browser.mouse("mouseMoved", *place)
    browser.settle()
    t = float(browser.evaluate(VIEW)["cursor"])
    energy = next(c for c in flight.mission.controller.charts if c.name == "energy")
    time, values = series(energy, flight.measured, len(flight.measured.time))
    read = browser.evaluate(f"""[...{figure}.querySelectorAll('.key')]
        .find(k => k.textContent.startsWith('V') && !k.textContent.includes('reduced'))
        .querySelector('.value').textContent""")
    value, unit = read.replace("−", "-").split()
    scale = {"J": 1.0, "mJ": 1e-3}[unit]
    wanted = values[int(time.searchsorted(t, side="right")) - 1, 0]
    assert float(value) * scale == pytest.approx(wanted, rel=1e-3)  # four digits are shown


PHASE = "document.querySelectorAll('[data-figure=phase_z] .trace')[1].getAttribute('d')"


def test_the_phase_plane_follows_the_time_shown_and_curves_between_the_rows(page):
    whole = page.evaluate(PHASE)
    page.evaluate("report.setView(30, 31)")
    page.settle()
    time = flown(*SETTINGS).measured.time
    rows = np.count_nonzero((time >= 30) & (time <= 31))
    points = page.evaluate(f"{PHASE}.split(/[ML]/).length - 1")
    assert page.evaluate(PHASE) != whole
    assert points > 4 * rows  # eight pieces an interval, those of no length left out


def test_an_axis_that_spans_little_says_where_it_begins(page):
    label = """[...document.querySelectorAll('[data-figure=attitude] svg text')]
        .map(t => t.textContent).find(t => t.includes('rad'))"""
    page.evaluate("document.querySelector('[data-figure=attitude] .key').click()")  # one curve
    page.evaluate("report.setView(30, 30.0005)")
    page.settle()
    assert re.fullmatch(r"[mµn]?rad from −?[\d.e−-]+ rad", page.evaluate(label))
    page.evaluate("report.setView(0, 60)")
    page.settle()
    assert page.evaluate(label) in ("mrad", "rad")


def test_a_verdict_leads_to_its_worst_instant(page):
    worst = page.evaluate("""(() => { const b = document.querySelector('[data-time]'); b.click();
        return b.dataset.time; })()""")
    page.settle()
    assert page.evaluate(VIEW)["cursor"] == worst
    start, end = view(page)
    assert start <= float(worst) <= end
    assert end - start == pytest.approx(3.0)  # a twentieth of the flight


def test_a_key_hides_its_curve(page):
    key = "document.querySelector('[data-figure=attitude] .key')"
    path = "document.querySelector('[data-figure=attitude] .trace').getAttribute('d')"
    assert page.evaluate(path)
    page.evaluate(f"{key}.click()")
    page.settle()
    assert page.evaluate(path) == ""


def test_curves_keep_the_extremes_of_each_pixel(browser, tmp_path):
    """A spike of one row among thousands is drawn to its full height."""
    flight = flown(*SETTINGS)
    time = np.linspace(0.0, 60.0, 20_001)
    signals = {name: np.interp(time, flight.measured.time, value)
               for name, value in flight.measured.signals.items()}  # fmt: skip
    signals["attitude_z"] = np.where(np.arange(len(time)) == 7_777, 5.0, 0.0)
    spiked = replace(flight.measured, time=time, signals=signals)
    path = tmp_path / "report.html"
    write(replace(flight, measured=spiked), path)
    browser.open(path)
    browser.settle()
    box = json.loads(browser.evaluate(f"JSON.stringify({PANE})"))
    heights = browser.evaluate("""(document.querySelectorAll('[data-figure=attitude] .trace')[1]
        .getAttribute('d').match(/ [0-9.]+/g)).map(Number)""")
    # 5 rad is 1/1.12 of the pane, whose margins are 6 % of the range; a tenth of a pixel.
    assert max(heights) - min(heights) == pytest.approx(box["height"] / 1.12, rel=0.02)


def test_dark_and_paper(page, tmp_path):
    page.call("Emulation.setEmulatedMedia",
              features=[{"name": "prefers-color-scheme", "value": "dark"}])  # fmt: skip
    color = "getComputedStyle(document.body).backgroundColor"
    page.until(f"{color} === 'rgb(12, 15, 22)'")
    page.paper(tmp_path / "report.pdf")
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")
    page.call("Emulation.setEmulatedMedia", features=[])
    page.until(f"{color} === 'rgb(245, 246, 249)'")
    assert page.complaints() == []
