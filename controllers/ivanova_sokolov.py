"""Relay regulator of maximal guaranteed accuracy for a thruster with a minimum on-time.

V. F. Ivanova, B. N. Sokolov, "Maximal guaranteed accuracy of a relay regulator in a
one-dimensional stabilisation problem" (1999, in Russian).

Plant.  x'' = u + F + eps, F known and constant, |eps| <= e < |F|, u in {0, -u0, +u0}, |F| + e < u0.
A thrust that was switched on stays on for the minimum on-time Dt; off it may be for any time, and
it may be switched on at any time.

Guaranteed.  With the levels 0 and -1 (against F), and switching curves made of parabolas,
limsup |x| <= p0 = u0 Dt^2/min(kappa1, kappa2)^2 from any start and under any disturbance:
- Example 1, if its contraction k < 1: every turn leaves at most k of the excess over p0;
- Example 2, for any e < F.
Where F >= 2/3 u0 and e <= 3/4 (u0 - F), (3.8), no law with all three levels guarantees less; that
is a claim of its own, not guaranteed outside (3.8).  Without disturbance p0 is a, and with +1 and
-1 there is b: the lesser of the two is the best for any |F| < u0.

On a sampled machine with delays, limsup |x| <= p_s (`ivanova_sokolov_sampled`), which the paper
does not have; convergence to p_s from outside the widened contour is seen in runs, not proved.

The printed (3.4), Lemma 3.4 and both examples have misprints; ERRATA.md lists them.
"""

import math
from functools import partial
from typing import Literal

from controllers.axis import Axis, Channel, channel, torque_gain
from controllers.contour import (
    Contour,
    contour,
    contraction,
    guaranteed_accuracy,
    in_optimal_region,
    kappa,
    undisturbed,
)
from controllers.contour_rules import example_1, example_2, undisturbed_a, undisturbed_b
from controllers.contour_sets import in_w1, in_w2
from controllers.dimensionless import Scale, to_dimensionless
from controllers.ivanova_sokolov_charts import parameter_map, phase_portrait
from controllers.ivanova_sokolov_claims import PAPER, SLACK, Claims
from controllers.ivanova_sokolov_sampled import (
    AnticipatingRelay,
    command_samples,
    sampled_accuracy,
    sampled_contour,
)
from controllers.minimum_on_time import MinimumOnTimeRelay
from spacecraft_sim.chart import Charts
from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Assumption, Guarantee
from spacecraft_sim.reduced import ReducedModel, double_integrator
from spacecraft_sim.switching_curves import Relay
from spacecraft_sim.thrusters import Thrusters

__all__ = [
    "AnticipatingRelay",
    "Contour",
    "MinimumOnTimeRelay",
    "Scale",
    "contour",
    "contraction",
    "design",
    "guaranteed_accuracy",
    "in_optimal_region",
    "kappa",
    "sampled_accuracy",
    "to_dimensionless",
    "undisturbed",
]

Rule = Literal["example_1", "example_2", "undisturbed", "undisturbed_a", "undisturbed_b"]


