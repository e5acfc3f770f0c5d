"""The film of a flight: what it shows, its formats, what it says where it cannot be made."""

import shutil
import subprocess
import sys
import tempfile
from dataclasses import replace

import numpy as np
import pytest
from flown import flown
from PIL import Image

from spacecraft_sim import cli, render, run_folder, sketch, video
from spacecraft_sim.drawing import Jet, Shape

SETTINGS = ("duration=4.0",)


def works():
    """Whether a backend renders here, and what the others complain of."""
    for backend in video.BACKENDS:
        with tempfile.TemporaryFile() as errors:
            child = video.start_renderer(backend, ["probe"], errors)
            child.communicate()
            if child.returncode == 0:
                return True
    return False


@pytest.fixture(scope="module")
def gl():
    if not works():
        pytest.skip(video.NO_GL)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The folder of a run, as far as a film needs it."""
    path = tmp_path_factory.mktemp("runs") / "run"
    path.mkdir()
    flight = flown(*SETTINGS)
    run_folder.write_flights(path, flight.mission.scenario, flight.measured)
    return path


def pictures(path):
    """The frames of a film as arrays."""
    with Image.open(path) as film:
        found = []
        for k in range(film.n_frames):
            film.seek(k)
            found.append(np.asarray(film.convert("RGB"), dtype=int))
    return found


def booms(picture):
    """Where the booms are: they are grey, the hull is golden, the plumes are orange."""
    return picture[: video.SIZE[1] - 50].min(axis=2) > 90


# -- what it shows ---------------------------------------------------------------------------------


def test_a_film_shows_the_attitude_that_was_recorded(gl, folder, tmp_path, capsys):
    out = tmp_path / "film.webp"
    words = ["--camera", "top", "--fps", "2", "--speed", "2", "--out", str(out)]
    assert cli.main(["video", str(folder), *words]) == 0
    assert str(out) in capsys.readouterr().out
    frames = pictures(out)
    assert len(frames) == 4  # 4 s, twice as fast, two frames a second
    assert frames[0].shape[:2] == video.SIZE[::-1]
    flight = flown(*SETTINGS).measured
    for k, frame in enumerate(frames):
        y, x = np.nonzero(booms(frame))
        assert len(x) > 300
        # The booms lie along the x axis of the bus, but for 0.2 m of bending at 10.5 m: 0.02 rad.
        spread = np.cov(x, -y)
        angle = 0.5 * np.arctan2(2 * spread[0, 1], spread[0, 0] - spread[1, 1])
        assert angle == pytest.approx(np.interp(k, flight.time, flight["attitude_z"]), abs=0.03)
    assert (frames[0][-50:, :200] > 150).any()  # the caption
    assert np.abs(frames[0] - frames[-1]).max() > 100


@pytest.mark.slow
def test_plumes_burn_while_the_thruster_is_on(gl, folder, tmp_path):
    flight = flown(*SETTINGS).measured
    assert flight["thruster_z"][-1] != 0
    signals = {**flight.signals, "thruster_z": 0 * flight["thruster_z"]}
    shutil.copy(folder / "scenario.toml", tmp_path)
    replace(flight, signals=signals).save(tmp_path / "trajectory.parquet")

    def flames(where):
        frame = pictures(video.write(where, fps=1, speed=1, out=tmp_path / f"{where.name}.webp"))[
            -1
        ]
        red, green, blue = np.moveaxis(frame, 2, 0)
        return np.count_nonzero((red > 150) & (green < 0.62 * red) & (blue < 0.35 * red))

    assert flames(folder) > 50
    assert flames(tmp_path) == 0


@pytest.mark.slow
def test_an_mp4_has_as_many_frames_as_asked_for(gl, folder, tmp_path):
    if not shutil.which("ffprobe"):
        pytest.skip(video.NO_FFMPEG)
    out = video.write(folder, fps=5, speed=2, out=tmp_path / "film.mp4")
    entries = ["-count_frames", "-show_entries", "stream=nb_read_frames,r_frame_rate,width"]
    told = subprocess.run(["ffprobe", "-v", "error", *entries, "-of", "csv=p=0", str(out)],
                          capture_output=True, text=True, check=True)  # fmt: skip
    assert told.stdout.strip() == f"{video.SIZE[0]},5/1,10"


def jet(**parts):
    zero = {"position": (0, 0, 0), "force": (0, 0, 0), "torque": (0, 0, 0)} | parts
    return Jet(channel="t", body="bus", **{k: np.array(v, float) for k, v in zero.items()})


HULL = Shape(
    body="bus", kind="box", size=np.array([1.0, 2.0, 3.0]), position=np.zeros(3),
    quaternion=np.array([1.0, 0, 0, 0]), rgba=np.ones(4),
)  # fmt: skip


def test_exhaust_leaves_the_hull_on_the_line_of_the_force():
    ((point, way),) = sketch.exhausts(jet(position=(0.5, 0, 0), force=(0, 4, 0)), (HULL,), 2.0)
    np.testing.assert_allclose(way, (0, -1, 0))  # against the force on the craft
    np.testing.assert_allclose(point, (0.5, -2, 0))
    ((point, way),) = sketch.exhausts(jet(position=(0.5, 0, 0), force=(0, 4, 0)), (HULL,), -2.0)
    np.testing.assert_allclose((point, way), ((0.5, 2, 0), (0, 1, 0)))
    ((point, _),) = sketch.exhausts(jet(position=(5, 0, 0), force=(0, 1, 0)), (HULL,), 1.0)
    np.testing.assert_allclose(point, (5, 0, 0))  # outside already


def test_a_torque_is_a_pair_that_turns_the_same_way():
    pair = sketch.exhausts(jet(torque=(0, 0, 2)), (HULL,), 1.0)
    assert len(pair) == 2
    moment = sum(np.cross(point, -way) for point, way in pair)
    np.testing.assert_allclose(moment[:2], 0, atol=1e-12)
    assert moment[2] > 0
    np.testing.assert_allclose(sum(way for _, way in pair), 0, atol=1e-12)  # no force


# -- what it says where it cannot be made ----------------------------------------------------------


@pytest.mark.parametrize(
    ("words", "parts"),
    [
        (["--out", "film.gif"], ["film.gif", ".webp or a .mp4"]),
        (["--out", "none/film.webp"], ["no folder none"]),
        (["--fps", "0"], ["--fps 0", "> 0"]),
        (["--fps", "nan"], ["--fps nan"]),
        (["--speed", "-2"], ["--speed -2"]),
    ],
)
def test_what_cannot_be_is_refused_with_2(words, parts, folder, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert cli.main(["video", str(folder), *words]) == 2
    message = capsys.readouterr().err
    assert all(part in message for part in parts)
    assert list(tmp_path.iterdir()) == []


def test_a_camera_that_is_not_there_is_refused_with_those_that_are(folder, tmp_path):
    with pytest.raises(ValueError, match=r"did you mean 'side'.*top"):
        next(render.frames(folder, "syde", (64, 64), np.zeros(1)))


def test_the_child_tells_what_it_refuses(folder, tmp_path, capsys):
    out = tmp_path / "film.webp"
    assert cli.main(["video", str(folder), "--camera", "syde", "--out", str(out)]) == 2
    message = capsys.readouterr().err
    # Without OpenGL MuJoCo may not even start; with it there is nothing to install.
    assert ("camera 'syde' is not in scene.xml" in message) != (video.NO_GL in message)
    assert not out.exists()


def test_a_folder_that_is_no_run(tmp_path, capsys):
    assert cli.main(["video", str(tmp_path)]) == 2
    assert "not the folder of a run" in capsys.readouterr().err


def test_a_film_that_is_there_is_kept(folder, tmp_path, capsys):
    (tmp_path / "film.webp").write_text("mine")
    assert cli.main(["video", str(folder), "--out", str(tmp_path / "film.webp")]) == 2
    assert "exists already" in capsys.readouterr().err
    assert (tmp_path / "film.webp").read_text() == "mine"


def test_a_flight_that_diverged_is_refused(folder, tmp_path, capsys):
    flight = flown(*SETTINGS).measured
    signals = {**flight.signals, "rate_z": np.full_like(flight.time, np.nan)}
    shutil.copy(folder / "scenario.toml", tmp_path)
    replace(flight, signals=signals).save(tmp_path / "trajectory.parquet")
    assert cli.main(["video", str(tmp_path)]) == 2
    assert "diverged" in capsys.readouterr().err


def played(program):
    """Instead of the renderer, a small program."""

    def start(backend, words, errors):
        command = [sys.executable, "-c", program.format(backend=backend)]
        return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=errors)

    return start


def test_without_opengl_it_says_what_to_install(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(video, "start_renderer", played("import sys; sys.exit('no lib{backend}')"))
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    out = tmp_path / "film.webp"
    assert cli.main(["video", str(folder), "--out", str(out)]) == 2
    message = capsys.readouterr().err
    assert "apt install libegl1 libgl1-mesa-dri" in message
    assert "apt install libosmesa6" in message
    assert "egl: no libegl" in message
    assert "osmesa: no libosmesa" in message
    assert not out.exists()


@pytest.mark.parametrize(
    ("chosen", "tried"),
    [("osmesa", ("osmesa",)), ("egl", ("egl",)), ("glfw", video.BACKENDS), ("", video.BACKENDS)],
)
def test_the_backend_of_the_environment_is_kept(chosen, tried, monkeypatch):
    monkeypatch.setenv("MUJOCO_GL", chosen)
    assert video.backends() == tried


def test_a_renderer_that_dies_is_told_of(folder, tmp_path, monkeypatch):
    size = 3 * video.SIZE[0] * video.SIZE[1]
    program = f"import sys; sys.stdout.buffer.write(bytes({2 * size})); sys.exit('out of memory')"
    monkeypatch.setattr(video, "start_renderer", played(program))
    with pytest.raises(ValueError, match="ended after 2 frames: out of memory"):
        video.write(folder, fps=2, speed=1, out=tmp_path / "film.webp")


def test_an_mp4_without_ffmpeg_says_what_to_install(folder, tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(shutil, "which", lambda name: None)
    assert cli.main(["video", str(folder), "--out", str(tmp_path / "film.mp4")]) == 2
    assert "apt install ffmpeg" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("length", "speed"), [(4.0, 1.0), (31.0, 2.0), (448.8, 20.0), (3600.0, 200.0)]
)
def test_a_film_is_half_a_minute_long_at_most_at_a_round_speed(length, speed):
    assert video._round_up(length / video.LENGTH) == speed
