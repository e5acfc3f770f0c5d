"""A run on one page that needs nothing else: `report.html`, with its figures, style and script."""

import json
from html import escape
from pathlib import Path

from spacecraft_sim import explain, report_columns, report_figures, report_tables
from spacecraft_sim.chart import charts_of
from spacecraft_sim.compare import Comparison
from spacecraft_sim.drawing import Drawing
from spacecraft_sim.families import is_quasi_rigid
from spacecraft_sim.mission import Mission
from spacecraft_sim.trajectory import Trajectory

_HERE = Path(__file__).parent
_MAPS = ("chart_", "band_", "pulses_")  # figures that stand in the section of the law's charts
COMMANDS = (
    ("fly the same trajectory again, bit for bit", "spacecraft-sim run scenario.toml --out again"),
    ("open the recording", "rerun recording.rrd"),
    ("render a video", "spacecraft-sim video . --out flight.webp"),
    ("read what theory predicts", "spacecraft-sim explain scenario.toml"),
)


def write(
    path: Path,
    *,
    mission: Mission,
    measured: Trajectory,
    predicted: Trajectory,
    drawing: Drawing,
    comparison: Comparison,
    scenario_toml: str,
) -> None:
    """Writes the page; it fetches nothing and names no file but its neighbours.

    Args:
        path: The HTML file.
        mission: What was flown.
        measured: Flight of the full plant.
        predicted: Flight of the reduced model.
        drawing: Shapes and motion of the full plant.
        comparison: How it came out.
        scenario_toml: The resolved scenario.
    """
    figures = report_figures.page(
        (predicted, measured),
        drawing,
        verdicts=comparison.verdicts,
        bands=mission.bands,
        charts=charts_of(mission.controller),
    )
    sections = {
        "verdicts": ("Verdicts", report_tables.verdicts(comparison)),
        "flight": ("Flight", _flight(figures)),
        "charts": ("Charts of the law", _charts(figures)),
        "assumptions": ("Assumptions", report_tables.assumptions(comparison.verdicts)),
        "differences": (
            "MuJoCo minus reduced model",
            report_tables.differences(comparison.differences),
        ),
        "scenario": ("Scenario", _scenario(mission, scenario_toml)),
        "replay": ("Replay", report_tables.commands(COMMANDS)),
        "errata": ("Errata of the sources", report_tables.errata(mission.errata)),
    }
    sections = {name: part for name, part in sections.items() if part[1]}
    body = "".join(
        f'<section id="{name}"><h2>{title}</h2>{text}</section>\n'
        for name, (title, text) in sections.items()
    )
    links = "".join(f'<a href="#{name}">{title}</a>' for name, (title, _) in sections.items())
    data = json.dumps(figures, allow_nan=False, separators=(",", ":")).replace("<", r"\u003c")
    scripts = "".join(
        f"<script>\n{(_HERE / name).read_text(encoding='utf-8')}</script>\n"
        for name in ("report.js", "report_kinds.js")
    )
    text = (
        f"{head(mission.scenario.title)}<body>\n{_header(mission, comparison, predicted)}"
        f'<nav><div>{links}<button class="theme">light / dark</button></div></nav>\n'
        f"<main>\n{body}</main>\n"
        f'<script type="application/json" id="flight-data">{data}</script>\n'
        f"{scripts}</body></html>\n"
    )
    path.write_text(text, encoding="utf-8")


def head(title: str) -> str:
    """Returns the beginning of a page up to its head's end, with the style inside.

    Args:
        title: Title of the page.
    """
    style = (_HERE / "report.css").read_text(encoding="utf-8")
    return (
        '<!doctype html>\n<html lang="en" data-theme="light"><head><meta charset="utf-8">\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f'<link rel="icon" href="data:,"><title>{escape(title)}</title>\n'
        f"<style>\n{style}</style></head>\n"
    )


