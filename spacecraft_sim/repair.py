"""Repairs the recording of a run that was killed: keeps what reads and writes the footer."""

import shutil
import subprocess
import tempfile
import warnings
from pathlib import Path
from typing import IO

from rerun.chunk import RrdReader

from spacecraft_sim.record_scene import TIMELINE
from spacecraft_sim.viewer import RERUN

_MAGIC = b"RRF"


def repair(path: Path) -> bool:
    """Replaces a recording by one with the same data, as far as it can be read, and a footer.

    Args:
        path: The .rrd file.

    Returns:
        Whether anything was wrong; if not, the file is left as it was.

    Raises:
        ValueError: If it is no recording, is still being written, nothing of it can be read, or
            the repaired one has no room beside it.
    """
    try:
        with path.open("rb") as file:
            start, held = file.read(len(_MAGIC)), _is_held(file)
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from error
    if start != _MAGIC:
        raise ValueError(f"{path}: not a recording; an .rrd file begins with {_MAGIC.decode()!r}")
    if held:
        raise ValueError(f"{path}: still being written; wait until its run is over")
    if _rerun("verify", str(path)) is None and _holds_something(path):
        return False
    size, free = path.stat().st_size, shutil.disk_usage(path.parent).free
    if free < size:
        raise ValueError(
            f"{path}: the repaired one is written beside it and takes {size / 1e6:.1f} MB; "
            f"{free / 1e6:.1f} MB are free: make room, or copy it to another disk"
        )
    try:
        _replace(path)
    except OSError as error:
        raise ValueError(f"{path}: cannot be replaced: {error.strerror}") from error
    return True


def end(path: Path) -> float:
    """Returns the simulated time up to which a recording reads, s; 0 if it holds no flight.

    Args:
        path: The .rrd file, with its footer.
    """
    last = 0
    for chunk in RrdReader(path).stream():
        batch = chunk.to_record_batch()
        if TIMELINE in batch.schema.names:
            nanoseconds = batch.column(TIMELINE).cast("int64").to_numpy()
            last = max(last, int(nanoseconds.max(initial=0)))
    return last / 1e9


def _is_held(file: IO[bytes]) -> bool:
    """Whether the process that writes a file lives: what it writes yet would be lost."""
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except (ImportError, OSError) as error:  # or there are no such locks
        return isinstance(error, BlockingIOError)
    return False


def _replace(path: Path) -> None:
    with tempfile.TemporaryDirectory(dir=path.parent, prefix=".repair-") as folder:
        whole = Path(folder) / path.name
        fault = _rerun("merge", str(path), "--continue-on-error", "--output", str(whole))
        fault = fault or _rerun("verify", str(whole))
        if fault or not _holds_something(whole):
            raise ValueError(f"{path}: nothing of it can be read{f': {fault}' if fault else ''}")
        whole.replace(path)


def _holds_something(path: Path) -> bool:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that there is no footer
        try:
            return len(RrdReader(path).recordings()) > 0
        except RuntimeError:  # how rerun says that it cannot decode the file
            return False


def _rerun(*words: str) -> str | None:
    """What `rerun rrd` says if it fails, or how it ended if it says nothing."""
    done = subprocess.run([*RERUN, "rrd", *words], capture_output=True, text=True)
    said = done.stderr.strip() or f"rerun ended with {done.returncode}"
    return None if done.returncode == 0 else said.splitlines()[-1]
