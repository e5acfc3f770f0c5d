"""A scenario: everything that fixes a flight, as validated data."""

from typing import Any, Literal

from pydantic import Field, create_model

from spacecraft_sim.config import Model, quantity
from spacecraft_sim.disturbance import Torque
from spacecraft_sim.spacecraft import Boom, Thruster


class Initial(Model):
    """State at t = 0: the bus turned and turning, the booms bent and at rest in its frame.

    Machines without a bus start from their joints.
    """

    attitude: tuple[float, float, float] = quantity("rotation vector", "rad", (0.0, 0.0, 0.0))
    rate: tuple[float, float, float] = quantity("body rate", "rad/s", (0.0, 0.0, 0.0))
    boom_mode: int = quantity("cantilever mode into which every boom is bent", "", 1, ge=1)
    boom_amplitude: float = quantity("modal coordinate q, kappa = length: tip at 2 q", "m", 0.0)
    joints: dict[str, float] = quantity("joint angles by joint name", "rad", {})
    joint_rates: dict[str, float] = quantity("joint rates by joint name", "rad/s", {})
    attitude_scatter: float = quantity(
        "half-width of a uniform scatter of each attitude component that is not 0", "rad", 0.0, ge=0
    )
    rate_scatter: float = quantity("the same for the rate", "rad/s", 0.0, ge=0)


class Simulation(Model):
    """How the MuJoCo plant is integrated."""

    timestep: float = quantity("longest RK4 step; edges are landed on", "s", 0.01, gt=0)
    substeps: int = quantity("steps to a control step, at which rows are recorded", "", 10, ge=1)


def _changes(part: type[Model]) -> Any:
    """The model of a table that changes some numbers of a part and leaves the others."""
    fields: dict[str, Any] = {
        name: (field.rebuild_annotation() | None, Field(None, description=field.description))
        for name, field in part.model_fields.items()
        if name != "name"
    }
    return create_model(f"{part.__name__}Changes", __base__=Model, **fields)


# pyright: reportInvalidTypeForm=false
BoomChanges, ThrusterChanges = _changes(Boom), _changes(Thruster)


class Actual(Model):
    """How the machine that flies in MuJoCo differs from the one that the law was designed for."""

    booms: dict[str, BoomChanges] = quantity("changed numbers by boom, or of all", "", {})
    thrusters: dict[str, ThrusterChanges] = quantity("changed numbers by thruster", "", {})


class Reduced(Model):
    """The reduced model that flies beside MuJoCo."""

    source: Literal["galerkin", "mjcf", "equations"] = quantity(
        "Bubnov-Galerkin with cantilever shapes, modes of the compiled MJCF, or the machine's own "
        "equations of motion",
        "",
        "mjcf",
    )
    modes: int = quantity("elastic modes kept", "", 1, ge=0)


class Scenario(Model):
    """A flight: spacecraft, start, law, thrusters, disturbance, reduced model, seed."""

    name: str = quantity("name", pattern=r"^\w[\w .-]*$")
    title: str = quantity("one line about it")
    description: str = quantity("what it shows", "", "")
    spacecraft: str = quantity("name of a spacecraft, or path of its TOML file")
    duration: float = quantity("length of the flight", "s", gt=0)
    seed: int = quantity("seed of everything random", "", 0, ge=0)
    initial: Initial = quantity("state at t = 0", "", Initial())
    controller: dict[str, Any] = quantity("law, and the parameters of its design")
    disturbance: dict[Literal["x", "y", "z"], Torque] = quantity(
        "torques on the bus by bus axis", "", {}
    )
    booms: dict[str, BoomChanges] = quantity("changed numbers by boom, or of all", "", {})
    thrusters: dict[str, ThrusterChanges] = quantity("changed numbers by thruster", "", {})
    actual: Actual = quantity("what only the MuJoCo plant has", "", Actual())
    simulation: Simulation = quantity("integration", "", Simulation())
    reduced: Reduced = quantity("reduced model", "", Reduced())
    versions: dict[str, str] = quantity("versions that flew it, for the record", "", {})

    def changes(self) -> dict[str, dict[str, dict[str, Any]]]:
        """Returns the changed numbers as plain tables: `booms` and `thrusters`, each by name."""
        return _tables(self)

    def actual_changes(self) -> dict[str, dict[str, dict[str, Any]]]:
        """Returns what is changed further for the MuJoCo plant alone, likewise."""
        return _tables(self.actual)


def _tables(changed: Any) -> dict[str, dict[str, dict[str, Any]]]:
    return {
        kind: {name: part.model_dump(exclude_unset=True) for name, part in parts.items()}
        for kind, parts in (("booms", changed.booms), ("thrusters", changed.thrusters))
    }
