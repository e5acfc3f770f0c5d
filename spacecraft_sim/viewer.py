"""A viewer on this machine to which a recording is sent while it is made; loopback only."""

import ipaddress
import os
import platform
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Sequence

# The viewer's program with its exit code, which `python -m rerun_cli` drops.
RERUN = (sys.executable, "-P", "-c", "import sys, rerun_cli.__main__ as m; sys.exit(m.main())")
HEADLESS = "--headless"  # option of a viewer without a window
PORT = 9876  # where a viewer listens unless told otherwise
_SCHEME, _PATH = "rerun+http://", "/proxy"


def found(text: str | None) -> str | None:
    """Returns the full address of a viewer that listens.

    Args:
        text: `host:port`, a port, a full address, or nothing for the usual port; None for no
            viewer.

    Raises:
        ValueError: If the address is not of this machine, or nobody listens there.
    """
    if text is None:
        return None
    host, port = _place(text)
    if not _listens(host, port):
        given = f"--connect {text}".rstrip()
        raise ValueError(
            f"{given}: no viewer listens on {host}, port {port}; open one with "
            f"'rerun --bind 127.0.0.1 --port {port}', or use --spawn"
        )
    return _address(host, port)


def spawn(options: Sequence[str] = (), patience: float = 30.0) -> str:
    """Opens a viewer that listens on this machine alone and outlives this program.

    Args:
        options: Further words for the viewer.
        patience: How long it may take to listen, s.

    Returns:
        Its full address.

    Raises:
        ValueError: If there is no display for it, or it does not come to listen.
    """
    if HEADLESS not in options and not has_display():
        raise ValueError(
            "--spawn: no display for a viewer: neither DISPLAY nor WAYLAND_DISPLAY is set; leave "
            "it out, and open the recording on a machine with a display"
        )
    host, port = "127.0.0.1", PORT
    if _listens(host, port):
        port = _free_port(host)
    # Left to itself the viewer listens on all addresses.
    words = ["--bind", host, "--port", str(port), "--expect-data-soon", *options]
    started = subprocess.Popen(
        [*RERUN, *words],
        start_new_session=True,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    end = time.monotonic() + patience
    while not _listens(host, port):
        if (code := started.poll()) is not None:
            raise ValueError(f"--spawn: the viewer ended with code {code}; is there a display?")
        if time.monotonic() > end:
            os.killpg(started.pid, signal.SIGTERM)
            raise ValueError(f"--spawn: the viewer does not listen after {patience:g} s")
        time.sleep(0.05)
    return _address(host, port)


def has_display() -> bool:
    """Returns whether a window can be opened, as far as the environment tells."""
    names = ("WAYLAND_DISPLAY", "DISPLAY")
    return platform.system() != "Linux" or any(map(os.environ.get, names))


def _place(text: str) -> tuple[str, int]:
    """Host and port of an address in any of its forms."""
    bare = text.removeprefix(_SCHEME).removesuffix(_PATH)
    host, colon, port = bare.rpartition(":")
    if not colon:
        host, port = ("", bare) if bare.isdecimal() else (bare, "")
    host = host.strip("[]")
    host = "127.0.0.1" if host in ("", "localhost") else host
    try:
        loopback = ipaddress.ip_address(host).is_loopback
        number = int(port or PORT)
    except ValueError:
        raise ValueError(
            f"--connect {text}: not an address; give host:port, such as 127.0.0.1:{PORT}"
        ) from None
    if not loopback:
        raise ValueError(
            f"--connect {text}: {host} is another machine; recordings are sent to viewers on this "
            f"one alone, such as 127.0.0.1:{number}"
        )
    if not 0 < number < 65536:
        raise ValueError(f"--connect {text}: port {number} is not between 1 and 65535")
    return host, number


def _address(host: str, port: int) -> str:
    return f"{_SCHEME}{f'[{host}]' if ':' in host else host}:{port}{_PATH}"


def _listens(host: str, port: int) -> bool:
    try:
        socket.create_connection((host, port), timeout=1.0).close()
    except OSError:
        return False
    return True


def _free_port(host: str) -> int:
    with socket.socket() as probe:
        probe.bind((host, 0))
        return probe.getsockname()[1]
