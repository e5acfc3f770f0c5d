"""Every law on every spacecraft: one object for both plants, deterministic, finite, picklable."""

import copy
import dataclasses
import functools
import itertools
import pickle

import numpy as np
import pytest

from controllers import REGISTRY
from spacecraft_sim import library, mission
from spacecraft_sim.controller import Controller
from spacecraft_sim.guarantee import Guarantee
from spacecraft_sim.scenario import Scenario

# Inertia, kg m^2, and torque of a unit level, m.
MACHINES = {
    "two_boom": (1183.2375, 1.0),
    "two_boom_free": (1183.2375, 5.0),
    "two_boom_twin": (1183.240355, 1.0),
    "rigid_bus": (80.0, 1.0),
    "two_boom_3d": (353.3333, 2.0),
    "four_boom": (458.4533, 2.0),
    "asymmetric_booms": (309.7758, 2.0),
    "two_boom_light": (258.3333, 2.0),
}
MODES = {"rigid_bus": 0}  # elastic modes of the reduced plant, where not two
CLOSE = {"max_delay": 0.21, "accuracy": 0.007, "c": 0.31}  # Efremov et al. (2006), section 5
CONTROLLERS = {
    "dwell_relay": {"axes": ("z",)},
    "efremov_local": CLOSE,
    "efremov_nonlocal": {**CLOSE, "radius": 0.1, "gain": 2.765},
    "efremov_observed": {
        **CLOSE,
        "max_delay": 0.2105,
        "radius": 0.1,
        "gain": 2.765,
        "period": 0.01,
        "disturbance": 8.6e-7,
        "angle_noise": 2e-5,
    },
    "manoeuvre": {"profile": "min_time"},
    "ivanova_sokolov": {},
    "ivanova_sokolov_axes": {"axes": ("z",)},
    "phase_plane": {"dead_band": 1e-3, "drift": 2e-4},
    "pwpf": {"bandwidth": 0.5},
    "schmitt_trigger": {"threshold": 1e-3, "lead": 2.0},
}
# Accelerations that the laws need, rad/s^2: p 3^k with p of Theorems 1 and 2.
ACCELERATIONS = {
    "efremov_local": [1.5 * 0.31**2 * 0.007],
    "efremov_nonlocal": [3.75 * 0.31**2 * 0.007 * 2.765 * 3**k for k in range(5)],
}
ACCELERATIONS["efremov_observed"] = ACCELERATIONS["efremov_nonlocal"]
REGULATORS = (
    "dwell_relay", "ivanova_sokolov", "ivanova_sokolov_axes", "phase_plane", "pwpf",
    "schmitt_trigger",
)  # fmt: skip
ACCELERATIONS |= {law: [1e-3] for law in (*REGULATORS, "manoeuvre")}
# Thrusters of the laws that are made for a minimum on-time; the others act 0.2 s late.
PULSED = {law: {"delay": 0.0, "min_on_time": 0.05} for law in REGULATORS}
# Products of inertia couple the axes: v is no momentum over inertia about z alone.
COUPLED = "units: v is momentum over inertia: not"
REFUSED = {
    ("efremov_local", "asymmetric_booms"): COUPLED,
    ("efremov_nonlocal", "asymmetric_booms"): COUPLED,
    ("efremov_observed", "asymmetric_booms"): COUPLED,
    ("manoeuvre", "rigid_bus"): "modes = 1, but the reduced model has 0",
}
PAIRS = sorted(set(itertools.product(CONTROLLERS, MACHINES)) - REFUSED.keys())
# Laws that read angles or directions, each on the machines that have such readings.
VECTORS = {"r2": (0.0, 1.0, 0.0), "r3": (0.0, 0.0, 1.0), "k2": 2.0, "k3": 1.2}
UNRATED = {f"{x}{i}": (8.0, 9.0, 7.0) for x in "GD" for i in (2, 3)}
BODIES = ("rigid_body_ball", "rigid_body_free", "hub_two_booms")
PATH = {"mean": (0.1,) * 2, "amplitude": (0.5, 0.3), "frequency": (1.0, 2.0), "phase": (0.0,) * 2}
SPIN = {"spin": 0.5, "beta": 1.0, "gamma": 1.0, "k": 1.6}
MODEL_BASED = {
    ("burkov_position", "arm2"): {"target": (0.6, -0.9), "K1": (80.0, 40.0), "K2": (600.0, 250.0),
                                  "K3": (20.0, 25.0)},
    ("burkov_position", "arm7"): {"target": (0.3,) * 7,
                                  "K1": (300.0, 200.0, 150.0, 80.0, 40.0, 15.0, 4.0),
                                  "K2": (900.0, 700.0, 400.0, 200.0, 90.0, 30.0, 6.0),
                                  "K3": (20.0,) * 7},
    ("burkov_path", "arm2"): {"programme": PATH, "K0": (4.0, 2.0), "K1": (1.0, 0.5),
                              "K3": (1.0, 1.0), "K4": (1.0, 1.0), "gamma": 50.0, "nu": 30.0},
    ("burkov_flexible_joint", "flexible_joint_arm"): {
        "target": (0.5, -0.8, 0.6), "K0": (40.0, 25.0, 12.0), "K2": (400.0, 250.0, 120.0),
        "K3": (20.0,) * 3},
    **{("burkov_body_vectors", body): {**VECTORS, **UNRATED, "period": 0.01} for body in BODIES},
    **{("burkov_permanent_rotation", body): {**SPIN, "alpha": 1.0, "period": 0.01}
       for body in BODIES},
    **{("burkov_two_torques", body): {**SPIN, "period": 0.01} for body in BODIES},
}  # fmt: skip
PAIRS += sorted(MODEL_BASED)


