"""The recording of a run, read back with rerun's own reader, and how it is streamed."""

import json

import numpy as np
import pytest
import rrd
from scipy.spatial.transform import Rotation

from spacecraft_sim import beneath, cli, mission, record, run_folder, simulate
from spacecraft_sim.trajectory import Trajectory, moving_axes, selected

NAME, DURATION = "efremov-nonlocal", 60.0  # the pulses, and 11 s of the relay
NANOSECOND = 1.1e-9  # to which rerun rounds times
SINGLE = 1.2e-7  # relative rounding of rerun's vectors


def fly(out, *settings, name=NAME, words=()):
    changes = [f"duration={DURATION}", *settings]
    return cli.main(["run", name, "--out", str(out), *words, "--set", *changes])


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    """Folder of a run, its entities and both flights."""
    folder = tmp_path_factory.mktemp("record") / "run"
    fly(folder)
    flights = [Trajectory.load(folder / f"{name}.parquet") for name in ("trajectory", "reduced")]
    return folder, rrd.read(folder / "recording.rrd"), *flights


@pytest.fixture(scope="module")
def short():
    """A mission and its flights, to be recorded in many ways."""
    ready = mission.assemble(mission.load_scenario(NAME, ("duration=12.0",)))
    return ready, ready.fly(), ready.fly("reduced")


def same_times(found, wanted):
    np.testing.assert_allclose(found, wanted, rtol=0, atol=NANOSECOND)


# -- what is in it --------------------------------------------------------------------------------


def test_one_recording_with_one_blueprint_and_a_footer(flown):
    path = flown[0] / "recording.rrd"
    assert rrd.stores(path) == (1, 1)
    assert rrd.chunks(path) > 100


@pytest.mark.parametrize("view", ["attitude", "quasi_rigid_angle", "rate", "quasi_rigid_rate"])
@pytest.mark.parametrize(("key", "plant"), [("simulated", 2), ("reduced", 3)])
def test_every_row_of_a_history_is_there_to_the_last_digit(flown, view, key, plant):
    entity, flight = flown[1][f"/{view}/{key}"], flown[plant]
    same_times(entity.time, flight.time)
    wanted = np.stack([flight[f"{view}_{axis}"] for axis in moving_axes(flight, view)], axis=1)
    np.testing.assert_array_equal(entity.array("Scalars:scalars"), wanted)
    assert entity.values["Scalars:scalars"][-1] == wanted[-1].tolist()
    assert entity.time[0] == 0.0
    assert entity.time[-1] == DURATION
    unit = flight.units[f"{view}_z"]
    for name in entity.static["SeriesLines:names"]:
        assert name.endswith(f"[{unit}]")
        assert ("MuJoCo" in name) == (key == "simulated")


@pytest.mark.parametrize(("key", "plant"), [("simulated", 2), ("reduced", 3)])
def test_tips_of_all_booms_are_there(flown, key, plant):
    entity, flight = flown[1][f"/tips/{key}"], flown[plant]
    wanted = np.stack([flight["left_tip_y"], flight["right_tip_y"]], axis=1)
    np.testing.assert_array_equal(entity.array("Scalars:scalars"), wanted)


def test_lanes_and_steps_tell_command_and_thrust(flown):
    _, entities, flight, _ = flown
    for lane, signal in (("command", "thruster_z_command"), ("delivered", "thruster_z")):
        value = flight[signal]
        rows = np.flatnonzero(np.r_[True, np.diff(value) != 0])
        states = entities[f"/relay/thruster_z/{lane}"]
        same_times(states.time, flight.time[rows])
        words = [state for (state,) in states.values["StateChange:state"]]
        figures = [0.0 if word == "off" else float(word.split()[0]) for word in words]
        np.testing.assert_allclose(figures, value[rows], rtol=5e-4)  # four digits are written
        assert all(word == "off" or word.endswith(" N m") for word in words)
        assert set(words) <= set(states.static["StateConfiguration:values"])
        steps = entities[f"/thrust/thruster_z/{lane}"]
        assert steps.time[-1] == DURATION  # the line reaches to the end
        at = np.searchsorted(flight.time, steps.time + NANOSECOND, side="right") - 1
        np.testing.assert_array_equal(steps.array("Scalars:scalars")[:, 0], value[at])


