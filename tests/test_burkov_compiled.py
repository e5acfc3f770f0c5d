"""Burkov's laws on compiled machines: poles, flights and boundaries against reference figures.

The figures are those of the equations of motion in the other tests; here MuJoCo finds them.
"""

import functools
import math
import shutil
from dataclasses import replace

import burkov_cases as cases
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controllers import REGISTRY, burkov
from controllers.burkov_claims import samples
from spacecraft_sim import compiled_dynamics, library, mission
from spacecraft_sim.dynamics import linear_plant
from spacecraft_sim.loop_margins import close


def ready(name, *settings):
    return mission.assemble(mission.load_scenario(name, settings))


def loop_at(ready, law, *, qpos, qvel=None, without=()):
    """The linear loop of the compiled machine about a rest or a steady spin."""
    physics = ready.mujoco
    data = physics.data.ptr
    data.qpos[-len(qpos) :], data.qvel[:] = qpos, 0.0
    if qvel is not None:
        data.qvel[-len(qvel) :] = qvel
    physics.after_reset()
    y, still = physics.select(law.sensors)(), [0.0] * len(law.filter.cutoffs)
    torques = np.array(law.formula.command(0.0, y, still))
    motion = compiled_dynamics.dynamics_at(physics, law.thrusters)
    N = compiled_dynamics.basis(motion.model, without=without)
    return close(law, linear_plant(motion, state=np.zeros(len(N)), torques=torques, basis=N))


def includes(loop, *known):
    """Whether each known eigenvalue is one of the loop's, to 1e-5 relative, and its conjugate."""
    values = loop.eigenvalues()
    for value in known:
        for z in (complex(value), complex(value).conjugate()):
            # Six decimals, and MuJoCo's derivatives by differences.
            assert np.min(np.abs(values - z)) < 1e-5 * abs(z) + 1e-6
    return True


# -- poles -------------------------------------------------------------------------------------


def test_poles_at_a_position():
    flown = ready("burkov-position")
    loop = loop_at(flown, flown.controller, qpos=cases.TARGET)
    assert len(loop.eigenvalues()) == 6
    assert includes(loop, -11.804692, -2.692535, -10.580797 + 33.557424j, -4.670590 + 3.793101j)


def test_poles_with_elastic_joints():
    flown = ready("burkov-flexible-joint")
    names = [flown.mujoco.model.joint(k).name for k in range(6)]
    at = {f"{part}_{k + 1}": x for part in ("link", "rotor")
          for k, x in enumerate(cases.FLEXIBLE_TARGET)}  # fmt: skip
    loop = loop_at(flown, flown.controller, qpos=[at[name] for name in names])
    assert len(loop.eigenvalues()) == 15
    assert includes(
        loop, -7.131821 + 51.010254j, -6.875331 + 57.404989j, -4.812184 + 37.592240j,
        -4.278853 + 61.372762j, -2.348968 + 21.948427j, -2.302530, -1.865099, -1.848259,
        -1.544898 + 5.060023j,
    )  # fmt: skip


def attitude(model, s):
    """The quaternion of the bus with which the rows s are s1, s2, s3."""
    inertial = Rotation.from_quat(model.body("bus").iquat, scalar_first=True).as_matrix()
    return Rotation.from_matrix(s @ inertial.T).as_quat(scalar_first=True)


UNSTABLE = {  # signs of r2 and r3: eigenvalues without rates, the largest with
    (-1, -1): ((0.486411, 0.864439, 0.913281), 3),
    (-1, 1): ((0.245810, 0.875824), 2),
    (1, -1): ((0.488710,), 1),
}


@pytest.mark.parametrize("signs", UNSTABLE)
@pytest.mark.parametrize("name", ["burkov-body-vectors", "burkov-body-vectors-free"])
def test_unstable_eigenvalues_at_the_other_equilibria(name, signs):
    flown = ready(name)
    known, count = UNSTABLE[signs]
    r2, r3 = (a * np.array(r) for a, r in zip(signs, flown.controller.formula.r, strict=True))
    s = np.array([np.cross(r2, r3), r2, r3])
    loop = loop_at(flown, flown.controller, qpos=attitude(flown.mujoco.model, s))
    assert np.allclose(burkov.body_axes(flown.mujoco.model, flown.mujoco.data, "bus"), s)
    assert np.sum(loop.eigenvalues().real > 1e-6) == count
    assert includes(loop, *known)


def damped(law, product, *, k=1.6):
    """The law (5.18) with beta = gamma at a share of the critical product, whatever (5.19) says."""
    damping = math.sqrt(0.36 * product)
    return replace(law, formula=replace(law.formula, beta=damping, gamma=damping, k=k, spin=2.0))


SPIN = {
    0.97: (-0.740690, -0.112454 + 2.611354j, 0.005336),
    1.03: (-0.752735, -0.115764 + 2.610345j, -0.005254),
}


