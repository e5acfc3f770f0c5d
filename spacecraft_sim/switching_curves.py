"""Relay laws of the phase plane whose switching curves are parabolas in the rate.

A relay has a curve on the left, x = L(v), and one on the right, x = R(v).  Beyond the left one it
commands its left level, beyond the right one its right level, and between them what it commanded
last.  Regions may override that.  A tolerance is the business of whoever makes the curves: moved
by some roundings they decide on the safe side.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple


class Piece(NamedTuple):
    """x = x0 + q (v - w)^2 for low <= v <= high."""

    low: float
    high: float
    x0: float
    w: float
    q: float


Curve = tuple[Piece, ...]  # continuous, from v = -inf to inf, ascending


def curve(*parts: tuple[float, float, float, float]) -> Curve:
    """Joins parabolas into a curve that covers all rates.

    Args:
        *parts: (low, x0, w, q) of each, ascending: x = x0 + q (v - w)^2 from v = low on.  The first
            low must be -inf.

    Raises:
        ValueError: If the parts are not in order or do not begin at -inf.
    """
    lows = [part[0] for part in parts]
    if not lows or lows[0] != -math.inf or lows != sorted(lows):
        raise ValueError(f"the parts of a curve must ascend from v = -inf, got {lows}")
    highs = [*lows[1:], math.inf]
    return tuple(
        Piece(low, high, x0, w, q)
        for (low, x0, w, q), high in zip(parts, highs, strict=True)
        if high > low
    )


def position(line: Curve, v: float) -> float:
    """Returns x of a curve.

    Args:
        line: The curve.
        v: Rate.
    """
    for _, high, x0, w, q in line:
        if v <= high:
            return x0 + q * (v - w) * (v - w)
    raise ValueError(f"a curve has no position at v = {v}")


class Region(NamedTuple):
    """A closed region lower(v) <= x <= upper(v), low <= v <= high, with a law of its own.

    `level` is commanded there; None stands for what was commanded last.
    """

    low: float
    high: float
    lower: Curve
    upper: Curve
    level: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Relay:
    """A relay law of the phase plane; levels are -1, 0, +1.

    Attributes:
        left: L, at which `left_level` is commanded.
        right: R, at which -1 is commanded.
        left_level: 0 or +1.
        guarded: Whether 0 is kept while v < 0, and -1 while v > 0.
        regions: What overrides the curves.
    """

    left: Curve
    right: Curve
    left_level: int
    guarded: bool = False
    regions: tuple[Region, ...] = ()

    def to_right_level(self, level: int, x: float, v: float) -> float:
        """Returns how far the state is from where -1 replaces a level; <= 0 where it does.

        Args:
            level: Level commanded last, 0 or +1.
            x: Position.
            v: Rate.
        """
        distance = position(self.right, v) - x
        if self.guarded and level == 0 and -v > distance:
            distance = -v
        return self._overridden(distance, -1, x, v) if self.regions else distance

    def to_left_level(self, level: int, x: float, v: float) -> float:
        """Returns how far the state is from where the left level replaces a level; <= 0 where.

        Args:
            level: Level commanded last, not the left one.
            x: Position.
            v: Rate.
        """
        distance = x - position(self.left, v)
        if self.guarded and level == -1 and v > distance:
            distance = v
        return self._overridden(distance, self.left_level, x, v) if self.regions else distance

    def _overridden(self, distance: float, target: int, x: float, v: float) -> float:
        """The distance to where a level is commanded, what the regions add and take included."""
        for region in self.regions:
            inside = _depth(region, x, v)
            distance = min(distance, -inside) if region.level == target else max(distance, inside)
        return distance

    def command(self, level: int, x: float, v: float) -> int:
        """Returns the level commanded at a state; where both curves meet, by the sign of v.

        Args:
            level: Level commanded last.
            x: Position.
            v: Rate.
        """
        right = level != -1 and self.to_right_level(level, x, v) <= 0
        left = level != self.left_level and self.to_left_level(level, x, v) <= 0
        if right and (v >= 0 or not left):
            return -1
        return self.left_level if left else level

    def distances(self, level: int, x: float, v: float) -> tuple[float, ...]:
        """Returns what is positive while a level stands, in units of x or v.

        Args:
            level: Level commanded last.
            x: Position.
            v: Rate.
        """
        if level == -1:
            return (self.to_left_level(level, x, v),)
        if level == self.left_level:
            return (self.to_right_level(level, x, v),)
        return self.to_right_level(level, x, v), self.to_left_level(level, x, v)

    def lines(self, level: int) -> tuple[tuple[Piece, ...], tuple[float, ...]]:
        """Returns all parabolas and all rates at which the command after a level may change.

        Args:
            level: Level commanded last.
        """
        pieces: list[Piece] = []
        if level != -1:
            pieces += self.right
        if level != self.left_level:
            pieces += self.left
        rates = [0.0] if self.guarded else []
        for region in self.regions:
            for piece in (*region.lower, *region.upper):
                low, high = max(piece.low, region.low), min(piece.high, region.high)
                if low < high:
                    pieces.append(piece._replace(low=low, high=high))
            rates += [region.low, region.high]
        return tuple(pieces), tuple(rates)


def _depth(region: Region, x: float, v: float) -> float:
    """How deep inside a region a state is; negative outside."""
    in_v = min(v - region.low, region.high - v)
    return min(in_v, x - position(region.lower, v), position(region.upper, v) - x)
