"""Relay stabilisation of a spacecraft with viscoelastic booms under an uncertain delay.

M. S. Efremov, A. E. Polyakov, V. V. Strygin, "An algorithm of active stabilization of a spacecraft
with viscoelastic elements under conditions of uncertainty", J. Appl. Math. Mech. 70 (2006) 723-733.

Plant.  The quasi-rigid angle beta = J gamma + 2 sum p_i q_i of bus and booms obeys
beta'' = u(t - h(t)) + f whatever the booms do (1.6).  Here beta, v = beta', u and f are divided by
J: rad, rad/s, rad/s^2.  Of the delay only 0 < h(t) < h0 is known.

Law.  Two pulses of one level bring (beta, v) near the origin (section 2); then the multi-level
relay of Theorem 2, u = -A sign s with s = c beta + v and A = p 3^k, k the number of thresholds
v_n <= |s|.

Guaranteed, if |f| < v1 c/2 and the region |beta|, |v| < R is entered: |beta| < eps from some time
on.  The printed claim |v| < eps is false in general; what the repaired proof gives is
S = (p + v1 c/2) (E - 1)/(c (2 - E)), E = exp(c h0), and in the end |s| <= S, |beta| <= S/c,
|v| <= 2 S.  Nothing is promised about the attitude gamma: it swings on while beta is still.
"""

import math
from bisect import bisect_left, bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Assumption, Guarantee, Measurement
from spacecraft_sim.reduced import ReducedModel, double_integrator
from spacecraft_sim.thrusters import Thrusters, nearest_level
from spacecraft_sim.trajectory import Trajectory, peak

PAPER = "Efremov et al. 2006"
FINAL = 60.0  # the end of a flight over which final figures are taken, s
ANGLE, RATE = "quasi_rigid_angle_z", "quasi_rigid_rate_z"


class Attraction(NamedTuple):
    """The two pulses of section 2: `sign` U until T1, -`sign` U until T2, both from now, s."""

    sign: float
    T1: float
    T2: float


class LimitCycle(NamedTuple):
    """The symmetric limit cycle of beta'' = -p sign s(t - h): s, rad/s and rad."""

    period: float
    v_max: float
    beta_max: float


def attracting(beta: float, v: float, acceleration: float) -> Attraction:
    """Returns the time-optimal pair of pulses that brings beta'' = +-U to the origin.

    Args:
        beta: Quasi-rigid angle, rad.
        v: Its rate, rad/s.
        acceleration: U, rad/s^2.

    Returns:
        Sign of the first pulse and the ends of both, s.

    Raises:
        ValueError: If U is not positive.
    """
    positive(acceleration=acceleration)
    b, w = beta / acceleration, v / acceleration
    # (2.2) with erratum 1: on G+ the first pulse is -1.  Erratum 2: Gamma+ belongs to G+.
    plus = (w * w + 2 * b >= 0 and w >= 0) or (w * w - 2 * b < 0 and b > 0)
    side = 1.0 if plus else -1.0
    root = math.sqrt(max(w * w + 2 * side * b, 0.0) / 2)  # sqrt(G/2)
    return Attraction(-side, side * w + root, side * w + 2 * root)


def limit_cycle(*, c: float, delay: float, level: float) -> LimitCycle:
    """Returns the limit cycle of the undisturbed relay with a constant delay, in closed form.

    Args:
        c: Slope of the switching line s = c beta + v, 1/s.
        delay: h, s.
        level: p, rad/s^2.

    Raises:
        ValueError: If an argument is not positive, or c h >= 1: there is no such cycle.
    """
    positive(c=c, delay=delay, level=level)
    x = c * delay
    if x >= 1:
        raise ValueError(f"c h = {x} must be below 1 for a limit cycle")
    v = level * delay * (1 - x / 2) / (1 - x)
    return LimitCycle(2 * delay * (2 - x) / (1 - x), v, v * v / (2 * level))


