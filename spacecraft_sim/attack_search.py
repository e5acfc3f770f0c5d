"""Search for switchings, a disturbance and a spin that drive the elastic moment over its bound."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from spacecraft_sim.attack import Schedule, claim
from spacecraft_sim.elastic_flight import longest_step
from spacecraft_sim.elastic_influence import Influence
from spacecraft_sim.elastic_modes import ElasticModel
from spacecraft_sim.falsify import Found, falsify
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.relay_channels import AXES

Array = np.ndarray

_COARSE = 3.0  # steps of the search over exact ones
_RUNG_UP = 3.0  # time constants of the slowest motion in a flight: 95 % of all there is
_LONGEST = 400.0  # s
_SILENT = 1e-9  # share of the largest bound below which an axis is not disturbed at all


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """Schedules as points of the box -1 <= x <= 1: signs, waits beyond the dwell, torque and spin.

    The waits of a channel are given at its first and last switching and at knots between, and in
    proportion elsewhere: few numbers for trains as long as it takes to ring a mode up.

    Attributes:
        torque: M0 of each channel, shape (3,), N m.
        dwell: Least time between switchings of each, shape (3,), s.
        wait: Longest time beyond the dwell, s.
        knots: Waits of each channel that are chosen.
        duration: Length of the flight, s.
        disturbance: Largest constant torque about each axis over M0.
        spin: Largest rate about each axis at t = 0, rad/s.
    """

    torque: Array
    dwell: Array
    wait: float
    knots: int
    duration: float
    disturbance: float
    spin: float

    @property
    def variables(self) -> int:
        """How many numbers make a schedule."""
        return 3 * (1 + self.knots) + 6

    def schedule(self, x: Array) -> Schedule:
        """Returns the schedule of a point.

        Args:
            x: The point, shape (variables,).
        """
        channels, extra = x[:-6].reshape(3, -1), x[-6:]
        times, levels = [], []
        for M0, held, (sign, *waits) in zip(self.torque, self.dwell, channels, strict=True):
            most = int(self.duration / held)
            share = np.interp(np.linspace(0, 1, most), np.linspace(0, 1, self.knots), waits)
            at = np.cumsum(held + self.wait * (1 + share) / 2)
            times.append(at[at < self.duration])
            alternating = (-1.0) ** np.arange(len(times[-1]) + 1)
            levels.append((M0 if sign >= 0 else -M0) * alternating)
        return Schedule(
            switch_times=tuple(times),
            levels=tuple(levels),
            duration=self.duration,
            disturbance=tuple((self.disturbance * self.torque * extra[:3]).tolist()),
            spin=tuple((self.spin * extra[3:]).tolist()),
        )

    def resonances(self, eigenvalues: Array, parts: Array) -> list[Array]:
        """Returns a point for each mode whose half periods the channels can switch at.

        Args:
            eigenvalues: lambda of the modes, shape (k,), 1/s.
            parts: Amplitude of each mode after a step of each channel, shape (k, 3); the channels
                start in the senses in which theirs add up.
        """
        found = []
        for eigenvalue, part in zip(eigenvalues.tolist(), parts, strict=True):
            if eigenvalue.imag <= 0:
                continue
            half = np.pi / eigenvalue.imag
            odd = 2 * np.ceil((self.dwell / half - 1) / 2) + 1  # half periods past the dwell
            share = 2 * (np.maximum(odd, 1) * half - self.dwell) / self.wait - 1
            if np.all(share <= 1):
                along = np.real(part / part[int(np.argmax(np.abs(part)))])
                senses = np.where(along < 0, -1.0, 1.0)
                channels = np.column_stack([senses, *[share] * self.knots])
                found.append(np.r_[channels.ravel(), np.zeros(6)])
        return found


def search(
    model: Any,
    elastic: ElasticModel,
    found: Influence,
    *,
    axis: str,
    evaluations: int,
    rng: np.random.Generator,
    duration: float,
    knots: int = 3,
    disturbance: float = 0.0,
    spin: float = 0.0,
) -> tuple[Schedule, Found]:
    """Searches for the worst flight, from switchings at half periods of each mode.

    Args:
        model: The compiled model.
        elastic: Its structure.
        found: Its bounds.
        axis: x, y or z.
        evaluations: How many flights.
        rng: Source of all that is random.
        duration: Length of each flight, s.
        knots: Waits of each channel that are chosen.
        disturbance: Largest constant torque about each axis over M0.
        spin: Largest rate about each axis at t = 0, rad/s.

    Returns:
        The worst schedule, and what was measured over M_e.

    Raises:
        ValueError: If M_e is zero, evaluations are not positive, there are fewer than two knots, or
            the flight is no longer than the longest dwell.
    """
    scale = float(found.bound[AXES.index(axis)])
    if not scale > 0:
        raise ValueError(f"M_e = {scale} N m about {axis}: there is nothing to search for")
    if knots < 2 or not duration > max(found.dwell):
        raise ValueError(
            f"knots = {knots} must be >= 2, and duration = {duration} s above the longest dwell, "
            f"{max(found.dwell):.6g} s"
        )
    plan = Plan(
        torque=found.torque,
        dwell=found.dwell,
        wait=2 * np.pi / float(np.min(np.abs(found.eigenvalues))),
        knots=knots,
        duration=duration,
        disturbance=disturbance,
        spin=spin,
    )
    step = _COARSE * longest_step(elastic)

    def share(x: Array) -> float:
        flight = plan.schedule(x).fly(model, step)
        return float(np.abs(flight[f"moment_{axis}"]).max()) / scale

    box = [(-1.0, 1.0)] * plan.variables
    parts = found.modes.accelerations(elastic.H[AXES.index(axis)])[:, 0]
    starts = plan.resonances(found.eigenvalues, parts)
    best = falsify(share, box, evaluations=evaluations, rng=rng, starts=starts)
    return plan.schedule(best.x), best


def attack(
    model: Any, elastic: ElasticModel, found: Influence, *, evaluations: int, seed: int = 0
) -> dict[str, Verdict]:
    """Searches about each axis that is disturbed, and holds the worst flight to the bound.

    Args:
        model: The compiled model.
        elastic: Its structure.
        found: Its bounds.
        evaluations: How many flights about each axis.
        seed: Of all that is random.

    Returns:
        The verdict on the worst flight about each axis.
    """
    duration = min(_RUNG_UP / found.modes.slowest_decay, _LONGEST)
    duration = max(duration, 3 * float(max(found.dwell)))
    verdicts = {}
    for axis, bound in zip(AXES, found.bound, strict=True):
        if bound > _SILENT * found.bound.max():
            schedule, _ = search(
                model, elastic, found, axis=axis, evaluations=evaluations, duration=duration,
                rng=np.random.default_rng(seed),
            )  # fmt: skip
            verdicts[axis] = claim(elastic, found, axis).check(schedule.fly(model))
    return verdicts
