"""The law of Ivanova & Sokolov (1999) on a sampled machine with delays, and the contour it keeps.

The paper's machine decides at any instant.  Here decisions fall on samples, and a command takes
effect after an on-delay or an off-delay.  The law therefore looks ahead to where a command issued
one sample later would take effect, with the commands under way played first: if eps = +e or -e all
the way may lead beyond the switching curve by then, it commands now.  So thrust never changes
late, and early by one sample and what eps may do in the delay.

The contour is widened to the least half width p_s for which every state in which -1 may so take
effect still wants -1 for the shortest pulse.  Those states lie between two ends.  The upper one
comes from A1; the lower one from the parabola, eps = -e sgn v, that starts where 0 may take effect
on M2 A2.  Times in between are longer: the time is concave along the arc, as in Lemma 3.2.  With
the thrust off, too, there must be time for a decision between one effect and the next.

p_s is sufficient; that no smaller one is, is not claimed.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

from controllers.contour import Contour, Point, contour, guaranteed_accuracy
from controllers.dimensionless import Scale
from spacecraft_sim.chart import Charts
from spacecraft_sim.checks import positive
from spacecraft_sim.switching_curves import Relay

_ROUNDING = 1e-9  # share of a period by which a whole number of periods may be missed


def command_samples(period: float, *, on_delay: float = 0.0, off_delay: float = 0.0) -> int:
    """Returns the periods for which a pulse is commanded at least, so that it acts for 1.

    Args:
        period: Ts over the minimum on-time.
        on_delay: Delay of switching on over the minimum on-time.
        off_delay: Delay of switching off over the minimum on-time.
    """
    return max(1, math.ceil((1 + on_delay - off_delay) / period - _ROUNDING))


def sampled_accuracy(
    F: float, eps: float, period: float, *, on_delay: float = 0.0, off_delay: float = 0.0
) -> float:
    """Returns p_s: limsup |x| <= p_s is guaranteed by the anticipating sampled law of Example 1.

    Args:
        F: Constant disturbance over the thrust, > 0.
        eps: Bound of what else disturbs over the thrust, < F and < 1 - F.
        period: Ts over the minimum on-time, at most 1.
        on_delay: Delay of switching on over the minimum on-time.
        off_delay: Delay of switching off over the minimum on-time.

    Raises:
        ValueError: If F and eps are out of bounds, the period is longer than the minimum on-time
            or not positive, or a delay is negative.
    """
    return sampled_contour(F, eps, period, on_delay=on_delay, off_delay=off_delay).p


def sampled_contour(
    F: float, eps: float, period: float, *, on_delay: float = 0.0, off_delay: float = 0.0
) -> Contour:
    """Returns the contour of half width p_s, with the time for which a sampled pulse acts.

    Args:
        F: Constant disturbance over the thrust, > 0.
        eps: Bound of what else disturbs over the thrust, < F and < 1 - F.
        period: Ts over the minimum on-time, at most 1.
        on_delay: Delay of switching on over the minimum on-time.
        off_delay: Delay of switching off over the minimum on-time.

    Raises:
        ValueError: As `sampled_accuracy`.
    """
    positive(period=period)
    positive(on_delay=on_delay, off_delay=off_delay, zero=True)
    if period > 1:
        raise ValueError(
            f"the sampling period is {period:.6g} minimum on-times: longer than the on-time; "
            "sample at least once in it"
        )
    samples = command_samples(period, on_delay=on_delay, off_delay=off_delay)
    on_time = samples * period + off_delay - on_delay

    def margin(p: float) -> float:
        c = contour(F, eps, half_width=p, on_time=on_time)
        lower, upper = early_states(c, period, on_delay=on_delay, off_delay=off_delay)
        pulse = min(time_to_left(c, lower), time_to_left(c, upper))
        coast = _least_coast(c, upper, period, off_delay)
        return min(pulse - on_time, coast - (period + on_delay - off_delay))

    low = high = guaranteed_accuracy(F, eps)
    while margin(high) < 0:
        low, high = high, 2 * high
    while high - low > 4 * math.ulp(high):
        middle = (low + high) / 2
        low, high = (low, middle) if margin(middle) >= 0 else (middle, high)
    return contour(F, eps, half_width=high, on_time=on_time)


def time_to_left(c: Contour, z: Point) -> float:
    """Returns the least time of u = -1 from a state to the arc A2 M1; -inf if it is past.

    Args:
        c: The contour.
        z: The state.
    """
    _, am, _, dp = c.rates
    room = z.x + z.v**2 / (2 * dp) + c.p
    return (z.v + math.sqrt(2 * room / (1 / dp + 1 / am))) / dp if room >= 0 else -math.inf


def early_states(
    c: Contour, period: float, *, on_delay: float = 0.0, off_delay: float = 0.0
) -> tuple[Point, Point]:
    """Returns the ends of the line of states in which -1 takes effect earliest: lower, upper.

    Args:
        c: The contour.
        period: Ts over the minimum on-time.
        on_delay: Delay of switching on over the minimum on-time.
        off_delay: Delay of switching off over the minimum on-time.
    """
    lowest = _lowest(c, period, on_delay, off_delay)
    return early_state(c, lowest, period, on_delay), early_state(c, c.A1.v, period, on_delay)


def early_state(c: Contour, v: float, period: float, on_delay: float) -> Point:
    """Returns the earliest state of -1 whose look-ahead ends at the rate v of A1 M2.

    Args:
        c: The contour.
        v: Rate at that end.
        period: Ts over the minimum on-time.
        on_delay: Delay of switching on over the minimum on-time.
    """
    z = _seen_from(c, v, period)
    # It looked ahead with eps = +e, and eps = -e came.
    return Point(z.x - c.eps * on_delay**2, z.v - 2 * c.eps * on_delay)


def _seen_from(c: Contour, v: float, horizon: float) -> Point:
    """The state that u = 0, eps = +e takes to the rate v of A1 M2 within the horizon."""
    ap, _, dm, _ = c.rates
    x = c.p - v**2 / (2 * dm)
    return Point(x - horizon * (v - horizon * ap / 2), v - horizon * ap)


def _early_off(c: Contour, v: float, period: float, off_delay: float) -> Point:
    """The earliest state of 0 whose look-ahead ends at the rate v of A2 M1."""
    _, am, _, dp = c.rates
    x = -c.p + v**2 / (2 * am)
    # It looked ahead with eps = -e, and +e came.
    return Point(
        x - period * (v + period * dp / 2) + c.eps * off_delay**2,
        v + dp * period + 2 * c.eps * off_delay,
    )


def _least_coast(c: Contour, upper: Point, period: float, off_delay: float) -> float:
    """Least time with the thrust off, from an end of the line of earliest 0 to A1 M2."""
    ap, am, dm, dp = c.rates
    turn = upper.x + upper.v**2 / (2 * dp)
    # The highest pulse ends here: eps = -e before it turns, +e after.
    highest = -math.sqrt(2 * max(turn + c.p, 0.0) / (1 / dm + 1 / am))
    times = []
    for v in (c.A2.v, highest):
        z = _early_off(c, v, period, off_delay)
        room = max(c.p - z.x + z.v**2 / (2 * ap), 0.0)
        times.append((math.sqrt(2 * room * ap * dm) - z.v) / ap)  # ap + dm = 1
    return min(times)


def _lowest(c: Contour, period: float, on_delay: float, off_delay: float) -> float:
    """Rate of A1 M2 that is looked at from the lower end."""
    ap, am = c.rates.ap, c.rates.am
    z = _early_off(c, c.A2.v, period, off_delay)
    X = z.x - z.v**2 / (2 * (ap if z.v < 0 else am))  # the parabola from there, at v = 0
    horizon = period + on_delay

    def beyond(v: float) -> bool:
        """Whether what looks at v is right of that parabola."""
        x, w = _seen_from(c, v, horizon)
        return x > X + w * w / (2 * (ap if w < 0 else am))

    low, high = 0.0, c.A1.v
    if not beyond(low):
        return low
    while high - low > 4 * math.ulp(high):
        middle = (low + high) / 2
        low, high = (middle, high) if beyond(middle) else (low, middle)
    return low


class Memory(NamedTuple):
    """What the sampled law remembers.

    Attributes:
        level: Dimensionless level commanded last: -1 or 0.
        since: Time of that command, s.
        acting: Level in effect.
        pending: Commands under way: (time of effect, level), ascending, s.
    """

    level: int
    since: float
    acting: int
    pending: tuple[tuple[float, int], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class AnticipatingRelay:
    """The sampled law, which looks one period and the delay ahead.

    Attributes:
        relay: Switching curves of the widened contour, dimensionless.
        scale: Units; the commanded thrust is mirrored with them.
        level: Thrust of the one level that accelerates to plus, N or N m.
        F: Constant disturbance over the thrust.
        eps: Bound of what else disturbs over the thrust.
        command_time: Time for which a pulse is commanded at least, s.
        period: Sampling period, s.
        on_delay: Delay of switching on, s.
        off_delay: Delay of switching off, s.
        sensors: Names of angle and rate, rad and rad/s.
        thrusters: Name of the one channel.
        charts: The figures of the paper for this law.
    """

    relay: Relay
    scale: Scale
    level: float
    F: float
    eps: float
    command_time: float
    period: float
    on_delay: float = 0.0
    off_delay: float = 0.0
    sensors: tuple[str, ...] = ("attitude_z", "rate_z")
    thrusters: tuple[str, ...] = ("thruster_z",)
    charts: Charts = field(default=(), compare=False)

    def init(self) -> Memory:
        """Returns the memory of a thruster that is off."""
        return Memory(0, -math.inf, 0, ())

    def step(
        self, t: float, y: Sequence[float], memory: Memory
    ) -> tuple[tuple[float, ...], Memory]:
        """Returns the thrust and the new memory.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            memory: What the last step returned.
        """
        n, since, acting, pending = memory
        while pending and pending[0][0] <= t:
            acting, pending = pending[0][1], pending[1:]
        slack = _ROUNDING * self.period
        if n == 0 or t - since >= self.command_time - slack:
            n = self._decision(t, y, n, acting, pending)
        if n != memory.level:
            since, effect = t, t + (self.on_delay if n else self.off_delay)
            pending = (*(p for p in pending if p[0] < effect), (effect, n))
        memory = Memory(n, since, acting, pending)
        return (n * self.scale.sign * self.level,), memory

    def events(self, t: float, y: Sequence[float], memory: Memory) -> tuple[float, ...]:
        """Returns none: decisions fall on samples.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            memory: What the last step returned.
        """
        return ()

    def _decision(
        self,
        t: float,
        y: Sequence[float],
        n: int,
        acting: int,
        pending: tuple[tuple[float, int], ...],
    ) -> int:
        """The level that some eps would make late a sample from now; n if none."""
        end = t + self.period + (self.off_delay if n else self.on_delay)
        state = self.scale.reduced(y[0], y[1])
        for eps in (self.eps, -self.eps):
            level, (x, v), now = acting, state, t
            for time, following in (*pending, (math.inf, 0)):
                tau = (min(time, end) - now) / self.scale.time
                a = level + self.F + eps
                x, v = x + tau * (v + tau * a / 2), v + tau * a
                if time >= end:
                    break
                level, now = following, time
            new = self.relay.command(n, x, v)
            if new != n:
                return new
        return n
