"""The regulator of Ivanova & Sokolov beside what else a spacecraft might fly, in one scenario."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np

from spacecraft_sim import mission
from spacecraft_sim.chart import pulses
from spacecraft_sim.disturbance import Torque
from spacecraft_sim.scenario import Scenario
from spacecraft_sim.trajectory import Trajectory, peak

SCENARIO = "ivanova-sokolov"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """What a regulator did.

    Attributes:
        name: The regulator.
        worst: limsup |x| as the largest of the second half of the flight, rad.
        firings: Pulses an hour.
        on_time: Time with the thruster on, s an hour.
        impulse: What it spent, N s an hour.
    """

    name: str
    worst: float
    firings: float
    on_time: float
    impulse: float


def candidates(p0: float, minimum: float, acceleration: float) -> dict[str, list[dict[str, Any]]]:
    """Returns controller tables by regulator; of several, the best is to be flown.

    Args:
        p0: Guaranteed accuracy of the first ones, rad.
        minimum: Minimum on-time, s.
        acceleration: Of the thrust, rad/s^2.
    """
    guaranteed = {"law": "ivanova_sokolov", "bias": 0.016, "disturbance": 0.002}
    kick = acceleration * minimum  # rate that the least pulse gives, rad/s
    ways = ("both", "negative")  # the bias pushes to plus
    shares, leads = (0.125, 0.25, 0.5, 1.0, 2.0), (0.25, 0.5, 1.0, 2.0, 4.0, 8.0)
    return {
        "Ivanova & Sokolov, Example 1, guarded": [guaranteed],
        "the same in finite time": [{**guaranteed, "finite_time": True}],
        "Ivanova & Sokolov, Example 2": [{**guaranteed, "rule": "example_2"}],
        "Schmitt trigger with dead zone": [
            {"law": "schmitt_trigger", "threshold": a * p0, "lead": b * minimum, "ways": w}
            for a, b, w in product(shares, leads, ways)
        ],
        "PD with PWPF": [
            {
                "law": "pwpf",
                "bandwidth": a / minimum,
                "on": b,
                "off": b / 3,
                "period": minimum / 50,
                "ways": w,
            }
            for a, b, w in product((0.25, 0.5, 1.0, 2.0, 4.0), (0.15, 0.45, 0.9), ways)
        ],
        "two-pulse phase plane": [
            {"law": "phase_plane", "dead_band": a * p0, "drift": kick / b, "ways": w}
            for a, b, w in product(shares, (1, 2, 4, 8, 16, 32), ways)
        ],
    }


def disturbances(F: float, e: float, turn: float) -> dict[str, dict[str, Any]]:
    """Returns disturbances within the bound: those that follow the rate, shifts, square waves.

    Args:
        F: The steady torque, N m.
        e: Bound of the rest, N m.
        turn: Time in which a limit cycle turns, s; the square waves are in step with it.
    """
    following = ("with_rate", "against_rate", "leftmost", "rightmost")
    found = {name: {"constant": F, "amplitude": e, "waveform": name} for name in following}
    found |= {"F + e": {"constant": F + e}, "F - e": {"constant": F - e}}
    for k in (1, 2, 3):
        wave = {"waveform": "square", "frequency": 2 * np.pi / (k * turn)}
        found[f"square, {k} turns"] = {"constant": F, "amplitude": e, **wave}
    return found


def worst(scenario: Scenario, table: dict[str, Any], limit: float = np.inf) -> tuple[Row, str]:
    """Returns what a regulator did under the worst of the disturbances, on the reduced plant.

    Args:
        scenario: The scenario.
        table: The controller table.
        limit: limsup |x| beyond which the rest of the disturbances are not tried, rad.
    """
    torque = scenario.disturbance["z"]
    found = []
    for name, numbers in disturbances(torque.constant, torque.amplitude, 1.43).items():
        trial = with_law(scenario, table).model_copy(
            update={"disturbance": {"z": Torque.model_validate(numbers)}}
        )
        found.append((measured("", mission.assemble(trial).fly("reduced")), name))
        if found[-1][0].worst > limit:
            break
    return max(found, key=lambda pair: pair[0].worst)


def flown(duration: float, *, tune: bool = True) -> Iterator[tuple[Row, str]]:
    """Flies the scenario on MuJoCo with every regulator, under the disturbance worst for it.

    Args:
        duration: Length of each flight, s.
        tune: Whether the best of the candidates is looked for; the first one flies if not.
    """
    scenario = mission.load_scenario(SCENARIO, (f"duration={duration}",))
    first = mission.assemble(scenario)
    spec = first.thrusters["mujoco"]["thruster_z"]
    gain = first.linear_model.gain("thruster_z", "quasi_rigid_rate_z")
    p0 = first.accuracy or 0.0
    yield Row(name="guaranteed", worst=p0, firings=np.nan, on_time=np.nan, impulse=np.nan), "any"
    trial = scenario.model_copy(update={"duration": min(duration, 40.0)})
    torque = scenario.disturbance["z"]
    for name, tables in candidates(p0, spec.min_on_time, spec.levels[0] * gain).items():
        limit, chosen, against = np.inf, tables[0], ""
        for table in tables if tune else tables[:1]:
            row, disturbance = worst(trial, table, limit)
            if row.worst < limit or not against:
                limit, chosen, against = row.worst, table, disturbance
        numbers = disturbances(torque.constant, torque.amplitude, 1.43)[against]
        final = with_law(scenario, chosen).model_copy(
            update={"disturbance": {"z": Torque.model_validate(numbers)}}
        )
        yield measured(name, mission.assemble(final).fly()), against


def with_law(scenario: Scenario, table: dict[str, Any]) -> Scenario:
    """Returns a scenario with another law.

    Args:
        scenario: The scenario.
        table: Its controller table.
    """
    return scenario.model_copy(update={"controller": table})


def measured(name: str, track: Trajectory) -> Row:
    """Returns what a flight shows of its regulator.

    Args:
        name: The regulator.
        track: The flight.
    """
    late = track.time >= track.time[-1] / 2
    worst, _ = peak(track.time[late], track["attitude_z"][late], track["rate_z"][late])
    start, length = pulses(track.time, track["thruster_z"])
    hours = track.time[-1] / 3600 / 2
    counted = start >= track.time[-1] / 2
    spent = track["thruster_z_spent"][late]
    return Row(
        name=name,
        worst=worst,
        firings=np.count_nonzero(counted) / hours,
        on_time=float(length[counted].sum()) / hours,
        impulse=float(spent[-1] - spent[0]) / hours,
    )
