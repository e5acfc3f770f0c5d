"""What a controller is: frozen parameters with a pure `init` and `step`, no base class."""

from collections.abc import Sequence
from typing import Any, Protocol, runtime_checkable


@runtime_checkable
class Controller(Protocol):
    """A control law that flies on any plant which has the sensors it names.

    With a period it is called at every sample; without one it is a relay law in continuous time,
    called where its `events` say, which are located exactly.
    """

    @property
    def sensors(self) -> tuple[str, ...]:
        """Names of the readings, in the order of y."""
        ...

    @property
    def thrusters(self) -> tuple[str, ...]:
        """Names of the channels, in the order of u."""
        ...

    @property
    def period(self) -> float | None:
        """Sampling period, s, or None."""
        ...

    def init(self) -> Any:
        """Returns the memory before the first step."""
        ...

    def step(self, t: float, y: Sequence[float], memory: Any) -> tuple[Sequence[float], Any]:
        """Returns the command u, N or N m, and the new memory.

        Args:
            t: Time, s.
            y: Readings, in the order of `sensors`.
            memory: What `init` or the last step returned.
        """
        ...

    def events(self, t: float, y: Sequence[float], memory: Any) -> Sequence[float]:
        """Returns functions that are positive while the command of `memory` stands.

        The command changes where one of them falls to zero; `step` is called there.  A sampled law
        returns none.

        Args:
            t: Time, s.
            y: Readings, in the order of `sensors`.
            memory: What the last step returned.
        """
        ...


def estimates_of(law: Any) -> dict[str, str]:
    """Returns names of what a law estimates, with units; nothing if it has no `estimates`.

    A law that has them has a method `estimated` too, which reads their values from its memory.

    Args:
        law: A controller.
    """
    return dict(getattr(law, "estimates", {}))


def estimated_by(law: Any, memory: Any) -> Sequence[float]:
    """Returns what a law estimates, in the order of `estimates_of`.

    Args:
        law: A controller.
        memory: What its last step returned.
    """
    return law.estimated(memory) if estimates_of(law) else ()
