"""What this machine can do for the program, and what to install for the rest."""

import importlib.metadata
import os
import platform
import re
import shutil
import subprocess
import sys
import tempfile
import textwrap
import time
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from spacecraft_sim import video
from spacecraft_sim.viewer import has_display

State = Literal["ok", "missing", "limited"]

_PACKAGE, _PYTHON = "spacecraft-sim", (3, 11)
_OPERATORS = {
    ">=": lambda have, need: have >= need,
    "<": lambda have, need: have < need,
}
_CHROMIUMS = ("chromium", "chromium-browser", "google-chrome")
_PROBE = 4_000_000  # bytes written to see whether, and how fast, the disk takes them
_PATIENCE = 60.0  # s


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing that was looked at.

    Attributes:
        subject: What.
        state: Whether it is there; `limited` where something works without it.
        found: What was found.
        advice: What it is for, and what to install; empty where nothing is to be done.
    """

    subject: str
    state: State
    found: str
    advice: str = ""


def checks(folder: Path = Path()) -> list[Check]:
    """Looks at Python, packages, OpenGL, viewer, encoders, browser, disk and processor.

    Args:
        folder: Where runs would be written.
    """
    parts = (_packages(), _opengl(), [_viewer(), _webp(), _ffmpeg(), _browser()])
    return [_python(), *(check for part in parts for check in part), _disk(folder), _cores()]


def satisfies(version: str, needed: str) -> bool:
    """Returns whether a version lies in a range.

    Args:
        version: Such as `3.17.0`.
        needed: Bounds with commas between, such as `>=3.17,<4`.
    """
    have = _numbers(version)
    bounds = re.findall(r"(>=|<)\s*([\d.]+)", needed)
    return all(_OPERATORS[sign](have, _numbers(limit)) for sign, limit in bounds)


def _numbers(version: str) -> tuple[int, ...]:
    found = [int(part) for part in re.findall(r"\d+", re.split(r"[^\d.]", version)[0])]
    return tuple(found + [0] * (4 - len(found)))


def _ok(subject: str, found: str) -> Check:
    return Check(subject=subject, state="ok", found=found)


def _lack(subject: str, found: str, advice: str, state: State = "missing") -> Check:
    return Check(subject=subject, state=state, found=found, advice=advice)


def _python() -> Check:
    found = f"{platform.python_version()}, {platform.system()} {platform.machine()}"
    if sys.version_info >= _PYTHON:
        return _ok("Python", found)
    return _lack("Python", found, f"install Python {'.'.join(map(str, _PYTHON))} or later")


def _packages() -> list[Check]:
    """The packages that the program requires, with what is asked of each."""
    asked = [text for text in importlib.metadata.requires(_PACKAGE) or () if ";" not in text]
    split = [re.split(r"(?=[<>=!~])", text, maxsplit=1) for text in asked]
    return [_package(name.strip(), "".join(needed)) for name, *needed in split]


def _package(name: str, needed: str) -> Check:
    needed = ",".join(sorted(needed.split(","), reverse=True))  # the lower bound first
    advice = f'pip install "{name}{needed}"'
    try:
        version = importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return _lack(name, "not installed", advice)
    if satisfies(version, needed):
        return _ok(name, version)
    why = "; dm_control does not work with MuJoCo 4" if name == "mujoco" else ""
    return _lack(name, f"{version}, but {needed} is needed", advice + why)


def _opengl() -> list[Check]:
    """Both ways to OpenGL without a display, tried in processes of their own, side by side."""
    ways = {"egl": ("EGL", "libegl1 libgl1-mesa-dri"), "osmesa": ("OSMesa", "libosmesa6")}
    with ExitStack() as stack:
        errors = {way: stack.enter_context(tempfile.TemporaryFile()) for way in ways}
        children = {way: video.start_renderer(way, ["probe"], errors[way]) for way in ways}
        told = {way: _told(child) for way, child in children.items()}
        complaints = {way: video.last_words(errors[way]) for way in ways}
    works, found = any(told.values()), []
    for way, (name, packages) in ways.items():
        subject, advice = f"OpenGL by {name}", f"apt install {packages}"
        if told[way]:
            found.append(_ok(subject, told[way]))
        elif works:
            advice += "; not needed, the other way works"
            found.append(_lack(subject, complaints[way], advice, "limited"))
        else:
            found.append(_lack(subject, complaints[way], f"{advice}, for `spacecraft-sim video`"))
    return found


def _told(child: subprocess.Popen) -> str:
    """What a child says; nothing if it fails or takes too long."""
    try:
        out, _ = child.communicate(timeout=_PATIENCE)
    except subprocess.TimeoutExpired:
        child.kill()
        child.communicate()
        return ""
    return "" if child.returncode else out.decode(errors="replace").strip()


def _viewer() -> Check:
    beside = Path(sys.executable).parent
    program = shutil.which("rerun", path=f"{beside}{os.pathsep}{os.environ.get('PATH', '')}")
    if program is None:
        advice = "pip install rerun-sdk, to open recordings"
        return _lack("rerun viewer", "no program rerun", advice)
    if has_display():
        return _ok("rerun viewer", f"{_version(program)}; a display")
    advice = "open recordings on a machine with a display; report.html needs only a browser"
    return _lack("rerun viewer", f"{_version(program)}; no display", advice, "limited")


def _webp() -> Check:
    try:
        from PIL import __version__, features
    except ImportError:
        return _lack("WebP", "no Pillow", video.NO_PILLOW)
    if features.check("webp"):
        return _ok("WebP", f"Pillow {__version__}")
    return _lack("WebP", f"Pillow {__version__} without WebP", video.NO_PILLOW)


def _ffmpeg() -> Check:
    if program := shutil.which("ffmpeg"):
        return _ok("ffmpeg", _version(program, "-version"))
    advice = "apt install ffmpeg, for videos as MP4; WebP needs none"
    return _lack("ffmpeg", "not installed", advice, "limited")


def _browser() -> Check:
    if program := next(filter(None, map(shutil.which, _CHROMIUMS)), None):
        return _ok("Chromium", _version(program))
    advice = "apt install chromium, for the tests of report.html; any browser opens it"
    return _lack("Chromium", "not installed", advice, "limited")


def _version(program: str, option: str = "--version") -> str:
    """The first line of what a program says of itself."""
    try:
        told = subprocess.run([program, option], capture_output=True, text=True, timeout=_PATIENCE)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"{program}: {error}"
    return textwrap.shorten(next(iter(told.stdout.splitlines()), program), 64, placeholder=" …")


def _disk(folder: Path) -> Check:
    where = folder.resolve()
    try:
        free = shutil.disk_usage(folder).free / 1e9
        with tempfile.NamedTemporaryFile(dir=folder) as file:
            started = time.perf_counter()
            file.write(bytes(_PROBE))
            file.flush()
            os.fsync(file.fileno())
            rate = _PROBE / 1e6 / (time.perf_counter() - started)
    except OSError as error:
        advice = "runs are written here: go to another folder, or give --out"
        return _lack("disk", f"{where}: {error.strerror}", advice)
    found = f"{where}: {free:.0f} GB free, writes {rate:.0f} MB/s"
    if free > 1:
        return _ok("disk", found)
    return _lack("disk", found, "less than 1 GB is free; an hour of flight takes 0.2", "limited")


def _cores() -> Check:
    have = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    return _ok("processor", f"{have} cores, load {load:.1f}")
