"""The charts of a law as figures of a report: portraits with their pulses, maps of parameters."""

import math

import numpy as np

from spacecraft_sim import report_columns, sphere
from spacecraft_sim.chart import (
    Chart,
    History,
    Map,
    Portrait,
    Sphere,
    counted,
    floor,
    half_width,
    histories,
    locked,
    path_of,
    pulses,
    series,
    spheres,
    worst_to_come,
)
from spacecraft_sim.report_columns import Columns, Figure, curve, plane, track
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray

ROWS = 3000  # at which histories are computed and paths on spheres kept
ASPECT = 1.44  # width over height of a plane on the page


def _outlines(chart: Portrait | Map) -> Figure:
    looks = {
        "bound": {"tone": "good", "width": 2.2, "dashed": False},
        "switching": {"tone": "switching", "width": 1.6, "dashed": True},
        "aid": {"tone": "soft", "width": 0.9, "dashed": False},
    }
    return {
        "regions": [
            {"name": r.name, "tone": f"region-{k % 4}", "points": _points(r.outline)}
            for k, r in enumerate(chart.regions)
        ],
        "lines": [
            {"name": line.name, **looks[line.look], "points": _points(line.points)}
            for line in chart.lines
        ],
    }


def _points(points: Array) -> list[list[float | None]]:
    """JSON has no NaN, which breaks a line: null."""
    return [[None, None] if math.isnan(x + y) else [x, y] for x, y in points.tolist()]


def figures(columns: Columns, chart: Chart, flights: tuple[Trajectory, Trajectory]) -> list[Figure]:
    """Returns the figures of a chart; none of one whose signals the flight does not have.

    Args:
        columns: Where to pack its numbers.
        chart: The chart.
        flights: Of the reduced model and of the full plant.
    """
    measured = flights[1]
    if isinstance(chart, Portrait):
        return _portrait(columns, chart, measured)
    if isinstance(chart, Map):
        return [_map(chart)]
    if isinstance(chart, History):
        return [_history(columns, h, flights) for h in histories([chart], measured)]
    return [_sphere(columns, s, flights) for s in spheres([chart], measured)]


def _history(columns: Columns, history: History, flights: tuple[Trajectory, Trajectory]) -> Figure:
    """Curves of the full plant, and below them of the reduced one what the history is about."""
    predicted, measured = flights
    time, values = series(history, measured, ROWS)
    low = floor(history, values[0])

    def shown(values: Array) -> Array:
        return np.log10(np.maximum(values, low)) if history.decades else values

    traces = []
    if history.heads and all(name in predicted.signals for name in history.signals):
        below, heads = series(history, predicted, ROWS)
        for k in history.heads:
            name = f"{history.curves[k].name}, reduced"
            look = {"name": name, "tone": "z-reduced", "width": 3.4, "draw": "line"}
            traces.append({**look, **curve(columns, below, shown(heads[:, k]))})
    for k, part in enumerate(history.curves):
        tone = "ink" if part.hue is None else f"boom-{part.hue % 5}"
        width = 4.0 if part.beneath else 1.4
        look = {"name": part.name, "tone": tone, "width": width, "faint": part.beneath}
        data = curve(columns, time, shown(values[:, k]))
        traces.append({**look, "draw": "line", **data})
    figure = {"id": f"chart_{history.name}", "kind": "history", "title": history.title}
    more = {"unit": history.unit, "log": history.decades is not None, "bands": []}
    return {**figure, **more, "traces": traces}


def _sphere(columns: Columns, chart: Sphere, flights: tuple[Trajectory, Trajectory]) -> Figure:
    """The sphere as it is seen from where the targets are; dashed or thin: its back."""
    view = sphere.view(chart)
    angle = np.linspace(0, 2 * np.pi, 121)
    rim = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    lines = [{"name": "", "tone": "soft", "width": 1.2, "dashed": False, "points": _points(rim)}]
    tracks, points = [], []

    def both(points: Array, name: str, tone: str, width: float) -> None:
        for side, back in zip(sphere.sides(points, view.near), (False, True), strict=True):
            look = {"name": "" if back else name, "tone": tone, "width": width, "dashed": back}
            lines.append({**look, "points": _points(view.project(side))})

    for line in sphere.net():
        both(line, "", "soft", 0.6)
    for k, arrow in enumerate(chart.arrows):
        if arrow.basin is not None:
            both(arrow.basin, f"{arrow.name}: {chart.bound}", f"boom-{k % 5}", 0.9)
        for flight, plant in zip(flights, ("reduced", "MuJoCo"), strict=True):
            if not all(name in flight.signals for name in arrow.signals):
                continue
            tone, wide = ("z-reduced", 3.4) if plant == "reduced" else (f"boom-{k % 5}", 1.8)
            rows = np.unique(np.linspace(0, len(flight.time) - 1, ROWS).astype(int))
            way = path_of(arrow, flight)[rows]
            for side, share in zip(sphere.sides(way, view.near), (1.0, 0.4), strict=True):
                x, y = view.project(side).T
                data = {"x": columns.add(x), "y": columns.add(y)}
                data["t"] = columns.add(flight.time[rows], "f8")
                look = {"name": f"{arrow.name}, {plant}", "tone": tone, "width": wide * share}
                tracks.append({**look, **data, "dotted": plant == "MuJoCo" and share == 1.0})
        x, y = view.project(np.array(arrow.target)).tolist()
        points.append({"x": x, "y": y, "name": f"goal of {arrow.name}"})
    across = {"name": f"{chart.frame}, seen from the goals; thin: at the back", "unit": ""}
    figure = plane(f"chart_{chart.name}", chart.title, across, {"name": "", "unit": ""})
    window = [-1.15 * ASPECT, 1.15 * ASPECT, -1.15, 1.15]
    return {
        **figure,
        "lines": lines,
        "tracks": tracks,
        "points": points,
        "window": window,
        "smooth": False,
    }


