"""The relay of Theorem 2 fed by an observer: beta and v from the bus angle, with or without rate.

Bus sensors see gamma, not beta: the booms are in between.  What an observer of the machine makes
of them, (beta^, v^), obeys v^' = u + d2, beta^' = v^ + d1 with nothing but the observer's
corrections in d1, d2; so Theorem 2 holds for it with |f| replaced by d2 + 2 c d1, and
|beta| <= |beta^| + e with the observer's error e.  (Own extension of Efremov et al. 2006.)
"""

import math
from functools import partial
from typing import Literal

from controllers.efremov import design_nonlocal, settling_time
from controllers.efremov_claims import PAPER, Claims, Theorem
from controllers.efremov_relay import ANGLE, RATE, MultilevelRelay
from controllers.observer import Errors, ObservedLaw, Unknown, design_observer
from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Assumption, Guarantee
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.thrusters import Thrusters

CHANNEL = "thruster_z"
SENSORS = {"angle": ("attitude_z",), "angle and rate": ("attitude_z", "rate_z")}


def design_observed(
    model: ReducedModel,
    thrusters: Thrusters,
    *,
    max_delay: float,
    accuracy: float,
    radius: float,
    c: float,
    gain: float,
    period: float,
    disturbance: float,
    sensors: Literal["angle", "angle and rate"] = "angle and rate",
    delay_error: float = 0.0,
    angle_noise: float = 2e-5,
    rate_noise: float = 2e-5,
    level: float | None = None,
    threshold: float | None = None,
) -> tuple[ObservedLaw, tuple[Guarantee, ...]]:
    """Designs the relay of Theorem 2 with an observer, and bounds what the observer costs.

    Args:
        model: The plant; its modes are the observer's.
        thrusters: The thrusters; the observer assumes their mean delay.
        max_delay: h0, which delay and sampling period together never exceed, s.
        accuracy: eps, the |beta/J| to be kept, rad.
        radius: R, the |beta/J| and |v/J| from which it starts, rad and rad/s.
        c: Slope of the switching line, 1/s.
        gain: The parameter gamma of the theorem.
        period: Sampling period T, s.
        disturbance: Bound of |f/J|, rad/s^2.
        sensors: What is measured of the bus: `angle`, or `angle and rate`.
        delay_error: How far the real delay may be from the assumed one, s.
        angle_noise: Bound of the error of the angle sensor, rad.
        rate_noise: Bound of the error of the rate sensor, rad/s.
        level: p if not (15/4) c^2 eps gamma, rad/s^2.
        threshold: v_1 if not (3/4) c eps gamma, rad/s.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: As `design_nonlocal`; or if a bound that the observer needs is not positive, or
            the modes cannot be seen by the sensors.
    """
    positive(period=period, disturbance=disturbance, angle_noise=angle_noise, rate_noise=rate_noise)
    positive(delay_error=delay_error, zero=True)
    relay, promises = design_nonlocal(
        model, thrusters, max_delay=max_delay, accuracy=accuracy, radius=radius, c=c, gain=gain,
        level=level, threshold=threshold, period=period,
    )  # fmt: skip
    names = SENSORS[sensors]
    unit = model.gain(CHANNEL, RATE)
    observer, errors = design_observer(
        model, thrusters, channels=relay.thrusters, sensors=names, fed=relay.sensors, period=period,
        unknown=Unknown(
            thrust=(disturbance / unit,),
            impulse=(2 * relay.lowest * delay_error / unit,),
            noise=(angle_noise, rate_noise)[: len(names)],
            steady=(0.0,),
        ),
    )  # fmt: skip
    law = ObservedLaw(law=relay, observer=observer)
    inherited = promises[0].assumptions  # of the theorem, of thrusters and sampling, of units
    bounds = max_delay, accuracy, radius, disturbance, delay_error
    return law, _claims(relay, model, thrusters, errors, inherited, *bounds)


def _claims(
    relay: MultilevelRelay,
    model: ReducedModel,
    thrusters: Thrusters,
    errors: Errors,
    inherited: tuple[Assumption, ...],
    max_delay: float,
    accuracy: float,
    radius: float,
    disturbance: float,
    delay_error: float,
) -> tuple[Guarantee, ...]:
    c, E, v1 = relay.c, math.exp(relay.c * max_delay), relay.thresholds[0]
    (angle, rate), (d1, d2) = errors.error.tolist(), errors.jumps.tolist()
    f = d2 + 2 * c * d1
    S = (relay.lowest + f) / c * (E - 1) / (2 - E)
    final_angle = (S + d1) / c + angle
    parameters = (
        *inherited,
        Assumption(
            text="d2 + 2 c d1 < v1 c/2: what the observer costs", value=f, limit=v1 * c / 2,
            unit="rad/s^2",
        ),
        Assumption(
            text="(S + d1)/c + error < eps", value=final_angle, limit=accuracy, unit="rad"
        ),
    )  # fmt: skip

    def entry(beta: float, v: float) -> tuple[Assumption, ...]:
        return (
            Assumption(text="|beta| + error < R", value=abs(beta) + angle, limit=radius),
            Assumption(text="|v| + error < R", value=abs(v) + rate, limit=radius),
        )

    theorem = Theorem(
        source=f"{PAPER}, Theorem 2, with observer",
        parameters=parameters,
        max_delay=max_delay,
        accuracy=accuracy,
        settling=partial(settling_time, c=c, accuracy=accuracy),
        final_angle=final_angle,
        final_rate=2 * S + d1 + rate,
        disturbance=disturbance,
        entry=entry,
        assumed_delay=(thrusters[CHANNEL].delay.mean, delay_error),
        estimated={ANGLE: angle, RATE: rate},
    )
    return Claims(theorem=theorem, law=relay, model=model, thrusters=thrusters).all()
