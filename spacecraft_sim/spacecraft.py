"""A spacecraft as plain validated data: its MJCF bus, its booms, its thrusters."""

from pathlib import Path
from typing import Annotated, Any

from pydantic import BeforeValidator, field_validator, model_validator

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
    """A relay thruster channel: levels, delay, minimum on-time, linear rise and fall."""

    name: str = quantity("channel name, the input that controllers command")
    actuators: tuple[str, ...] = quantity(
        "MJCF motors that fire together; default: the one called like the channel", "", ()
    )
    levels: tuple[float, ...] = quantity("amplitudes of either sign", "N or N m", min_length=1)
    delay: Annotated[Delay, BeforeValidator(_as_delay)] = quantity(
        "delay from command to valve", "s", Delay(mean=0.0)
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


class Spacecraft(Model):
    """A machine: one MJCF file for the bus, booms to grow on it, thrusters to drive it."""

    name: str = quantity("name")
    title: str = quantity("one line about it", "", "")
    xml: Path = quantity("MJCF file of the bus, beside the TOML file")
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
