"""A module of this package in a process of its own, which finds the same modules as this one."""

import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from typing import IO


def start(
    module: str,
    words: Sequence[str] = (),
    *,
    stdin: int | None = None,
    stderr: IO[bytes] | None = None,
    environment: Mapping[str, str] | None = None,
) -> subprocess.Popen[bytes]:
    """Starts the process; its output is a pipe.

    Args:
        module: Name of the module in the package.
        words: Words of its command line.
        stdin: As for `subprocess.Popen`.
        stderr: File for what it complains of; where this process complains if left out.
        environment: Variables to set.
    """
    # Files in the working directory are not modules (-P), unless they are here.
    command = [sys.executable, "-P", "-m", f"spacecraft_sim.{module}", *words]
    found = {"PYTHONPATH": os.pathsep.join(sys.path)}
    return subprocess.Popen(
        command,
        stdin=stdin,
        stdout=subprocess.PIPE,
        stderr=stderr,
        env={**os.environ, **found, **(environment or {})},
    )
