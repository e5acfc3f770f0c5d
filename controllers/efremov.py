"""Relay stabilisation of a spacecraft with viscoelastic booms under an uncertain delay.

M. S. Efremov, A. E. Polyakov, V. V. Strygin, "An algorithm of active stabilization of a spacecraft
with viscoelastic elements under conditions of uncertainty", J. Appl. Math. Mech. 70 (2006) 723-733.

Plant.  The quasi-rigid angle beta = J gamma + 2 sum p_i q_i of bus and booms obeys
beta'' = u(t - h(t)) + f whatever the booms do (1.6).  Here beta, v = beta', u and f are divided by
J: rad, rad/s, rad/s^2.  Of the delay only 0 < h(t) < h0 is known.

Law.  Two pulses of one level bring (beta, v) near the origin (section 2).  Then, with
s = c beta + v, the relay of Theorem 1, u = -p sign s, or the multi-level relay of Theorem 2,
u = -A sign s with A = p 3^k, k the number of thresholds v_n <= |s|.

Theorem 1 guarantees |beta| < eps for ever from |beta| < eps/4, |s| < c eps (6 - 5E)/(4E) on, if
|f| < c^2 eps/4 and no command above p is under way; its proof gives |beta| < 3 eps/4 and
|v| < 5 c eps/4.  Here and below E = exp(c h0).

Theorem 2 guarantees, if |f| < v1 c/2 and the region |beta|, |v| < R is entered: |beta| < eps from
some time on.  The printed claim |v| < eps is false in general; what the repaired proof gives is
S = (p + v1 c/2) (E - 1)/(c (2 - E)), and in the end |s| <= S, |beta| <= S/c,
|v| <= 2 S.  Nothing is promised about the attitude gamma: it swings on while beta is still.
"""

import math
from dataclasses import replace
from functools import partial

from controllers.efremov_claims import PAPER, Claims, Theorem
from controllers.efremov_relay import (
    RATE,
    Attraction,
    LimitCycle,
    MultilevelRelay,
    attracting,
    limit_cycle,
)
from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Assumption, Guarantee
from spacecraft_sim.reduced import ReducedModel, double_integrator
from spacecraft_sim.thrusters import Thrusters, nearest_level

__all__ = [
    "Attraction",
    "LimitCycle",
    "MultilevelRelay",
    "attracting",
    "design_local",
    "design_nonlocal",
    "limit_cycle",
    "settling_time",
]

CHANNEL = "thruster_z"


def design_local(
    model: ReducedModel | None = None,
    thrusters: Thrusters | None = None,
    *,
    max_delay: float,
    accuracy: float,
    c: float,
    attraction_level: float = 0.0,
    compensated_delay: float = 0.0,
    period: float | None = None,
) -> tuple[MultilevelRelay, tuple[Guarantee, ...]]:
    """Designs the relay of Theorem 1, which holds a spacecraft that is already near its target.

    Args:
        model: The plant, for its inertia; the double integrator in rad/s^2 if left out.
        thrusters: The thrusters; unlimited if left out.
        max_delay: h0, the delay that is never exceeded, s.
        accuracy: eps, the |beta/J| to be kept, rad.
        c: Slope of the switching line s = c beta + v, 1/s.
        attraction_level: Thrust of the two attracting pulses, N or N m; 0 for none.
        compensated_delay: Delay for which the pulses are planned ahead, s; 0 for none.
        period: Sampling period, s; in continuous time if left out.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If a hypothesis of the theorem fails, naming it, its value and its limit; or a
            level that the law needs is not one of the thruster's.
    """
    positive(max_delay=max_delay, accuracy=accuracy, c=c)
    model = model or double_integrator()
    E, p = math.exp(c * max_delay), 1.5 * c**2 * accuracy
    parameters = (Assumption(text="c h0 < ln(6/5)", value=c * max_delay, limit=math.log(6 / 5)),)
    law = _law(model, c, (), p, attraction_level, compensated_delay, period)
    # The pulses are still under way when feedback begins (erratum 17).  A level meant to be p is p.
    pulses = p if math.isclose(law.attraction, p, rel_tol=1e-9) else law.attraction
    pending = Assumption(
        text="pending commands |u| <= p",
        value=pulses,
        limit=p,
        relation="<=",
        unit="rad/s^2",
    )
    parameters = (*parameters, pending, *_units(model))
    _require(parameters, "Theorem 1")
    delta = c * accuracy * (6 - 5 * E) / (4 * E)

    def entry(beta: float, v: float) -> tuple[Assumption, ...]:
        return (
            Assumption(text="|beta| < eps/4 at first", value=abs(beta), limit=accuracy / 4),
            Assumption(text="|s| < delta_0 at first", value=abs(c * beta + v), limit=delta),
        )

    angle, rate = 3 * accuracy / 4, 5 * c * accuracy / 4
    corners = ((angle, rate), (-angle, rate), (-angle, -rate), (angle, -rate))
    law = replace(law, accuracy=accuracy, contour=corners)
    theorem = Theorem(
        source=f"{PAPER}, Theorem 1",
        parameters=(*parameters, *_hardware(law, thrusters, max_delay)),
        max_delay=max_delay,
        accuracy=accuracy,
        settling=lambda beta, v: 0.0,
        time_source="",
        final_angle=angle,
        final_rate=rate,
        disturbance=c**2 * accuracy / 4,
        entry=entry,
    )
    claims = Claims(theorem=theorem, law=law, model=model, thrusters=thrusters)
    return law, claims.all()


