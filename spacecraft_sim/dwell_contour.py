"""Contour that a two-level relay with a dwell does not leave: late switching, slip of the angle.

Plant: x' = v + s, |s| <= slip; v' = u + F + eps, |eps| <= e; u = -1 or +1, in units of the torque's
acceleration u0, the dwell and u0 dwell^2.  The law asks for -1 on x = p - v^2/(2 b), v > 0, with
b = 1 - F - e, and for +1 on x = -p + v^2/(2 (1 + F - e)), v < 0; the thrust follows within the time
`late`, which a sampling period and a delay add up to.  Slip is what the angle does beside following
the rate: kinematics of three axes, errors of an observer.

From an arc point (x, v) late switching and the slowest braking lead no further than
x + (v + slip) late + a late^2/2 + (v + slip + a late)^2/(2 b) with a = 1 + F + e.  The arc point
with the most rate is reached from the left end of the contour, the one with the least from where
the state turned soonest.  x and v order trajectories under the same input: the next switching comes
soonest after the fastest braking with all slip, and its time is concave along the arc, so it is
least at an end of it.  p is the least for which that time is the dwell.

Without slip and lateness this is `dwell_accuracy`; both added here, after Ivanova & Sokolov (1999),
Lemma 3.3.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

from spacecraft_sim.checks import positive
from spacecraft_sim.dwell_accuracy import guaranteed_accuracy

_STEPS = 60
_TURNS = 200  # round the contour until its ends have settled
_SETTLED = 1e-13
_WIDEST = 1e4  # p over that without slip and lateness


class Rates(NamedTuple):
    """Slowest and fastest acceleration under the relay's present sign and under the other one."""

    push: float  # v' under u = +1, eps = -e
    push_fast: float
    brake: float  # -v' under u = -1, eps = +e
    brake_fast: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Half:
    """The half of a contour in which the relay turns from +1 to -1, or, mirrored, back.

    Attributes:
        brake: Slowest braking after the switching, 1 - F - e.
        end: Largest x, or -x.
        slowest: Least rate at the arc.
        fastest: Largest rate, reached when the thrust turns at last.
    """

    brake: float
    end: float
    slowest: float
    fastest: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Contour:
    """A contour that is not left.

    Attributes:
        half_width: p, where the arcs meet v = 0.
        slip: Bound of x' - v.
        upper: The half of the switching to -1, x and v as they are.
        lower: The half of the switching to +1, x and v mirrored.
    """

    half_width: float
    slip: float
    upper: Half
    lower: Half

    @property
    def accuracy(self) -> float:
        """The largest |x|."""
        return max(self.upper.end, self.lower.end)

    @property
    def fastest(self) -> float:
        """The largest |v|."""
        return max(self.upper.fastest, self.lower.fastest)

    def enters(self, x: float, v: float, level: int, *, slack: float = 0.0) -> bool:
        """Returns whether a switching in (x, v) starts a motion that stays inside for good.

        Args:
            x: Position when the thrust turns.
            v: Rate then.
            level: The new sign of the thrust.
            slack: Share of the half-width and of the rate by which it may be missed.
        """
        half, x, v = (self.upper, x, v) if level < 0 else (self.lower, -x, -v)
        room, play = slack * self.half_width, slack * half.fastest
        on_arc = x + v * v / (2 * half.brake) >= self.half_width - room
        stays = x + (v + self.slip) ** 2 / (2 * half.brake) <= half.end + room
        return on_arc and stays and half.slowest - play <= v <= half.fastest + play


