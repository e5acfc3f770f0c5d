"""Modal form: transfer functions, and the reduced plant flown by the same law."""

import numpy as np
import pytest

from controllers.efremov import MultilevelRelay
from spacecraft_sim import beam, crossing, task
from spacecraft_sim.delay import Delay
from spacecraft_sim.disturbance import Disturbance, Torque
from spacecraft_sim.modal_form import modal_form, row_of, system_of
from spacecraft_sim.reduced import (
    ReducedModel,
    ReducedPhysics,
    double_integrator,
    galerkin_model,
    galerkin_start,
    truncate,
)
from spacecraft_sim.relay_system import State, propagate
from spacecraft_sim.scenario import Initial
from spacecraft_sim.simulate import Environment, simulate
from spacecraft_sim.spacecraft import Thruster
from spacecraft_sim.thrusters import Thrusters

ANGLE, RATE = "quasi_rigid_angle_z", "quasi_rigid_rate_z"
THRESHOLDS = tuple(0.0045 * 3**i for i in range(4))
LEVELS = tuple(0.007 * 3**k for k in range(5))
C = 0.31


def booms(modes, damping_time=0.018542):
    """Coefficients of the authors' spacecraft; damping low enough for its highest mode."""
    return beam.galerkin(
        bus_inertia=30.0, root_radius=3.0, length=7.5, linear_density=1.53,
        bending_stiffness=35.0, damping_time=damping_time / max(1, modes / 3) ** 2, n_modes=modes,
    )  # fmt: skip


def built(modes):
    torques = {"u": 2.5, "disturbance_z": 1.0}
    return galerkin_model(booms(modes), torques=torques, tips={"left": 7.5})


@pytest.mark.parametrize("modes", [1, 3, 10])
@pytest.mark.parametrize("channel", ["u", "disturbance_z"])
@pytest.mark.parametrize("reading", ["attitude_z", "rate_z", ANGLE, RATE, "left_tip_y"])
def test_transfer_functions_are_those_of_the_reduced_model(modes, channel, reading):
    model = built(modes)
    eigenvalues, drive, shapes = modal_form(model, channel)
    row = row_of(model, reading, shapes)
    assert len(eigenvalues) == len(drive) == len(row.modes) == modes
    n, i = 1 + modes, model.inputs.index(channel)
    stiffness, damping = np.zeros((n, n)), np.zeros((n, n))
    stiffness[1:, 1:], damping[1:, 1:] = np.diag(model.frequencies**2), model.D
    for s in (0.3 + 0.1j, 0.05 + 2.0j, 1.0 + 20j):
        q = np.linalg.solve(s**2 * np.eye(n) + s * damping + stiffness, model.B[:, i])
        direct = model.C[list(model.outputs).index(reading)] @ np.r_[q, s * q]
        modal = row.angle / s**2 + row.rate / s
        for d, b, x in zip(row.modes, drive, eigenvalues, strict=True):
            modal += d * b / (s - x) + (d * b).conjugate() / (s - x.conjugate())
        # Both solve a well conditioned system of 2 + 2k equations: some hundred roundings.
        assert modal * model.B[0, i] == pytest.approx(direct, rel=1e-11)


@pytest.mark.parametrize("modes", [1, 3, 10])
def test_eigenvalues_are_one_of_each_pair(modes):
    model = built(modes)
    eigenvalues, _, _ = modal_form(model, "u")
    n = modes
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(model.frequencies**2), -model.D]])
    found = np.array([*eigenvalues, *np.conj(eigenvalues)])
    assert np.all(np.imag(eigenvalues) > 0)
    every = np.linalg.eigvals(A)
    order, same = np.lexsort((found.imag, found.real)), np.lexsort((every.imag, every.real))
    assert found[order] == pytest.approx(every[same], rel=1e-12)  # the same routine, reordered


def test_a_rigid_plant_has_no_modes():
    model = double_integrator(inertia=3.0)
    eigenvalues, drive, shapes = modal_form(model, "thruster_z")
    assert eigenvalues == drive == ()
    row = row_of(model, "angular_momentum_z", shapes)
    assert (row.angle, row.rate, row.modes) == (0.0, 3.0, ())
    feedback = {ANGLE: 0.5, RATE: 2.0, "rate_z": 1.0}
    system = system_of(model, channel="thruster_z", switching=feedback, levels=(1.0,))
    assert (system.switching.angle, system.switching.rate) == (0.5, 3.0)


def test_the_switching_function_is_the_sum_of_its_readings():
    model = built(3)
    _, _, shapes = modal_form(model, "u")
    parts = {"attitude_z": 0.4, RATE: 1.5, "left_tip_y": -0.2}
    system = system_of(model, channel="u", switching=parts, thresholds=(1.0,), levels=(1.0, 2.0))
    rows = {name: row_of(model, name, shapes) for name in parts}
    for k in range(3):
        exact = sum(w * rows[name].modes[k] for name, w in parts.items())
        assert system.switching.modes[k] == pytest.approx(exact, rel=1e-14)  # three products
    assert system.switching.angle == pytest.approx(0.4, rel=1e-14)
    assert system.switching.rate == pytest.approx(1.5, rel=1e-14)
    assert (system.thresholds, system.levels) == ((1.0,), (1.0, 2.0))


