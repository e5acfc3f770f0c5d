"""A viewer on this machine: addresses, a live flight, pictures of what it shows."""

import contextlib
import os
import socket
import subprocess
import sys
import time
from urllib.parse import urlsplit

import numpy as np
import psutil
import pytest
import rrd
from PIL import Image
from rerun.experimental import ViewerClient

from spacecraft_sim import cli, record_stream, viewer
from spacecraft_sim.record_stream import Outlet, Stream, rr

NAME = "efremov-nonlocal"
# A viewer is left running on purpose, which Python would remark on.
outlives = pytest.mark.filterwarnings(
    "ignore::ResourceWarning", "ignore::pytest.PytestUnraisableExceptionWarning"
)
HEADLESS = (viewer.HEADLESS, "--window-size", "1600x900", "--hide-welcome-screen")


@pytest.fixture
def listening():
    """Port of this machine on which somebody listens."""
    with socket.socket() as server:
        server.bind(("127.0.0.1", 0))
        server.listen()
        yield server.getsockname()[1]


@contextlib.contextmanager
def opened(options=HEADLESS):
    """Address of a viewer without a window; skips where the machine cannot draw one."""
    mine = psutil.Process()
    before = {child.pid for child in mine.children()}
    try:
        address = viewer.spawn(options)
    except ValueError as error:
        pytest.skip(f"no viewer can be had here, not even without a window: {error}")
    try:
        yield address
    finally:
        for child in mine.children():
            if child.pid not in before:
                for process in (*child.children(recursive=True), child):
                    with contextlib.suppress(psutil.NoSuchProcess):
                        process.kill()
                child.wait(10)


# -- addresses ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text",
    ["{}", ":{}", "127.0.0.1:{}", "localhost:{}", "127.0.0.1:{}/proxy",
     "rerun+http://127.0.0.1:{}/proxy", "rerun+http://localhost:{}/proxy"],
)  # fmt: skip
def test_an_address_may_be_given_in_many_forms(text, listening):
    found = viewer.found(text.format(listening))
    assert found == f"rerun+http://127.0.0.1:{listening}/proxy"


def test_no_address_is_no_viewer():
    assert viewer.found(None) is None


@pytest.mark.parametrize("host", ["192.168.1.7", "0.0.0.0", "8.8.8.8", "[2001:db8::1]"])
def test_other_machines_are_refused(host):
    with pytest.raises(ValueError, match="another machine"):
        viewer.found(f"{host}:9876")


@pytest.mark.parametrize("text", ["somewhere", "host.example:9876", "127.0.0.1:port", "a:b:c"])
def test_what_is_no_address_is_refused_with_an_example(text):
    with pytest.raises(ValueError, match=r"not an address.*127\.0\.0\.1:9876"):
        viewer.found(text)


@pytest.mark.parametrize("port", ["0", "65536"])
def test_ports_that_cannot_be_are_refused(port):
    with pytest.raises(ValueError, match=f"port {port}"):
        viewer.found(f"127.0.0.1:{port}")


def test_a_run_is_refused_before_it_begins_if_no_viewer_listens(listening, tmp_path, capsys):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    words = ["run", NAME, "--out", str(tmp_path / "out"), "--connect", str(port)]
    assert cli.main(words) == 2
    message = capsys.readouterr().err
    assert f"no viewer listens on 127.0.0.1, port {port}" in message
    assert "--spawn" in message
    assert not (tmp_path / "out").exists()


