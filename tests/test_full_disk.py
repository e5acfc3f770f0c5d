"""A disk that takes no more: it is said, nothing waits for ever, what was written can be repaired.

A limit on the size of files stands for the full disk: writes fail alike, with another number.
"""

import os
import resource
import signal
import subprocess
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
import rrd

from spacecraft_sim import (
    beneath,
    cli,
    mission,
    record,
    record_stream,
    recorder,
    run_folder,
    trajectory,
)
from spacecraft_sim.repair import repair

NAME = "efremov-nonlocal"


@pytest.fixture(scope="module")
def short():
    """What a recording is made of."""
    ready = mission.assemble(mission.load_scenario(NAME, ("duration=12.0",)))
    measured, predicted = ready.fly(), ready.fly("reduced")
    subject = run_folder.subject(ready)
    return subject, measured, beneath.reduced(subject, predicted)


@pytest.fixture
def limited():
    """Sets the size that files may have at most, bytes."""
    soft, hard = resource.getrlimit(resource.RLIMIT_FSIZE)
    yield lambda size: resource.setrlimit(resource.RLIMIT_FSIZE, (size, hard))
    resource.setrlimit(resource.RLIMIT_FSIZE, (soft, hard))


@pytest.mark.parametrize("share", [0.5, 0.95], ids=["rows", "footer"])
def test_a_recording_that_cannot_be_written_to_its_end_is_an_error(
    share, short, limited, tmp_path, monkeypatch
):
    monkeypatch.setattr(record, "ROOM", 1000)
    subject, measured, below = short
    path = tmp_path / "recording.rrd"
    record.write(path, subject, measured, below, ())
    limited(size := int(share * path.stat().st_size))
    cut = tmp_path / "cut.rrd"
    with pytest.raises(OSError, match=rf"{cut}: cannot be written to its end: .*is the disk full"):
        record.write(cut, subject, measured, below, ())
    assert cut.stat().st_size <= size
    limited(resource.RLIM_INFINITY)
    assert repair(cut)
    assert rrd.stores(cut)[0] == 1


