"""Relays with a dwell about three axes: reference flights, what is fed back, what is refused."""

import dataclasses
import tempfile
from pathlib import Path

import numpy as np
import pytest
from relatives import generator, relative, shipped

from controllers.axis import torque_gain
from controllers.channels import Channels
from controllers.dwell_relay import design
from controllers.observer import Unknown, design_observer
from spacecraft_sim import mission
from spacecraft_sim.certificate import certify
from spacecraft_sim.dwell_axes import RelayAxis, coupled
from spacecraft_sim.scenario import Scenario
from spacecraft_sim.trajectory import sample_rows

slow = pytest.mark.slow

# Machine, damping ratio, tip, dwell, M0, M1 about x and -z: measured over guaranteed, by axis.
CLOSED_LOOP = {
    ("two_boom_3d", 0.02, 0.03, 2, 1, 0): {"x": 0.833, "z": 0.860},
    ("two_boom_3d", 0.05, 0.1, 2, 1, 0): {"x": 0.737, "z": 0.766},
    ("two_boom_3d", 0.05, 0.1, 2, 10, 0): {"x": 0.740, "z": 0.769},
    ("two_boom_3d", 0.05, 0.3, 5, 1, 0): {"x": 0.542, "z": 0.625},
    ("two_boom_3d", 0.05, 0.3, 0.5, 1, 0): {"x": 0.364, "z": 0.352},
    ("two_boom_3d", 0.2, 1, 20, 0.05, 0): {"x": 0.628, "z": 0.611},
    ("two_boom_3d", 0.02, 0.1, 5, 1, 0.1): {"x": 0.703, "z": 0.776},
    ("four_boom", 0.05, 0.05, 2, 1, 0): {"x": 0.877, "y": 0.902, "z": 0.794},
}
STARTS = (0.0, -0.2, -0.4, -0.6)  # angle on the switching arc over p


def loop(row, start, feedback="attitude", period=0.01):
    """(attitudes over guaranteed ones, by axis; shortest time between switchings over the dwell).

    The law is that of the reference: its bare contour, without what sampling and the other axes
    add, and with a thousandth of room; sampled.
    """
    name, ratio, tip, dwell, M0, M1 = row
    _, elastic = relative(tip, ratio, name)
    steady = np.array([M1, 0, -M1])
    certified = certify(elastic, torque=M0, dwell=dwell, disturbance=steady)
    own = [axis.attitude if feedback == "attitude" else axis.quasi_rigid for axis in certified]
    p, leans = 1.001 * np.array([x.contour for x in own]), np.array([x.lean for x in own])
    u0, F = M0 / np.diag(elastic.J), steady / M0
    controller = {"law": "dwell_relay", "axes": ("x", "y", "z"), "feedback": feedback}
    controller |= {"bias": tuple(steady.tolist()), "period": period}
    e = np.zeros(3)
    if feedback == "attitude":
        e = np.array([axis.disturbance for axis in certified])
        controller["disturbance"] = tuple((e * M0).tolist())
    else:
        controller |= {"lean": tuple(leans), "sway": tuple(axis.sway for axis in certified)}
    brake, push = u0 * (1 - F - e), u0 * (1 + F - e)
    with tempfile.TemporaryDirectory() as folder:
        machine = generator().write(
            Path(folder), name, tip=tip, ratio=ratio, torque=M0, dwell=float(dwell)
        )
        table = {
            "name": "loop",
            "title": "the relays of the reference",
            "spacecraft": str(machine),
            "duration": 100.0 if feedback == "attitude" else 400.0,
            "initial": {
                "attitude": tuple(start * p),
                "rate": tuple(np.sqrt(2 * brake * (1 - start) * p)),
            },
            "controller": controller,
            "disturbance": {
                a: {"waveform": "square", "amplitude": m, "frequency": 1e-6}
                for a, m in (("x", M1), ("z", -M1))
                if m
            },
            "simulation": {"timestep": period, "substeps": 1},
            "reduced": {"source": "mjcf", "modes": 2},
        }
        ready = mission.assemble(Scenario.model_validate(table))
    bare = zip(ready.controller.laws, p, brake, push, strict=True)
    laws = [dataclasses.replace(x, half_width=a, brake=b, push=c) for x, a, b, c in bare]
    track = dataclasses.replace(ready, controller=Channels(laws=tuple(laws))).fly()
    bounds = dict(zip("xyz", p + leans, strict=True))
    shares = {a: np.abs(track[f"attitude_{a}"]).max() / bound for a, bound in bounds.items()}
    gaps = []
    for axis in "xyz":
        rows = np.flatnonzero(np.diff(np.sign(track[f"thruster_{axis}"]), prepend=0))
        gaps.append(np.diff(track.time[rows]).min() / dwell)
    return shares, min(gaps)