@pytest.mark.parametrize("share", SPIN)
def test_poles_either_side_of_the_boundary_of_a_spin(share):
    flown = ready("burkov-permanent-rotation")
    law = damped(flown.controller, share)
    loop = loop_at(flown, law, qpos=[1.0, 0, 0, 0], qvel=[2.0, 0, 0], without=(0, 3))
    assert includes(loop, *SPIN[share])


def test_poles_of_the_spin_upside_down():
    flown = ready("burkov-permanent-rotation")
    law = damped(flown.controller, 1 / 0.36)
    loop = loop_at(flown, law, qpos=[0.0, 0, 0, 1], qvel=[2.0, 0, 0], without=(0, 3))
    assert includes(loop, -1.420795 + 0.913023j, 0.608295 + 1.560372j)


# -- trajectories of the law at 1 ms -----------------------------------------------------------


def rows(track, names, times, period=1e-3):
    at = [int(np.searchsorted(track.time, t - period / 10)) for t in times]
    return np.array([track[name][at] for name in names]).T


ARM = ("joint_1", "joint_2", "joint_1_rate", "joint_2_rate")


def test_a_flight_to_a_position():
    known = {
        0.25: (1.172838, -0.945070, -1.746509, -0.169078, 1.255377, -0.937362),
        0.5: (0.826621, -0.996277, -0.948470, -0.069597, 0.882968, -0.991588),
        1.0: (0.632251, -0.947309, -0.099069, 0.124273, 0.638658, -0.952574),
    }
    flown = ready(
        "burkov-position", "duration=1.0", "initial.joints={joint_1=1.5, joint_2=-1.0}",
        "initial.joint_rates={}",
    )  # fmt: skip
    track = flown.fly()
    found = rows(track, ARM, known)
    w = samples(flown.controller, track, ARM).filtered[[round(1000 * t) for t in known]]
    reference = np.array(list(known.values()))
    # What is asked for; a torque held is half a period late, 7.6e-3 rad/s at 15 rad/s^2.
    assert found[:, :2] == pytest.approx(reference[:, :2], abs=1e-3)
    assert found[:, 2:] == pytest.approx(reference[:, 2:4], abs=1e-2)
    assert found[:, :2] - w == pytest.approx(reference[:, 4:], abs=1e-3)


def test_a_flight_along_a_path():
    known = {
        0.1: (0.229506, -0.100001, -0.729929, 0.573177),
        0.3: (0.069268, -0.061221, -0.641346, 0.126029),
        0.6: (0.006088, -0.027986, -0.057001, 0.102446),
        1.0: (0.001456, -0.006364, -0.005288, 0.027258),
    }
    flown = ready("burkov-path", "duration=1.0")
    track = flown.fly()
    path = np.array([cases.PROGRAMME(t).q for t in known])
    w = samples(flown.controller, track, ARM).filtered[[round(1000 * t) for t in known]]
    reference = np.array(list(known.values()))
    assert rows(track, ARM[:2], known) - path == pytest.approx(reference[:, :2], abs=1e-3)
    assert w == pytest.approx(reference[:, 2:], abs=2e-2)  # of 30 x', as late


# -- boundaries in flight ----------------------------------------------------------------------