def test_what_has_no_modal_form_is_refused():
    overdamped = galerkin_model(booms(3, damping_time=1.0), torques={"u": 1.0}, tips={})
    with pytest.raises(ValueError, match="overdamped"):
        modal_form(overdamped, "u")
    two = free(rigid=2)
    with pytest.raises(ValueError, match=r"\b2\b.*rigid coordinates|rigid coordinate.*\b2\b"):
        modal_form(two, "u")


def free(rigid) -> ReducedModel:
    """Free unit masses."""
    return truncate(
        M=np.eye(rigid), D=np.zeros((rigid, rigid)), K=np.zeros((rigid, rigid)),
        B=np.ones((rigid, 1)), C=np.eye(1, 2 * rigid), y0=np.zeros(1), outputs={"x": "m"},
        inputs=("u",), rigid=range(rigid), modes=0,
    )  # fmt: skip


@pytest.mark.parametrize(
    ("channel", "reading", "known"), [("w", "rate_z", "u"), ("u", "speed", "attitude_z")]
)
def test_a_name_that_does_not_exist_is_answered_with_those_that_do(channel, reading, known):
    with pytest.raises(ValueError, match=known):
        system_of(built(1), channel=channel, switching={reading: 1.0}, levels=(1.0,))


# -- a second simulator ----------------------------------------------------------------------


@pytest.mark.parametrize("modes", [0, 1, 3])
@pytest.mark.parametrize("delay", [0.2, Delay(mean=0.2, amplitude=0.15, frequency=2.0)])
def test_the_same_law_flies_to_the_same_switchings_on_the_reduced_plant(modes, delay, monkeypatch):
    coefficients = beam.galerkin(
        bus_inertia=30.0, root_radius=3.0, length=7.5, linear_density=1.53,
        bending_stiffness=35.0, damping_time=0.018542, n_modes=modes or 1,
    )  # fmt: skip
    torques = {"thruster_z": coefficients.J, "disturbance_z": coefficients.J}
    model = galerkin_model(coefficients, torques=torques, tips={}) if modes else double_integrator()
    sensors = ("attitude_z", "rate_z") if modes else (ANGLE, RATE)
    law = MultilevelRelay(
        c=C, thresholds=THRESHOLDS, levels=LEVELS, lowest=LEVELS[0], attraction=0.0,
        attraction_level=0.0, compensated_delay=0.0, period=None, sensors=sensors,
    )  # fmt: skip
    feedback = dict(zip(sensors, (C, 1.0), strict=True))
    system = system_of(
        model, channel="thruster_z", switching=feedback, thresholds=THRESHOLDS, levels=LEVELS
    )
    torque = Torque(constant=2e-4)
    start = State(0.03, -0.004, (0j,) * modes)
    if modes:  # the hub's angle and rate with straight booms, in modal coordinates
        _, _, shapes = modal_form(model, "thruster_z")
        eta = np.r_[model.projection[1:, 0] * 0.03, model.projection[1:, 0] * -0.004]
        z = np.linalg.solve(np.c_[shapes, shapes.conj()], eta)
        start = start._replace(modes=tuple(z[:modes].tolist()))
    run = propagate(system, start=start, duration=20.0, delay=delay, disturbance=torque)
    errors = []
    for width in (1e-11, 1e-12):
        monkeypatch.setattr(crossing, "WIDTH", width)  # to which a flight locates a switching
        plant = ReducedPhysics(model, start=galerkin_start(modes), timestep=0.02)
        flight = task.ControlTask(
            law,
            Thrusters([Thruster(name="thruster_z", levels=LEVELS, delay=delay)]),
            initial=Initial(attitude=(0, 0, 0.03), rate=(0, 0, -0.004)),
            disturbance=Disturbance({"z": torque}),
        )
        track = simulate(Environment(plant, flight, duration=20.0, substeps=5), meta={})
        command = track["thruster_z_command"]
        changed = np.flatnonzero(np.diff(command)) + 1
        assert len(changed) == len(run.switch_times) - 1 > 40
        # p over the thruster's unit and back.
        assert command[changed].tolist() == pytest.approx(run.commands[1:], rel=1e-14)
        errors.append(np.max(np.abs(track.time[changed] - run.switch_times[1:])))
        angle, rate, _ = run.at(track.time)
        # A switching displaced by d changes the rate by 2 A d and the angle by what it drifts.
        step = 2 * LEVELS[-1] * errors[-1]
        assert track[RATE] == pytest.approx(rate, abs=step)
        assert track[ANGLE] == pytest.approx(angle, abs=step * 20)
    # What the flight finds late adds up over hundreds of switchings, but goes to zero with WIDTH.
    assert errors[0] < 2e-8
    assert errors[0] / errors[1] == pytest.approx(10, rel=0.05)  # rounding is 1e-12 of 5e-11
