"""Designs of Burkov (1998) that hold a position: rigid mechanisms and flexible joints."""

import math
from dataclasses import replace
from functools import partial
from typing import Literal

import numpy as np

from controllers.burkov_charts import mechanism_charts
from controllers.burkov_claims import PAPER, Start, Theorem
from controllers.burkov_energy import flexible_terms, position_terms
from controllers.burkov_laws import Position
from controllers.burkov_lyapunov import gravity_condition, rests
from controllers.gains import Numbers, finite_entries, positive_definite, positive_entries
from controllers.velocity_filter import Hold, SampledLaw, sampled
from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Assumption, Guarantee
from spacecraft_sim.loop_margins import close
from spacecraft_sim.mechanisms import (
    FlexibleMechanism,
    Mechanism,
    Vector,
    linear_flexible,
    linear_mechanism,
)
from spacecraft_sim.thrusters import Thrusters

Gravity = Literal["at the position", "at the target", "none"]


def position(
    model: Mechanism | None = None,
    thrusters: Thrusters | None = None,
    *,
    target: tuple[float, ...],
    K1: tuple[float, ...] | tuple[tuple[float, ...], ...],
    K2: tuple[float, ...],
    K3: tuple[float, ...],
    gravity: Gravity = "at the position",
    hold: Hold = "first-order hold",
    period: float = 1e-3,
    accuracy: float = 1e-3,
) -> tuple[SampledLaw, tuple[Guarantee, ...]]:
    """Designs the law that holds a position by joint angles alone, (2.1) or (2.4) with (2.2).

    Args:
        model: The mechanism; without it the law knows no gravity and nothing is guaranteed.
        thrusters: The motors, by name; any if left out.
        target: q_p, rad.
        K1: Stiffness, its diagonal or its rows, N m/rad.
        K2: Damping over cutoff, N m/rad.
        K3: Cutoffs of the filter, 1/s.
        gravity: Where the torque against gravity is taken: at the measured position, (2.1), stable
            in the large; at the target, (2.4), stable nearby if K1 + g_q(q_p) > 0; nowhere.
        hold: What the filter assumes of an angle between samples.
        period: Sampling period, s.
        accuracy: |q - q_p| that is asked for in the end, rad.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If a gain is not positive, or K1 + g_q(q_p) is not, with the value at fault, or
            there are more or fewer of them than joints.
    """
    positive(accuracy=accuracy)
    n = len(target) if model is None else model.count
    if model is None and gravity != "none":
        raise ValueError(f'gravity = "{gravity}" needs a mechanism; without one set it to "none"')
    q_p = finite_entries("target", target, n)
    formula = Position(
        target=q_p,
        K1=positive_definite("K1", K1, n),
        K2=positive_entries("K2", K2, n),
        mechanism=model if gravity == "at the position" else None,
        bias=_weight(model, q_p) if model and gravity == "at the target" else (0.0,) * n,
    )
    law = sampled(
        formula,
        cutoffs=positive_entries("K3", K3, n),
        hold=hold,
        period=period,
        sensors=tuple(f"joint_{k + 1}" for k in range(n)),
        channels=tuple(f"motor_{k + 1}" for k in range(n)),
        thrusters=thrusters,
    )
    if model is None:
        return law, ()
    rates = tuple(f"{name}_rate" for name in law.sensors)
    conditions: tuple[Assumption, ...] = ()
    basin = math.inf
    if gravity != "at the position":
        conditions = (gravity_condition(formula, model),)
        if not conditions[0].holds:
            raise ValueError(f"outside the hypotheses of Theorem 2.2: {conditions[0]}")
        if gravity == "none":
            conditions += (_weightless(model, q_p),)
        if others := rests(formula, model)[1:]:
            basin = others[0].energy
            counts = ", ".join(str(rest.unstable) for rest in others)
            conditions += (
                Assumption(
                    text=f"V at the lowest of {len(others)} other equilibria that were found, with "
                    f"{counts} unstable directions",
                    value=basin,
                    limit=0.0,
                    relation=">",
                    unit="J",
                ),
            )

    loop = close(law, linear_mechanism(model, q=q_p))

    terms = partial(position_terms, formula, model)
    law = replace(law, charts=mechanism_charts(law, terms, rates, rates))

    def energy(y: Vector, w: Vector, v: Vector) -> float:
        return sum(terms(y, w, v).values())

    def entry(start: Start) -> tuple[Assumption, ...]:
        V0 = energy(*start)
        text = "V(0) below every other equilibrium that was found"
        return (Assumption(text=text, value=V0, limit=basin, unit="J"),)

    theorem = Theorem(
        source=f"{PAPER}, Theorem {'2.2' if conditions else '2.1'}",
        law=law,
        assumptions=conditions,
        moving=rates,
        speeds=rates,
        energy=energy,
        deviation=lambda y, v: math.dist(y, q_p),
        unit="rad",
    )
    if conditions:
        ends = theorem.ends(accuracy=accuracy, loops=(loop,), entry=entry)
        return law, (theorem.falls(), ends)
    least = float(np.linalg.eigvalsh(formula.K1)[0])
    stays = theorem.stays(reach=lambda start, work: math.sqrt(2 * (energy(*start) + work) / least))
    return law, (theorem.falls(), theorem.ends(accuracy=accuracy, loops=(loop,)), stays)


