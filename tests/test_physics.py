"""The MuJoCo plant: conservation, orders of accuracy, limits, agreement where motion is small."""

import re
from decimal import Decimal
from itertools import pairwise

import mujoco
import numpy as np
import pytest
import scipy.linalg
from dm_control.rl.control import PhysicsError

from spacecraft_sim import linearize, mjcf
from spacecraft_sim.physics import MujocoPhysics, require_stable_step
from spacecraft_sim.reduced import ReducedPhysics, truncate
from spacecraft_sim.scenario import Initial

BENT = Initial(attitude=(0, 0, 0.3), rate=(0, 0, 0.02), boom_amplitude=0.2)


def fly(spacecraft, timestep=0.02, start=BENT, **options):
    physics = MujocoPhysics.fly(spacecraft, timestep=timestep, **options)
    physics.set_initial(start)
    return physics


def state(physics):
    return np.r_[physics.data.ptr.qpos, physics.data.ptr.qvel]


def piece(physics, end, value=(0.0,), slope=(0.0,)):
    physics.begin(list(value), list(slope))
    physics.advance(end)


def energy(model, data):
    mujoco.mj_forward(model, data)
    velocity = np.zeros(model.nv)
    mujoco.mj_mulM(model, data, velocity, data.qvel)
    return data.qvel @ velocity / 2 + data.qpos @ (np.ravel(model.jnt_stiffness) * data.qpos) / 2


# -- conservation ------------------------------------------------------------------------------


def first_mode(model):
    """Joint coordinates of the first free mode with the tip at 0.05 m, shape (nv,)."""
    linear = linearize.linearize(model)
    squares, shapes = scipy.linalg.eigh(linear.K, linear.M)
    reached = np.flatnonzero((squares > 1e-6) & (np.abs(linear.B.T @ shapes)[0] > 1e-9))
    shape = shapes[:, reached[0]]
    tip = linear.C[list(linear.outputs).index("left_tip_y"), : model.nv] @ shape
    return 0.05 / tip * shape


def test_energy_and_momentum_are_kept_for_a_thousand_seconds(machine):
    physics = fly(machine(n_hinges=8), timestep=0.01, start=Initial(rate=(0, 0, 0.01)))
    model, data = physics.model.ptr, physics.data.ptr
    data.qpos[:] = first_mode(model)
    mujoco.mj_step1(model, data)
    momentum = physics.select(("angular_momentum_z",))
    before = energy(model, data), momentum()[0]
    mujoco.mj_step(model, data, 100_000)
    mujoco.mj_step1(model, data)
    after = energy(model, data), momentum()[0]
    assert data.time == pytest.approx(1000.0, rel=1e-9)
    # RK4 takes (omega dt)^6/72 of the vibration a step, 2.3e-15, and of the whole 1 % vibrates.
    assert after[0] == pytest.approx(before[0], rel=1e-10, abs=0)
    # The momentum is all but linear in the state, and RK4 keeps what is linear: rounding remains.
    assert after[1] == pytest.approx(before[1], rel=1e-12, abs=0)


def tumbled(spacecraft, timestep, rate):
    """Relative drift of the angular momentum over eight seconds."""
    physics = fly(spacecraft, timestep=timestep, start=Initial(rate=rate, boom_amplitude=0.05))
    momentum = physics.select(tuple(f"angular_momentum_{axis}" for axis in "xyz"))
    before = np.array(momentum())
    mujoco.mj_step(physics.model.ptr, physics.data.ptr, round(8 / timestep))
    mujoco.mj_step1(physics.model.ptr, physics.data.ptr)
    return np.linalg.norm(momentum() - before) / np.linalg.norm(before)


def test_free_machine_that_turns_about_one_axis_keeps_its_angular_momentum(machine):
    # Rotations about one axis commute: the order is 4, and rounding remains at this step.
    assert tumbled(machine(free=True, n_hinges=2), 0.01, (0, 0, 0.4)) < 1e-13


def test_free_machine_that_tumbles_keeps_its_angular_momentum_to_second_order(machine):
    spacecraft = machine(free=True, n_hinges=2)
    coarse, fine = (tumbled(spacecraft, dt, (0.03, 0.02, 0.04)) for dt in (0.04, 0.02))
    # MuJoCo's RK4 adds the rates of its stages as if rotations commuted: order 2, not 4.
    assert np.log2(coarse / fine) == pytest.approx(2, abs=0.01)
    assert fine < 1e-7


