"""Accuracy of two-level relays with a dwell about several axes of one bus, which turn each other.

About principal axes the equations of `dwell_contour` hold for each axis alone but for two products
of small motions: a rotation vector phi has phi' = omega + phi x omega/2 + ..., a slip of the angle,
and J v' has omega x J v, a disturbance; v is the rate fed back, omega that of the bus, the same or,
for the quasi-rigid angle, with the sway of the elastic parts on top.  Both are bounded by the
contours themselves: what they add is found by going round until the contours have settled.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

from spacecraft_sim.dwell_contour import Contour, contour

_TURNS = 60
_SETTLED = 1e-10
# |phi' - omega - phi x omega/2| <= |phi|^2 |omega| (1 - phi/2 cot(phi/2))/phi^2, 1/12 at phi = 0.
_THIRD_ORDER = 1 / 11


@dataclass(frozen=True, slots=True, kw_only=True)
class RelayAxis:
    """One axis and its relay.

    Attributes:
        acceleration: u0 = M0/J, rad/s^2.
        inertia: J, kg m^2.
        dwell: Least time between switchings, s.
        bias: F, the constant disturbance over the thrust.
        disturbance: e, the bound of what else disturbs over the thrust.
        late: Longest time from the arc to the switching, s.
        slip: Bound of how fast the angle fed back departs from its rate, rad/s.
        lean: How far the attitude may be from the angle fed back, rad.
        sway: How far the rate of the bus may be from the rate fed back, rad/s.
    """

    acceleration: float
    inertia: float
    dwell: float
    bias: float = 0.0
    disturbance: float = 0.0
    late: float = 0.0
    slip: float = 0.0
    lean: float = 0.0
    sway: float = 0.0

    @property
    def length(self) -> float:
        """The unit of the angle, rad."""
        return self.acceleration * self.dwell**2

    @property
    def speed(self) -> float:
        """The unit of the rate, rad/s."""
        return self.acceleration * self.dwell


@dataclass(frozen=True, slots=True, kw_only=True)
class Accuracy:
    """What a regulator guarantees of an angle, term by term, rad.

    Attributes:
        contour: p0 u0 dwell^2.
        sampling: What late switching adds: u0 dwell late to first order without a disturbance.
        coupling: What the other axes, and the slip of the angle, add.
        lean: How far the attitude may be from the angle that is fed back.
    """

    contour: float
    sampling: float = 0.0
    coupling: float = 0.0
    lean: float = 0.0

    @property
    def total(self) -> float:
        """The bound of |theta|, rad."""
        return self.contour + self.sampling + self.coupling + self.lean


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """An axis with its contour.

    Attributes:
        axis: The axis.
        contour: The contour, in units of the axis.
        accuracy: What it guarantees.
        slip: Bound of phi' - omega, rad/s.
        gyroscopic: Bound of the gyroscopic acceleration, rad/s^2.
    """

    axis: RelayAxis
    contour: Contour
    accuracy: Accuracy
    slip: float
    gyroscopic: float

    @property
    def rate(self) -> float:
        """Bound of the rate that is fed back, rad/s."""
        return self.contour.fastest * self.axis.speed


def coupled(axes: Mapping[str, RelayAxis]) -> dict[str, Band]:
    """Returns the contours of relays about axes of one bus.

    Args:
        axes: The axes under control, by letter; the bus does not turn about others.

    Raises:
        ValueError: If |F| + e >= 1 about an axis, or the axes turn each other too fast.
    """
    alone = {name: contour(a.bias, a.disturbance) for name, a in axes.items()}
    late = {name: contour(a.bias, a.disturbance, late=a.late / a.dwell) for name, a in axes.items()}
    slip, push = {n: a.slip for n, a in axes.items()}, dict.fromkeys(axes, 0.0)
    found = late
    for _ in range(_TURNS):
        try:
            found = {name: _contour(a, slip[name], push[name]) for name, a in axes.items()}
        except ValueError as error:
            raise ValueError(f"{_too_fast(axes)}: {error}") from error
        before = slip, push
        slip, push = _coupling(axes, found)
        if all(
            abs(slip[n] - before[0][n]) <= _SETTLED * a.speed
            and abs(push[n] - before[1][n]) <= _SETTLED * a.acceleration
            for n, a in axes.items()
        ):
            break
    else:
        raise ValueError(_too_fast(axes))
    return {
        name: Band(
            axis=a,
            contour=found[name],
            accuracy=Accuracy(
                contour=alone[name].accuracy * a.length,
                sampling=(late[name].accuracy - alone[name].accuracy) * a.length,
                coupling=(found[name].accuracy - late[name].accuracy) * a.length,
                lean=a.lean,
            ),
            slip=slip[name],
            gyroscopic=push[name],
        )
        for name, a in axes.items()
    }


def _too_fast(axes: Mapping[str, RelayAxis]) -> str:
    sizes = ", ".join(f"{name} {a.length:.3g} rad" for name, a in axes.items())
    return (
        f"the axes turn each other too fast for any contour: u0 dwell^2 is {sizes}; shorten the "
        "dwell or weaken the thrust"
    )


def _contour(a: RelayAxis, slip: float, push: float) -> Contour:
    e = a.disturbance + push / a.acceleration
    return contour(a.bias, e, slip=slip / a.speed, late=a.late / a.dwell)


def _coupling(
    axes: Mapping[str, RelayAxis], found: Mapping[str, Contour]
) -> tuple[dict[str, float], dict[str, float]]:
    """Slip, rad/s, and gyroscopic acceleration, rad/s^2, of each axis."""
    angle = {n: found[n].accuracy * a.length + a.lean for n, a in axes.items()}
    own = {n: found[n].fastest * a.speed for n, a in axes.items()}
    rate = {n: own[n] + a.sway for n, a in axes.items()}
    third = math.hypot(*angle.values()) ** 2 * math.hypot(*rate.values()) * _THIRD_ORDER
    slip, push = {}, {}
    for name, a in axes.items():
        others = [n for n in axes if n != name]
        slip[name], push[name] = a.slip, 0.0
        if others:
            slip[name] += third
        if len(others) == 2:
            i, j = others
            momentum = {n: axes[n].inertia * own[n] for n in others}
            slip[name] += (angle[i] * rate[j] + angle[j] * rate[i]) / 2
            torque = abs(axes[i].inertia - axes[j].inertia) * own[i] * own[j]
            torque += momentum[i] * axes[j].sway + momentum[j] * axes[i].sway
            push[name] = torque / a.inertia
    return slip, push
