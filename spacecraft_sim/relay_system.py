"""A linear system under delayed relay feedback, propagated exactly from event to event.

Plant.  beta'' = u + f for the rigid coordinate, z_k' = lambda_k z_k + b_k (u + f) for each elastic
pair, s = c0 beta + c1 beta' + 2 Re sum d_k z_k.  u and f are divided by the inertia: rad/s^2.

Relay.  The command is -A sign s, A a staircase of |s|; it takes effect after the delay.  Between
two effects u is constant and s is a polynomial plus exponentials in closed form (`curve.py`).  The
command changes where s leaves its cell of the staircase; its first exit is found, never missed.

Source: the systems of Efremov, Polyakov & Strygin (2006), Theorems 1 and 2.
"""

import cmath
import math
from bisect import bisect_left, bisect_right
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.curve import Curve, Wave
from spacecraft_sim.delay import Delay, arrival
from spacecraft_sim.disturbance import Torque

Array = np.ndarray


class State(NamedTuple):
    """Rigid angle, rad, its rate, rad/s, and the complex modal coordinates."""

    angle: float
    rate: float
    modes: tuple[complex, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A linear function of the state: angle * beta + rate * beta' + 2 Re sum modes_k z_k.

    Attributes:
        angle: Coefficient of the angle.
        rate: Coefficient of the rate.
        modes: Complex coefficients of the modal coordinates; none for the rigid part alone.
    """

    angle: float = 0.0
    rate: float = 0.0
    modes: tuple[complex, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class RelaySystem:
    """Plant and relay.

    Attributes:
        switching: The switching function s.
        thresholds: Values of |s| at which the level changes, ascending, rad/s.
        levels: Acceleration in each band of |s|, one more than thresholds, rad/s^2.
        eigenvalues: lambda_k, one of each conjugate pair, 1/s.
        drive: b_k.
    """

    switching: Row
    thresholds: tuple[float, ...] = ()
    levels: tuple[float, ...]
    eigenvalues: tuple[complex, ...] = ()
    drive: tuple[complex, ...] = ()

    def __post_init__(self) -> None:
        if len(self.levels) != len(self.thresholds) + 1:
            raise ValueError(
                f"{len(self.thresholds)} thresholds need {len(self.thresholds) + 1} levels, "
                f"got {len(self.levels)}"
            )
        if any(a >= b for a, b in pairwise((0.0, *self.thresholds))):
            raise ValueError(f"thresholds must be positive and ascending, got {self.thresholds}")
        n = len(self.eigenvalues)
        for name, parts in (
            ("drive", self.drive),
            ("modes of the switching row", self.switching.modes),
        ):
            if len(parts) != n and (parts or name == "drive"):
                raise ValueError(f"{n} eigenvalues need {n} {name}, got {len(parts)}")
        positive(lowest_level=min(self.levels))
        wrong = [x for x in self.eigenvalues if not (x.real <= 0 and x != 0)]
        if wrong:
            raise ValueError(f"eigenvalues must have Re <= 0 and not be zero; got {wrong}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What a propagation found.

    Attributes:
        switch_times: Instants at which the command changed, shape (n,), s.
        commands: The new commands, shape (n,), rad/s^2.
        times: Starts of the segments of constant input, and the end of the run, shape (m + 1,), s.
        inputs: u + constant f of each segment, shape (m,), rad/s^2.
        states: States at `times`, less the steady response to a periodic disturbance.
        system: The system.
        periodic: The periodic disturbance, if any.
    """

    switch_times: Array
    commands: Array
    times: Array
    inputs: Array
    states: tuple[State, ...]
    system: RelaySystem
    periodic: Torque | None

    def at(self, times: Sequence[float] | Array) -> tuple[Array, Array, Array]:
        """Returns angle (n,), rate (n,) and modal coordinates (n, k) at the given times.

        Args:
            times: Instants within the run, shape (n,), s.
        """
        t = np.asarray(times, dtype=float)
        i = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.inputs) - 1)
        tau, u = t - self.times[i], self.inputs[i]
        angle, rate = np.array([(s.angle, s.rate) for s in self.states]).T
        z = np.array([s.modes for s in self.states]).reshape(len(self.states), -1)[i]
        eigenvalues, drive = np.array(self.system.eigenvalues), np.array(self.system.drive)
        rest = -np.outer(u, drive / eigenvalues) if drive.size else np.zeros_like(z)
        steady = _Steady(self.system, self.periodic)
        modes = rest + (z - rest) * np.exp(np.outer(tau, eigenvalues)) if drive.size else z
        shift = [steady.state(x) for x in t.tolist()]
        return (
            angle[i] + tau * (rate[i] + tau * u / 2) + [s.angle for s in shift],
            rate[i] + tau * u + [s.rate for s in shift],
            modes + np.array([s.modes for s in shift]).reshape(modes.shape),
        )

    def peak(self, row: Row, *, after: float = 0.0) -> tuple[float, float]:
        """Finds the largest |row . state| from `after` on: extrema are roots of the derivative.

        Args:
            row: The function of the state.
            after: Start of the search, s.

        Returns:
            The largest absolute value and its time, s.

        Raises:
            ValueError: If the run ends before `after`.
        """
        if after > self.times[-1]:
            raise ValueError(f"after = {after} s, but the run ends at {self.times[-1]} s")
        steady = _Steady(self.system, self.periodic)
        worst, when = -1.0, after
        for k in range(len(self.inputs)):
            t0, t1 = float(self.times[k]), float(self.times[k + 1])
            if t1 < after or t1 <= t0:
                continue
            curve = _curve(self.system, row, self.states[k], float(self.inputs[k]), steady, t0)
            slope = curve.derivative()
            tau, end = max(after - t0, 0.0), t1 - t0
            while True:
                value = abs(curve(tau)[0])
                if value > worst:
                    worst, when = value, t0 + tau
                if tau >= end:
                    break
                rising = slope(tau)
                up = rising[0] > 0 or (rising[0] == 0 and rising[1] > 0)
                low, high = (0.0, math.inf) if up else (-math.inf, 0.0)
                found = slope.first_exit(tau, end, low, high)
                tau = end if found is None else min(max(found, tau + 1e-12), end)
        return worst, when


