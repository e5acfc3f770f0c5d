"""What the laws of Burkov (1998) would draw: V and its terms, estimated rates, body vectors."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, Protocol

import numpy as np

from controllers.burkov_laws import BodyVectors, BodyVectorsAndRates, Path
from controllers.burkov_lyapunov import basin
from controllers.gains import Numbers
from controllers.velocity_filter import Memory, SampledLaw, VelocityFilter
from spacecraft_sim.chart import Arrow, Charts, Curve, History, Measured, Sphere
from spacecraft_sim.trajectory import Trajectory, sample_rows

Array = np.ndarray
Vector = Sequence[float] | Array
Terms = Callable[[Vector, Vector, Vector], dict[str, float]]  # of readings, w and what else moves
Values = Callable[[float, Sequence[float], Any, Sequence[float]], Sequence[float]]
_DECADES = 12  # that V is followed down
_RAYS = 181  # along which the border of a basin is looked for
_JOINT_RATES = "Joint rates: true (wide), estimated (thin)"


class Remembering(Protocol):
    """A sampled law whose memory can be followed without its torques."""

    @property
    def sensors(self) -> tuple[str, ...]:
        """What it reads."""
        ...

    @property
    def filter(self) -> VelocityFilter:
        """Its filter."""
        ...

    @property
    def period(self) -> float:
        """Sampling period, s."""
        ...

    def after(self, t: float, y: Sequence[float], memory: Any) -> Any:
        """Returns the memory after a sample.

        Args:
            t: Time, s.
            y: Readings.
            memory: The memory before.
        """
        ...


@dataclass(frozen=True, slots=True, kw_only=True)
class AtSamples:
    """Computes a history at the samples of a law, whose memory it follows from the readings.

    Attributes:
        law: The law.
        moving: Names of further readings.
        values: Takes time, readings, memory and further readings to the curves.
    """

    law: Remembering
    moving: tuple[str, ...]
    values: Values

    def __call__(self, part: Trajectory, wanted: Array, memory: Any) -> Measured:
        """Returns the curves at the wanted samples.

        Args:
            part: The next rows of the flight.
            wanted: Whether a row is wanted, shape (n,).
            memory: Number of the last sample and the law's memory after it; None at the start.

        Raises:
            ValueError: If the flight has no row at some sample.
        """
        at, numbers = sample_rows(part.time, self.law.period)
        last, state = memory or (-1, None)
        missing = np.flatnonzero(np.diff(np.r_[last, numbers]) != 1)
        if len(missing):
            due = (int(np.r_[last, numbers][missing[0]]) + 1) * self.law.period
            raise ValueError(
                f"the flight has no row at the sample of its law at {due:.6g} s: record them all"
            )
        columns = [
            np.array([part[name][at] for name in names]).reshape(len(names), len(at)).T.tolist()
            for names in (self.law.sensors, self.moving)
        ]
        rows, found = [], []
        for row, t, y, z in zip(at.tolist(), part.time[at].tolist(), *columns, strict=True):
            state = self.law.after(t, y, state)
            if wanted[row]:
                rows.append(row)
                found.append(self.values(t, y, state, z))
        after = int(numbers[-1]) if len(numbers) else last
        values = np.array(found, dtype=float) if found else np.zeros((0, 0))
        return Measured(np.array(rows, dtype=int), values, (after, state))


def mechanism_charts(
    law: SampledLaw, terms: Terms, moving: tuple[str, ...], rates: tuple[str, ...]
) -> Charts:
    """Returns the charts of a law that holds a position: V, and rates as its filter has them.

    Args:
        law: The law.
        terms: Takes readings, w and `moving` to the terms of V, J.
        moving: Names of the readings that V takes beside those of the law.
        rates: Names of the true rates of what the law reads.
    """
    values = partial(_joint_rates, law.filter.cutoffs)
    measure = AtSamples(law=law, moving=rates, values=values)
    return (
        _energy(law, terms, moving),
        _estimates("rates", _JOINT_RATES, "rad/s", law.sensors, "K w", measure),
    )


def path_charts(law: Remembering, formula: Path, *, replanned: bool) -> Charts:
    """Returns the charts of a law that follows a path: how far off, and rates by its filter.

    Args:
        law: The law.
        formula: The formula on the programme itself.
        replanned: Whether the memory of the law holds the formula of the moment.
    """
    rates = tuple(f"{name}_rate" for name in law.sensors)
    K = law.filter.cutoffs
    values = partial(_replanned_rates, K) if replanned else partial(_path_rates, K, formula)
    measure = AtSamples(law=law, moving=rates, values=values)
    joints = (Curve(name=_words(name), hue=k) for k, name in enumerate(law.sensors))
    away = History(
        name="distance",
        title="Distance from the path, of all joints and each",
        unit="rad",
        curves=(Curve(name="|q - q_p|"), *joints),
        signals=law.sensors,
        measure=AtSamples(law=law, moving=(), values=partial(_distances, formula)),
        decades=6,
    )
    return away, _estimates("rates", _JOINT_RATES, "rad/s", law.sensors, "by w", measure)


def body_charts(
    law: SampledLaw,
    formula: BodyVectors | BodyVectorsAndRates,
    terms: Terms,
    rates: tuple[str, ...],
) -> Charts:
    """Returns the charts of a law that turns two body vectors: V, estimated rates, the vectors.

    Args:
        law: The law.
        formula: Its formula.
        terms: Takes readings, w and the rates to the terms of V, J.
        rates: Names of the rates in principal axes.
    """
    estimates, arrows = [], []
    for i, name in enumerate(("s2", "s3")):
        first, second, third = (f"{name}_{axis}" for axis in "xyz")
        signals, (x, y, z) = (first, second, third), formula.r[i]
        arrows.append(
            Arrow(name=name, signals=signals, target=(x, y, z), basin=_border(formula, i))
        )
        values = partial(_vector_rates, law.filter.cutoffs, i)
        measure = AtSamples(law=law, moving=rates, values=values)
        title = f"Rate of {name}: true (wide), estimated (thin)"
        estimates.append(_estimates(f"{name}_rate", title, "1/s", signals, "D w", measure))
    sphere = Sphere(
        name="vectors",
        title="s2, s3 on the unit sphere",
        frame="principal axes of the body",
        arrows=tuple(arrows),
        bound="V can be below 2 min(k2, k3)",
    )
    filtered = estimates if isinstance(formula, BodyVectors) else ()
    return (_energy(law, terms, rates), *filtered, sphere)


def spin_charts(
    law: SampledLaw, terms: Terms, direction: tuple[str, str, str], rates: tuple[str, ...]
) -> Charts:
    """Returns the charts of a law that points the first principal axis: V, and its direction.

    Args:
        law: The law.
        terms: Takes readings, w, direction and rates to the terms of V, J.
        direction: Names of the components of s1.
        rates: Names of the rates in principal axes.
    """
    sphere = Sphere(
        name="direction",
        title="s1 on the unit sphere",
        frame="principal axes of the body",
        arrows=(Arrow(name="s1", signals=direction, target=(1.0, 0.0, 0.0)),),
    )
    return (_energy(law, terms, (*direction, *rates)), sphere)


def _energy(law: SampledLaw, terms: Terms, moving: tuple[str, ...]) -> History:
    """V, and what it is the sum of."""
    counts = len(law.sensors), len(law.filter.cutoffs), len(moving)
    names = list(terms(*(np.full(n, 0.5) for n in counts)))  # the values are of no interest
    return History(
        name="energy",
        title="V and its terms",
        unit="J",
        curves=(Curve(name="V"), *(Curve(name=n, hue=k) for k, n in enumerate(names))),
        signals=tuple(dict.fromkeys((*law.sensors, *moving))),
        measure=AtSamples(law=law, moving=moving, values=partial(_energies, terms)),
        decades=_DECADES,
    )


def _estimates(
    name: str, title: str, unit: str, read: tuple[str, ...], formula: str, measure: AtSamples
) -> History:
    """Pairs of curves: what a rate is, and what the filter makes of it."""
    curves = []
    for k, reading in enumerate(read):
        curves.append(Curve(name=f"{_words(reading)}: true", hue=k, beneath=True))
        curves.append(Curve(name=f"{_words(reading)}: {formula}", hue=k))
    signals = tuple(dict.fromkeys((*measure.law.sensors, *measure.moving)))
    return History(
        name=name, title=title, unit=unit, curves=tuple(curves), signals=signals, measure=measure
    )


def _energies(
    terms: Terms, t: float, y: Sequence[float], memory: Memory, z: Sequence[float]
) -> list[float]:
    found = list(terms(y, memory.w, z).values())
    return [sum(found), *found]


def _joint_rates(
    K: Numbers, t: float, y: Sequence[float], memory: Memory, v: Sequence[float]
) -> list[float]:
    """K w, (2.2), beside q'."""
    pairs = zip(v, K, memory.w, strict=True)
    return [x for true, cutoff, w in pairs for x in (true, cutoff * w)]