def test_a_plume_is_lit_while_its_thruster_fires(flown):
    _, entities, flight, _ = flown
    plumes = [e for path, e in entities.items() if path.endswith("/plume")]
    assert len(plumes) == 2  # a pure torque is drawn as a pair
    for plume in plumes:
        length = plume.array("Transform3D:scale")[:, 0, 2]
        at = np.searchsorted(flight.time, plume.time + NANOSECOND, side="right") - 1
        thrust = flight["thruster_z"][at]
        assert np.all((np.abs(length) > 0.1) == (thrust != 0))
        assert np.all(np.sign(length[thrust != 0]) == np.sign(thrust[thrust != 0]))
        higher = np.abs(length[np.abs(thrust) > 2]).min()
        assert higher > np.abs(length[np.abs(thrust) == 1]).max()


@pytest.mark.parametrize(("key", "plant"), [("simulated", 2), ("reduced", 3)])
def test_the_bus_is_drawn_in_its_attitude(flown, key, plant):
    entity, flight = flown[1][f"/world/{key}/bus"], flown[plant]
    angle = np.interp(entity.time, flight.time, flight["attitude_z"])
    turn = Rotation.from_quat(entity.array("Transform3D:quaternion")[:, 0])
    np.testing.assert_allclose(turn.as_rotvec()[:, 2], angle, atol=2 * SINGLE)
    assert entity.time[-1] == DURATION
    spacing = np.diff(entity.time)
    assert spacing.max() < 0.2 + NANOSECOND  # smooth enough to watch


def test_the_last_drawn_tip_is_the_last_reading_times_the_stated_factor(flown):
    _, entities, *flights = flown
    (text,) = entities["/verdicts"].static["TextDocument:text"]
    factor = float(text.partition("Booms are drawn bent ")[2].split()[0])
    assert factor > 1
    for key, flight in zip(("simulated", "reduced"), flights, strict=True):
        tip = entities[f"/world/{key}/booms"].values["LineStrips3D:strips"][-1][0][-1]
        inside = Rotation.from_rotvec([0, 0, -flight["attitude_z"][-1]]).apply(tip)
        assert inside[1] == pytest.approx(factor * flight["left_tip_y"][-1], abs=11 * SINGLE)


def test_the_bound_is_a_band_over_the_whole_flight(flown):
    band = flown[1]["/0_bounds/0_quasi_rigid_angle_z"]
    edges = band.array("Scalars:scalars")[:, 0]
    assert set(edges) == {-0.007, 0.007}
    assert np.all(edges[1:] == -edges[:-1])  # from edge to edge, so that it is filled
    assert band.time[0] == 0.0
    assert band.time[-1] == pytest.approx(DURATION)
    assert len(edges) > 1000  # more than a plot has columns


def test_bounds_lie_beneath_all_that_they_bound(flown):
    paths = [p for p, entity in flown[1].items() if "SeriesLines:names" in entity.static]
    bounds = [p for p in paths if p.startswith("/0_bounds/")]
    # The viewer draws lines over each other in the order of their paths, capitals as small letters.
    assert sorted(paths, key=str.casefold)[: len(bounds)] == sorted(bounds)


def test_events_tell_switchings_levels_and_verdicts(flown):
    _, entities, flight, _ = flown
    events = entities["/events"]
    texts = [text for (text,) in events.values["TextLog:text"]]
    changes = sum(
        1 + np.count_nonzero(np.diff(flight[signal]))
        for signal in ("thruster_z", "thruster_z_command")
    )
    assert sum(text.startswith("thruster_z ") for text in texts) == changes
    assert any("command switches: -8.283 N m" in text for text in texts)
    assert any("command changes level" in text for text in texts)
    verdicts = json.loads((flown[0] / "verdict.json").read_text())["verdicts"]
    assert any(not verdict["holds"] for verdict in verdicts)
    levels = [level for (level,) in events.values["TextLog:level"]]
    for verdict in verdicts:
        (row,) = [k for k, text in enumerate(texts) if f": {verdict['claim']}: " in text]
        assert (levels[row] == "ERROR") == (not verdict["holds"])
        when = DURATION if verdict["t_worst"] is None else verdict["t_worst"]
        assert events.time[row] == pytest.approx(when, abs=NANOSECOND)


def test_documents_give_verdicts_and_scenario(flown):
    folder, entities, *_ = flown
    (scenario,) = entities["/scenario"].static["TextDocument:text"]
    assert (folder / "scenario.toml").read_text().strip() in scenario
    (page,) = entities["/verdicts"].static["TextDocument:text"]
    table = json.loads((folder / "verdict.json").read_text())
    kept = sum(verdict["holds"] for verdict in table["verdicts"])
    assert page.startswith(f"# {kept} of {len(table['verdicts'])} claims hold")
    for verdict in table["verdicts"]:
        assert verdict["claim"].replace("|", "\\|") in page
        assert f"{verdict['measured']:.4g}" in page


