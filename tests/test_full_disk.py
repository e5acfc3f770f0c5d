"""A disk that takes no more: it is said, nothing waits for ever, what was written can be repaired.

A limit on the size of files stands for the full disk: writes fail alike, with another number.
"""

import resource
import threading

import pytest
import rerun as rr
import rrd

from spacecraft_sim import beneath, cli, mission, record, run_folder
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
def limited(monkeypatch):
    """Sets the size that files may have at most, bytes."""
    monkeypatch.setattr(record, "PATIENCE", 1.0)
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
    with pytest.raises(OSError, match=rf"{cut}: cannot be written to its end; is the disk full"):
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


def test_a_disk_that_is_full_from_the_start_is_told_before_the_flight(limited, tmp_path, capsys):
    limited(record.ROOM // 2)
    out = tmp_path / "out"
    assert cli.main(["run", NAME, "--out", str(out), "--set", "duration=2.0"]) == 3
    message = capsys.readouterr().err
    assert f"{out} cannot be written to its end" in message
    assert "File too large" in message
    assert "Traceback" not in message
    assert not list(out.glob("*.room"))


def test_a_recording_that_does_not_close_is_left(short, tmp_path, monkeypatch):
    never, let_go = threading.Event(), []
    monkeypatch.setattr(record, "PATIENCE", 0.05)
    monkeypatch.setattr(rr.RecordingStream, "disconnect", lambda _: never.wait(60))
    monkeypatch.setattr(rr, "unregister_shutdown", lambda: let_go.append(True))
    with record.Recording(short[0], tmp_path / "recording.rrd") as recording:
        pass
    never.set()
    assert "not closed within 0.2 s" in (recording.lost_file or "")
    assert let_go == [True]
