"""Writes a recording to one place, in a process of its own: makes what it is told on its input.

The first recipe is the stream; when the input ends, be it that the run is over or that it was
killed, the recording is closed.  What prevents it is said on the output, with code 1.
"""

import contextlib
import os
import signal
import sys
from threading import Timer
from typing import Any

CLOSING = 20.0  # how long it may take to close, s; for a disk that was full it takes for ever


def main() -> int:
    """Returns the exit code."""
    for name in {"SIGINT", "SIGTERM", "SIGHUP"} & set(dir(signal)):  # they are for the run
        signal.signal(getattr(signal, name), signal.SIG_IGN)
    import rerun as rr  # only now: it takes a second, in which signals may come
    import rerun.blueprint as rrb

    from spacecraft_sim.recipe import made

    rr.set_strict_mode(True)  # a mistake is an error, not a remark
    told, names = sys.stdin.buffer, {"rr": rr, "rrb": rrb, "hold": _hold}
    stream = names["stream"] = made(told, names)
    try:
        while True:
            made(told, names)
    except EOFError:
        return _close(stream)
    except RuntimeError as error:  # a flush: the disk is full, the viewer gone
        return _give_up(str(error))


def _hold(path: str) -> None:
    """Locks a file as long as this process lives: whoever would replace it can tell."""
    with contextlib.suppress(ImportError, OSError):  # there are systems without such locks
        import fcntl

        fcntl.flock(os.open(path, os.O_RDONLY), fcntl.LOCK_EX | fcntl.LOCK_NB)


def _close(stream: Any) -> int:
    late = Timer(CLOSING, _give_up, [f"not closed within {CLOSING:g} s"])
    late.daemon = True
    late.start()
    stream.disconnect()  # it writes the footer of a file
    late.cancel()
    return 0


def _give_up(reason: str) -> int:
    with contextlib.suppress(BrokenPipeError):  # the run was killed: nobody is there to hear it
        os.write(sys.stdout.fileno(), reason.encode())
    os._exit(1)  # else rerun tries again at the end of the process, and may wait for ever


if __name__ == "__main__":
    sys.exit(main())
