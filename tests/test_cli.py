"""The command: what it prints, the folder of a run, exit codes, what it says to bad input."""

import json
import re
import shutil
import tomllib

import mujoco
import pyarrow.parquet as pq
import pytest

from spacecraft_sim import cli, library, versions
from spacecraft_sim.trajectory import Trajectory

NAME, ATTITUDE = "efremov-nonlocal", "attitude_z"
# Rest near the target, where every claim holds after a minute and a half.
CALM = (
    "duration=100.0",
    "initial.attitude=[0.0, 0.0, 0.001]",
    "initial.rate=[0.0, 0.0, 0.0]",
    "initial.boom_amplitude=0.0",
    "controller.attraction_level=0.0",
    "booms.all.n_hinges=4",  # stiffer booms, which the relay hardly moves
    "booms.all.bending_stiffness=875.0",
)
SHORT = ("duration=2.0",)


def run(out, *settings, name=NAME):
    changes = ["--set", *settings] if settings else []
    return cli.main(["run", str(name), "--out", str(out), *changes])


@pytest.fixture(scope="module")
def calm(tmp_path_factory):
    """(exit code, folder) of one complete run."""
    out = tmp_path_factory.mktemp("runs") / "calm"
    return run(out, *CALM), out


# -- list, explain, export ------------------------------------------------------------------------


def test_list_names_scenarios_spacecraft_and_laws(capsys):
    assert cli.main(["list"]) == 0
    shown = capsys.readouterr().out
    for name in (*library.scenario_names(), *library.spacecraft_names(), "efremov_nonlocal"):
        assert re.search(rf"^\s*{re.escape(name)}\s+\S", shown, re.MULTILINE), name


def test_explain_gives_parameters_units_defaults_predictions_and_source(capsys):
    assert cli.main(["explain", NAME, "--set", "controller.accuracy=0.0071"]) == 0
    shown = capsys.readouterr().out
    lines = {line.split()[0]: line for line in shown.splitlines() if line.strip()}
    for key, value, unit in (
        ("duration", "448.8", " s "),
        ("initial.boom_amplitude", "0.1", " m "),
        ("booms.left.bending_stiffness", "35.0", " N m^2 "),
        ("thrusters.thruster_z.delay.mean", "0.2", " s "),
        ("controller.c", "0.31", " 1/s "),
        ("controller.accuracy", "0.0071", " rad "),
        ("simulation.substeps", "", ""),
    ):
        assert value in lines[key], key
        assert unit in lines[key], key
    assert "required" in lines["controller.c"]
    assert "Theorem 2" in shown
    assert "Efremov et al. 2006" in shown
    assert "0.826439" in shown  # the period of the limit cycle
    assert "c h0 < ln(15/14): 0.0651 < 0.0689929" in shown


# -- the folder of a run --------------------------------------------------------------------------


def test_a_run_whose_claims_hold_ends_with_0(calm):
    code, folder = calm
    assert code == 0
    names = {"recording.rrd", "summary.png", "trajectory.parquet", "verdict.json", "scenario.toml"}
    assert names <= {path.name for path in folder.iterdir()}
    assert (folder / "summary.png").read_bytes().startswith(b"\x89PNG")
    assert (folder / "recording.rrd").read_bytes().startswith(b"RRF")


def test_a_claim_that_fails_ends_with_1_and_a_table(tmp_path, capsys):
    assert run(tmp_path / "out", *SHORT) == 1  # two seconds prove nothing
    shown = capsys.readouterr()
    head = next(line for line in shown.out.splitlines() if "claim" in line)
    assert head.split() == ["claim", "predicted", "measured", "bound", "margin", "source"]
    assert "not judged" in shown.out
    assert shown.err == ""  # quiet when it is not a terminal
    assert shown.out.splitlines()[-1].endswith(f"rerun {tmp_path / 'out' / 'recording.rrd'}")


def test_verdict_has_the_names_that_programs_read(calm):
    verdict = json.loads((calm[1] / "verdict.json").read_text())
    names = ["claim", "source", "holds", "margin", "predicted", "measured", "bound", "assumptions"]
    assert verdict["verdicts"]
    for entry in verdict["verdicts"]:
        assert set(names) <= set(entry)
        assert isinstance(entry["holds"], bool)
        assert isinstance(entry["assumptions"], list)
    assert verdict["comparison"]
    for entry in verdict["comparison"]:
        assert {"signal", "max_error", "rms_error"} <= set(entry)
        assert 0 <= entry["rms_error"] <= entry["max_error"]
    claims = {entry["claim"] for entry in verdict["verdicts"]}
    assert any("beta" in claim for claim in claims)
    assert any("attitude itself" in claim for claim in claims)  # apart from the pass on beta


