"""The relay of Theorem 2 fed by an observer: beta and v from the bus angle, with or without rate.

Bus sensors see gamma, not beta: the booms are in between.  A sampled observer carries a model with
a few elastic modes, drives it with the thrust that its own commands must have brought about by now
(they are under way for the assumed delay), and corrects it by the innovations:
x(k+1) = F x(k) + thrust,  x += L (y - C x).

What the law is fed, (beta^, v^), obeys v^' = u + d2, beta^' = v^ + d1 with nothing but the jumps L
innovation / T in d1, d2; so Theorem 2 holds for it with |f| replaced by d2 + 2 c d1, and |beta| <=
|beta^| + e with the observer's error e.  Bounds of e, d1 and d2 are sums over the impulse response
of the error: what disturbs it is f, the thrust error of a delay known to within some time, and
sensor noise.  The modes are taken to be those of the machine: on others the
estimate is not bounded, and nothing here says so.  (Own extension of Efremov et al. 2006.)
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from controllers.efremov import design_nonlocal, settling_time
from controllers.efremov_claims import PAPER, Claims, Theorem
from controllers.efremov_relay import RATE, MultilevelRelay
from spacecraft_sim.chart import Charts
from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Assumption, Guarantee
from spacecraft_sim.modal_form import driven_coordinate, modal_form, real_form, row_of
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.relay_system import RelaySystem, Row, State, moved
from spacecraft_sim.thrusters import Thrusters

Array = np.ndarray
CHANNEL = "thruster_z"
SENSORS = {"angle": ("attitude_z",), "angle and rate": ("attitude_z", "rate_z")}
_UNKNOWN = 10.0  # disturbance of each single mode over that by the torque, for the gain alone
_SUMMED = 200_000  # samples over which an impulse response is summed at most


class Memory(NamedTuple):
    """State of observer and relay.

    Attributes:
        relay: Memory of the relay.
        estimate: Model state at the last sample.
        time: Time of the last sample, s.
        acting: Acceleration believed to act, rad/s^2.
        pending: Commands under way: (time of effect, acceleration).
    """

    relay: Any
    estimate: State | None
    time: float
    acting: float
    pending: tuple[tuple[float, float], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class ObservedRelay:
    """A relay that steps on estimates of beta and v.

    Attributes:
        relay: The relay.
        model: Modes of the observer's model.
        rows: What each sensor reads of the model's state.
        gain: L, shape (2 + 2 n modes, n sensors).
        delay: Delay assumed for the thrust, s.
        unit: Acceleration at unit thrust, rad/s^2.
        period: Sampling period, s.
        sensors: Sensor names.
        thrusters: The one channel.
    """

    relay: MultilevelRelay
    model: RelaySystem
    rows: tuple[Row, ...]
    gain: tuple[tuple[float, ...], ...]
    delay: float
    unit: float
    period: float
    sensors: tuple[str, ...]
    thrusters: tuple[str, ...] = (CHANNEL,)

    @property
    def charts(self) -> Charts:
        """Those of the relay, which sees estimates of what is drawn."""
        return self.relay.charts

    def init(self) -> Memory:
        """Returns the memory before the first measurement."""
        return Memory(self.relay.init(), None, 0.0, 0.0, ())

    def step(self, t: float, y: Sequence[float], memory: Memory) -> tuple[Sequence[float], Memory]:
        """Returns the thrust and the new memory.

        Args:
            t: Time, s.
            y: Bus angle, rad, and rate, rad/s, if it is a sensor.
            memory: What the last step returned.
        """
        x, acting, pending = self._predicted(t, memory)
        if x is None:  # booms straight, rate unknown unless it is measured
            rate = y[1] if len(y) > 1 else 0.0
            x = State(y[0], rate, (0j,) * len(self.model.eigenvalues))
        else:
            x = self._corrected(x, y)
        u, relay = self.relay.step(t, (x.angle, x.rate), memory.relay)
        command = u[0] * self.unit
        if command != (pending[-1][1] if pending else acting):
            pending = (*pending, (t + self.delay, command))
        return u, Memory(relay, x, t, acting, pending)

    def events(self, t: float, y: Sequence[float], memory: Memory) -> tuple[float, ...]:
        """Returns nothing: the law is sampled.

        Args:
            t: Time, s.
            y: Readings.
            memory: Memory.
        """
        return ()

    def _predicted(
        self, t: float, memory: Memory
    ) -> tuple[State | None, float, tuple[tuple[float, float], ...]]:
        """The model carried to t under the thrust that must have acted since the last sample."""
        x, now, acting, pending = memory.estimate, memory.time, memory.acting, memory.pending
        while pending and pending[0][0] <= t:
            effect, level = pending[0]
            x = x and moved(self.model, x, acting, effect - now)
            now, acting, pending = effect, level, pending[1:]
        return x and moved(self.model, x, acting, t - now), acting, pending

    def _corrected(self, x: State, y: Sequence[float]) -> State:
        innovations = [value - _read(row, x) for value, row in zip(y, self.rows, strict=True)]
        jump = [sum(g * i for g, i in zip(row, innovations, strict=True)) for row in self.gain]
        modes = [z + complex(jump[2 + 2 * k], jump[3 + 2 * k]) for k, z in enumerate(x.modes)]
        return State(x.angle + jump[0], x.rate + jump[1], tuple(modes))


def _read(row: Row, x: State) -> float:
    modal = sum((d * z).real for d, z in zip(row.modes, x.modes, strict=True))
    return row.angle * x.angle + row.rate * x.rate + 2 * modal


class Errors(NamedTuple):
    """Bounds of the observer: errors of beta, rad, and v, rad/s; jumps per time d1 and d2."""

    angle: float
    rate: float
    d1: float
    d2: float


def design_observed(
    model: ReducedModel,
    thrusters: Thrusters,
    *,
    max_delay: float,
    accuracy: float,
    radius: float,
    c: float,
    gain: float,
    period: float,
    disturbance: float,
    sensors: Literal["angle", "angle and rate"] = "angle and rate",
    delay_error: float = 0.0,
    angle_noise: float = 2e-5,
    rate_noise: float = 2e-5,
    level: float | None = None,
    threshold: float | None = None,
) -> tuple[ObservedRelay, tuple[Guarantee, ...]]:
    """Designs the relay of Theorem 2 with an observer, and bounds what the observer costs.

    Args:
        model: The plant; its modes are the observer's.
        thrusters: The thrusters; the observer assumes their mean delay.
        max_delay: h0, which delay and sampling period together never exceed, s.
        accuracy: eps, the |beta/J| to be kept, rad.
        radius: R, the |beta/J| and |v/J| from which it starts, rad and rad/s.
        c: Slope of the switching line, 1/s.
        gain: The parameter gamma of the theorem.
        period: Sampling period T, s.
        disturbance: Bound of |f/J|, rad/s^2.
        sensors: What is measured of the bus: `angle`, or `angle and rate`.
        delay_error: How far the real delay may be from the assumed one, s.
        angle_noise: Bound of the error of the angle sensor, rad.
        rate_noise: Bound of the error of the rate sensor, rad/s.
        level: p if not (15/4) c^2 eps gamma, rad/s^2.
        threshold: v_1 if not (3/4) c eps gamma, rad/s.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: As `design_nonlocal`; or if a bound that the observer needs is not positive, or
            the modes cannot be seen by the sensors.
    """
    positive(period=period, disturbance=disturbance, angle_noise=angle_noise, rate_noise=rate_noise)
    positive(delay_error=delay_error, zero=True)
    relay, promises = design_nonlocal(
        model, thrusters, max_delay=max_delay, accuracy=accuracy, radius=radius, c=c, gain=gain,
        level=level, threshold=threshold, period=period,
    )  # fmt: skip
    eigenvalues, drive, shapes = modal_form(model, CHANNEL)
    names = SENSORS[sensors]
    coordinate = driven_coordinate(model, CHANNEL)
    rows = tuple(row_of(model, name, shapes, coordinate) for name in names)
    system = RelaySystem(
        switching=Row(angle=c, rate=1.0),
        levels=(relay.lowest,),
        eigenvalues=eigenvalues,
        drive=drive,
    )
    noise = np.array([angle_noise, rate_noise][: len(names)])
    L, errors = _observer(system, rows, period, disturbance, 2 * relay.lowest * delay_error, noise)
    law = ObservedRelay(
        relay=relay,
        model=system,
        rows=rows,
        gain=tuple(map(tuple, L.tolist())),
        delay=thrusters[CHANNEL].delay.mean,
        unit=model.gain(CHANNEL, RATE),
        period=period,
        sensors=names,
    )
    inherited = promises[0].assumptions  # of the theorem, of thrusters and sampling, of units
    bounds = max_delay, accuracy, radius, disturbance, delay_error
    return law, _claims(relay, model, thrusters, errors, inherited, *bounds)


def _observer(
    system: RelaySystem,
    rows: Sequence[Row],
    T: float,
    disturbance: float,
    late_impulse: float,
    noise: Array,
) -> tuple[Array, Errors]:
    """The stationary Kalman gain, and the bounds that hold with it."""
    import scipy.linalg  # slow to import, and seldom needed

    A, b, C = real_form(system, rows)
    n = len(b)
    F = scipy.linalg.expm(A * T)
    # Elementwise bound of the response to an impulse anywhere in a sample interval.
    reach = np.max([np.abs(scipy.linalg.expm(A * t) @ b) for t in np.linspace(0, T, 9)], axis=0)
    impulse = disturbance * T + late_impulse
    # Each mode is also disturbed on its own: what the booms did at first must be found out too.
    Q = impulse**2 * (np.outer(b, b) + _UNKNOWN**2 * np.diag(b**2) + 1e-12 * np.eye(n))
    P = scipy.linalg.solve_discrete_are(F.T, C.T, Q, np.diag(noise**2))
    L = P @ C.T @ np.linalg.inv(C @ P @ C.T + np.diag(noise**2))
    step = (np.eye(n) - L @ C) @ F
    if np.max(np.abs(np.linalg.eigvals(step))) >= 1:
        raise ValueError("the sensors cannot see every mode: the observer does not converge")
    driven = np.hstack([(np.eye(n) - L @ C) @ np.diag(reach), L * noise])
    total, term = np.zeros((n, driven.shape[1])), driven
    for _ in range(_SUMMED):  # the error's impulse response, summed in magnitude
        total += np.abs(term)
        term = step @ term
        if np.max(np.abs(term)) < 1e-12 * np.max(total):
            break
    scale = np.r_[np.full(n, impulse), np.ones(len(noise))]
    error = total @ scale
    innovation = np.abs(C @ F) @ error + np.abs(C) @ reach * impulse + noise
    jump = np.abs(L) @ innovation / T
    return L, Errors(float(error[0]), float(error[1]), float(jump[0]), float(jump[1]))


def _claims(
    relay: MultilevelRelay,
    model: ReducedModel,
    thrusters: Thrusters,
    errors: Errors,
    inherited: tuple[Assumption, ...],
    max_delay: float,
    accuracy: float,
    radius: float,
    disturbance: float,
    delay_error: float,
) -> tuple[Guarantee, ...]:
    c, E, v1 = relay.c, math.exp(relay.c * max_delay), relay.thresholds[0]
    f = errors.d2 + 2 * c * errors.d1
    S = (relay.lowest + f) / c * (E - 1) / (2 - E)
    final_angle = (S + errors.d1) / c + errors.angle
    parameters = (
        *inherited,
        Assumption(
            text="d2 + 2 c d1 < v1 c/2: what the observer costs", value=f, limit=v1 * c / 2,
            unit="rad/s^2",
        ),
        Assumption(
            text="(S + d1)/c + error < eps", value=final_angle, limit=accuracy, unit="rad"
        ),
    )  # fmt: skip

    def entry(beta: float, v: float) -> tuple[Assumption, ...]:
        return (
            Assumption(text="|beta| + error < R", value=abs(beta) + errors.angle, limit=radius),
            Assumption(text="|v| + error < R", value=abs(v) + errors.rate, limit=radius),
        )

    theorem = Theorem(
        source=f"{PAPER}, Theorem 2, with observer",
        parameters=parameters,
        max_delay=max_delay,
        accuracy=accuracy,
        settling=partial(settling_time, c=c, accuracy=accuracy),
        final_angle=final_angle,
        final_rate=2 * S + errors.d1 + errors.rate,
        disturbance=disturbance,
        entry=entry,
        assumed_delay=(thrusters[CHANNEL].delay.mean, delay_error),
    )
    return Claims(theorem=theorem, law=relay, model=model, thrusters=thrusters).all()
