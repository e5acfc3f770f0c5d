"""The way of a recording out of the run: to processes that write it, one for each place.

rerun is loaded and fed there, beside the flight; what is logged here are recipes.  A process that
is stuck or gone does not hold up the run, and one whose run was killed closes its recording.
"""

import contextlib
import subprocess
from collections.abc import Iterable, Sequence
from pathlib import Path
from queue import SimpleQueue
from threading import Thread
from typing import TYPE_CHECKING, Any

from spacecraft_sim import child_process
from spacecraft_sim.recipe import END, Recipe

if TYPE_CHECKING:
    import rerun as rr
    import rerun.blueprint as rrb
else:
    rr, rrb = Recipe("rr"), Recipe("rrb")

FLUSH = 5.0  # how long a process may take to write what it was told, s
CLOSING = 25.0  # and to take anything more, or to end, s: longer than it allows itself
BLOCK = 65536  # bytes that are passed on at a time
_STREAM = Recipe("stream")


class Outlet:
    """A process that writes a recording to one place.

    Attributes:
        process: The process.
    """

    def __init__(self, application: str, identity: str, sink: "rr.FileSink | rr.GrpcSink"):
        """Starts the process.

        Args:
            application: Name of the program that records.
            identity: Name of the recording, of which there is no other.
            sink: The place.
        """
        self.process = child_process.start(
            "recorder", stdin=subprocess.PIPE, environment={"RERUN": "on"}
        )
        self._queue: SimpleQueue[bytes | None] = SimpleQueue()
        self._taken = 0  # blocks that the process has taken
        self._passing = Thread(target=self._pass_on, daemon=True)
        self._passing.start()
        opened = Recipe("rr").RecordingStream(application, recording_id=identity)
        self.pass_on(opened.encoded() + _STREAM.set_sinks(sink).encoded())

    def pass_on(self, recipes: bytes) -> None:
        """Lets the process make what is told; returns at once.

        Args:
            recipes: Encoded recipes, one after the other.
        """
        self._queue.put(recipes)

    def hold(self, path: Path) -> None:
        """Locks a file until the process ends.

        Args:
            path: The file, absolute.
        """
        self.pass_on(Recipe("hold")(str(path)).encoded())

    def lay_out(self, blueprint: rrb.Blueprint) -> None:
        """Sends the layout of the views.

        Args:
            blueprint: The layout.
        """
        self.pass_on(_STREAM.send_blueprint(blueprint).encoded())

    def end(self) -> None:
        """Lets the process close the recording when all is written; returns at once."""
        self._queue.put(None)

    def close(self) -> str | None:
        """Waits until all is written and the recording closed.

        Returns:
            Why it is not; None if it is.
        """
        self.end()
        ended = self._takes_all() and self._ends(CLOSING)
        if not ended:
            self.process.kill()
            self._ends(1.0)  # unless a disk holds it that does not answer
        assert self.process.stdout
        with self.process.stdout as told:
            if not ended:
                return f"nothing more was written for {CLOSING:g} s"
            reason, code = told.read().decode(errors="replace"), self.process.returncode
        return None if code == 0 else reason or f"the process that writes it ended with {code}"

    def _takes_all(self) -> bool:
        """Whether the process takes what was passed on, in whatever time, block by block."""
        while True:
            taken = self._taken
            self._passing.join(CLOSING)
            if not self._passing.is_alive():
                return True
            if self._taken == taken:
                return False

    def _ends(self, patience: float) -> bool:
        with contextlib.suppress(subprocess.TimeoutExpired):
            self.process.wait(patience)
        return self.process.returncode is not None

    def _pass_on(self) -> None:
        assert self.process.stdin
        with contextlib.suppress(BrokenPipeError), self.process.stdin as pipe:  # it says why
            while recipes := self._queue.get():
                for k in range(0, len(recipes), BLOCK):
                    pipe.write(recipes[k : k + BLOCK])
                    pipe.flush()
                    self._taken += 1
            pipe.write(END)  # a fork of this process may keep the pipe open


class Stream:
    """What is logged, as to a stream of rerun's; it leaves for the outlets when it is flushed."""

    def __init__(self, outlets: Sequence[Outlet]):
        """Logs to some outlets.

        Args:
            outlets: The outlets.
        """
        self._outlets = outlets
        self._told: list[bytes] = []

    def send_recording_name(self, name: str) -> None:
        """Names the recording.

        Args:
            name: The name.
        """
        self._tell(_STREAM.send_recording_name(name))

    def log(self, path: str, what: "rr.AsComponents", *, static: bool) -> None:
        """Logs components of an entity.

        Args:
            path: Path of the entity.
            what: The components.
            static: Whether they are the same at all times.
        """
        self._tell(_STREAM.log(path, what, static=static))

    def send_columns(
        self, path: str, indexes: "Iterable[rr.TimeColumn]", columns: "Iterable[Any]"
    ) -> None:
        """Logs components of an entity at many times.

        Args:
            path: Path of the entity.
            indexes: The times.
            columns: The components.
        """
        self._tell(_STREAM.send_columns(path, indexes, columns))

    def flush(self) -> None:
        """Brings all that was logged on its way, to be written as soon as it has arrived."""
        self._tell(_STREAM.flush(timeout_sec=FLUSH))
        recipes = b"".join(self._told)
        for outlet in self._outlets:
            outlet.pass_on(recipes)
        self._told = []

    def end(self) -> None:
        """Lets the outlets close; nothing may be logged any more."""
        if self._told:
            self.flush()
        for outlet in self._outlets:
            outlet.end()

    def _tell(self, recipe: Recipe) -> None:
        self._told.append(recipe.encoded())