def flexible_joint(
    model: FlexibleMechanism | None = None,
    thrusters: Thrusters | None = None,
    *,
    target: tuple[float, ...],
    K0: tuple[float, ...],
    K2: tuple[float, ...],
    K3: tuple[float, ...],
    hold: Hold = "first-order hold",
    period: float = 1e-3,
    accuracy: float = 1e-3,
) -> tuple[SampledLaw, tuple[Guarantee, ...]]:
    """Designs the law that holds an arm with elastic joints by its rotors alone, (4.2) with (4.3).

    Args:
        model: Links, rotors and springs; without it nothing is guaranteed.
        thrusters: The motors, by name; any if left out.
        target: q_1p = q_2p, with no spring under load, rad.
        K0: Stiffness, N m/rad.
        K2: Damping over cutoff, N m/rad.
        K3: Cutoffs of the filter, 1/s.
        hold: What the filter assumes of an angle between samples.
        period: Sampling period, s.
        accuracy: Distance of links and rotors that is asked for in the end, rad.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If a gain is not positive, with its value.
    """
    positive(accuracy=accuracy)
    n = len(target) if model is None else model.links.count
    q_p = finite_entries("target", target, n)
    formula = Position(
        target=q_p,
        K1=positive_definite("K0", positive_entries("K0", K0, n), n),
        K2=positive_entries("K2", K2, n),
        mechanism=None,
        bias=(0.0,) * n,
    )
    law = sampled(
        formula,
        cutoffs=positive_entries("K3", K3, n),
        hold=hold,
        period=period,
        sensors=tuple(f"rotor_{k + 1}" for k in range(n)),
        channels=tuple(f"motor_{k + 1}" for k in range(n)),
        thrusters=thrusters,
    )
    if model is None:
        return law, ()
    links = tuple(f"link_{k + 1}" for k in range(n))
    rates = {part: tuple(f"{part}_{k + 1}_rate" for k in range(n)) for part in ("link", "rotor")}
    # V >= x Q x/2 with the deviations x of a rotor and its link.
    least = min(
        float(np.linalg.eigvalsh([[K + k, -k], [-k, k]])[0])
        for K, k in zip(K0, model.stiffnesses, strict=True)
    )
    loop = close(law, linear_flexible(model, q=q_p))

    terms = partial(flexible_terms, formula, model)
    moving = (*links, *rates["link"], *rates["rotor"])
    law = replace(law, charts=mechanism_charts(law, terms, moving, rates["rotor"]))

    def energy(y: Vector, w: Vector, moving: Vector) -> float:
        return sum(terms(y, w, moving).values())

    theorem = Theorem(
        source=f"{PAPER}, Theorem 4.1",
        law=law,
        assumptions=(_weightless(model.links, q_p),),
        moving=moving,
        speeds=rates["rotor"],
        energy=energy,
        deviation=lambda y, z: math.hypot(math.dist(y, q_p), math.dist(z[:n], q_p)),
        unit="rad",
    )
    stays = theorem.stays(reach=lambda start, work: math.sqrt(2 * (energy(*start) + work) / least))
    return law, (theorem.falls(), theorem.ends(accuracy=accuracy, loops=(loop,)), stays)


def _weight(mechanism: Mechanism, q: Numbers) -> Numbers:
    return tuple(float(x) for x in mechanism.gravity(q))


def _weightless(mechanism: Mechanism, target: Numbers) -> Assumption:
    """That gravity does nothing, tried where the arm is asked to be and a radian off."""
    torques = [
        abs(x) for off in (0.0, 1.0) for x in _weight(mechanism, tuple(q + off for q in target))
    ]
    return Assumption(
        text="no torque of gravity", value=max(torques), limit=1e-9, relation="<=", unit="N m"
    )
