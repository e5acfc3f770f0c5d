"""Where things are drawn: bending that is exaggerated, the ghost of the reduced model."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from spacecraft_sim import beam, drawing, frames, mission, mjcf, spacecraft
from spacecraft_sim.drawing import cross
from spacecraft_sim.mjcf import BUS
from spacecraft_sim.trajectory import Trajectory, selected

FREE = (
    "spacecraft='two_boom_free'",
    "reduced.source='mjcf'",
    "controller.attraction_level=0.2",
    "initial.attitude=[0.3, -0.2, 0.7]",
)


def flown(*settings, duration=3.0):
    ready = mission.assemble(
        mission.load_scenario("efremov-nonlocal", (f"duration={duration}", *settings))
    )
    return ready, ready.fly(), ready.fly("reduced")


@pytest.fixture(scope="module")
def planar():
    return flown()


@pytest.fixture(scope="module")
def free():
    return flown(*FREE)


def drawn(case, factor=1.0):
    """Frames of both plants."""
    ready, measured, predicted = case
    model, machine = ready.mujoco.model.ptr, ready.machine
    simulated = frames.simulated(model, machine, measured, factor)
    rest = frames.at_rest(model, machine)
    return simulated, frames.bus_alone(machine, rest, predicted, simulated, measured, factor)


def tips_in_root_frames(case, found, sign):
    """Tips of left and right boom, as their sensors would read them, from where they are drawn."""
    turn = Rotation.from_quat(found.quaternions[BUS], scalar_first=True)
    inside = turn.inv().apply(found.booms[sign][:, -1] - found.positions[BUS])
    side = 1 if sign == "left" else -1  # the right root is turned by half a revolution about z
    return side * inside[:, :2] - (3.0, 0.0)  # roots stand 3 m from the middle


@pytest.mark.parametrize("boom", ["left", "right"])
@pytest.mark.parametrize("case", ["planar", "free"])
def test_the_drawn_tip_is_where_the_sensor_says(case, boom, request):
    case = request.getfixturevalue(case)
    measured = case[1]
    tip = tips_in_root_frames(case, drawn(case)[0], boom)
    np.testing.assert_allclose(tip[:, 0], measured[f"{boom}_tip_x"], atol=1e-9)  # rounding
    np.testing.assert_allclose(tip[:, 1], measured[f"{boom}_tip_y"], atol=1e-9)


def test_bending_is_exaggerated_in_proportion(planar):
    straight, once, often = (drawn(planar, factor)[0].booms["left"] for factor in (0.0, 1.0, 7.0))
    np.testing.assert_allclose(often - straight, 7 * (once - straight), atol=1e-9)  # rounding
    assert np.abs(once - straight).max() > 0.1  # it does bend


@pytest.mark.parametrize("boom", ["left", "right"])
def test_the_tip_of_the_ghost_is_the_reading_times_the_factor(planar, boom):
    predicted = planar[2]
    tip = tips_in_root_frames(planar, drawn(planar, 5.0)[1], boom)
    np.testing.assert_allclose(tip[:, 1], 5 * predicted[f"{boom}_tip_y"], atol=1e-9)  # rounding


def test_the_ghost_has_the_shape_of_the_only_mode_of_the_galerkin_model(planar):
    ready, _, predicted = planar
    ghost = drawn(planar)[1]
    turn = Rotation.from_rotvec([0.0, 0.0, predicted["attitude_z"][0]])
    inside = turn.inv().apply(ghost.booms["left"][0]) - (3.0, 0.0, 0.0)
    q = ready.scenario.initial.boom_amplitude  # y = q Phi(x), by the definition of the model
    wanted = q * beam.mode_shape(1, inside[:, 0], 7.5)
    np.testing.assert_allclose(inside[:, 1], wanted, atol=1e-12)  # rounding


@pytest.mark.parametrize("case", ["planar", "free"])
def test_both_plants_are_drawn_alike_where_they_start(case, request):
    simulated, ghost = drawn(request.getfixturevalue(case))
    np.testing.assert_allclose(ghost.positions[BUS][0], simulated.positions[BUS][0], atol=1e-12)
    turns = [
        Rotation.from_quat(found.quaternions[BUS][0], scalar_first=True)
        for found in (simulated, ghost)
    ]
    # The reduced model projects the start on its modes: the bus is off by the modes left out.
    assert (turns[0].inv() * turns[1]).magnitude() < 0.002
    for boom in ("left", "right"):
        # Hinges stand for the mode shape, and one mode for all: 6 mm of the 0.2 m at the tip.
        tip = simulated.booms[boom][0, -1], ghost.booms[boom][0, -1]
        np.testing.assert_allclose(*tip, atol=0.01)


def test_the_attitude_of_the_ghost_is_that_of_its_model(free):
    predicted, ghost = free[2], drawn(free)[1]
    wanted = Rotation.from_rotvec(np.stack([predicted[f"attitude_{a}"] for a in "xyz"], axis=1))
    found = Rotation.from_quat(ghost.quaternions[BUS], scalar_first=True)
    assert (wanted.inv() * found).magnitude().max() < 1e-9  # rounding


def test_the_ghost_shares_the_place_of_the_bus(free):
    ready, measured, predicted = free
    rest = frames.at_rest(ready.mujoco.model.ptr, ready.machine)
    still, _ = drawn(free)
    adrift = dataclasses.replace(still, positions={BUS: np.outer(still.time, (1.0, 2.0, 3.0))})
    ghost = frames.bus_alone(ready.machine, rest, predicted, adrift, measured, 1.0)
    place = np.outer(ghost.time, (1.0, 2.0, 3.0))  # between frames along a straight line
    np.testing.assert_allclose(ghost.positions[BUS], place, atol=1e-12)
    root = ghost.booms["left"][:, 0] - place
    np.testing.assert_allclose(np.linalg.norm(root, axis=1), 3.0, rtol=1e-12)  # and the booms too


def test_parts_of_a_flight_make_the_frames_of_the_whole(planar):
    ready, measured, _ = planar
    model, machine = ready.mujoco.model.ptr, ready.machine
    whole = frames.simulated(model, machine, measured, 2.0)
    for k in range(0, len(measured.time), 7):
        part = frames.simulated(model, machine, selected(measured, slice(k, k + 7)), 2.0)
        rows, found = np.intersect1d(whole.time, part.time, return_indices=True)[1:]
        assert len(rows)
        # The length of the unbent boom is taken from each part's first frame: rounding.
        wanted = whole.booms["left"][rows]
        np.testing.assert_allclose(part.booms["left"][found], wanted, atol=1e-12)


@given(st.lists(st.floats(0, 50), min_size=1, max_size=60, unique=True))
def test_frames_are_thinned_to_one_a_tenth_of_a_second_with_both_ends(times):
    time = np.sort(times)
    thin = frames.thinned(Trajectory(time=time, signals={"x": 2 * time}, units={}), 0.1)
    assert thin.time[0] == time[0]
    assert thin.time[-1] == time[-1]
    np.testing.assert_array_equal(thin["x"], 2 * thin.time)
    # One row in each tenth at most, and the last one.
    assert len(thin.time) <= len(set(np.floor(time / 0.1 + 1e-6))) + 1


@pytest.mark.parametrize(
    ("end", "every"),
    [(0.0, 0.02), (8.0, 0.02), (50.0, 0.05), (100.0, 0.1), (448.8, 0.1), (3600.0, 0.2)],
)
def test_frames_are_close_enough_to_watch_and_few_enough_to_store(end, every):
    still = Trajectory(time=np.array([0.0, end]), signals={}, units={})
    assert frames.spacing(still) == pytest.approx(every)


@pytest.mark.parametrize(
    ("deflection", "factor"), [(0.0, 100.0), (0.02, 100.0), (0.375, 5.0), (2.0, 1.0), (9.0, 1.0)]
)
def test_the_factor_brings_the_largest_deflection_to_a_quarter_of_the_boom(deflection, factor):
    machine = spacecraft.load("two_boom")
    tip = np.array([0.0, -deflection])
    still = np.zeros(2)
    signals = {"left_tip_y": tip, "left_tip_z": still}
    found = Trajectory(time=np.arange(2.0), signals=signals, units={})
    assert machine.booms[0].length == 7.5
    assert frames.suited_factor(compiled(machine), machine, found) == factor


def compiled(machine):
    return mjcf.assemble(machine).compile()


def test_a_machine_without_elastic_parts_is_not_exaggerated():
    machine = spacecraft.load("rigid_body_free")
    still = Trajectory(time=np.zeros(1), signals={}, units={})
    assert frames.suited_factor(compiled(machine), machine, still) == 1.0


@pytest.mark.parametrize(("turn", "factor"), [(0.0, 100.0), (0.004, 50.0), (0.4, 1.0)])
def test_sprung_joints_of_a_free_machine_are_turned_too_far(turn, factor):
    for name, joint in (("two_boom_3d", "left_x"), ("four_boom", "front")):
        machine = spacecraft.load(name)
        model = compiled(machine)
        signals = dict(zip(coordinates(model), model.qpos0[:, None], strict=True))
        half = np.array([turn]) / 2
        if name == "four_boom":  # a ball, about its own x
            signals |= {f"{joint}.qw": np.cos(half), f"{joint}.qx": np.sin(half)}
        else:
            signals[f"{joint}.angle"] = 2 * half
        flight = Trajectory(time=np.zeros(1), signals=signals, units={})
        assert frames.suited_factor(model, machine, flight) == factor
        body = model.body(model.joint(joint).bodyid[0]).name
        straight, drawn = frames.at_rest(model, machine), drawing.draw(
            model, machine, flight, factor=factor
        )  # fmt: skip
        assert drawn.turned == factor
        between = abs(float(drawn.quaternions[body][0] @ straight.quaternions[body][0]))
        assert 2 * np.arccos(min(between, 1.0)) == pytest.approx(factor * turn, abs=1e-7)
        np.testing.assert_allclose(drawn.quaternions["bus"], straight.quaternions["bus"])


def coordinates(model):
    """Names of the coordinates as flights have them."""
    names = []
    for j in range(model.njnt):
        joint = model.joint(j).name
        parts = {0: ("x", "y", "z", "qw", "qx", "qy", "qz"), 1: ("qw", "qx", "qy", "qz")}
        names += [f"{joint}.{part}" for part in parts.get(int(model.jnt_type[j]), ("angle",))]
    return names


def test_without_coordinates_the_lean_of_the_bus_tells_how_far_joints_turn():
    machine = spacecraft.load("two_boom_3d")
    # One joint alone leans the bus by G = 40/366.7 of its angle.
    lean = {"attitude_x": np.array([0.004 * 40 / 366.67]), "quasi_rigid_angle_x": np.zeros(1)}
    flight = Trajectory(time=np.zeros(1), signals=lean, units={})
    assert frames.suited_factor(compiled(machine), machine, flight) == 50.0


def test_the_ghost_of_an_arm_is_posed_by_its_joints():
    ready = mission.assemble(mission.load_scenario("burkov-position", ("duration=0.5",)))
    model, machine = ready.mujoco.model.ptr, ready.machine
    measured, predicted = ready.fly(), ready.fly("reduced")
    joints = frames.read_joints(model, predicted)
    assert joints == ["joint_1", "joint_2"]
    whole = frames.simulated(model, machine, measured, 1.0)
    # The readings of the full plant are its coordinates: the same poses, by another way.
    again = frames.posed(model, machine, measured, joints, 1.0)
    assert set(again.positions) == {"arm_1", "arm_2"}
    for body in again.positions:
        np.testing.assert_array_equal(again.positions[body], whole.positions[body])
        np.testing.assert_array_equal(again.quaternions[body], whole.quaternions[body])
    ghost = frames.posed(model, machine, predicted, joints, 1.0)
    # Equations and MuJoCo agree to the order of both integrators.
    np.testing.assert_allclose(ghost.positions["arm_2"], whole.positions["arm_2"], atol=1e-5)


def test_the_ghost_of_a_body_turns_as_its_fixed_directions_say():
    ready = mission.assemble(mission.load_scenario("burkov-body-vectors", ("duration=3.0",)))
    model, machine = ready.mujoco.model.ptr, ready.machine
    measured, predicted = ready.fly(), ready.fly("reduced")
    assert frames.read_joints(model, predicted) == []
    assert set(frames.orientation(predicted)) == {"directions"}
    simulated = frames.simulated(model, machine, measured, 1.0)
    rest = frames.at_rest(model, machine)
    ghost = frames.bus_alone(machine, rest, predicted, simulated, measured, 1.0)
    turns = [
        Rotation.from_quat(found.quaternions[BUS], scalar_first=True)
        for found in (simulated, ghost)
    ]
    # Both plants integrate the same equations of motion.
    assert (turns[0].inv() * turns[1]).magnitude().max() < 1e-5
    assert turns[0].magnitude().max() > 0.1


def test_what_no_reading_places_has_no_orientation():
    nothing = Trajectory(time=np.zeros(2), signals={"joint": np.zeros(2)}, units={})
    assert frames.orientation(nothing) == {}


@given(st.lists(st.floats(-3, 3), min_size=3, max_size=3).map(np.array))
def test_matrices_become_the_quaternions_of_scipy(vector):
    rotation = Rotation.from_rotvec(vector)
    ours = frames.of_matrix(rotation.as_matrix()[None])[0]
    theirs = rotation.as_quat(scalar_first=True)
    assert min(np.abs(ours - theirs).max(), np.abs(ours + theirs).max()) < 1e-12  # rounding


vectors = st.lists(st.floats(-3, 3), min_size=3, max_size=3).map(np.array)


@given(vectors, vectors)
def test_rotations_follow_one_another_as_in_scipy(a, b):
    ours = frames.product(frames.rotation(a), frames.rotation(b))
    theirs = (Rotation.from_rotvec(a) * Rotation.from_rotvec(b)).as_quat(scalar_first=True)
    # Rounding; a quaternion and its opposite are one rotation.
    assert min(np.abs(ours - theirs).max(), np.abs(ours + theirs).max()) < 1e-12


@given(vectors, vectors)
def test_vector_products_are_those_of_numpy(a, b):
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), atol=1e-14)  # rounding
