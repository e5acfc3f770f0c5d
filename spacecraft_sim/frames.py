"""What is drawn of a flight at its instants: poses of bodies, booms bent more than they are.

The full plant knows where each body is.  The reduced model knows attitude and boom tips alone: its
ghost has the bus in that attitude, at the place of the other plant's bus, and each boom in the
shape of the first cantilever mode through its tip, which is exact for the Galerkin model of one
mode.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from spacecraft_sim import beam
from spacecraft_sim.drawing import Drawing, boom_points, cross, draw, turned
from spacecraft_sim.mjcf import BUS
from spacecraft_sim.spacecraft import Spacecraft
from spacecraft_sim.trajectory import Trajectory, selected

Array = np.ndarray

SPACING = 0.1  # least time between two frames, s
FACTORS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0)
POINTS = 9  # of the ghost's booms


@dataclass(frozen=True, slots=True, kw_only=True)
class Frames:
    """Where things are drawn at some instants.

    Attributes:
        time: Instants, shape (n,), s.
        positions: Body origins by body name, each of shape (n, 3), m.
        quaternions: Body orientations (w, x, y, z) by body name, each of shape (n, 4).
        booms: Points of each boom from root to tip, by boom name, each of shape (n, k, 3), m.
    """

    time: Array
    positions: dict[str, Array]
    quaternions: dict[str, Array]
    booms: dict[str, Array]


def at_rest(model, machine: Spacecraft) -> Drawing:
    """Returns the drawing of a machine in its reference configuration, one frame.

    Args:
        model: The compiled spacecraft.
        machine: The machine.
    """
    signals = {f"q{k}": np.array([value]) for k, value in enumerate(model.qpos0)}
    return draw(model, machine, Trajectory(time=np.zeros(1), signals=signals, units={}))


def thinned(part: Trajectory) -> Trajectory:
    """Returns the rows that become frames: first and last, and one a `SPACING` between.

    Args:
        part: A part of a flight.
    """
    place = np.floor(part.time / SPACING + 1e-6)
    rows = np.flatnonzero(np.r_[True, np.diff(place) > 0])
    return selected(part, np.union1d(rows, [len(part.time) - 1]))


def simulated(model, machine: Spacecraft, part: Trajectory, factor: float) -> Frames:
    """Draws a part of a flight of the full plant.

    Args:
        model: The compiled spacecraft.
        machine: The machine.
        part: The part.
        factor: How many times too far the booms are bent.
    """
    part = thinned(part)
    drawing = draw(model, machine, part, frames=len(part.time))
    booms = {}
    for boom in drawing.booms:
        points, straight = boom_points(drawing, boom)
        booms[boom] = straight + factor * (points - straight)
    return Frames(
        time=drawing.time,
        positions=drawing.positions,
        quaternions=drawing.quaternions,
        booms=booms,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Ghost:
    """How the reduced model is drawn beside the full plant.

    Attributes:
        turn: Orientation (w, x, y, z) of the bus at attitude zero.
        roots: Root frame of each boom in the bus frame: position, m, and quaternion.
        lengths: Length of each boom, m.
        factor: How many times too far the booms are bent.
    """

    turn: Array
    roots: Mapping[str, tuple[Array, Array]]
    lengths: Mapping[str, float]
    factor: float

    def frames(self, part: Trajectory, beside: Frames) -> Frames:
        """Draws a part of a flight of the reduced model.

        Args:
            part: The part, at least one row.
            beside: The same part of the other plant's flight, whose bus lends its place.
        """
        part = thinned(part)
        turn = product(self.turn, rotation(attitude(part)))
        place = interpolated(part.time, beside.time, beside.positions[BUS])
        booms = {}
        for boom, (position, quaternion) in self.roots.items():
            names = [f"{boom}_tip_{axis}" for axis in "yz"]
            if not all(name in part.signals for name in names):
                continue
            x = np.linspace(0.0, self.lengths[boom], POINTS)
            shape = beam.mode_shape(1, x, self.lengths[boom])
            line = np.zeros((len(part.time), POINTS, 3))
            line[:, :, 0] = x
            for axis, name in enumerate(names, start=1):
                line[:, :, axis] = self.factor * np.outer(part[name], shape / shape[-1])
            inside = position + turned(quaternion, line)
            booms[boom] = place[:, None] + turned(turn[:, None], inside)
        return Frames(
            time=part.time,
            positions={BUS: place},
            quaternions={BUS: turn},
            booms=booms,
        )


def ghost(
    machine: Spacecraft, rest: Drawing, start: Frames, part: Trajectory, factor: float
) -> Ghost:
    """Returns how to draw the reduced model of a machine.

    Args:
        machine: The machine.
        rest: The machine in its reference configuration.
        start: First frames of the full plant.
        part: The rows of its flight that they were drawn from.
        factor: How many times too far the booms are bent.
    """
    inverse = rest.quaternions[BUS][0] * (1, -1, -1, -1)
    roots = {}
    for boom, (root, *_) in rest.booms.items():
        arm = rest.positions[root][0] - rest.positions[BUS][0]
        roots[boom] = turned(inverse, arm), product(inverse, rest.quaternions[root][0])
    # Whether a sensor counts from the reference configuration or from the world: take it back.
    turn = product(start.quaternions[BUS][0], rotation(-attitude(part)[0]))
    lengths = {boom.name: boom.length for boom in machine.booms}
    return Ghost(turn=turn, roots=roots, lengths=lengths, factor=factor)


def suited_factor(flight: Trajectory, lengths: Mapping[str, float]) -> float:
    """Returns a round factor that brings the largest tip deflection to a quarter of its boom.

    Args:
        flight: A flight with the tips of its booms.
        lengths: Length of each boom, m.
    """
    if not lengths:
        return 1.0
    largest = 1e-4
    for boom, length in lengths.items():
        for axis in "yz":
            tip = flight.signals.get(f"{boom}_tip_{axis}", np.zeros(1))
            largest = max(largest, float(np.abs(tip).max()) / length)
    return max(f for f in FACTORS if f == 1 or f < 0.3 / largest)


def attitude(part: Trajectory) -> Array:
    """Returns the attitude as rotation vectors, shape (n, 3), rad; zero about axes not recorded.

    Args:
        part: A part of a flight.
    """
    still = np.zeros(len(part.time))
    return np.stack([part.signals.get(f"attitude_{axis}", still) for axis in "xyz"], axis=-1)


def rotation(vector: Array) -> Array:
    """Returns the quaternions (w, x, y, z) of rotation vectors.

    Args:
        vector: Shape (..., 3), rad.
    """
    half = np.linalg.norm(vector, axis=-1, keepdims=True) / 2
    return np.concatenate([np.cos(half), vector * np.sinc(half / np.pi) / 2], axis=-1)


def product(p: Array, q: Array) -> Array:
    """Returns the quaternions that turn by q first and then by p, whatever shapes broadcast.

    Args:
        p: (w, x, y, z), shape (..., 4).
        q: The same.
    """
    w, v = p[..., :1], p[..., 1:]
    s, u = q[..., :1], q[..., 1:]
    scalar = w * s - np.sum(v * u, axis=-1, keepdims=True)
    return np.concatenate([scalar, s * v + w * u + cross(v, u)], axis=-1)


def interpolated(time: Array, known: Array, values: Array) -> Array:
    """Returns values between known instants, column by column.

    Args:
        time: Instants wanted, shape (m,), s.
        known: Known instants, ascending, shape (n,), s.
        values: Values there, shape (n, k).
    """
    return np.stack([np.interp(time, known, column) for column in values.T], axis=1)
