"""A manoeuvre that leaves no vibration, flown open loop by relay thrusters.

Yu. N. Gorelov, "Synthesis of null-finite optimal control for a double integrator with an attached
oscillator by the method of moments" (in Russian).

In quasi-rigid coordinates bus and booms are x'' = u and y_k'' + b_k y_k' + w_k^2 y_k = u with
u = torque/J: exactly the plant of `gorelov`, for as many modes as the plan shall leave at rest.
The plan is made when the flight begins, from the measured quasi-rigid angle and rate.  A delay that
is the same for all commands shifts the manoeuvre as a whole; the plan is made for the state to
which the plant will have drifted when the first pulse arrives.  When the plan has acted, a closing
law may take over what remains: the relay of Efremov, Polyakov & Strygin (2006), Theorem 1.

Guaranteed on the plant of the plan, if the thruster has its levels: the end at the target with
every planned mode at rest.
"""

import math
from typing import get_args

from controllers import efremov
from controllers.axis import channel
from controllers.manoeuvre_claims import Claims
from controllers.manoeuvre_law import SHAPERS, Manoeuvre, Profile
from spacecraft_sim.checks import choices, positive
from spacecraft_sim.guarantee import Guarantee
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.thrusters import Thrusters


def design(
    model: ReducedModel,
    thrusters: Thrusters | None = None,
    *,
    profile: Profile,
    angle: float = 0.0,
    rate: float = 0.0,
    duration: float | None = None,
    level: float | None = None,
    modes: int = 1,
    slots: int = 40,
    accuracy: float = 1e-3,
    closing_c: float | None = None,
    closing_accuracy: float | None = None,
    closing_max_delay: float | None = None,
) -> tuple[Manoeuvre, tuple[Guarantee, ...]]:
    """Designs a manoeuvre about z that leaves the planned modes at rest.

    Args:
        model: The plant, for its inertia and its modes.
        thrusters: The thrusters; ideal if left out.
        profile: min_time, min_fuel, min_peak or min_energy of Gorelov; or, for comparison,
            bang_bang, zv, zvd or ei.
        angle: Quasi-rigid angle at the end, rad.
        rate: Its rate at the end, rad/s.
        duration: T, s; an outcome for min_time, and for a shaper that it is left out of.
        level: Thrust of the pulses, N or N m; the thruster's highest if left out.
        modes: How many modes of the plant are left at rest, the lowest first.
        slots: How many pulses stand for the smooth control of least energy.
        accuracy: What the angles shall keep when the manoeuvre is over, rad.
        closing_c: c of the closing relay, 1/s; no closing law if left out.
        closing_accuracy: Its accuracy, rad.
        closing_max_delay: Its h0, s.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If the profile or a mode does not exist, or a number is out of range.
    """
    if profile not in get_args(Profile):
        raise ValueError(choices("profile", profile, get_args(Profile), where="the planners"))
    if not 1 <= modes <= len(model.frequencies):
        raise ValueError(
            f"modes = {modes}, but the reduced model has {len(model.frequencies)}: set "
            "controller.modes within them, or a larger reduced.modes"
        )
    positive(accuracy=accuracy, slots=slots)
    if profile not in ("min_time", *SHAPERS) and duration is None:
        raise ValueError(f"profile {profile!r} needs controller.duration, s")
    if duration is not None:
        positive(duration=duration)
    found = channel(model, thrusters, feedback="quasi_rigid")
    highest = found.spec.levels[-1] if found.spec else math.inf
    if level is None and math.isinf(highest):
        raise ValueError("controller.level is needed where there is no thruster to tell it")
    closing = None
    given = {
        "closing_c": closing_c,
        "closing_accuracy": closing_accuracy,
        "closing_max_delay": closing_max_delay,
    }
    if any(value is not None for value in given.values()):
        missing = [name for name, value in given.items() if value is None]
        if closing_c is None or closing_accuracy is None or closing_max_delay is None:
            raise ValueError(f"a closing law needs all of {', '.join(given)}; missing: {missing}")
        if rate:
            raise ValueError(f"rate = {rate} rad/s: the closing law holds an angle, not a rate")
        closing, _ = efremov.design_local(
            model, thrusters, max_delay=closing_max_delay, accuracy=closing_accuracy, c=closing_c
        )
    law = Manoeuvre(
        profile=profile,
        angle=angle,
        rate=rate,
        omega=tuple(model.frequencies[:modes].tolist()),
        damping=tuple(model.D.diagonal()[:modes].tolist()),
        unit=found.unit,
        level=highest if level is None else level,
        duration=duration,
        slots=slots,
        delay=found.spec.delay.mean if found.spec else 0.0,
        closing=closing,
        sensors=found.sensors,
        thrusters=(found.thruster,),
    )
    return law, Claims(law=law, model=model, thrusters=thrusters, accuracy=accuracy).all()


__all__ = ["SHAPERS", "Manoeuvre", "Profile", "design"]