def tally(kept: int, claims: int) -> str:
    """Returns how many claims hold, in words.

    Args:
        kept: How many hold.
        claims: How many there are.
    """
    return f"{kept} of {claims} claims hold" if claims != 1 else f"{kept} of 1 claim holds"


def _header(mission: Mission, comparison: Comparison, predicted: Trajectory) -> str:
    scenario, verdicts = mission.scenario, comparison.verdicts
    modes = scenario.reduced.modes
    elastic = f", {modes} mode{'s' * (modes != 1)}" if is_quasi_rigid(predicted) else ""
    kept = sum(v.holds for v in verdicts)
    facts = {
        "scenario": scenario.name,
        "spacecraft": mission.machine.name,
        "law": str(scenario.controller["law"]),
        "flight": f"{scenario.duration:g} s",
        "reduced model": scenario.reduced.source + elastic,
        "seed": str(scenario.seed),
    }
    words = "".join(f"<span>{name} <b>{escape(text)}</b></span>" for name, text in facts.items())
    kind = "holds" if kept == len(verdicts) else "fails"
    return (
        f'<header class="{kind}"><div><div class="words"><h1>{escape(scenario.title)}</h1>'
        f'<div class="facts">{words}</div></div>'
        f'<div class="verdict" data-kept="{kept}" data-claims="{len(verdicts)}">'
        f"{tally(kept, len(verdicts))}</div></div></header>\n"
    )


def _figure(figure: report_columns.Figure) -> str:
    return f'<figure data-figure="{figure["id"]}"></figure>'


def _flight(figures: report_columns.Figure) -> str:
    own = [f for f in figures["figures"] if not f["id"].startswith(_MAPS)]
    beside = "".join(_figure(f) for f in own if f["kind"] in ("plane", "craft"))
    over_time = "".join(_figure(f) for f in own if f["kind"] not in ("plane", "craft"))
    buttons = "".join(
        f'<button data-span="{start!r} {end!r}">{name}</button>'
        for name, (start, end) in figures["spans"].items()
    )
    rows, limit = figures["rows"], report_columns.LIMIT
    kept = (
        f"Every one of the {rows} rows of the MuJoCo flight is here"
        if rows <= limit
        else f"Of the {rows} rows the curves keep the least and the largest of every "
        f"{-(-2 * rows // limit)}; all are in trajectory.parquet"
    )
    return (
        f'<div class="tools">{buttons}<span class="soft">drag: zoom · wheel: zoom at the pointer · '
        "shift and drag: move · double click: back · a key: hide its curve</span>"
        '<span class="now"></span></div>'
        f'<div class="flight"><div>{over_time}</div><div class="beside">{beside}</div></div>'
        f'<p class="soft">{kept}, in single precision. Each pixel shows the extremes of its rows.'
        "</p><noscript><p>The figures need JavaScript; summary.png needs none.</p></noscript>"
    )


def _charts(figures: report_columns.Figure) -> str:
    """In two columns; of several portraits each in a column of its own, with what follows it."""
    drawn = [f for f in figures["figures"] if f["id"].startswith(_MAPS)]
    portraits = {
        f["id"].replace("band_", "chart_", 1) for f in drawn if f["id"].startswith("band_")
    }
    columns: list[str] = []
    for figure in drawn:
        if not columns or figure["id"] in portraits:
            columns.append("")
        columns[-1] += _figure(figure)
    if len(columns) < 2:
        return f'<div class="charts">{columns[0]}</div>' if columns else ""
    return f'<div class="charts-by-axis">{"".join(f"<div>{c}</div>" for c in columns)}</div>'


def _scenario(mission: Mission, scenario_toml: str) -> str:
    groups = explain.parameters(mission.scenario, mission.machine, mission.design)
    text = " ".join(mission.scenario.description.split())
    return (
        f"<p>{escape(text)}</p>{report_tables.parameters(groups)}"
        f"<details><summary>scenario.toml</summary><pre>{escape(scenario_toml)}</pre></details>"
    )
