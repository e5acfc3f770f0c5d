"""A flight as figures in plain data, which the page of `report` draws: JSON and packed columns."""

from collections.abc import Mapping, Sequence

import numpy as np

from spacecraft_sim import report_charts, report_columns, sketch, spans
from spacecraft_sim.chart import Charts, vectors
from spacecraft_sim.drawing import Drawing, turned
from spacecraft_sim.families import families, is_quasi_rigid
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.report_columns import Columns, Figure, curve, plane, steps, track
from spacecraft_sim.trajectory import Trajectory, channel_units, moving_axes

Flights = tuple[Trajectory, Trajectory]  # of the reduced model and of the full plant

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
    if is_quasi_rigid(flights[0]):
        figures = [_history(columns, kind, flights, drawing, bands) for kind in HISTORIES]
    else:
        shown = families(measured, vectors(charts, measured))
        figures = [_family(columns, *part, flights) for part in shown.items()]
        figures.append(_difference(columns, next(iter(shown.values())), flights))
    figures = [figure for figure in figures if figure["traces"]]
    if figures:
        figures[0]["marks"] = [
            {"t": v.t_worst, "holds": v.holds, "text": f"{v.claim}: {v.measured:.4g} {v.unit}"}
            for v in verdicts
            if v.t_worst is not None
        ]
    if is_quasi_rigid(flights[0]) and (channels := channel_units(measured)):
        figures.insert(3, _lanes(columns, channels, measured))
    figures.append(_craft(columns, drawing))
    moving = moving_axes(measured, "quasi_rigid_rate")
    axes = [a for a in sorted(moving_axes(measured, "quasi_rigid_angle")) if a in moving]
    figures += [f for axis in axes for f in _phase_plane(columns, axis, flights, bands)]
    figures += [f for chart in charts for f in report_charts.figures(columns, chart, flights)]
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
            full, unit = plant == "MuJoCo", flight.units[signal]
            tone = f"boom-{k % 5}" if kind == "tips" and full else f"{name}-{plant.lower()}"
            if kind == "tips":  # booms often swing alike: the later ones are thinner
                tone, width = tone if full else "z-reduced", max(2.8 - 0.9 * k, 1) if full else 4.5
            trace = {"name": f"{name}, {plant}", "tone": tone, "width": width, "draw": "line"}
            traces.append({**trace, **curve(columns, flight.time, flight[signal])})
    figure = {"id": kind, "kind": "history", "title": HISTORIES[kind], "unit": unit}
    return {**figure, "traces": traces, "bands": _bands(kind, bands)}


def _family(columns: Columns, title: str, names: Sequence[str], flights: Flights) -> Figure:
    """Signals that belong together, the reduced plant wide below."""
    traces = []
    for k, name in enumerate(names):
        look = {"name": "reduced", "tone": "z-reduced", "width": 3.4, "draw": "line"}
        if name in flights[0].signals:
            traces.append({**look, **curve(columns, flights[0].time, flights[0][name])})
        look = {"name": name.replace("_", " "), "tone": f"boom-{k % 5}", "width": 1.4}
        dashed = {"draw": "line", "dashed": k >= 5}
        traces.append({**look, **dashed, **curve(columns, flights[1].time, flights[1][name])})
    unit = flights[1].units[names[0]] if names else ""
    figure = {"id": title.lower().replace(" ", "_"), "kind": "history", "title": title}
    return {**figure, "unit": unit, "traces": traces, "bands": []}


