"""`spacecraft-sim doctor`: what is there, what is missing, what to install; always exit code 0."""

import importlib.metadata
import os
import shutil
import subprocess
import sys

import pytest

from spacecraft_sim import cli, doctor, video


def renderer(good=()):
    """Instead of a renderer, a child that answers or complains."""

    def start(backend, words, errors):
        assert words == ["probe"]
        program = (
            f"print('soft {backend}')" if backend in good else f"raise SystemExit('{backend}?')"
        )
        return subprocess.Popen(
            [sys.executable, "-c", program], stdout=subprocess.PIPE, stderr=errors
        )

    return start


@pytest.fixture(autouse=True)
def quick(request, monkeypatch):
    """Programs are not started to be asked who they are."""
    if "slow" not in request.keywords:
        monkeypatch.setattr(doctor, "_version", lambda program, *_: f"{program} 1.0")


@pytest.fixture
def bare(monkeypatch):
    """A machine with Python and nothing else."""

    def version(name):
        if name == "mujoco":
            return "4.0.1"
        raise importlib.metadata.PackageNotFoundError(name)

    monkeypatch.setattr(importlib.metadata, "version", version)
    monkeypatch.setattr(shutil, "which", lambda *_, **__: None)
    monkeypatch.setattr(video, "start_renderer", renderer())
    monkeypatch.setitem(sys.modules, "PIL", None)  # importing it fails


def by_subject():
    return {check.subject: check for check in doctor.checks()}


@pytest.mark.parametrize(
    ("version", "needed", "good"),
    [
        ("3.17.0", ">=3.17,<4", True),
        ("3.16.9", ">=3.17,<4", False),
        ("4.0.1", ">=3.17,<4", False),
        ("3.17.0rc1", ">=3.17,<4", True),  # its numbers alone count
        ("0.41.2", ">=0.41,<0.42", True),
        ("0.42.0", ">=0.41,<0.42", False),
        ("18", ">=18", True),
        ("10.0", ">=9", True),  # numbers, not letters
        ("1", "", True),
    ],
)
def test_versions_are_compared_as_numbers(version, needed, good):
    assert doctor.satisfies(version, needed) is good


def test_a_bare_machine_is_told_what_to_install(bare):
    found = by_subject()
    assert found["mujoco"].state == "missing"
    assert "4.0.1, but >=3.17,<4 is needed" in found["mujoco"].found
    assert 'pip install "mujoco>=3.17,<4"' in found["mujoco"].advice
    assert "MuJoCo 4" in found["mujoco"].advice
    assert 'pip install "rerun-sdk>=0.41,<0.42"' in found["rerun-sdk"].advice
    for subject, package in (
        ("OpenGL by EGL", "libegl1"),
        ("OpenGL by OSMesa", "libosmesa6"),
        ("rerun viewer", "rerun-sdk"),
        ("WebP", "spacecraft-sim[video]"),
        ("ffmpeg", "apt install ffmpeg"),
        ("Chromium", "apt install chromium"),
    ):
        assert found[subject].state != "ok"
        assert package in found[subject].advice, subject
    assert found["OpenGL by EGL"].found == "egl?"  # what the child complained of


def test_one_way_to_opengl_is_enough(monkeypatch):
    monkeypatch.setattr(video, "start_renderer", renderer(good=("osmesa",)))
    found = by_subject()
    assert (found["OpenGL by OSMesa"].state, found["OpenGL by OSMesa"].found) == (
        "ok",
        "soft osmesa",
    )
    assert found["OpenGL by EGL"].state == "limited"
    assert "not needed" in found["OpenGL by EGL"].advice


def test_the_exit_code_is_0_whatever_is_missing(bare, capsys):
    assert cli.main(["doctor"]) == 0
    shown = capsys.readouterr().out
    for word in ("mujoco", "apt install ffmpeg", "missing", "processor"):
        assert word in shown


def test_what_it_found_says_what_it_is(monkeypatch):
    monkeypatch.setattr(video, "start_renderer", renderer(good=video.BACKENDS))
    found = by_subject()
    for name in ("mujoco", "dm-control", "numpy"):
        assert found[name].state == "ok"
        assert found[name].found == importlib.metadata.version(name)
    assert all(check.advice for check in found.values() if check.state != "ok")
    assert not any(check.advice for check in found.values() if check.state == "ok")


@pytest.mark.parametrize(("display", "state"), [("", "limited"), (":0", "ok")])
def test_the_viewer_needs_a_display(display, state, monkeypatch):
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setenv("DISPLAY", display)
    monkeypatch.setattr(doctor.platform, "system", lambda: "Linux")
    monkeypatch.setattr(shutil, "which", lambda name, path=None: sys.executable)
    assert doctor._viewer().state == state


def test_a_folder_that_takes_no_file_is_found_out(tmp_path, monkeypatch):
    def refuse(**_):
        raise PermissionError(13, "Permission denied")

    assert doctor._disk(tmp_path).state == "ok"
    monkeypatch.setattr(doctor.tempfile, "NamedTemporaryFile", refuse)
    check = doctor._disk(tmp_path)
    assert check.state == "missing"
    assert str(tmp_path) in check.found
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
def test_on_this_machine_it_loads_no_mujoco():
    program = (
        "import sys; from spacecraft_sim import cli; code = cli.main(['doctor']);"
        "sys.exit(9 if {'mujoco', 'rerun', 'matplotlib'} & set(sys.modules) else code)"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True,
                          env={**os.environ, "COLUMNS": "200"})  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert "OpenGL by EGL" in done.stdout