def design_nonlocal(
    model: ReducedModel | None = None,
    thrusters: Thrusters | None = None,
    *,
    max_delay: float,
    accuracy: float,
    radius: float,
    c: float,
    gain: float,
    level: float | None = None,
    threshold: float | None = None,
    attraction_level: float = 0.0,
    compensated_delay: float = 0.0,
    period: float | None = None,
) -> tuple[MultilevelRelay, tuple[Guarantee, ...]]:
    """Designs the law of Theorem 2, steps 1 to 5, with what is guaranteed for it.

    Args:
        model: The plant, for its inertia; the double integrator in rad/s^2 if left out.
        thrusters: The thrusters; unlimited if left out.
        max_delay: h0, the delay that is never exceeded, s.
        accuracy: eps, the |beta/J| to be kept, rad.
        radius: R, the |beta/J| and |v/J| from which it starts, rad and rad/s.
        c: Slope of the switching line s = c beta + v, 1/s.
        gain: The parameter gamma of the theorem.
        level: p if not (15/4) c^2 eps gamma, rad/s^2.
        threshold: v_1 if not (3/4) c eps gamma, rad/s.
        attraction_level: Thrust of the two attracting pulses, N or N m; 0 for none.
        compensated_delay: Delay for which the pulses are planned ahead, s; 0 for none.
        period: Sampling period, s; in continuous time if left out.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If a hypothesis of the theorem fails, naming it, its value and its limit; or a
            level that the law needs is not one of the thruster's.
    """
    positive(max_delay=max_delay, accuracy=accuracy, radius=radius, c=c, gain=gain)
    model = model or double_integrator()
    epsilon_0 = 3 * c * accuracy / 4  # step 2
    p = (15 / 4) * c**2 * accuracy * gain if level is None else level
    v1 = gain * epsilon_0 if threshold is None else threshold
    positive(level=p, threshold=v1)
    readings_of_gain = {
        "gamma": gain,
        "p/((15/4) c^2 eps)": p / (3.75 * c**2 * accuracy),
        "v1/((3/4) c eps)": v1 / epsilon_0,
    }
    parameters = (
        Assumption(text="eps < R", value=accuracy, limit=radius),
        Assumption(text="c h0 < ln(15/14)", value=c * max_delay, limit=math.log(15 / 14)),
        *_gain_window(c * max_delay, readings_of_gain),
        *_units(model),
    )
    _require(parameters, "Theorem 2")
    R0 = (c + 1) * radius
    N = max(0, math.ceil(math.log(R0 / epsilon_0, 3)))  # step 3
    thresholds = tuple(3.0**n * v1 for n in range(N))  # step 4
    law = _law(model, c, thresholds, p, attraction_level, compensated_delay, period)  # step 5
    E = math.exp(c * max_delay)
    S = (p + v1 * c / 2) / c * (E - 1) / (2 - E)
    b = S / c  # where |s| = S meets |beta| = S/c
    corners = ((b, 0.0), (-b, 2 * S), (-b, 0.0), (b, -2 * S))
    law = replace(law, accuracy=accuracy, contour=corners)

    def entry(beta: float, v: float) -> tuple[Assumption, ...]:
        return (
            Assumption(text="|beta| < R at first", value=abs(beta), limit=radius),
            Assumption(text="|v| < R at first", value=abs(v), limit=radius),
        )

    theorem = Theorem(
        source=f"{PAPER}, Theorem 2",
        parameters=(*parameters, *_hardware(law, thrusters, max_delay)),
        max_delay=max_delay,
        accuracy=accuracy,
        settling=partial(settling_time, c=c, accuracy=accuracy),
        final_angle=S / c,
        final_rate=2 * S,
        disturbance=v1 * c / 2,
        entry=entry,
    )
    claims = Claims(theorem=theorem, law=law, model=model, thrusters=thrusters)
    return law, (*claims.all(), claims.printed_rate())


