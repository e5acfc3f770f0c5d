"""A recorded flight as a film: MuJoCo's renderer in a child process, WebP or MP4."""

import math
import os
import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO

import numpy as np

from spacecraft_sim import child_process
from spacecraft_sim.trajectory import Trajectory

Progress = Callable[[int, int], None]  # frames done, frames in all

SIZE = (960, 540)  # pixels
LENGTH = 30.0  # of a film whose speed is not given, at most, s
BACKENDS = ("egl", "osmesa")
REFUSED = 2  # how a renderer ends that was asked for what there is not
NO_GL = (
    "no OpenGL without a display; on Debian: apt install libegl1 libgl1-mesa-dri (EGL), "
    "or apt install libosmesa6 (OSMesa)"
)
NO_FFMPEG = "an MP4 needs ffmpeg; on Debian: apt install ffmpeg; or name a .webp file"
NO_PILLOW = 'a film needs Pillow with WebP; run: pip install "spacecraft-sim[video]"'


def write(
    folder: Path,
    *,
    camera: str | None = None,
    fps: float = 25.0,
    speed: float | None = None,
    out: Path | None = None,
    progress: Progress | None = None,
) -> Path:
    """Renders the flight in the folder of a run.

    Args:
        folder: The folder.
        camera: A camera of the machine's scene; `side` if there is one, else the first.
        fps: Frames a second.
        speed: Simulated time over time of the film; chosen round for a film of half a minute at
            most if left out.
        out: A .webp or .mp4 file; `flight.webp` in the folder if left out.
        progress: Called after every frame.

    Returns:
        The file.

    Raises:
        ValueError: If there is no such run, camera or format, the file exists, or the machine
            lacks what renders or encodes; the message says what to install.
    """
    out = out or folder / "flight.webp"
    flight = _flight(folder)
    _check_output(out)
    for name, value, limit in (("--fps", fps, 240.0), ("--speed", speed or 1.0, math.inf)):
        if not 0 < value <= limit or not math.isfinite(value):
            raise ValueError(f"{name} {value:g}: give a finite number > 0 and <= {limit:g}")
    start, end = float(flight.time[0]), float(flight.time[-1])
    speed = speed or _round_up((end - start) / LENGTH)
    step = speed / fps
    count = max(int((end - start) / step), 1)
    words = [str(folder), camera or "", *map(str, SIZE), repr(start), repr(step), str(count)]
    with _rendering(words) as pictures:
        shown = _captioned(pictures, start, step, speed, count, progress)
        (_webp if out.suffix == ".webp" else _mp4)(out, shown, count, fps)
    return out


def backends() -> tuple[str, ...]:
    """Returns the OpenGL backends to try: the one that MUJOCO_GL names, if it needs no display."""
    wanted = os.environ.get("MUJOCO_GL", "").lower()
    return (wanted,) if wanted in BACKENDS else BACKENDS


def start_renderer(backend: str, words: list[str], errors: IO[bytes]) -> subprocess.Popen:
    """Starts `render` in a process of its own.

    Args:
        backend: `egl` or `osmesa`.
        words: What to do.
        errors: File for what it complains of.
    """
    environment = {"MUJOCO_GL": backend, "PYOPENGL_PLATFORM": backend}
    return child_process.start("render", words, stderr=errors, environment=environment)


def last_words(errors: IO[bytes]) -> str:
    """Returns the last line that a process complained with.

    Args:
        errors: The file of its standard error.
    """
    errors.seek(0)
    lines = errors.read().decode(errors="replace").strip().splitlines()
    return lines[-1] if lines else "it said nothing"


@contextmanager
def _rendering(words: list[str]) -> Iterator[Iterator[bytes]]:
    """Raw pictures from the first backend that gives one."""
    size, reasons = 3 * SIZE[0] * SIZE[1], []
    for backend in backends():
        with tempfile.TemporaryFile() as errors:
            child = start_renderer(backend, ["frames", *words], errors)
            assert child.stdout
            try:
                first = child.stdout.read(size)
                if len(first) == size:
                    yield _pictures(first, child, errors, int(words[-1]))
                    return
                if child.wait() == REFUSED:
                    raise ValueError(last_words(errors))
                reasons.append(f"{backend}: {last_words(errors)}")
            finally:
                child.stdout.close()
                child.terminate()
                child.wait()
    raise ValueError("\n".join([NO_GL, *(f"  {reason}" for reason in reasons)]))


