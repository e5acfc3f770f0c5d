"""From an elastic structure to a guaranteed pointing accuracy, axis by axis.

The elastic parts disturb an axis by less than M_e, which over the thrust M0 is the e of a regulator
for a double integrator, u0 = M0/J: such a regulator keeps |theta| <= p0(F, e) u0 dwell^2 with
F = M1/M0 the constant disturbance.  That says nothing where F + e >= 1; feedback of the quasi-rigid
angle theta + H q/J always says something: the elastic moment falls out of its equation, and
|theta| <= p0(F, 0) u0 dwell^2 + sup |H q|/J.

Where products of inertia turn one axis with another, H, M0/J and e are those of J^-1 H and J^-1 M:
the same where J is diagonal.

Source: Sokolov (2004), (26), (27); Ivanova & Sokolov (1999) for regulators with an off state;
Efremov, Polyakov & Strygin (2006), (1.6), for the quasi-rigid angle.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.dwell_axes import Accuracy, Band, RelayAxis, coupled
from spacecraft_sim.elastic_influence import Influence, influence
from spacecraft_sim.elastic_modes import ElasticModel
from spacecraft_sim.guarantee import Assumption
from spacecraft_sim.relay_channels import AXES, per_channel
from spacecraft_sim.remedy import Lighter, Remedy, remedies
from spacecraft_sim.small_motion import slow_rotation, small_deflection

Array = np.ndarray
Regulator = Callable[[float, float], float]  # p0 of (F, e); raises ValueError where there is none

NOTHING = Accuracy(contour=math.inf)
_ROUNDING = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class AxisCertificate:
    """What is guaranteed about one axis.

    Attributes:
        axis: x, y or z.
        torque: M0, N m.
        dwell: Least time between switchings, s.
        bias: F = M1/M0.
        inertia: J, kg m^2; of the bus free about the other axes, where products couple them.
        moment: M_e by the printed bound, N m; inf if it is refused.
        moment_l1: M_e for any switching, N m.
        refused: Why the printed bound is, or nothing.
        joint: The elastic coordinate that is bent farthest, over what it must be small beside.
        deflection: The smaller bound of it, A_m or that for any switching, rad or m.
        disturbance: e: the smaller M_e over M0, and what the torques of the other axes add.
        attitude: What the two-level relay guarantees on the attitude; inf where nothing.
        quasi_rigid: What it guarantees of the attitude on the quasi-rigid angle.
        sway: Bound of |(J^-1 H q')_e|, how far the rate is from the quasi-rigid rate, rad/s.
        others: What other regulators guarantee in continuous time, alone, rad, by name.
        refused_others: Why those that guarantee nothing do, by name.
        inertia_fraction: mu, the share of the inertia that moves elastically.
        decay: sigma of the mode that disturbs the axis most, 1/s.
        remedy: What would help; None where e < 1 - |F|.
        assumptions: What all this rests on, with values.
    """

    axis: str
    torque: float
    dwell: float
    bias: float
    inertia: float
    moment: float
    moment_l1: float
    refused: str
    joint: str
    deflection: float
    disturbance: float
    attitude: Accuracy
    quasi_rigid: Accuracy
    sway: float
    others: dict[str, float]
    refused_others: dict[str, str]
    inertia_fraction: float
    decay: float
    remedy: Remedy | None
    assumptions: tuple[Assumption, ...]

    @property
    def holds(self) -> bool:
        """Whether the attitude is guaranteed and every assumption holds."""
        return math.isfinite(self.attitude.total) and all(a.holds for a in self.assumptions)

    @property
    def why(self) -> str:
        """Why feedback of the attitude guarantees something or nothing, in one line."""
        if self.moment_l1 == 0:
            return "nothing elastic is felt in the linear theory: e = 0"
        mu, room = self.inertia_fraction, 1 - abs(self.bias)
        swing, lost = 2 * mu / (1 - mu), -math.expm1(-self.decay * self.dwell) * room
        sign, one = ("<" if a < b else ">=" for a, b in ((self.disturbance, room), (swing, lost)))
        share = "" if self.bias == 0 else f"{room:.4g} "
        return (
            f"e = {self.disturbance:.4g} {sign} 1 - |F| = {room:.4g}; by one mode: 2 mu/(1 - mu) = "
            f"{swing:.4g} {one} {share}(1 - exp(-sigma dwell)) = {lost:.4g} with mu = {mu:.4g}, "
            f"sigma = {self.decay:.4g} 1/s"
        )


def certify(
    elastic: ElasticModel,
    *,
    torque: float | Array | list[float],
    dwell: float | Array | list[float],
    disturbance: float | Array | list[float] = 0.0,
    timestep: float = 0.0,
    delay: float | Array | list[float] = 0.0,
    regulators: Mapping[str, Regulator] | None = None,
    lighter: Lighter | None = None,
) -> tuple[AxisCertificate, ...]:
    """Certifies the pointing accuracy about each axis.

    Args:
        elastic: The structure.
        torque: M0 of each channel or of all, N m.
        dwell: Least time between switchings of each channel or of all, s.
        disturbance: M1, constant torque on the bus about each axis or all, of either sign, N m.
        timestep: Sampling period of the regulator, s; 0 for continuous time.
        delay: Longest delay of the thrust of each channel or of all, s.
        regulators: p0(F, e) by name beside the two-level relay.
        lighter: Gives the structure with the masses of its elastic parts times a factor.

    Returns:
        One certificate an axis.

    Raises:
        ValueError: If a number is out of range, or |M1| >= M0.
    """
    M0, hold = per_channel("torque", torque), per_channel("dwell", dwell)
    positive(timestep=timestep, zero=True)
    late = timestep + per_channel("delay", delay, zero=True)
    M1 = _steady(disturbance, M0)
    found = influence(elastic, torque=M0, dwell=hold)
    products, room = _products(elastic, M0, M1), 1 - np.abs(M1) / M0

    def disturbances(structure: ElasticModel) -> Array:
        """The bound e about each axis."""
        return influence(_of_acceleration(structure), torque=M0, dwell=hold).bound / M0 + products

    e, lean = disturbances(elastic), _leans(elastic, found, M1)
    inverse = np.diag(_inverse(elastic))
    full = {
        name: RelayAxis(
            acceleration=float(M0[k] * inverse[k]),
            inertia=float(1 / inverse[k]),
            dwell=float(hold[k]),
            bias=float(M1[k] / M0[k]),
            disturbance=float(e[k]),
            late=float(late[k]),
        )
        for k, name in enumerate(AXES)
    }
    sway = found.bending_rates(elastic.G.T).tolist()
    quasi = {
        name: replace(axis, disturbance=float(products[k]), lean=float(lean[k]), sway=sway[k])
        for k, (name, axis) in enumerate(full.items())
    }
    bands, rigid = _bands(full), _bands(quasi)
    bent = _deflections(elastic, found, M1)
    worst = int(np.argmax(bent / elastic.scale))
    rate = max(band.rate for band in (*bands.values(), *rigid.values()) if band)
    shared = _assumptions(elastic, found, bent, rate)
    helps = remedies(
        _of_acceleration(elastic),
        torque=M0,
        limits=(room - products) * M0,
        axes=[k for k, name in enumerate(AXES) if bands[name] is None],
        holds=lambda structure: disturbances(structure) < room,
        lighter=lighter,
    )
    alone = {name: _alone(regulators or {}, axis) for name, axis in full.items()}
    return tuple(
        AxisCertificate(
            axis=name,
            torque=float(M0[k]),
            dwell=axis.dwell,
            bias=axis.bias,
            inertia=axis.inertia,
            moment=float(found.moment[k]),
            moment_l1=float(found.moment_l1[k]),
            refused=found.refused,
            joint=elastic.coordinates[worst],
            deflection=float(bent[worst]),
            disturbance=axis.disturbance,
            attitude=_accuracy(bands[name]),
            quasi_rigid=_accuracy(rigid[name]),
            sway=sway[k],
            others=alone[name][0],
            refused_others=alone[name][1],
            inertia_fraction=float(elastic.inertia_fraction[k]),
            decay=_decay(elastic, found, k),
            remedy=helps.get(k),
            assumptions=(*shared, *_lateness(name, axis)),
        )
        for k, (name, axis) in enumerate(full.items())
    )


def _steady(disturbance: float | Array | list[float], M0: Array) -> Array:
    given = np.asarray(disturbance, dtype=float)
    if given.shape not in ((), (3,)) or not np.all(np.isfinite(given)):
        raise ValueError(f"disturbance must be one finite number or three, got {disturbance!r}")
    M1 = np.broadcast_to(given, (3,))
    for name, thrust, steady in zip(AXES, M0, M1, strict=True):
        if not abs(steady) < thrust:
            raise ValueError(
                f"the constant disturbance about {name}, {steady:.6g} N m, must be below the "
                f"torque, {thrust:.6g} N m: no regulator holds the axis"
            )
    return M1


def _inverse(elastic: ElasticModel) -> Array:
    """J^-1, with products of inertia that are rounding left out."""
    scale = np.sqrt(np.outer(np.diag(elastic.J), np.diag(elastic.J)))
    J = np.where(np.abs(elastic.J) > _ROUNDING * scale, elastic.J, 0.0)
    return np.diag(1 / np.diag(J)) if np.array_equal(J, np.diag(np.diag(J))) else np.linalg.inv(J)


def _products(elastic: ElasticModel, M0: Array, M1: Array) -> Array:
    """What the torques of the other axes do to each by products of inertia, over its own thrust."""
    inverse = _inverse(elastic)
    others = np.abs(inverse - np.diag(np.diag(inverse)))
    return others @ (M0 + np.abs(M1)) / (np.diag(inverse) * M0)


def _of_acceleration(elastic: ElasticModel) -> ElasticModel:
    """The structure with J_e (J^-1 H)_e for H_e: what an axis of the free bus feels."""
    inverse = _inverse(elastic)
    if np.array_equal(inverse, np.diag(np.diag(inverse))):
        return elastic
    return replace(elastic, H=(elastic.G / np.diag(inverse)).T)


def _deflections(elastic: ElasticModel, found: Influence, M1: Array) -> Array:
    """Bounds of |q|: about rest, and from rest to where the constant disturbance holds it."""
    return found.deflections(np.eye(len(elastic.D))) + np.abs(found.modes.deflection @ M1)


def _leans(elastic: ElasticModel, found: Influence, M1: Array) -> Array:
    """Bounds of (J^-1 H q)_e, rad: how far the attitude is from the quasi-rigid angle."""
    leans = elastic.G.T
    return found.deflections(leans) + np.abs(leans @ found.modes.deflection @ M1)


def _bands(axes: Mapping[str, RelayAxis]) -> dict[str, Band | None]:
    """Contours of the axes that have one; an axis without one may turn the others at will."""
    held = {n: a for n, a in axes.items() if abs(a.bias) + a.disturbance < 1}
    try:
        found, loose = coupled(held), len(held) < len(axes)
    except ValueError:  # each has a contour, but they turn each other too fast for it
        found, loose = {n: coupled({n: a})[n] for n, a in held.items()}, True
    if loose:
        found = {
            n: replace(band, accuracy=replace(band.accuracy, coupling=math.inf))
            for n, band in found.items()
        }
    return {n: found.get(n) for n in axes}


def _accuracy(band: Band | None) -> Accuracy:
    return band.accuracy if band else NOTHING


def _alone(
    regulators: Mapping[str, Regulator], axis: RelayAxis
) -> tuple[dict[str, float], dict[str, str]]:
    """What each regulator guarantees about an axis, rad, and why those that do not refuse."""
    found, refused = {}, {}
    for law, p0 in regulators.items():
        try:
            found[law] = axis.length * p0(abs(axis.bias), axis.disturbance)
        except ValueError as error:  # it guarantees nothing there
            found[law], refused[law] = math.inf, str(error)
    return found, refused


def _decay(elastic: ElasticModel, found: Influence, k: int) -> float:
    """Decay of the mode with the largest part in the moment about the axis, rung up."""
    decays = -np.real(found.modes.eigenvalues)
    parts = np.abs(found.modes.accelerations(elastic.H[k])[:, 0])
    built = (parts / -np.expm1(-np.outer(decays, found.dwell))) @ found.torque
    return float(decays[int(np.argmax(built))])


def _assumptions(
    elastic: ElasticModel, found: Influence, bent: Array, rate: float
) -> tuple[Assumption, ...]:
    """Small motion and slow rotation, as far as the design can tell."""
    assert elastic.scale is not None
    assert elastic.travel is not None
    worst, tight = int(np.argmax(bent / elastic.scale)), int(np.argmin(elastic.travel - bent))
    listed = [
        small_deflection(elastic.coordinates[worst], float(bent[worst] / elastic.scale[worst])),
        slow_rotation(rate, found.modes.slowest_decay),
    ]
    if math.isfinite(elastic.travel[tight]):
        text = f"{elastic.coordinates[tight]} stays off its stop"
        limit = float(elastic.travel[tight])
        listed.append(Assumption(text=text, value=float(bent[tight]), limit=limit, unit="rad or m"))
    return tuple(listed)


def _lateness(name: str, axis: RelayAxis) -> tuple[Assumption, ...]:
    if not axis.late:
        return ()
    text = f"{name}: sampling period and delay within the dwell"
    return (Assumption(text=text, value=axis.late, limit=axis.dwell, relation="<=", unit="s"),)