def propagate(
    system: RelaySystem,
    *,
    start: State,
    duration: float,
    delay: float | Delay | Callable[[float], float],
    pending: Sequence[tuple[float, float]] = (),
    acting: float = 0.0,
    feedback_from: float = 0.0,
    disturbance: Torque | None = None,
    steps: Sequence[tuple[float, float]] = (),
) -> Run:
    """Propagates the closed loop from t = 0.

    Args:
        system: Plant and relay.
        start: State at t = 0.
        duration: Length of the run, s.
        delay: h, s: constant, sinusoidal, or any function with h > 0 and h' < 1.
        pending: Commands still under way at t = 0: (time of effect, acceleration), ascending.
        acting: Acceleration in force at t = 0, rad/s^2.
        feedback_from: Time of the first feedback command, s; before it `pending` alone acts.
        disturbance: Constant and periodic acceleration f, rad/s^2.
        steps: Piecewise constant f on top: (time, value from then on), ascending, s and rad/s^2.

    Returns:
        Switchings, segments and states.

    Raises:
        ValueError: If the delay is negative or runs backwards, or an input is out of order.
    """
    positive(duration=duration)
    given = [start.angle, start.rate, *start.modes, acting, *(x for pair in pending for x in pair)]
    if not all(map(cmath.isfinite, given)):
        raise ValueError(
            f"start, acting and pending must be finite, got {start}, {acting}, {pending}"
        )
    if len(start.modes) != len(system.eigenvalues):
        raise ValueError(
            f"start has {len(start.modes)} modal coordinates, the system {len(system.eigenvalues)}"
        )
    if disturbance is not None and disturbance.waveform == "square":
        raise ValueError("a square disturbance has corners: give it as `steps`, (time, value)")
    arrive = arrival(delay)
    queue, changes = deque(pending), deque(steps)
    for name, times in (("pending", [t for t, _ in queue]), ("steps", [t for t, _ in changes])):
        if any(t < 0 for t in times) or times != sorted(times):
            raise ValueError(f"{name} must be ascending times >= 0, got {times}")
    periodic = disturbance if disturbance is not None and disturbance.amplitude else None
    force = disturbance.constant if disturbance is not None else 0.0
    steady, u, step = _Steady(system, periodic), acting, 0.0
    relay, cell = _Staircase(system), _Cell(-1, -math.inf, math.inf, acting)  # no feedback yet
    switches, commands = [], []

    def issue(at: float, new: _Cell) -> float:
        """Commands the level of a cell; returns when the next command takes effect."""
        effect = arrive(at)
        if queue and queue[-1][0] > effect:
            raise ValueError(
                f"pending commands act until {queue[-1][0]} s, after the feedback command of "
                f"t = {at} s, which acts at {effect} s: a delay line keeps the order"
            )
        switches.append(at)
        commands.append(new.level)
        queue.append((effect, new.level))
        return queue[0][0]

    t, x = 0.0, steady.subtract(0.0, start)
    times, inputs, states = [0.0], [], [x]
    while t < duration:
        while queue and queue[0][0] <= t:
            u = queue.popleft()[1]
        while changes and changes[0][0] <= t:
            step = changes.popleft()[1]
        acceleration = u + force + step
        curve = _curve(system, system.switching, x, acceleration, steady, t)
        if cell.index < 0 and t >= feedback_from:
            cell = relay.cell(curve(0.0)[0])
            issue(t, cell)
        end = min(queue[0][0] if queue else math.inf, changes[0][0] if changes else math.inf)
        end = min(end, duration, feedback_from if cell.index < 0 else math.inf)
        tau = 0.0
        while (found := curve.first_exit(tau, end - t, cell.low, cell.high)) is not None:
            tau = found
            cell = relay.next(cell, curve(tau)[0])
            end = min(end, issue(t + tau, cell))
        x = moved(system, x, acceleration, end - t)
        t = end
        times.append(t)
        inputs.append(acceleration)
        states.append(x)
    return Run(
        switch_times=np.array(switches),
        commands=np.array(commands),
        times=np.array(times),
        inputs=np.array(inputs),
        states=tuple(states),
        system=system,
        periodic=periodic,
    )


