"""A flight as figures in plain data, which the page of `report` draws: JSON and packed columns.

A curve of more than `LIMIT` points is thinned: of each group of rows the least and the largest are
kept. Thrust is never thinned: rows at which nothing changes say nothing.
"""

import base64
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from spacecraft_sim import sketch, spans
from spacecraft_sim.chart import Charts, Map, Portrait, half_width, locked, pulses, worst_to_come
from spacecraft_sim.drawing import Drawing, channel_units
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.trajectory import Trajectory, moving_axes

Array = np.ndarray
Flights = tuple[Trajectory, Trajectory]  # of the reduced model and of the full plant
Figure = dict[str, Any]

LIMIT = 24_000  # points of a curve
FRAMES = 500  # instants at which the spacecraft itself is kept
PLANTS = (("reduced", 3.4), ("MuJoCo", 1.2))  # the thin over the wide line
HISTORIES = {
    "quasi_rigid_angle": "Quasi-rigid angle",
    "attitude": "Attitude of the bus",
    "tips": "Boom tips, deflection y",
    "rate": "Rate of the bus",
    "quasi_rigid_rate": "Quasi-rigid rate",
    "disturbance": "Disturbance torque",
}


class Columns:
    """Columns of numbers, each kept once, little-endian and in base64.

    Attributes:
        packed: Type and data by key.
    """

    def __init__(self):
        self.packed: dict[str, dict[str, str]] = {}
        self._keys: dict[bytes, str] = {}

    def add(self, values: Array, kind: str = "f4") -> str:
        """Returns the key of a column.

        Args:
            values: The numbers.
            kind: `f4` or `f8`; times are f8, so that switchings stay apart.
        """
        data = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
        key = self._keys.setdefault(kind.encode() + data, f"c{len(self._keys)}")
        if key not in self.packed:
            self.packed[key] = {"type": kind, "data": base64.b64encode(data).decode()}
        return key


def page(
    flights: Flights,
    drawing: Drawing,
    *,
    verdicts: Sequence[Verdict],
    bands: Mapping[str, float],
    charts: Charts,
) -> Figure:
    """Returns the figures of a flight with their columns.

    Args:
        flights: Of the reduced model and of the full plant.
        drawing: Shapes and motion of the full plant.
        verdicts: What became of the guarantees on the full plant.
        bands: Half-widths that are promised, by signal, rad.
        charts: What the law draws beside its theorem.
    """
    columns, measured = Columns(), flights[1]
    figures = [_history(columns, kind, flights, drawing, bands) for kind in HISTORIES]
    figures = [figure for figure in figures if figure["traces"]]
    if figures:
        figures[0]["marks"] = [
            {"t": v.t_worst, "holds": v.holds, "text": f"{v.claim}: {v.measured:.4g} {v.unit}"}
            for v in verdicts
            if v.t_worst is not None
        ]
    if channels := channel_units(measured, drawing):
        figures.insert(3, _lanes(columns, channels, measured))
    figures.append(_craft(columns, drawing))
    moving = moving_axes(measured, "quasi_rigid_rate")
    axes = [a for a in moving_axes(measured, "quasi_rigid_angle") if a in moving]
    figures += [f for axis in axes for f in _phase_plane(columns, axis, flights, bands)]
    for chart in charts:
        portrait = isinstance(chart, Portrait)
        figures += _portrait(columns, chart, measured) if portrait else [_map(chart)]
    start, end = float(measured.time[0]), float(measured.time[-1])
    return {
        "start": start,
        "end": end,
        "spans": {
            "whole flight": (start, end),
            "until it has settled": (start, min(1.3 * spans.settled(measured) + 1, end)),
            "last cycles": (spans.last_cycles(measured), end),
        },
        "rows": len(measured.time),
        "figures": figures,
        "columns": columns.packed,
    }


