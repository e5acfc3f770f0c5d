"""The scene of a recording: what the camera holds, where plumes leave the hull, what is plotted."""

import numpy as np
import pytest
import rrd

from spacecraft_sim import beneath, frames, mission, record, record_scene, run_folder, sketch
from spacecraft_sim.trajectory import selected

SINGLE = 1.2e-7  # relative rounding of rerun's vectors


def ready_for(name, *settings):
    return mission.assemble(mission.load_scenario(name, settings))


def written(ready, measured, predicted, path):
    subject = run_folder.subject(ready)
    record.write(path, subject, measured, beneath.reduced(subject, predicted), ())
    return rrd.read(path)


def test_the_camera_holds_all_that_an_arm_reaches():
    ready = ready_for("burkov-position", "duration=0.8")
    model, machine, flight = ready.mujoco.model.ptr, ready.machine, ready.fly()
    rest = frames.at_rest(model, machine)
    shown = frames.posed(model, machine, flight, ["joint_1", "joint_2"], 1.0)
    middle, radius = record_scene.ball(rest, [shown])
    # Elbow and tip from the angles alone; the links are 1 and 0.8 m long and hang.
    a, b = flight["joint_1"], flight["joint_1"] + flight["joint_2"]
    elbow = np.stack([np.sin(a), 0 * a, -np.cos(a)], axis=1)
    tip = elbow + 0.8 * np.stack([np.sin(b), 0 * b, -np.cos(b)], axis=1)
    points = np.vstack([np.zeros((1, 3)), elbow, tip]) + shown.positions["arm_1"][0]
    assert np.linalg.norm(points - middle, axis=1).max() <= radius
    # No farther than the box about it, whose half diagonal is sqrt(3) times half its size at most.
    assert radius <= np.sqrt(3) * (np.ptp(points, axis=0).max() / 2 + 0.1)


def test_without_frames_the_ball_is_about_the_first_body():
    ready = ready_for("burkov-permanent-rotation", "duration=0.1")
    rest = frames.at_rest(ready.mujoco.model.ptr, ready.machine)
    middle, radius = record_scene.ball(rest, ())
    np.testing.assert_array_equal(middle, rest.positions["bus"][0])
    for shape in rest.shapes:
        corners = sketch.surface(shape) + rest.positions[shape.body][0] - middle
        assert np.linalg.norm(corners, axis=1).max() <= radius * (1 + 1e-12)


def test_plumes_start_where_the_line_of_force_leaves_the_hull(tmp_path):
    ready = ready_for("ivanova-sokolov", "duration=1.0")
    rest = frames.at_rest(ready.mujoco.model.ptr, ready.machine)
    measured, predicted = ready.fly(), ready.fly("reduced")
    rows = len(measured.time)
    both = np.where(np.arange(rows) % 2, 0.02, -0.02)  # a thrust of both signs
    signals = {**measured.signals, "thruster_z": both, "thruster_z_command": both}
    entities = written(
        ready, type(measured)(time=measured.time, signals=signals, units=measured.units),
        predicted, tmp_path / "r.rrd",
    )  # fmt: skip
    jets = [(k, jet) for k, jet in enumerate(rest.jets) if jet.channel == "thruster_z"]
    assert jets
    for k, jet in jets:
        path = f"/world/simulated/{jet.body}/jets/thruster_z_{k}_0"
        frame = entities[path].static
        place = np.array(frame["Transform3D:translation"][0])
        turn = np.array(frame["Transform3D:mat3x3"][0]).reshape(3, 3).T  # by columns
        plume = entities[f"{path}/plume"]
        scale, start = (plume.array(f"Transform3D:{c}")[:, 0] for c in ("scale", "translation"))
        for level, found in ((1.0, scale[:, 2] > 0), (-1.0, scale[:, 2] < 0)):
            ((point, away),) = sketch.exhausts(jet, rest.shapes, level)
            assert found.any()
            starts = place + start[found] @ turn.T
            np.testing.assert_allclose(starts, np.tile(point, (found.sum(), 1)), atol=4 * SINGLE)
            ways = np.sign(scale[found, 2:]) * (turn @ [0, 0, 1])
            np.testing.assert_allclose(ways, np.tile(away, (found.sum(), 1)), atol=4 * SINGLE)


def test_a_law_that_points_one_direction_has_that_one_plotted(tmp_path):
    ready = ready_for("burkov-permanent-rotation", "duration=1.0")
    measured, predicted = ready.fly(), ready.fly("reduced")
    entities = written(ready, measured, predicted, tmp_path / "r.rrd")
    names = entities["/direction/simulated"].static["SeriesLines:names"]
    assert [name.partition(",")[0] for name in names] == ["s1 x", "s1 y", "s1 z"]


@pytest.mark.parametrize("size", [1, 9, 10_000])
def test_plumes_of_a_smooth_torque_are_thinned_but_end_with_the_flight(size, tmp_path):
    ready = ready_for("burkov-body-vectors", "duration=1.0")
    measured, predicted = ready.fly(), ready.fly("reduced")
    subject = run_folder.subject(ready)
    with record.Recording(subject, tmp_path / "r.rrd") as recording:
        recording.expect(beneath.reduced(subject, predicted))
        for k in range(0, len(measured.time), size):
            recording.take(selected(measured, slice(k, k + size)))
        recording.conclude(())
    plumes = [e for p, e in rrd.read(tmp_path / "r.rrd").items() if p.endswith("/plume")]
    assert plumes
    for plume in plumes:
        assert plume.time[-1] == pytest.approx(1.0, abs=0.02)