def test_the_phase_plane_has_the_flight_and_the_lines_of_the_law(flown):
    _, entities, *flights = flown
    for key, flight in zip(("simulated", "reduced"), flights, strict=True):
        points = np.stack([flight[f"quasi_rigid_{kind}_z"] for kind in ("angle", "rate")], axis=1)
        now = entities[f"/phase/relay/flights/{key}/now"].array("Points2D:positions")[:, 0]
        np.testing.assert_allclose(now, points, rtol=SINGLE, atol=1e-12)
        strips = entities[f"/phase/relay/flights/{key}/track"].values["LineStrips2D:strips"]
        track = np.array([strip for (strip,) in strips])
        np.testing.assert_array_equal(track[1:, 0], track[:-1, -1])  # no gap
        np.testing.assert_allclose(track[-1, -1], points[-1], rtol=SINGLE, atol=1e-12)
    c = mission.load_scenario(NAME).controller["c"]
    scale = np.array(entities["/phase/relay/whole"].static["Transform3D:scale"][0][:2])
    (path,) = [
        p for p in entities if p.startswith("/phase/relay/whole/lines/0_") if "name" not in p
    ]
    beta, v = np.array(entities[path].static["LineStrips2D:strips"][0]).T * scale[:, None]
    np.testing.assert_allclose(v, -c * beta, rtol=1e-6)  # s = c beta + v = 0, single precision
    names = [e.static.get("Points2D:labels") for p, e in entities.items() if p.endswith("/name")]
    assert {"s = c beta + v = 0", "|s| = v1", "in the end"} <= {name for (name,) in names}


# -- streaming ------------------------------------------------------------------------------------


def written(path, short, sizes):
    """A recording that takes the flight in parts of the given sizes, one after the other."""
    ready, measured, predicted = short
    subject = run_folder.subject(ready)
    with record.Recording(subject, path) as recording:
        recording.expect(beneath.reduced(subject, predicted))
        k = 0
        while k < len(measured.time):
            size = sizes[k % len(sizes)]
            recording.take(selected(measured, slice(k, k + size)))
            k += size
        recording.conclude(ready.judge(measured, predicted).verdicts)
    return rrd.read(path)


def test_parts_of_any_size_make_the_same_signals(short, tmp_path):
    at_once = written(tmp_path / "one.rrd", short, [10_000])
    in_parts = written(tmp_path / "many.rrd", short, [1, 2, 30, 7, 3])
    assert set(at_once) == set(in_parts)
    for path, entity in at_once.items():
        other = in_parts[path]
        assert entity.static == other.static or path == "/__properties"
        if path.startswith(("/world", "/thrust")) or path.endswith("/track"):
            continue  # each part has a first and a last frame, step and strip of its own
        np.testing.assert_array_equal(entity.time, other.time, err_msg=path)
        assert entity.values == other.values, path


def test_two_recordings_in_one_viewer_keep_their_layouts(short, tmp_path):
    for name in ("one", "two"):
        written(tmp_path / f"{name}.rrd", short, [1000])
    one, two = (rrd.application(tmp_path / f"{name}.rrd") for name in ("one", "two"))
    assert one != two
    assert one.startswith("spacecraft_sim ")


def test_a_user_who_has_switched_rerun_off_gets_a_recording(short, tmp_path, monkeypatch):
    monkeypatch.setenv("RERUN", "off")
    assert "/attitude/simulated" in written(tmp_path / "r.rrd", short, [1000])


def test_the_flight_goes_out_while_it_is_flown(short, monkeypatch):
    ready, measured, _ = short
    monkeypatch.setattr(simulate, "CHUNK", 20)
    monkeypatch.setattr(simulate, "PAUSE", 0.0)
    seen, parts = [0.0], []

    def watch(part):
        parts.append(part)
        assert part.time[-1] <= seen[-1]  # nothing that was not flown yet

    again = ready.fly(progress=seen.append, watch=lambda part: watch(part))
    assert len(parts) > 5
    assert parts[0].time[-1] < 0.5 * again.time[-1]
    for name in measured.signals:  # each row once, and the flight is not disturbed
        joined = np.concatenate([part[name] for part in parts])
        np.testing.assert_array_equal(joined, measured[name])


def test_watching_is_no_more_frequent_than_it_says(short):
    parts = []
    short[0].fly(watch=parts.append)
    assert all(len(part.time) > simulate.CHUNK for part in parts[:-1])