def design(
    model: ReducedModel | None = None,
    thrusters: Thrusters | None = None,
    *,
    bias: float,
    disturbance: float = 0.0,
    rule: Rule = "example_1",
    guarded: bool = True,
    finite_time: bool = False,
    period: float | None = None,
    on_delay: float | None = None,
    off_delay: float | None = None,
    axis: Axis = "z",
    feedback: Literal["attitude", "quasi_rigid"] = "attitude",
    level: float | None = None,
    min_on_time: float | None = None,
) -> tuple[MinimumOnTimeRelay | AnticipatingRelay, tuple[Guarantee, ...]]:
    """Designs the regulator of one axis, with what is guaranteed of it.

    Args:
        model: The plant, for its inertia; the double integrator of 1 kg m^2 if left out.
        thrusters: The thrusters; ideal ones of 1 N m and 1 s if left out.
        bias: F, the steady torque about the axis, N m.
        disturbance: e, the bound of the rest of the torque, N m.
        rule: The switching curves; `undisturbed` is the better of `undisturbed_a`, with thrust
            against the bias alone, and `undisturbed_b`, with thrust both ways.
        guarded: Whether Example 1 keeps 0 while v < 0 and -1 while v > 0; without it, it settles
            far off once the disturbance passes its bound by a thousandth.
        finite_time: Whether the contour is reached in finite time, not asymptotically.
        period: Sampling period, s; in continuous time if left out.
        on_delay: Delay of switching on that a sampled law makes up for, s; the thruster's if left
            out.
        off_delay: Delay of switching off, likewise, s.
        axis: The axis.
        feedback: What is fed back: the attitude of the bus and its rate, or the quasi-rigid angle
            of bus and booms and its rate.
        level: The thrust to use, N or N m; the thruster's only one if left out.
        min_on_time: Dt, s; the thruster's if left out.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If |F| + e >= u0, e >= |F|, k >= 1 for Example 1, the minimum on-time is zero,
            the period is longer than it, the thruster has several levels and none is chosen, or
            the rule does not go with a disturbance, a period or finite time.
    """
    positive(disturbance=disturbance, **{"|bias|": abs(bias)}, zero=True)
    found = channel(model, thrusters, axis=axis, feedback=feedback)
    thrust, time = _thrust(found, level), _on_time(found, min_on_time)
    gain = torque_gain(model or double_integrator(), axis)
    u0 = thrust * abs(found.unit)
    F, eps, scale = to_dimensionless(
        thrust_acceleration=u0,
        min_on_time=time,
        bias=bias * gain,
        disturbance=disturbance * gain,
    )
    if disturbance > 0 and disturbance >= abs(bias):
        raise ValueError(
            f"disturbance = {disturbance:.6g} N m must be below |bias| = {abs(bias):.6g} N m: "
            "otherwise it may turn the torque over and the accuracy of thrust against it alone is "
            "infinite; bring the disturbance down, or take a law with thrust both ways"
        )
    rule, c, relay = _switching(rule, F, eps, guarded, finite_time, period is not None)
    spec = found.spec
    own = spec.delay.mean if spec and period is not None else 0.0
    on, off = (own if delay is None else delay for delay in (on_delay, off_delay))
    positive(on_delay=on, off_delay=off, zero=True)
    signed = math.copysign(thrust, found.unit)
    if period is None:
        if on or off:
            raise ValueError(
                f"on_delay = {on}, off_delay = {off}: only a sampled law makes up for delays; set "
                "period too"
            )
        law = MinimumOnTimeRelay(
            relay=relay,
            scale=scale,
            level=signed,
            sensors=found.sensors,
            thrusters=(found.thruster,),
            charts=_charts(c, relay, scale, found, F, eps),
        )
    else:
        positive(period=period)
        if period > time:
            raise ValueError(
                f"period = {period:.6g} s is longer than the minimum on-time, {time:.6g} s: sample "
                f"at least once in it, with period <= {time:.6g} s"
            )
        Ts, ton, toff = period / time, on / time, off / time
        c = sampled_contour(F, eps, Ts, on_delay=ton, off_delay=toff)
        relay = example_1(c, guarded=guarded) if rule == "example_1" else example_2(c)
        law = AnticipatingRelay(
            relay=relay,
            scale=scale,
            level=signed,
            F=F,
            eps=eps,
            command_time=command_samples(Ts, on_delay=ton, off_delay=toff) * period,
            period=period,
            on_delay=on,
            off_delay=off,
            sensors=found.sensors,
            thrusters=(found.thruster,),
            charts=_charts(c, relay, scale, found, F, eps),
        )
    claims = Claims(
        source=f"{PAPER}, {_SOURCES[rule]}" + ("" if period is None else ", sampled"),
        scale=scale,
        accuracy=undisturbed(F)[1] if c is None else c.p,
        contraction=contraction(F, eps) if rule == "example_1" and period is None else None,
        settled=_on_contour_b(F) if c is None else _reaching(c, sampled=period is not None),
        assumptions=(*_hypotheses(rule, F, eps), *_hardware(found, time, on, off, period)),
        least=() if period is not None else _least(rule, F, eps),
        sensors=found.sensors,
        channel=found.thruster,
        axis=axis,
        level=signed,
        torque_gain=gain,
        bias=bias,
        disturbance=disturbance,
        delays=(on, off),
    )
    return law, claims.all()


_SOURCES = {
    "example_1": "Example 1",
    "example_2": "Example 2",
    "undisturbed_a": "section 2, m = a",
    "undisturbed_b": "section 2, m = b",
}


def _thrust(found: Channel, level: float | None) -> float:
    """The one level of the thruster, N or N m."""
    levels = found.spec.levels if found.spec else None
    if level is not None:
        positive(level=level)
        if levels and not any(math.isclose(level, x, rel_tol=1e-9) for x in levels):
            raise ValueError(
                f"thruster {found.thruster!r} has the levels {list(levels)}; level = {level} is "
                "none of them"
            )
        return level
    if levels and len(levels) > 1:
        raise ValueError(
            f"thruster {found.thruster!r} has the levels {list(levels)} and the law uses one: set "
            "controller.level"
        )
    return levels[0] if levels else 1.0


def _on_time(found: Channel, min_on_time: float | None) -> float:
    time = min_on_time
    if time is None:
        time = found.spec.min_on_time if found.spec else 1.0
    if not (math.isfinite(time) and time > 0):
        raise ValueError(
            f"the minimum on-time of {found.thruster!r} is {time} s and must be > 0: without one "
            "any accuracy can be had and nothing limits it; set thrusters.*.min_on_time, or "
            "controller.min_on_time to what the law shall keep"
        )
    return time