def test_momentum_grows_by_the_impulse(machine):
    def error(timestep):
        physics = fly(machine(n_hinges=2, damping_time=0.018542), timestep=timestep)
        momentum = physics.select(("angular_momentum_z",))
        expected, t = momentum()[0], 0.0
        for end, value, slope in ((0.4, 2.0, 0.0), (1.2, 2.0, -2.0), (1.6, 0.4, 0.0)):
            piece(physics, end, [value], [slope])
            expected += (end - t) * (value + slope * (end - t) / 2)
            t = end
        return abs(momentum()[0] / expected - 1)

    # H' = u whatever the booms do; H is not linear in the state, so RK4 errs with its order.
    assert error(0.02) < 1e-10
    assert np.log2(error(0.04) / error(0.02)) == pytest.approx(4, abs=0.15)


# -- pieces ------------------------------------------------------------------------------------


@pytest.mark.parametrize("free", [False, True])
def test_piece_advanced_again_is_bit_for_bit_the_piece_advanced_once(machine, free):
    spacecraft = machine(free=free, n_hinges=3, damping_time=0.018542)
    once, often = (fly(spacecraft) for _ in range(2))
    for t, (value, slope) in enumerate([(1.0, 0.5), (1.0, 0.0), (1.0, 0.0), (-3.0, 2.0)]):
        for physics in (once, often):
            physics.begin([value], [slope])
        for share in (0.02, 0.7, 0.0123, 1.0, 1e-9, 0.431):
            often.advance(0.02 * (t + share))
        for physics in (once, often):
            physics.advance(0.02 * (t + 1))
        assert state(often).tolist() == state(once).tolist()
        assert often.read() == once.read()


def test_plant_lands_exactly_on_any_instant_and_keeps_its_step(machine):
    physics = fly(machine(n_hinges=3))
    for t in (0.013, 0.02, 0.0200000001, 1 / 3, 0.7):
        piece(physics, t)
        assert physics.time() == t
        assert physics.timestep() == 0.02


def test_flight_is_the_same_again_after_a_reset(machine):
    physics = fly(machine(n_hinges=3))

    def flown():
        physics.reset()
        physics.set_initial(BENT)
        piece(physics, 0.5, [2.0], [0.3])
        piece(physics, 0.9, [2.0], [0.0])
        return state(physics)

    first = flown()
    assert flown().tolist() == first.tolist()
    assert physics.time() == 0.9


def test_readings_after_a_piece_are_those_of_its_end(machine):
    physics = fly(machine(n_hinges=3))
    piece(physics, 0.31, [1.0])
    after = physics.read()
    mujoco.mj_forward(physics.model.ptr, physics.data.ptr)
    assert physics.read() == after
    assert physics.select(("attitude_z",))() == [physics.data.ptr.qpos[0]]


def test_inputs_are_taken_when_the_piece_is_opened(machine):
    fresh, reused = (fly(machine(n_hinges=2)) for _ in range(2))
    value, zero = [0.0], [0.0]
    for k, level in enumerate((1.0, -3.0, 2.0)):
        end = 0.1 * (k + 1)
        piece(fresh, end, [level])
        value[0] = level  # the caller's own list, changed and handed in again
        reused.begin(value, zero)
        reused.advance(end)
    assert state(reused).tolist() == state(fresh).tolist()


def test_held_control_is_stepped_as_pieces_are(machine):
    stepped, pieces = (fly(machine(n_hinges=2)) for _ in range(2))
    stepped.set_control([1.5])
    for k in range(5):
        stepped.step()
        piece(pieces, stepped.time(), [1.5])
        assert stepped.time() == pytest.approx(0.02 * (k + 1), rel=1e-15)
    assert state(stepped).tolist() == state(pieces).tolist()