def grown(ready, law, *, qpos, qvel, until, since, read):
    """Growth rate of what is read in a flight from a state, 1/s."""
    flown = replace(ready, controller=law, guarantees=())
    environment = flown.environment()
    environment.reset()
    physics = flown.mujoco
    data = physics.data.ptr
    data.qpos[:], data.qvel[:] = qpos, qvel
    physics.after_reset()
    value, select = [0.0] * len(physics.inputs), physics.select(law.sensors)
    memory, T, sizes, times = law.init(), law.period, [], []
    for k in range(round(until / T)):
        y = select()
        if k * T >= since:
            times.append(k * T)
            sizes.append(read(y))
        u, memory = law.step(k * T, y, memory)
        for name, torque in zip(law.thrusters, u, strict=True):
            value[physics.inputs.index(name)] = torque
        physics.begin(value, [0.0] * len(value))
        physics.advance((k + 1) * T)
    return float(np.polyfit(times, np.log(sizes), 1)[0])


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "rate"), [(0.94, 0.010757), (0.97, 0.005336), (1.03, -0.005254), (1.06, -0.010429)]
)
def test_a_spin_grows_or_decays_in_flight_as_its_poles_say(share, rate):
    flown = ready("burkov-permanent-rotation", "controller.period=0.01", "simulation.timestep=0.01")
    law = damped(flown.controller, share)
    tilt = 1e-5
    found = grown(
        flown, law, qpos=[math.cos(tilt / 2), 0, math.sin(tilt / 2), 0], qvel=[2.0, 0, 0],
        until=240.0, since=120.0, read=lambda y: math.hypot(y[0], y[1]),
    )  # fmt: skip
    # What is asked for; the swing has died by e^-13.
    assert found == pytest.approx(rate, abs=1e-4)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("share", "rate"), [(0.97, 0.0478), (0.99, 0.0160), (1.01, -0.0161), (1.03, -0.0484)]
)
def test_an_upright_arm_falls_or_stays_as_its_poles_say(share, rate):
    flown = ready(
        "burkov-position", 'controller.gravity="at the target"',
        f"controller.target=[{math.pi}, 0.0]", "controller.K1=[60.0, 30.0]",
    )  # fmt: skip
    law, rho = flown.controller, share * 46.21875
    law = replace(law, formula=replace(law.formula, K1=((rho, 0.0), (0.0, rho / 2))))
    found = grown(
        flown, law, qpos=[math.pi + 1e-6, 0.0], qvel=[0.0, 0.0], until=25.0, since=10.0,
        read=lambda y: abs(y[0] - math.pi),
    )  # fmt: skip
    # What is asked for; the next pole has died by e^-20.
    assert found == pytest.approx(rate, abs=1e-4)
    # And closer that of the sampled loop: of the flight nothing but a fit is left.
    loop = loop_at(flown, law, qpos=[math.pi, 0.0])
    assert found == pytest.approx(float(loop.growth(law.period)), abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize("signs", UNSTABLE)
@pytest.mark.parametrize("name", ["burkov-body-vectors", "burkov-body-vectors-rates"])
def test_unstable_equilibria_are_left_for_the_goal(name, signs):
    flown = ready(name)
    r = flown.controller.formula.r
    r2, r3 = (a * np.array(x) for a, x in zip(signs, r, strict=True))
    turn = Rotation.from_matrix(np.array([np.cross(r2, r3), r2, r3]))
    off = turn * Rotation.from_rotvec([1e-4, 1e-4, 1e-4])
    start = (f"initial.attitude={off.as_rotvec().tolist()}", "initial.rate=[0.0, 0.0, 0.0]")
    track = ready(name, *start, "duration=40.0").fly()
    signals = [f"{s}_{axis}" for s in ("s2", "s3") for axis in "xyz"]
    ends = [track[s][-1] for s in signals]
    # They leave within 20 s; the slowest pole, -0.49, takes what is left down to e^-8 or so.
    assert np.linalg.norm(np.array(ends) - np.ravel(r)) < 1e-2


# -- machines without the sensors --------------------------------------------------------------


def without(machine, sensor, folder):
    """A copy of a machine without sensors of one kind."""
    copy = shutil.copytree(library.folder("models") / machine, folder / machine)
    xml = copy / f"{machine}.xml"
    lines = xml.read_text().splitlines(keepends=True)
    kept = [line for line in lines if f"<{sensor} " not in line]
    assert len(kept) < len(lines)
    xml.write_text("".join(kept))
    return f'spacecraft="{copy / machine}.toml"'


UNMEASURED = [
    ("burkov-position", "arm2", "jointvel"),
    ("burkov-path", "arm2", "jointvel"),
    ("burkov-flexible-joint", "flexible_joint_arm", "jointvel"),
    ("burkov-body-vectors", "rigid_body_ball", "gyro"),
]


def alone(design):
    """A design without its claims, which true velocities judge."""

    @functools.wraps(design)
    def law(*arguments, **parameters):
        return design(*arguments, **parameters)[0], ()

    return law


@pytest.mark.parametrize(("name", "machine", "sensor"), UNMEASURED)
def test_a_machine_that_measures_no_velocity_flies_the_same(name, machine, sensor, tmp_path):
    settings = ("duration=0.5", without(machine, sensor, tmp_path))
    scenario = mission.load_scenario(name, settings)
    key = scenario.controller["law"]
    blind = mission.assemble(scenario, laws={key: alone(REGISTRY[key])})
    assert not [x for x in blind.mujoco.units if x in VELOCITIES or x.endswith("_rate")]
    one, two = blind.fly(), ready(name, "duration=0.5").fly()
    for torque in blind.controller.thrusters:
        assert np.array_equal(one[torque], two[torque])
    greedy = replace(blind.controller, sensors=(*blind.controller.sensors, VELOCITY[sensor]))
    with pytest.raises(ValueError, match=f"sensor '{VELOCITY[sensor]}' is not in the model"):
        replace(blind, controller=greedy).fly()


VELOCITIES = ("rate_x", "rate_y", "rate_z")
VELOCITY = {"jointvel": "joint_1_rate", "gyro": "rate_x"}


@pytest.mark.parametrize(
    ("name", "machine", "sensor", "says"),
    [
        ("burkov-position", "arm2", "jointpos", "'joint_1' .*; the law burkov_position reads it"),
        ("burkov-position", "arm2", "jointvel", "'joint_1_rate' .*; not the law but 'V rises .*'"),
        (
            "burkov-body-vectors", "rigid_body_ball", "frameyaxis",
            "'s2_x' .*; the law burkov_body_vectors reads it",
        ),
        ("burkov-body-vectors-rates", "rigid_body_ball", "gyro", "'rate_x' .*; the law"),
        ("burkov-permanent-rotation", "rigid_body_ball", "framexaxis", "'s1_y' .*; the law"),
    ],
)  # fmt: skip
def test_a_machine_without_the_sensors_is_told_who_needs_them(
    name, machine, sensor, says, tmp_path
):
    with pytest.raises(ValueError, match=says):
        ready(name, without(machine, sensor, tmp_path))
