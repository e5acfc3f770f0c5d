"""What a sampled law bears on its machine: delay, sampling period, saturated torques.

The linear figures are of the loop linearised, from the compiled machine, where a flight settles;
beside them stands what the same machine shows in flights from a small disturbance there.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from spacecraft_sim import compiled_dynamics
from spacecraft_sim.dynamics import jacobian, linear_plant
from spacecraft_sim.loop_margins import Loop, close, delay_margin, longest_period

Array = np.ndarray
HOLDS = ("zero-order hold", "euler", "first-order hold", "tustin")
_UPPER = 3.0  # longest sampling period looked at, s
_FINE = 20  # samples in a delay, where continuous time is meant
_KICK = 1e-6  # disturbance of each velocity, rad/s
_SHARES = (1.0, 0.5, 0.2, 0.1, 0.05)  # of the largest torque, to which it is limited
# A slower motion that decays may hide one that grows: flights last so many of its time constants.
_CONSTANTS, _LONGEST = 14, 150.0  # the latter in s
_NEWTON = 3  # rounds: from 1e-3 of the scale to rounding
_CYCLES = 30  # of the critical oscillation in a flight
_BRACKET, _ROUNDS = 0.15, 7  # about the linear figure, where MuJoCo's is looked for


@dataclass(frozen=True, slots=True, kw_only=True)
class Margin:
    """One figure, linear and as flown.

    Attributes:
        name: What it is.
        linear: Of the linearised loop, s; inf if there is none.
        flown: What MuJoCo shows, s; NaN if it was not found near the linear figure, or not sought.
    """

    name: str
    linear: float
    flown: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Settled:
    """A law and its machine where they have come to rest, or to a steady spin.

    Attributes:
        physics: The MuJoCo plant.
        law: The law, one with a formula and a filter.
        qpos: Configuration.
        qvel: Velocities.
        torques: What holds the machine there, by channel of the law, N m.
        loop: The loop linearised there.
    """

    physics: Any
    law: Any
    qpos: Array
    qvel: Array
    torques: Array
    loop: Loop


def settle(mission: Any) -> Settled:
    """Flies a mission to its end and linearises the loop there.

    Args:
        mission: The mission, long enough to settle.

    Raises:
        ValueError: If the law has no formula with a filter, or the machine has not settled.
    """
    law, physics = mission.controller, mission.mujoco
    if not hasattr(law, "formula") or not hasattr(law, "filter"):
        raise ValueError(
            f"{mission.scenario.controller['law']} is not a smooth sampled law: its loop cannot be "
            "linearised"
        )
    t = float(mission.fly().time[-1])
    y, still = physics.select(law.sensors)(), [0.0] * len(law.filter.cutoffs)
    if law.formula.command(t, y, still) != law.formula.command(t + 0.1, y, still):
        raise ValueError(
            f"{mission.scenario.name}: not settled, the law follows a motion; make its programme "
            "constant: controller.programme.amplitude=[0.0, ..]"
        )
    dynamics = compiled_dynamics.dynamics_at(physics, law.thrusters)
    dynamics = replace(dynamics, qvel=_steady(physics))
    N = compiled_dynamics.basis(dynamics.model, without=_unseen(physics, law))
    dynamics, torques = _rest(dynamics, law, N, t)
    try:
        plant = linear_plant(dynamics, state=np.zeros(len(N)), torques=torques, basis=N)
    except ValueError as error:
        raise ValueError(
            f"{mission.scenario.name}: not settled at t = {t:.6g} s ({error}); make the flight "
            "longer, or the programme of a path constant"
        ) from error
    return Settled(
        physics=physics,
        law=law,
        qpos=dynamics.qpos,
        qvel=dynamics.qvel,
        torques=torques,
        loop=close(law, plant, t=t),
    )


def _rest(dynamics: Any, law: Any, N: Array, t: float) -> tuple[Any, Array]:
    """The exact rest near the end of a flight, by Newton's method, and its torques."""
    places = [list(dynamics.units).index(name) for name in law.sensors]
    still = [0.0] * len(law.filter.cutoffs)

    def torques(x: Array) -> Array:
        return np.array(law.formula.command(t, dynamics.readings(x)[places].tolist(), still))

    def drift(z: Array) -> Array:
        x = N @ z
        return N.T @ dynamics.rates(x, torques(x))

    for _ in range(_NEWTON):
        zero = np.zeros(N.shape[1])
        step = np.linalg.lstsq(jacobian(drift, zero), -drift(zero), rcond=1e-9)[0]
        dynamics = dynamics.moved(N @ step)
    return dynamics, torques(np.zeros(len(N)))


def margins(settled: Settled, *, flown: bool = True) -> tuple[Margin, ...]:
    """Finds the delay margin, and the longest sampling period by each hold of the filter.

    Args:
        settled: Law and machine.
        flown: Whether to look for the figures in flights too.

    Raises:
        ValueError: If the loop is not stable without delay.
    """
    delay, frequency = delay_margin(settled.loop)
    found = [Margin(name="delay", linear=delay, flown=math.nan)]
    if flown and math.isfinite(delay):
        found[0] = replace(
            found[0],
            flown=_flown(lambda x: _growth(settled, x / _FINE, _rest_of(x), frequency), delay),
        )
    holds = HOLDS if settled.law.filter.cutoffs else ("held torque",)
    for hold in holds:
        filter_ = replace(settled.law.filter, hold=hold) if hold in HOLDS else settled.law.filter
        period = longest_period(replace(settled.loop, filter=filter_), upper=_UPPER)
        measured = math.nan
        if flown and math.isfinite(period) and hold in (settled.law.filter.hold, "held torque"):
            measured = _flown(lambda x: _growth(settled, x, 0.0, frequency), period)
        found.append(Margin(name=f"sampling period, {hold}", linear=period, flown=measured))
    return tuple(found)


