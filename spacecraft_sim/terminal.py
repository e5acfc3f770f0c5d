"""What the commands share: exit codes, the console, the mission that a command names."""

import argparse
import math
import sys
from collections.abc import Sequence
from typing import TYPE_CHECKING

from rich.console import Console
from rich.table import Table

from spacecraft_sim.versions import require_supported_mujoco

if TYPE_CHECKING:
    from spacecraft_sim.mission import Mission

HOLDS, FAILS, BAD_INPUT, BROKEN = 0, 1, 2, 3


def assemble(arguments: argparse.Namespace) -> "Mission":
    """Returns the mission that a command names, with the keys that it sets.

    Args:
        arguments: Words of the command: `name` and `set`.
    """
    require_supported_mujoco()
    from spacecraft_sim import mission

    return mission.assemble(mission.load_scenario(arguments.name, tuple(arguments.set)))


def exaggeration(arguments: argparse.Namespace) -> float | None:
    """Returns how many times too far booms are drawn bent; None for a round factor.

    Args:
        arguments: Words of the command: `exaggeration`.

    Raises:
        ValueError: If it is not positive.
    """
    factor = arguments.exaggeration
    if factor is not None and not 0 < factor < math.inf:
        raise ValueError(f"--exaggeration {factor:g}: must be a positive number, such as 10")
    return factor


def console() -> Console:
    """Returns a console whose tables keep their width when the output is a file or a pipe."""
    return Console(width=None if sys.stdout.isatty() else 180)


def fill(table: Table, rows: Sequence[Sequence[str]]) -> None:
    """Adds rows to a table.

    Args:
        table: The table.
        rows: Cells of each row.
    """
    for row in rows:
        table.add_row(*row)
