"""From an elastic structure to a guaranteed pointing accuracy, axis by axis.

The elastic parts disturb an axis by less than M_e, which over the thrust M0 is the e of a regulator
for a double integrator, u0 = M0/J: such a regulator keeps |theta| <= p0(F, e) u0 dwell^2 with
F = M1/M0 the constant disturbance.  That says nothing where F + e >= 1; feedback of the quasi-rigid
angle theta + H q/J always says something: the elastic moment falls out of its equation, and
|theta| <= p0(F, 0) u0 dwell^2 + sup |H q|/J.

Source: Sokolov (2004), (26), (27); Ivanova & Sokolov (1999) for regulators with an off state;
Efremov, Polyakov & Strygin (2006), (1.6), for the quasi-rigid angle.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from spacecraft_sim import dwell_accuracy
from spacecraft_sim.checks import positive
from spacecraft_sim.elastic_influence import Influence, influence, least_dwell
from spacecraft_sim.elastic_modes import ElasticModel
from spacecraft_sim.guarantee import Assumption
from spacecraft_sim.relay_channels import AXES, per_channel

Array = np.ndarray
Accuracy = Callable[[float, float], float]  # p0 of (F, e); raises ValueError where there is none

TWO_LEVEL = "two levels"
SMALL_ANGLE = 0.15  # rad; measured over bound passes 1 at 0.19 rad on the shipped machines
_SLOW = (
    0.01  # what is left out grows with the rate: at this one the bound is passed by 4 % at worst
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Remedy:
    """What would make a vacuous guarantee say something, the rest unchanged.

    Attributes:
        dwell: The least dwell, s; inf if none is long enough.
        damping: The least factor on the damping of all elastic parts; inf if none is enough.
        fraction: The largest share of the inertia that may move elastically, by one mode.
    """

    dwell: float
    damping: float
    fraction: float


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisCertificate:
    """What is guaranteed about one axis.

    Attributes:
        axis: x, y or z.
        torque: M0, N m.
        dwell: Least time between switchings, s.
        bias: F = M1/M0.
        inertia: J, kg m^2.
        moment: M_e by the printed bound, N m; inf if it is refused.
        moment_l1: M_e for any switching, N m.
        disturbance: e, the smaller of both over M0.
        accuracy: What each regulator guarantees by its name, rad; inf where it says nothing.
        quasi_rigid: What feedback of the quasi-rigid angle guarantees, rad.
        sampling: What sampled switching adds, u0 dwell h, rad.
        inertia_fraction: mu, the share of the inertia that moves elastically.
        decay: Of the mode that disturbs the axis most, 1/s.
        remedy: What would help; None where the bound of attitude feedback is finite.
        assumptions: What all this rests on, with values.
    """

    axis: str
    torque: float
    dwell: float
    bias: float
    inertia: float
    moment: float
    moment_l1: float
    disturbance: float
    accuracy: dict[str, float]
    quasi_rigid: float
    sampling: float
    inertia_fraction: float
    decay: float
    remedy: Remedy | None
    assumptions: tuple[Assumption, ...]

    @property
    def best(self) -> float:
        """The best that feedback of the attitude guarantees, rad; inf if nothing."""
        return min(self.accuracy.values())

    @property
    def why(self) -> str:
        """Why attitude feedback guarantees nothing, or as much as it does, in one line."""
        mu, swing = self.inertia_fraction, 2 * self.inertia_fraction / (1 - self.inertia_fraction)
        lost = -math.expm1(-self.decay * self.dwell)
        return (
            f"one mode: 2 mu/(1 - mu) = {swing:.4g} {'<' if swing < lost else '>='} "
            f"1 - exp(-sigma dwell) = {lost:.4g} with mu = {mu:.4g}, sigma = {self.decay:.4g} 1/s"
        )


def certify(
    elastic: ElasticModel,
    *,
    torque: float | Array | list[float],
    dwell: float | Array | list[float],
    disturbance: float | Array | list[float] = 0.0,
    timestep: float = 0.0,
    regulators: Mapping[str, Accuracy] | None = None,
) -> tuple[AxisCertificate, ...]:
    """Certifies the pointing accuracy about each axis.

    Args:
        elastic: The structure.
        torque: M0 of each channel or of all, N m.
        dwell: Least time between switchings of each channel or of all, s.
        disturbance: M1, constant torque on the bus about each axis or all, of either sign, N m.
        timestep: Sampling period of the regulator, s; 0 for continuous time.
        regulators: p0(F, e) by name beside the two-level relay.

    Returns:
        One certificate an axis.

    Raises:
        ValueError: If a number is out of range, or |M1| >= M0.
    """
    M0, hold = per_channel("torque", torque), per_channel("dwell", dwell)
    positive(timestep=timestep, zero=True)
    M1 = np.broadcast_to(np.asarray(disturbance, dtype=float), (3,))
    for name, thrust, steady in zip(AXES, M0, M1, strict=True):
        if not abs(steady) < thrust:
            raise ValueError(
                f"the constant disturbance about {name}, {steady:.6g} N m, must be below the "
                f"torque, {thrust:.6g} N m: no regulator holds the axis"
            )
    found = influence(elastic, torque=M0, dwell=hold)
    rules = {TWO_LEVEL: dwell_accuracy.guaranteed_accuracy, **(regulators or {})}
    return tuple(_certified(elastic, found, k, float(M1[k]), timestep, rules) for k in range(3))


def _certified(
    elastic: ElasticModel,
    found: Influence,
    k: int,
    steady: float,
    timestep: float,
    rules: Mapping[str, Accuracy],
) -> AxisCertificate:
    M0, dwell, J = float(found.torque[k]), float(found.dwell[k]), float(elastic.J[k, k])
    F, e = steady / M0, float(found.bound[k]) / M0
    length = M0 / J * dwell**2
    accuracy = {name: length * _or_inf(rule, abs(F), e) for name, rule in rules.items()}
    row = elastic.H[k] / J
    swing = min(found.deflection(row), found.deflection_l1(row))
    mu = float(elastic.inertia_fraction[k])
    decay = _decay(elastic, found, k)
    vacuous = math.isinf(min(accuracy.values()))
    return AxisCertificate(
        axis=AXES[k],
        torque=M0,
        dwell=dwell,
        bias=F,
        inertia=J,
        moment=float(found.moment[k]),
        moment_l1=float(found.moment_l1[k]),
        disturbance=e,
        accuracy=accuracy,
        quasi_rigid=length * dwell_accuracy.guaranteed_accuracy(F, 0.0) + swing,
        sampling=M0 / J * dwell * timestep,
        inertia_fraction=mu,
        decay=decay,
        remedy=_remedy(elastic, found, k, F, mu, decay) if vacuous else None,
        assumptions=_assumptions(elastic, found, k, timestep),
    )


def _or_inf(rule: Accuracy, F: float, e: float) -> float:
    try:
        return rule(F, e)
    except ValueError:  # it guarantees nothing there
        return math.inf


def _decay(elastic: ElasticModel, found: Influence, k: int) -> float:
    """Decay of the mode with the largest part in the moment about the axis."""
    part = np.abs(found.modes.accelerations(elastic.H[k])[:, 0]) @ found.torque
    return float(-found.modes.eigenvalues[int(np.argmax(part))].real)


def _remedy(
    elastic: ElasticModel, found: Influence, k: int, F: float, mu: float, decay: float
) -> Remedy:
    limit = float(found.torque[k]) * (1 - abs(F))

    def moment(factor: float) -> float:
        damped = replace(elastic, B=factor * elastic.B)
        return float(influence(damped, torque=found.torque, dwell=found.dwell).bound[k])

    return Remedy(
        dwell=least_dwell(elastic, torque=found.torque, axis=k, limit=limit),
        damping=_least_factor(moment, limit),
        fraction=dwell_accuracy.one_mode_largest_fraction(
            decay=decay, dwell=float(found.dwell[k]), bias=F
        ),
    )


def _least_factor(moment: Callable[[float], float], limit: float, highest: float = 1e4) -> float:
    """The least factor above 1 with a moment below the limit, to 1 %; inf beyond `highest`."""
    high = 2.0
    while moment(high) >= limit:
        high *= 2
        if high > highest:
            return math.inf
    low = high / 2
    while high > low * 1.01:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if moment(middle) < limit else (middle, high)
    return high


def _assumptions(
    elastic: ElasticModel, found: Influence, k: int, timestep: float
) -> tuple[Assumption, ...]:
    """Small motion, slow rotation and sampling, as far as the design can tell."""
    n = len(elastic.D)
    travel = np.full(n, np.inf) if elastic.travel is None else elastic.travel
    largest = [min(found.deflection(row), found.deflection_l1(row)) for row in np.eye(n)]
    worst = int(np.argmax(largest))
    tight = int(np.argmin(travel - largest))
    # A limit cycle turns at u0 dwell/2 at most, a bias may double that.
    J = np.diag(elastic.J)
    rate = found.torque * found.dwell / J
    a, b = (i for i in range(3) if i != k)
    gyroscopic = abs(J[a] - J[b]) * rate[a] * rate[b] / float(found.torque[k])
    slowest = float(np.min(np.abs(found.eigenvalues)))
    listed = [
        Assumption(
            text=f"small motion: deflection of {elastic.coordinates[worst]}",
            value=largest[worst], limit=SMALL_ANGLE, unit="rad",
        ),
        Assumption(text="slow rotation: gyroscopic torque over M0", value=gyroscopic, limit=_SLOW),
        Assumption(
            text="slow rotation: rate over the slowest elastic frequency",
            value=float(rate.max()) / slowest, limit=_SLOW,
        ),
    ]  # fmt: skip
    if math.isfinite(travel[tight]):
        name = elastic.coordinates[tight]
        text = f"{name} stays off its stop"
        listed.append(
            Assumption(text=text, value=largest[tight], limit=float(travel[tight]), unit="rad")
        )
    if timestep:
        listed.append(
            Assumption(
                text="sampling period within the dwell", value=timestep,
                limit=float(found.dwell[k]), relation="<=", unit="s",
            )
        )  # fmt: skip
    return tuple(listed)
