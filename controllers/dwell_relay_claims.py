"""What is guaranteed of two-level relays with a dwell, as claims that a flight can be held to.

The accuracy is claimed from the first switching on that starts inside the contour; before, the law
comes in from wherever it was, which is seen in runs and not proved.
"""

import math
from dataclasses import dataclass

import numpy as np

from controllers.observer import ESTIMATED
from spacecraft_sim.dwell_axes import Band
from spacecraft_sim.guarantee import Assumption, Guarantee, Measurement
from spacecraft_sim.small_motion import slow_rotation, small_deflection
from spacecraft_sim.trajectory import Trajectory, peak, sample_rows

Array = np.ndarray

SOURCE = "Sokolov 2004, (27), and Ivanova & Sokolov 1999"
SLACK = 1e-7  # share of the contour by which a switching may miss its arc
ROUNDING = 1e-6  # share of the bound that this and the plant's integration may add
_STEP = 0.02  # share of the dwell that motion is averaged over, to tell what disturbed it


@dataclass(frozen=True, slots=True, kw_only=True)
class Claims:
    """The guarantees of one axis.

    Attributes:
        axis: x, y or z.
        band: Its contour, and what it guarantees.
        level: Thrust that accelerates to plus, N or N m.
        torque_gain: Acceleration at 1 N m, rad/s^2.
        sensors: Names of angle and rate that are fed back.
        estimated: Names of what an observer estimates, with the bounds of its errors at samples,
            rad and rad/s; none if all is measured.
        channel: Name of the thruster.
        period: Sampling period, s; None in continuous time.
        decay: Of the slowest elastic motion, 1/s; inf if there is none.
        assumptions: Hypotheses that the design decides.
    """

    axis: str
    band: Band
    level: float
    torque_gain: float
    sensors: tuple[str, str]
    estimated: dict[str, float]
    channel: str
    decay: float
    period: float | None
    assumptions: tuple[Assumption, ...]

    def all(self) -> tuple[Guarantee, ...]:
        """Returns every claim; that of the angle has a term for each of its causes.

        The contour p0 u0 dwell^2; switching late, by sampling and delay; the other axes; and how
        far the attitude may be from the angle that is fed back.
        """
        terms = self.band.accuracy
        attitude = (f"attitude_{self.axis}", f"rate_{self.axis}")
        words = f"|{attitude[0]}| <= contour {terms.contour:.3g}"
        for text, value in (
            ("late", terms.sampling),
            ("axes", terms.coupling),
            ("H q/J", terms.lean),
        ):
            words += f" + {text} {value:.2g}" if value else ""
        return (
            Guarantee(
                claim=f"{words} rad",
                source=SOURCE,
                unit="rad",
                bound=terms.total * (1 + ROUNDING),
                measure=lambda track: self._largest(track, attitude),
                assumptions=self.assumptions,
                signals=attitude,
            ),
            Guarantee(
                claim=f"by how much {self.channel} switches sooner than the dwell",
                source=SOURCE,
                unit="s",
                measure=self._shortfall,
                assumptions=self.assumptions,
            ),
        )

    # -- measurements --------------------------------------------------------------------------

    def _largest(self, track: Trajectory, names: tuple[str, str]) -> Measurement:
        """The largest angle since the contour was entered."""
        row, switchings = self._entered(track)
        worst = peak(track.time[row:], *(track[name][row:] for name in names))
        enough = Assumption(
            text=f"{self.axis}: switchings inside the contour",
            value=switchings,
            limit=2,
            relation=">=",
        )
        return Measurement(*worst, assumptions=(enough, *self._in_flight(track, row)))

    def _shortfall(self, track: Trajectory) -> Measurement:
        rows, _ = self._switchings(track)
        times = track.time[rows]
        dwell = self.band.axis.dwell
        clock = max(1e-9 * dwell, 4 * math.ulp(float(track.time[-1])))
        gaps = np.diff(times)
        if not gaps.size:
            return Measurement(math.nan, bound=clock)
        shortest = int(np.argmin(gaps))
        missing = max(dwell - float(gaps[shortest]), 0.0)
        return Measurement(missing, float(times[shortest]), bound=clock)

    # -- readings of a flight ------------------------------------------------------------------

    def _switchings(self, track: Trajectory) -> tuple[Array, Array]:
        """Rows at which the thrust turned, and the sign of the acceleration after each."""
        signs = np.sign(track[self.channel] * math.copysign(1.0, self.level)).astype(int)
        rows = np.flatnonzero(np.diff(signs, prepend=0))
        return rows, signs[rows]

    def _entered(self, track: Trajectory) -> tuple[int, int]:
        """Row of the first switching inside the contour, and how many follow; the middle and 0."""
        rows, signs = self._switchings(track)
        axis, contour = self.band.axis, self.band.contour
        angle, rate = (track[name][rows] for name in self.sensors)
        x, v = angle / axis.length, rate / axis.speed
        for k, (a, b, sign) in enumerate(zip(x.tolist(), v.tolist(), signs.tolist(), strict=True)):
            if contour.enters(a, b, sign, slack=SLACK):
                return int(rows[k]), len(rows) - 1 - k
        return len(track.time) // 2, 0

    def _in_flight(self, track: Trajectory, row: int) -> tuple[Assumption, ...]:
        """Hypotheses that only the flight can tell, from a row on."""
        axis = self.band.axis
        disturbance = axis.disturbance * axis.acceleration + self.band.gyroscopic
        room = 1e-6 * axis.acceleration
        found = [
            Assumption(
                text=f"{self.axis}: |eps| <= e in flight, from thrust and motion",
                value=self._excursion(track, row) / self.torque_gain,
                limit=(disturbance + room) / self.torque_gain,
                relation="<=",
                unit="N m",
            ),
            Assumption(
                text=f"{self.axis}: |phi' - omega| as the other axes allow",
                value=self._slip(track, row),
                limit=self.band.slip + 1e-9 * axis.speed,
                relation="<=",
                unit="rad/s",
            ),
            *self._observed(track, row),
            *small_deflections(track),
        ]
        if math.isfinite(self.decay):
            spin = _magnitude(track, "quasi_rigid_rate")
            found.append(slow_rotation(float(spin[row:].max()), self.decay))
        return tuple(found)

    def _excursion(self, track: Trajectory, row: int) -> float:
        """Largest acceleration beside thrust and bias, as a mean over short spans, rad/s^2."""
        axis = self.band.axis
        time, rate = track.time[row:], track[self.sensors[1]][row:]
        thrust = track[f"{self.channel}_impulse"][row:] * (axis.acceleration / self.level)
        rows, last = [0], float(time[0])
        for i in self._samples(time).tolist():
            if (t := float(time[i])) - last >= _STEP * axis.dwell:  # over less, rounding counts
                rows.append(i)
                last = t
        span = np.diff(time[rows])
        if not span.size:
            return 0.0
        mean = (np.diff(rate[rows]) - np.diff(thrust[rows])) / span
        return float(np.max(np.abs(mean - axis.bias * axis.acceleration)))

    def _observed(self, track: Trajectory, row: int) -> tuple[Assumption, ...]:
        """That an observer is as good as its bounds, its start forgotten."""
        if self.period is None:
            return ()
        rows = row + sample_rows(track.time[row:], self.period)[0]
        return tuple(
            Assumption(
                text=f"{self.axis}: error of the estimate",
                value=float(np.abs(track[f"{ESTIMATED}{name}"] - track[name])[rows].max()),
                limit=limit,
                relation="<=",
                unit=track.units[name],
            )
            for name, limit in self.estimated.items()
        )

    def _samples(self, time: Array) -> Array:
        """Rows between which a mean may be taken: between samples an estimate does not follow."""
        return np.arange(len(time)) if self.period is None else sample_rows(time, self.period)[0]

    def _slip(self, track: Trajectory, row: int) -> float:
        """Largest |(phi x omega)/2| about the axis, the kinematics of three axes."""
        if "attitude_x" not in track.signals:
            return 0.0
        phi, omega = (
            np.stack([track[f"{kind}_{a}"][row:] for a in "xyz"], axis=1)
            for kind in ("attitude", "rate")
        )
        return float(np.abs(np.cross(phi, omega)[:, "xyz".index(self.axis)]).max() / 2)


def small_deflections(track: Trajectory) -> tuple[Assumption, ...]:
    """Returns that the joint bent farthest is bent little; nothing where no joints are recorded.

    Args:
        track: A flight.
    """
    bent = {}
    for name, signal in track.signals.items():
        joint, _, part = name.rpartition(".")
        if part == "angle" and track.units[name] == "rad" and not joint.startswith("attitude_"):
            bent[joint] = float(np.abs(signal).max())
        if part == "qw" and f"{joint}.x" not in track.signals:  # a ball, and not the free bus
            bent[joint] = float(2 * np.arccos(np.clip(np.abs(signal), 0.0, 1.0)).max())
    if not bent:
        return ()
    worst = max(bent, key=lambda joint: bent[joint])
    return (small_deflection(worst, bent[worst]),)


def _magnitude(track: Trajectory, kind: str) -> Array:
    """Length of a vector signal, of as many components as there are."""
    parts = [track.signals.get(f"{kind}_{axis}") for axis in "xyz"]
    return np.sqrt(sum(part**2 for part in parts if part is not None))
