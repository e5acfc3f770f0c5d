"""What Efremov, Polyakov & Strygin (2006) guarantee, as claims that a flight can be held to.

beta, v and f stand for beta/J, v/J and f/J: rad, rad/s, rad/s^2.  A pass on beta is no pass on the
attitude gamma, which swings on with the booms; it has a claim of its own, which no theorem backs.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from controllers.efremov_relay import ANGLE, RATE, MultilevelRelay, attracting, limit_cycle
from controllers.observer import ESTIMATED
from spacecraft_sim.guarantee import Assumption, Guarantee, Measurement
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.thrusters import Thrusters
from spacecraft_sim.trajectory import Trajectory, peak, sample_rows

PAPER = "Efremov et al. 2006"
FINAL = 60.0  # the end of a flight over which final figures are taken, s
_LEFT_OVER = 1e-3  # share of a limit cycle that its transient, and beta linear in angles, may leave

Measure = Callable[[Trajectory], Measurement]


@dataclass(frozen=True, slots=True, kw_only=True)
class Theorem:
    """One theorem with its numbers.

    Attributes:
        source: Where it stands.
        parameters: Hypotheses that the design decides.
        max_delay: h0, s.
        accuracy: eps, rad.
        settling: Takes (beta, v) at the start of feedback to the time, s, until |beta| < eps.
        final_angle: Bound of |beta| in the end, rad.
        final_rate: Bound of |v| in the end, rad/s.
        disturbance: |f| must stay below this, rad/s^2.
        entry: Hypotheses on (beta, v) at the start of feedback.
        assumed_delay: Delay that the law counts on and how far off it may be, s, if it does.
        estimated: Largest error of each reading that the law takes from an observer, by name.
        time_source: Words on where the settling time comes from, if not from the theorem.
    """

    source: str
    parameters: tuple[Assumption, ...]
    max_delay: float
    accuracy: float
    settling: Callable[[float, float], float]
    final_angle: float
    final_rate: float
    disturbance: float
    entry: Callable[[float, float], tuple[Assumption, ...]]
    assumed_delay: tuple[float, float] | None = None
    estimated: Mapping[str, float] = field(default_factory=dict)
    time_source: str = "; time from experiment"


@dataclass(frozen=True, slots=True, kw_only=True)
class Claims:
    """The guarantees of one design.

    Attributes:
        theorem: What is promised.
        law: The law.
        model: The plant, for the scale of the disturbance.
        thrusters: The thrusters; ideal if None.
    """

    theorem: Theorem
    law: MultilevelRelay
    model: ReducedModel
    thrusters: Thrusters | None

    def all(self) -> tuple[Guarantee, ...]:
        """Returns every claim."""
        theorem, source = self.theorem, self.theorem.source
        claims = [
            self._claim("|beta/J| < eps from the predicted time on",
                        f"{source}{self.theorem.time_source}", "rad",
                        theorem.accuracy, self._after_settling),
            self._claim("|beta/J| in the end", f"{source}, proof", "rad",
                        theorem.final_angle, self._final(ANGLE, RATE)),
            self._claim("|v/J| in the end", f"{source}, proof", "rad/s",
                        theorem.final_rate, self._final(RATE, None)),
        ]  # fmt: skip
        if self.law.attraction:
            claims.insert(0, self._attraction())
        return (*claims, *self._limit_cycle(), self._attitude())

    def printed_rate(self) -> Guarantee:
        """Returns the printed claim |v| < eps, guaranteed only where the repaired one gives it."""
        repaired = Assumption(
            text="2 S < eps: the repaired bound gives the printed one",
            value=self.theorem.final_rate,
            limit=self.theorem.accuracy,
            relation="<=",
            unit="rad/s",
        )
        return Guarantee(
            claim="|v/J| < eps in the end, as printed",
            source=f"{self.theorem.source}, as printed",
            unit="rad/s",
            bound=self.theorem.accuracy,
            measure=self._under_hypotheses(self._final(RATE, None)),
            assumptions=(*self.theorem.parameters, repaired),
        )

    def _claim(
        self, claim: str, source: str, unit: str, bound: float, measure: Measure
    ) -> Guarantee:
        return Guarantee(
            claim=claim,
            source=source,
            unit=unit,
            bound=bound,
            measure=self._under_hypotheses(measure),
            assumptions=self.theorem.parameters,
        )

    def _attraction(self) -> Guarantee:
        """The miss: without compensation the delay leaves h v0."""

        def miss(trajectory: Trajectory) -> Measurement:
            end = self._feedback_start(trajectory) + self._delay()
            if end > trajectory.time[-1]:
                over = Assumption(
                    text="flight goes on until the pulses have acted",
                    value=float(trajectory.time[-1]),
                    limit=end,
                    relation=">=",
                    unit="s",
                )
                return Measurement(math.nan, assumptions=(over,))
            beta = float(np.interp(end, trajectory.time, trajectory[ANGLE]))
            return Measurement(beta, end, predicted=self._predicted_miss(trajectory))

        return Guarantee(
            claim="attraction leaves |beta/J| < eps",
            source=f"{PAPER}, (2.2)",
            unit="rad",
            bound=self.theorem.accuracy,
            measure=miss,
        )

    def _attitude(self) -> Guarantee:
        return Guarantee(
            claim="attitude itself: |gamma| < eps in the end",
            source="not promised by the theorem",
            unit="rad",
            bound=self.theorem.accuracy,
            measure=self._final("attitude_z", "rate_z"),
            signals=("attitude_z", "rate_z"),
        )

    def _limit_cycle(self) -> list[Guarantee]:
        """Closed forms, where they apply: ideal relay, constant delay, continuous time."""
        spec = self.thrusters[self.law.thrusters[0]] if self.thrusters else None
        holds = all(a.holds for a in self.theorem.parameters)
        if spec is None or self.law.period is not None or spec.delay.amplitude or not holds:
            return []
        if spec.delay.mean == 0:
            return []  # a relay without delay has no cycle; the flight refuses it
        h, c, p = spec.delay.mean, self.law.c, self.law.lowest
        cycle = limit_cycle(c=c, delay=h, level=p)
        figures = (
            ("period", "s", cycle.period, self._period, 0.0),
            ("|v/J|", "rad/s", cycle.v_max, self._final(RATE, None), 0.0),
            # A steady f moves the centre of the cycle by f h (1 - c h/2)/c.
            ("|beta/J|", "rad", cycle.beta_max, self._final(ANGLE, RATE), h / c),
        )

        def near(measure: Measure, predicted: float, shift: float) -> Measure:
            def measured(trajectory: Trajectory) -> Measurement:
                f, m = self._disturbance(trajectory), measure(trajectory)
                error = max((abs(lag - h) for lag in self._lags(trajectory)), default=0.0)
                settled = self._goes_on(trajectory, FINAL)
                as_designed = Assumption(
                    text="delay seen in flight is the one designed for, within 1 us",
                    value=error,
                    limit=1e-6,
                    unit="s",
                )
                overcome = Assumption(
                    text="|f/J| < p: the relay overcomes the disturbance",
                    value=f,
                    limit=p,
                    unit="rad/s^2",
                )
                bound = (2 * f / p + _LEFT_OVER) * predicted + shift * f
                return Measurement(
                    m.value, m.t_worst, None, bound, (as_designed, overcome, settled)
                )

            return measured

        return [
            Guarantee(
                claim=f"limit cycle: {name}",
                source=f"{PAPER}, closed form, +-(2 f/p + 0.1 %)",
                unit=unit,
                kind="within",
                predicted=value,
                measure=near(measure, value, shift),
            )
            for name, unit, value, measure, shift in figures
        ]

    # -- measurements --------------------------------------------------------------------------

    def _under_hypotheses(self, measure: Measure) -> Measure:
        """Adds the hypotheses that only the flight can tell."""

        def measured(trajectory: Trajectory) -> Measurement:
            m, start = measure(trajectory), self._start(trajectory)
            beta, v = self._state_at(trajectory, start)
            disturbance = Assumption(
                text="|f/J| below the bound of the theorem",
                value=self._disturbance(trajectory),
                limit=self.theorem.disturbance,
                unit="rad/s^2",
            )
            intact = Assumption(
                text="thrust follows the commands: none stays out for longer than h0",
                value=self._longest_silence(trajectory),
                limit=self.theorem.max_delay + (self.law.period or 0.0),
                unit="s",
            )
            age = Assumption(
                text="delay seen in flight, and sampling period, < h0",
                value=max(self._lags(trajectory), default=0.0) + (self.law.period or 0.0),
                limit=self.theorem.max_delay,
                unit="s",
            )
            assumptions = (disturbance, age, self._goes_on(trajectory, 0.0), intact)
            if self.theorem.assumed_delay:
                assumed, error = self.theorem.assumed_delay
                off = max((abs(lag - assumed) for lag in self._lags(trajectory)), default=0.0)
                assumptions += (
                    Assumption(
                        text="delay as the observer assumes it",
                        value=off,
                        limit=error + 1e-9,  # rounding of the clock
                        relation="<=",
                        unit="s",
                    ),
                )
            if self.theorem.estimated:
                forgotten, end = self._forgotten(trajectory), float(trajectory.time[-1])
                assumptions += (
                    Assumption(
                        text="since when the estimates keep their bounds",
                        value=forgotten,
                        limit=end - (self._settled(trajectory, forgotten) - forgotten),
                        relation="<=",
                        unit="s",
                    ),
                )
            assumptions += self.theorem.entry(beta, v)
            return Measurement(m.value, m.t_worst, m.predicted, m.bound, assumptions)

        return measured

    def _after_settling(self, trajectory: Trajectory) -> Measurement:
        start = self._start(trajectory)
        start += self.theorem.settling(*self._state_at(trajectory, start))
        late = trajectory.time >= start
        if not late.any():
            return Measurement(math.nan)
        worst = peak(trajectory.time[late], trajectory[ANGLE][late], trajectory[RATE][late])
        return Measurement(*worst)

    def _state_at(self, trajectory: Trajectory, t: float) -> tuple[float, float]:
        """(beta, v) at an instant, between rows by interpolation."""
        beta, v = (float(np.interp(t, trajectory.time, trajectory[x])) for x in (ANGLE, RATE))
        return beta, v

    def _final(self, signal: str, rate: str | None) -> Measure:
        """Largest |signal| over the last minute; between the rows too where its rate is known."""

        def measure(trajectory: Trajectory) -> Measurement:
            late = trajectory.time >= self._final_start(trajectory)
            if not late.any():
                return Measurement(math.nan)
            time, x = trajectory.time[late], trajectory[signal][late]
            if rate is None:
                worst = int(np.argmax(np.abs(x)))
                return Measurement(float(abs(x[worst])), float(time[worst]))
            return Measurement(*peak(time, x, trajectory[rate][late]))

        return measure

    def _final_start(self, trajectory: Trajectory) -> float:
        """Start of the last minute, not before |beta| < eps is promised, s."""
        settled = self._settled(trajectory, self._start(trajectory))
        return max(float(trajectory.time[-1]) - FINAL, settled)

    def _settled(self, trajectory: Trajectory, start: float) -> float:
        """When |beta| < eps is promised if the theorem speaks from a start on, s."""
        return start + self.theorem.settling(*self._state_at(trajectory, start)) + self._delay()

    def _goes_on(self, trajectory: Trajectory, span: float) -> Assumption:
        """That a flight goes on for some time after |beta| < eps is promised, to be judged."""
        promised = self._settled(trajectory, self._start(trajectory))
        return Assumption(
            text="flight goes on after the predicted time",
            value=float(trajectory.time[-1]) - promised,
            limit=span,
            relation=">=",
            unit="s",
        )

    def _period(self, trajectory: Trajectory) -> Measurement:
        """Mean time between switchings of the thrust to plus, over the last minute."""
        late = trajectory.time >= self._final_start(trajectory)
        thrust, time = np.sign(trajectory[self.law.thrusters[0]][late]), trajectory.time[late]
        rising = time[1:][(thrust[1:] > 0) & (thrust[:-1] <= 0)]
        return Measurement(float(np.mean(np.diff(rising))) if len(rising) > 1 else math.nan)

    def _disturbance(self, trajectory: Trajectory) -> float:
        """The largest |f/J| of a flight, rad/s^2."""
        signal = trajectory.signals.get("disturbance_z")
        if signal is None:
            return 0.0
        return float(np.max(np.abs(signal))) * abs(self.model.gain("disturbance_z", RATE))

    def _lags(self, trajectory: Trajectory) -> list[float]:
        """Times from each change of the command to the change of thrust that follows it, s."""
        channel, time = self.law.thrusters[0], trajectory.time
        command = np.r_[0.0, trajectory[f"{channel}_command"]]
        issued = time[np.flatnonzero(np.diff(command))]
        followed = time[1:][np.flatnonzero(np.diff(trajectory[channel]))]
        n = min(len(issued), len(followed))
        return (followed[:n] - issued[:n]).tolist()

    def _longest_silence(self, trajectory: Trajectory) -> float:
        """Longest time for which the thrust is not a level commanded within the last h0, s."""
        channel, time = self.law.thrusters[0], trajectory.time
        thrust, command = trajectory[channel], trajectory[f"{channel}_command"]
        longest = self.theorem.max_delay + (self.law.period or 0.0)
        agrees = np.isclose(thrust, command, rtol=1e-6)
        agreed = np.maximum.accumulate(np.where(agrees, time, -np.inf))
        changed = np.r_[True, np.diff(command) != 0]
        since = time[np.maximum.accumulate(np.where(changed, np.arange(len(time)), 0))]
        # The command has stood for longer than the delay, and the thrust is not it.
        stale = ~agrees & (time - since > longest)
        waited = time - np.maximum(np.where(np.isfinite(agreed), agreed, time[0]), since)
        return float(np.max(waited[stale], initial=0.0))

    def _start(self, trajectory: Trajectory) -> float:
        """When the theorem begins to speak, s: there is feedback, by estimates within bounds."""
        start, forgotten = self._feedback_start(trajectory), self._forgotten(trajectory)
        judged = self._settled(trajectory, forgotten) <= trajectory.time[-1]
        return max(start, forgotten) if judged else start

    def _forgotten(self, trajectory: Trajectory) -> float:
        """Since when the estimates keep their bounds, s; the end of the flight if they do not."""
        time = trajectory.time
        if not self.theorem.estimated or self.law.period is None:
            return float(time[0])
        rows = sample_rows(time, self.law.period)[0]
        over = [
            np.abs(trajectory[f"{ESTIMATED}{name}"] - trajectory[name])[rows] > limit
            for name, limit in self.theorem.estimated.items()
        ]
        last = int(np.flatnonzero(np.any(over, axis=0)).max(initial=-1))
        return float(time[rows[last + 1]]) if last + 1 < len(rows) else float(time[-1])

    def _feedback_start(self, trajectory: Trajectory) -> float:
        """T2 of a flight, s; its first row if there is no attraction."""
        if not self.law.attraction:
            return float(trajectory.time[0])
        return float(trajectory.time[0]) + self._pulses(trajectory).T2

    def _pulses(self, trajectory: Trajectory):
        v = trajectory[RATE][0]
        beta = trajectory[ANGLE][0] + v * self.law.compensated_delay
        return attracting(beta, v, self.law.attraction)

    def _predicted_miss(self, trajectory: Trajectory) -> float:
        """(h - compensated h) v0: until the first pulse acts the spacecraft drifts on."""
        return (self._delay() - self.law.compensated_delay) * float(trajectory[RATE][0])

    def _delay(self) -> float:
        return self.thrusters[self.law.thrusters[0]].delay.mean if self.thrusters else 0.0