def _pictures(
    first: bytes, child: subprocess.Popen, errors: IO[bytes], count: int
) -> Iterator[bytes]:
    yield first
    for k in range(1, count):
        picture = child.stdout.read(len(first)) if child.stdout else b""
        if len(picture) < len(first):
            child.wait()
            raise ValueError(f"the renderer ended after {k} frames: {last_words(errors)}")
        yield picture


def _captioned(
    pictures: Iterator[bytes],
    start: float,
    step: float,
    speed: float,
    count: int,
    progress: Progress | None,
) -> Iterator:
    """Pictures with the time of flight and the speed of the film."""
    from PIL import Image, ImageDraw, ImageFont

    font = ImageFont.load_default(18)
    for k, raw in enumerate(pictures):
        picture = Image.frombytes("RGB", SIZE, raw)
        text = f"t = {start + k * step:.1f} s    speed x {speed:g}"
        ImageDraw.Draw(picture).text((18, SIZE[1] - 34), text, fill=(200, 208, 222), font=font)
        yield picture
        if progress:
            progress(k + 1, count)


def _webp(out: Path, pictures: Iterator, count: int, fps: float) -> None:
    """One picture at a time: a list of all of them would take a gigabyte."""
    film, shown = next(pictures), 0

    def seek(frame: int) -> None:
        nonlocal shown
        if frame > shown:
            film.paste(next(pictures))
            shown = frame

    film.n_frames, film.seek = count, seek  # what Pillow asks of a picture that moves
    try:
        film.save(out, "WEBP", save_all=True, duration=1000 / fps, loop=0, quality=80, method=2)
    except OSError as error:
        raise ValueError(f"{out}: cannot be written: {error.strerror or error}") from error


def _mp4(out: Path, pictures: Iterator, count: int, fps: float) -> None:
    raw = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{SIZE[0]}x{SIZE[1]}", "-r", f"{fps:g}"]
    coded = ["-pix_fmt", "yuv420p", "-movflags", "+faststart", "-frames:v", str(count)]
    command = ["ffmpeg", "-loglevel", "error", "-nostdin", "-y", *raw, "-i", "-", *coded, str(out)]
    with tempfile.TemporaryFile() as errors:
        encoder = subprocess.Popen(command, stdin=subprocess.PIPE, stderr=errors)
        assert encoder.stdin
        try:
            for picture in pictures:
                encoder.stdin.write(picture.tobytes())
            encoder.stdin.close()
        except BrokenPipeError:  # it says why below
            pass
        if encoder.wait():
            raise ValueError(f"ffmpeg cannot write {out}: {last_words(errors)}")


def _check_output(out: Path) -> None:
    if out.suffix not in (".webp", ".mp4"):
        raise ValueError(f"{out}: a film is a .webp or a .mp4 file")
    if out.exists():
        raise ValueError(f"{out}: exists already; name a file that does not")
    if not out.parent.is_dir():
        raise ValueError(f"{out}: cannot be written: there is no folder {out.parent}")
    try:
        from PIL import features
    except ImportError:
        raise ValueError(NO_PILLOW) from None
    if out.suffix == ".webp" and not features.check("webp"):
        raise ValueError(NO_PILLOW)
    if out.suffix == ".mp4" and not shutil.which("ffmpeg"):
        raise ValueError(NO_FFMPEG)


def _flight(folder: Path) -> Trajectory:
    path = folder / "trajectory.parquet"
    if not path.is_file() or not (folder / "scenario.toml").is_file():
        raise ValueError(
            f"{folder}: not the folder of a run; it has no scenario.toml and trajectory.parquet"
        )
    flight = Trajectory.load(path)
    if not all(np.isfinite(values).all() for values in flight.signals.values()):
        raise ValueError(f"{path}: the flight diverged; there is nothing to render")
    return flight


def _round_up(value: float) -> float:
    """The least of 1, 2, 5, 10, ... that is not below a value."""
    power = 10.0 ** math.floor(math.log10(max(value, 1.0)))
    return next(k * power for k in (1, 2, 5, 10) if k * power >= value or value <= 1)