def model_based(law, machine):
    joints = {"arm2": {"joint_1": 0.4}, "arm7": {"joint_3": 0.4}}
    joints["flexible_joint_arm"] = {"link_1": 0.3, "rotor_1": 0.3}
    turned = {"attitude": (0.1, -0.2, 0.15), "rate": (0.02, 0.0, 0.0)}
    return {
        "name": f"{law} on {machine}",
        "title": "a short flight",
        "spacecraft": machine,
        "duration": 1.0,
        "initial": {"joints": joints[machine]} if machine in joints else turned,
        "controller": {"law": law, **MODEL_BASED[law, machine]},
        "simulation": {"timestep": 0.001 if machine in joints else 0.01},
        "reduced": {"source": "equations"},
    }


@functools.cache
def ready(law, machine):
    if (law, machine) in MODEL_BASED:
        return mission.assemble(Scenario.model_validate(model_based(law, machine)))
    inertia, arm = MACHINES[machine]
    levels = [a * inertia / arm for a in ACCELERATIONS[law]]
    controller = CONTROLLERS[law]
    if law == "dwell_relay" or law.startswith("ivanova"):  # torques in terms of the thrust
        M0 = ACCELERATIONS[law][0] * inertia
        steady, rest = 0.8 * M0, 0.08 * M0
        one = law == "ivanova_sokolov"
        controller = {**controller, "bias": steady if one else (steady,)}
        controller["disturbance"] = rest if one else (rest,)
    table = {
        "name": f"{law} on {machine}",
        "title": "a short flight",
        "spacecraft": machine,
        "duration": 4.0,
        "initial": {"attitude": (0.0, 0.0, 0.0015), "boom_amplitude": 0.02},
        "controller": {"law": law, **controller},
        "thrusters": {"all": {"levels": levels, "delay": 0.2, **PULSED.get(law, {})}},
        "disturbance": {"z": {"amplitude": 0.001, "frequency": 1.0}},
        "reduced": {"source": "mjcf", "modes": MODES.get(machine, 2)},
    }
    return mission.assemble(Scenario.model_validate(table))


@functools.cache
def flight(law, machine, plant):
    return ready(law, machine).fly(plant)


