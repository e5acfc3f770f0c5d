"""What a recording is about, and the flight that lies beneath the other in it, drawn as a ghost."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from spacecraft_sim.changes import Channel
from spacecraft_sim.chart import Charts
from spacecraft_sim.drawing import Drawing, sprung_joints
from spacecraft_sim.frames import (
    Frames,
    at_rest,
    bus_alone,
    drawn_bodies,
    orientation,
    posed,
    read_joints,
    suited_factor,
)
from spacecraft_sim.mjcf import BUS
from spacecraft_sim.spacecraft import Spacecraft
from spacecraft_sim.trajectory import Trajectory, channel_units


@dataclass(frozen=True, slots=True, kw_only=True)
class Subject:
    """What a recording is about.

    Attributes:
        title: Name of the recording.
        scenario: The scenario, as TOML.
        model: The compiled spacecraft.
        machine: The spacecraft.
        bands: Half-widths that signals are to keep to about zero, by signal, rad.
        charts: What the law draws beside its theorem.
    """

    title: str
    scenario: str
    model: Any
    machine: Spacecraft
    bands: Mapping[str, float] = field(default_factory=dict)
    charts: Charts = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Beneath:
    """The flight that lies beneath the other, drawn as a ghost.

    Attributes:
        flight: The flight.
        known: Flights that are known beforehand: this one, and the other one if it is over.
        key: Its name in paths; in alphabetical order before that of the other.
        name: Its name in keys.
        over_key: Name of the other flight in paths.
        over_name: Name of the other flight in keys.
        rest: Its machine in the reference configuration.
        bodies: The bodies that are drawn; the first carries the booms.
        frames: Draws a part of it, given its rows, the frames and the rows of the other flight.
        factor: How many times too far all booms are bent.
        channels: Channels that get lanes of their own.
        charts: What its law draws.
        notes: What is to be said of the recording.
    """

    flight: Trajectory
    known: Sequence[Trajectory]
    key: str
    name: str
    over_key: str
    over_name: str
    rest: Drawing
    bodies: Sequence[str]
    frames: Callable[[Trajectory, Frames, Trajectory], Frames]
    factor: float
    channels: Sequence[Channel] = ()
    charts: Charts = ()
    notes: tuple[str, ...] = ()


def reduced(subject: Subject, flight: Trajectory, factor: float | None = None) -> Beneath:
    """Returns the flight of the reduced plant as the one that lies beneath.

    Args:
        subject: What the recording is about.
        flight: The flight.
        factor: How many times too far booms are bent; a round factor that shows it if left out.
    """
    machine, rest = subject.machine, at_rest(subject.model, subject.machine)
    if factor is None:
        factor = suited_factor(subject.model, machine, flight)
    bodies, joints = [], read_joints(subject.model, flight)
    if joints:
        bodies = drawn_bodies(rest)
        words = "Translucent: the reduced plant, whose readings are the joints of the machine."
    elif BUS in rest.positions and orientation(flight):
        bodies = [BUS]
        words = (
            "Translucent: the reduced plant. It knows the attitude; its bus stands at the place of "
            "the MuJoCo bus."
        )
        if machine.booms:
            words += " Its booms have the shape of the first cantilever mode through their tips."
    else:
        words = "The reduced plant has no readings that place its bodies: it is not drawn."

    def frames(part: Trajectory, beside: Frames, over: Trajectory) -> Frames:
        if joints:
            return posed(subject.model, machine, part, joints, factor)
        if bodies:
            return bus_alone(machine, rest, part, beside, over, factor)
        return Frames(time=part.time, positions={}, quaternions={}, booms={})

    return Beneath(
        flight=flight,
        known=(flight,),
        key="reduced",
        name="reduced",
        over_key="simulated",
        over_name="MuJoCo",
        rest=rest,
        bodies=bodies,
        frames=frames,
        factor=factor,
        charts=subject.charts,
        notes=tuple(note for note in (bent(subject.model, machine, factor), words) if note),
    )


def bent(model: Any, machine: Spacecraft, factor: float) -> str:
    """Returns what is to be said of how elastic parts are drawn.

    Args:
        model: The compiled spacecraft.
        machine: The machine.
        factor: How many times too far they are bent.
    """
    if machine.booms:
        return f"Booms are drawn bent {factor:g} times as far as they are."
    if sprung_joints(model, machine):
        return f"Sprung joints are drawn turned {factor:g} times as far as they are."
    return ""


def channels(flight: Trajectory, machine: Spacecraft, known: Sequence[Trajectory]) -> list[Channel]:
    """Returns the thruster channels of a flight.

    Args:
        flight: The flight, or a part of it.
        machine: The machine.
        known: Flights that say how large a thrust is to be expected.
    """
    units, found = channel_units(flight), []
    for thruster in machine.thrusters:
        if (name := thruster.name) in units:
            seen = [float(np.abs(f[name]).max()) for f in known if name in f.signals]
            largest = max(seen, default=0.0) or max(thruster.levels)
            found.append(Channel(thruster=thruster, unit=units[name], largest=largest))
    return found
