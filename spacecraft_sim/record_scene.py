"""The spacecraft in 3D: solids, bending booms, a ghost, plumes that light when a thruster fires."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from spacecraft_sim.changes import Changes, Channel
from spacecraft_sim.drawing import Drawing, Shape, boom_points, turned
from spacecraft_sim.frames import Frames
from spacecraft_sim.record_stream import Stream, rr
from spacecraft_sim.sketch import exhausts, surface

Array = np.ndarray
Color = tuple[int, int, int]

TIMELINE = "sim_time"
TUBE = 0.06  # drawn radius of a boom, m
FAINT, GREY = (52, 57, 70), (120, 126, 140)
BOOMS: tuple[tuple[Color, Color], ...] = (  # of a boom and of its ghost
    ((98, 205, 132), (46, 96, 62)),
    ((199, 125, 255), (93, 58, 120)),
    ((255, 200, 87), (120, 94, 41)),
    ((90, 205, 215), (42, 96, 101)),
)
RULERS = (0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0)  # m
GHOST = 60  # opacity of a ghost's solids, of 255


def setting(stream: Stream, rest: Drawing) -> None:
    """Logs what never moves: the directions of the booms in the reference configuration.

    Args:
        stream: The recording.
        rest: The machine in its reference configuration.
    """
    stream.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    straight = [boom_points(rest, boom)[1][0][[0, -1]] for boom in rest.booms]
    if straight:
        look = {"colors": FAINT, "radii": -1.0}  # negative: in points of the screen
        stream.log("world/attitude_zero", rr.LineStrips3D(straight, **look), static=True)


def ruler(stream: Stream, rest: Drawing, middle: Array, radius: float, upright: bool) -> None:
    """Logs a ruler of a round length: beside the machine, or beneath one that stands upright.

    Args:
        stream: The recording.
        rest: The machine in its reference configuration.
        middle: Middle of the ball that holds it, shape (3,), m.
        radius: Radius of that ball, m.
        upright: Whether it is seen from the side.
    """
    length = max(m for m in RULERS if m <= radius or m == RULERS[0])
    wide = max((np.max(np.abs(s.position)) + np.max(s.size) for s in rest.shapes), default=0.0)
    aside = min(0.55 * radius + 0.3 * wide, 1.1 * radius)
    away = np.array([0.0, 0.0, -1.12 * radius] if upright else [0.0, -aside, 0.0])
    ends = [middle + away + (x, 0.0, 0.0) for x in (-length / 2, length / 2)]
    line = rr.LineStrips3D([ends], labels=[f"{length:g} m"], colors=GREY, radii=-1.0)
    stream.log("world/ruler", line, static=True)


def solids(stream: Stream, root: str, rest: Drawing, bodies: Sequence[str], ghost: bool) -> None:
    """Logs shapes once, in the frames of their bodies, and the lines of the unbent booms.

    Args:
        stream: The recording.
        root: Path of the flight's scene.
        rest: The machine in its reference configuration.
        bodies: The bodies that are drawn as solids; the first carries the booms.
        ghost: Whether they are translucent.
    """
    shapes = [shape for shape in rest.shapes if shape.body in bodies]
    for body, kind in sorted({(shape.body, shape.kind) for shape in shapes}):
        alike = [s for s in shapes if (s.body, s.kind) == (body, kind)]
        stream.log(f"{root}/{body}/{kind}", _solid(kind, alike, ghost), static=True)
    colors = [BOOMS[k % len(BOOMS)][ghost] for k, _ in enumerate(rest.booms)]
    look = rr.LineStrips3D.from_fields(colors=colors, radii=TUBE * (0.7 if ghost else 1.0))
    stream.log(f"{root}/booms", look, static=True)
    balls = [s for s in rest.shapes if s.body in {f"{boom}_tip_mass" for boom in rest.booms}]
    if balls:
        look = rr.Points3D.from_fields(
            colors=[_rgba(s, ghost) for s in balls], radii=[s.size[0] for s in balls]
        )
        stream.log(f"{root}/tip_masses", look, static=True)
    if rest.booms and not ghost:
        carrier = bodies[0]
        place, inverse = rest.positions[carrier][0], rest.quaternions[carrier][0] * (1, -1, -1, -1)
        lines = [boom_points(rest, boom)[1][0][[0, -1]] - place for boom in rest.booms]
        unbent = rr.LineStrips3D([turned(inverse, x) for x in lines], colors=GREY, radii=-0.8)
        stream.log(f"{root}/{carrier}/unbent", unbent, static=True)


def motion(stream: Stream, root: str, frames: Frames, rest: Drawing, bodies: Sequence[str]) -> None:
    """Logs the poses of bodies and the bent booms.

    Args:
        stream: The recording.
        root: Path of the flight's scene.
        frames: The instants.
        rest: The machine in its reference configuration.
        bodies: The bodies that are drawn.
    """
    times = [rr.TimeColumn(TIMELINE, duration=frames.time)]
    for body in bodies:
        pose = rr.Transform3D.columns(
            translation=frames.positions[body],
            quaternion=np.roll(frames.quaternions[body], -1, axis=1),  # (w, ...) -> (..., w)
        )
        stream.send_columns(f"{root}/{body}", times, pose)
    if not frames.booms:
        return
    lines, count = _together(list(frames.booms.values())), len(frames.booms)
    strips = rr.LineStrips3D.columns(strips=lines).partition(np.full(len(frames.time), count))
    stream.send_columns(f"{root}/booms", times, strips)
    heavy = {s.body.removesuffix("_tip_mass") for s in rest.shapes if s.body.endswith("_tip_mass")}
    if ends := [points[:, -1] for boom, points in frames.booms.items() if boom in heavy]:
        at = np.stack(ends, axis=1).reshape(-1, 3)
        counts = np.full(len(frames.time), len(ends))
        places = rr.Points3D.columns(positions=at).partition(counts)
        stream.send_columns(f"{root}/tip_masses", times, places)


def _together(booms: list[Array]) -> Array:
    """Lines of all booms, frame by frame, shape (n frames * n booms, n points, 3)."""
    longest = max(points.shape[1] for points in booms)
    padded = [np.pad(p, ((0, 0), (0, longest - p.shape[1]), (0, 0)), mode="edge") for p in booms]
    return np.stack(padded, axis=1).reshape(-1, longest, 3).astype(np.float32)


def extent(rest: Drawing) -> float:
    """Returns the distance of the farthest thing that is drawn from the first body, m.

    Args:
        rest: The machine in its reference configuration.
    """
    centre = next(iter(rest.positions.values()))[0]
    return float(np.linalg.norm(_points(rest) - centre, axis=1).max(initial=0.01))


def ball(rest: Drawing, shown: Sequence[Frames]) -> tuple[Array, float]:
    """Returns middle, shape (3,), and radius of a ball that holds a machine in some frames, m.

    Args:
        rest: The machine in its reference configuration, for its shapes.
        shown: The frames; without any, the ball is about the first body.
    """
    found = [
        (turned(f.quaternions[s.body][:, None], surface(s)) + f.positions[s.body][:, None])
        for f in shown
        for s in rest.shapes
        if s.body in f.positions
    ]
    if not found:
        return next(iter(rest.positions.values()))[0], extent(rest)
    points = np.vstack([x.reshape(-1, 3) for x in found])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    return middle, float(np.linalg.norm(points - middle, axis=1).max())


def _points(rest: Drawing) -> Array:
    """Points whose hull is the machine, tips of booms among them, shape (n, 3)."""
    tips = [boom_points(rest, boom)[0][0, -1:] for boom in rest.booms]
    shapes = [
        rest.positions[s.body][0] + turned(rest.quaternions[s.body][0], surface(s))
        for s in rest.shapes
    ]
    return np.vstack([np.zeros((0, 3)), *tips, *shapes])


class Nozzle(NamedTuple):
    """Where the plume of a jet is logged.

    Attributes:
        path: Path of the plume.
        through: How far it is through the hull to where exhaust leaves at a negative thrust, m.
    """

    path: str
    through: float


def nozzles(stream: Stream, root: str, rest: Drawing) -> dict[str, list[Nozzle]]:
    """Logs the exhaust of every jet, still out, and returns the plumes of each channel.

    Args:
        stream: The recording.
        root: Path of the flight's scene.
        rest: The machine in its reference configuration.
    """
    found: dict[str, list[Nozzle]] = {}
    for k, jet in enumerate(rest.jets):
        ways = (exhausts(jet, rest.shapes, level) for level in (1.0, -1.0))
        for n, ((point, away), (opposite, _)) in enumerate(zip(*ways, strict=True)):
            path = f"{root}/{jet.body}/jets/{jet.channel}_{k}_{n}"
            side = np.cross(away, np.eye(3)[np.argmin(np.abs(away))])
            side /= np.linalg.norm(side)
            frame = np.stack([side, np.cross(away, side), away], axis=1)
            stream.log(path, rr.Transform3D(translation=point, mat3x3=frame), static=True)
            stream.log(f"{path}/plume", _cone(), static=True)
            nozzle = Nozzle(f"{path}/plume", float(np.linalg.norm(point - opposite)))
            found.setdefault(jet.channel, []).append(nozzle)
    return found


def plumes(
    stream: Stream,
    found: Mapping[str, Sequence[Nozzle]],
    happened: Sequence[Changes],
    size: float,
    every: float,
) -> None:
    """Logs the plumes at the instants at which a thrust changes: longer at a higher level.

    Args:
        stream: The recording.
        found: The plumes of each channel.
        happened: The changes of commands and thrusts.
        size: Length of the longest plume, m.
        every: Time between two rows of a thrust that changes all the time, s.
    """
    for change in happened:
        if change.what == "command" or not len(change.time):
            continue
        rows = np.ones(len(change.time), dtype=bool)
        if change.channel.thruster.proportional:
            rows[1:] = np.diff(np.floor(change.time / every + 1e-6)) > 0
            rows[-1] = True
        length = size * throttle(change.value[rows], change.channel)
        length[length == 0] = 1e-6  # a transform must have an inverse
        scale = np.stack([abs(length), abs(length), length], axis=1)
        times = [rr.TimeColumn(TIMELINE, duration=change.time[rows])]
        for path, through in found.get(change.channel.name, ()):
            start = np.outer(length < 0, [0.0, 0.0, -through]) if through > 0 else None
            pose = rr.Transform3D.columns(scale=scale, translation=start)
            stream.send_columns(path, times, pose)


def throttle(thrust: Array, channel: Channel) -> Array:
    """Returns the signed size from 0 to 1 of a thrust; on a log scale where levels span decades.

    Args:
        thrust: The thrust, shape (n,), N or N m.
        channel: Its channel.
    """
    least, most = min(channel.thruster.levels), max(channel.thruster.levels)
    if channel.thruster.proportional:
        return np.clip(thrust / channel.largest, -1, 1)
    if most == least:
        return thrust / most
    share = np.log(np.maximum(np.abs(thrust), least) / least) / np.log(most / least)
    return np.sign(thrust) * (0.5 + 0.5 * share)


def _solid(kind: str, shapes: Sequence[Shape], ghost: bool) -> rr.AsComponents:
    size = np.array([shape.size for shape in shapes])
    centre = np.array([shape.position for shape in shapes])
    turn = np.array([shape.quaternion for shape in shapes])
    radius, length = size[:, 0], 2 * size[:, 1]
    look = {
        "quaternions": np.roll(turn, -1, axis=1),  # (w, x, y, z) -> (x, y, z, w)
        "colors": np.array([_rgba(shape, ghost) for shape in shapes], np.uint8),
        "fill_mode": "solid",
    }
    if kind in ("capsule", "sphere"):  # a sphere is a capsule of no length
        # A capsule starts at its origin here; MuJoCo's origin is its middle.
        start = centre - size[:, 1:2] * turned(turn, np.array([0.0, 0.0, 1.0]))
        return rr.Capsules3D(radii=radius, lengths=length, translations=start, **look)
    if kind == "cylinder":
        return rr.Cylinders3D(radii=radius, lengths=length, centers=centre, **look)
    if kind == "box":
        return rr.Boxes3D(half_sizes=size, centers=centre, **look)
    return rr.Ellipsoids3D(half_sizes=size, centers=centre, **look)


def _rgba(shape: Shape, ghost: bool) -> list[int]:
    red, green, blue, alpha = (round(255 * x) for x in shape.rgba)
    return [red, green, blue, GHOST if ghost else alpha]


def _cone(sides: int = 16) -> rr.Mesh3D:
    """A plume of unit length along z, bright at the nozzle and fading."""
    angle = 2 * np.pi * np.arange(sides) / sides
    circle = np.stack([0.13 * np.cos(angle), 0.13 * np.sin(angle), np.ones(sides)], axis=1)
    rim = 1 + np.arange(sides)
    return rr.Mesh3D(
        vertex_positions=np.vstack([np.zeros(3), circle]),
        triangle_indices=np.stack([np.zeros(sides, int), rim, np.roll(rim, -1)], axis=1),
        vertex_colors=np.array([(255, 226, 130, 255)] + sides * [(255, 96, 20, 40)], np.uint8),
    )