def test_every_law_and_every_spacecraft_is_flown_here():
    assert set(CONTROLLERS) == set(ACCELERATIONS)
    laws, machines = (set(names) for names in zip(*MODEL_BASED, strict=True))
    assert set(CONTROLLERS) | laws == set(REGISTRY)
    assert set(MACHINES) | machines == set(library.spacecraft_names())


@pytest.mark.parametrize(("law", "machine"), sorted(REFUSED))
def test_a_law_refuses_a_machine_that_is_outside_its_hypotheses(law, machine):
    with pytest.raises(ValueError, match=REFUSED[law, machine]):
        ready(law, machine)


@pytest.mark.parametrize(("law", "machine"), PAIRS)
@pytest.mark.parametrize("plant", ["mujoco", "reduced"])
def test_flights_are_finite_and_repeat_bit_for_bit(law, machine, plant):
    track = flight(law, machine, plant)
    assert "diverged" not in track.meta
    assert track.time[-1] == ready(law, machine).scenario.duration
    again = ready(law, machine).fly(plant)
    assert track.time.tobytes() == again.time.tobytes()
    for name, signal in track.signals.items():
        assert np.all(np.isfinite(signal)), name
        assert signal.tobytes() == again[name].tobytes(), name


@pytest.mark.parametrize(("law", "machine"), PAIRS)
def test_one_law_object_flies_on_both_plants_unchanged(law, machine):
    assembled = ready(law, machine)
    controller = assembled.controller
    before = copy.deepcopy(controller)
    environments = [assembled.environment(plant) for plant in ("mujoco", "reduced")]
    assert all(e.task._controller is controller for e in environments)
    for plant in ("mujoco", "reduced"):
        track = assembled.fly(plant)
        # The thruster acts: a law that commands nothing would prove nothing here.
        assert np.any(track[f"{controller.thrusters[0]}_command"] != 0)
    assert controller == before


@pytest.mark.parametrize(("law", "machine"), PAIRS)
def test_laws_are_frozen_and_keep_the_protocol(law, machine):
    controller = ready(law, machine).controller
    assert isinstance(controller, Controller)
    assert dataclasses.is_dataclass(controller)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(controller, dataclasses.fields(controller)[0].name, None)


@pytest.mark.parametrize(("law", "machine"), PAIRS)
def test_law_and_memory_survive_pickling(law, machine):
    assembled = ready(law, machine)
    controller = pickle.loads(pickle.dumps(assembled.controller))
    assert controller == assembled.controller
    assembled.environment().reset()
    y = assembled.mujoco.select(controller.sensors)()
    memory = controller.init()
    for t in (0.0, 1.0, 2.0):
        memory = pickle.loads(pickle.dumps(memory))
        one = controller.step(t, y, memory)
        assert one == assembled.controller.step(t, y, memory)  # pure: the same arguments again
        assert controller.events(t, y, one[1]) == assembled.controller.events(t, y, one[1])
        memory = one[1]


@pytest.mark.parametrize(("law", "machine"), PAIRS)
def test_guarantees_give_a_verdict_of_every_flight(law, machine):
    assembled = ready(law, machine)
    assert assembled.guarantees
    assert all(isinstance(g, Guarantee) for g in assembled.guarantees)
    assert len({g.claim for g in assembled.guarantees}) == len(assembled.guarantees)
    comparison = assembled.judge(flight(law, machine, "mujoco"), flight(law, machine, "reduced"))
    for verdict in (*comparison.verdicts, *comparison.reduced):
        assert verdict.source
        # A figure that the flight cannot give is NaN, and NaN never holds.
        assert not (np.isnan(verdict.measured) and verdict.holds)
        assert not (verdict.failed and verdict.holds)


@pytest.mark.parametrize("law", REGISTRY)
def test_designs_say_what_they_are(law):
    doc = REGISTRY[law].__doc__
    assert doc
    assert doc.partition("\n")[0].endswith(".")
    for name, parameter in mission.parameters_of(REGISTRY[law]).items():
        assert parameter.annotation is not parameter.empty, name