@slow
@pytest.mark.parametrize("row", CLOSED_LOOP, ids=str)
def test_three_axes_in_closed_loop_as_in_the_reference(row):
    # The reference starts on the switching arc, and does not say where; the first swings count.
    flights = [loop(row, start) for start in STARTS]
    for axis, reference in CLOSED_LOOP[row].items():
        shares = [found[axis] for found, _ in flights]
        assert 0.98 * min(shares) < reference < 1.02 * max(shares)
        assert max(shares) < 1
    # The clock of a sampled flight is exact to 1e-9 of a dwell.
    assert min(gap for _, gap in flights) > 1 - 1e-9


@slow
@pytest.mark.parametrize(
    ("tip", "ratio", "dwell", "M0", "periods", "reference"),
    [
        # The cycle of the relay is near a resonance: how near, its sampling decides.
        (2, 0.01, 2.66, 0.02, (0.01, 0.02), 0.880),
        (2, 0.01, 2.66, 0.2, (0.01, 0.02), 0.879),
        (2, 0.01, 1.0, 0.02, (0.01,), 0.025),
        (1, 0.02, 2.0, 0.02, (0.01,), 0.189),
    ],
)
def test_the_quasi_rigid_angle_fed_back_as_in_the_reference(
    tip, ratio, dwell, M0, periods, reference
):
    row = ("two_boom_3d", ratio, tip, dwell, M0, 0)
    flights = [loop(row, x, "quasi_rigid", period)[0] for x in STARTS[:3] for period in periods]
    shares = [found["x"] for found in flights]
    assert 0.98 * min(shares) < reference < 1.02 * max(shares)
    assert max(shares) < 1
    # Nothing is felt about y: the bare contour is left by what sampling costs, 8 h/dwell, and the
    # other axes, as in the reference.
    assert all(1.0 < found["y"] < 1.09 for found in flights)


def test_sampling_costs_what_the_certificate_adds_for_it():
    # About y nothing elastic disturbs; the bare contour is left by 8 h/dwell at most.
    found, _ = loop(("two_boom_3d", 0.05, 0.1, 2, 1, 0), 0.0)
    assert 1.02 < found["y"] < 1.001 * (1 + 8 * 0.01 / 2) * 1.01  # and 1 % from the other axes


# -- what is fed back ------------------------------------------------------------------------------


def assembled(name, *settings):
    return mission.assemble(mission.load_scenario(name, settings))


def attitude_claims(ready):
    return {g.claim[10]: g for g in ready.guarantees if g.claim.startswith("|attitude")}


@pytest.mark.parametrize("plant", ["mujoco", "reduced"])
@pytest.mark.parametrize("name", ["sokolov-attitude", "sokolov-quasi-rigid", "sokolov-estimated"])
def test_every_claim_holds_on_both_plants(name, plant):
    ready = assembled(name, "duration=100.0")
    track = ready.fly(plant)
    for guarantee in ready.guarantees:
        verdict = guarantee.check(track)
        assert verdict.holds, (verdict.claim, [str(a) for a in verdict.failed])


def test_momentum_is_balanced_though_the_torques_turn_with_the_bus():
    ready = assembled("sokolov-attitude", "duration=60.0")
    track = ready.fly()
    (balance,) = (g for g in ready.guarantees if g.claim.startswith("angular momentum"))
    verdict = balance.check(track)
    assert verdict.holds
    # Attitudes of 1e-3 rad would make 1e-3 of it; what turning leaves open is far less.
    assert verdict.bound < 2e-4 * np.abs(track["angular_momentum_z"]).max()
    for name in ("thruster_x_impulse", "thruster_z_impulse"):
        wrong = {**track.signals, name: track[name] * (1 + 1e-3) + 0.03 * track.time}
        assert not balance.check(dataclasses.replace(track, signals=wrong)).holds