def test_a_run_goes_on_without_its_recording_and_says_so(limited, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(run_folder, "write_pictures", lambda *_: None)  # larger than the limit
    monkeypatch.setattr(record, "ROOM", 1000)
    limited(400_000)
    out = tmp_path / "out"
    assert cli.main(["run", NAME, "--out", str(out), "--set", "duration=60.0"]) == 3
    shown = capsys.readouterr()
    assert f"{out / 'recording.rrd'}: cannot be written to its end" in shown.err
    assert "viewer" not in shown.err
    assert "open the recording" not in shown.out
    assert (out / "verdict.json").exists()


@pytest.mark.parametrize(
    ("settings", "word"),
    [(["initial.rate=[0.0, 0.0, 1e9]"], "diverged before"), ([], "the run crashed")],
    ids=["diverges", "crashes"],
)
def test_a_recording_that_is_lost_is_told_whatever_becomes_of_the_run(
    settings, word, started, tmp_path, capsys, monkeypatch
):
    def crash(*_):
        raise RuntimeError("no judge left")

    monkeypatch.setattr(mission.Mission, "judge", crash)
    monkeypatch.setattr(run_folder, "write_flights", lambda *_: started[0].kill())
    out = tmp_path / "out"
    assert cli.main(["run", NAME, "--out", str(out), "--set", "duration=2.0", *settings]) == 3
    message = capsys.readouterr().err
    assert word in message
    assert f"{out / 'recording.rrd'}: cannot be written to its end" in message


def test_a_disk_that_is_full_from_the_start_is_told_before_the_flight(limited, tmp_path, capsys):
    limited(record.ROOM // 2)
    out = tmp_path / "out"
    assert cli.main(["run", NAME, "--out", str(out), "--set", "duration=2.0"]) == 3
    message = capsys.readouterr().err
    assert f"{out} cannot be written to its end" in message
    assert "File too large" in message
    assert "Traceback" not in message
    assert not list(out.glob("*.room"))


@pytest.fixture
def started(monkeypatch):
    """The processes that write recordings, as they are started."""
    found, popen = [], subprocess.Popen

    def start(*words, **named):
        found.append(popen(*words, **named))
        return found[-1]

    monkeypatch.setattr(subprocess, "Popen", start)
    return found


def test_a_process_that_hangs_holds_up_neither_the_flight_nor_the_end(
    short, started, tmp_path, monkeypatch
):
    monkeypatch.setattr(record_stream, "CLOSING", 0.2)
    subject, measured, below = short
    begun = time.monotonic()
    with record.Recording(subject, tmp_path / "recording.rrd") as recording:
        started[0].send_signal(signal.SIGSTOP)
        recording.expect(below)
        for _ in range(3):  # much more than the pipe holds
            recording.take(measured)
        recording.conclude(())
    assert time.monotonic() - begun < 5.0
    assert "nothing more was written for 0.2 s" in (recording.lost_file or "")
    assert started[0].poll() == -signal.SIGKILL


def test_a_process_that_is_slow_is_waited_for(short, started, tmp_path, monkeypatch):
    monkeypatch.setattr(record_stream, "CLOSING", 3.0)
    subject, measured, below = short
    path = tmp_path / "recording.rrd"
    with record.Recording(subject, path) as recording:
        started[0].send_signal(signal.SIGSTOP)
        recording.expect(below)
        recording.take(measured)
        threading.Timer(1.0, started[0].send_signal, [signal.SIGCONT]).start()
    assert recording.lost_file is None
    assert rrd.chunks(path)


def test_a_process_that_dies_is_told_and_the_flight_goes_on(short, started, tmp_path):
    subject, measured, below = short
    with record.Recording(subject, tmp_path / "recording.rrd") as recording:
        recording.expect(below)
        recording.take(trajectory.selected(measured, slice(0, 50)))
        started[0].kill()
        started[0].wait()
        for _ in range(3):
            recording.take(trajectory.selected(measured, slice(50, None)))
    assert "the process that writes it ended with -9" in (recording.lost_file or "")


def test_a_pipe_that_a_fork_keeps_open_holds_up_no_end(short, started, tmp_path, monkeypatch):
    monkeypatch.setattr(record_stream, "CLOSING", 5.0)
    subject, _, below = short
    with record.Recording(subject, tmp_path / "recording.rrd") as recording:
        kept = os.dup(started[0].stdin.fileno())
        recording.expect(below)
    os.close(kept)
    assert recording.lost_file is None


@pytest.mark.parametrize("left", [None, b"", b"RRF2 and nothing else"])
def test_a_file_that_is_taken_away_is_told(left, short, started, tmp_path):
    subject, measured, below = short
    path = tmp_path / "recording.rrd"
    with record.Recording(subject, path) as recording:
        recording.expect(below)
        recording.take(measured)
        recording.conclude(())
        started[0].wait()
        path.unlink()
        if left is not None:
            path.write_bytes(left)
    assert f"{path}: cannot be written to its end" in (recording.lost_file or "")


def test_a_relative_path_is_that_of_the_beginning(short, tmp_path, monkeypatch):
    subject, _, below = short
    monkeypatch.chdir(tmp_path)
    with record.Recording(subject, Path("recording.rrd")) as recording:
        recording.expect(below)
        monkeypatch.chdir("/")
    assert recording.lost_file is None
    assert rrd.chunks(tmp_path / "recording.rrd")


def test_a_file_that_does_not_close_is_given_up(monkeypatch, capfd):
    ended = []
    monkeypatch.setattr(os, "_exit", ended.append)
    monkeypatch.setattr(recorder, "CLOSING", 0.05)
    recorder._close(SimpleNamespace(disconnect=lambda: time.sleep(0.5)))
    assert ended == [1]
    assert capfd.readouterr().out == "not closed within 0.05 s"