class Memory(NamedTuple):
    """What the law remembers.

    Attributes:
        sign: Sign of the first pulse.
        ends: Ends of both pulses, s.
        until: End of the pulse that is on, s; inf under feedback.
        low: Lower end of the cell that s is in under feedback, rad/s.
        high: Upper end of the cell, rad/s.
    """

    sign: float
    ends: tuple[float, float]
    until: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NonlocalRelay:
    """Attraction by two pulses, then the multi-level relay of Theorem 2.

    Attributes:
        c: Slope of the switching line, 1/s.
        thresholds: v_1 .. v_N, rad/s.
        levels: Thrust of each band of |s|, N + 1 of them, N or N m.
        attraction: Acceleration U of the pulses, rad/s^2; 0 for no attraction.
        attraction_level: The thrust that gives it, N or N m.
        period: Sampling period, s; None for continuous time.
        sensors: beta/J and v/J.
        thrusters: The one channel.
    """

    c: float
    thresholds: tuple[float, ...]
    levels: tuple[float, ...]
    attraction: float
    attraction_level: float
    period: float | None
    sensors: tuple[str, ...] = (ANGLE, RATE)
    thrusters: tuple[str, ...] = ("thruster_z",)

    def init(self) -> None:
        """Returns no memory: the pulses follow from the first measurement."""
        return

    def step(
        self, t: float, y: Sequence[float], memory: Memory | None
    ) -> tuple[tuple[float], Memory]:
        """Returns the thrust and the new memory.

        Args:
            t: Time, s.
            y: beta/J and v/J, rad and rad/s.
            memory: What the last step returned.
        """
        if memory is None:
            memory = self._first(t, y)
        for sign, end in zip((memory.sign, -memory.sign), memory.ends, strict=True):
            if t < end:
                return (sign * self.attraction_level,), memory._replace(until=end)
        s, n = self.c * y[0] + y[1], len(self.thresholds)
        bounds = (-math.inf, *(-v for v in reversed(self.thresholds)), 0.0, *self.thresholds)
        # On a bound itself s belongs to the cell that it has come into.
        i = bisect_left(bounds, s) if s <= memory.low else bisect_right(bounds, s)
        # Cells 1 .. n+1 lie below zero, n+2 .. 2n+2 above; A grows outwards.
        level = self.levels[n + 1 - i] if i <= n + 1 else -self.levels[i - n - 2]
        low, high = (*bounds, math.inf)[i - 1 : i + 1]
        return (level,), memory._replace(until=math.inf, low=low, high=high)

    def events(self, t: float, y: Sequence[float], memory: Memory) -> tuple[float, ...]:
        """Returns the time left to the end of a pulse, or the distances of s to its cell's ends.

        Args:
            t: Time, s.
            y: beta/J and v/J, rad and rad/s.
            memory: What the last step returned.
        """
        if memory.until < math.inf:
            return (memory.until - t,)
        s = self.c * y[0] + y[1]
        return s - memory.low, memory.high - s

    def _first(self, t: float, y: Sequence[float]) -> Memory:
        """The pulses that the first measurement asks for."""
        sign, T1, T2 = (0.0, 0.0, 0.0)
        if self.attraction:
            sign, T1, T2 = attracting(y[0], y[1], self.attraction)
        return Memory(sign, (t + T1, t + T2), math.inf, -math.inf, math.inf)


def design_nonlocal(
    model: ReducedModel | None = None,
    thrusters: Thrusters | None = None,
    *,
    max_delay: float,
    accuracy: float,
    radius: float,
    c: float,
    gain: float,
    level: float | None = None,
    threshold: float | None = None,
    attraction_level: float = 0.0,
    period: float | None = None,
) -> tuple[NonlocalRelay, tuple[Guarantee, ...]]:
    """Designs the law of Theorem 2, steps 1 to 5, with what is guaranteed for it.

    Args:
        model: The plant, for its inertia; the double integrator in rad/s^2 if left out.
        thrusters: The thrusters; unlimited if left out.
        max_delay: h0, the delay that is never exceeded, s.
        accuracy: eps, the |beta/J| to be kept, rad.
        radius: R, the |beta/J| and |v/J| from which it starts, rad and rad/s.
        c: Slope of the switching line s = c beta + v, 1/s.
        gain: The parameter gamma of the theorem.
        level: p if not (15/4) c^2 eps gamma, rad/s^2.
        threshold: v_1 if not (3/4) c eps gamma, rad/s.
        attraction_level: Thrust of the two attracting pulses, N or N m; 0 for none.
        period: Sampling period, s; in continuous time if left out.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If a hypothesis of the theorem fails, naming it, its value and its limit; or a
            level that the law needs is not one of the thruster's.
    """
    positive(max_delay=max_delay, accuracy=accuracy, radius=radius, c=c, gain=gain)
    model = model or double_integrator()
    epsilon_0 = 3 * c * accuracy / 4  # step 2
    p = (15 / 4) * c**2 * accuracy * gain if level is None else level
    v1 = gain * epsilon_0 if threshold is None else threshold
    positive(level=p, threshold=v1)
    E = math.exp(c * max_delay)
    parameters = [
        Assumption(text="eps < R", value=accuracy, limit=radius),
        Assumption(text="c h0 < ln(15/14)", value=c * max_delay, limit=math.log(15 / 14)),
    ]
    if E < 10 / 9:
        for text, value in (
            ("gamma", gain),
            ("p/((15/4) c^2 eps)", p / (3.75 * c**2 * accuracy)),
            ("v1/((3/4) c eps)", v1 / epsilon_0),
        ):
            lower = E / (10 - 9 * E)
            parameters += [
                Assumption(text=f"{text} > E/(10 - 9E)", value=value, limit=lower, relation=">"),
                Assumption(text=f"{text} < 3", value=value, limit=3.0),
            ]
    broken = [str(a) for a in parameters if not a.holds]
    if broken:
        raise ValueError("outside the hypotheses of Theorem 2: " + "; ".join(broken))
    R0 = (c + 1) * radius
    N = max(0, math.ceil(math.log(R0 / epsilon_0, 3)))  # step 3
    unit = model.gain("thruster_z", RATE)  # rad/s^2 at unit thrust
    law = NonlocalRelay(
        c=c,
        thresholds=tuple(3.0**n * v1 for n in range(N)),  # step 4
        levels=tuple(p * 3.0**k / unit for k in range(N + 1)),  # step 5
        attraction=attraction_level * unit,
        attraction_level=attraction_level,
        period=period,
    )
    hardware = _hardware(law, thrusters, max_delay)
    claims = _Claims(law, model, thrusters, max_delay, accuracy, radius, p, v1)
    return law, claims.all((*parameters, *hardware))