def test_disturbance_and_thruster_of_the_same_torque_are_the_same(machine):
    spacecraft = machine(n_hinges=2)
    thrust, torque = (fly(spacecraft, disturbances=["disturbance_z"]) for _ in range(2))
    assert thrust.inputs == ("thruster_z", "disturbance_z")
    piece(thrust, 1.0, [2.0, 0.0], [-0.5, 0.0])
    piece(torque, 1.0, [0.0, 2.0], [0.0, -0.5])
    assert state(thrust).tolist() == state(torque).tolist()


# -- accuracy ----------------------------------------------------------------------------------


def pulsed(spacecraft, steps):
    """The end of a flight through edges that no common step would hit, `steps` to a piece."""
    physics = fly(spacecraft, timestep=0.25)
    corners = [(0.0, 0.0, 4.0), (0.37, 1.48, 0.0), (1.0, 1.48, -2.0), (1.74, 0.0, 0.0), (2.6, 0, 0)]
    for (start, value, slope), (end, *_) in pairwise(corners):
        instants = np.linspace(start, end, steps + 1)
        for t, following in pairwise(instants):
            piece(physics, following, [100 * (value + slope * (t - start))], [100 * slope])
    return state(physics)


def test_thrust_that_is_linear_in_time_is_integrated_with_order_four(machine):
    spacecraft = machine(n_hinges=3, damping_time=0.018542)
    exact = pulsed(spacecraft, 256)
    errors = [np.abs(pulsed(spacecraft, steps) - exact).max() for steps in (16, 32, 64)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 3.8)  # order 4 from above or below by the next term
    assert errors[-1] < 1e-5


def linear_twin(physics, spacecraft, modes):
    model = physics.model.ptr
    linear = linearize.linearize(model)
    reduced = truncate(
        M=linear.M, D=linear.D, K=linear.K, B=linear.B, C=linear.C, y0=linear.y0,
        outputs=linear.outputs, inputs=linear.actuators, rigid=linear.rigid, modes=modes,
    )  # fmt: skip
    return ReducedPhysics(
        reduced,
        start=lambda initial: linearize.initial_state(model, spacecraft, initial),
        timestep=0.01,
    )


@pytest.mark.parametrize(("reading", "order"), [("attitude_z", 3), ("left_tip_x", 2)])
def test_difference_to_the_linear_model_vanishes_with_a_power_of_the_amplitude(
    machine, reading, order
):
    spacecraft = machine(n_hinges=3, damping_time=0.018542)

    def difference(amplitude):
        start = Initial(rate=(0, 0, 0.1 * amplitude), boom_amplitude=amplitude)
        full = fly(spacecraft, timestep=0.005, start=start)
        linear = linear_twin(full, spacecraft, modes=3)
        linear.set_initial(start)
        found = []
        for k in range(1, 9):
            for physics in (full, linear):
                piece(physics, 0.5 * k, [100 * amplitude])
            found.append(full.select((reading,))()[0] - linear.select((reading,))()[0])
        return np.abs(found).max()

    large, small = difference(0.025), difference(0.0125)
    assert small > 1e-6  # there is something to compare: RK4 leaves 1e-9
    # The mirror image of a planar motion is a motion: odd readings have no terms of second order,
    # the shortening of a boom no others. The next term is (amplitude/length)^2 of the first.
    assert np.log2(large / small) == pytest.approx(order, abs=0.02)


# -- limits ------------------------------------------------------------------------------------


def limit_in(message):
    return float(re.search(r"stability limit ([0-9.e-]+) s", message).group(1))


@pytest.mark.parametrize(
    "booms",
    [{"n_hinges": 8, "damping_time": 0.018542}, {"n_hinges": 8}, {"rule": "equal", "n_hinges": 16}],
)
def test_step_over_the_limit_is_refused_with_the_limit_and_under_it_accepted(machine, booms):
    spacecraft = machine(**booms)
    linear = linearize.linearize(mjcf.compile(spacecraft, timestep=0.01))
    limit = 2.5 / np.abs(linear.eigenvalues()).max()
    with pytest.raises(ValueError, match="take a smaller step or fewer hinges") as refusal:
        MujocoPhysics.fly(spacecraft, timestep=limit * (1 + 1e-9))
    assert limit_in(str(refusal.value)) == pytest.approx(limit, rel=5e-4)  # four digits are printed
    physics = fly(spacecraft, timestep=limit * (1 - 1e-9))
    before = energy(physics.model.ptr, physics.data.ptr)
    physics.step(2000)
    after = energy(physics.model.ptr, physics.data.ptr)
    assert after <= before * (1 + 1e-9)  # RK4 damps below its limit: nothing grows


