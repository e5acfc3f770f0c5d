"""How much delay, and how long a sampling period, a smooth law bears near an equilibrium.

Plant and law are linear here: x' = A x + B u, y = C x, and u = Cy y + Cw w with the filtered rates
w' = -K w + Z y'.  The law's matrices are found by differencing its formula, whatever law it is.

- Delay margin, continuous time: with L(s) = law times plant a delay tau on all inputs puts a
  characteristic root on the imaginary axis where an eigenvalue mu of L(j w) is e^{j w tau}.  The
  frequencies of |mu| = 1 are swept for and then located; tau = arg mu/w, the least of them.
- Longest period: the loop sampled with T, torques held, is a matrix; T is raised until its spectral
  radius passes 1.  Stability may come back for longer periods; the first loss is what counts.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from spacecraft_sim.checks import choices, positive
from spacecraft_sim.dynamics import LinearPlant, jacobian
from spacecraft_sim.filtered_law import Filter, FilteredLaw

Array = np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Loop:
    """A linear plant under a linear law.

    Attributes:
        A: Plant, shape (n, n).
        B: Inputs that the law drives, shape (n, nu).
        C: Readings of the law, shape (ny, n).
        direct: Cy, torque at unit reading, shape (nu, ny).
        damping: Cw, torque at unit filtered rate, shape (nu, nz).
        filtered: Z, what is filtered at unit reading, shape (nz, ny).
        filter: The filter, of nz channels.
    """

    A: Array
    B: Array
    C: Array
    direct: Array
    damping: Array
    filtered: Array
    filter: Filter

    def matrix(self) -> Array:
        """Returns the state matrix of the continuous-time loop, of (x, zh), 1/s."""
        Z, K = self.filtered @ self.C, np.diag(self.filter.cutoffs)
        u = self.direct @ self.C + self.damping @ Z  # w = Z y - zh
        return np.block([[self.A + self.B @ u, -self.B @ self.damping], [K @ Z, -K]])

    def eigenvalues(self) -> Array:
        """Returns the eigenvalues of the continuous-time loop, slowest last, 1/s."""
        values = np.linalg.eigvals(self.matrix())
        return values[np.lexsort((values.imag, values.real))]

    def gain(self, s: Array) -> Array:
        """Returns L(s), law times plant, shape (k, nu, nu).

        Args:
            s: Complex frequencies, shape (k,), 1/s.
        """
        s = np.asarray(s)
        plant = self.C @ np.linalg.solve(s[:, None, None] * np.eye(len(self.A)) - self.A, self.B)
        washout = s[:, None] / (s[:, None] + np.array(self.filter.cutoffs))
        return (self.direct + (self.damping * washout[:, None, :]) @ self.filtered) @ plant

    def sampled_matrix(self, period: float | Array, *, late: int = 0) -> Array:
        """Returns the matrix that takes the sampled loop from one sample to the next.

        Args:
            period: T, or several of them, s.
            late: Samples by which the torques come late.

        Returns:
            The matrix, over plant, filter and the torques under way, shape (..., m, m).
        """
        from scipy.linalg import expm

        T = np.asarray(period, dtype=float)
        n, nu = self.B.shape
        plant = np.zeros((n + nu, n + nu))
        plant[:n] = np.hstack([self.A, self.B])
        both = expm(T[..., None, None] * plant)
        pairs = [self.filter.coefficients(x) for x in T.ravel().tolist()]
        a, b = (np.array([pair[k] for pair in pairs]).reshape(*T.shape, -1) for k in (0, 1))
        # With v = w - b z, memory of the filter: w = v + b z, v+ = a w - b z.
        Z, nz = self.filtered @ self.C, a.shape[-1]
        torques = self.direct @ self.C + (self.damping * b[..., None, :]) @ Z  # by x
        x, v, m = slice(0, n), slice(n, n + nz), n + nz + late * nu
        M = np.zeros((*T.shape, m, m))
        M[..., x, x] = both[..., :n, :n]
        M[..., v, x] = ((a - 1) * b)[..., None] * Z
        M[..., v, v] = a[..., None] * np.eye(nz)
        # The torques under way stand last, the next to act first.
        held = both[..., :n, n:]
        if late == 0:
            M[..., x, x] += held @ torques
            M[..., x, v] = held @ self.damping
        else:
            M[..., x, n + nz : n + nz + nu] = held
            M[..., m - nu :, x], M[..., m - nu :, v] = torques, self.damping
            M[..., n + nz : m - nu, n + nz + nu :] = np.eye((late - 1) * nu)
        return M

    def growth(self, period: float | Array, *, late: int = 0) -> Array:
        """Returns the growth rate of the sampled loop, negative if it is stable, 1/s.

        Args:
            period: T, or several of them, s.
            late: Samples by which the torques come late.
        """
        roots = np.linalg.eigvals(self.sampled_matrix(period, late=late))
        return np.log(np.max(np.abs(roots), axis=-1)) / period


def close(law: FilteredLaw, plant: LinearPlant, *, t: float = 0.0) -> Loop:
    """Linearises a law at the equilibrium of a linear plant and closes the loop.

    Args:
        law: The law.
        plant: The plant.
        t: Time at which a law that depends on it is taken, s.

    Raises:
        ValueError: If the plant lacks a reading or an input of the law.
    """
    rows = _places("sensor", law.sensors, plant.outputs)
    columns = _places("input", law.thrusters, plant.inputs)
    y0, still = plant.y0[rows], np.zeros(len(law.filter.cutoffs))
    return Loop(
        A=plant.A,
        B=plant.B[:, columns],
        C=plant.C[rows],
        direct=jacobian(lambda y: law.formula.command(t, y.tolist(), still.tolist()), y0),
        damping=jacobian(lambda w: law.formula.command(t, y0.tolist(), w.tolist()), still),
        filtered=jacobian(lambda y: law.formula.filtered(t, y.tolist()), y0),
        filter=law.filter,
    )


class DelayMargin(NamedTuple):
    """The least delay at which a loop is no longer stable.

    Attributes:
        delay: s; inf if the loop bears any.
        frequency: Of the oscillation that begins there, rad/s; nan if there is none.
    """

    delay: float
    frequency: float


def delay_margin(loop: Loop) -> DelayMargin:
    """Finds the least delay on all inputs that takes a root to the imaginary axis.

    Args:
        loop: A loop that is stable without delay.

    Raises:
        ValueError: If it is not.
    """
    _require_stable(loop)

    def sizes(w: Array) -> Array:  # of the eigenvalues of L(j w), the largest first, (k, nu)
        return -np.sort(-np.abs(np.linalg.eigvals(loop.gain(1j * w))), axis=-1)

    best = DelayMargin(math.inf, math.nan)
    for rank, w in _unit_crossings(sizes, _frequencies(loop, sizes)):
        mu = np.linalg.eigvals(loop.gain(1j * np.array([w])))[0]
        angle = float(np.angle(mu[np.argsort(-np.abs(mu))[rank]])) % (2 * math.pi)
        best = min(best, DelayMargin(angle / w, w))
    return best


def longest_period(loop: Loop, *, upper: float, late: int = 0) -> float:
    """Finds the sampling period at which the loop first loses its stability, s.

    Args:
        loop: A loop that is stable in continuous time.
        upper: Longest period looked at, s.
        late: Samples by which the torques come late.

    Returns:
        The period; inf if all up to `upper` are stable.

    Raises:
        ValueError: If the loop is not stable in continuous time.
    """
    from scipy.optimize import brentq

    positive(upper=upper)
    values = _require_stable(loop)

    def growth(T: float) -> float:
        return float(loop.growth(T, late=late))

    shortest = min(_FIRST / float(np.max(np.abs(values))), upper / 2)
    T = np.geomspace(shortest, upper, 1 + math.ceil(math.log(upper / shortest) / _RATIO))
    rates = np.empty(0)
    for start in range(0, len(T), _BATCH):
        rates = np.append(rates, loop.growth(T[start : start + _BATCH], late=late))
        if rates[0] > 0:
            raise ValueError(f"the sampled loop is not stable even at T = {shortest:.3g} s")
        for k in range(max(start, 1), len(rates)):
            unstable = float(T[k]) if rates[k] > 0 else math.inf
            if k > 1 and rates[k - 2] < rates[k - 1] > rates[k]:
                # The peak may be higher than the three periods show.
                peak = _extreme(growth, T[k - 2], T[k], highest=True)
                unstable = min(unstable, peak) if growth(peak) > 0 else unstable
            if unstable < math.inf:
                stable = T[k - 1] if unstable >= T[k] else T[k - 2]
                return float(brentq(growth, stable, unstable, rtol=1e-10))  # pyright: ignore
    return math.inf


def _require_stable(loop: Loop) -> Array:
    values = loop.eigenvalues()
    if (slowest := max(x.real for x in values.tolist())) >= 0:
        raise ValueError(
            f"the loop is not stable even without delay, in continuous time: it has an eigenvalue "
            f"of real part {slowest:.6g} 1/s"
        )
    return values


def _extreme(
    function: Callable[[float], float], low: float, high: float, *, highest: bool
) -> float:
    """Where a function that has one extreme between two points has it."""
    from scipy.optimize import fminbound

    sign = -1.0 if highest else 1.0
    return float(fminbound(lambda x: sign * function(x), low, high, xtol=1e-7 * high))  # pyright: ignore


_FIRST = 0.02  # first period looked at, over the fastest time constant
_BATCH = 100  # periods looked at together
_RATIO = 5e-3  # between neighbouring periods looked at: 0.25 ms at 50 ms; peaks are refined
_PER_DECADE = 300  # frequencies looked at, beside those near the poles


def _frequencies(loop: Loop, sizes: Callable[[Array], Array]) -> Array:
    """Where to look for unit gain: evenly on a logarithmic scale, and finely near every pole."""
    poles = np.concatenate(
        [loop.eigenvalues(), np.linalg.eigvals(loop.A), -np.array(loop.filter.cutoffs)]
    )
    poles = poles[np.abs(poles) > 1e-6]
    low, high = 1e-3 * np.min(np.abs(poles)), 10 * np.max(np.abs(poles))
    while sizes(np.array([high]))[0, 0] > 0.5:
        high *= 2
    even = np.geomspace(low, high, math.ceil(_PER_DECADE * math.log10(high / low)))
    swings = poles[poles.imag > 0]
    width = np.maximum(np.abs(swings.real), 1e-6 * swings.imag)
    near = swings.imag[:, None] + width[:, None] * np.sinh(np.linspace(-6, 6, 60))
    return np.unique(np.concatenate([even, near[(near > low) & (near < high)]]))


def _unit_crossings(sizes: Callable[[Array], Array], grid: Array) -> list[tuple[int, float]]:
    """(rank, frequency) where an eigenvalue of the gain, by rank of its size, has size 1."""
    from scipy.optimize import brentq

    found = []
    values = sizes(grid)
    for rank in range(values.shape[1]):

        def excess(w: float, rank: int = rank) -> float:
            return float(sizes(np.array([w]))[0, rank]) - 1

        points = [(float(w), float(v) - 1) for w, v in zip(grid, values[:, rank], strict=True)]
        extremes = []
        for (low, u), (_, v), (high, w) in zip(points, points[1:], points[2:], strict=False):
            # An extreme that falls short of 1 on the grid may pass it in between.
            if abs(v) < 0.5 and ((u < v > w and v < 0) or (u > v < w and v > 0)):
                x = _extreme(excess, low, high, highest=v < 0)
                extremes.append((x, excess(x)))
        points = sorted(points + extremes)
        for (a, u), (b, v) in pairwise(points):
            if (u < 0) != (v < 0):
                found.append((rank, float(brentq(excess, a, b, rtol=1e-13))))  # pyright: ignore
    return found


def _places(kind: str, names: Sequence[str], known: Sequence[str]) -> list[int]:
    for name in names:
        if name not in known:
            raise ValueError(choices(kind, name, known, where="the linear plant"))
    return [list(known).index(name) for name in names]
