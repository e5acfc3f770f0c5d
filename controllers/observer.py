"""Laws fed by an observer: readings that no sensor gives, from those that there are.

The observer carries a reduced model along with the thrust that its own commands must have brought
about by now, and corrects it at each sample by what it foretold wrongly:
x(k+1) = F x(k) + thrust,  x += L (y - C x), with the stationary Kalman gain L.  What the law is fed
obeys the equations of the model with nothing but the jumps L (y - C x) on top; how large these and
the errors become is bounded by sums over impulse responses, for torques that the observer is not
told of, thrust that comes later than it believes, and sensor noise.  The modes are taken to be
those of the machine: on others nothing is bounded, so claims that rest on these bounds read from
the flight whether the estimates keep them.

Stationary Kalman gain: B. D. O. Anderson, J. B. Moore, "Optimal filtering" (1979), chapter 4.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Any, NamedTuple

import numpy as np

from spacecraft_sim.chart import Charts, charts_of
from spacecraft_sim.checks import choices, positive
from spacecraft_sim.controller import Controller
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.thrusters import Thrusters

Array = np.ndarray

ESTIMATED = "estimated_"
_UNKNOWN = 10.0  # disturbance of each single mode over that by the torque, for the gain alone
_WHOLE = 1e-9  # periods: a delay of so little less than whole ones is whole
_SUMMED = 200_000  # samples over which an impulse response is summed at most


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Observer:
    """A sampled observer with n states, m channels and k sensors.

    Attributes:
        sensors: What is measured.
        estimates: What is estimated for the law, under the names of the record, with units.
        period: Sampling period, s.
        step: F, over one period, shape (n, n).
        before: State that a unit of the command before the last one to act adds, shape (n, m).
        after: State that a unit of the last command to act within the period adds, shape (n, m).
        lags: Whole periods by which each channel is late.
        steady: State that constant torques add in a period, shape (n,).
        C: What the sensors read of the state, shape (k, n).
        gain: L, shape (n, k).
        fed: What is made of the state for the law, shape (f, n).
        start: First estimate at unit readings, shape (n, k).
    """

    sensors: tuple[str, ...]
    estimates: dict[str, str]
    period: float
    step: Array
    before: Array
    after: Array
    lags: tuple[int, ...]
    steady: Array
    C: Array
    gain: Array
    fed: Array
    start: Array

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Observer) and all(
            np.array_equal(getattr(self, f.name), getattr(other, f.name)) for f in fields(self)
        )

    def predicted(self, x: Array, commands: Sequence[Sequence[float]]) -> Array:
        """Returns the state one period later.

        Args:
            x: State, shape (n,).
            commands: Commands of all channels, the newest first; before the first there was none.
        """
        x = self.step @ x + self.steady
        for i, lag in enumerate(self.lags):
            for share, k in ((self.after, lag), (self.before, lag + 1)):
                if k < len(commands):
                    x += share[:, i] * commands[k][i]
        return x

    def corrected(self, x: Array, y: Sequence[float]) -> Array:
        """Returns the state corrected by readings.

        Args:
            x: State foretold, shape (n,).
            y: Readings.
        """
        return x + self.gain @ (np.asarray(y) - self.C @ x)


class Memory(NamedTuple):
    """What a law with an observer remembers.

    Attributes:
        law: Memory of the law.
        state: Estimate at the last sample; None before the first.
        commands: The last commands, the newest first.
    """

    law: Any
    state: tuple[float, ...] | None
    commands: tuple[tuple[float, ...], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedLaw:
    """A sampled law that is fed estimates.

    Attributes:
        law: The law, whose sensors the observer stands in for.
        observer: The observer.
    """

    law: Controller
    observer: Observer

    @property
    def sensors(self) -> tuple[str, ...]:
        """What is measured."""
        return self.observer.sensors

    @property
    def estimates(self) -> dict[str, str]:
        """What is estimated, under the names of the record, with units."""
        return self.observer.estimates

    @property
    def period(self) -> float:
        """Sampling period, s."""
        return self.observer.period

    @property
    def thrusters(self) -> tuple[str, ...]:
        """Channels of the law."""
        return self.law.thrusters

    @property
    def charts(self) -> Charts:
        """Charts of the law."""
        return charts_of(self.law)

    def init(self) -> Memory:
        """Returns the memory before the first measurement."""
        return Memory(self.law.init(), None, ())

    def step(self, t: float, y: Sequence[float], memory: Memory) -> tuple[Sequence[float], Memory]:
        """Returns the thrusts and the new memory.

        Args:
            t: Time, s.
            y: Readings of the sensors.
            memory: What the last step returned.
        """
        observer = self.observer
        if memory.state is None:
            x = observer.start @ np.asarray(y)
        else:
            before = observer.predicted(np.array(memory.state), memory.commands)
            x = observer.corrected(before, y)
        u, own = self.law.step(t, (observer.fed @ x).tolist(), memory.law)
        kept = max(observer.lags) + 2
        return u, Memory(own, tuple(x.tolist()), (tuple(u), *memory.commands)[:kept])

    def estimated(self, memory: Memory) -> list[float]:
        """Returns the estimates, in the order of their names.

        Args:
            memory: What the last step returned.
        """
        n = len(self.observer.fed)
        return (
            [math.nan] * n if memory.state is None else (self.observer.fed @ memory.state).tolist()
        )

    def events(self, t: float, y: Sequence[float], memory: Memory) -> tuple[float, ...]:
        """Returns nothing: the law is sampled.

        Args:
            t: Time, s.
            y: Readings.
            memory: Memory.
        """
        return ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Errors:
    """Bounds of an observer, each of one number for each reading that the law is fed.

    Attributes:
        error: Largest error at the samples.
        jumps: Largest correction over the period, per s.
    """

    error: Array
    jumps: Array


@dataclass(frozen=True, slots=True, kw_only=True)
class Unknown:
    """What an observer is not told, and what constant thrust it is told of.

    Attributes:
        thrust: Bound of what acts beside each channel, in units of its thrust, N or N m.
        impulse: Bound of the impulse of each channel that comes later or sooner than believed in
            one period, N s or N m s.
        noise: Bound of the error of each sensor, rad or rad/s.
        steady: Constant thrust beside each channel that is known, N or N m.
    """

    thrust: tuple[float, ...]
    impulse: tuple[float, ...]
    noise: tuple[float, ...]
    steady: tuple[float, ...]


def design_observer(
    model: ReducedModel,
    thrusters: Thrusters | None,
    *,
    channels: tuple[str, ...],
    sensors: tuple[str, ...],
    fed: tuple[str, ...],
    period: float,
    unknown: Unknown,
) -> tuple[Observer, Errors]:
    """Designs an observer, and bounds its errors.

    Args:
        model: The plant; its modes are the observer's.
        thrusters: The thrusters, whose mean delays the observer assumes; without delay if left out.
        channels: Those that the law commands.
        sensors: What is measured.
        fed: Readings of the model that the law is to be fed.
        period: Sampling period, s.
        unknown: What the observer is not told, for its gain and its bounds.

    Raises:
        ValueError: If a name does not exist, a number is not positive, or the sensors do not show
            every motion.
    """
    import scipy.linalg  # slow to import, and seldom needed

    noise = {f"noise of {name}": x for name, x in zip(sensors, unknown.noise, strict=True)}
    positive(zero=False, period=period, **noise)
    C, E = _rows(model, sensors), _rows(model, fed)
    kept = _kept(model, C)
    A, C, E = _state_matrix(model)[np.ix_(kept, kept)], C[:, kept], E[:, kept]
    n = len(A)
    drives = [_drive(model, name)[kept] for name in channels]

    def held(b: Array, span: float) -> Array:
        """The state after a unit input over a span."""
        augmented = np.zeros((n + 1, n + 1))
        augmented[:n, :n], augmented[:n, n] = A, b
        return scipy.linalg.expm(augmented * span)[:n, n]

    delays = [thrusters[name].delay.mean if thrusters else 0.0 for name in channels]
    lags = tuple(int(delay / period + _WHOLE) for delay in delays)
    rests = [max(delay - lag * period, 0.0) for delay, lag in zip(delays, lags, strict=True)]
    whole = np.stack([held(b, period) for b in drives], axis=1)
    after = np.stack([held(b, period - r) for b, r in zip(drives, rests, strict=True)], axis=1)
    F = scipy.linalg.expm(A * period)
    impulses = np.array(unknown.thrust) * period + np.array(unknown.impulse)
    pushes = [x * b for x, b in zip(impulses, drives, strict=True)]
    observer = Observer(
        sensors=sensors,
        estimates={f"{ESTIMATED}{name}": model.outputs[name] for name in fed},
        period=period,
        step=F,
        before=whole - after,
        after=after,
        lags=lags,
        steady=whole @ np.array(unknown.steady),
        C=C,
        gain=_kalman(F, C, pushes, np.array(unknown.noise)),
        fed=E,
        start=_start(model, kept, C),
    )
    # Elementwise bound of what an impulse anywhere within a period has done at its end.
    spans = [scipy.linalg.expm(A * t) for t in np.linspace(0, period, 9)]
    reach = sum((np.max([np.abs(e @ b) for e in spans], axis=0) for b in pushes), np.zeros(n))
    return observer, _errors(observer, reach, np.array(unknown.noise))


def _rows(model: ReducedModel, names: Sequence[str]) -> Array:
    """What readings are made of the state."""
    order = list(model.outputs)
    for name in names:
        if name not in order:
            raise ValueError(choices("sensor", name, order, where="the reduced model"))
    return model.C[[order.index(name) for name in names]]


def _kept(model: ReducedModel, C: Array) -> Array:
    """States of the modes, and of the rigid coordinates that the sensors read."""
    n, rigid = len(model.B), len(model.B) - len(model.frequencies)
    seen = np.any(C[:, :n], axis=0) | np.any(C[:, n:], axis=0)
    seen[rigid:] = True
    return np.flatnonzero(np.r_[seen, seen])


def _drive(model: ReducedModel, channel: str) -> Array:
    """Rate of the state at a unit of an input."""
    if channel not in model.inputs:
        raise ValueError(choices("input", channel, model.inputs, where="the reduced model"))
    column = model.B[:, model.inputs.index(channel)]
    return np.r_[np.zeros(len(column)), column]


def _state_matrix(model: ReducedModel) -> Array:
    """A of x' = A x + B u over x = (r, eta, r', eta')."""
    n, k = len(model.B), len(model.frequencies)
    A = np.zeros((2 * n, 2 * n))
    A[:n, n:] = np.eye(n)
    A[2 * n - k :, n - k : n] = -np.diag(model.frequencies**2)
    A[2 * n - k :, 2 * n - k :] = -model.D
    return A


