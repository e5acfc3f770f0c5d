"""What is certified: a shipped machine with its thrusters, or any MJCF file with given numbers."""

# pyright: reportAttributeAccessIssue=false
# (MuJoCo is a compiled module without type stubs)

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spacecraft_sim import library, linearize, mjcf, spacecraft
from spacecraft_sim.elastic_mjcf import faults
from spacecraft_sim.relay_channels import AXES, per_channel
from spacecraft_sim.spacecraft import Spacecraft

Array = np.ndarray

_PURE = 1e-9  # share of a channel's torque that may be a net force, N for 1 m, or about other axes


@dataclass(frozen=True, slots=True, kw_only=True)
class Craft:
    """A compiled machine and its three relay channels.

    Attributes:
        name: Its name.
        title: One line about it.
        model: The compiled model.
        torque: M0 of each channel, shape (3,), N m.
        dwell: Least time between switchings of each, shape (3,), s.
        delay: Longest delay of each, shape (3,), s.
    """

    name: str
    title: str
    model: Any
    torque: Array
    dwell: Array
    delay: Array


def read(
    name: str,
    *,
    torque: list[float] | None = None,
    dwell: list[float] | None = None,
    delay: list[float] | None = None,
) -> Craft:
    """Reads a machine.

    Args:
        name: A shipped spacecraft, the path of its TOML file, or of an MJCF file.
        torque: M0 of each channel, or one for all, N m; of a spacecraft its highest level times the
            arm of its motors if left out.
        dwell: Least time between switchings, s; of a spacecraft the minimum on-time if left out.
        delay: Longest delay of the thrust, s; if left out that of a spacecraft's thrusters, or 0 of
            a file, or where torque and dwell are given and the thrusters do not count.

    Raises:
        ValueError: If there is no such machine, it is not a free bus with elastic parts, a number
            is missing or out of range, or thrusters are no pure torques about x, y and z.
    """
    given = {
        "torque": _given("torque", torque),
        "dwell": _given("dwell", dwell),
        "delay": _given("delay", delay, zero=True),
    }
    if name.endswith(".xml"):
        path = Path(name)
        model, title, own = mjcf.read(path), f"MJCF file {path.name}", {"delay": np.zeros(3)}
        name = path.stem
    else:
        machine = _machine(name)
        model, title, name = mjcf.assemble(machine).compile(), machine.title, machine.name
        if found := faults(model):
            raise ValueError(
                f"{name} is not a free bus with elastic parts: {'; '.join(found)}. "
                f"Shipped machines that are: {_certifiable()}"
            )
        whole = torque is not None and dwell is not None
        own = {"delay": np.zeros(3)} if whole else _of_thrusters(machine, model)
    numbers = {key: own.get(key) if value is None else value for key, value in given.items()}
    missing = [f"--{key}" for key, value in numbers.items() if value is None]
    if missing:
        raise ValueError(
            f"{name} does not say what {' and '.join(missing)} of its channels are: give one "
            "number for all or three, for x, y and z"
        )
    return Craft(name=name, title=title, model=model, **numbers)  # pyright: ignore


def steady(disturbance: list[float] | None) -> Array:
    """Returns the constant disturbance about each axis, shape (3,), N m.

    Args:
        disturbance: One number for all axes or three; none if left out.

    Raises:
        ValueError: If it is another number of numbers.
    """
    given = [0.0] if disturbance is None else disturbance
    if len(given) not in (1, 3):
        raise ValueError(
            f"--disturbance takes one number or three, for x, y and z; got {len(given)}"
        )
    return np.broadcast_to(np.array(given, dtype=float), (3,))


def _given(name: str, value: list[float] | None, *, zero: bool = False) -> Array | None:
    if value is None:
        return None
    if len(value) not in (1, 3):
        raise ValueError(f"--{name} takes one number or three, for x, y and z; got {len(value)}")
    return per_channel(f"--{name}", value[0] if len(value) == 1 else value, zero=zero)


def _machine(name: str) -> Spacecraft:
    try:
        return spacecraft.load(name)
    except ValueError as error:
        if Path(name).suffix:
            raise
        raise ValueError(f"{error}; or give the path of an MJCF file, ending in .xml") from None


def _certifiable() -> str:
    """Shipped machines that can be certified as they stand, and those that need numbers."""
    ready, asked = [], []
    for name in library.spacecraft_names():
        machine = spacecraft.load(name)
        model = mjcf.assemble(machine).compile()
        if not faults(model):
            whole = all(v is not None for v in _of_thrusters(machine, model).values())
            (ready if whole else asked).append(name)
    return f"{', '.join(ready)}; with --torque and --dwell {', '.join(asked)}"


def _of_thrusters(machine: Spacecraft, model: Any) -> dict[str, Array | None]:
    """Torque, dwell and delay of the thrusters, where there is one about each axis."""
    turns = {}
    for thruster in machine.thrusters:
        axis, arm = _axis(machine, model, mjcf.motors(thruster), thruster.name)
        if axis in turns:
            raise ValueError(
                f"{machine.name}: {turns[axis][0].name} and {thruster.name} both turn {axis}; a "
                "certificate knows one channel an axis: give --torque and --dwell"
            )
        turns[axis] = thruster, arm
    if set(turns) != set(AXES):
        return {"torque": None, "dwell": None, "delay": np.zeros(3)}
    thrusters = [turns[axis][0] for axis in AXES]
    held = np.array([thruster.min_on_time for thruster in thrusters])
    return {
        "torque": np.array([turns[axis][0].levels[-1] * turns[axis][1] for axis in AXES]),
        "dwell": held if np.all(held > 0) else None,
        "delay": np.array([thruster.delay.longest for thruster in thrusters]),
    }


def _axis(machine: Spacecraft, model: Any, motors: tuple[str, ...], name: str) -> tuple[str, float]:
    """Axis and torque at unit level, N m, of motors that fire together."""
    forces = linearize.actuator_forces(model)
    names = [model.actuator(i).name for i in range(model.nu)]
    sum_ = sum(forces[:6, names.index(motor)] for motor in motors)
    force, torque = np.split(np.asarray(sum_), 2)
    k = int(np.argmax(np.abs(torque)))
    across = np.delete(torque, k)
    rest = max(np.max(np.abs(force)), np.max(np.abs(across)))
    if torque[k] == 0 or rest > _PURE * abs(torque[k]):
        raise ValueError(
            f"{machine.name}: {name} at unit level is a force {force} N and a torque {torque} N m "
            "on the bus; "
            "a certificate needs pure torques about x, y and z: give --torque and --dwell"
        )
    return AXES[k], float(abs(torque[k]))
