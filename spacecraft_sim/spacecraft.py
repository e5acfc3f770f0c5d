"""A machine as plain validated data: its MJCF, its booms, thrusters and equations of motion."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator, Field, field_validator, model_validator

from spacecraft_sim import config, library
from spacecraft_sim.beam import Rule
from spacecraft_sim.checks import choices
from spacecraft_sim.config import Model, quantity
from spacecraft_sim.delay import Delay


class Boom(Model):
    """A flexible boom, clamped to a site of the bus and bending about that site's z axis."""

    name: str = quantity("name, the prefix of its bodies and joints")
    root: str = quantity("site of the bus; the boom runs along its x axis")
    length: float = quantity("length", "m", gt=0)
    linear_density: float = quantity("mass per length", "kg/m", gt=0)
    bending_stiffness: float = quantity("bending stiffness EI", "N m^2", gt=0)
    damping_time: float = quantity("Kelvin-Voigt time chi", "s", 0.0, ge=0)
    tip_mass: float = quantity("point mass at the tip", "kg", 0.0, ge=0)
    n_hinges: int = quantity("hinges of the chain", "", 8, ge=1)
    rule: Rule = quantity("quadrature rule that places the hinges", "", "gauss_jacobi")


class Failure(Model):
    """From `time` on the thruster delivers `level` whatever is commanded: stuck off or on."""

    time: float = quantity("time of the failure", "s", ge=0)
    level: float = quantity("level it is stuck at; 0 is stuck off", "N or N m", 0.0)


def _as_delay(value: Any) -> Any:
    return {"mean": value} if isinstance(value, int | float) else value


class Thruster(Model):
    """A thruster channel: levels, delay, minimum on-time, linear rise and fall."""

    name: str = quantity("channel name, the input that controllers command")
    actuators: tuple[str, ...] = quantity(
        "MJCF motors that fire together; default: the one called like the channel", "", ()
    )
    levels: tuple[float, ...] = quantity("amplitudes of either sign", "N or N m", min_length=1)
    delay: Annotated[Delay, BeforeValidator(_as_delay)] = quantity(
        "delay from command to valve", "s", Delay(mean=0.0)
    )
    proportional: bool = quantity(
        "whether it delivers any thrust up to its highest level, not its levels alone", "", False
    )
    min_on_time: float = quantity("shortest time at a level other than zero", "s", 0.0, ge=0)
    rise_time: float = quantity("time to build up a level, linear", "s", 0.0, ge=0)
    fall_time: float = quantity("time to fall to a level or to zero, linear", "s", 0.0, ge=0)
    failure: Failure | None = quantity("a failure, if any", "", None)

    @field_validator("levels")
    @classmethod
    def _ascending(cls, levels: tuple[float, ...]) -> tuple[float, ...]:
        if any(level <= 0 for level in levels):
            raise ValueError("levels are amplitudes, all > 0")
        return tuple(sorted(levels))

    @model_validator(mode="after")
    def _valve_follows(self) -> "Thruster":
        if self.proportional and self.min_on_time:
            raise ValueError(
                f"min_on_time = {self.min_on_time} s is of a relay; a proportional thruster has "
                "none: leave it out or set proportional = false"
            )
        return self


class _Links(Model):
    lengths: tuple[float, ...] = quantity("from each joint to the next", "m", min_length=1)
    centres: tuple[float, ...] = quantity("from each joint to its link's centre of mass", "m")
    masses: tuple[float, ...] = quantity("masses of the links", "kg")
    inertias: tuple[float, ...] = quantity("inertias about the centres of mass", "kg m^2")
    g: float = quantity("acceleration of gravity", "m/s^2", 9.81, ge=0)


class PlanarArmEquations(_Links):
    """Numbers of Lagrange's equations of an arm in a vertical plane, link by link."""

    kind: Literal["planar_arm"] = quantity("which equations")


class FlexibleJointEquations(_Links):
    """The same for an arm whose rotors drive its links through springs."""

    kind: Literal["flexible_joint_arm"] = quantity("which equations")
    rotors: tuple[float, ...] = quantity("inertias of the rotors", "kg m^2")
    stiffnesses: tuple[float, ...] = quantity("stiffnesses of the springs", "N m/rad")


class RigidBodyEquations(Model):
    """Numbers of the equations of Euler and Poisson of a rigid body."""

    kind: Literal["rigid_body"] = quantity("which equations")
    inertia: tuple[float, float, float] = quantity("principal moments A, B, C", "kg m^2")
    axes: tuple[float, float, float, float] = quantity(
        "quaternion (w, x, y, z) from principal to body axes", "", (1.0, 0.0, 0.0, 0.0)
    )


Equations = Annotated[
    PlanarArmEquations | FlexibleJointEquations | RigidBodyEquations, Field(discriminator="kind")
]


class Spacecraft(Model):
    """A machine: one MJCF file, booms to grow on its bus, thrusters or motors to drive it."""

    name: str = quantity("name")
    title: str = quantity("one line about it", "", "")
    xml: Path = quantity("MJCF file of the bus, beside the TOML file")
    gravity: bool = quantity("whether it stands on the ground and may have gravity on", "", False)
    equations: Equations | None = quantity(
        "its equations of motion, in numbers independent of the MJCF", "", None
    )
    booms: tuple[Boom, ...] = quantity("booms", "", ())
    thrusters: tuple[Thruster, ...] = quantity("thruster channels", "", ())

    @model_validator(mode="after")
    def _names_are_unique(self) -> "Spacecraft":
        for kind, names in (
            ("boom", [boom.name for boom in self.booms]),
            ("thruster", [thruster.name for thruster in self.thrusters]),
        ):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise ValueError(f"{kind} names must differ; given twice: {', '.join(twice)}")
        return self

    def with_parts(self, *, booms: config.Table, thrusters: config.Table) -> "Spacecraft":
        """Returns the spacecraft with some numbers of its booms and thrusters replaced.

        Args:
            booms: Tables of new values by boom name; `all` speaks of every boom.
            thrusters: Tables of new values by thruster name; `all` speaks of every thruster.

        Raises:
            ValueError: If a name does not exist or a value is not valid.
        """
        table = self.model_dump()
        for kind, changes in (("booms", booms), ("thrusters", thrusters)):
            names = [part["name"] for part in table[kind]]
            for name in changes:
                if name not in (*names, "all"):
                    raise ValueError(choices(kind[:-1], name, (*names, "all"), where=self.name))
            table[kind] = [
                {**part, **changes.get("all", {}), **changes.get(part["name"], {})}
                for part in table[kind]
            ]
        return config.validate(Spacecraft, table, where=self.name)


def load(name: str | Path) -> Spacecraft:
    """Loads a spacecraft.

    Args:
        name: Name of a shipped spacecraft, or the path of a TOML file of the same form.

    Raises:
        ValueError: If there is no such spacecraft, or its file is not valid.
    """
    path = Path(name)
    if path.suffix != ".toml":
        known = library.spacecraft_names()
        if str(name) not in known:
            raise ValueError(choices("spacecraft", str(name), known, where="the library"))
        path = library.folder("models") / name / f"{name}.toml"
    table = config.read(path)
    if isinstance(table.get("xml"), str):
        table["xml"] = path.parent / table["xml"]
    return config.validate(Spacecraft, {"name": path.stem, **table}, where=str(path))
