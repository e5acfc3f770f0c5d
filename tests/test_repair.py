"""A run that is killed leaves a whole recording; killed with all that it started, one that reads.

`repair` makes that whole.
"""

import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import psutil
import pytest
import rrd

from spacecraft_sim import cli, mission
from spacecraft_sim import repair as repairs
from spacecraft_sim.record_stream import Outlet, Stream, rr
from spacecraft_sim.repair import end, repair

NAME = "efremov-nonlocal"
FOR_THE_RUN = (signal.SIGTERM, signal.SIGINT, signal.SIGHUP)


def started(out, size):
    """A long run whose recording has come to a size, bytes."""
    words = ["run", NAME, "--out", str(out), "--set", "duration=1500.0"]
    command = [sys.executable, "-m", "spacecraft_sim.cli", *words]
    run = subprocess.Popen(command, start_new_session=True)
    path, deadline = out / "recording.rrd", time.monotonic() + 120
    while not path.exists() or path.stat().st_size < size:
        assert run.poll() is None
        assert time.monotonic() < deadline
        time.sleep(0.002)
    return run, path


def killed(out, size):
    """The recording of a long run that was killed with all that it started, as by a power cut."""
    run, path = started(out, size)
    recorders = psutil.Process(run.pid).children()
    os.killpg(run.pid, signal.SIGKILL)
    run.wait()
    psutil.wait_procs(recorders, 60)
    return path


@pytest.fixture(scope="module")
def broken(tmp_path_factory):
    """A recording of a killed run, some chunks into its flight on MuJoCo."""
    return killed(tmp_path_factory.mktemp("killed") / "run", 1_500_000)


def test_the_file_of_a_killed_run_reads_up_to_its_last_rows(broken):
    entities = rrd.read(broken)
    assert rrd.stores(broken) == (1, 1)  # with its layout
    found = entities["/attitude/simulated"]
    assert len(found.time) > 250
    duration = f"duration={np.ceil(found.time[-1] + 1)}"
    flight = mission.assemble(mission.load_scenario(NAME, (duration,))).fly()
    rows = flight.time[: len(found.time)]
    np.testing.assert_allclose(found.time, rows, rtol=0, atol=1.1e-9)  # whole nanoseconds
    wanted = flight["attitude_z"][: len(rows)]
    np.testing.assert_array_equal(found.array("Scalars:scalars")[:, 0], wanted)
    (page,) = entities["/verdicts"].static["TextDocument:text"]
    assert page.startswith("# Not judged")
    with pytest.raises(RuntimeError, match="without footer"):
        rrd.chunks(broken)


@pytest.mark.parametrize("how", [signal.SIGKILL, *FOR_THE_RUN])
def test_a_run_that_is_killed_alone_leaves_a_whole_recording(how, tmp_path, capsys):
    run, path = started(tmp_path / "run", 1_000_000)
    (recorder,) = psutil.Process(run.pid).children()
    with pytest.raises(ValueError, match=r"recording\.rrd: still being written"):
        repair(path)
    if how == signal.SIGKILL:
        run.kill()
    else:  # as a terminal or `timeout` does it: all are told
        os.killpg(run.pid, how)
    assert run.wait(60) != 0
    psutil.wait_procs([recorder], 60)
    assert rrd.chunks(path)  # refused without a footer
    assert rrd.stores(path) == (1, 1)
    assert end(path) > 1.0
    assert cli.main(["repair", str(path)]) == 0
    assert "whole already" in capsys.readouterr().out


def test_signals_while_its_process_starts_break_no_recording(tmp_path):
    outlet = Outlet("test", "one", rr.FileSink(str(tmp_path / "recording.rrd")))
    process, deadline = psutil.Process(outlet.process.pid), time.monotonic() + 60
    while not any("numpy" in file.path for file in process.memory_maps()):  # rerun is next
        assert time.monotonic() < deadline
        time.sleep(0.002)
    for kind in FOR_THE_RUN:
        process.send_signal(kind)
    Stream([outlet]).flush()
    assert outlet.close() is None


def test_repair_restores_the_footer_and_changes_nothing_else(broken, tmp_path, capsys):
    path = shutil.copy(broken, tmp_path / "recording.rrd")
    before = rrd.read(path)
    assert cli.main(["repair", str(path)]) == 0
    shown = capsys.readouterr().out
    last = max(entity.time[-1] for entity in before.values() if len(entity.time))
    assert f"repaired; it reads up to t = {last:.6g} s" in shown
    assert rrd.chunks(path)
    assert rrd.stores(path) == (1, 1)
    after = rrd.read(path)
    assert set(after) == set(before)
    for name, entity in before.items():
        assert entity.static == after[name].static
        assert entity.values == after[name].values
        np.testing.assert_array_equal(entity.time, after[name].time)
    assert [p.name for p in tmp_path.iterdir()] == ["recording.rrd"]


