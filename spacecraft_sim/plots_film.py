"""A strip of pictures of the bending spacecraft, drawn from its geometry without OpenGL."""

import math

import numpy as np
from matplotlib.axes import Axes
from matplotlib.patches import FancyArrowPatch, Polygon
from matplotlib.path import Path as Line

from spacecraft_sim import sketch, spans
from spacecraft_sim.drawing import Drawing, Jet, turned
from spacecraft_sim.families import is_quasi_rigid
from spacecraft_sim.sketch import View
from spacecraft_sim.trajectory import Trajectory, channel_units

Array = np.ndarray

INK, SOFT, SHADE = "#1d2430", "#6b7484", "#f4f6fa"
PLUS, MINUS = "#d8432f", "#2b6cd4"
BOOMS = ("#1f8f4d", "#8a4fd0", "#c98a00", "#178d99", "#d0437a")
_WAY = 0.98  # share of its way after which a machine is all but at rest
LEAST = 1e-3  # share of a channel's peak below which it counts as off
_ARC = np.radians(np.linspace(25, 155, 24))  # of the arrow that stands for a torque


def film(strip: list[Axes], drawing: Drawing, measured: Trajectory) -> str:
    """Draws the spacecraft at a few instants, its bending exaggerated.

    Args:
        strip: Axes of the pictures, of one size.
        drawing: Shapes and motion.
        measured: The flight, for the thrust.

    Returns:
        What the pictures show, in words.
    """
    frames = _frames(drawing, measured, len(strip))
    view, lines = sketch.view_of(drawing), sketch.boom_lines(drawing)
    lines = {name: (bent[frames], straight[frames]) for name, (bent, straight) in lines.items()}
    factor = drawing.bending
    drawn = [_lines(lines, n, factor, view) for n in range(len(frames))]
    outlines = [_outlines(drawing, frame, view) for frame in frames]
    points = [p for parts in drawn for pair in parts for p in pair]
    points += [p for parts in outlines for p, *_ in parts]
    low = np.min([p.min(axis=0) for p in points], axis=0)
    high = np.max([p.max(axis=0) for p in points], axis=0)
    (x, y), reach = (low + high) / 2, (high - low) / 2
    # Every frame shows the same window, with equal scales.
    box = strip[0].get_window_extent()
    width = 1.06 * max(reach[0], reach[1] * box.width / box.height)
    height = width * box.height / box.width
    for axes, frame, booms, shapes in zip(strip, frames, drawn, outlines, strict=True):
        axes.set(xticks=[], yticks=[], facecolor=SHADE)
        axes.set(xlim=(x - width, x + width), ylim=(y - height, y + height))
        axes.spines[:].set_visible(False)
        for k, (bent, straight) in enumerate(booms):
            axes.plot(*straight.T, color=SOFT, linewidth=0.8, linestyle=(0, (4, 3)))
            axes.plot(*bent.T, color=BOOMS[k % len(BOOMS)], linewidth=2.4)
        for points, color, depth in shapes:
            style = {"facecolor": color, "edgecolor": INK, "linewidth": 0.7}
            axes.add_patch(Polygon(points, zorder=3 + depth, **style))
        thrust = _arrows(axes, drawing, measured, frame, view, 0.28 * max(reach))
        when = f"t = {drawing.time[frame]:.1f} s"
        axes.set_title(when, loc="left", y=1.0, size=10, weight="bold", pad=4)
        axes.set_title(thrust, loc="right", y=1.0, size=9, color=SOFT, pad=4)
    size = f"drawn × {factor:g}" if factor > 1 else "to scale"
    bending = f"; bending {size}, dashed: unbent" if lines else ""
    if drawing.turned > 1:
        bending = f"; sprung joints turned × {drawing.turned:g}"
    arrows = "; arrows: thrust on the craft" if drawing.jets else ""
    return f"{view.words[0].upper()}{view.words[1:]}{bending}{arrows}"


def _frames(drawing: Drawing, measured: Trajectory, count: int) -> list[int]:
    """Until a spacecraft has settled, evenly; of other machines, after equal shares of the way."""
    if is_quasi_rigid(measured):
        instants = np.linspace(drawing.time[0], spans.settled(measured), count - 1)
        found = [int(np.argmin(np.abs(drawing.time - t))) for t in instants]
    else:
        steps = [np.linalg.norm(np.diff(q, axis=0), axis=1) for q in drawing.quaternions.values()]
        way = np.r_[0.0, np.cumsum(np.sum(steps, axis=0))]
        shares = np.linspace(0, _WAY, count - 1) * way[-1]
        found = np.searchsorted(way, shares).tolist()
    return [*found, len(drawing.time) - 1]