def test_what_is_measured_or_estimated_costs_lean_and_corrections():
    measured = attitude_claims(assembled("sokolov-quasi-rigid", "controller.period=0.05"))
    estimated = attitude_claims(assembled("sokolov-estimated"))
    vacuous = 'controller.feedback="attitude"', "controller.lean=[]", "controller.sway=[]"
    with pytest.raises(ValueError, match=r"0\.4148.*20\.7|the guarantee is vacuous"):
        assembled("sokolov-quasi-rigid", *vacuous, "controller.disturbance=[0.4148, 0.0, 0.4336]")
    for axis, guarantee in estimated.items():
        assert measured[axis].bound < guarantee.bound < 1.2 * measured[axis].bound


def test_what_an_observer_costs_is_in_the_bound():
    ready = assembled("sokolov-estimated")
    settings, T, axes = ready.scenario.controller, 0.05, "xyz"
    model, laws = ready.reduced.model, ready.controller.law.laws
    units = [
        model.gain(x.thrusters[0], f"quasi_rigid_rate_{a}") for a, x in zip(axes, laws, strict=True)
    ]
    told = [torque_gain(model, a) / unit for a, unit in zip(axes, units, strict=True)]
    _, found = design_observer(
        model, ready.thrusters["reduced"], channels=ready.controller.thrusters,
        sensors=ready.controller.sensors, fed=ready.controller.law.sensors, period=T,
        unknown=Unknown(
            thrust=tuple(np.array(told) * settings["disturbance"]), impulse=(0.0,) * 3,
            noise=(1e-8,) * 3, steady=(0.0,) * 3,
        ),
    )  # fmt: skip
    relays = {}
    for k, (axis, law) in enumerate(zip(axes, laws, strict=True)):
        (error, rate), (slip, push) = (x[2 * k : 2 * k + 2] for x in (found.error, found.jumps))
        u0 = law.level * units[k]
        relays[axis] = RelayAxis(
            acceleration=u0,
            inertia=1 / torque_gain(model, axis),
            dwell=law.dwell,
            disturbance=push / u0,
            late=T,
            slip=slip,
            # Between two samples errors go on growing.
            lean=settings["lean"][k] + error + T * (rate + slip),
            sway=settings["sway"][k] + rate + T * push,
        )
    for axis, band in coupled(relays).items():
        claimed = attitude_claims(ready)[axis].bound
        assert claimed == pytest.approx(band.accuracy.total, rel=2e-6)  # rounding is allowed for
        without = dataclasses.replace(
            relays[axis], slip=0.0, lean=settings["lean"]["xyz".index(axis)]
        )
        assert claimed > 1.0003 * coupled({axis: without})[axis].accuracy.total


def test_the_thrusters_of_other_axes_disturb_by_products_of_inertia():
    table = {
        "name": "coupled",
        "title": "a bus whose axes products of inertia couple",
        "spacecraft": "asymmetric_booms",
        "duration": 1.0,
        "controller": {"law": "dwell_relay", "axes": ("x", "y", "z"), "feedback": "quasi_rigid"},
        "reduced": {"source": "mjcf", "modes": 2},
    }
    ready = mission.assemble(Scenario.model_validate(table))
    inverse = np.linalg.inv(shipped("asymmetric_booms")[1].J)
    for k, law in enumerate(ready.controller.laws):
        # Equal torques on all axes: what the others do, over the own, here a thousandth.
        e = (np.abs(inverse[k]).sum() - inverse[k, k]) / inverse[k, k]
        room = 1 - law.brake / (0.02 * inverse[k, k])
        assert e <= room * (1 + 1e-9) < 1.01 * e  # a little is gyroscopic


def test_the_estimate_follows_the_quasi_rigid_angle_from_the_attitude_alone():
    ready = assembled("sokolov-estimated", "duration=150.0")
    assert ready.controller.sensors == ("attitude_x", "attitude_y", "attitude_z")
    track = ready.fly()
    rows, _ = sample_rows(track.time, 0.05)
    rows = rows[track.time[rows] > 100]
    for axis in "xyz":
        true = track[f"quasi_rigid_angle_{axis}"][rows]
        error = np.abs(track[f"estimated_quasi_rigid_angle_{axis}"][rows] - true).max()
        # On top of the measured case the bound has the observer's error, and what sampling adds.
        assert error < 5e-6 < 0.1 * attitude_claims(ready)[axis].bound
        swing = np.abs(track[f"attitude_{axis}"][rows] - true).max()
        assert axis == "y" or error < 0.1 * swing  # the attitude itself is no estimate


