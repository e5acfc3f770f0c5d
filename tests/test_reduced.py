"""The reduced plant: exact propagation, modes that are those of the full model."""

import numpy as np
import pytest
import scipy.linalg
from dm_control.rl.control import PhysicsError
from scipy.integrate import solve_ivp

from spacecraft_sim import beam, linearize, mjcf
from spacecraft_sim.reduced import (
    ReducedPhysics,
    double_integrator,
    galerkin_model,
    galerkin_start,
    truncate,
)
from spacecraft_sim.scenario import Initial

PAPER = {
    "length": 7.5,
    "linear_density": 1.53,
    "bending_stiffness": 35.0,
    "bus_inertia": 30.0,
    "root_radius": 3.0,
}
START = Initial(attitude=(0, 0, 0.7), rate=(0, 0, -0.01), boom_amplitude=0.1)


def galerkin(modes=3, damping_time=0.018542):
    coefficients = beam.galerkin(**PAPER, damping_time=damping_time, n_modes=modes)
    return galerkin_model(
        coefficients,
        torques={"thruster_z": 1.0, "disturbance_z": 1.0},
        tips={"left": 7.5, "right": 7.5},
    )


def plant(modes=3, timestep=0.05, start=START, **changes):
    physics = ReducedPhysics(
        galerkin(modes, **changes), start=galerkin_start(modes), timestep=timestep
    )
    physics.set_initial(start)
    return physics


def readings(physics):
    return np.array(physics.select(tuple(physics.units))())


def from_compiled(spacecraft, modes):
    model = mjcf.compile(spacecraft, timestep=0.01)
    linear = linearize.linearize(model)
    reduced = truncate(
        M=linear.M, D=linear.D, K=linear.K, B=linear.B, C=linear.C, y0=linear.y0,
        outputs=linear.outputs, inputs=linear.actuators, rigid=linear.rigid, modes=modes,
    )  # fmt: skip
    return model, linear, reduced


def state_space(linear):
    n = len(linear.M)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[n:] = -np.linalg.solve(linear.M, np.hstack([linear.K, linear.D]))
    return A, np.vstack([np.zeros_like(linear.B), np.linalg.solve(linear.M, linear.B)])


# -- propagation -------------------------------------------------------------------------------


def test_double_integrator_is_propagated_in_closed_form():
    physics = ReducedPhysics(double_integrator(inertia=4.0), start=galerkin_start(0), timestep=0.1)
    physics.set_initial(Initial(attitude=(0, 0, 0.7), rate=(0, 0, -0.01)))
    physics.begin([2.0, 0.5], [0.4, -0.2])
    physics.advance(3.0)
    angle = 0.7 - 0.01 * 3 + (2.5 * 9 / 2 + 0.2 * 27 / 6) / 4
    rate = -0.01 + (2.5 * 3 + 0.2 * 9 / 2) / 4
    assert readings(physics) == pytest.approx([angle, rate, 4 * rate, angle, rate], rel=1e-15)


def test_linear_thrust_is_propagated_as_the_differential_equation_says():
    physics, g = plant(), beam.galerkin(**PAPER, damping_time=0.018542, n_modes=3)
    M = np.diag(np.r_[g.J, g.a])
    M[0, 1:], M[1:, 0] = 2 * g.p, g.p  # (1.4)-(1.5)
    pieces = [(0.7, [1.0, 0.2], [0.5, 0.0]), (1.9, [-2.0, 0.1], [0.0, 0.3]), (5.0, [0, 0], [0, 0])]

    def motion(t, x, start, value, slope):
        force = np.zeros(4)
        force[0] = np.sum(value) + np.sum(slope) * (t - start)
        acceleration = np.linalg.solve(M, force - np.r_[0, g.b] * x[4:] - np.r_[0, g.c] * x[:4])
        return np.r_[x[4:], acceleration]

    x, t = np.r_[0.7, 0.1, 0, 0, -0.01, 0, 0, 0], 0.0
    for end, value, slope in pieces:
        x = solve_ivp(
            motion, (t, end), x, method="DOP853", rtol=1e-13, atol=1e-15, args=(t, value, slope)
        ).y[:, -1]
        physics.begin(value, slope)
        physics.advance(end)
        t = end
    tips = 2 * (x[1] - x[2] + x[3])
    found = dict(zip(physics.units, readings(physics), strict=True))
    exact = {
        "attitude_z": x[0],
        "rate_z": x[4],
        "left_tip_y": tips,
        "right_tip_y": tips,
        "angular_momentum_z": g.J * x[4] + 2 * g.p @ x[5:],
        "quasi_rigid_angle_z": x[0] + 2 * g.p @ x[1:4] / g.J,
    }
    for name, value in exact.items():
        # The integrator keeps some 1e-13 a unit of time; momentum is some 1e3 times the rate.
        scale = g.J if name == "angular_momentum_z" else 1.0
        assert found[name] == pytest.approx(value, abs=1e-11 * scale, rel=0)
    assert (found["left_tip_x"], found["left_tip_z"]) == (7.5, 0.0)


