"""A coordinate between two events, in closed form, and the first instant at which it leaves a cell.

With bounds m <= x'' <= M on an interval, x(t + d) >= x + x' d + m d^2/2: x cannot fall to a bound
before that parabola does.  Marching from one such instant to the next finds the *first* exit and
misses none; near it each step doubles the digits.
"""

import cmath
import math

Wave = tuple[complex, complex]  # (exponent mu, amplitude a): the term 2 Re a e^(mu tau)


class Curve:
    """x(tau) = a0 + a1 tau + a2 tau^2 + 2 Re sum a e^(mu tau), Re mu <= 0.

    Args:
        a0: Constant coefficient.
        a1: Linear coefficient, per s.
        a2: Quadratic coefficient, per s^2.
        waves: Pairs (mu, a): exponent, 1/s, and amplitude.
    """

    __slots__ = ("a0", "a1", "a2", "ripple", "waves")

    def __init__(self, a0: float, a1: float, a2: float, waves: list[Wave]):
        self.a0, self.a1, self.a2, self.waves = a0, a1, a2, waves
        self.ripple = sum(2 * abs(a) * abs(mu) ** 2 for mu, a in waves)  # |x'' - 2 a2| <= this

    def __call__(self, tau: float) -> tuple[float, float]:
        """Value and rate."""
        value, rate = self.a0 + tau * (self.a1 + tau * self.a2), self.a1 + 2 * tau * self.a2
        for mu, a in self.waves:
            w = a * cmath.exp(mu * tau)
            value += 2 * w.real
            rate += 2 * (mu * w).real
        return value, rate

    def derivative(self) -> "Curve":
        """Its rate as a curve."""
        return Curve(self.a1, 2 * self.a2, 0.0, [(mu, mu * a) for mu, a in self.waves])

    def first_exit(self, tau: float, end: float, low: float, high: float) -> float | None:
        """Returns the first instant in (tau, end] at which the value leaves (low, high), or None.

        Args:
            tau: Start of the search, s.
            end: End of the search, s.
            low: Lower bound of the cell; -inf for none.
            high: Upper bound of the cell; inf for none.
        """
        down, up = 2 * self.a2 - self.ripple, 2 * self.a2 + self.ripple
        exact = self.ripple == 0
        while True:
            x, v = self(tau)
            step = gap = math.inf
            if low > -math.inf:
                gap = x - low
                step = _reach(gap, v, down)
            if high < math.inf:
                other = _reach(high - x, -v, -up)
                if other < step:  # from here on (gap, v) speak of the bound that comes first
                    step, gap, v = other, high - x, -v
            if tau + step > end:
                return None
            if exact or step <= 1e-16 * (1 + tau):
                return tau + step
            # Near the exit Newton's step and the bound enclose it.
            if v < 0 and abs(gap / v + step) <= 1e-16 * (1 + tau):
                return tau - gap / v
            tau += step


def _reach(gap: float, v: float, curvature: float) -> float:
    """Smallest d >= 0 from which gap + v d + curvature d^2/2 is below zero; inf if there is none.

    Just after an exit the gap to the bound that was crossed is zero to rounding, of either sign;
    what counts then is when the curve comes back, so each case takes a form that does not cancel.
    """
    square = v * v - 2 * curvature * gap
    if v > 0 or (gap <= 0 and v == 0):
        if curvature >= 0:
            return math.inf
        return (v + math.sqrt(square)) / -curvature if square > 0 else 0.0
    if gap <= 0:
        return 0.0
    if square < 0 or v == square == 0:
        return math.inf
    return 2 * gap / (math.sqrt(square) - v)