def test_another_machine_than_the_observer_believes_is_told():
    ready = assembled("sokolov-estimated", "duration=100.0", "actual.thrusters.all.delay=0.5")
    verdict = attitude_claims(ready)["x"].check(ready.fly())
    assert not verdict.holds
    assert any("|eps| <= e in flight" in a.text for a in verdict.failed)


def test_an_observer_that_has_not_forgotten_its_start_is_told():
    # The law enters its contour at once, while the observer still takes the bus to be at rest.
    ready = assembled("sokolov-estimated", "duration=20.0", "initial.rate=[1e-4, 0.0, 0.0]")
    verdict = attitude_claims(ready)["x"].check(ready.fly())
    assert not verdict.holds
    assert "x: error of the estimate" in [a.text for a in verdict.failed]


@pytest.mark.parametrize("told", [1e-3, 0.0])
def test_a_steady_torque_that_the_observer_is_told_of_costs_it_nothing(told):
    pushed = 'disturbance.x={waveform="square", amplitude=1e-3, frequency=1e-6}'
    ready = assembled(
        "sokolov-estimated", "duration=100.0", pushed, f"controller.bias=[{told}, 0.0, 0.0]"
    )
    track = ready.fly("reduced")
    rows, _ = sample_rows(track.time, 0.05)
    error = track["estimated_quasi_rigid_angle_x"] - track["quasi_rigid_angle_x"]
    verdict = attitude_claims(ready)["x"].check(track)
    assert verdict.holds == bool(told)
    if told:
        assert np.abs(error[rows]).max() < 1e-15  # rounding of 1e-4 rad over 2000 samples
    else:
        assert np.abs(error[rows]).max() > 1e-7
        assert "x: error of the estimate" in [a.text for a in verdict.failed]


def test_commands_between_samples_are_foretold():
    # A delay that is no multiple of the period; the start is at rest: the estimate is exact.
    late = "thrusters.all.delay=0.13", "duration=60.0"
    track = assembled("sokolov-estimated", *late).fly("reduced")
    rows, _ = sample_rows(track.time, 0.05)
    for axis in "xyz":
        true = track[f"quasi_rigid_angle_{axis}"][rows]
        assert np.abs(true).max() > 1e-5
        # Rounding alone: 1200 samples of 1e-4 rad.
        assert np.abs(track[f"estimated_quasi_rigid_angle_{axis}"][rows] - true).max() < 1e-15


# -- what is refused -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"axes": ()}, "must name one axis at least, and each once"),
        ({"axes": ("z", "z")}, "must name one axis at least, and each once"),
        ({"disturbance": (0.1, 0.2)}, r"axes = \['z'\] need one disturbance each"),
        ({"disturbance": (-0.1,)}, "disturbance of z = -0.1"),
        ({"bias": (0.6,), "disturbance": (0.5,)}, "1.1 of the thrust, must be below it"),
        ({"lean": (0.1,)}, 'with controller.feedback = "attitude" leave them out'),
        ({"dwell": 0.0}, "the least time between switchings is 0.0 s and must be > 0"),
        ({"period": -1.0}, "period = -1.0"),
        ({"feedback": "estimated"}, "an observer is sampled"),
        (
            {"feedback": "estimated", "period": 0.1},
            "must be finite and > 0: disturbance of z = 0.0",
        ),
    ],
)
def test_bad_numbers_are_refused(changes, message):
    with pytest.raises(ValueError, match=message.replace("(", r"\(")):
        design(**{"axes": ("z",), **changes})


def test_on_a_rigid_machine_the_law_is_the_undisturbed_one():
    law, guarantees = design(axes=("z",), dwell=1.0)
    assert law.laws[0].half_width == pytest.approx(0.125, rel=1e-12)
    assert guarantees[0].bound == pytest.approx(0.125, rel=2e-6)  # rounding is allowed for
