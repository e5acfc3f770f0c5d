"""Planes of a recording: phase portraits of two flights with a law's lines, and its maps.

A plane view has equal axes and y down.  The flight is logged in its own units; the origin of each
view carries a scale that brings its window to the square from -1 to 1, and up to -1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from spacecraft_sim.chart import Charts, Line, Map, Portrait, portraits
from spacecraft_sim.plane_lines import inside, pieces, spread
from spacecraft_sim.record_scene import TIMELINE, Color
from spacecraft_sim.record_stream import Stream, rr, rrb
from spacecraft_sim.trajectory import Trajectory, between_rows, moving_axes

Array = np.ndarray

COLORS = {"bound": (98, 205, 132), "switching": (199, 125, 255), "aid": (120, 126, 140)}
REGIONS = ((255, 190, 110), (110, 160, 230), (170, 140, 220), (120, 200, 160))
HERE, BAND, NIGHT = (255, 98, 74), (15, 38, 27), (13, 15, 22)
AXIS, TICK = (70, 75, 88), (150, 157, 172)
STRIDE = 10  # rows to a strip of a track: a view shows or leaves out whole strips
FINAL = 60.0  # the end of a flight, shown on its own, s
RESTING = 1e-9  # share of the window of a flight below which its end shows rounding alone
PIECES = 4  # into which a track is divided between two rows
FAR = 4.0  # how far a band is drawn, in half-widths of the window
EDGE = np.array([1.08, 1.2])  # how far lines are drawn, likewise
MARGIN = (2.1, 3.1)  # middle and end of what is to the right of the window, likewise


@dataclass(frozen=True, slots=True, kw_only=True)
class Plane:
    """A view of a portrait.

    Attributes:
        portrait: The portrait.
        word: Name of the view in paths.
        title: What it shows.
        centre: Middle of its window, in the units of the signals.
        half: Half-widths of its window, likewise.
        late: Whether only the last `FINAL` seconds of each flight are shown.
    """

    portrait: Portrait
    word: str
    title: str
    centre: tuple[float, float]
    half: tuple[float, float]
    late: bool = False

    @property
    def origin(self) -> str:
        """Path of the view."""
        return f"phase/{_slug(self.portrait.name)}/{self.word}"

    def placed(self, points: Array) -> Array:
        """Returns points of the portrait in the frame of the view, where y is down.

        Args:
            points: Shape (n, 2), in the units of the signals.
        """
        return (points - self.centre) / self.half * (1, -1)


def planes(
    charts: Charts, known: Sequence[Trajectory], bands: Mapping[str, float]
) -> tuple[Plane, ...]:
    """Returns the views of each portrait: the whole flight, its end, and what is guaranteed.

    Args:
        charts: What the law draws; the axis that moves most gets a portrait of its own if nothing.
        known: Flights that are known beforehand, for the windows.
        bands: Half-widths that signals are to keep, by signal, rad.
    """
    drawn, found = portraits(charts), []
    if not drawn:
        axis = next(iter(moving_axes(known[0], "quasi_rigid_angle")), "")
        names = f"quasi_rigid_angle_{axis}", f"quasi_rigid_rate_{axis}"
        half = bands.get(names[0])
        drawn = [Portrait(name="plane", title="", signals=names, channel="", band=half)]
    for portrait in drawn:
        if not all(name in flight.signals for flight in known for name in portrait.signals):
            continue
        whole = [_window(known, signal, False) for signal in portrait.signals]
        end = [_window(known, signal, True) for signal in portrait.signals]
        found.append(_plane(portrait, "whole", "whole flight", whole))
        # What has come to rest has no end to look at.
        if all(e[1] > RESTING * w[1] for e, w in zip(end, whole, strict=True)):
            found.append(_plane(portrait, "end", "last minute", end, late=True))
        if bounds := [line.points for line in portrait.lines if line.look == "bound"]:
            half = 1.3 * np.nanmax(np.abs(np.vstack(bounds)), axis=0)
            window = [(0.0, float(x) or 1.0) for x in half]
            found.append(_plane(portrait, "bound", "what is guaranteed", window))
    return tuple(found)


def _plane(
    portrait: Portrait,
    word: str,
    title: str,
    window: Sequence[tuple[float, float]],
    late: bool = False,
) -> Plane:
    (x, a), (y, b) = window
    return Plane(portrait=portrait, word=word, title=title, centre=(x, y), half=(a, b), late=late)


def _window(known: Sequence[Trajectory], signal: str, late: bool) -> tuple[float, float]:
    """Middle and half-width of what a signal does; about zero, unless it keeps far from it."""
    shown = [
        flight[signal][flight.time >= (flight.time[-1] - FINAL if late else -np.inf)]
        for flight in known
    ]
    low, high = min(float(x.min()) for x in shown), max(float(x.max()) for x in shown)
    middle, half = (low + high) / 2, (high - low) / 2
    if abs(middle) < 3 * half or half == 0:
        middle, half = 0.0, max(abs(low), abs(high))
    return middle, 1.1 * half or 1.0


def plane_frames(stream: Stream, drawn: Sequence[Plane], flight: Trajectory) -> None:
    """Logs what stands still in the planes: axes with units, the law's lines, the band.

    Args:
        stream: The recording.
        drawn: The planes.
        flight: A flight, for the units.
    """
    for plane in drawn:
        portrait, (x, y) = plane.portrait, plane.half
        scale = rr.Transform3D(translation=[*plane.centre, 0.0], scale=[x, -y, 1.0])
        stream.log(plane.origin, scale, static=True)
        cross = [[(-1, 0), (1, 0)], [(0, -1), (0, 1)]]
        axes = rr.LineStrips2D(cross, colors=AXIS, radii=-0.7, draw_order=2.0)
        stream.log(f"{plane.origin}/axes", axes, static=True)
        labels = [
            f"{word}: {_words(name)} {_range(middle, half)} {flight.units[name]}"
            for word, name, middle, half in zip(
                ("x", "y"), portrait.signals, plane.centre, plane.half, strict=True
            )
        ]
        _scale(stream, plane.origin, labels)
        if portrait.band:
            middle = plane.placed(np.zeros((1, 2)))[0, 0]
            line = [[(middle, -FAR), (middle, FAR)]]
            look = {"colors": BAND, "radii": portrait.band / x, "draw_order": 1.0}
            stream.log(f"{plane.origin}/band", rr.LineStrips2D(line, **look), static=True)
        for k, region in enumerate(portrait.regions):
            outline = plane.placed(np.vstack([region.outline, region.outline[:1]]))
            path = f"{plane.origin}/regions/{_slug(region.name)}"
            _line(stream, path, outline, REGIONS[k % len(REGIONS)], 1.0)
        # The viewer counts in single precision: what is outside the window is cut off.
        visible = [inside(plane.placed(line.points), EDGE) for line in portrait.lines]
        for k, (line, seen) in enumerate(zip(portrait.lines, visible, strict=True)):
            if len(seen):
                width = 1.6 if line.look == "bound" else 1.1
                look = {"colors": COLORS[line.look], "radii": -width, "draw_order": 10.0}
                strips = rr.LineStrips2D(list(seen), **look)
                stream.log(_line_path(plane.origin, k, line), strips, static=True)
        _line_names(stream, plane.origin, portrait.lines, visible)


def _range(middle: float, half: float) -> str:
    return f"{middle:.4g} ± {half:.3g}" if middle else f"± {half:.3g}"


def _scale(stream: Stream, origin: str, labels: Sequence[str]) -> None:
    """What the axes are, in the margin to the right of the window."""
    places = [(MARGIN[0], -1.0 + 0.28 * k) for k in range(len(labels))]
    words = rr.Points2D(places, labels=labels, colors=TICK, radii=-0.1)
    stream.log(f"{origin}/scale", words, static=True)


def _line_names(
    stream: Stream, origin: str, lines: Sequence[Line], visible: Sequence[Array]
) -> None:
    """Names of lines, each name once, where they do not cover each other."""
    first = {line.name: k for k, line in reversed([*enumerate(lines)])}
    ranks = sorted(first.values())
    share = np.linspace(0, 1, 20)[:, None, None]
    points = []
    for k in ranks:
        start, end = visible[k][:, 0], visible[k][:, 1]
        points.append((start + share * (end - start)).swapaxes(0, 1).reshape(-1, 2))
    places = spread(points, [lines[k].name for k in ranks])
    for k, place in zip(ranks, places, strict=True):
        if place is not None:
            line = lines[k]
            look = {"colors": COLORS[line.look], "radii": -0.1}
            name = rr.Points2D([place], labels=[line.name], **look)
            stream.log(f"{_line_path(origin, k, line)}/name", name, static=True)


def _line_path(origin: str, k: int, line: Line) -> str:
    return f"{origin}/lines/{k}_{_slug(line.name)}"


def track_styles(
    stream: Stream, drawn: Sequence[Plane], key: str, color: Color, beneath: bool
) -> None:
    """Logs how the flights look in the planes.

    Args:
        stream: The recording.
        drawn: The planes.
        key: Name of the flight in paths.
        color: Its colour.
        beneath: Whether it is drawn beneath the other.
    """
    width, order = (1.9, 30.0) if beneath else (0.8, 31.0)
    for path in dict.fromkeys(_flight(plane.portrait, key) for plane in drawn):
        look = rr.LineStrips2D.from_fields(colors=color, radii=-width, draw_order=order)
        stream.log(f"{path}/track", look, static=True)
        point = rr.Points2D.from_fields(
            colors=color if beneath else (255, 255, 255), radii=-4.5 if beneath else -3.0
        )
        stream.log(f"{path}/now", point, static=True)


def tracks(
    stream: Stream,
    drawn: Sequence[Plane],
    part: Trajectory,
    key: str,
    before: Mapping[str, float],
) -> None:
    """Logs a part of a flight in the planes: the present point and short strips.

    Args:
        stream: The recording.
        drawn: The planes.
        part: The part, at least one row.
        key: Name of the flight in paths.
        before: The signals in the row before the part; empty at the start of a flight.
    """
    for portrait in {plane.portrait.name: plane.portrait for plane in drawn}.values():
        if not all(name in part.signals for name in portrait.signals):
            continue
        path = _flight(portrait, key)
        points = np.stack([part[name] for name in portrait.signals], axis=1)
        times = [rr.TimeColumn(TIMELINE, duration=part.time)]
        stream.send_columns(f"{path}/now", times, rr.Points2D.columns(positions=points))
        if before:
            last = [before[name] for name in portrait.signals]
            points, time = np.vstack([last, points]), np.r_[before["time"], part.time]
        else:
            time = part.time
        (x, y), count = portrait.signals, 1
        if y == x.replace("angle", "rate") and len(time) > 1:  # curved between the rows
            count = PIECES
            between = between_rows(time, *points.T, pieces=count)
            points = np.vstack([between[:, :-1].reshape(-1, 2), points[-1:]])
        starts, parts = strips(time, points, count)
        times = [rr.TimeColumn(TIMELINE, duration=starts)]
        stream.send_columns(f"{path}/track", times, rr.LineStrips2D.columns(strips=parts))


def strips(time: Array, points: Array, pieces: int = 1) -> tuple[Array, Array]:
    """Cuts a track into strips.

    Args:
        time: Times of the rows, shape (n,), s.
        points: Points of the track, of which `pieces` lie from row to row, the last at a row,
            shape (1 + (n - 1) pieces, m).
        pieces: Into how many pieces the track is divided between two rows.

    Returns:
        Start of each strip, shape (k,), s, and its points, shape (k, STRIDE pieces + 1, m).
    """
    long = STRIDE * pieces
    first = np.arange(0, max(len(points) - 1, 1), long)
    rows = np.minimum(first[:, None] + np.arange(long + 1), len(points) - 1)
    # The last strip may stand still at its end.
    return time[first // pieces], points[rows].astype(np.float32)


def maps(stream: Stream, charts: Charts) -> None:
    """Logs the maps of parameters of a law, each scaled to its window.

    Args:
        stream: The recording.
        charts: What the law draws.
    """
    for chart in charts:
        if not isinstance(chart, Map):
            continue
        path = f"maps/{_slug(chart.name)}"
        points = np.vstack([*(x.points for x in chart.lines), *(r.outline for r in chart.regions)])
        low, high = np.nanmin(points, axis=0), np.nanmax(points, axis=0)
        centre, half = (low + high) / 2, np.where(high > low, (high - low) / 2, 1.0)

        def placed(points: Array, centre=centre, half=half) -> Array:
            return (np.asarray(points) - centre) / half * (1, -1)

        for k, region in enumerate(chart.regions):
            outline = placed(np.vstack([region.outline, region.outline[:1]]))
            name = f"{path}/regions/{_slug(region.name)}"
            _line(stream, name, outline, REGIONS[k % len(REGIONS)], 1.5)
        for k, line in enumerate(chart.lines):
            for n, piece in enumerate(pieces(placed(line.points))):
                name = f"{path}/lines/{k}_{n}_{_slug(line.name)}"
                _line(stream, name, piece, COLORS[line.look], 1.0)
        _line_names(
            stream, path, chart.lines, [inside(placed(x.points), EDGE) for x in chart.lines]
        )
        ranges = [f"{a:.3g} to {b:.3g}" for a, b in zip(low, high, strict=True)]
        words = [
            f"{word}: {label} {span}"
            for word, label, span in zip(("x", "y"), chart.labels, ranges, strict=True)
        ]
        _scale(stream, path, words)
        for k, region in enumerate(chart.regions):
            place = [(MARGIN[0], -0.3 + 0.28 * k)]
            look = {"colors": REGIONS[k % len(REGIONS)], "radii": -0.1}
            name = rr.Points2D(place, labels=[region.name], **look)
            stream.log(f"{path}/regions/{_slug(region.name)}/name", name, static=True)
        here = rr.Points2D(placed(np.array([chart.point])), colors=HERE, radii=-6.0)
        stream.log(f"{path}/here", here, static=True)


def plane_views(
    drawn: Sequence[Plane], ends: Mapping[str, float], following: bool
) -> list[rrb.Spatial2DView]:
    """Returns a view for each plane.

    Args:
        drawn: The planes.
        ends: End of each flight, s, by its name in paths.
        following: Whether the end of a flight is taken to be where the cursor is.
    """
    views, boundary = [], rr.TimeRangeBoundary
    for plane in drawn:
        shown = {}
        for key, end in ends.items():
            start = boundary.infinite()
            if plane.late:
                start = boundary.absolute(seconds=max(end - FINAL, 0.0))
                if following:
                    start = boundary.cursor_relative(seconds=-FINAL)
            shown[_flight(plane.portrait, key)] = rrb.VisibleTimeRanges(
                rr.VisibleTimeRange(TIMELINE, start=start, end=boundary.infinite())
            )
        views.append(
            rrb.Spatial2DView(
                origin=plane.origin,
                contents=["+ $origin/**", *(f"+ /{path}/**" for path in shown)],
                name=f"Phase plane{_which(plane, drawn)}, {plane.title}",
                visual_bounds=rrb.VisualBounds2D(x_range=[-1.1, MARGIN[1]], y_range=[-1.2, 1.2]),
                background=NIGHT,
                overrides={f"{path}/track": [times] for path, times in shown.items()},
            )
        )
    return views


def _which(plane: Plane, drawn: Sequence[Plane]) -> str:
    """The axis of a plane, where there are planes of several."""
    axes = {other.portrait.signals[0].rpartition("_")[2] for other in drawn}
    return f" {plane.portrait.signals[0].rpartition('_')[2]}" if len(axes) > 1 else ""


def map_views(charts: Charts) -> list[rrb.Spatial2DView]:
    """Returns a view for each map.

    Args:
        charts: What the law draws.
    """
    bounds = rrb.VisualBounds2D(x_range=[-1.1, MARGIN[1]], y_range=[-1.2, 1.2])
    look = {"visual_bounds": bounds, "background": NIGHT}
    return [
        rrb.Spatial2DView(origin=f"maps/{_slug(chart.name)}", name=chart.title, **look)
        for chart in charts
        if isinstance(chart, Map)
    ]


def _flight(portrait: Portrait, key: str) -> str:
    return f"phase/{_slug(portrait.name)}/flights/{key}"


def _line(stream: Stream, path: str, points: Array, color: Color, width: float) -> None:
    line = rr.LineStrips2D([points], colors=color, radii=-width, draw_order=10.0)
    stream.log(path, line, static=True)


def _words(signal: str) -> str:
    return signal.replace("_", " ").replace("quasi rigid", "quasi-rigid")


def _slug(name: str) -> str:
    return "".join(c if c.isalnum() else "_" for c in name)
