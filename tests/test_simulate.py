"""The dm_control environment of a scenario, and the flight of an episode."""

import dataclasses
import math

import numpy as np
import pytest
from absl.testing import absltest
from dm_env import StepType, test_utils

import spacecraft_sim
from controllers.efremov import attracting
from spacecraft_sim import mission
from spacecraft_sim.disturbance import Disturbance
from spacecraft_sim.scenario import Initial
from spacecraft_sim.simulate import Environment, simulate
from spacecraft_sim.task import ControlTask
from spacecraft_sim.thrusters import Thrusters
from spacecraft_sim.trajectory import Recorder

NAME = "efremov-nonlocal"
SHORT = "duration=3.0"
ATTITUDE = "attitude_z"


class TestDmEnvContract(test_utils.EnvironmentTestMixin, absltest.TestCase):
    def make_object_under_test(self):
        return spacecraft_sim.load(NAME, SHORT)

    def make_action_sequence(self):
        """Agents that push at random, for longer than an episode of 30 control steps."""
        spec = self.environment.action_spec()
        random = np.random.default_rng(0)
        for _ in range(70):
            yield random.uniform(spec.minimum, spec.maximum)


def episode(environment, action=None):
    """All time steps of an episode under a constant action, the first one included."""
    if action is None:
        action = np.zeros(environment.action_spec().shape)
    steps = [environment.reset()]
    while not steps[-1].last():
        steps.append(environment.step(action))
    return steps


def angles(steps):
    return [float(step.observation[ATTITUDE]) for step in steps]


def fly(*settings, plant="mujoco"):
    return mission.assemble(mission.load_scenario(NAME, (SHORT, *settings))).fly(plant)


def assert_same(one, other):
    assert one.time.tobytes() == other.time.tobytes()
    for name in one.signals:
        assert one[name].tobytes() == other[name].tobytes(), name


def test_an_episode_lasts_as_long_as_the_scenario_says():
    environment = spacecraft_sim.load(NAME, "duration=1.23")
    steps = episode(environment)
    assert environment.physics.time() == 1.23
    assert [s.step_type for s in steps[:2]] == [StepType.FIRST, StepType.MID]
    assert len(steps) == 1 + math.ceil(1.23 / 0.1)  # 5 steps of 0.02 s to a control step
    assert {step.discount for step in steps[1:]} == {1.0}


def test_the_action_is_bounded_by_the_highest_level():
    environment = spacecraft_sim.load(NAME, SHORT)
    spec, (thruster,) = environment.action_spec(), environment.task._thrusters.specs
    assert spec.shape == (1,)
    assert spec.maximum == max(thruster.levels)
    assert spec.minimum == -max(thruster.levels)


def test_a_zero_action_leaves_the_law_alone():
    environment = spacecraft_sim.load(NAME, SHORT)
    by_agent = angles(episode(environment))
    alone = simulate(spacecraft_sim.load(NAME, SHORT), meta={})
    at = np.searchsorted(alone.time, np.arange(len(by_agent)) * 0.1 - 1e-9)
    assert by_agent == alone[ATTITUDE][at].tolist()  # bit for bit


def test_an_action_is_added_to_the_law_after_the_delay():
    environment = spacecraft_sim.load(NAME, SHORT)
    alone = episode(environment)
    pushed = episode(environment, np.array([8.2826625 + 1.0]))  # the law's own command is -1 N m
    pairs = zip(pushed, alone, strict=True)
    rate = "quasi_rigid_rate_z"
    difference = np.array([float(a.observation[rate] - b.observation[rate]) for a, b in pairs])
    time = np.arange(len(difference)) * 0.1
    # The delay is 0.2 s, the inertia 1183.2375 kg m^2; -1 N m is replaced by 8.28 N m.  RK4 keeps
    # the momentum to 1e-9 of what is given.
    expected = np.maximum(time - 0.2, 0.0) * (8.2826625 + 1.0) / 1183.2375
    assert difference == pytest.approx(expected, abs=1e-8)


def test_an_action_that_ends_leaves_the_command_to_the_law():
    environment = spacecraft_sim.load(NAME, SHORT)
    task = environment.task
    task.recorder = Recorder(task.units(environment.physics))
    environment.reset()
    for action in (0.0, 24.8, 24.8, 0.0, 0.0, 0.0):
        environment.step(np.array([action]))
    track = task.recorder.trajectory({})
    # Nearest levels of -1 and 23.8 N m, 0.2 s late: the action of the second step acts from 0.3 s.
    at = np.searchsorted(track.time, np.arange(7) * 0.1 - 1e-9)
    wanted = [0.0, 0.0, -1.0, 24.8479875, 24.8479875, -1.0, -1.0]
    assert track["thruster_z"][at].tolist() == wanted
    assert set(track["thruster_z_command"]) == {-1.0}  # the law's own


def test_observations_are_the_readings_by_name():
    environment = spacecraft_sim.load(NAME, SHORT)
    step = environment.reset()
    assert list(step.observation) == list(environment.physics.units)
    assert list(environment.observation_spec()) == list(step.observation)
    assert step.observation[ATTITUDE] == 0.7
    assert step.observation["rate_z"] == -0.01


