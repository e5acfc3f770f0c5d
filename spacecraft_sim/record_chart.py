"""The charts of a law in a recording: phase portraits and maps as plane views."""

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from spacecraft_sim.chart import Charts, Map, Portrait
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray

COLORS = {"bound": (98, 205, 132), "switching": (199, 125, 255), "aid": (120, 126, 140)}
REGIONS = ((255, 190, 110), (110, 160, 230), (170, 140, 220), (120, 200, 160))
FLIGHT, HERE, NIGHT = (77, 163, 255), (255, 98, 74), (13, 15, 22)
TIMELINE = "sim_time"


def log(stream: rr.RecordingStream, measured: Trajectory, charts: Charts) -> None:
    """Logs the charts, each under `charts/<name>`, scaled to its largest line or region.

    A plane view has equal axes and y down, so both axes are scaled and y is turned over.

    Args:
        stream: The recording.
        measured: The flight.
        charts: The charts.
    """
    for chart in charts:
        path = f"charts/{chart.name}"
        centre, half = _window(chart, measured)

        def placed(points: Array, centre=centre, half=half) -> Array:
            return (np.asarray(points) - centre) / half * (1, -1)

        for region, color in zip(chart.regions, REGIONS, strict=False):
            outline = placed(np.vstack([region.outline, region.outline[:1]]))
            _line(stream, f"{path}/regions/{_slug(region.name)}", outline, color, 1.5, region.name)
        for k, line in enumerate(chart.lines):
            width = 1.6 if line.look == "bound" else 1.0
            for n, piece in enumerate(_pieces(placed(line.points))):
                name = f"{path}/lines/{k}_{n}_{_slug(line.name)}"
                _line(stream, name, piece, COLORS[line.look], width, None if n else line.name)
        if isinstance(chart, Portrait):
            track = placed(np.stack([measured[s] for s in chart.signals], axis=1))
            _line(stream, f"{path}/flight", track, FLIGHT, 0.7, None)
            stream.log(f"{path}/now", rr.Points2D.from_fields(colors=HERE, radii=-5.0), static=True)
            times = [rr.TimeColumn(TIMELINE, duration=measured.time)]
            stream.send_columns(f"{path}/now", times, rr.Points2D.columns(positions=track))
        else:
            here = placed(np.array([chart.point]))
            stream.log(f"{path}/here", rr.Points2D(here, colors=HERE, radii=-6.0), static=True)


def views(charts: Charts) -> list[rrb.Spatial2DView]:
    """Returns a view for each chart.

    Args:
        charts: The charts.
    """
    bounds = rrb.VisualBounds2D(x_range=[-1.1, 1.1], y_range=[-1.1, 1.1])
    return [
        rrb.Spatial2DView(
            origin=f"charts/{chart.name}", name=chart.title, visual_bounds=bounds, background=NIGHT
        )
        for chart in charts
    ]


def _window(chart: Portrait | Map, measured: Trajectory) -> tuple[Array, Array]:
    """Centre and half-widths of what is drawn."""
    if isinstance(chart, Portrait):
        bound = [line.points for line in chart.lines if line.look == "bound"]
        shown = bound or [np.stack([measured[s] for s in chart.signals], axis=1)]
        half = 1.45 * np.nanmax(np.abs(np.vstack(shown)), axis=0)
        return np.zeros(2), np.where(half > 0, half, 1.0)
    points = np.vstack([*(x.points for x in chart.lines), *(r.outline for r in chart.regions)])
    low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
    return (low + high) / 2, np.where(high > low, (high - low) / 2, 1.0)


def _pieces(points: Array) -> list[Array]:
    """A line without its breaks."""
    broken = np.flatnonzero(np.isnan(points).any(axis=1))
    parts = np.split(points, broken)
    return [p for p in (part[~np.isnan(part).any(axis=1)] for part in parts) if len(p) > 1]


def _line(
    stream: rr.RecordingStream,
    path: str,
    points: Array,
    color: tuple[int, int, int],
    width: float,
    label: str | None,
) -> None:
    labels = [label] if label else None
    line = rr.LineStrips2D([points], colors=color, radii=-width, labels=labels)
    stream.log(path, line, static=True)


def _slug(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)
