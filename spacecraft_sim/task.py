"""The task of a flight: measure -> controller -> thrusters -> plant, on either plant."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from dm_control.rl import control
from dm_env import specs

from spacecraft_sim.controller import Controller
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
        accuracy: float = 1e-2,
        seed: int = 0,
    ):
        for name in controller.thrusters:
            thrusters[name]  # raises if there is no such channel
            if controller.period is None and thrusters[name].delay.mean == 0:
                raise ValueError(
                    f"thruster {name!r} has no delay and the law no sampling period: a relay in "
                    "continuous time would chatter; set thrusters.*.delay or controller.period"
                )
        self.recorder: Recorder | None = None
        self._controller, self._thrusters = controller, thrusters
        self._initial, self._disturbance = initial, disturbance
        self._accuracy = accuracy
        self._random = np.random.default_rng(seed)
        self._channels = [thrusters.names.index(name) for name in controller.thrusters]

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
        self._memory = self._controller.init()
        self._state = self._thrusters.init()
        self._extra = [0.0] * len(self._thrusters.names)
        self._command = [0.0] * len(self._thrusters.names)
        self._impulse = [0.0] * len(wanted)
        self._spent = [0.0] * len(self._thrusters.names)
        self._samples = 0
        self._unknown_slope = self._controller.period is None
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
                end, self._edge, sample, jump, t + disturbance.longest, _foreseen(self._trace)
            )
            if self._unknown_slope:
                stop = min(stop, t + probe)
                self._unknown_slope = False
            torque, rate = disturbance.line(t, stop)
            value, rates = self._thrust + torque, self._slope + rate
            physics.begin(value, rates)
            physics.advance(stop)
            decided = stop == sample
            if period is None:
                stop, decided = self._switching(physics, stop)
            if self.recorder:
                self._accumulate(value, rates, stop - t)
            t, landed = stop, stop in (self._edge, jump)
            if decided:
                self._decide(t)
            elif landed or any(self._slope):
                self._follow_thrust(t)
            if decided or landed:
                self._trace = self._trace[-1:]
                # From a zero of its own the event function can only come back once, which shows.
                self._unknown_slope = landed and period is None
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
        if points[-1][1] > 0 and (dip := _suspected_dip(points)) is not None:
            inside = (dip, carried_to(dip))
            points[-1] = inside if inside[1] <= 0 else (stop, carried_to(stop))
        if points[-1][1] <= 0:
            points.append(_first_not_positive(carried_to, points))
            if physics.time() != points[-1][0]:
                physics.advance(points[-1][0])
        self._trace = points[-4:]
        return points[-1][0], points[-1][1] <= 0

    def _least_event(self, t: float) -> float:
        events = self._controller.events(t, self._measure(), self._memory)
        return min(events) if events else 1.0

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
        """Takes thrust and slope just after `t`, and the next edge, from the thrusters."""
        self._thrust, self._slope, self._edge = self._thrusters.line(t, self._state)

    # -- the record ------------------------------------------------------------------------------

    def units(self, physics: Plant) -> dict[str, str]:
        """Returns the signals of a row of the recorder, with their units.

        `<thruster>` is the thrust, `<thruster>_command` the law's command, `<input>_impulse` the
        time integral of an input and `<thruster>_spent` that of its magnitude.

        Args:
            physics: The plant.
        """
        channels, inputs = self._thrusters.names, physics.inputs
        return {
            **physics.units,
            **dict.fromkeys(inputs, "N or N m"),
            **{f"{name}_command": "N or N m" for name in channels},
            **{f"{name}_impulse": "N s or N m s" for name in inputs},
            **{f"{name}_spent": "N s or N m s" for name in channels},
            **physics.coordinate_units(),
        }

    def _record(self, physics: Plant) -> None:
        if self.recorder is None:
            return
        t = physics.time()
        self.recorder.add(
            [
                *(t, *self._read(), *self._thrust, *self._disturbance.value(t)),
                *(*self._command, *self._impulse, *self._spent, *physics.coordinates()),
            ]
        )

    def _accumulate(self, value: list[float], slope: list[float], span: float) -> None:
        """Adds a piece to the impulses; no thrust changes its sign within one."""
        spent = self._spent
        for i, (v, s) in enumerate(zip(value, slope, strict=True)):
            impulse = span * (v + s * span / 2)
            self._impulse[i] += impulse
            if i < len(spent):
                spent[i] += abs(impulse)


Point = tuple[float, float]  # time, least event function
WIDTH = 1e-11  # to which a switching instant is located, s
_PROBE = 0.05  # share of a control step after which a new smooth stretch is looked at first: it
# gives the slope by which a dip across zero and back is suspected, and a crossing foreseen


def _foreseen(points: Sequence[Point]) -> float:
    """When the event function will cross zero, extrapolated from its last points; inf if not.

    Cutting the piece there spares most of the repetitions that `_first_not_positive` would need.
    The first cut falls just short of the crossing, the next one just behind it.
    """
    if len(points) < 3:
        return math.inf
    t, before = points[-1][0], points[-2]
    ahead = _root_of_parabola(points[-1], before, points[-3])
    if ahead < math.inf and len(points) > 3:
        ahead = _on_cubic(ahead, points)
    if ahead < 0.05 * (t - before[0]):
        return t + ahead + WIDTH / 2
    return t + (1 - 3e-5) * ahead


def _on_cubic(ahead: float, points: Sequence[Point]) -> float:
    """Moves a root of the parabola to the cubic through the last four points, by Newton steps."""
    (t0, f0), (t1, f1), (t2, f2), (t3, f3) = points[-4:]
    a, b, c = t3 - t2, t3 - t1, t3 - t0
    d1, d2, d3 = (f3 - f2) / a, (f2 - f1) / (t2 - t1), (f1 - f0) / (t1 - t0)
    e1, e2 = (d1 - d2) / b, (d2 - d3) / (t2 - t0)
    g = (e1 - e2) / c
    for _ in range(2):
        u, v, w = ahead, ahead + a, ahead + b
        value = f3 + u * (d1 + v * (e1 + w * g))
        slope = d1 + (u + v) * e1 + (u * v + v * w + w * u) * g
        if slope >= 0:
            return math.inf
        ahead -= value / slope
    return max(ahead, 0.0)


def _suspected_dip(points: Sequence[Point]) -> float | None:
    """Where a parabola through the last three points dips between the last two, if it may cross 0.

    While the function curves upwards its slope over the last piece was steeper than it is now: only
    if that slope leads below zero can there be a pair of zeros between two positive ends.
    """
    if len(points) < 3:
        return None
    (t0, f0), (t1, f1), (t2, f2) = points[-3:]
    slope = (f1 - f0) / (t1 - t0)
    if slope >= 0 or f1 + slope * (t2 - t1) > 0:
        return None
    curvature = ((f2 - f1) / (t2 - t1) - slope) / (t2 - t0)
    dip = (t0 + t1) / 2 - slope / (2 * curvature)
    return dip if t1 < dip < t2 else None


def _first_not_positive(function: Callable[[float], float], points: Sequence[Point]) -> Point:
    """Narrows a sign change to the last bits of the clock, from the side that is not positive.

    Args:
        function: The event function.
        points: The last two bracket the sign change; an earlier one, if any, shows the curvature.

    Returns:
        A point within `WIDTH` after the sign change.
    """
    *earlier, a, b = points
    third = earlier[-1] if earlier else None
    width = max(WIDTH, 4 * math.ulp(b[0]))
    for k in range(100):
        span = b[0] - a[0]
        if span <= width or -b[1] <= width * (a[1] - b[1]) / span:
            break
        step = span / 2 if k % 5 == 4 else _root_of_parabola(a, b, third)
        t = a[0] + min(max(step + width / 2, width / 2), span - width / 2)
        point = (t, function(t))
        if point[1] > 0:
            a, third = point, a
        else:
            b, third = point, b
    return b


def _root_of_parabola(a: Point, b: Point, third: Point | None) -> float:
    """How far after a the parabola, or chord, through the points first falls to zero; or inf."""
    (ta, fa), (tb, fb) = a, b
    slope, curvature = (fb - fa) / (tb - ta), 0.0
    if third is not None:
        curvature = ((third[1] - fb) / (third[0] - tb) - slope) / (third[0] - ta)
    slope -= curvature * (tb - ta)  # at a
    discriminant = slope * slope - 4 * curvature * fa
    if discriminant < 0 or (fall := math.sqrt(discriminant) - slope) <= 0:
        return math.inf
    return 2 * fa / fall


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