def _switching(
    rule: Rule, F: float, eps: float, guarded: bool, finite_time: bool, sampled: bool
) -> tuple[Rule, Contour | None, Relay]:
    """The rule meant, its contour (None for m = b), and its curves in continuous time."""
    if rule in ("example_1", "example_2"):
        if sampled and finite_time:
            raise ValueError("finite_time = true: a sampled law has no such correction; set false")
        c = contour(F, eps)
        if rule == "example_2":
            return rule, c, example_2(c, finite_time=finite_time)
        if (k := contraction(F, eps)) >= 1:
            raise ValueError(
                f"Example 1 needs a contraction k < 1; here k = {k:.6g} at F/u0 = {F:.6g}, e/u0 = "
                f'{eps:.6g}: set controller.rule = "example_2", which converges for any e < F'
            )
        return rule, c, example_1(c, guarded=guarded, finite_time=finite_time)
    if rule not in ("undisturbed", "undisturbed_a", "undisturbed_b"):
        raise ValueError(f"rule = {rule!r} is none of {', '.join(_SOURCES)}, undisturbed")
    wrong = {"disturbance > 0": eps > 0, "finite_time": finite_time, "a period": sampled}
    if any(wrong.values()):
        raise ValueError(
            f'rule = "{rule}" does not go with {", ".join(k for k, v in wrong.items() if v)}; '
            'set controller.rule = "example_1" or "example_2"'
        )
    a, b = undisturbed(F)
    if rule == "undisturbed_a" or (rule == "undisturbed" and a <= b):
        return "undisturbed_a", contour(F, 0.0), undisturbed_a(F)
    return "undisturbed_b", None, undisturbed_b(F)


def _charts(
    c: Contour | None, relay: Relay, scale: Scale, found: Channel, F: float, eps: float
) -> Charts:
    plane = parameter_map(F, eps, axis=found.axis)
    if c is None:
        return (plane,)
    signals = (found.sensors[0], found.sensors[1])
    return (
        phase_portrait(c, relay, scale, axis=found.axis, signals=signals, channel=found.thruster),
        plane,
    )


def _reaching(c: Contour, *, sampled: bool):
    """Lemma 3.3, both ways; sampled, a pulse alone tells, for 0 takes effect early."""
    return partial(_reaches, c, sampled)


def _reaches(c: Contour, sampled: bool, x: float, v: float, level: int) -> bool:
    if level == -1:
        return in_w1(c, x, v, slack=SLACK)
    return level == 0 and not sampled and in_w2(c, x, v, slack=SLACK)


def _on_contour_b(F: float):
    """C1 of the contour N, where -1 replaces +1."""
    b = undisturbed(F)[1]
    return partial(_near, -b * F, (1 + F) / 2, SLACK * b)


def _near(x1: float, v1: float, room: float, x: float, v: float, level: int) -> bool:
    return level == -1 and abs(x - x1) <= room and abs(v - v1) <= room


def _hypotheses(rule: Rule, F: float, eps: float) -> tuple[Assumption, ...]:
    """What the design has made sure of."""
    found = [Assumption(text="F + e < u0, over u0", value=F + eps, limit=1.0)]
    if rule != "undisturbed_b":
        found.append(Assumption(text="e < F, over u0", value=eps, limit=F))
    if rule == "example_1":
        found.append(Assumption(text="k < 1", value=contraction(F, eps), limit=1.0))
    return tuple(found)


def _least(rule: Rule, F: float, eps: float) -> tuple[Assumption, ...]:
    """Where no law guarantees less."""
    if eps == 0:
        a, b = undisturbed(F)
        ours, other = (b, a) if rule == "undisturbed_b" else (a, b)
        text = "b <= a" if rule == "undisturbed_b" else "a <= b"
        return (Assumption(text=text, value=ours, limit=other, relation="<="),)
    room = 0.0 if not in_optimal_region(F, eps) else 1e-12  # as `in_optimal_region` allows
    return (
        Assumption(text="(3.8): F/u0 >= 2/3", value=F, limit=2 / 3 - room, relation=">="),
        Assumption(
            text="(3.8): e/u0 <= 3/4 (1 - F/u0)",
            value=eps,
            limit=0.75 * (1 - F) + room,
            relation="<=",
        ),
    )


def _hardware(
    found: Channel, time: float, on: float, off: float, period: float | None
) -> tuple[Assumption, ...]:
    """What the theory takes for granted of thruster and sampling."""
    sampling = () if period is None else (
        Assumption(text="Ts <= Dt", value=period, limit=time, relation="<=", unit="s"),
    )  # fmt: skip
    spec = found.spec
    if spec is None:
        return sampling
    late = max(abs(spec.delay.mean - on), abs(spec.delay.mean - off)) + spec.delay.amplitude
    return (
        *sampling,
        Assumption(
            text="the thruster's minimum on-time is no longer than Dt",
            value=spec.min_on_time,
            limit=time,
            relation="<=",
            unit="s",
        ),
        Assumption(
            text="thrust follows the valve at once",
            value=max(spec.rise_time, spec.fall_time),
            limit=0.0,
            relation="<=",
            unit="s",
        ),
        Assumption(
            text="delay of the thruster, less what the law makes up for",
            value=late,
            limit=1e-9,
            relation="<=",
            unit="s",
        ),
    )
