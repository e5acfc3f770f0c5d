"""The charts of a law as figures of a report: portraits with their pulses, maps of parameters."""

import math

import numpy as np

from spacecraft_sim import report_columns
from spacecraft_sim.chart import Map, Portrait, half_width, locked, pulses, worst_to_come
from spacecraft_sim.report_columns import Columns, Figure, curve, plane, track
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray


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


def figures(columns: Columns, chart: Portrait | Map, measured: Trajectory) -> list[Figure]:
    """Returns the figures of a chart.

    Args:
        columns: Where to pack its numbers.
        chart: The chart.
        measured: The flight.
    """
    return _portrait(columns, chart, measured) if isinstance(chart, Portrait) else [_map(chart)]


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
    shortest = f", the shortest {length.min():.6g} s" if len(length) else ""
    figure = {"id": f"pulses_{portrait.name}", "kind": "history", "unit": "s", "floor": 0.0}
    figure["title"] = f"{len(length)} pulses{shortest}"
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