def _portrait(columns: Columns, portrait: Portrait, measured: Trajectory) -> list[Figure]:
    """The phase plane of a law, the angle in its band, the lengths of the pulses."""
    time, (x, y) = measured.time, (measured[name] for name in portrait.signals)
    names = [name.replace("_", " ") for name in portrait.signals]
    units = [measured.units[name] for name in portrait.signals]
    labels = [{"name": n, "unit": u} for n, u in zip(names, units, strict=True)]
    look = {"name": "flight", "tone": "z-mujoco", "width": 1.1, "dotted": True}
    tracks = [{**look, **track(columns, time, x, y)}]
    if portrait.min_on_time:
        on = locked(measured, portrait)
        rows = np.flatnonzero(on | np.r_[False, on[:-1]])  # with a row after each, which ends it
        look = {"name": "minimum on-time running", "tone": "bad", "width": 2.2}
        data = {"x": np.where(on, x, np.nan)[rows], "y": y[rows]}
        packed = {name: columns.add(values) for name, values in data.items()}
        tracks.append({**look, **packed, "t": columns.add(time[rows], "f8")})
    half = [half_width(portrait, k) for k in (0, 1)]
    window = [-half[0], half[0], -half[1], half[1]] if all(half) else None
    figure = plane(f"chart_{portrait.name}", portrait.title, *labels)
    smooth = len(time) <= report_columns.LIMIT
    figure |= {"tracks": tracks, "window": window, "smooth": smooth, **_outlines(portrait)}
    band = portrait.band
    still = {"name": "largest still to come", "tone": "bad", "width": 1.3, "draw": "line"}
    inside = {
        **{"id": f"band_{portrait.name}", "kind": "history", "unit": units[0]},
        "title": f"{names[0].capitalize()} in its band",
        "traces": [
            {"name": "flight", "tone": "z-mujoco", "width": 1.2, "draw": "line"}
            | curve(columns, time, x),
            still | curve(columns, time, worst_to_come(x)),
        ],
        "bands": [{"low": -band, "high": band, "name": "guaranteed"}] if band else [],
    }
    return [figure, inside, _pulses(columns, portrait, measured)]


def _pulses(columns: Columns, portrait: Portrait, measured: Trajectory) -> Figure:
    thrust, least = measured[portrait.channel], portrait.min_on_time
    start, length = pulses(measured.time, thrust)
    positive = thrust[np.searchsorted(measured.time, start)] > 0
    traces = []
    for mask, tone, word in ((positive, "plus", "positive"), (~positive, "minus", "negative")):
        if mask.any():
            look = {"name": f"{word} pulse", "tone": tone, "width": 1.4, "draw": "stem"}
            data = {"t": columns.add(start[mask], "f8"), "y": columns.add(length[mask])}
            traces.append({**look, **data})
    limit = {"low": least, "high": least, "faint": True, "name": f"minimum on-time {least:g} s"}
    figure = {"id": f"pulses_{portrait.name}", "kind": "history", "unit": "s", "floor": 0.0}
    figure["title"] = counted(portrait, length)
    return {**figure, "traces": traces, "bands": [limit] if least else []}


def _map(chart: Map) -> Figure:
    x, y = ({"name": label, "unit": ""} for label in chart.labels)
    outlines = _outlines(chart)
    drawn = [*(line.points for line in chart.lines), *(r.outline for r in chart.regions)]
    points = np.vstack([np.array([chart.point]), *drawn])
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    pad = 0.03 * np.where(high > low, high - low, 1.0)
    window = [low[0] - pad[0], high[0] + pad[0], low[1] - pad[1], high[1] + pad[1]]
    here = [{"x": chart.point[0], "y": chart.point[1], "name": "here"}]
    figure = plane(f"chart_{chart.name}", chart.title, x, y)
    return {**figure, **outlines, "points": here, "window": [float(v) for v in window]}
