"""Designs of Burkov (1998), section 5: the attitude and the spin of a rigid body.

Everything is in principal axes of inertia: s1, s2, s3 are inertial unit vectors resolved in them,
rows of `body_axes`; om = (p, q, r) = `rate_x`, `rate_y`, `rate_z`; and the torques act about them.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from controllers.burkov_charts import body_charts, spin_charts
from controllers.burkov_claims import PAPER, Start, Theorem, unstable
from controllers.burkov_energy import Body, body_terms, spin_terms
from controllers.burkov_laws import BodyVectors, BodyVectorsAndRates, Spin
from controllers.burkov_lyapunov import Vector, attitudes, basin, spin_condition, spin_energy
from controllers.gains import Numbers, orthogonal_axes, positive_entries
from controllers.velocity_filter import Hold, SampledLaw, sampled
from spacecraft_sim.checks import positive
from spacecraft_sim.dynamics import linear_plant
from spacecraft_sim.euler_poisson import RigidBody
from spacecraft_sim.guarantee import Assumption, Guarantee
from spacecraft_sim.loop_margins import Loop, close
from spacecraft_sim.thrusters import Thrusters

Array = np.ndarray
Vector3 = tuple[float, float, float]
RATES = ("rate_x", "rate_y", "rate_z")
TORQUES = ("torque_x", "torque_y", "torque_z")
VECTORS = tuple(f"{s}_{axis}" for s in ("s2", "s3") for axis in "xyz")


def body_axes(model: Any, data: Any, body: int | str) -> Array:
    """Returns the rotation whose rows are s1, s2, s3 of a body in MuJoCo, shape (3, 3).

    It takes vectors in principal axes of inertia to the world: R_wb R_i with R_i of `body_iquat`.

    Args:
        model: The compiled model.
        data: Its data, positions up to date.
        body: The body, by name or number.
    """
    k = model.body(body).id if isinstance(body, str) else body
    return np.array(data.ximat[k], dtype=float).reshape(3, 3)


def body_vectors(
    model: Body | None = None,
    thrusters: Thrusters | None = None,
    *,
    r2: Vector3,
    r3: Vector3,
    k2: float,
    k3: float,
    G: Vector3 | None = None,
    G2: Vector3 | None = None,
    G3: Vector3 | None = None,
    D2: Vector3 | None = None,
    D3: Vector3 | None = None,
    hold: Hold = "first-order hold",
    period: float = 1e-3,
    accuracy: float = 1e-3,
) -> tuple[SampledLaw, tuple[Guarantee, ...]]:
    """Designs the law that turns s2 to r2 and s3 to r3: (5.4) with G, (5.8) with the other four.

    Args:
        model: The body, for its inertia; without it nothing is guaranteed.
        thrusters: The actuators, by name; any if left out.
        r2: Where s2 is to point, in principal axes.
        r3: Where s3 is to point, at a right angle to r2.
        k2: Stiffness of s2, N m.
        k3: Stiffness of s3, other than k2, N m.
        G: Damping with measured rates, (5.4), N m s.
        G2: Damping over cutoff of s2, (5.8), N m.
        G3: Damping over cutoff of s3, (5.8), N m.
        D2: Cutoffs of the filter of s2, (5.9), 1/s.
        D3: Cutoffs of the filter of s3, (5.9), 1/s.
        hold: What the filters assume of a vector between samples.
        period: Sampling period, s.
        accuracy: |(s2 - r2, s3 - r3)| that is asked for in the end.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If a gain is not positive, k2 = k3, r2 and r3 are not orthogonal unit vectors,
            or the damping is given neither as G nor as the other four.
    """
    positive(k2=k2, k3=k3, accuracy=accuracy)
    if math.isclose(k2, k3, rel_tol=1e-9):
        raise ValueError(
            f"k2 = k3 = {k2:.9g}: with equal gains the other equilibria are circles, and the "
            "theorems need k2 /= k3"
        )
    axes = orthogonal_axes(r2=r2, r3=r3)
    r = (axes[0], axes[1])
    filters = {"G2": G2, "G3": G3, "D2": D2, "D3": D3}
    given = {name: x for name, x in filters.items() if x is not None}
    cutoffs: tuple[float, ...] = ()
    formula: BodyVectors | BodyVectorsAndRates
    if G is not None and not given:
        formula = BodyVectorsAndRates(r=r, k=(k2, k3), G=positive_entries("G", G, 3))
    elif G is None and len(given) == len(filters):
        g2, g3, d2, d3 = (positive_entries(name, x, 3) for name, x in given.items())
        formula, cutoffs = BodyVectors(r=r, k=(k2, k3), G=(g2, g3)), (*d2, *d3)
    else:
        names = [*(["G"] if G is not None else []), *given]
        raise ValueError(
            "damping is given as G, with measured rates, or as G2, G3, D2, D3, without; "
            f"here: {', '.join(names) or 'nothing'}"
        )
    rated = isinstance(formula, BodyVectorsAndRates)
    law = sampled(
        formula,
        cutoffs=cutoffs,
        hold=hold,
        period=period,
        sensors=(*VECTORS, *RATES) if rated else VECTORS,
        channels=TORQUES,
        thrusters=thrusters,
    )
    if model is None:
        return law, ()
    goal = np.ravel(r)
    terms = partial(body_terms, formula, model)
    law = replace(law, charts=body_charts(law, formula, terms, RATES))

    def energy(y: Vector, w: Vector, om: Vector) -> float:
        return sum(terms(y, w, om).values())

    def entry(start: Start) -> tuple[Assumption, ...]:
        text = "V(0) < 2 min(k2, k3): no other equilibrium within reach"
        return (Assumption(text=text, value=energy(*start), limit=basin(formula), unit="J"),)

    theorem = Theorem(
        source=f"{PAPER}, Theorem {'5.1' if rated else '5.2'}",
        law=law,
        assumptions=(),
        moving=RATES,
        speeds=RATES,
        energy=energy,
        deviation=lambda y, om: math.dist(y[:6], goal),
        unit="",
    )
    loops = [_pair_loop(law, model, a.signs, r) for a in attitudes(formula)]
    others = tuple(
        unstable(loop, "({}r2, {}r3)".format(*("+-"[sign < 0] for sign in a.signs)), a.energy)
        for loop, a in zip(loops[1:], attitudes(formula)[1:], strict=True)
    )
    return law, (
        theorem.falls(),
        theorem.ends(accuracy=accuracy, loops=loops[:1], others=others, entry=entry),
        theorem.stays(
            reach=lambda start, work: math.sqrt(2 * (energy(*start) + work) / min(k2, k3))
        ),
    )


def permanent_rotation(
    model: Body,
    thrusters: Thrusters | None = None,
    *,
    spin: float,
    alpha: float,
    beta: float,
    gamma: float,
    k: float,
    period: float = 1e-3,
    accuracy: float = 1e-3,
) -> tuple[SampledLaw, tuple[Guarantee, ...]]:
    """Designs the law that spins a body about its first principal axis, pointed along s1, (5.18).

    Args:
        model: The body, for its inertia.
        thrusters: The actuators, by name; any if left out.
        spin: p_p, rad/s.
        alpha: Damping of the spin, N m s.
        beta: Damping about y, N m s.
        gamma: Damping about z, N m s.
        k: Stiffness of s1, N m.
        period: Sampling period, s.
        accuracy: |s1 - e_x| that is asked for in the end.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If a gain is not positive, or (5.19) is not met.
    """
    positive(alpha=alpha, beta=beta, gamma=gamma, k=k, accuracy=accuracy)
    formula = Spin(alpha=alpha, beta=beta, gamma=gamma, k=k, spin=_finite(spin=spin))
    condition = _required(formula, model, spin, "Theorem 5.3, (5.19)")
    law = _spinning(formula, model, period, thrusters)

    def energy(y: Vector, w: Vector, z: Vector) -> float:
        return spin_energy(formula, model, z[:3], z[3:], spin)

    def entry(start: Start) -> tuple[Assumption, ...]:
        text = "V(0) < 2 k: the other equilibrium is out of reach"
        return (Assumption(text=text, value=energy(*start), limit=2 * k, unit="J"),)

    theorem = _spin_theorem("Theorem 5.3", law, (condition,), energy)
    return law, (
        theorem.falls(),
        theorem.ends(
            accuracy=accuracy,
            loops=(_loop(law, model, spin),),
            others=(_upside_down(law, model, spin, k),),
            entry=entry,
        ),
        theorem.stays(reach=lambda start, work: math.sqrt(2 * (energy(*start) + work) / k)),
    )


def two_torques(
    model: Body,
    thrusters: Thrusters | None = None,
    *,
    spin: float,
    beta: float,
    gamma: float,
    k: float,
    period: float = 1e-3,
    accuracy: float = 1e-3,
) -> tuple[SampledLaw, tuple[Guarantee, ...]]:
    """Designs the law that points the first principal axis along s1 by two torques, (5.20).

    Nothing acts on the spin, which ends somewhere.  The paper has every spin stable; that is false
    for fast ones, and here c^2 (B - C)^2 < 4 beta gamma is asked for.

    Args:
        model: The body, for its inertia.
        thrusters: The actuators, by name; any if left out.
        spin: Largest |c| for which the law is to be good, rad/s.
        beta: Damping about y, N m s.
        gamma: Damping about z, N m s.
        k: Stiffness of s1, N m.
        period: Sampling period, s.
        accuracy: |s1 - e_x| that is asked for in the end.

    Returns:
        The law and its guarantees, the printed claim among them.

    Raises:
        ValueError: If a gain is not positive, or the condition is not met.
    """
    positive(beta=beta, gamma=gamma, k=k, accuracy=accuracy)
    formula = Spin(alpha=None, beta=beta, gamma=gamma, k=k, spin=_finite(spin=spin))
    condition = _required(formula, model, spin, "Theorem 5.4 as corrected")
    law = _spinning(formula, model, period, thrusters)
    loops = [_loop(law, model, c) for c in (0.0, spin)]

    def member(start: Start) -> float:  # V about the spin that the flight starts with
        _, _, z = start
        return spin_energy(formula, model, z[:3], z[3:], z[3])

    def slow(start: Start) -> tuple[Assumption, ...]:
        c = float(start.moving[3])
        return (replace(spin_condition(formula, model, c), text=f"{_SLOW} at the start"),)

    def entry(start: Start) -> tuple[Assumption, ...]:
        text = "V_c(0) < 2 k: s_x = -1 is out of reach"
        return (*slow(start), Assumption(text=text, value=member(start), limit=2 * k, unit="J"))

    def reach(start: Start, work: float) -> float:
        return math.sqrt(2 * (member(start) + work) / k)

    def energy(y: Vector, w: Vector, z: Vector) -> float:
        return spin_energy(formula, model, z[:3], z[3:], 0.0)

    theorem = _spin_theorem("Theorem 5.4", law, (condition,), energy)
    printed = _spin_theorem("Theorem 5.4", law, (), energy)
    return law, (
        theorem.falls(),
        theorem.ends(
            accuracy=accuracy,
            loops=loops,
            others=tuple(_upside_down(law, model, c, k) for c in (0.0, spin)),
            entry=entry,
        ),
        theorem.stays(reach=reach, entry=slow, detail="V_c <= V_c(0) with c = p(0)"),
        printed.stays(
            reach=reach,
            claim="distance from the goal at all times, whatever the spin, as printed",
            detail="as printed, false for fast spins",
        ),
    )


_SLOW = "c^2 (B - C)^2 < 4 beta gamma"
_S1 = ("s1_x", "s1_y", "s1_z")


def _finite(**values: float) -> float:
    ((name, value),) = values.items()
    if not math.isfinite(value):
        raise ValueError(f"{name} = {value!r} must be finite")
    return float(value)


def _required(formula: Spin, body: Body, c: float, theorem: str) -> Assumption:
    condition = spin_condition(formula, body, c)
    if not condition.holds:
        _, B, C = body.inertia
        fastest = 2 * math.sqrt(formula.beta * formula.gamma) / abs(B - C)
        raise ValueError(
            f"outside the hypotheses of {theorem}: {condition}; with these gains |spin| must be "
            f"below {fastest:.6g} rad/s, at this spin beta gamma above {condition.value / 4:.6g}"
        )
    return condition


def _spinning(formula: Spin, model: Body, period: float, thrusters: Thrusters | None) -> SampledLaw:
    whole = formula.alpha is not None
    law = sampled(
        formula,
        cutoffs=(),
        hold="first-order hold",
        period=period,
        sensors=(*_S1[1:], *RATES[1:], *(RATES[:1] if whole else ())),
        channels=TORQUES if whole else TORQUES[1:],
        thrusters=thrusters,
    )
    c = formula.spin if whole else 0.0  # 0: the printed V
    terms = partial(spin_terms, formula, model, c)
    return replace(law, charts=spin_charts(law, terms, _S1, RATES))


def _spin_theorem(
    name: str,
    law: SampledLaw,
    assumptions: tuple[Assumption, ...],
    energy: Callable[[Vector, Vector, Vector], float],
) -> Theorem:
    return Theorem(
        source=f"{PAPER}, {name}",
        law=law,
        assumptions=assumptions,
        moving=(*_S1, *RATES),
        speeds=RATES if len(law.thrusters) == 3 else RATES[1:],
        energy=energy,
        deviation=lambda y, z: math.dist(z[:3], (1.0, 0.0, 0.0)),
        unit="",
    )


def _pair_loop(
    law: SampledLaw, model: Body, signs: tuple[int, int], r: tuple[Numbers, Numbers]
) -> Loop:
    """The linear loop at s2 = +-r2, s3 = +-r3."""
    body = RigidBody(inertia=model.inertia, vectors=("s2", "s3"))
    state = np.concatenate([np.zeros(3), np.repeat(signs, 3) * np.ravel(r)])
    plant = linear_plant(body, state=state, torques=np.zeros(3), basis=body.tangent(state))
    return close(law, plant)


def _upside_down(law: SampledLaw, model: Body, c: float, k: float) -> Assumption:
    """That s_x = -1, p = c is unstable."""
    return unstable(_loop(law, model, c, side=-1), f"s_x = -1, p = {c:.6g} rad/s", 2 * k)


def _loop(law: SampledLaw, model: Body, c: float, *, side: int = 1) -> Loop:
    """The linear loop at s_x = side, p = c, without the spin where no torque acts on it."""
    body = RigidBody(inertia=model.inertia, vectors=("s1",))
    freedoms = [1, 2, 4, 5] if len(law.thrusters) == 2 else [0, 1, 2, 4, 5]
    plant = linear_plant(
        body,
        state=np.array([c, 0.0, 0.0, side, 0.0, 0.0]),
        torques=np.zeros(3),
        basis=np.eye(6)[:, freedoms],
    )
    return close(law, plant)