def _start(model: ReducedModel, kept: Array, C: Array) -> Array:
    """The rigid motion that readings show when the elastic parts are straight."""
    n, rigid = len(model.B), len(model.B) - len(model.frequencies)
    stiff = (kept % n) < rigid
    start = np.zeros((len(kept), len(C)))
    start[stiff] = np.linalg.pinv(C[:, stiff])
    return start


def _kalman(F: Array, C: Array, disturbances: list[Array], noise: Array) -> Array:
    """The stationary gain; each mode is also disturbed on its own: its start must be found out."""
    import scipy.linalg

    n, unit = len(F), noise[0] ** 2  # all in terms of the first sensor's noise: figures near 1
    Q = np.zeros((n, n))
    for b in disturbances:
        Q += np.outer(b, b) + _UNKNOWN**2 * np.diag(b**2) + 1e-12 * float(b @ b) * np.eye(n)
    R = np.diag(noise**2)
    try:
        P = scipy.linalg.solve_discrete_are(F.T, C.T, Q / unit, R / unit)
    except ValueError as error:  # LinAlgError is one
        raise ValueError(
            f"no gain can be computed for an observer of {n} states and sensor noise of "
            f"{', '.join(f'{x:g}' for x in noise)}: let it have fewer modes (reduced.modes), or "
            f"more noise: {error}"
        ) from error
    L = P @ C.T @ np.linalg.inv(C @ P @ C.T + R / unit)
    if np.max(np.abs(np.linalg.eigvals((np.eye(n) - L @ C) @ F))) >= 1:
        raise ValueError("the sensors cannot see every mode: the observer does not converge")
    return L


def _errors(observer: Observer, reach: Array, noise: Array) -> Errors:
    """Bounds that hold with the gain, once the start is forgotten."""
    F, L, C, fed = observer.step, observer.gain, observer.C, observer.fed
    settle = np.eye(len(F)) - L @ C
    driven = np.hstack([settle @ np.diag(reach), L * noise])
    rows = np.vstack([fed, C @ F])
    total, term, S = np.zeros(len(rows)), driven, settle @ F
    for _ in range(_SUMMED):  # the impulse response, summed in magnitude
        part = np.abs(rows @ term).sum(axis=1)
        total += part
        term = S @ term
        if np.all(part < 1e-12 * total):
            break
    innovation = total[len(fed) :] + np.abs(C) @ reach + noise
    return Errors(error=total[: len(fed)], jumps=np.abs(fed @ L) @ innovation / observer.period)