def _lines(
    lines: dict[str, tuple[Array, Array]], frame: int, factor: float, view: View
) -> list[tuple[Array, Array]]:
    """Each boom in one picture, bent too far and unbent."""
    return [
        (view.project(straight[frame] + factor * (bent - straight)[frame]),
         view.project(straight[frame]))
        for bent, straight in lines.values()
    ]  # fmt: skip


def _outlines(drawing: Drawing, frame: int, view: View) -> list[tuple[Array, Array, float]]:
    """What is seen of each shape: outline, colour and nearness, from 0 to 1."""
    centre, found = next(iter(drawing.positions.values()))[frame], []
    for shape in sketch.solid_shapes(drawing):
        place, turn = drawing.positions[shape.body][frame], drawing.quaternions[shape.body][frame]
        points = place + turned(turn, sketch.surface(shape)) - centre
        flat, depth = view.project(points), points @ view.near
        # Of shapes about one centre the longer is behind: a strut runs through a hull.
        near = float(depth.mean() - 1e-3 * np.ptp(points, axis=0).max())
        if shape.kind != "box":
            found.append((flat[sketch.outline(flat)], shape.rgba[:3], near))
            continue
        for corners in map(list, sketch.BOX_FACES):
            a, b, c, _ = points[corners]
            normal = np.cross(b - a, c - a)
            towards = float(normal @ view.near / max(np.linalg.norm(normal), 1e-12))
            if towards > 1e-6:
                found.append((flat[corners], shape.rgba[:3] * (0.65 + 0.35 * towards), near))
    furthest = max((abs(near) for *_, near in found), default=0.0) or 1.0
    return [(points, color, near / furthest) for points, color, near in found]


def _arrows(
    axes: Axes, drawing: Drawing, measured: Trajectory, frame: int, view: View, size: float
) -> str:
    """Draws the thrust as arrows, an arc for a torque; returns its figures."""
    row = int(np.searchsorted(measured.time, drawing.time[frame], side="right")) - 1
    units = channel_units(measured)
    peaks = {channel: float(np.abs(measured[channel]).max()) for channel in units}
    now = {channel: float(measured[channel][row]) for channel in units}
    now = {channel: level for channel, level in now.items() if abs(level) > LEAST * peaks[channel]}
    for jet in drawing.jets:
        level = now.get(jet.channel, 0.0)
        share = 0.5 + 0.5 * abs(level) / (peaks[jet.channel] or 1.0)  # the smallest can be seen
        reach = math.copysign(size * share, level)
        line = _arrow(jet, drawing, frame, view, reach) if level else None
        if line is not None:
            style = {"color": PLUS if level > 0 else MINUS, "linewidth": 2, "zorder": 99}
            patch = FancyArrowPatch(path=Line(line), arrowstyle="-|>", mutation_scale=14, **style)
            axes.add_patch(patch)
    return _thrust(now, units)


def _thrust(now: dict[str, float], units: dict[str, str]) -> str:
    """What the channels do, in few words."""
    if not now:
        return "thrust off"
    if len(now) > 2:
        return f"{len(now)} of {len(units)} channels on"
    figures, kinds = [f"{level:+.3g}" for level in now.values()], {units[c] for c in now}
    if len(kinds) == 1:
        return f"{', '.join(figures)} {kinds.pop()}"
    return ", ".join(f"{x} {units[channel]}" for channel, x in zip(now, figures, strict=True))


def _arrow(jet: Jet, drawing: Drawing, frame: int, view: View, size: float) -> Array | None:
    """The line of an arrow in the picture, shape (n, 2); None if it points at the eye."""
    centre = next(iter(drawing.positions.values()))[frame]
    turn = drawing.quaternions[jet.body][frame]
    place = drawing.positions[jet.body][frame] + turned(turn, jet.position) - centre
    if np.any(jet.force):
        force = turned(turn, jet.force / np.linalg.norm(jet.force))
        line = view.project(np.stack([place, place + size * force]))
        return line if np.ptp(line, axis=0).max() > 0.1 * abs(size) else None
    axis = turned(turn, jet.torque / np.linalg.norm(jet.torque)) * np.sign(size)
    side = view.right - (view.right @ axis) * axis
    if np.linalg.norm(side) < 0.3:
        side = view.up - (view.up @ axis) * axis
    side = side / np.linalg.norm(side)
    if axis @ view.near < 0:  # above the craft, whichever way it turns
        side = -side
    circle = np.outer(np.cos(_ARC), side) + np.outer(np.sin(_ARC), np.cross(axis, side))
    return view.project(place + abs(size) * circle)