def test_without_a_display_no_viewer_is_spawned(tmp_path, monkeypatch, capsys):
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr("platform.system", lambda: "Linux")
    assert cli.main(["run", NAME, "--out", str(tmp_path / "out"), "--spawn"]) == 2
    assert "no display for a viewer" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_connect_and_spawn_exclude_each_other(capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(["run", NAME, "--connect", "--spawn"])
    assert end.value.code == 2


@outlives
def test_a_viewer_that_does_not_start_is_a_clear_error():
    with pytest.raises(ValueError, match="the viewer ended with code"):
        viewer.spawn((viewer.HEADLESS, "--no-such-option"))


def test_a_viewer_that_answers_nothing_keeps_no_process_whose_run_was_killed(
    listening, monkeypatch
):
    monkeypatch.setattr(record_stream, "FLUSH", 0.2)
    outlet = Outlet("test", "one", rr.GrpcSink(f"rerun+http://127.0.0.1:{listening}/proxy"))
    process = outlet.process
    process.stdout.close()  # nobody is there to hear what it says
    stream = Stream([outlet])
    for _ in range(3):  # more than the way there takes
        stream.log("page", rr.TextDocument(os.urandom(100_000).hex()), static=True)
        stream.flush()
    stream.end()
    try:
        assert process.wait(60) == 1
    finally:
        process.kill()


# -- a viewer -------------------------------------------------------------------------------------


def live(test):
    """Marks a test that opens a viewer."""
    return pytest.mark.slow(outlives(test))


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Folder of a run of a minute."""
    folder = tmp_path_factory.mktemp("viewer") / "run"
    cli.main(["run", NAME, "--out", str(folder), "--set", "duration=60.0"])
    return folder


def wait_for(condition, patience=60.0):
    """What a condition gives as soon as it gives something."""
    end = time.monotonic() + patience
    while time.monotonic() < end:
        if found := condition():
            return found
        time.sleep(0.2)
    raise AssertionError(f"not within {patience} s")


@live
def test_a_viewer_listens_on_this_machine_alone():
    with opened() as address:
        port = urlsplit(address).port
        mine = [
            connection
            for process in psutil.Process().children(recursive=True)
            for connection in process.net_connections("inet")
            if connection.status == psutil.CONN_LISTEN
        ]
        assert port in {connection.laddr.port for connection in mine}
        assert {connection.laddr.ip for connection in mine} == {"127.0.0.1"}


@live
def test_each_view_of_a_recording_shows_something(flown, tmp_path):
    with opened() as address, ViewerClient.connect(address) as client:
        client.open(str(flown / "recording.rrd"))
        wait_for(lambda: not client.get_state().loading and client.get_state().views)
        client.set_time("sim_time", duration=52.3, play_state="paused")
        time.sleep(2.0)  # until it is painted; nothing says when
        views = {view.name: view for view in client.get_state().views if view.visible}
        for word in ("Bending", "Attitude", "Quasi-rigid angle within", "Rate", "Boom tips",
                     "Phase plane", "Thrust", "Relay", "Verdicts"):  # fmt: skip
            assert any(name.startswith(word) for name in views), word
        assert {name: view.reports for name, view in views.items() if view.reports} == {}
        painted, blank = [], []
        for name, view in views.items():
            if name in ("Events", "Scenario"):  # behind the verdicts
                continue
            path = tmp_path / "view.png"
            with contextlib.suppress(Exception):  # a view behind another is not painted
                path.unlink(missing_ok=True)
                client.save_screenshot(str(path), view.view_id)
            if path.exists():
                pixels = np.asarray(Image.open(path).convert("RGB")).reshape(-1, 3)
                painted.append(name)
                if len(np.unique(pixels, axis=0)) < 20:  # a blank view has one colour, or two
                    blank.append(name)
        assert blank == []
        assert len(painted) >= 8


@live
def test_a_flight_is_seen_while_it_is_flown_and_kept_in_the_file(tmp_path):
    with opened() as address, ViewerClient.connect(address) as client:
        run = started(tmp_path / "out", address, "duration=2000.0")

        def reached():
            lines = [t for r in client.get_state().recordings for t in r.timelines]
            return max((t.end or 0 for t in lines if t.name == "sim_time"), default=0)

        first = wait_for(reached)
        assert run.poll() is None  # it is under way
        wait_for(lambda: reached() > first)
        assert run.wait(120) in (0, 1), run.stderr.read()
        wait_for(lambda: reached() == 2000 * 10**9)
        assert rrd.stores(tmp_path / "out" / "recording.rrd") == (1, 1)


@live
def test_a_run_outlives_its_viewer(tmp_path):
    with opened() as address:
        port = urlsplit(address).port
        run = started(tmp_path / "out", address, "duration=600.0")
        path = tmp_path / "out" / "recording.rrd"
        wait_for(lambda: path.exists() and path.stat().st_size > 100_000)
        for process in psutil.Process().children(recursive=True):
            if "--port" in process.cmdline() and str(port) in process.cmdline():
                process.kill()
        _, message = run.communicate(timeout=180)
        assert run.returncode in (0, 1), message
        assert "the viewer was lost" in message
        entities = rrd.read(path)
        assert entities["/attitude/simulated"].time[-1] == 600.0
        assert rrd.chunks(path)


@live
def test_a_frozen_viewer_stops_no_run(tmp_path):
    with opened() as address:
        port = str(urlsplit(address).port)
        for process in psutil.Process().children(recursive=True):
            if port in process.cmdline():
                process.suspend()  # it still listens: the system takes what comes, up to a limit
        run = started(tmp_path / "out", address, "duration=60.0")
        _, message = run.communicate(timeout=120)
    assert run.returncode in (0, 1), message
    assert "the viewer was lost" in message
    path = tmp_path / "out" / "recording.rrd"
    assert rrd.chunks(path)
    assert rrd.read(path)["/attitude/simulated"].time[-1] == 60.0


def started(out, address, *settings):
    """A run in a process of its own that shows its flight."""
    words = ["run", NAME, "--out", str(out), "--connect", address, "--set", *settings]
    return subprocess.Popen(
        [sys.executable, "-m", "spacecraft_sim.cli", *words],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
        text=True,
    )