def test_trajectory_has_units_and_meta_in_its_schema(calm):
    schema = pq.read_schema(calm[1] / "trajectory.parquet")
    assert schema.names[0] == "time"
    units = {name: schema.field(name).metadata[b"unit"].decode() for name in schema.names}
    assert units["attitude_z"] == "rad"
    assert units["thruster_z_impulse"] == "N m s"
    meta = json.loads(schema.metadata[b"spacecraft_sim"])["meta"]
    assert meta["plant"] == "mujoco"
    assert meta["versions"]["mujoco"] == mujoco.__version__


@pytest.mark.parametrize("moved", [False, True])
def test_the_resolved_scenario_flies_the_same_trajectory(moved, tmp_path, capsys):
    first, again = tmp_path / "first", tmp_path / "again"
    run(first, *SHORT, "seed=7", "initial.attitude_scatter=0.03", "thrusters.all.min_on_time=0.05")
    resolved = first / "scenario.toml"
    if moved:
        resolved = shutil.copy(resolved, tmp_path / "other.toml")
    run(again, name=resolved)
    for file in ("trajectory.parquet", "reduced.parquet"):
        one, other = Trajectory.load(first / file), Trajectory.load(again / file)
        assert list(one.signals) == list(other.signals)
        assert one.time.tobytes() == other.time.tobytes()
        for name in one.signals:
            assert one[name].tobytes() == other[name].tobytes(), name
    assert one[ATTITUDE][0] != 0.7  # scattered
    assert (first / "scenario.toml").read_text() == (again / "scenario.toml").read_text()
    table = tomllib.loads((first / "scenario.toml").read_text())
    assert table["thrusters"]["all"]["min_on_time"] == 0.05
    assert table["versions"]["mujoco"] == mujoco.__version__