@dataclass(frozen=True, slots=True, kw_only=True)
class Saturation:
    """A flight with limited torques.

    Attributes:
        limit: Largest torque of every channel, N m.
        settling: When the readings of the law last leave a hundredth of their largest distance, s.
        distance: Distance of the readings from where they settle without limits, in the end.
    """

    limit: float
    settling: float
    distance: float


def saturation(mission: Any, limited: Callable[[float], Any]) -> tuple[Saturation, ...]:
    """Flies a scenario with its torques limited to shares of the largest that it asks for.

    Args:
        mission: The mission, with torques to spare.
        limited: Assembles it with another limit, N m.
    """
    law, first = mission.controller, mission.fly()
    goal = np.array([first[name][-1] for name in law.sensors])
    most = max(float(np.abs(first[f"{name}_command"]).max()) for name in law.thrusters)
    rows = []
    for share in _SHARES:
        track = limited(share * most).fly()
        readings = np.array([track[name] for name in law.sensors]).T
        distance = np.linalg.norm(readings - goal, axis=1)
        far = np.flatnonzero(distance > 0.01 * distance.max())
        rows.append(
            Saturation(
                limit=share * most,
                settling=float(track.time[far[-1]]) if len(far) else 0.0,
                distance=float(distance[-1]),
            )
        )
    return tuple(rows)


def _flown(growth: Callable[[float], float], linear: float) -> float:
    """Where flights change from decay to growth, near the linear figure."""
    low, high = (1 - _BRACKET) * linear, (1 + _BRACKET) * linear
    if growth(low) > 0 or growth(high) < 0:
        return math.nan
    for _ in range(_ROUNDS):
        middle = (low + high) / 2
        low, high = (low, middle) if growth(middle) > 0 else (middle, high)
    return (low + high) / 2


def _growth(settled: Settled, period: float, delay: float, frequency: float) -> float:
    """Rate at which a small disturbance grows, fitted over the second half of a flight, 1/s."""
    physics, law = settled.physics, settled.law
    cycle = 2 * math.pi / frequency if math.isfinite(frequency) else 50 * period
    slowest = -max(x.real for x in settled.loop.eigenvalues().tolist())
    duration = max(_CYCLES * max(cycle, 4 * period), min(_CONSTANTS / slowest, _LONGEST))
    steps = math.ceil(duration / period)
    decay, gain = law.filter.coefficients(period)
    filter_ = replace(law.filter, period=period, decay=decay, gain=gain)
    with physics.reset_context():
        pass
    data = physics.data.ptr
    data.qpos[:], data.qvel[:] = settled.qpos, settled.qvel + _KICK
    physics.after_reset()
    read = physics.select(law.sensors)
    places = [physics.inputs.index(name) for name in law.thrusters]
    value = np.zeros(len(physics.inputs))
    value[places] = settled.torques
    still, target = [0.0] * len(physics.inputs), None
    memory, waiting, deviation = None, [], np.zeros(steps)
    target = _target(settled)
    for k in range(steps):
        t, end = k * period, (k + 1) * period
        y = read()
        deviation[k] = math.dist(y, target)
        memory = filter_.step(law.formula.filtered(t, y), memory)
        waiting.append((t + delay, law.formula.command(t, y, memory.w)))
        while waiting and waiting[0][0] < end - 1e-12:
            at, torque = waiting.pop(0)
            if at > t:
                physics.begin(value.tolist(), still)
                physics.advance(at)
                t = at
            value[places] = torque
        physics.begin(value.tolist(), still)
        physics.advance(end)
        if not deviation[k] < 1.0:
            return math.inf
    window = max(1, round(cycle / period))
    half = deviation[steps // 2 :]
    peaks = np.array([half[k : k + window].max() for k in range(0, len(half) - window, window)])
    if len(peaks) < 3 or not np.all(peaks > 0):
        return -math.inf
    return float(np.polyfit(np.arange(len(peaks)) * window * period, np.log(peaks), 1)[0])


def _rest_of(delay: float) -> float:
    """A delay without that of the hold, which is half a sampling period."""
    return delay * (1 - 0.5 / _FINE)


def _target(settled: Settled) -> list[float]:
    """Readings of the law where it has settled."""
    physics = settled.physics
    dynamics = compiled_dynamics.CompiledDynamics(
        model=physics.model.ptr, qpos=settled.qpos, qvel=settled.qvel, wiring={}
    )
    readings = dict(
        zip(dynamics.units, dynamics.readings(np.zeros(2 * len(settled.qvel))), strict=True)
    )
    return [float(readings[name]) for name in settled.law.sensors]


def _steady(physics: Any) -> Array:
    """Velocities, without what is left of a swing; a spin stays."""
    qvel = physics.data.ptr.qvel.copy()
    qvel[np.abs(qvel) < 1e-3] = 0.0
    return qvel


def _unseen(physics: Any, law: Any) -> tuple[int, ...]:
    """The roll about s1, and its rate, where a law reads or drives neither."""
    if "s1_y" not in law.sensors:
        return ()
    first = physics.model.ptr.nv - 3
    both = "torque_x" not in law.thrusters
    return (first, physics.model.ptr.nv + first) if both else (first,)