def test_all_modes_together_are_the_full_linear_model(machine):
    spacecraft = machine(n_hinges=3, damping_time=0.018542)
    model, linear, reduced = from_compiled(spacecraft, modes=3)

    def start(initial):
        return linearize.initial_state(model, spacecraft, initial)

    physics = ReducedPhysics(reduced, start=start, timestep=0.05)
    physics.set_initial(START)
    physics.begin([1.5], [-0.25])
    physics.advance(4.0)
    A, B = state_space(linear)
    n = len(A)
    augmented = np.zeros((n + 2, n + 2))  # x' = A x + B u, u' = slope, slope' = 0
    augmented[:n, :n], augmented[:n, n], augmented[n, n + 1] = A, B[:, 0], 1.0
    x = scipy.linalg.expm(4.0 * augmented) @ np.r_[start(START)[0], start(START)[1], 1.5, -0.25]
    expected = linear.y0 + linear.C @ x[:n]
    # Rounding of eigenvectors and of the exponential, norm 4 x 68 per s; momentum some 10 N m s.
    np.testing.assert_allclose(readings(physics), expected, rtol=1e-10, atol=1e-10)


def test_piece_can_be_advanced_again_and_again_from_its_opening():
    once, often = plant(), plant()
    for physics in (once, often):
        physics.begin([1.0, 0.0], [0.3, 0.1])
    for t in (0.05, 0.4, 0.0123, 1.7, 0.731):
        often.advance(t)
        assert often.time() == t
    once.advance(0.731)
    assert readings(often).tolist() == readings(once).tolist()


def test_piece_and_its_parts_are_the_same_motion():
    whole, parts = plant(), plant()
    whole.begin([1.0, 0.5], [0.3, 0.0])
    whole.advance(1.0)
    for start, end in ((0.0, 0.05), (0.05, 0.099), (0.099, 0.3), (0.3, 0.300001), (0.300001, 1.0)):
        parts.begin([1.0 + 0.3 * start, 0.5], [0.3, 0.0])
        parts.advance(end)
    # Rounding; momentum is of order one.
    np.testing.assert_allclose(readings(parts), readings(whole), rtol=1e-13, atol=1e-13)


def test_steps_with_held_inputs_are_pieces():
    stepped, whole = plant(timestep=0.05), plant(timestep=0.05)
    stepped.set_control([1.0, -0.3])
    stepped.step(20)
    whole.begin([1.0, -0.3], [0.0, 0.0])
    whole.advance(1.0)
    assert stepped.time() == pytest.approx(1.0, rel=1e-15)
    np.testing.assert_allclose(readings(stepped), readings(whole), rtol=1e-13, atol=1e-13)


def test_undamped_free_flight_keeps_momentum_and_energy():
    physics = plant(damping_time=0.0)

    def energy():
        g = beam.galerkin(**PAPER, damping_time=0.0, n_modes=3)
        position, velocity = state(physics, g)
        kinetic = g.J * velocity[0] ** 2 / 2 + velocity[0] * (2 * g.p @ velocity[1:])
        return kinetic + g.a @ velocity[1:] ** 2 + g.c @ position[1:] ** 2

    momentum = physics.select(("angular_momentum_z",))
    before = energy(), momentum()[0]
    physics.begin([0.0, 0.0], [0.0, 0.0])
    physics.advance(1000.0)
    # Phases of 6000 rad keep twelve digits.
    assert (energy(), momentum()[0]) == pytest.approx(before, rel=1e-10)


def state(physics, g):
    """Coordinates and velocities (gamma, q) back from the modal state, through its projection."""
    (r, v), (eta, eta_rate) = physics._x[:2], np.split(physics._x[2:], 2)
    modal = np.r_[r, eta], np.r_[v, eta_rate]
    return [np.linalg.solve(physics.model.projection, part) for part in modal]


