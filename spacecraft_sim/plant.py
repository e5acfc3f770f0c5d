"""What a flight needs of a plant; `MujocoPhysics` and `ReducedPhysics` both have it."""

from collections.abc import Callable, Sequence
from typing import Literal, Protocol

from spacecraft_sim.scenario import Initial

PlantName = Literal["mujoco", "reduced"]


class Plant(Protocol):
    """A moving thing with named inputs and named readings.

    Attributes:
        inputs: Input names: thruster channels, then disturbances.
        units: Reading names with their SI units.
    """

    inputs: tuple[str, ...]
    units: dict[str, str]

    def select(self, names: tuple[str, ...]) -> Callable[[], list[float]]:
        """Returns a function that reads the named readings.

        Args:
            names: Reading names.

        Raises:
            ValueError: If a name does not exist.
        """
        ...

    def set_initial(self, initial: Initial) -> None:
        """Sets the state at time 0.

        Args:
            initial: Attitude, rate and boom deflection.
        """
        ...

    def begin(self, value: Sequence[float], slope: Sequence[float]) -> None:
        """Opens a smooth piece at the present instant.

        Args:
            value: Inputs at the opening, in the order of `inputs`, N or N m.
            slope: Their rates during the piece, per s.
        """
        ...

    def advance(self, t: float) -> None:
        """Carries the plant from the opening of the piece to `t`; again, if called again.

        Args:
            t: End time, s.
        """
        ...

    def time(self) -> float:
        """Returns the simulated time, s."""
        ...

    def timestep(self) -> float:
        """Returns the longest piece, s."""
        ...

    def coordinates(self) -> list[float]:
        """Returns what fixes the drawing of the plant, in the order of `coordinate_units`."""
        ...

    def coordinate_units(self) -> dict[str, str]:
        """Returns the names of the coordinates with their units."""
        ...