def contour(bias: float, disturbance: float, *, slip: float = 0.0, late: float = 0.0) -> Contour:
    """Returns the narrowest contour.

    Args:
        bias: F, the constant disturbance over the thrust.
        disturbance: e, the bound of what else disturbs over the thrust, >= 0.
        slip: Bound of x' - v over u0 dwell.
        late: Longest time from the arc to the switching, over the dwell.

    Raises:
        ValueError: If |F| + e >= 1, or slip or lateness are too much for any contour.
    """
    p = least = guaranteed_accuracy(bias, disturbance)
    positive(slip=slip, late=late, zero=True)
    low, high, best = 0.0, _WIDEST * least, None
    for _ in range(_STEPS):
        found = _closed(p, bias, disturbance, slip, late)
        time = found[1] if found else 0.0
        if found and time > 1 - _SETTLED:
            high, best = p, found[0]
            if time < 1 + _SETTLED or p == least:
                break
        else:
            low = p
        if high <= low * (1 + _SETTLED):  # narrower ones are open
            break
        guess = max(p / time**2, least) if found else 2 * p  # times grow nearly as sqrt(p)
        p = guess if low < guess < high else math.sqrt(low * high) if low else least
    if best:
        return best
    raise ValueError(
        f"no contour at F = {bias:.6g}, e = {disturbance:.6g} with a slip of {slip:.4g} and a "
        f"lateness of {late:.4g} of the dwell: sample more often, or slow down the axes"
    )


def _closed(p: float, F: float, e: float, slip: float, late: float) -> tuple[Contour, float] | None:
    """The contour between arcs at p and the least time between switchings; None if it is open."""
    up = Rates(1 + F - e, 1 + F + e, 1 - F - e, 1 - F + e)
    down = Rates(1 - F - e, 1 - F + e, 1 + F - e, 1 + F + e)
    right = left = p
    for _ in range(_TURNS):
        before = right, left
        v_top, w_top = _top(p, left, up, slip), _top(p, right, down, slip)
        right, left = _end(p, v_top, up, slip, late), _end(p, w_top, down, slip, late)
        if max(right - before[0], left - before[1]) <= _SETTLED * p:
            break
    else:
        return None
    halves, least = [], math.inf
    for rates, top, other in ((up, v_top, w_top), (down, w_top, v_top)):
        low = _bottom(p, other, rates, slip)
        high = top + rates.push_fast * late
        times = [_passage(p, v, rates, slip) for v in (low, high)]
        if not all(x >= 0 for x in (low - slip, *times)):  # nan too: there is no such arc point
            return None
        least = min(least, *times)
        end = _end(p, top, rates, slip, late)
        halves.append(Half(brake=rates.brake, end=end, slowest=low, fastest=high))
    return Contour(half_width=p, slip=slip, upper=halves[0], lower=halves[1]), least


def _top(p: float, left: float, r: Rates, slip: float) -> float:
    """Largest rate at the arc: from x = -left, v = slip, with the fastest push, slip holding back.

    With y = v - slip: -left + y^2/(2 a) = p - (y + slip)^2/(2 b).
    """
    y = _root((1 / r.push_fast + 1 / r.brake) / 2, slip / r.brake,
              slip**2 / (2 * r.brake) - p - left)  # fmt: skip
    return y + slip


def _end(p: float, v: float, r: Rates, slip: float, late: float) -> float:
    """Farthest point after the arc point of rate v."""
    gain = slip + r.push_fast * late
    creep = (v + slip) * late + r.push_fast * late**2 / 2
    return p + creep + (2 * v * gain + gain**2) / (2 * r.brake)


def _bottom(p: float, w: float, r: Rates, slip: float) -> float:
    """Least rate at the arc: after the other arc's fastest point, turned soonest, pushed slowly.

    With z = v + slip from the turn: x_turn + z^2/(2 c) = p - (z - slip)^2/(2 b).
    """
    turn = -p + w**2 / (2 * r.push) - max(w - slip, 0.0) ** 2 / (2 * r.push_fast)
    z = _root((1 / r.push + 1 / r.brake) / 2, -slip / r.brake,
              slip**2 / (2 * r.brake) + turn - p)  # fmt: skip
    return z - slip


def _passage(p: float, v: float, r: Rates, slip: float) -> float:
    """Least time from the arc point of rate v to the other arc, reached at the rate -s."""
    room = 2 * p - v * v / (2 * r.brake) + v * v / (2 * r.brake_fast) - slip * v / r.brake_fast
    if not room > 0:  # it starts there
        return math.nan
    s = _root((1 / r.brake_fast + 1 / r.push) / 2, slip / r.brake_fast, -room)
    return (s + v) / r.brake_fast


def _root(a: float, b: float, c: float) -> float:
    """The larger root of a x^2 + b x + c, a > 0; nan if there is none."""
    square = b * b - 4 * a * c
    return (-b + math.sqrt(square)) / (2 * a) if square >= 0 else math.nan