def extremes(values: Array, limit: int) -> Array:
    """Returns rows that keep the least and the largest value of each group, and both ends.

    Args:
        values: Samples, shape (n,).
        limit: How many rows to keep at most, about; all are kept if there are no more.
    """
    n = len(values)
    if n <= limit:
        return np.arange(n)
    size = -(-2 * n // limit)
    whole = n // size * size
    groups = values[:whole].reshape(-1, size)
    first = np.arange(0, whole, size)
    rows = [first + groups.argmin(axis=1), first + groups.argmax(axis=1), np.arange(whole, n)]
    return np.unique(np.concatenate([[0], *rows, [n - 1]]))


def _curve(columns: Columns, time: Array, values: Array) -> dict[str, str]:
    rows = extremes(values, LIMIT)
    return {"t": columns.add(time[rows], "f8"), "y": columns.add(values[rows])}


def _steps(columns: Columns, time: Array, values: Array) -> dict[str, str]:
    """Only the rows at which a value that holds changes, and the last."""
    rows = np.flatnonzero(np.r_[True, values[1:] != values[:-1]])
    rows = np.unique(np.append(rows, len(values) - 1))
    return {"t": columns.add(time[rows], "f8"), "y": columns.add(values[rows])}


def _history(
    columns: Columns,
    kind: str,
    flights: Flights,
    drawing: Drawing,
    bands: Mapping[str, float],
) -> Figure:
    traces, unit = [], ""
    for k, (name, signal) in enumerate(_signals(kind, flights[1], drawing).items()):
        for flight, (plant, width) in zip(flights, PLANTS, strict=True):
            if signal not in flight.signals or (kind == "tips" and k and plant == "reduced"):
                continue
            full, unit = plant == "MuJoCo", flight.units[signal].partition(" or ")[0]
            tone = f"boom-{k % 5}" if kind == "tips" and full else f"{name}-{plant.lower()}"
            if kind == "tips":  # booms often swing alike: the later ones are thinner
                tone, width = tone if full else "z-reduced", max(2.8 - 0.9 * k, 1) if full else 4.5
            trace = {"name": f"{name}, {plant}", "tone": tone, "width": width, "draw": "line"}
            traces.append({**trace, **_curve(columns, flight.time, flight[signal])})
    unit = "N m" if kind == "disturbance" else unit
    figure = {"id": kind, "kind": "history", "title": HISTORIES[kind], "unit": unit}
    return {**figure, "traces": traces, "bands": _bands(kind, bands)}


def _bands(kind: str, bands: Mapping[str, float]) -> list[Figure]:
    """Those of a kind of angle filled; those of the other kind faint: they promise nothing here."""
    found, angles = [], {"quasi_rigid_angle": "quasi-rigid angle", "attitude": "attitude"}
    for signal, half in bands.items() if kind in angles else ():
        asked, _, axis = signal.rpartition("_")
        if asked in angles:
            other = {} if asked == kind else {"faint": True}
            name = (
                f"{axis}: ±{half:.3g} rad" if not other else f"asked of the {angles[asked]} {axis}"
            )
            found.append({"low": -half, "high": half, "name": name, **other})
    return found


def _signals(kind: str, measured: Trajectory, drawing: Drawing) -> dict[str, str]:
    """Signals of a history by the name that they get in its key."""
    if kind == "tips":
        return {b: f"{b}_tip_y" for b in drawing.booms if f"{b}_tip_y" in measured.signals}
    names = {axis: f"{kind}_{axis}" for axis in moving_axes(measured, kind)}
    return {axis: name for axis, name in names.items() if np.any(measured[name])}


def _lanes(columns: Columns, channels: dict[str, str], measured: Trajectory) -> Figure:
    lanes = []
    for channel, unit in channels.items():
        thrust, time = measured[channel], measured.time
        lanes.append(
            {
                "name": channel,
                "unit": unit,
                "levels": np.unique(np.abs(thrust[thrust != 0])).tolist(),
                "delivered": _steps(columns, time, thrust),
                "command": _steps(columns, time, measured[f"{channel}_command"]),
            }
        )
        if len(lanes[-1]["levels"]) > 16:  # a thrust that rises and falls has no levels
            lanes[-1]["levels"] = [lanes[-1]["levels"][-1] / 10, lanes[-1]["levels"][-1]]
    return {"id": "thrust", "kind": "lanes", "title": "Thrust", "channels": lanes}


def _craft(columns: Columns, drawing: Drawing) -> Figure:
    """The spacecraft at some instants, about its first body."""
    view, lines = sketch.view_of(drawing), sketch.boom_lines(drawing)
    frames = np.unique(np.linspace(0, len(drawing.time) - 1, FRAMES).astype(int))
    centre = next(iter(drawing.positions.values()))
    factor, seen, bodies, booms = sketch.exaggeration(list(lines.values())), [], {}, []
    for shape in sketch.solid_shapes(drawing):
        points = sketch.surface(shape)
        faces = sketch.BOX_FACES if shape.kind == "box" else ()
        rgb = [round(255 * float(c)) for c in shape.rgba[:3]]
        part = {"points": points.round(4).tolist(), "rgb": rgb, "faces": faces}
        bodies.setdefault(shape.body, []).append(part)
        place = np.abs(view.project(drawing.positions[shape.body] - centre)).max(axis=0)
        seen.append(place + np.linalg.norm(points, axis=1).max())
    for boom, (bent, straight) in lines.items():
        shares = np.linalg.norm(straight[0] - straight[0, 0], axis=1)
        path = np.concatenate([bent[frames], straight[frames, -1:]], axis=1)
        key, shares = columns.add(path), (shares / shares[-1]).round(6).tolist()
        booms.append({"name": boom, "key": key, "shares": shares})
        shown = view.project(straight + factor * (bent - straight))
        seen.append(np.abs(shown).max(axis=(0, 1)))
    poses = {
        body: np.hstack([drawing.positions[body] - centre, drawing.quaternions[body]])[frames]
        for body in bodies
    }
    return {
        "id": "craft",
        "kind": "craft",
        "title": "Spacecraft at the cursor",
        "seen": view.words,
        "axes": [view.right.tolist(), view.up.tolist(), view.near.tolist()],
        "reach": (2 * np.max(seen, axis=0)).tolist(),
        "factor": factor,
        "factors": sorted({1.0, 2.0, 5.0, 10.0, factor}) if booms else [],
        "t": columns.add(drawing.time[frames], "f8"),
        "bodies": [{"key": columns.add(poses[b]), "shapes": parts} for b, parts in bodies.items()],
        "booms": booms,
    }


def _track(columns: Columns, time: Array, x: Array, y: Array) -> dict[str, str]:
    rows = np.union1d(extremes(x, LIMIT // 2), extremes(y, LIMIT // 2))
    rows = rows if len(x) > LIMIT else np.arange(len(x))
    pair = {"x": columns.add(x[rows]), "y": columns.add(y[rows])}
    return {"t": columns.add(time[rows], "f8"), **pair}


def _phase_plane(
    columns: Columns, axis: str, flights: Flights, bands: Mapping[str, float]
) -> list[Figure]:
    names = [f"quasi_rigid_angle_{axis}", f"quasi_rigid_rate_{axis}"]
    if not all(name in flight.signals for flight in flights for name in names):
        return []
    tracks = []
    for flight, (plant, width) in zip(flights, PLANTS, strict=True):
        look = {"name": plant, "tone": f"{axis}-{plant.lower()}", "width": width}
        track = _track(columns, flight.time, flight[names[0]], flight[names[1]])
        tracks.append({**look, **track, "dotted": plant == "MuJoCo"})
    x = {"name": f"quasi-rigid angle {axis}", "unit": "rad"}
    y = {"name": f"quasi-rigid rate {axis}", "unit": "rad/s"}
    half = bands.get(names[0])
    band = [{"low": -half, "high": half, "name": f"±{half:.3g} rad"}] if half else []
    title = f"Phase plane {axis}" if axis != "z" else "Phase plane"
    figure = _plane(f"phase_{axis}", f"{title}, of the time shown", x, y)
    return [{**figure, "tracks": tracks, "bands": band, "smooth": len(flights[1].time) <= LIMIT}]


def _plane(name: str, title: str, x: Figure, y: Figure) -> Figure:
    parts = {part: [] for part in ("regions", "lines", "tracks", "bands", "points")}
    return {"id": name, "kind": "plane", "title": title, "x": x, "y": y, "window": None, **parts}


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


def _portrait(columns: Columns, portrait: Portrait, measured: Trajectory) -> list[Figure]:
    """The phase plane of a law, the angle in its band, the lengths of the pulses."""
    time, (x, y) = measured.time, (measured[name] for name in portrait.signals)
    names = [name.replace("_", " ") for name in portrait.signals]
    units = [measured.units[name] for name in portrait.signals]
    labels = [{"name": n, "unit": u} for n, u in zip(names, units, strict=True)]
    look = {"name": "flight", "tone": "z-mujoco", "width": 1.1, "dotted": True}
    tracks = [{**look, **_track(columns, time, x, y)}]
    if portrait.min_on_time:
        on = locked(measured, portrait)
        rows = np.flatnonzero(on | np.r_[False, on[:-1]])  # with a row after each, which ends it
        look = {"name": "minimum on-time running", "tone": "bad", "width": 2.2}
        data = {"x": np.where(on, x, np.nan)[rows], "y": y[rows]}
        packed = {name: columns.add(values) for name, values in data.items()}
        tracks.append({**look, **packed, "t": columns.add(time[rows], "f8")})
    half = [half_width(portrait, k) for k in (0, 1)]
    window = [-half[0], half[0], -half[1], half[1]] if all(half) else None
    plane = _plane(f"chart_{portrait.name}", portrait.title, *labels)
    smooth = len(time) <= LIMIT
    plane |= {"tracks": tracks, "window": window, "smooth": smooth, **_outlines(portrait)}
    band = portrait.band
    still = {"name": "largest still to come", "tone": "bad", "width": 1.3, "draw": "line"}
    inside = {
        **{"id": f"band_{portrait.name}", "kind": "history", "unit": units[0]},
        "title": f"{names[0].capitalize()} in its band",
        "traces": [
            {"name": "flight", "tone": "z-mujoco", "width": 1.2, "draw": "line"}
            | _curve(columns, time, x),
            still | _curve(columns, time, worst_to_come(x)),
        ],
        "bands": [{"low": -band, "high": band, "name": "guaranteed"}] if band else [],
    }
    return [plane, inside, _pulses(columns, portrait, measured)]


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
    figure = _plane(f"chart_{chart.name}", chart.title, x, y)
    return {**figure, **outlines, "points": here, "window": [float(v) for v in window]}
