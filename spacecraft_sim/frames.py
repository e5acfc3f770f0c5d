"""What is drawn of a flight at its instants: poses of bodies, booms bent more than they are.

The full plant knows where each body is.  What the reduced plant knows decides how its ghost is
drawn: if it reads every joint, as an arm's equations of motion do, whole; otherwise the bus in its
attitude, at the place of the other plant's bus, and each boom in the shape of the first cantilever
mode through its tip, which is exact for the Galerkin model of one mode.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from spacecraft_sim import beam
from spacecraft_sim.drawing import (
    Drawing,
    boom_points,
    cross,
    draw,
    largest_turn,
    sprung_joints,
    turned,
)
from spacecraft_sim.mjcf import BUS
from spacecraft_sim.readings import undeformed_mass_matrix
from spacecraft_sim.spacecraft import Spacecraft
from spacecraft_sim.trajectory import Trajectory, selected

Array = np.ndarray

SPACING = 0.1  # time between two frames, s, of which a flight has some, and not too many
QUICKEST = 0.02  # closer ones no screen shows, s
FEWEST, MOST = 1000, 18_000
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


def drawn_bodies(rest: Drawing) -> list[str]:
    """Returns the bodies that are drawn as solids or carry jets: all but the links of booms.

    Args:
        rest: The machine in its reference configuration.
    """
    links = {body for bodies in rest.booms.values() for body in bodies}
    links |= {f"{boom}_tip_mass" for boom in rest.booms}
    carriers = {jet.body for jet in rest.jets}
    return [body for body in rest.positions if body not in links or body in carriers]


def spacing(flight: Trajectory) -> float:
    """Returns the time between two frames of a flight, s.

    Args:
        flight: The flight.
    """
    end = float(flight.time[-1])
    return min(max(SPACING, end / MOST), max(end / FEWEST, QUICKEST))


def thinned(part: Trajectory, every: float) -> Trajectory:
    """Returns the rows that become frames: the first, the last, and one at times between.

    Args:
        part: A part of a flight.
        every: Time between two frames, s.
    """
    place = np.floor(part.time / every + 1e-6)
    rows = np.flatnonzero(np.r_[True, np.diff(place) > 0])
    return selected(part, np.union1d(rows, [len(part.time) - 1]))


def simulated(model, machine: Spacecraft, part: Trajectory, factor: float) -> Frames:
    """Draws the rows of a flight of the full plant.

    Args:
        model: The compiled spacecraft.
        machine: The machine.
        part: The rows, with the machine's coordinates as their last signals.
        factor: How many times too far booms are bent, or sprung joints turned.
    """
    drawing = draw(model, machine, part, frames=len(part.time), factor=factor)
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


def read_joints(model, flight: Trajectory) -> list[str]:
    """Returns the readings that are the coordinates of a machine; none if any is not read.

    Args:
        model: The compiled spacecraft.
        flight: A flight.
    """
    names = [model.joint(j).name for j in range(model.njnt)]
    simple = model.nq == model.njnt  # hinges and slides alone
    return names if simple and all(name in flight.signals for name in names) else []


def posed(
    model, machine: Spacecraft, part: Trajectory, joints: Sequence[str], factor: float
) -> Frames:
    """Draws the rows of a flight whose readings are all coordinates of the machine.

    Args:
        model: The compiled spacecraft.
        machine: The machine.
        part: The rows.
        joints: The readings, as `read_joints` returns them.
        factor: How many times too far the booms are bent.
    """
    coordinates = {name: part[name] for name in joints}
    return simulated(model, machine, replace(part, signals=coordinates), factor)


def bus_alone(
    machine: Spacecraft,
    rest: Drawing,
    part: Trajectory,
    beside: Frames,
    over: Trajectory,
    factor: float,
) -> Frames:
    """Draws the rows of a flight from the attitude of the bus and the tips of the booms.

    Args:
        machine: The machine.
        rest: The machine in its reference configuration.
        part: The rows, at least one.
        beside: The same part of the other plant's flight, whose bus lends its place.
        over: The rows that it was drawn from.
        factor: How many times too far the booms are bent.
    """
    # Whether a sensor counts from the world or the reference configuration, from the body or its
    # principal axes: the other plant's first frame says.
    read, first = orientation(part), orientation(selected(over, slice(1)))
    if "attitude" in read:
        back = product(beside.quaternions[BUS][:1], inverse(first["attitude"]))
        turn = product(back, read["attitude"])
    else:
        forth = product(inverse(first["directions"]), beside.quaternions[BUS][:1])
        turn = product(read["directions"], forth)
    place = interpolated(part.time, beside.time, beside.positions[BUS])
    back, booms = inverse(rest.quaternions[BUS][0]), {}
    for boom in machine.booms:
        tips = [f"{boom.name}_tip_{axis}" for axis in "yz"]
        if not all(name in part.signals for name in tips):
            continue
        x = np.linspace(0.0, boom.length, POINTS)
        shape = beam.mode_shape(1, x, boom.length)
        line = np.zeros((len(part.time), POINTS, 3))
        line[:, :, 0] = x
        for axis, name in enumerate(tips, start=1):
            line[:, :, axis] = factor * np.outer(part[name], shape / shape[-1])
        root = rest.booms[boom.name][0]
        arm = turned(back, rest.positions[root][0] - rest.positions[BUS][0])
        inside = arm + turned(product(back, rest.quaternions[root][0]), line)
        booms[boom.name] = place[:, None] + turned(turn[:, None], inside)
    return Frames(time=part.time, positions={BUS: place}, quaternions={BUS: turn}, booms=booms)


def suited_factor(model, machine: Spacecraft, flight: Trajectory) -> float:
    """Returns a round factor that brings the largest bending to a quarter of a boom or a radian.

    Args:
        model: The compiled spacecraft.
        machine: The machine.
        flight: A flight of either plant; what is made of a run takes that of the reduced one, which
            is known when the recording begins.
    """
    if joints := sprung_joints(model, machine):
        largest = max(1e-4, _largest_turn(model, joints, flight))
    elif machine.booms:
        largest = 1e-4
        for boom in machine.booms:
            for axis in "yz":
                tip = flight.signals.get(f"{boom.name}_tip_{axis}", np.zeros(1))
                largest = max(largest, float(np.abs(tip).max()) / boom.length)
    else:
        return 1.0
    return max(f for f in FACTORS if f == 1 or f < 0.3 / largest)


def _largest_turn(model, joints: list[int], flight: Trajectory) -> float:
    """Recorded, or what one joint alone needs to lean the bus off the quasi-rigid angle so far."""
    if any(name.startswith(f"{model.joint(joints[0]).name}.") for name in flight.signals):
        return largest_turn(model, joints, flight)
    M = undeformed_mass_matrix(model)
    lean_of = np.abs(np.linalg.solve(M[:6, :6], M[:6, 6:])).max(axis=1)[3:]
    turns = [0.0]
    for axis, most in zip("xyz", lean_of, strict=True):
        names = f"attitude_{axis}", f"quasi_rigid_angle_{axis}"
        if all(name in flight.signals for name in names) and most > 0:
            turns.append(float(np.abs(flight[names[0]] - flight[names[1]]).max()) / most)
    return max(turns)


def orientation(part: Trajectory) -> dict[str, Array]:
    """Returns what the readings say of the orientation of the bus, as quaternions (w, x, y, z).

    Args:
        part: A part of a flight.

    Returns:
        `attitude`, from angles about axes (none recorded: zero), and `directions`, from fixed
        directions in the body; each of shape (n, 4), and only if there are such readings.
    """
    found, still = {}, np.zeros(len(part.time))
    if any(f"attitude_{axis}" in part.signals for axis in "xyz"):
        vector = [part.signals.get(f"attitude_{axis}", still) for axis in "xyz"]
        found["attitude"] = rotation(np.stack(vector, axis=-1))
    names = [[f"s{row}_{axis}" for axis in "xyz"] for row in (1, 2, 3)]
    if all(name in part.signals for row in names for name in row):
        matrix = np.array([[part[name] for name in row] for row in names])
        found["directions"] = of_matrix(np.moveaxis(matrix, -1, 0))
    return found


def of_matrix(matrix: Array) -> Array:
    """Returns the quaternions (w, x, y, z) of rotation matrices.

    Args:
        matrix: Shape (n, 3, 3).
    """
    # 4 q q^T from the matrix; its column with the largest diagonal is q but for its size.
    products = np.zeros((len(matrix), 4, 4))
    diagonal = matrix[:, range(3), range(3)]
    products[:, 0, 0] = 1 + diagonal.sum(axis=1)
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1)), start=1):
        products[:, i, i] = 1 + 2 * diagonal[:, i - 1] - diagonal.sum(axis=1)
        products[:, 0, i] = products[:, i, 0] = matrix[:, k, j] - matrix[:, j, k]
        products[:, j + 1, k + 1] = products[:, k + 1, j + 1] = matrix[:, k, j] + matrix[:, j, k]
    best = np.argmax(products[:, range(4), range(4)], axis=1)
    found = products[range(len(matrix)), best]
    return found / np.linalg.norm(found, axis=1, keepdims=True)


def inverse(q: Array) -> Array:
    """Returns the quaternions (w, x, y, z) that turn back.

    Args:
        q: Shape (..., 4), of unit length.
    """
    return q * (1, -1, -1, -1)


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