def test_what_is_whole_is_left_alone(broken, tmp_path, capsys):
    path = shutil.copy(broken, tmp_path / "recording.rrd")
    assert repair(path)
    data = path.read_bytes()
    assert not repair(path)
    assert path.read_bytes() == data
    assert cli.main(["repair", str(tmp_path)]) == 0  # the folder of the run
    assert f"{path}: whole already" in capsys.readouterr().out


@pytest.mark.parametrize("share", [0.3, 0.55, 0.999])
def test_a_file_cut_anywhere_is_repaired_as_far_as_it_reads(broken, share, tmp_path):
    data = broken.read_bytes()
    path = tmp_path / "cut.rrd"
    path.write_bytes(data[: int(share * len(data)) + 7])
    assert repair(path)
    assert rrd.chunks(path)
    whole, found = rrd.read(broken), rrd.read(path)
    assert 0 < end(path) <= max(e.time[-1] for e in whole.values() if len(e.time))
    entity = found["/attitude/simulated"]
    wanted = whole["/attitude/simulated"].values["Scalars:scalars"][: len(entity.time)]
    # A cut early in the file may leave the look of a curve and none of its points.
    assert len(entity.time) > 0 or share < 0.5
    assert list(entity.values.get("Scalars:scalars", [])) == list(wanted)


@pytest.mark.parametrize(
    ("data", "word"),
    [
        (None, "No such file"),
        (b"", "not a recording"),
        (b"title = 'a scenario'", "not a recording"),
        (b"RRF2" + bytes(400), "nothing of it can be read"),
    ],
)
def test_what_cannot_be_repaired_is_refused_and_left_alone(data, word, tmp_path, capsys):
    path = tmp_path / "mine.rrd"
    if data is not None:
        path.write_bytes(data)
    assert cli.main(["repair", str(path)]) == 2
    message = capsys.readouterr().err
    assert word in message
    assert str(path) in message
    assert [p.read_bytes() for p in tmp_path.iterdir()] == ([] if data is None else [data])


def test_without_room_for_the_repaired_file_the_broken_one_is_left(broken, tmp_path, monkeypatch):
    path, free = shutil.copy(broken, tmp_path / "recording.rrd"), broken.stat().st_size - 1
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=free))
    with pytest.raises(ValueError, match=r"takes 1\.\d MB; 1\.\d MB are free: make room"):
        repair(path)
    assert path.read_bytes() == broken.read_bytes()


def test_a_repair_that_is_killed_is_told(broken, tmp_path, monkeypatch):
    path = shutil.copy(broken, tmp_path / "recording.rrd")
    monkeypatch.setattr(repairs, "RERUN", ("sh", "-c", "kill -KILL $$"))
    with pytest.raises(ValueError, match=r"nothing of it can be read: rerun ended with -9"):
        repair(path)
    assert path.read_bytes() == broken.read_bytes()


@pytest.mark.parametrize("place", ["mkdtemp", "replace"])
def test_a_folder_that_takes_no_files_is_told(place, broken, tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise PermissionError(13, "Permission denied")

    owner = tempfile if place == "mkdtemp" else Path
    monkeypatch.setattr(owner, place, refuse)
    path = shutil.copy(broken, tmp_path / "recording.rrd")
    with pytest.raises(ValueError, match=r"recording\.rrd: cannot be replaced: Permission denied"):
        repair(path)
    assert path.read_bytes() == broken.read_bytes()


@pytest.mark.slow
@pytest.mark.parametrize("size", [50_000, 150_000, 700_000])
def test_a_run_may_be_killed_at_any_moment(size, tmp_path):
    path = killed(tmp_path / "run", size)
    whole = not repair(path)
    assert not whole
    assert rrd.stores(path)[0] == 1
    assert "/scenario" in rrd.read(path)


@pytest.mark.slow
def test_a_run_killed_at_its_first_byte_leaves_what_reads_or_is_refused(tmp_path):
    path = killed(tmp_path / "run", 1)
    try:
        repair(path)
    except ValueError as refusal:
        assert "nothing of it can be read" in str(refusal)  # noqa: PT017 - it is a race by nature
    else:
        assert rrd.stores(path)[0] >= 1