def first_unstable_step(model):
    """The step at which an eigenvalue leaves the region of stability of RK4, s."""
    eigenvalues = linearize.linearize(model).eigenvalues()
    eigenvalues = eigenvalues[np.abs(eigenvalues) > 1e-3]
    steps = np.linspace(2.4, 3.1, 7001) / np.abs(eigenvalues).max()
    z = steps[:, None] * eigenvalues
    growth = np.abs(1 + z + z**2 / 2 + z**3 / 6 + z**4 / 24).max(axis=1)
    return steps[np.argmax(growth > 1 + 1e-9)]


@pytest.mark.parametrize(
    ("rule", "n", "damping_time", "published"),
    [
        ("equal", 8, 0.01854, ".078"),
        ("equal", 8, 0.0, ".079"),
        ("equal", 16, 0.01854, "8.1e-3"),
        ("equal", 16, 0.0, ".019"),
        ("equal", 32, 0.01854, "4.2e-4"),
        ("gauss_jacobi", 4, 0.01854, ".25"),
        ("gauss_jacobi", 8, 0.01854, ".039"),
        ("gauss_jacobi", 8, 0.0, ".041"),
        ("gauss_jacobi", 16, 0.01854, "4.2e-4"),
        ("gauss_legendre", 8, 0.01854, "1.6e-3"),
        ("gauss_legendre", 16, 0.01854, "8.2e-6"),
    ],
)
def test_limit_keeps_a_margin_below_the_step_at_which_rk4_is_unstable(
    machine, rule, n, damping_time, published
):
    model = mjcf.compile(machine(rule=rule, n_hinges=n, damping_time=damping_time), timestep=0.01)
    unstable = first_unstable_step(model)
    # Half of the last digit, and half of the next: the figures were rounded twice.
    digit = 10.0 ** Decimal(published).as_tuple().exponent
    assert unstable == pytest.approx(float(published), abs=0.55 * digit, rel=0)
    with pytest.raises(ValueError, match="stability limit") as refusal:
        require_stable_step(model, 10.0)
    assert 0.83 < limit_in(str(refusal.value)) / unstable < 0.96  # 2.5 of 2.61 to 2.98


@pytest.mark.parametrize("timestep", [0.0, -0.01, np.nan, np.inf])
def test_step_that_is_no_positive_number_is_refused(machine, timestep):
    with pytest.raises(ValueError, match=str(timestep)):
        MujocoPhysics.fly(machine(n_hinges=2), timestep=timestep)


@pytest.mark.parametrize("bad", [np.nan, np.inf, 1e12])
@pytest.mark.parametrize("part", ["qpos", "qvel"])
def test_divergence_is_reported_and_never_reset_away(machine, bad, part):
    physics = fly(machine(n_hinges=3))
    piece(physics, 0.1)
    physics.check_divergence()
    getattr(physics.data.ptr, part)[1:3] = bad, -bad  # two that cancel in a sum
    with pytest.raises(PhysicsError, match=r"diverged before t = 0\.1 s"):
        physics.check_divergence()
    mujoco.mj_step(physics.model.ptr, physics.data.ptr)
    assert physics.time() > 0.1
    with pytest.raises(PhysicsError, match="diverged"):
        physics.check_divergence()


def test_unknown_sensor_is_refused_with_the_nearest(machine):
    with pytest.raises(ValueError, match=r"sensor 'rate_zz' .*did you mean 'rate_z'"):
        fly(machine(n_hinges=1)).select(("rate_zz",))


@pytest.mark.parametrize("free", [False, True])
def test_every_coordinate_has_a_name_and_a_unit(machine, free):
    physics = fly(machine(free=free, n_hinges=2))
    units = physics.coordinate_units()
    assert len(units) == len(physics.coordinates()) == physics.model.ptr.nq
    assert units["left_1.angle"] == "rad"
    assert physics.coordinates()[list(units).index("left_1.angle")] != 0.0
    assert ("bus.qw" if free else "attitude_z.angle") in units