def _path_rates(
    K: Numbers, path: Path, t: float, y: Sequence[float], memory: Memory, v: Sequence[float]
) -> list[float]:
    """q_p' + K3 K4^-1 w, (3.2), beside q'."""
    parts = zip(v, path.programme(t).v, K, memory.w, path.scale, strict=True)
    return [x for true, v_p, cutoff, w, scale in parts for x in (true, v_p + cutoff * w / scale)]


def _replanned_rates(
    K: Numbers, t: float, y: Sequence[float], memory: Any, v: Sequence[float]
) -> list[float]:
    """The same on the path of the moment."""
    return _path_rates(K, memory.formula, t, y, memory.filter, v)


def _distances(
    path: Path, t: float, y: Sequence[float], memory: Any, z: Sequence[float]
) -> list[float]:
    """|q - q_p| and its parts."""
    parts = [abs(q - p) for q, p in zip(y, path.programme(t).q, strict=True)]
    return [float(np.linalg.norm(parts)), *parts]


def _vector_rates(
    D: Numbers, i: int, t: float, y: Sequence[float], memory: Memory, om: Sequence[float]
) -> list[float]:
    """D_i w_i, (5.9), beside s_i' = s_i x om, (5.2)."""
    part = slice(3 * i, 3 * i + 3)
    (x, y_, z), (p, q, r) = y[part], om
    true = (y_ * r - z * q, z * p - x * r, x * q - y_ * p)
    pairs = zip(true, D[part], memory.w[part], strict=True)
    return [x for rate, cutoff, w in pairs for x in (rate, cutoff * w)]


def _border(formula: BodyVectors | BodyVectorsAndRates, i: int) -> Array:
    """Outline of the s_i, about r_i, with which V can be below 2 min(k2, k3), shape (n, 3).

    V is least with the body at rest, w = 0 and the other vector as near to its own goal as the
    right angle to s_i lets it: V = k_i (1 - s_i r_i) + k_j (1 - sqrt(1 - (s_i r_j)^2)).
    """
    r, other = np.array(formula.r[i]), np.array(formula.r[1 - i])
    k, k_other = formula.k[i], formula.k[1 - i]
    side = np.linspace(0, 2 * np.pi, _RAYS)[:, None]
    way = np.cos(side) * other + np.sin(side) * np.cross(r, other)
    angle = np.linspace(0, np.pi, 721)[:, None, None]
    s = np.cos(angle) * r + np.sin(angle) * way
    V = k * (1 - s @ r) + k_other * (1 - np.sqrt(np.maximum(1 - (s @ other) ** 2, 0)))
    above = basin(formula) <= V
    first = np.where(above.any(axis=0), above.argmax(axis=0), len(angle) - 1)  # along each ray
    return s[first, np.arange(_RAYS)]


def _words(signal: str) -> str:
    return signal.replace("_", " ")
