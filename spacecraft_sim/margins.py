"""What a sampled law bears on its machine: delay, sampling period, limited torques, relays.

The linear figures are of the loop linearised, from the compiled machine, where a flight settles;
beside them stands what the same machine shows in flights from a small disturbance there.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from spacecraft_sim import compiled_dynamics
from spacecraft_sim.chart import pulses
from spacecraft_sim.dynamics import jacobian, linear_plant
from spacecraft_sim.loop_margins import Loop, close, delay_margin, longest_period

Array = np.ndarray
HOLDS = ("zero-order hold", "euler", "first-order hold", "tustin")
_UPPER = 3.0  # longest sampling period looked at, s
_FINE = 20  # samples in a delay, where continuous time is meant
_KICK = 1e-6  # largest disturbance of an angle, rad, or a rate, rad/s
_SHARES = (1.0, 0.5, 0.2, 0.1, 0.05)  # of the largest torque, to which it is limited
_JUDGED = 1 / 3  # last share of a flight with relay thrusters, in which pulses are counted
_NEWTON = 3  # rounds: from 1e-3 of the scale to rounding
_GONE = 1e-7  # share of the largest deviation below which a motion has died out
_CYCLES = 30  # of the critical oscillation in a flight
_SEEN = 1e-6  # share of a motion in the readings, below which the law does not see it
_SLOW = 0.02  # turn between samples below which a motion is taken for one without oscillation, rad
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
        motion: The machine as a function about where it has settled.
        basis: The states that the loop speaks of, shape (2 nv, n).
        torques: What holds the machine there, by channel of the law, N m.
        loop: The loop linearised there.
    """

    physics: Any
    law: Any
    motion: compiled_dynamics.CompiledDynamics
    basis: Array
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
            f"constant: controller.programme.amplitude={[0.0] * len(law.sensors)}"
        )
    dynamics = compiled_dynamics.dynamics_at(physics, law.thrusters)
    # Only a law that points one axis leaves a spin; what others have is the rest of a swing.
    spin = compiled_dynamics.steady_spin(dynamics) * _points_one_axis(law)
    dynamics = replace(dynamics, qvel=spin)
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
        motion=dynamics,
        basis=N,
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
    delay, _ = delay_margin(settled.loop)
    found = [Margin(name="delay", linear=delay, flown=math.nan)]
    if flown and math.isfinite(delay):
        found[0] = replace(
            found[0],
            flown=_flown(lambda x: _growth(settled, x / _FINE, late=_FINE), delay),
        )
    holds = HOLDS if settled.law.filter.cutoffs else ("held torque",)
    for hold in holds:
        filter_ = replace(settled.law.filter, hold=hold) if hold in HOLDS else settled.law.filter
        period = longest_period(replace(settled.loop, filter=filter_), upper=_UPPER)
        measured = math.nan
        if flown and math.isfinite(period) and hold in (settled.law.filter.hold, "held torque"):
            measured = _flown(lambda x: _growth(settled, x), period)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class Relay:
    """A flight with relay thrusters, judged in its last third against the rules of its modulators.

    Attributes:
        modulation: Which modulators.
        min_on_time: Of the thrusters, s.
        angle: Largest angle from the goal, rad.
        dead_band: What the rule says of it, rad.
        rate: Largest rate, rad/s.
        impulse: What the rule says of it, one least pulse over the inertia, rad/s.
        firings: Pulses a second, all thrusters together.
        within: Whether both stay within what is granted beyond the rules.
    """

    modulation: str
    min_on_time: float
    angle: float
    dead_band: float
    rate: float
    impulse: float
    firings: float
    within: bool


