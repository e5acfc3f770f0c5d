"""The task of a flight: measure -> controller -> thrusters -> plant, on either plant."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from dm_control.rl import control
from dm_env import specs

from spacecraft_sim import crossing
from spacecraft_sim.controller import Controller, estimated_by, estimates_of
from spacecraft_sim.disturbance import Disturbance
from spacecraft_sim.plant import Plant
from spacecraft_sim.scenario import Initial
from spacecraft_sim.thrusters import Thrusters
from spacecraft_sim.trajectory import Recorder


class ControlTask(control.Task):
    """Flies a controller, closed inside the task; an outside agent may add to its command.

    Action: an extra command for every thruster channel, added to the controller's, N or N m, within
    plus and minus the channel's highest level; a relay delivers the nearest of its levels.
    Observation: every reading of the plant by name, SI units.
    Reward: 1/(1 + (angle/accuracy)^2), where the angle is that of `attitude_*`, rad; 1 on target,
    1/2 at the accuracy asked for.

    Inputs of which `input_units` says nothing are torques, N m.

    Attributes:
        recorder: Collects rows while it is set.
    """

    def __init__(
        self,
        controller: Controller,
        thrusters: Thrusters,
        *,
        initial: Initial,
        disturbance: Disturbance,
        input_units: Mapping[str, str] | None = None,
        accuracy: float = 1e-2,
        seed: int = 0,
    ):
        for name in controller.thrusters:
            spec = thrusters[name]  # raises if there is no such channel
            if controller.period is None and spec.delay.mean == 0 and spec.min_on_time == 0:
                raise ValueError(
                    f"thruster {name!r} has neither delay nor minimum on-time and the law no "
                    "sampling period: a relay in continuous time would chatter; set "
                    "thrusters.*.delay, thrusters.*.min_on_time or controller.period"
                )
        self.recorder: Recorder | None = None
        self._controller, self._thrusters = controller, thrusters
        self._initial, self._disturbance = initial, disturbance
        self._input_units = input_units or {}
        self._accuracy = accuracy
        self._random = np.random.default_rng(seed)
        self._channels = [thrusters.names.index(name) for name in controller.thrusters]
        # Whether instants at which something switches are to be found inside a step.
        self._located = controller.period is None or bool(disturbance.sensors)

    # -- what dm_control asks for ---------------------------------------------------------------

    def initialize_episode(self, physics: Plant) -> None:
        """Places the plant at its start and takes the first decision.

        Args:
            physics: The plant.
        """
        wanted = (*self._thrusters.names, *self._disturbance.names)
        if physics.inputs != wanted:
            raise ValueError(f"the plant's inputs are {physics.inputs}, the task's {wanted}")
        physics.set_initial(_scattered(self._initial, self._random))
        self._measure = physics.select(self._controller.sensors)
        self._read = physics.select(tuple(physics.units))
        self._attitude = physics.select(
            tuple(name for name in physics.units if name.startswith("attitude_"))
        )
        self._rates = physics.select(self._disturbance.sensors)
        self._memory = self._controller.init()
        self._ways = self._disturbance.init(self._rates())
        self._state = self._thrusters.init()
        self._extra = [0.0] * len(self._thrusters.names)
        self._command = [0.0] * len(self._thrusters.names)
        self._impulse = [0.0] * len(wanted)
        self._spent = [0.0] * len(self._thrusters.names)
        self._samples, self._push = 0, []
        self._unknown_slope = self._located
        self._decide(physics.time())
        self._record(physics)

    def before_step(self, action: Any, physics: Plant) -> None:
        """Takes the agent's extra command for the coming control step.

        Args:
            action: Extra command, shape (n_thrusters,), N or N m.
            physics: The plant.
        """
        extra = np.asarray(action, dtype=float).tolist()
        if len(extra) != len(self._thrusters.names):
            raise ValueError(
                f"the action has {len(extra)} entries; channels: {self._thrusters.names}"
            )
        if extra != self._extra:
            self._extra = extra
            self._issue(physics.time())

    def action_spec(self, physics: Plant) -> specs.BoundedArray:
        """Returns the bounds of the extra command.

        Args:
            physics: The plant.
        """
        highest = np.array([max(spec.levels) for spec in self._thrusters.specs])
        return specs.BoundedArray(highest.shape, float, -highest, highest, name="extra_command")

    def observation_spec(self, physics: Plant) -> dict[str, specs.Array]:
        """Returns the specification of the readings: scalars, by name.

        Args:
            physics: The plant.
        """
        return {name: specs.Array((), float, name=name) for name in physics.units}

    def get_observation(self, physics: Plant) -> dict[str, np.ndarray]:
        """Returns every reading by name.

        Args:
            physics: The plant.
        """
        return dict(zip(physics.units, np.array(self._read()), strict=True))

    def get_reward(self, physics: Plant) -> float:
        """Returns 1/(1 + (angle/accuracy)^2).

        Args:
            physics: The plant.
        """
        angle = math.hypot(*self._attitude()) / self._accuracy
        return 1 / (1 + angle * angle)

    # -- the flight ------------------------------------------------------------------------------

    def fly(self, physics: Plant, end: float) -> None:
        """Carries the plant to `end` through smooth pieces.

        A piece ends at the next thrust edge, sample or control step; a law in continuous time ends
        it earlier, at the instant at which its command changes.

        Args:
            physics: The plant.
            end: Time to reach, s.
        """
        disturbance, period = self._disturbance, self._controller.period
        t = physics.time()
        probe = _PROBE * (end - t)
        while t < end:
            sample = math.inf if period is None else self._samples * period
            jump = disturbance.next_edge(t)
            stop = min(
                end,
                self._edge,
                sample,
                jump,
                t + disturbance.longest,
                crossing.foreseen(self._trace),
            )
            if self._unknown_slope:
                stop = min(stop, t + probe)
                self._unknown_slope = False
            torque, rate = disturbance.line(t, stop)
            if self._push:
                torque = [x + y for x, y in zip(torque, self._push, strict=True)]
            value, rates = self._thrust + torque, self._slope + rate
            physics.begin(value, rates)
            physics.advance(stop)
            switched = False
            if self._located:
                stop, switched = self._switching(physics, stop)
            if self.recorder:
                self._accumulate(value, rates, stop - t)
            t, landed, before = stop, stop in (self._edge, jump), (self._thrust, self._push)
            if switched or stop == sample:
                self._switch(t, sampled=stop == sample)
            elif landed or any(self._slope):
                self._follow_thrust(t)
            if switched or landed or stop == sample:
                self._trace = self._trace[-1:]
                # Under the same thrust as before, from a zero of its own, the event function can
                # only come back once, which shows.
                jumped = landed or before != (self._thrust, self._push)
                self._unknown_slope = jumped and self._located
                self._record(physics)
        self._record(physics)

    def _switching(self, physics: Plant, stop: float) -> tuple[float, bool]:
        """Finds the first instant of the open piece at which the command changes, if it does.

        The plant is carried again from the opening to each trial instant.  It is left at the end of
        the piece, or at the instant found, where the event function is no longer positive.
        """

        def carried_to(t: float) -> float:
            physics.advance(t)
            return self._least_event(t)

        points = [*self._trace, (stop, self._least_event(stop))]
        if points[-1][1] > 0 and (dip := crossing.suspected_dip(points)) is not None:
            inside = (dip, carried_to(dip))
            points[-1] = inside if inside[1] <= 0 else (stop, carried_to(stop))
        if points[-1][1] <= 0:
            points.append(crossing.first_not_positive(carried_to, points))
            if physics.time() != points[-1][0]:
                physics.advance(points[-1][0])
        self._trace = points[-4:]
        return points[-1][0], points[-1][1] <= 0

    def _least_event(self, t: float) -> float:
        least = self._law_event(t)
        if self._ways:
            least = min(least, *self._disturbance.events(self._rates(), self._ways))
        return least

    def _law_event(self, t: float) -> float:
        events = self._controller.events(t, self._measure(), self._memory)
        return min(events) if events else 1.0

    def _switch(self, t: float, *, sampled: bool) -> None:
        """Lets those decide whose instant it is: the law, and the torques that follow a rate."""
        if self._ways:
            self._ways = self._disturbance.turned(self._rates(), self._ways)
        if sampled or self._law_event(t) <= 0:
            self._decide(t)
        else:
            self._follow_thrust(t)
            self._trace = [(t, self._least_event(t))]

    def _decide(self, t: float) -> None:
        """Lets the controller step on the present readings and issues its command."""
        u, self._memory = self._controller.step(t, self._measure(), self._memory)
        self._samples += 1
        for i, level in zip(self._channels, u, strict=True):
            self._command[i] = float(level)
        self._issue(t)
        self._trace = [(t, self._least_event(t))]

    def _issue(self, t: float) -> None:
        total = [c + e for c, e in zip(self._command, self._extra, strict=True)]
        self._state = self._thrusters.command(t, total, self._state)
        self._follow_thrust(t)

    def _follow_thrust(self, t: float) -> None:
        """Takes thrust, slope and following torques just after `t`, and the next edge."""
        self._thrust, self._slope, self._edge = self._thrusters.line(t, self._state)
        if self._ways:
            thrust = dict(zip(self._thrusters.names, self._thrust, strict=True))
            self._push = self._disturbance.push(self._ways, thrust)

    # -- the record ------------------------------------------------------------------------------

    def units(self, physics: Plant) -> dict[str, str]:
        """Returns the signals of a row of the recorder, with their units.

        `<thruster>` is the thrust, `<thruster>_command` the law's command, `<input>_impulse` the
        time integral of an input and `<thruster>_spent` that of its magnitude.  What a law
        estimates stands under the names that it gives.

        Args:
            physics: The plant.
        """
        inputs = {name: self._input_units.get(name, "N m") for name in physics.inputs}
        channels = {name: inputs[name] for name in self._thrusters.names}
        return {
            **physics.units,
            **inputs,
            **{f"{name}_command": unit for name, unit in channels.items()},
            **{f"{name}_impulse": f"{unit} s" for name, unit in inputs.items()},
            **{f"{name}_spent": f"{unit} s" for name, unit in channels.items()},
            **estimates_of(self._controller),
            **physics.coordinate_units(),
        }

    def _record(self, physics: Plant) -> None:
        if self.recorder is None:
            return
        t = physics.time()
        estimated = estimated_by(self._controller, self._memory)
        self.recorder.add(
            [
                *(t, *self._read(), *self._thrust, *self._torque(t)),
                *(*self._command, *self._impulse, *self._spent),
                *(*estimated, *physics.coordinates()),
            ]
        )

    def _torque(self, t: float) -> list[float]:
        torque = self._disturbance.value(t)
        return [a + b for a, b in zip(torque, self._push, strict=True)] if self._push else torque

    def _accumulate(self, value: list[float], slope: list[float], span: float) -> None:
        """Adds a piece to the impulses; no thrust changes its sign within one."""
        spent = self._spent
        for i, (v, s) in enumerate(zip(value, slope, strict=True)):
            impulse = span * (v + s * span / 2)
            self._impulse[i] += impulse
            if i < len(spent):
                spent[i] += abs(impulse)


_PROBE = 0.05  # share of a control step after which a new smooth stretch is looked at first: it
# gives the slope by which a dip across zero and back is suspected, and a crossing foreseen


def _scattered(initial: Initial, random: np.random.Generator) -> Initial:
    """The initial state with its components that are not zero moved at random."""

    def moved(vector: Sequence[float], half_width: float) -> tuple[float, ...]:
        return tuple(x + half_width * random.uniform(-1, 1) if x else x for x in vector)

    return initial.model_copy(
        update={
            "attitude": moved(initial.attitude, initial.attitude_scatter),
            "rate": moved(initial.rate, initial.rate_scatter),
        }
    )
