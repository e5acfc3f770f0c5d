"""What Ivanova & Sokolov (1999) guarantee, as claims that a flight can be held to.

The contour is reached when a thrust is switched on in W1, or off in W2: from there on no
disturbance within its bound takes the state out again (Lemma 3.3).  Claims about the limit are
measured from that instant.  How fast it comes is claimed of Example 1 alone, whose turns leave a
share k of the excess.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from controllers.dimensionless import Scale
from spacecraft_sim.guarantee import Assumption, Guarantee, Measurement
from spacecraft_sim.trajectory import Trajectory, peak

Array = np.ndarray
PAPER = "Ivanova & Sokolov 1999"
SLACK = 1e-7  # share of p by which W1 and W2 may be missed; asymptotic rules come no nearer
ROUNDING = 1e-6  # share of p that this slack, and the plant's integration, may add
_LEAST_EXCESS = 1e-3  # share of p of an excess over p whose contraction is measured
_STEP = 0.02  # share of the on-time that motion is averaged over, to tell what disturbed it


class Reached(NamedTuple):
    """When a flight reached the contour, and how many switchings followed.

    Attributes:
        row: Row of the trajectory; of the middle of the flight if the contour was not reached.
        switchings: Switchings from there on; 0 if the contour was not reached.
    """

    row: int
    switchings: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Claims:
    """The guarantees of one design.

    Attributes:
        source: Where the rule stands.
        scale: Units.
        accuracy: Half width of the contour, dimensionless.
        contraction: k of a turn; None if none is claimed.
        settled: Tells by x, v and the new level whether a switching reaches the contour.
        assumptions: Hypotheses that the design decides.
        least: Hypotheses under which no law guarantees less; none if it is not claimed.
        sensors: Names of angle and rate.
        channel: Name of the thruster.
        axis: x, y or z.
        level: Thrust that accelerates to plus, N or N m.
        torque_gain: Acceleration at unit disturbance torque, rad/s^2.
        bias: Constant torque F, N m.
        disturbance: Bound of the rest, N m.
        delays: On-delay and off-delay that the law counts on, s.
    """

    source: str
    scale: Scale
    accuracy: float
    contraction: float | None
    settled: Callable[[float, float, int], bool]
    assumptions: tuple[Assumption, ...]
    least: tuple[Assumption, ...]
    sensors: tuple[str, str]
    channel: str
    axis: str
    level: float
    torque_gain: float
    bias: float
    disturbance: float
    delays: tuple[float, float]

    def all(self) -> tuple[Guarantee, ...]:
        """Returns every claim."""
        bound = self.accuracy * self.scale.angle
        claims = [
            Guarantee(
                claim=f"limsup |{self.sensors[0]}| <= p",
                source=f"{self.source}, Lemma 3.3",
                unit="rad",
                bound=bound * (1 + ROUNDING),
                measure=self._limit,
                assumptions=self.assumptions,
            ),
            Guarantee(
                claim=f"by how much the shortest pulse of {self.channel} is too short",
                source=f"{self.source}, (1.4)",
                unit="s",
                measure=self._shortfall,
                assumptions=self.assumptions,
            ),
            Guarantee(
                claim=f"mean thrust of {self.channel} over whole cycles balances the disturbance",
                source="momentum balance",
                unit="of the level",
                kind="within",
                measure=self._duty,
                assumptions=self.assumptions,
            ),
        ]
        if self.least:
            claims.insert(1, Guarantee(
                claim=f"limsup |{self.sensors[0]}| <= m, which no law can improve",
                source=f"{self.source}, (3.8)" if self.disturbance else f"{self.source}, (2.1)",
                unit="rad",
                bound=bound * (1 + ROUNDING),
                measure=self._limit,
                assumptions=(*self.assumptions, *self.least),
            ))  # fmt: skip
        if self.contraction is not None:
            claims.append(Guarantee(
                claim=f"a turn of {self.sensors[0]} leaves at most k of the excess over p",
                source=f"{self.source}, Example 1",
                unit="",
                bound=self.contraction + ROUNDING / _LEAST_EXCESS,
                measure=self._contraction,
                assumptions=self.assumptions,
            ))  # fmt: skip
        return tuple(claims)

    # -- measurements --------------------------------------------------------------------------

    def _limit(self, trajectory: Trajectory) -> Measurement:
        reached = self._reached(trajectory)
        enough = Assumption(
            text="switchings after the contour was reached",
            value=reached.switchings,
            limit=2,
            relation=">=",
        )
        angle, rate = (trajectory[name][reached.row :] for name in self.sensors)
        worst = peak(trajectory.time[reached.row :], angle, rate)
        return Measurement(*worst, assumptions=(*self._in_flight(trajectory), enough))

    def _shortfall(self, trajectory: Trajectory) -> Measurement:
        rows, levels = self._switchings(trajectory)
        times = trajectory.time[rows]
        lengths = np.diff(times)[levels[:-1] != 0]
        clock = max(1e-9 * self.scale.time, 4 * math.ulp(float(trajectory.time[-1])))
        if not lengths.size:
            return Measurement(math.nan, bound=clock)
        start = int(np.argmin(lengths))
        missing = max(self.scale.time - float(lengths[start]), 0.0)
        when = float(times[:-1][levels[:-1] != 0][start])
        return Measurement(missing, when, bound=clock)

    def _duty(self, trajectory: Trajectory) -> Measurement:
        rows, levels = self._switchings(trajectory)
        on = rows[(levels == -1) & (rows >= self._reached(trajectory).row)]
        if len(on) < 2:
            return Measurement(math.nan, bound=0.0)
        first, last = int(on[0]), int(on[-1])
        impulse = trajectory[f"{self.channel}_impulse"]
        span = float(trajectory.time[last] - trajectory.time[first])
        mean = -float(impulse[last] - impulse[first]) * self.scale.sign / (self.level * span)
        unit = self.scale.sign * self.torque_gain / self.scale.acceleration
        push = self._mean_torque(trajectory, first, last) * unit
        # What the rates at the ends, anywhere in the contour, leave to the balance.
        rate = trajectory[self.sensors[1]]
        play = float(np.ptp(rate[first : last + 1])) / (self.scale.acceleration * span)
        return Measurement(mean, predicted=push, bound=play)

    def _contraction(self, trajectory: Trajectory) -> Measurement:
        """Largest share of an excess over p that was left when x turned on the same side again."""
        p = self.accuracy * self.scale.angle
        worst, when = 0.0, float(trajectory.time[0])
        before = {1.0: 0.0, -1.0: 0.0}
        for time, angle, side in self._turns(trajectory):
            excess, last = side * angle - p, before[side]
            if last > _LEAST_EXCESS * p and excess / last > worst:
                worst, when = excess / last, time
            before[side] = excess
        return Measurement(worst, when, assumptions=self._in_flight(trajectory))

    # -- readings of a flight ------------------------------------------------------------------

    def _switchings(self, trajectory: Trajectory) -> tuple[Array, Array]:
        """Rows at which the thrust changed, and the dimensionless level after each."""
        thrust = trajectory[self.channel] * (self.scale.sign / self.level)
        levels = np.rint(thrust).astype(int)
        rows = np.flatnonzero(np.diff(levels, prepend=0))
        return rows, levels[rows]

    def _reached(self, trajectory: Trajectory) -> Reached:
        rows, levels = self._switchings(trajectory)
        angle, rate = (trajectory[name][rows].tolist() for name in self.sensors)
        for k, (a, b, level) in enumerate(zip(angle, rate, levels.tolist(), strict=True)):
            if self.settled(*self.scale.reduced(a, b), level):
                return Reached(int(rows[k]), len(rows) - 1 - k)
        return Reached(len(trajectory.time) // 2, 0)

    def _turns(self, trajectory: Trajectory) -> list[tuple[float, float, float]]:
        """Time, angle and sign of the rate before, where it passes zero after a switching."""
        angle, rate = (trajectory[name] for name in self.sensors)
        rows, _ = self._switchings(trajectory)
        first = int(rows[0]) if rows.size else len(rate)
        moving = np.flatnonzero(rate)
        way = np.sign(rate[moving])
        turns = np.flatnonzero(way[:-1] != way[1:])
        found = []
        for i, j in zip(moving[turns].tolist(), moving[turns + 1].tolist(), strict=True):
            if i < first:
                continue
            rows_between = slice(i, j + 1)
            worst, time = peak(
                trajectory.time[rows_between], angle[rows_between], rate[rows_between]
            )
            found.append((time, math.copysign(worst, float(angle[i])), float(np.sign(rate[i]))))
        return found

    def _mean_torque(self, trajectory: Trajectory, first: int, last: int) -> float:
        """Mean disturbance torque between two rows, N m; the bias where none is recorded."""
        impulse = trajectory.signals.get(f"disturbance_{self.axis}_impulse")
        if impulse is None:
            return self.bias
        span = float(trajectory.time[last] - trajectory.time[first])
        return float(impulse[last] - impulse[first]) / span

    def _in_flight(self, trajectory: Trajectory) -> tuple[Assumption, ...]:
        """Hypotheses that only the flight can tell."""
        excursion = self._excursion(trajectory)
        on_lag, off_lag = self._lags(trajectory)
        return (
            Assumption(
                text="|eps| <= e in flight, from torque and motion",
                value=excursion,
                limit=self.disturbance + 1e-6 * self.level_torque,
                relation="<=",
                unit="N m",
            ),
            Assumption(
                text="thrust comes and goes as late as the law counts on, within 1 us",
                value=max(abs(on_lag), abs(off_lag)),
                limit=1e-6,
                relation="<=",
                unit="s",
            ),
        )

    @property
    def level_torque(self) -> float:
        """The thrust as a torque, N m."""
        return self.scale.acceleration / self.torque_gain

    def _excursion(self, trajectory: Trajectory) -> float:
        """Largest |torque - F| of a flight, recorded or told by how the rate changed, N m."""
        torque = trajectory.signals.get(f"disturbance_{self.axis}")
        recorded = 0.0 if torque is None else float(np.max(np.abs(torque - self.bias)))
        time, rate = trajectory.time, trajectory[self.sensors[1]]
        thrust = trajectory[f"{self.channel}_impulse"] * (self.level_torque / self.level)
        # Rows that lie a little apart: over less, rounding of the rate counts.
        rows, last = [0], float(time[0])
        for i, t in enumerate(time.tolist()):
            if t - last >= _STEP * self.scale.time:
                rows.append(i)
                last = t
        span = np.diff(time[rows])
        if not span.size:
            return recorded
        mean = (np.diff(rate[rows]) / self.torque_gain - np.diff(thrust[rows])) / span
        return max(recorded, float(np.max(np.abs(mean - self.bias))))

    def _lags(self, trajectory: Trajectory) -> tuple[float, float]:
        """Largest time by which thrust follows a command, on and off, other than expected, s."""
        time = trajectory.time
        command = np.rint(trajectory[f"{self.channel}_command"] / self.level).astype(int)
        issued = np.flatnonzero(np.diff(command, prepend=0))
        rows, levels = self._switchings(trajectory)
        count = min(len(issued), len(rows))
        lag = time[rows[:count]] - time[issued[:count]]
        on = levels[:count] != 0
        expected = np.where(on, self.delays[0], self.delays[1])
        late = np.abs(lag - expected)
        return (
            float(np.max(late[on], initial=0.0)),
            float(np.max(late[~on], initial=0.0)),
        )
