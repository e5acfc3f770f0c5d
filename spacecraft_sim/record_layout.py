"""The one layout of all recordings: the spacecraft, what was claimed, histories, phase planes."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spacecraft_sim.chart import Charts, History, Sphere
from spacecraft_sim.record_chart import NIGHT, Plane, map_views, plane_views
from spacecraft_sim.record_law import history_path, sphere_views
from spacecraft_sim.record_scene import TIMELINE
from spacecraft_sim.record_signals import band_path
from spacecraft_sim.record_stream import rr, rrb
from spacecraft_sim.signal_groups import Group

NEAR = 8.0  # half-width of the plots that follow the cursor, s, or a tenth of the flight
LONG, ROUND = 1.85, 2.9  # distance of the eye in radii of the ball, for booms and for all else
MINUTE = 60.0  # which a playback lasts at least, if it is faster than real time, s
FEW = 2  # curves of a flight whose names leave room for the curves
DOCUMENTS = ("verdicts", "scenario")


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """What a layout depends on.

    Attributes:
        middle: Middle of the ball that holds what moves, shape (3,), m.
        radius: Its radius, m.
        factor: How many times too far the booms are drawn bent.
        booms: Whether there are any.
        ghost: Name of the flight that is drawn translucent.
        drawn: Whether anything of it is drawn.
        ends: End of each flight, s, by its name in paths.
        duration: Length of the longest flight, s.
        active: Until when plots show it first, s; None for all of it.
        groups: What is plotted.
        planes: Phase planes.
        charts: What the law draws.
        histories: What it draws over time.
        spheres: Where it draws directions.
        bands: Half-widths that signals are to keep, by signal, the widest first, rad.
        relays: Whether there are channels with levels.
        acting: Names of the channels whose thrust is shown: those that are known to act.
        unit: Of their thrusts.
        upright: Whether the machine stands on the ground, to be seen from the side.
    """

    middle: np.ndarray
    radius: float
    factor: float
    booms: bool
    ghost: str
    drawn: bool
    ends: Mapping[str, float]
    duration: float
    active: float | None
    groups: Sequence[Group]
    planes: Sequence[Plane]
    charts: Charts
    histories: Sequence[History]
    spheres: Sequence[Sphere]
    bands: Mapping[str, float]
    relays: bool
    acting: Sequence[str]
    unit: str
    upright: bool


def blueprint(layout: Layout, *, following: bool) -> rrb.Blueprint:
    """Returns the blueprint of a recording.

    Args:
        layout: What it depends on.
        following: Whether the time cursor runs with the data, as it should while a run is flown.
    """
    left = rrb.Vertical(_space(layout), _words(), row_shares=[3, 2])
    middle = _histories(layout)
    right = _near_and_planes(layout, following)
    panel = rrb.TimePanel(
        timeline=TIMELINE,
        state="collapsed",
        play_state="following" if following else "paused",
        playback_speed=2.0 ** max(math.floor(math.log2(layout.duration / MINUTE)), 0),
    )
    columns = rrb.Horizontal(left, middle, right, column_shares=[4, 4, 3])
    return rrb.Blueprint(columns, panel, collapse_panels=True)


def _space(layout: Layout) -> rrb.Spatial3DView:
    eye = np.array([0.0, -1.9, 0.5] if layout.upright else [0.0, -1.15, 1.45])
    # Booms are long and thin: they fit where the ball about them does not.
    eye *= layout.radius * (LONG if layout.booms else ROUND) / np.linalg.norm(eye)
    words = ["Motion"] if not layout.booms else [f"Bending x {layout.factor:g}, grey: unbent"]
    words += [f"translucent: {layout.ghost}"] if layout.drawn else []
    return rrb.Spatial3DView(
        origin="world",
        name=f"{'; '.join(words)} [m]",
        background=NIGHT,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(
            position=layout.middle + eye, look_target=layout.middle, eye_up=[0, 0, 1]
        ),
    )


def _words() -> rrb.Tabs:
    columns = rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["LogLevel", "Body"])
    documents = [rrb.TextDocumentView(origin=p, name=p.title()) for p in DOCUMENTS]
    events = rrb.TextLogView(origin="events", name="Events", columns=columns)
    return rrb.Tabs(documents[0], events, documents[1])


def _time(near: float | None = None, until: float | None = None) -> rrb.TimeAxis:
    """The whole flight, or some seconds on both sides of the cursor, or its beginning."""
    boundary = rr.TimeRangeBoundary
    start, end = boundary.infinite(), boundary.infinite()
    if near:
        start, end = (boundary.cursor_relative(seconds=s * near) for s in (-1, 1))
    if until:
        start, end = (boundary.absolute(seconds=s) for s in (0.0, until))
    return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))


def _plot(
    origin: str,
    name: str,
    *,
    near: float | None = None,
    until: float | None = None,
    half: float | None = None,
    bounds: Sequence[str] = (),
    parts: Sequence[str] = ("**",),
    key: bool = True,
) -> rrb.TimeSeriesView:
    """A plot of the whole flight, or near the cursor."""
    return rrb.TimeSeriesView(
        origin=origin,
        contents=[*(f"+ $origin/{part}" for part in parts), *(f"+ /{path}" for path in bounds)],
        name=name,
        axis_x=_time(near, until),
        axis_y=rrb.ScalarAxis(range=(-half, half)) if half else None,
        plot_legend=rrb.PlotLegend(corner="RightTop", visible=key),
    )


def _histories(layout: Layout) -> rrb.Vertical:
    """Positions, those of them that have bounds once more near these, rates, boom tips."""
    paths = {signal: band_path(k, signal) for k, signal in enumerate(layout.bands)}
    rows: list[rrb.Container | rrb.View] = []
    for role in ("position", "rate", "tip"):
        groups = [group for group in layout.groups if group.role == role]
        # The colours are those of the first plot: where they are many, its key is enough.
        key = role == "position" or all(len(group.labels) <= FEW for group in groups)
        titles = [(g.name, f"{g.title}, to {g.size:.2g}", g.unit) for g in groups]
        if groups:
            rows.append(rrb.Tabs(*_spans(titles, layout, key=key)))
        kept = [g for g in groups if any(signal in paths for signal in g.signals)]
        if kept:
            rows.append(rrb.Tabs(*(_kept(group, layout.bands, paths) for group in kept)))
    if linear := [h for h in layout.histories if not h.decades]:
        parts = [(history_path(h), h.title, h.unit) for h in linear]
        rows.append(rrb.Tabs(*_spans(parts, layout)))
    return rrb.Vertical(*rows)


def _spans(
    plots: Sequence[tuple[str, str, str]],
    layout: Layout,
    parts: Sequence[str] = ("**",),
    key: bool = True,
) -> list[rrb.TimeSeriesView]:
    """Plots of the whole flight; before them, of one that comes to rest, plots of its beginning."""
    titles = [(origin, f"{title} [{unit or '-'}]") for origin, title, unit in plots]
    whole = [_plot(origin, title, parts=parts, key=key) for origin, title in titles]
    if not layout.active:
        return whole
    words = f"first {layout.active:.3g} s"
    first = [
        _plot(origin, f"{title}, {words}", until=layout.active, parts=parts, key=key)
        for origin, title in titles
    ]
    return [*first, *whole]


def _kept(group: Group, bands: Mapping[str, float], paths: Mapping[str, str]) -> rrb.TimeSeriesView:
    own = [signal for signal in group.signals if signal in bands]
    half = 1.6 * max(bands[signal] for signal in own)
    words = "its bound" if len(own) == 1 else "bounds"
    title = f"{group.title} within {words}, ±{half:.2g} [{group.unit}]"
    return _plot(group.name, title, half=half, bounds=[paths[signal] for signal in own])


def _near_and_planes(layout: Layout, following: bool) -> rrb.Vertical:
    views = plane_views(layout.planes, layout.ends, following)
    firsts = [v for v, plane in zip(views, layout.planes, strict=True) if plane.word == "whole"]
    others = [v for v, plane in zip(views, layout.planes, strict=True) if plane.word != "whole"]
    spheres = sphere_views(layout.spheres, list(layout.ends))
    energies = [
        _plot(history_path(h, power), f"{h.title} [{'log10 ' if power else ''}{h.unit}]")
        for h in layout.histories
        if h.decades
        for power in (True, False)
    ]
    found = (spheres, energies, [*firsts, *map_views(layout.charts)], others)
    upper = [rrb.Tabs(*views) for views in found if views]
    near = min(NEAR, layout.duration / 10)
    channels = [f"{name}/**" for name in layout.acting]
    thrust = [
        _plot(
            "thrust",
            f"Thrust near the cursor [{layout.unit}]",
            near=near,
            parts=channels,
            key=len(channels) <= FEW,
        ),
        *_spans([("thrust", "Thrust", layout.unit)], layout, channels, len(channels) <= FEW),
    ]
    # Pulses are seen from near, a torque that follows its command from afar.
    thrust = thrust if layout.relays else [*thrust[1:], thrust[0]]
    rows: list[rrb.Container | rrb.View] = [*upper, rrb.Tabs(*thrust)]
    if layout.relays:
        lanes = rrb.StateTimelineView(
            origin="relay",
            contents=[f"+ $origin/{part}" for part in channels],
            name="Relay near the cursor",
            time_view=_time(near),
        )
        rows.append(lanes)
    return rrb.Vertical(*rows, row_shares=[3] * len(upper) + [2, 1.5][: len(rows) - len(upper)])
