"""Two-level relays with a dwell about several axes of a spacecraft with elastic parts.

Plant, axis by axis.  theta'' = u + F + eps, u = -u0 or +u0, each kept for the dwell; F known and
constant, |eps| <= e: the moment of the elastic parts, bounded for any switching with that dwell by
B. N. Sokolov, "Guaranteed estimate of the influence of elastic structural elements on the dynamics
of the stabilization of its angular position under relay control" (2004, in Russian), (26), (27).

Law.  To -u0 on theta = p - omega^2/(2 (u0 - F - e)), omega > 0, and to +u0 on the arc that mirrors
it, as soon as the dwell is over: the contour of `spacecraft_sim.dwell_contour`, after V. F. Ivanova
and B. N. Sokolov (1999), section 2, whose undisturbed law with two levels it is for e = 0.

Guaranteed.  Once a switching took place on an arc within the contour, |theta| stays below
p0(F, e) u0 dwell^2 and what late switching and the other axes add, each stated for itself.

With feedback of the quasi-rigid angle theta + H q/J and its rate, M. S. Efremov, A. E. Polyakov,
V. V. Strygin (2006), (1.6), the elastic moment falls out and e is what is left, nothing as a rule;
the attitude is off by H q/J on top.  That is never vacuous, however heavy the elastic parts.  Where
nothing measures q, an observer of the machine estimates it from the attitude; what it corrects is
slip and disturbance to the relay, and its error is added to the attitude's.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple

import numpy as np

from controllers.axis import Axis, Channel, channel, torque_gain
from controllers.channels import Channels
from controllers.dwell_relay_charts import charts
from controllers.dwell_relay_claims import Claims
from controllers.observer import ESTIMATED, ObservedLaw, Observer, Unknown, design_observer
from spacecraft_sim.chart import Charts
from spacecraft_sim.checks import positive
from spacecraft_sim.dwell_axes import Band, RelayAxis, coupled
from spacecraft_sim.guarantee import Assumption, Guarantee
from spacecraft_sim.reduced import ReducedModel, double_integrator
from spacecraft_sim.thrusters import Thrusters

_CLOCK = 1e-9  # share of the dwell by which a sample may come early

Feedback = Literal["attitude", "quasi_rigid", "estimated"]


class Memory(NamedTuple):
    """What the law remembers.

    Attributes:
        sign: Of the acceleration commanded last; 0 before the first command.
        since: Time of that command, s.
    """

    sign: int
    since: float


@dataclass(frozen=True, slots=True, kw_only=True)
class DwellRelay:
    """The law of one axis.

    Attributes:
        half_width: p, rad.
        brake: u0 - F - e, rad/s^2: curvature of the arc on which -u0 begins.
        push: u0 + F - e, rad/s^2: of the other.
        dwell: Least time between switchings, s.
        level: Thrust that accelerates to plus, N or N m.
        sensors: Names of angle and rate, rad and rad/s.
        thrusters: Name of the one channel.
        period: Sampling period, s; None in continuous time.
        charts: Phase portrait and map of accuracies.
    """

    half_width: float
    brake: float
    push: float
    dwell: float
    level: float
    sensors: tuple[str, ...]
    thrusters: tuple[str, ...]
    period: float | None = None
    charts: Charts = field(default=(), compare=False)

    def init(self) -> Memory:
        """Returns the memory of a relay that has not been set."""
        return Memory(0, -math.inf)

    def step(self, t: float, y: Sequence[float], memory: Memory) -> tuple[tuple[float], Memory]:
        """Returns the thrust and the new memory.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            memory: What the last step returned.
        """
        if memory.sign == 0:
            memory = Memory(-1 if self._distance(1, *y) < self.half_width else 1, t)
        elif self._left(t, memory) <= 0 and self._distance(memory.sign, *y) <= 0:
            memory = Memory(-memory.sign, t)
        return (memory.sign * self.level,), memory

    def events(self, t: float, y: Sequence[float], memory: Memory) -> tuple[float, ...]:
        """Returns the time left of the dwell, s, or the distance to the arc, rad.

        Args:
            t: Time, s.
            y: Angle and rate, rad and rad/s.
            memory: What the last step returned.
        """
        if self.period is not None:
            return ()
        left = self._left(t, memory)
        return (left if left > 0 else self._distance(memory.sign, *y),)

    def _left(self, t: float, memory: Memory) -> float:
        play = 0.0 if self.period is None else _CLOCK * self.dwell
        return memory.since + self.dwell - t - play

    def _distance(self, sign: int, x: float, v: float) -> float:
        """How far x is from where the thrust turns; past v = 0 the arc goes on as its mirror."""
        room = self.brake if sign > 0 else self.push
        return self.half_width - sign * (x + v * abs(v) / (2 * room))


class Numbers(NamedTuple):
    """What is given of an axis: F and e, N m, and bounds of lean, rad, and sway, rad/s."""

    bias: float
    disturbance: float
    lean: float
    sway: float


class Error(NamedTuple):
    """Bounds of an observer about an axis: errors, rad and rad/s; corrections in time."""

    angle: float
    rate: float
    slip: float
    push: float


def design(
    model: ReducedModel | None = None,
    thrusters: Thrusters | None = None,
    *,
    axes: tuple[Axis, ...],
    bias: tuple[float, ...] = (),
    disturbance: tuple[float, ...] = (),
    feedback: Feedback = "attitude",
    lean: tuple[float, ...] = (),
    sway: tuple[float, ...] = (),
    noise: float = 1e-8,
    period: float | None = None,
    dwell: float | None = None,
) -> tuple[Channels | ObservedLaw, tuple[Guarantee, ...]]:
    """Designs two-level relays about several axes, with what is guaranteed of each.

    Args:
        model: The plant; the double integrator of 1 kg m^2 if left out.
        thrusters: The thrusters `thruster_<axis>`, at their highest level; ideal ones of 1 N m and
            1 s if left out.
        axes: The axes under control; about others the bus must not turn.
        bias: F of each axis, the steady torque, N m; none if left out.
        disturbance: e of each axis, N m: the certified moment M_e of the elastic parts if the
            attitude is fed back; if the quasi-rigid angle is, what else there is; if that is
            estimated, what the observer is not told of.  None if left out.
        feedback: What is fed back: the attitude of the bus and its rate, the quasi-rigid angle of
            bus and booms and its rate, or an estimate of these from the attitude alone.
        lean: Certified bound of |H q|/J of each axis, how far the attitude may be from the
            quasi-rigid angle, rad; with feedback of the attitude left out.
        sway: Certified bound of |H q'|/J of each axis, rad/s; likewise.
        noise: Bound of the error with which an observer reads an attitude, rad.
        period: Sampling period, s; in continuous time if left out.
        dwell: Least time between switchings, s; that of each thruster if left out.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If |F| + e >= u0 about an axis, a dwell is zero, the numbers are not one an
            axis, the axes turn each other too fast, or an observer lacks a period or a disturbance.
    """
    model = model or double_integrator()
    if period is not None:
        positive(period=period)
    given = {"bias": bias, "disturbance": disturbance, "lean": lean, "sway": sway}
    numbers = _by_axis(axes, given, feedback)
    fed = "attitude" if feedback == "attitude" else "quasi_rigid"
    found: dict[Axis, Channel] = {
        axis: channel(model, thrusters, axis=axis, feedback=fed) for axis in axes
    }
    observer, errors = None, None
    if feedback == "estimated":
        observer, errors = _observer(model, thrusters, found, numbers, noise, period)
    relays = {
        axis: _relay(axis, model, found, period, dwell, numbers[axis], errors) for axis in axes
    }
    bands = coupled(relays)
    prefix = ESTIMATED if observer else ""
    laws, claims = [], []
    for axis in axes:
        signals = (prefix + found[axis].sensors[0], prefix + found[axis].sensors[1])
        law = _law(found[axis], bands[axis], period, signals)
        laws.append(law)
        assumed = _assumptions(found[axis], relays[axis], period)
        if observer:
            assumed += (_untold(axis, bands[axis], numbers[axis].disturbance),)
        claims += Claims(
            axis=axis,
            band=bands[axis],
            level=law.level,
            torque_gain=torque_gain(model, axis),
            sensors=signals,
            estimated=dict(zip(found[axis].sensors, errors[axis], strict=False)) if errors else {},
            channel=law.thrusters[0],
            decay=model.slowest_decay,
            period=period,
            assumptions=assumed,
        ).all()
    law = Channels(laws=tuple(laws))
    return ObservedLaw(law=law, observer=observer) if observer else law, tuple(claims)


def _by_axis(
    axes: tuple[Axis, ...], given: dict[str, tuple[float, ...]], feedback: Feedback
) -> dict[Axis, Numbers]:
    """The numbers of each axis; what is left out is zero."""
    if not axes or len(set(axes)) < len(axes):
        raise ValueError(f"axes = {list(axes)} must name one axis at least, and each once")
    for name, values in given.items():
        if values and len(values) != len(axes):
            raise ValueError(
                f"axes = {list(axes)} need one {name} each; got {name} = {list(values)}"
            )
        for axis, value in zip(axes, values, strict=False):
            positive(zero=True, **{f"{name} of {axis}": abs(value) if name == "bias" else value})
    if feedback == "attitude" and any((*given["lean"], *given["sway"])):
        raise ValueError(
            "lean and sway are what feedback of the quasi-rigid angle leaves over; with "
            'controller.feedback = "attitude" leave them out'
        )
    rows = zip(*(given[name] or (0.0,) * len(axes) for name in Numbers._fields), strict=True)
    return {axis: Numbers(*row) for axis, row in zip(axes, rows, strict=True)}


def _observer(
    model: ReducedModel,
    thrusters: Thrusters | None,
    found: dict[Axis, Channel],
    numbers: dict[Axis, Numbers],
    noise: float,
    period: float | None,
) -> tuple[Observer, dict[Axis, Error]]:
    """An observer of the quasi-rigid angles that reads the attitude alone."""
    if period is None:
        raise ValueError(
            'controller.feedback = "estimated" needs controller.period: an observer is sampled'
        )
    told = {a: torque_gain(model, a) / own.unit for a, own in found.items()}  # thrust per N m
    for axis, own in numbers.items():
        positive(zero=False, **{f"disturbance of {axis}": own.disturbance})
    observer, errors = design_observer(
        model, thrusters, channels=tuple(own.thruster for own in found.values()),
        sensors=tuple(f"attitude_{axis}" for axis in found),
        fed=tuple(name for own in found.values() for name in own.sensors),
        period=period,
        unknown=Unknown(
            thrust=tuple(abs(told[axis]) * own.disturbance for axis, own in numbers.items()),
            impulse=(0.0,) * len(found),
            noise=(noise,) * len(found),
            steady=tuple(told[axis] * own.bias for axis, own in numbers.items()),
        ),
    )  # fmt: skip
    pairs = np.stack([errors.error, errors.jumps]).reshape(2, -1, 2).tolist()
    return observer, {
        axis: Error(*error, *jumps) for axis, error, jumps in zip(found, *pairs, strict=True)
    }


def _relay(
    axis: Axis,
    model: ReducedModel,
    found: dict[Axis, Channel],
    period: float | None,
    dwell: float | None,
    numbers: Numbers,
    errors: dict[Axis, Error] | None,
) -> RelayAxis:
    """One axis in the terms of `dwell_axes`."""
    own = found[axis]
    held = dwell if dwell is not None else own.spec.min_on_time if own.spec else 1.0
    if not (math.isfinite(held) and held > 0):
        raise ValueError(
            f"axis {axis}: the least time between switchings is {held} s and must be > 0; set "
            "thrusters.*.min_on_time, or controller.dwell to what the law shall keep"
        )
    u0, gain = _thrust(own) * abs(own.unit), torque_gain(model, axis)
    # Products of inertia: what the other thrusters do to this axis.
    others = sum(
        abs(model.gain(other.thruster, f"quasi_rigid_rate_{axis}")) * _thrust(other)
        for name, other in found.items()
        if name != axis
    )
    # An observer's corrections are what disturbs its estimates, and nothing else does.
    error = errors[axis] if errors else Error(0.0, 0.0, 0.0, numbers.disturbance * gain)
    F, e = numbers.bias * gain / u0, (error.push + others) / u0
    if not abs(F) + e < 1:
        raise ValueError(
            f"axis {axis}: the bias and the disturbance together, {abs(F) + e:.4g} of the thrust, "
            'must be below it: the guarantee is vacuous; take feedback = "quasi_rigid", for '
            "which the elastic parts are no disturbance"
        )
    sampled = period if errors and period else 0.0  # between samples errors go on growing
    return RelayAxis(
        acceleration=u0,
        inertia=1 / gain,
        dwell=held,
        bias=F,
        disturbance=e,
        late=(period or 0.0) + (own.spec.delay.longest if own.spec else 0.0),
        slip=error.slip,
        lean=numbers.lean + error.angle + sampled * (error.rate + error.slip),
        sway=numbers.sway + error.rate + sampled * error.push,
    )


def _thrust(found: Channel) -> float:
    return found.spec.levels[-1] if found.spec else 1.0


def _law(found: Channel, band: Band, period: float | None, signals: tuple[str, str]) -> DwellRelay:
    axis, half = band.axis, band.contour.half_width * band.axis.length
    return DwellRelay(
        half_width=half,
        brake=band.contour.upper.brake * axis.acceleration,
        push=band.contour.lower.brake * axis.acceleration,
        dwell=axis.dwell,
        level=math.copysign(_thrust(found), found.unit),
        sensors=found.sensors,
        thrusters=(found.thruster,),
        period=period,
        charts=charts(band, name=found.axis, signals=signals, channel=found.thruster),
    )


def _untold(axis: Axis, band: Band, disturbance: float) -> Assumption:
    return Assumption(
        text=f"{axis}: gyroscopic torque within what the observer is not told of",
        value=band.gyroscopic * band.axis.inertia, limit=disturbance, relation="<=", unit="N m",
    )  # fmt: skip


def _assumptions(found: Channel, axis: RelayAxis, period: float | None) -> tuple[Assumption, ...]:
    """What the design has made sure of, and what it takes for granted of the thruster."""
    share = abs(axis.bias) + axis.disturbance
    listed = [Assumption(text=f"{found.axis}: |F| + e < u0, over u0", value=share, limit=1.0)]
    if period is not None:
        listed.append(
            Assumption(
                text="sampling period within the dwell", value=period, limit=axis.dwell,
                relation="<=", unit="s",
            )
        )  # fmt: skip
    if (spec := found.spec) is not None:
        for text, value, limit in (
            ("the thruster's minimum on-time within the dwell", spec.min_on_time, axis.dwell),
            ("thrust follows the valve at once", spec.rise_time + spec.fall_time, 0.0),
            ("the delay is constant", abs(spec.delay.amplitude), 0.0),
        ):
            listed.append(
                Assumption(
                    text=f"{found.axis}: {text}", value=value, limit=limit, relation="<=", unit="s"
                )
            )
    return tuple(listed)
