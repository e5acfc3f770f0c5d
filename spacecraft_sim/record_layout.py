"""The one layout of all recordings: the spacecraft, what was claimed, histories, phase planes."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from spacecraft_sim.chart import Charts
from spacecraft_sim.record_chart import NIGHT, Plane, map_views, plane_views
from spacecraft_sim.record_scene import TIMELINE

NEAR = 8.0  # half-width of the plots that follow the cursor, s
SPEED = 4.0  # of playback, over real time
DOCUMENTS = ("verdicts", "scenario")


@dataclass(frozen=True, slots=True, kw_only=True)
class Layout:
    """What a layout depends on.

    Attributes:
        extent: Size of the spacecraft, m.
        factor: How many times too far the booms are drawn bent.
        ghost: Name of the flight that is drawn translucent.
        ends: End of each flight, s, by its name in paths.
        planes: Phase planes.
        charts: What the law draws.
        band: Accuracy that the quasi-rigid angle shall keep, rad; None if none was asked for.
    """

    extent: float
    factor: float
    ghost: str
    ends: Mapping[str, float]
    planes: Sequence[Plane]
    charts: Charts
    band: float | None


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
        playback_speed=SPEED,
    )
    columns = rrb.Horizontal(left, middle, right, column_shares=[4, 4, 3])
    return rrb.Blueprint(columns, panel, collapse_panels=True)


def _space(layout: Layout) -> rrb.Spatial3DView:
    eye = layout.extent * np.array([0.0, -1.15, 1.45])
    return rrb.Spatial3DView(
        origin="world",
        name=f"Bending x {layout.factor:g}, grey: unbent; translucent: {layout.ghost} [m]",
        background=NIGHT,
        line_grid=rrb.LineGrid3D(visible=False),
        eye_controls=rrb.EyeControls3D(position=eye, look_target=[0, 0, 0], eye_up=[0, 0, 1]),
    )


def _words() -> rrb.Tabs:
    columns = rrb.TextLogColumns(timeline_columns=[TIMELINE], text_log_columns=["LogLevel", "Body"])
    documents = [rrb.TextDocumentView(origin=p, name=p.title()) for p in DOCUMENTS]
    events = rrb.TextLogView(origin="events", name="Events", columns=columns)
    return rrb.Tabs(documents[0], events, documents[1])


def _time(near: bool) -> rrb.TimeAxis:
    """The whole flight, or what is near the cursor."""
    boundary = rr.TimeRangeBoundary
    start, end = boundary.infinite(), boundary.infinite()
    if near:
        start, end = (boundary.cursor_relative(seconds=s * NEAR) for s in (-1, 1))
    return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))


def _plot(
    origin: str, name: str, *, near: bool = False, half: float | None = None, band: bool = False
) -> rrb.TimeSeriesView:
    """A plot of the whole flight, or near the cursor."""
    bound = ["+ /bound/angle"] if band else []
    return rrb.TimeSeriesView(
        origin=origin,
        contents=["+ $origin/**", *bound],
        name=name,
        axis_x=_time(near),
        axis_y=rrb.ScalarAxis(range=(-half, half)) if half else None,
        plot_legend=rrb.PlotLegend(corner="RightTop"),
    )


def _histories(layout: Layout) -> rrb.Vertical:
    band = layout.band
    kept = []
    if band:
        name = "Quasi-rigid angle within its bound [rad]"
        kept.append(_plot("quasi_rigid_angle", name, half=1.6 * band, band=True))
    angle = _plot("quasi_rigid_angle", "Quasi-rigid angle [rad]", band=bool(band))
    return rrb.Vertical(
        rrb.Tabs(_plot("attitude", "Attitude of the bus [rad]"), angle),
        *kept,
        rrb.Tabs(
            _plot("rate", "Rate of the bus [rad/s]"),
            _plot("quasi_rigid_rate", "Quasi-rigid rate [rad/s]"),
        ),
        _plot("tips", "Boom tips, deflection [m]"),
    )


def _near_and_planes(layout: Layout, following: bool) -> rrb.Vertical:
    views = plane_views(layout.planes, layout.ends, following)
    firsts = [v for v, plane in zip(views, layout.planes, strict=True) if plane.word == "whole"]
    others = [v for v, plane in zip(views, layout.planes, strict=True) if plane.word != "whole"]
    upper = [rrb.Tabs(*found) for found in ([*firsts, *map_views(layout.charts)], others) if found]
    return rrb.Vertical(
        *upper,
        rrb.Tabs(
            _plot("thrust", "Thrust near the cursor [N or N m]", near=True),
            _plot("thrust", "Thrust, whole flight [N or N m]"),
        ),
        rrb.StateTimelineView(
            origin="relay", name="Relay near the cursor", time_view=_time(near=True)
        ),
        row_shares=[3] * len(upper) + [2, 1.5],
    )