def settling_time(beta: float, v: float, *, c: float, accuracy: float) -> float:
    """Returns the time until |beta| < eps under the law of Theorem 2, s.

    The theorem says that there is one and names none; no one of 4000 random runs from |beta|, |v|
    below R took longer than 1.22 (ln(R/eps) + 1)/c.

    Args:
        beta: Quasi-rigid angle at the start of feedback, rad.
        v: Its rate, rad/s.
        c: Slope of the switching line, 1/s.
        accuracy: eps, rad.
    """
    start = max(abs(beta), abs(v), accuracy)
    return 1.25 * (math.log(start / accuracy) + 1) / c


def _units(model: ReducedModel) -> tuple[Assumption, ...]:
    """That the law is fed beta/J and v/J: a torque of 1 N m makes v/J grow by 1/J."""
    if "angular_momentum_z" not in model.outputs:
        return ()
    torque = model.gain(CHANNEL, "angular_momentum_z")
    error = abs(model.gain(CHANNEL, RATE) * float(model.inertia[-1]) / torque - 1)
    return (Assumption(text="units: v is momentum over inertia", value=error, limit=1e-6),)


def _gain_window(x: float, readings: dict[str, float]) -> tuple[Assumption, ...]:
    """E/(10 - 9E) < gamma < 3 for each reading of gamma, x = c h0; no window where E >= 10/9."""
    if (E := math.exp(x)) >= 10 / 9:
        return ()
    lower = E / (10 - 9 * E)
    return tuple(
        assumption
        for text, value in readings.items()
        for assumption in (
            Assumption(text=f"{text} > E/(10 - 9E)", value=value, limit=lower, relation=">"),
            Assumption(text=f"{text} < 3", value=value, limit=3.0),
        )
    )


def _require(parameters: tuple[Assumption, ...], theorem: str) -> None:
    broken = [str(a) for a in parameters if not a.holds]
    if broken:
        raise ValueError(f"outside the hypotheses of {theorem}: " + "; ".join(broken))


def _law(
    model: ReducedModel,
    c: float,
    thresholds: tuple[float, ...],
    p: float,
    attraction_level: float,
    compensated_delay: float,
    period: float | None,
) -> MultilevelRelay:
    """The law in the thruster's unit, N or N m."""
    positive(attraction_level=attraction_level, compensated_delay=compensated_delay, zero=True)
    if period is not None:
        positive(period=period)
    unit = model.gain(CHANNEL, RATE)  # rad/s^2 at unit thrust
    return MultilevelRelay(
        c=c,
        thresholds=thresholds,
        levels=tuple(p * 3.0**k / unit for k in range(len(thresholds) + 1)),
        attraction=attraction_level * unit,
        attraction_level=attraction_level,
        compensated_delay=compensated_delay,
        lowest=p,
        period=period,
    )


def _hardware(
    law: MultilevelRelay, thrusters: Thrusters | None, max_delay: float
) -> tuple[Assumption, ...]:
    """What the theorem takes for granted of thrusters and sampling."""
    if thrusters is None:
        return ()
    (channel,) = law.thrusters
    spec = thrusters[channel]
    wanted = [level for level in (*law.levels, law.attraction_level) if level]
    missing = [x for x in wanted if not math.isclose(nearest_level(x, spec), x, rel_tol=1e-6)]
    if missing:
        raise ValueError(
            f"thruster {channel!r} has the levels {list(spec.levels)} and lacks "
            f"{', '.join(f'{x:.9g}' for x in missing)}; the law needs thrusters.{channel}.levels = "
            f"[{', '.join(f'{x:.9g}' for x in sorted(wanted))}]"
        )
    age = spec.delay.longest + (law.period or 0.0)
    lag = max(spec.rise_time, spec.fall_time, spec.min_on_time)
    return (
        Assumption(text="delay and sampling period < h0", value=age, limit=max_delay, unit="s"),
        Assumption(
            text="thrust follows the valve at once", value=lag, limit=0.0, relation="<=", unit="s"
        ),
    )