class _Cell(NamedTuple):
    """A cell of the staircase: s between two bounds, and the command there."""

    index: int
    low: float
    high: float
    level: float


class _Staircase:
    """The cells of s, from below."""

    def __init__(self, system: RelaySystem):
        v = system.thresholds
        self._bounds = (-math.inf, *(-x for x in reversed(v)), 0.0, *v, math.inf)
        self._levels = (*reversed(system.levels), *(-p for p in system.levels))

    def cell(self, s: float) -> _Cell:
        """The cell of a value; a bound belongs to the cell farther from zero, zero to the upper."""
        inner = self._bounds[1:-1]
        return self._at(bisect_right(inner, s) if s >= 0 else bisect_left(inner, s))

    def next(self, cell: _Cell, s: float) -> _Cell:
        """The neighbour behind the bound at which s is."""
        return self._at(cell.index + (1 if cell.high - s < s - cell.low else -1))

    def _at(self, i: int) -> _Cell:
        return _Cell(i, self._bounds[i], self._bounds[i + 1], self._levels[i])


class _Steady:
    """The steady response to F sin(omega t + phi) = Re G e^(i omega t)."""

    def __init__(self, system: RelaySystem, torque: Torque | None):
        self.torque = torque
        if torque is None:
            self._none = State(0.0, 0.0, (0j,) * len(system.eigenvalues))
            return
        if torque.frequency == 0:
            raise ValueError("a periodic disturbance needs a frequency; use its constant part")
        self.omega = torque.frequency
        self.G = G = -1j * torque.amplitude * cmath.exp(1j * torque.phase)
        w = 1j * self.omega
        pairs = list(zip(system.eigenvalues, system.drive, strict=True))
        self.forward = [b * G / 2 / (w - x) for x, b in pairs]
        self.backward = [b * G.conjugate() / 2 / (-w - x) for x, b in pairs]

    def state(self, t: float) -> State:
        """The response at t."""
        if self.torque is None:
            return self._none
        e, w = cmath.exp(1j * self.omega * t), 1j * self.omega
        pairs = zip(self.forward, self.backward, strict=True)
        return State(
            (self.G / w**2 * e).real,
            (self.G / w * e).real,
            tuple(a * e + b * e.conjugate() for a, b in pairs),
        )

    def subtract(self, t: float, state: State) -> State:
        """What is left of a state without the response."""
        own = self.state(t)
        return State(
            state.angle - own.angle,
            state.rate - own.rate,
            tuple(a - b for a, b in zip(state.modes, own.modes, strict=True)),
        )

    def wave(self, row: Row, t0: float) -> list[Wave]:
        """The response as it appears in a row, over the time since t0."""
        if self.torque is None:
            return []
        w, phase = 1j * self.omega, cmath.exp(1j * self.omega * t0)
        amplitude = (row.angle / w**2 + row.rate / w) * self.G
        for d, a, b in zip(row.modes, self.forward, self.backward, strict=False):
            amplitude += 2 * (d * a + (d * b).conjugate())
        return [(w, amplitude * phase / 2)]


def _curve(
    system: RelaySystem, row: Row, x: State, acceleration: float, steady: _Steady, t0: float
) -> Curve:
    """A row over a segment that starts at t0 in the state x, the steady response taken off."""
    rest, waves = 0.0, []
    parts = zip(row.modes, x.modes, system.eigenvalues, system.drive, strict=False)
    for d, z, exponent, b in parts:
        at_rest = -b * acceleration / exponent
        rest += 2 * (d * at_rest).real
        waves.append((exponent, d * (z - at_rest)))
    return Curve(
        row.angle * x.angle + row.rate * x.rate + rest,
        row.angle * x.rate + row.rate * acceleration,
        row.angle * acceleration / 2,
        waves + steady.wave(row, t0),
    )


def moved(system: RelaySystem, x: State, acceleration: float, tau: float) -> State:
    """Returns the state after a time under constant acceleration.

    Args:
        system: The system.
        x: State at the start.
        acceleration: u + f, rad/s^2.
        tau: The time, s.
    """
    modes = []
    for z, exponent, b in zip(x.modes, system.eigenvalues, system.drive, strict=True):
        at_rest = -b * acceleration / exponent
        modes.append(at_rest + (z - at_rest) * cmath.exp(exponent * tau))
    return State(
        x.angle + tau * (x.rate + tau * acceleration / 2),
        x.rate + tau * acceleration,
        tuple(modes),
    )
