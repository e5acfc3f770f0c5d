"""Manoeuvres flown side by side: what each leaves of vibration, and what it costs."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from controllers import gorelov, input_shaping
from controllers.plans import Plan, residual_vibration
from spacecraft_sim import mission
from spacecraft_sim.reduced import ReducedModel
from spacecraft_sim.scenario import Scenario

SCENARIO = "gorelov-slew"
LEVELS_OF_FUEL = 1.5  # thrust over the least peak that the plan of least fuel is given
ALL_MODES = 8
PROFILES = ("min_energy", "min_peak", "min_fuel", "bang_bang", "zv", "zvd", "ei")
SWING = "elastic swing of the bus, from the end on"


@dataclass(frozen=True, slots=True, kw_only=True)
class Result:
    """One manoeuvre.

    Attributes:
        profile: How it was planned.
        modes: Modes that the plan leaves at rest.
        duration: T, s.
        peak: Largest thrust, N m.
        fuel: Impulse spent, N m s.
        mujoco: Elastic swing of the bus that the full machine keeps, rad.
        reduced: The same of a linear model with all modes that count, rad.
        error: Angle by which the full machine misses the target, rad.
    """

    profile: str
    modes: int
    duration: float
    peak: float
    fuel: float
    mujoco: float
    reduced: float
    error: float


def scenario(machine: str, settings: tuple[str, ...] = ()) -> Scenario:
    """Returns the slew on a machine, beside a reduced model with all modes that count.

    Args:
        machine: Name of a spacecraft.
        settings: Further `key=value` assignments.
    """
    fixed = (f"spacecraft={machine}", f"reduced.modes={ALL_MODES}")
    return mission.load_scenario(SCENARIO, (*fixed, *settings))


def flown(base: Scenario, table: dict[str, Any], **actual: Any) -> Result:
    """Plans a manoeuvre, gives the thruster its levels, and flies it on both plants.

    Args:
        base: The scenario.
        table: The controller table.
        **actual: What only the full machine has: `booms` and `thrusters` tables.
    """
    table = {**base.controller, **table}
    law = mission.assemble(base.model_copy(update={"controller": table})).controller
    plan = law.plan(0.0, 0.0)
    levels = sorted({abs(x) for x in (plan.levels / law.unit).round(12).tolist() if x})
    document = base.model_dump(mode="json", exclude_none=True)
    document |= {"controller": table, **base.changes(), "actual": actual}
    document["thrusters"] = {"thruster_z": {**document["thrusters"].get("thruster_z", {}),
                                            "levels": levels}}  # fmt: skip
    ready = mission.assemble(Scenario.model_validate(document))
    verdicts = ready.judge(ready.fly(), ready.fly("reduced"))
    by_claim = {v.claim: v for v in verdicts.verdicts}
    reduced = {v.claim: v for v in verdicts.reduced}
    return Result(
        profile=table["profile"],
        modes=table["modes"],
        duration=plan.duration,
        peak=plan.peak / law.unit,
        fuel=plan.fuel / law.unit,
        mujoco=by_claim[SWING].measured,
        reduced=reduced[SWING].measured,
        error=by_claim["quasi-rigid angle at the target, from the end on"].measured,
    )


def tables(base: Scenario, duration: float, modes: int) -> Iterator[dict[str, Any]]:
    """Yields controller tables of all profiles at one duration.

    Args:
        base: The scenario.
        duration: T, s.
        modes: Modes that the plans leave at rest.
    """
    model = mission.assemble(base).linear_model
    least = planned(model, "min_peak", base.controller["angle"], duration, modes).peak
    inertia = 1 / model.gain("thruster_z", "quasi_rigid_rate_z")
    for profile in PROFILES:
        level = inertia * least * (LEVELS_OF_FUEL if profile in ("min_fuel", "min_energy") else 1)
        if profile == "min_energy":
            level *= 2  # its pulses must have the impulse of its peak
        yield {"profile": profile, "duration": duration, "modes": modes, "level": level}


def planned(model: ReducedModel, profile: str, angle: float, duration: float, modes: int) -> Plan:
    """Returns a plan from rest to rest, in rad/s^2.

    Args:
        model: The machine.
        profile: Its planner.
        angle: Angle to turn by, rad.
        duration: T, s.
        modes: Modes that it leaves at rest.
    """
    shape = {
        "omega": tuple(model.frequencies[:modes].tolist()),
        "damping": tuple(model.D.diagonal()[:modes].tolist()),
        "duration": duration,
        "x1": angle,
    }
    if profile == "min_fuel":
        least = gorelov.min_peak(**shape).peak
        return gorelov.min_fuel(**shape, bound=LEVELS_OF_FUEL * least)
    owner = gorelov if profile.startswith("min_") else input_shaping
    return getattr(owner, profile)(**shape)


def swing_left(plan: Plan, model: ReducedModel, *, factor: float = 1.0) -> float:
    """Returns the elastic swing of the bus that a plan leaves, over all modes, rad.

    Args:
        plan: The plan, rad/s^2.
        model: The machine with all modes that count.
        factor: Of the true frequencies over those that the plan was made for.
    """
    k = len(model.frequencies)
    rigid = len(model.B) - k
    channel = model.inputs.index("thruster_z")
    unit = model.gain("thruster_z", "quasi_rigid_rate_z")
    row = list(model.outputs).index("attitude_z")
    share = model.C[row, rigid : rigid + k] * model.B[rigid:, channel] / unit
    left = residual_vibration(
        plan, omega=factor * model.frequencies, damping=model.D.diagonal().copy()
    )
    return float(np.abs(share) @ left)


def variations(base: Scenario, duration: float) -> Iterator[tuple[str, Result]]:
    """Yields manoeuvres whose plans or machines are varied, by name.

    Args:
        base: The scenario.
        duration: T, s.
    """
    for modes in (2, 3):
        for table in tables(base, duration, modes):
            if table["profile"] in ("min_peak", "min_fuel", "zv"):
                yield f"{table['profile']}, {modes} modes planned", flown(base, table)
    boom = mission.assemble(base).machine.booms[0]
    chosen = [t for t in tables(base, duration, 2) if t["profile"] in ("min_peak", "zvd")]
    for off in (-0.2, -0.1, -0.05, 0.05, 0.1, 0.2):
        changed = {
            "bending_stiffness": boom.bending_stiffness * (1 + off) ** 2,
            "damping_time": boom.damping_time / (1 + off) ** 2,
        }
        for table in chosen:
            name = f"{table['profile']}, frequencies {100 * off:+.0f} %"
            yield name, flown(base, table, booms={"all": changed})
    for lag in (0.1, 0.5):
        for table in chosen:
            name = f"{table['profile']}, off {lag:g} s late"
            lagging = {"thruster_z": {"fall_time": 2 * lag}}
            yield name, flown(base, table, thrusters=lagging)
    for table in chosen:
        pulsed = {"thruster_z": {"min_on_time": 1.0}}
        yield f"{table['profile']}, pulses of 1 s at least", flown(base, table, thrusters=pulsed)
    for table in tables(base, duration, 1):
        if table["profile"] in ("zv", "ei"):
            coarse = {"thruster_z": {"levels": [flown(base, table).peak]}}
            yield (
                f"{table['profile']}, with its highest level alone",
                flown(base, table, thrusters=coarse),
            )
