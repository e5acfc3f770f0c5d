"""A run from Python leaves what the command leaves, with a law of the user's own."""

from dataclasses import dataclass

import pytest
import rrd
from rich.console import Console

from spacecraft_sim import cli, mission, plots, record_chart, report, run_folder
from spacecraft_sim.trajectory import Trajectory

LEFT = {"recording.rrd", "reduced.parquet", "report.html", "scenario.toml", "summary.png",
        "trajectory.parquet", "verdict.json"}  # fmt: skip


@dataclass(frozen=True)
class DeadZone:
    """A law that no registry knows."""

    width: float
    sensors, thrusters, period = ("attitude_z", "rate_z"), ("thruster_z",), 0.05

    def init(self):
        return None

    def step(self, t, y, memory):
        s = y[0] + 10 * y[1]
        return (0.0 if abs(s) < self.width else -1.0 if s > 0 else 1.0,), memory

    def events(self, t, y, memory):
        return ()


def test_a_law_of_ones_own_leaves_the_whole_folder(tmp_path):
    laws = {"dead_zone": lambda model, thrusters, *, width: (DeadZone(width), ())}
    settings = ("controller={law='dead_zone', width=0.01}", "duration=20.0")
    ready = mission.assemble(mission.load_scenario("efremov-nonlocal", settings, laws), laws)
    plants = []

    def flown(mission, plant, watch=None):
        plants.append(plant)
        return mission.fly(plant, watch=watch)

    folder = run_folder.create(tmp_path / "run", "dead-zone")
    done = run_folder.fly(folder, ready, flown=flown)
    assert plants == ["reduced", "mujoco"]
    assert {path.name for path in folder.iterdir()} == LEFT
    assert (done.lost_file, done.lost_viewer) == (None, None)
    assert done.comparison
    assert [verdict.outcome for verdict in done.comparison.verdicts] == ["holds"]  # momentum
    saved = Trajectory.load(folder / "trajectory.parquet")
    assert saved.time[-1] == done.measured.time[-1] == 20.0
    assert rrd.read(folder / "recording.rrd")["/attitude/simulated"].time[-1] == 20.0


@pytest.mark.parametrize("width", [80, 119, 120, 200])
def test_a_narrow_terminal_loses_no_digit(width):
    ready = mission.assemble(mission.load_scenario("efremov-nonlocal", ("duration=20.0",)))
    comparison = ready.judge(ready.fly(), ready.fly("reduced"))
    console = Console(width=width)
    with console.capture() as shown:
        console.print(cli._verdict_table(comparison, width))
    lines = shown.get().splitlines()
    assert max(map(len, lines)) <= width
    for verdict in comparison.verdicts:
        assert any(f"{verdict.bound:.6g} {verdict.unit}" in line for line in lines)
    assert ("source" in lines[1]) == (width >= 120)
    failed = list(cli._failed_assumptions(comparison))
    texts = {str(a) for verdict in comparison.verdicts for a in verdict.failed}
    assert sorted(line.split(": ", 1)[1].rpartition(" (")[0] for line in failed) == sorted(texts)
    assert any("until the pulses have acted" in line and "(1 claim)" in line for line in failed)


@pytest.mark.parametrize("exaggeration", [None, 7.0])
def test_the_pictures_bend_as_far_as_is_asked(exaggeration, tmp_path, monkeypatch):
    drawn = []
    monkeypatch.setattr(plots, "summary", lambda *_, drawing, **__: drawn.append(drawing))
    monkeypatch.setattr(report, "write", lambda *_, drawing, **__: drawn.append(drawing))
    ready = mission.assemble(mission.load_scenario("efremov-nonlocal", ("duration=2.0",)))
    run_folder.fly(tmp_path, ready, exaggeration=exaggeration)
    found = {drawing.bending for drawing in drawn}
    assert len(drawn) == 2
    assert (found == {7.0}) == (exaggeration == 7.0)
    assert len(found) == 1


def test_planes_of_several_axes_name_theirs():
    ready = mission.assemble(mission.load_scenario("sokolov-attitude", ("duration=20.0",)))
    flight = ready.fly("reduced")
    drawn = record_chart.planes(ready.controller.charts, [flight], ready.bands)
    views = record_chart.plane_views(drawn, {"simulated": 20.0}, following=False)
    told = b"".join(view.encoded() for view in views)
    for axis in "xyz":
        assert f"Phase plane {axis}, whole flight".encode() in told
    one = [plane for plane in drawn if plane.portrait.signals[0].endswith("_x")]
    alone = record_chart.plane_views(one, {"simulated": 20.0}, following=False)
    assert b"Phase plane, whole flight" in b"".join(view.encoded() for view in alone)