def _difference(columns: Columns, names: Sequence[str], flights: Flights) -> Figure:
    """MuJoCo minus the reduced plant, where both have rows."""
    time, i, j = np.intersect1d(flights[0].time, flights[1].time, return_indices=True)
    traces = []
    for k, name in enumerate(n for n in names if n in flights[0].signals):
        look = {"name": name.replace("_", " "), "tone": f"boom-{k % 5}", "width": 1.4}
        values = flights[1][name][j] - flights[0][name][i]
        more = {"draw": "line", "dashed": k >= 5, **curve(columns, time, values)}
        traces.append({**look, **more})
    unit = flights[1].units[names[0]] if names else ""
    figure = {"id": "difference", "kind": "history", "title": "MuJoCo minus reduced"}
    return {**figure, "unit": unit, "traces": traces, "bands": []}


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
                "delivered": steps(columns, time, thrust),
                "command": steps(columns, time, measured[f"{channel}_command"]),
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
    factor, seen, bodies, booms = drawing.bending, [], {}, []
    for shape in sketch.solid_shapes(drawing):
        points = sketch.surface(shape)
        faces = sketch.BOX_FACES if shape.kind == "box" else ()
        rgb = [round(255 * float(c)) for c in shape.rgba[:3]]
        part = {"points": points.round(4).tolist(), "rgb": rgb, "faces": faces}
        bodies.setdefault(shape.body, []).append(part)
        place = (drawing.positions[shape.body] - centre)[frames, None]
        shown = place + turned(drawing.quaternions[shape.body][frames, None], points)
        seen.append(view.project(shown).reshape(-1, 2))
    for boom, (bent, straight) in lines.items():
        shares = np.linalg.norm(straight[0] - straight[0, 0], axis=1)
        path = np.concatenate([bent[frames], straight[frames, -1:]], axis=1)
        key, shares = columns.add(path), (shares / shares[-1]).round(6).tolist()
        booms.append({"name": boom, "key": key, "shares": shares})
        shown = (straight + factor * (bent - straight))[frames]
        seen.append(view.project(shown).reshape(-1, 2))
    poses = {
        body: np.hstack([drawing.positions[body] - centre, drawing.quaternions[body]])[frames]
        for body in bodies
    }
    low = np.min([points.min(axis=0) for points in seen], axis=0)
    high = np.max([points.max(axis=0) for points in seen], axis=0)
    turning = f"; sprung joints turned × {drawing.turned:g}" if drawing.turned > 1 else ""
    return {
        "id": "craft",
        "kind": "craft",
        "title": "At the cursor",
        "seen": view.words + turning,
        "axes": [view.right.tolist(), view.up.tolist(), view.near.tolist()],
        "middle": ((low + high) / 2).tolist(),
        "reach": (high - low).tolist(),
        "factor": factor,
        "factors": sorted({1.0, 2.0, 5.0, 10.0, factor}) if booms else [],
        "t": columns.add(drawing.time[frames], "f8"),
        "bodies": [{"key": columns.add(poses[b]), "shapes": parts} for b, parts in bodies.items()],
        "booms": booms,
    }


def _phase_plane(
    columns: Columns, axis: str, flights: Flights, bands: Mapping[str, float]
) -> list[Figure]:
    names = [f"quasi_rigid_angle_{axis}", f"quasi_rigid_rate_{axis}"]
    if not all(name in flight.signals for flight in flights for name in names):
        return []
    tracks = []
    for flight, (plant, width) in zip(flights, PLANTS, strict=True):
        look = {"name": plant, "tone": f"{axis}-{plant.lower()}", "width": width}
        data = track(columns, flight.time, flight[names[0]], flight[names[1]])
        tracks.append({**look, **data, "dotted": plant == "MuJoCo"})
    x = {"name": f"quasi-rigid angle {axis}", "unit": "rad"}
    y = {"name": f"quasi-rigid rate {axis}", "unit": "rad/s"}
    half = bands.get(names[0])
    band = [{"low": -half, "high": half, "name": f"±{half:.3g} rad"}] if half else []
    figure = plane(f"phase_{axis}", f"Phase plane {axis}, of the time shown", x, y)
    return [
        {
            **figure,
            "tracks": tracks,
            "bands": band,
            "smooth": len(flights[1].time) <= report_columns.LIMIT,
        }
    ]