def test_reset_returns_to_rest_at_time_zero():
    physics = plant()
    physics.step(3)
    physics.reset()
    assert physics.time() == 0.0
    assert readings(physics).tolist() == physics.model.y0.tolist()


def test_divergence_is_reported():
    physics = plant()
    physics.begin([np.nan, 0.0], [0.0, 0.0])
    physics.advance(0.1)
    with pytest.raises(PhysicsError, match=r"diverged before t = 0\.1 s"):
        physics.check_divergence()


# -- the models --------------------------------------------------------------------------------


@pytest.mark.parametrize(("modes", "first"), [(1, 0.768785), (3, 0.739730)])
def test_galerkin_frequencies_are_the_reference_figures(modes, first):
    # Efremov et al. (2006) with 1.53 kg/m and 35 N m^2; six digits are given.
    assert galerkin(modes).frequencies[0] == pytest.approx(first, rel=1e-6)


def test_modal_damping_is_proportional_to_the_stiffness():
    model = galerkin(3)
    # Kelvin-Voigt: D = chi K in any coordinates; rounding of the eigenvectors.
    np.testing.assert_allclose(
        model.D, 0.018542 * np.diag(model.frequencies**2), atol=1e-12 * model.frequencies[-1] ** 2
    )


def test_modes_that_no_thruster_reaches_are_left_out(machine):
    spacecraft = machine(n_hinges=8)
    _, _, reduced = from_compiled(spacecraft, modes=8)  # the other eight bend booms alike
    exact = beam.coupled_frequencies(**PAPER, n=2)
    # The error of eight Gauss-Jacobi hinges on the free machine.
    np.testing.assert_allclose(reduced.frequencies[:2], exact, rtol=3e-4)
    clamped = {k: v for k, v in PAPER.items() if k not in ("bus_inertia", "root_radius")}
    first = beam.cantilever_frequencies(**clamped, n=1)[0]
    assert reduced.neglected.min() == pytest.approx(first, rel=1e-5)
    assert len(reduced.neglected) == 8


def test_truncation_keeps_the_lowest_modes_and_names_the_rest(machine):
    spacecraft = machine(n_hinges=4)
    *_, two = from_compiled(spacecraft, modes=2)
    *_, four = from_compiled(spacecraft, modes=4)
    assert two.frequencies.tolist() == four.frequencies[:2].tolist()
    assert set(two.neglected) == {*four.neglected, *four.frequencies[2:]}
    assert np.all(np.diff(four.frequencies) > 0)


def test_gain_is_torque_over_the_rigid_inertia(machine):
    *_, reduced = from_compiled(machine(n_hinges=4), modes=1)
    # J in closed form, through the mass matrix and central differences of the readings.
    gain = reduced.gain("thruster_z", "quasi_rigid_rate_z")
    assert gain == pytest.approx(1 / 1183.2375, rel=1e-9)
    assert reduced.gain("thruster_z", "angular_momentum_z") == pytest.approx(1.0, rel=1e-9)
    assert reduced.inertia == pytest.approx([1183.2375], rel=1e-12)


# -- what is refused ---------------------------------------------------------------------------


def test_more_modes_than_are_reached_are_refused_with_their_number(machine):
    with pytest.raises(ValueError, match=r"reduced\.modes = 5: the inputs reach 4 elastic modes"):
        from_compiled(machine(n_hinges=4), modes=5)


def test_bus_that_is_held_is_refused(machine):
    held = ('axis="0 0 1"/>', 'axis="0 0 1" stiffness="1"/>')
    with pytest.raises(ValueError, match="the bus must move freely"):
        from_compiled(machine(n_hinges=2, xml=held), modes=1)


def test_bent_mode_that_the_model_lacks_is_refused():
    with pytest.raises(ValueError, match=r"initial\.boom_mode = 2, but .* has 1 modes"):
        plant(modes=1, start=Initial(boom_mode=2, boom_amplitude=0.1))


def test_unknown_names_are_refused_with_the_nearest():
    physics = plant()
    with pytest.raises(ValueError, match=r"sensor 'rate' is not in the reduced model; .*'rate_z'"):
        physics.select(("rate",))
    with pytest.raises(ValueError, match=r"input 'thruster' .*did you mean 'thruster_z'"):
        physics.model.gain("thruster", "rate_z")
    with pytest.raises(ValueError, match=r"output 'rate' .*did you mean 'rate_z'"):
        physics.model.gain("thruster_z", "rate")