def _hardware(
    law: NonlocalRelay, thrusters: Thrusters | None, max_delay: float
) -> tuple[Assumption, ...]:
    """What the theorem takes for granted of thrusters and sampling."""
    if thrusters is None:
        return ()
    (channel,) = law.thrusters
    spec = thrusters[channel]
    wanted = [level for level in (*law.levels, law.attraction_level) if level]
    missing = [x for x in wanted if not math.isclose(nearest_level(x, spec), x, rel_tol=1e-6)]
    if missing:
        raise ValueError(
            f"thruster {channel!r} has the levels {list(spec.levels)} and lacks "
            f"{', '.join(f'{x:.9g}' for x in missing)}; the law needs thrusters.{channel}.levels = "
            f"[{', '.join(f'{x:.9g}' for x in sorted(wanted))}]"
        )
    age = spec.delay.longest + (law.period or 0.0)
    lag = max(spec.rise_time, spec.fall_time, spec.min_on_time)
    return (
        Assumption(text="delay and sampling period < h0", value=age, limit=max_delay, unit="s"),
        Assumption(
            text="thrust follows the valve at once", value=lag, limit=0.0, relation="<=", unit="s"
        ),
    )


@dataclass(frozen=True, slots=True)
class _Claims:
    """The guarantees of one design; theorems speak of beta/J, so does everything here."""

    law: NonlocalRelay
    model: ReducedModel
    thrusters: Thrusters | None
    max_delay: float
    accuracy: float
    radius: float
    p: float
    v1: float

    def all(self, assumptions: tuple[Assumption, ...]) -> tuple[Guarantee, ...]:
        c, E = self.law.c, math.exp(self.law.c * self.max_delay)
        S = (self.p + self.v1 * c / 2) / c * (E - 1) / (2 - E)
        claims = [
            Guarantee(
                claim="|beta/J| < eps after attraction and delay",
                source=f"{PAPER}, Theorem 2",
                unit="rad",
                bound=self.accuracy,
                measure=self._angle_after_attraction,
                assumptions=assumptions,
            ),
            Guarantee(
                claim="|beta/J| <= S/c in the end",
                source=f"{PAPER}, Theorem 2, proof repaired",
                unit="rad",
                bound=S / c,
                measure=self._final(ANGLE, RATE),
                assumptions=assumptions,
            ),
            Guarantee(
                claim="|v/J| <= 2 S in the end",
                source=f"{PAPER}, Theorem 2, proof repaired",
                unit="rad/s",
                bound=2 * S,
                measure=self._final(RATE, None),
                assumptions=assumptions,
            ),
        ]
        if self.law.attraction:
            claims.insert(
                0,
                Guarantee(
                    claim="attraction ends inside |beta/J| < R",
                    source=f"{PAPER}, (2.2)",
                    unit="rad",
                    bound=self.radius,
                    measure=self._miss,
                ),
            )
        claims += self._limit_cycle(assumptions)
        claims.append(
            Guarantee(
                claim="attitude itself: |gamma| < eps in the end",
                source="not promised by the theorem",
                unit="rad",
                bound=self.accuracy,
                measure=self._final("attitude_z", "rate_z"),
            )
        )
        return tuple(claims)

    def _limit_cycle(self, assumptions: tuple[Assumption, ...]) -> list[Guarantee]:
        """Closed forms, where they apply: ideal relay, constant delay, continuous time."""
        if self.thrusters is None or self.law.period is not None:
            return []
        delay = self.thrusters[self.law.thrusters[0]].delay
        if delay.amplitude or not all(a.holds for a in assumptions):
            return []
        cycle = limit_cycle(c=self.law.c, delay=delay.mean, level=self.p)
        figures = (
            ("period", "s", cycle.period, self._period, 0.0),
            ("|v/J|", "rad/s", cycle.v_max, self._final(RATE, None), 0.0),
            # A steady f moves the centre of the cycle by f h (1 - c h/2)/c.
            ("|beta/J|", "rad", cycle.beta_max, self._final(ANGLE, RATE), delay.mean / self.law.c),
        )

        def within(measure, predicted: float, shift: float):
            def measured(trajectory: Trajectory) -> Measurement:
                f, m = self._disturbance(trajectory), measure(trajectory)
                return Measurement(m.value, m.t_worst, bound=2 * f / self.p * predicted + shift * f)

            return measured

        return [
            Guarantee(
                claim=f"limit cycle: {name}",
                source=f"{PAPER}, undisturbed limit cycle in closed form, +-2 f/p",
                unit=unit,
                kind="within",
                predicted=value,
                measure=within(measure, value, shift),
            )
            for name, unit, value, measure, shift in figures
        ]

    def _disturbance(self, trajectory: Trajectory) -> float:
        """The largest |f/J| of a flight, rad/s^2."""
        signal = trajectory.signals.get("disturbance_z", np.zeros(1))
        scale = self.model.gain("disturbance_z", RATE) if np.any(signal) else 0.0
        return float(np.max(np.abs(signal))) * scale

    def _start(self, trajectory: Trajectory) -> tuple[float, float]:
        """T2 + h0 of a flight, s, and the miss h v0 predicted for it, rad."""
        beta, v = trajectory[ANGLE][0], trajectory[RATE][0]
        if not self.law.attraction:
            return trajectory.time[0] + self.max_delay, beta
        end = trajectory.time[0] + attracting(beta, v, self.law.attraction).T2
        delay = self.thrusters[self.law.thrusters[0]].delay.mean if self.thrusters else 0.0
        return end + self.max_delay, delay * v

    def _miss(self, trajectory: Trajectory) -> Measurement:
        start, predicted = self._start(trajectory)
        beta = float(np.interp(start, trajectory.time, trajectory[ANGLE]))
        if start > trajectory.time[-1]:
            return Measurement(math.nan)
        return Measurement(beta, start, predicted=predicted)

    def _angle_after_attraction(self, trajectory: Trajectory) -> Measurement:
        start, miss = self._start(trajectory)
        late = trajectory.time >= start
        if not late.any():
            return Measurement(math.nan)
        value, when = peak(trajectory.time[late], trajectory[ANGLE][late], trajectory[RATE][late])
        entry = max(abs(trajectory[ANGLE][late][0]), abs(trajectory[RATE][late][0]))
        return Measurement(
            value,
            when,
            predicted=abs(miss),
            assumptions=(
                Assumption(
                    text="|f/J| < v1 c/2",
                    value=self._disturbance(trajectory),
                    limit=self.v1 * self.law.c / 2,
                    unit="rad/s^2",
                ),
                Assumption(text="|beta/J|, |v/J| < R on entry", value=entry, limit=self.radius),
            ),
        )

    def _final(self, signal: str, rate: str | None):
        """Largest |signal| over the last minute; between the rows too where its rate is known."""

        def measure(trajectory: Trajectory) -> Measurement:
            start, _ = self._start(trajectory)
            late = trajectory.time >= max(trajectory.time[-1] - FINAL, start)
            if not late.any():
                return Measurement(math.nan)
            time, x = trajectory.time[late], trajectory[signal][late]
            if rate is None:
                worst = int(np.argmax(np.abs(x)))
                return Measurement(float(abs(x[worst])), float(time[worst]))
            return Measurement(*peak(time, x, trajectory[rate][late]))

        return measure

    def _period(self, trajectory: Trajectory) -> Measurement:
        """Mean time between switchings of the thrust to plus, over the last minute."""
        late = trajectory.time >= trajectory.time[-1] - FINAL
        thrust, time = np.sign(trajectory[self.law.thrusters[0]][late]), trajectory.time[late]
        rising = time[1:][(thrust[1:] > 0) & (thrust[:-1] <= 0)]
        return Measurement(float(np.mean(np.diff(rising))) if len(rising) > 1 else math.nan)
