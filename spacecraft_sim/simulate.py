"""The only loop: an environment, and the flight of one episode."""

from collections.abc import Callable
from time import perf_counter
from typing import Any

import dm_env
import numpy as np
from dm_control.rl import control

from spacecraft_sim.task import ControlTask
from spacecraft_sim.trajectory import Recorder, Trajectory

CHUNK, PAUSE = 250, 0.2  # least rows and least wall time, s, between two looks of a watcher


class Environment(control.Environment):
    """dm_control's environment for a plant that lands on thrust edges inside a control step."""

    _task: ControlTask

    def __init__(self, physics: Any, task: ControlTask, *, duration: float, substeps: int):
        super().__init__(physics, task, time_limit=duration, n_sub_steps=substeps)
        # A control step may be shortened by the end of the flight, never lengthened.
        self._substeps, self._timestep, self._duration = substeps, physics.timestep(), duration

    def step(self, action: Any) -> dm_env.TimeStep:
        """Flies one control step.

        Args:
            action: Extra command of an outside agent, as `action_spec` says.

        Returns:
            The time step; LAST when the flight's duration is over.

        Raises:
            PhysicsError: If the plant diverged; what was recorded stays in `task.recorder`.
        """
        if self._reset_next_step:
            return self.reset()
        physics, task = self._physics, self._task
        self._step_count += 1
        # A product of a whole number and the timestep, as the samples of a law are of its period:
        # where both are alike they fall on the same instant to the last bit.
        end = min(self._step_count * self._substeps * self._timestep, self._duration)
        task.before_step(action, physics)
        task.fly(physics, end)
        physics.check_divergence()
        self._reset_next_step = end == self._duration
        kind = dm_env.StepType.LAST if self._reset_next_step else dm_env.StepType.MID
        return dm_env.TimeStep(kind, task.get_reward(physics), 1.0, task.get_observation(physics))

    @property
    def duration(self) -> float:
        """Length of an episode, s."""
        return self._duration


def simulate(
    environment: Environment,
    *,
    meta: dict[str, Any],
    progress: Callable[[float], None] | None = None,
    watch: Callable[[Trajectory], None] | None = None,
) -> Trajectory:
    """Flies one episode without an outside agent and records it.

    Args:
        environment: The environment.
        meta: Plain data to keep with the trajectory.
        progress: Called with the simulated time after each control step, s.
        watch: Called during the flight with its rows, some at a time, each row once.

    Returns:
        The flight; if the plant diverged, the rows before, with the reason in `meta["diverged"]`.
    """
    task, physics = environment.task, environment.physics
    recorder = task.recorder = Recorder(task.units(physics))
    action = np.zeros(environment.action_spec().shape)
    shown, looked = 0, perf_counter()

    def show(stop: int) -> None:
        nonlocal shown, looked
        if watch and stop > shown:
            watch(recorder.trajectory(meta, shown, stop))
            shown, looked = stop, perf_counter()

    try:
        step = environment.reset()
        while not step.last():
            step = environment.step(action)
            if progress:
                progress(physics.time())
            if len(recorder) > shown + CHUNK and perf_counter() > looked + PAUSE:
                show(len(recorder) - 1)  # the last row may still be replaced
    except control.PhysicsError as error:
        meta = {**meta, "diverged": str(error)}
    finally:
        task.recorder = None
    show(len(recorder))
    return recorder.trajectory(meta)