def test_without_out_a_run_gets_a_folder_of_its_own(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    for _ in range(2):
        assert cli.main(["run", NAME, "--set", "duration=0.5"]) == 1
    assert len(list((tmp_path / "runs").iterdir())) == 2


def test_a_run_that_diverges_ends_with_3_and_keeps_what_it_recorded(tmp_path, capsys):
    out = tmp_path / "out"
    assert run(out, *SHORT, "initial.rate=[0.0, 0.0, 1e9]") == 3
    message = capsys.readouterr().err
    assert "diverged before t = " in message
    assert str(out) in message
    track = Trajectory.load(out / "trajectory.parquet")
    assert track["rate_z"][0] == 1e9
    assert "diverged" in track.meta
    assert not (out / "verdict.json").exists()


def test_a_run_that_crashes_ends_with_3_and_says_where_its_files_are(tmp_path, monkeypatch, capsys):
    def crash(*_, **__):
        raise RuntimeError("no paper left")

    monkeypatch.setattr("spacecraft_sim.run_folder.write_pictures", crash)
    assert run(tmp_path / "out", *SHORT) == 3
    message = capsys.readouterr().err
    assert "no paper left" in message
    assert str(tmp_path / "out") in message
    assert (tmp_path / "out" / "trajectory.parquet").exists()


# -- bad input ------------------------------------------------------------------------------------


def refused(tmp_path, capsys, *settings, name=NAME, out=None):
    """The message of a run that must end with 2 and leave the folder as it was."""
    before = sorted(tmp_path.rglob("*"))
    assert run(out or tmp_path / "out", *settings, name=name) == 2
    assert sorted(tmp_path.rglob("*")) == before
    shown = capsys.readouterr()
    assert shown.out == ""
    assert "Traceback" not in shown.err
    assert shown.err.startswith("spacecraft-sim: ")
    return shown.err


def test_all_misspelt_keys_are_named_at_once_with_the_nearest(tmp_path, capsys):
    message = refused(
        tmp_path, capsys,
        "duraton=3", "initial.atitude=1", "controller.gian=3", "simulation.timestp=1",
        "thrusters.all.dely=2", "booms.all.lenth=3", "disturbance.z.amplitud=1",
    )  # fmt: skip
    for path, near in (
        ("duraton", "duration"),
        ("initial.atitude", "attitude"),
        ("controller.gian", "gain"),
        ("simulation.timestp", "timestep"),
        ("thrusters.all.dely", "delay"),
        ("booms.all.lenth", "length"),
        ("disturbance.z.amplitud", "amplitude"),
    ):
        assert f"  {path}: unknown key; did you mean {near!r}?" in message


BAD_NUMBERS = """
booms.all.bending_stiffness=-1.0  booms.all.bending_stiffness=nan  booms.left.linear_density=-1.53
booms.left.linear_density=nan     booms.all.tip_mass=-1.0          booms.all.n_hinges=0
thrusters.all.delay=-0.2          thrusters.all.delay=nan          thrusters.all.delay=inf
thrusters.all.levels=[1.0,-2.0]   thrusters.all.rise_time=-1.0     thrusters.all.levels=[]
simulation.timestep=-0.01         simulation.timestep=0.0          simulation.substeps=0
duration=-1.0                     duration=nan                     duration=soon
controller.c=nan                  controller.c=-0.31               controller.accuracy=fine
controller.max_delay=-0.2         controller.period=0.0            disturbance.z.amplitude=nan
reduced.modes=-1                  seed=-1                          initial.boom_mode=0
"""


@pytest.mark.parametrize("setting", BAD_NUMBERS.split())
def test_numbers_that_cannot_be_are_refused(setting, tmp_path, capsys):
    message = refused(tmp_path, capsys, *SHORT, setting)
    key, _, value = setting.partition("=")
    assert key.rpartition(".")[2] in message
    assert value.rpartition(",")[2].strip("[]") in message


@pytest.mark.parametrize(
    ("settings", "parts"),
    [
        (["controller.max_delay=0.25"], ["c h0 < ln(15/14)", "0.0775", "0.0689929"]),
        (["controller.c=2.0"], ["c h0 < ln(15/14)", "0.42", "0.0689929"]),
        (["controller.gain=3.5"], ["gamma < 3", "3.5"]),
        (["controller.gain=1.5"], ["gamma > E/(10 - 9E)", "1.5", "2.70462"]),
        (["controller.radius=0.001"], ["eps < R", "0.007", "0.001"]),
        (["thrusters.all.delay=0.0"], ["'thruster_z' has neither delay", "controller.period"]),
        (["simulation.timestep=0.05"], ["timestep 0.05", "stability limit 0.03"]),
        (["thrusters.all.levels=[1.0]"], ["lacks 8.2826625", "levels = [1, 8.2826625"]),
        (["booms.all.root=lft_root"], ["site 'lft_root'", "mean 'left_root'?", "right_root"]),
        (["booms.middle.length=2.0"], ["boom 'middle'", "left", "right"]),
        (["thrusters.all.actuators=['motor']"], ["actuator 'motor'", "it has: thruster_z"]),
        (["controller.law=efremov_nonlocl"], ["controller.law", "mean 'efremov_nonlocal'?"]),
        (["spacecraft=two_bom"], ["'two_bom'", "did you mean 'two_boom'?", "two_boom_free"]),
        (["initial.attitude=[0.1, 0.0, 0.0]"], ["initial.attitude", "turns about"]),
        (["initial.boom_mode=2"], ["initial.boom_mode = 2", "1 modes"]),
        (["reduced.source=mjcf", "reduced.modes=9"], ["reduced.modes = 9", "8"]),
        (["booms.left.tip_mass=1.0"], ["galerkin", 'reduced.source = "mjcf"']),
        (["duration.x=3"], ["'duration' is a value, not a table"]),
    ],
)  # fmt: skip
def test_what_does_not_fit_is_refused_with_value_limit_and_choices(
    settings, parts, tmp_path, capsys
):
    message = refused(tmp_path, capsys, *settings).lower()
    for part in parts:
        assert part.lower() in message


def test_a_scenario_that_is_not_there(tmp_path, capsys):
    assert f"did you mean {NAME!r}?" in refused(tmp_path, capsys, name="efremov-nonlokal")
    missing = tmp_path / "missing.toml"
    assert f"{missing}: No such file" in refused(tmp_path, capsys, name=missing)


def test_a_scenario_that_is_not_toml(tmp_path, capsys):
    path = tmp_path / "broken.toml"
    path.write_text("title = ")
    assert "not TOML" in refused(tmp_path, capsys, name=path)


@pytest.fixture
def own_machine(tmp_path):
    """A user's copy of a scenario and its spacecraft; changes one text in the MJCF."""

    def make(old="", new="", remove=False):
        source = library.folder("models") / "two_boom"
        table = (source / "two_boom.toml").read_text().replace("scene.xml", "bus.xml")
        (tmp_path / "mine.toml").write_text(table)
        xml = (source / "two_boom.xml").read_text()
        assert old in xml
        if not remove:
            (tmp_path / "bus.xml").write_text(xml.replace(old, new) if old else xml)
        scenario = (library.folder("scenarios") / f"{NAME}.toml").read_text()
        path = tmp_path / "flight.toml"
        path.write_text(scenario.replace('"two_boom"', '"mine.toml"'))
        return path

    return make


def test_a_users_own_machine_flies(own_machine, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr("spacecraft_sim.run_folder.write_pictures", lambda *_: None)  # slow
    assert run(tmp_path / "out", *SHORT, name=own_machine()) == 1
    other = tmp_path / "elsewhere" / "scenario.toml"
    other.parent.mkdir()
    shutil.copy(tmp_path / "out" / "scenario.toml", other)  # it knows the machine's place
    assert run(tmp_path / "again", *SHORT, name=other) == 1


HINGE = '<joint name="attitude_z" type="hinge" axis="0 0 1"/>'


@pytest.mark.parametrize(
    ("old", "new", "parts"),
    [
        ('gravity="0 0 0"', 'gravity="0 0 -9.81"', ["gravity is on", "-9.81"]),
        ('contype="0" conaffinity="0"', "", ["contacts are on"]),
        ("</worldbody>", "", ["XML"]),
        ('type="hinge"', 'type="hingge"', ["hingge"]),
        ('name="left_root"', 'name="lft_root"', ["site 'left_root'", "did you mean 'lft_root'?"]),
        ('<motor name="thruster_z"', '<motor name="jet"', ["actuator 'thruster_z'", "jet"]),
        ('<body name="bus">', '<body name="hub">', ["body 'bus'", "hub"]),
        ('<jointpos name="attitude_z" joint="attitude_z"/>', "", ["'attitude_z'", "rate_z"]),
        ("<motor ", '<motor ctrlrange="-5 5" ', ["670.8", "ctrlrange", "5"]),
    ],
)
def test_a_bus_that_cannot_fly_is_refused(old, new, parts, own_machine, tmp_path, capsys):
    path = own_machine()
    if old == 'contype="0" conaffinity="0"':
        text = (tmp_path / "bus.xml").read_text()
        (tmp_path / "bus.xml").write_text(text.replace('<flag contact="disable"/>', ""))
    text = (tmp_path / "bus.xml").read_text()
    assert old in text
    (tmp_path / "bus.xml").write_text(text.replace(old, new))
    message = refused(tmp_path, capsys, *SHORT, name=path)
    for part in parts:
        assert part in message


def test_a_sensor_that_a_bus_cannot_have_is_refused_with_those_it_has(
    own_machine, tmp_path, capsys
):
    # On two hinges there is no single quasi-rigid angle.
    path = own_machine(HINGE, f'{HINGE}<joint name="tilt" type="hinge" axis="0 1 0"/>')
    message = refused(tmp_path, capsys, *SHORT, "reduced.source=mjcf", name=path)
    assert "'quasi_rigid_" in message
    assert "it has: attitude_z" in message


def test_a_missing_mjcf_is_named(own_machine, tmp_path, capsys):
    path = own_machine(remove=True)
    assert str(tmp_path / "bus.xml") in refused(tmp_path, capsys, name=path)


def test_a_folder_that_exists_is_not_touched(tmp_path, capsys):
    out = tmp_path / "mine"
    out.mkdir()
    (out / "notes.txt").write_text("precious")
    assert "exists already" in refused(tmp_path, capsys, out=out)
    assert (out / "notes.txt").read_text() == "precious"


def test_a_folder_that_cannot_be_made_is_refused(tmp_path, capsys):
    (tmp_path / "file").write_text("")
    assert "cannot be written" in refused(tmp_path, capsys, out=tmp_path / "file" / "out")


@pytest.mark.parametrize("words", [f"run {NAME}", f"explain {NAME}", "export two_boom x.xml"])
def test_mujoco_4_is_refused_with_what_to_install(words, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(versions, "version", lambda name: "4.0.1")
    assert cli.main(words.split()) == 2
    message = capsys.readouterr().err
    assert "MuJoCo 4.0.1 is installed" in message
    assert '"mujoco>=3.17,<4"' in message
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("words", ["", "fly", "run", "export two_boom", f"run {NAME} -x"])
def test_usage_errors_end_with_2(words, capsys):
    with pytest.raises(SystemExit) as end:
        cli.main(words.split())
    assert end.value.code == 2
    assert "usage:" in capsys.readouterr().err