def relays(missions: Sequence[Any]) -> tuple[Relay, ...]:
    """Flies scenarios whose laws are modulated.

    Args:
        missions: The missions; their guarantees speak of an angle, in rad, and a rate, in rad/s.
    """
    rows = []
    for mission in missions:
        track, law = mission.fly(), mission.controller
        by_unit = {g.unit: g.check(track) for g in mission.guarantees}
        angle, rate = by_unit["rad"], by_unit["rad/s"]
        begin = track.time[-1] * (1 - _JUDGED)
        starts = [pulses(track.time, track[name])[0] for name in law.thrusters]
        count = sum(int(np.count_nonzero(start >= begin)) for start in starts)
        rows.append(
            Relay(
                modulation=mission.scenario.controller["modulation"]["kind"],
                min_on_time=mission.thrusters["mujoco"][law.thrusters[0]].min_on_time,
                angle=angle.measured,
                dead_band=angle.predicted,
                rate=rate.measured,
                impulse=rate.predicted,
                firings=count / (track.time[-1] - begin),
                within=all(v.holds for v in by_unit.values()),
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


def _growth(settled: Settled, period: float, *, late: int = 0) -> float:
    """Rate at which the least stable motion of the sampled loop grows in a flight, 1/s.

    The flight begins with that motion, by the linear loop, so that no other one which decays more
    slowly hides what it does; it is fitted over the second half.
    """
    start = _least_stable(settled, period, late)
    steps = math.ceil(_CYCLES * max(start.cycle, 4 * period) / period)
    physics, law = settled.physics, settled.law
    with physics.reset_context():
        pass
    data = physics.data.ptr
    data.qpos[:], data.qvel[:] = start.motion.qpos, start.motion.qvel
    physics.after_reset()
    read = physics.select(law.sensors)
    places = [physics.inputs.index(name) for name in law.thrusters]
    value = np.zeros(len(physics.inputs))
    still, target = [0.0] * len(physics.inputs), _readings(settled, settled.motion)
    filter_, memory = start.filter, start.memory
    # A held torque is late by half a period: with that, those under way are late by `late` periods.
    waiting = [((k - 0.5) * period, torque.tolist()) for k, torque in enumerate(start.under_way)]
    deviation = np.zeros(steps)
    for k in range(steps):
        t, end = k * period, (k + 1) * period
        y = read()
        deviation[k] = math.dist(y, target)
        memory = filter_.step(law.formula.filtered(t, y), memory)
        at = t + (late - 0.5) * period if late else t
        waiting.append((at, law.formula.command(t, y, memory.w)))
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
    window = max(1, round(start.cycle / period))
    half = deviation[steps // 2 :]
    if half.max() < _GONE * deviation.max():
        return -math.inf  # rounding is left, which neither grows nor decays
    peaks = np.array([half[k : k + window].max() for k in range(0, len(half) - window, window)])
    if len(peaks) < 3 or not np.all(peaks > 0):
        return -math.inf
    return float(np.polyfit(np.arange(len(peaks)) * window * period, np.log(peaks), 1)[0])


class _Start(NamedTuple):
    """A flight that begins with one motion of the sampled loop: machine, filter, torques."""

    motion: compiled_dynamics.CompiledDynamics
    filter: Any
    memory: Any
    under_way: Array
    cycle: float


def _least_stable(settled: Settled, period: float, late: int) -> _Start:
    law, loop = settled.law, settled.loop
    roots, vectors = np.linalg.eig(loop.sampled_matrix(period, late=late))
    n, nz = len(loop.A), len(loop.filter.cutoffs)
    # Parts that swing against each other may do so unseen: no torque speeds them up.
    seen = np.max(np.abs(loop.C @ vectors[:n]), axis=0)
    seen = seen > _SEEN * np.max(np.abs(vectors[:n]), axis=0)
    least = int(np.argmax(np.where(seen, np.abs(roots), 0.0)))
    state = np.real(vectors[:, least])
    state *= _KICK / np.max(np.abs(state[:n]))
    decay, gain = law.filter.coefficients(period)
    filter_ = replace(law.filter, period=period, decay=decay, gain=gain)
    motion = settled.motion.moved(settled.basis @ state[:n])
    z = np.array(law.formula.filtered(0.0, _readings(settled, motion)))
    # In the loop w = v + b z, where z counts from rest.  A sample before, z was such that the
    # filter comes to this w from this w: w = a w + b (z - z before).
    w = state[n : n + nz] + np.array(gain) * (loop.filtered @ loop.C @ state[:n])
    before = z - (1 - np.array(decay)) * w / np.array(gain)
    memory = filter_.step(before.tolist(), None)._replace(w=tuple(w.tolist()))
    return _Start(
        motion=motion,
        filter=filter_,
        memory=memory,
        under_way=settled.torques + state[n + nz :].reshape(late, len(settled.torques)),
        cycle=2 * math.pi * period / max(abs(np.angle(roots[least])), _SLOW),
    )


def _readings(settled: Settled, motion: compiled_dynamics.CompiledDynamics) -> list[float]:
    """Readings of the law at the reference of a motion."""
    values = motion.readings(np.zeros(2 * motion.model.nv))
    readings = dict(zip(motion.units, values.tolist(), strict=True))
    return [readings[name] for name in settled.law.sensors]


def _points_one_axis(law: Any) -> bool:
    return "s1_y" in law.sensors


def _unseen(physics: Any, law: Any) -> tuple[int, ...]:
    """The roll about s1, and its rate, where a law reads or drives neither."""
    if not _points_one_axis(law):
        return ()
    first = physics.model.ptr.nv - 3
    both = "torque_x" not in law.thrusters
    return (first, physics.model.ptr.nv + first) if both else (first,)