def test_a_flight_that_diverges_leaves_a_whole_recording(tmp_path, capsys):
    out = tmp_path / "out"
    assert fly(out, "initial.rate=[0.0, 0.0, 1e9]") == 3
    entities = rrd.read(out / "recording.rrd")
    assert rrd.chunks(out / "recording.rrd")
    (page,) = entities["/verdicts"].static["TextDocument:text"]
    assert page.startswith("# Not judged")
    assert any("diverged" in text for (text,) in entities["/events"].values["TextLog:text"])


def test_a_crash_leaves_a_whole_recording(tmp_path, monkeypatch, capsys):
    def crash(*_, **__):
        raise RuntimeError("no judge left")

    monkeypatch.setattr("spacecraft_sim.mission.Mission.judge", crash)
    out = tmp_path / "out"
    assert fly(out, "duration=3.0") == 3
    assert rrd.chunks(out / "recording.rrd")
    assert rrd.read(out / "recording.rrd")["/attitude/simulated"].time[-1] == 3.0


# -- what can be chosen ---------------------------------------------------------------------------


def test_the_factor_of_the_bending_is_selectable(tmp_path, capsys):
    out = tmp_path / "out"
    fly(out, "duration=2.0", words=("--exaggeration", "3"))
    flight, entities = Trajectory.load(out / "trajectory.parquet"), rrd.read(out / "recording.rrd")
    tip = entities["/world/simulated/booms"].values["LineStrips3D:strips"][0][0][-1]
    inside = Rotation.from_rotvec([0, 0, -flight["attitude_z"][0]]).apply(tip)
    assert inside[1] == pytest.approx(3 * flight["left_tip_y"][0], abs=11 * SINGLE)


@pytest.mark.parametrize("factor", ["0", "-2", "nan", "inf"])
def test_a_factor_that_cannot_be_is_refused(factor, tmp_path, capsys):
    assert fly(tmp_path / "out", words=("--exaggeration", factor)) == 2
    message = capsys.readouterr().err
    assert "--exaggeration" in message
    assert factor in message
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    "settings",
    [
        ["spacecraft='two_boom_free'", "reduced.source='mjcf'", "controller.attraction_level=0.2"],
        ["spacecraft='rigid_bus'", "reduced.source='mjcf'", "reduced.modes=0",
         "controller={law='schmitt_trigger', threshold=0.02, lead=5.0}"],
    ],
    ids=["free", "rigid"],
)  # fmt: skip
def test_all_machines_can_be_recorded(settings, tmp_path, capsys):
    out = tmp_path / "out"
    assert fly(out, "duration=2.0", *settings) in (0, 1), capsys.readouterr().err
    entities = rrd.read(out / "recording.rrd")
    flight = Trajectory.load(out / "trajectory.parquet")
    assert entities["/attitude/simulated"].time[-1] == 2.0
    thrusters = {name for name in flight.signals if f"{name}_command" in flight.signals}
    for name in thrusters:
        assert f"/relay/{name}/delivered" in entities


@pytest.mark.parametrize(
    ("name", "view", "signals"),
    [
        ("burkov-position", "joint_angle", ["joint_1", "joint_2"]),
        ("burkov-body-vectors", "direction", [f"s{k}_{axis}" for k in (2, 3) for axis in "xyz"]),
    ],
)
def test_machines_with_torques_that_follow_show_what_they_read(
    name, view, signals, tmp_path, capsys
):
    out = tmp_path / "out"
    assert fly(out, "duration=1.5", name=name) in (0, 1), capsys.readouterr().err
    entities = rrd.read(out / "recording.rrd")
    for key, file in (("simulated", "trajectory"), ("reduced", "reduced")):
        entity, flight = entities[f"/{view}/{key}"], Trajectory.load(out / f"{file}.parquet")
        # Every fiftieth of a second a row, those there are, and the last.
        assert np.diff(entity.time).max() < 0.04
        rows = np.searchsorted(flight.time, entity.time - NANOSECOND)
        wanted = np.stack([flight[signal][rows] for signal in signals], axis=1)
        np.testing.assert_array_equal(entity.array("Scalars:scalars"), wanted)
        assert entity.time[-1] == flight.time[-1] == 1.5
    # Such a torque has no states, and its changes are no events.
    assert not any(path.startswith("/relay/") for path in entities)
    texts = [text for (text,) in entities["/events"].values["TextLog:text"]]
    assert all(text.startswith("claim ") for text in texts)
    assert any(path.startswith("/thrust/") for path in entities)


def test_an_hour_of_flight_takes_less_than_150_megabytes(flown):
    size = (flown[0] / "recording.rrd").stat().st_size
    assert size / DURATION * 3600 < 150e6