def test_the_reward_is_1_on_target_and_a_half_at_the_accuracy():
    environment = spacecraft_sim.load(NAME, SHORT)
    for angle, reward in ((0.0, 1.0), (0.007, 0.5), (-0.007, 0.5), (0.7, 1 / (1 + 1e4))):
        environment.reset()
        environment.physics.set_initial(Initial(attitude=(0, 0, angle)))
        # A few roundings of a quotient of squares.
        assert environment.task.get_reward(environment.physics) == pytest.approx(reward, rel=1e-12)
    step = episode(environment)[-1]
    angle = float(step.observation[ATTITUDE])
    assert step.reward == pytest.approx(1 / (1 + (angle / 0.007) ** 2), rel=1e-12)


# -- repetition -----------------------------------------------------------------------------------

SCATTER = ("initial.attitude_scatter=0.05", "initial.rate_scatter=0.001")


@pytest.mark.parametrize("plant", ["mujoco", "reduced"])
def test_the_seed_fixes_everything(plant):
    one, other = (fly(*SCATTER, "seed=3", plant=plant) for _ in range(2))
    assert_same(one, other)
    assert one[ATTITUDE][0] != 0.7


def test_another_seed_is_another_start_within_the_scatter():
    starts = {float(fly("duration=0.1", *SCATTER, f"seed={k}")[ATTITUDE][0]) for k in range(5)}
    assert len(starts) == 5
    assert all(abs(angle - 0.7) <= 0.05 for angle in starts)


def test_without_scatter_the_seed_changes_nothing():
    assert_same(fly("seed=1"), fly("seed=2"))


def test_components_that_are_zero_are_not_scattered():
    track = fly("initial.attitude=[0.0, 0.0, 0.0]", *SCATTER)
    assert track[ATTITUDE][0] == 0.0


def test_a_reset_starts_afresh():
    environment = spacecraft_sim.load(NAME, SHORT)
    first = angles(episode(environment))
    environment.reset()
    environment.step(environment.action_spec().maximum)  # an unfinished episode between
    assert angles(episode(environment)) == first


def test_a_second_episode_is_planned_from_its_own_start():
    environment = spacecraft_sim.load(NAME, "duration=25.0", *SCATTER)
    ends = []
    for _ in range(2):
        track = simulate(environment, meta={})
        start = (float(track[f"quasi_rigid_{x}_z"][0]) for x in ("angle", "rate"))
        ends.append(attracting(*start, 1 / 1183.2375).T1)  # 1 N m on J
        changes = track.time[1:][np.diff(track["thruster_z_command"]) != 0]
        assert changes[0] == pytest.approx(ends[-1], abs=2e-11)  # width of a root
    assert ends[0] != ends[1]


def test_one_assembly_flies_twice_the_same():
    ready = mission.assemble(mission.load_scenario(NAME, (SHORT,)))
    assert_same(ready.fly(), ready.fly())


def test_progress_is_told_in_simulated_seconds():
    seen = []
    simulate(spacecraft_sim.load(NAME, "duration=0.45"), meta={}, progress=seen.append)
    assert seen == pytest.approx([0.1, 0.2, 0.3, 0.4, 0.45], abs=1e-12)  # sums of 0.02


def test_the_recorder_is_put_away_after_the_flight():
    environment = spacecraft_sim.load(NAME, "duration=0.2")
    simulate(environment, meta={})
    assert environment.task.recorder is None


# -- divergence -----------------------------------------------------------------------------------


@dataclasses.dataclass(frozen=True)
class Runaway:
    """Pushes the way the bus already turns, as hard as it can."""

    sensors: tuple[str, ...] = ("rate_z",)
    thrusters: tuple[str, ...] = ("thruster_z",)
    period: float | None = 0.05

    def init(self):
        return None

    def step(self, t, y, memory):
        return (math.copysign(1e12, y[0]),), memory

    def events(self, t, y, memory):
        return ()


def runaway(plant):
    settings = ("duration=5.0", "thrusters.all.levels=[1e12]", "disturbance={}")
    scenario = mission.load_scenario(NAME, settings)
    full = mission.spacecraft.load("two_boom").with_parts(**scenario.changes())
    physics = mission.MujocoPhysics.fly(full, timestep=0.02)
    if plant == "reduced":
        physics = mission.reduced_plant(scenario, full, physics)
    task = ControlTask(
        Runaway(),
        Thrusters(full.thrusters),
        initial=Initial(rate=(0, 0, 0.01)),
        disturbance=Disturbance({}),
    )
    return Environment(physics, task, duration=5.0, substeps=5)


def test_a_flight_that_diverges_says_when_and_keeps_its_rows():
    track = simulate(runaway("mujoco"), meta={"plant": "mujoco"})
    assert "diverged before t = " in track.meta["diverged"]
    assert track.meta["plant"] == "mujoco"
    # The thrust arrives at 0.2 s, so at least the rows before it stand; the flight has not ended.
    assert track.time[-1] >= 0.2
    assert track.time[-1] < 5.0
    assert np.all(np.diff(track.time) > 0)
    rows = track.time <= 0.2
    assert all(np.all(np.isfinite(signal[rows])) for signal in track.signals.values())
    assert track["rate_z"][rows] == pytest.approx(0.01, abs=1e-12)  # nothing has pushed yet


def test_the_same_thrust_does_not_break_the_exact_plant():
    track = simulate(runaway("reduced"), meta={})
    assert "diverged" not in track.meta
    assert track.time[-1] == 5.0


def test_a_flight_from_an_absurd_rate_ends_with_the_reason():
    track = fly("initial.rate=[0.0, 0.0, 1e9]")
    assert "diverged" in track.meta
    assert len(track.time) >= 1
    assert track["rate_z"][0] == 1e9
