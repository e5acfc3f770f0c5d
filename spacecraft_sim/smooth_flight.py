"""Flights of smooth laws on equations of motion: sampled, as laws are flown, or in continuous time.

In a sampled flight the law is the very object that flies elsewhere, and its torques are held
between samples; the pieces are short, and scipy's RK45 is the fastest for them.  The loop in
continuous time, which no machine flies but the theorems speak of, takes the law's formula apart
from its sampling; it is integrated by DOP853.  Both keep to the same tolerances.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from spacecraft_sim.checks import choices
from spacecraft_sim.controller import Controller
from spacecraft_sim.dynamics import Dynamics
from spacecraft_sim.filtered_law import FilteredLaw
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray
Disturbance = Callable[[float], Sequence[float]]  # time, s -> torque on every input
_TOLERANCE = 1e-10  # of the integration, relative; a hundredth of it absolute
_TINY = 1e-9  # of a period


def fly(
    dynamics: Dynamics,
    law: Controller,
    *,
    starts: Array,
    duration: float,
    limits: Sequence[float] | None = None,
    disturbance: Disturbance | None = None,
    every: int = 1,
    tolerance: float = _TOLERANCE,
) -> tuple[Trajectory, ...]:
    """Flies a sampled law from one or many states, all integrated together.

    Args:
        dynamics: The plant.
        law: The law, with a period.
        starts: State at t = 0, shape (n,), or states of several flights, shape (m, n).
        duration: Length of the flights, s; a last piece may be shorter than a period.
        limits: Largest torque of each input, N m; unlimited if left out.
        disturbance: Torques added to those of the law.
        every: A row is recorded at every so many samples, and at the end.
        tolerance: Relative error allowed in a step of the integration; absolute, a hundredth.

    Returns:
        The flights.

    Raises:
        ValueError: If the plant lacks a reading or an input of the law, or the law has no period.
        ArithmeticError: If the motion cannot be integrated on.
    """
    from scipy.integrate import RK45

    if law.period is None:
        raise ValueError("the law has no sampling period: a relay law is not flown here")
    read, drive = _wiring(dynamics, law)
    x = np.atleast_2d(np.asarray(starts, dtype=float))
    shape, m = x.shape, len(x)
    memories: list[Any] = [law.init() for _ in range(m)]
    command = torque = np.zeros((m, len(dynamics.inputs)))
    ceiling = math.inf if limits is None else np.asarray(limits, dtype=float)
    samples = math.floor(duration / law.period + _TINY)
    rows: list[tuple[float, Array, Array, Array]] = []

    def rates(t: float, flat: Array) -> Array:
        total = torque if disturbance is None else torque + np.asarray(disturbance(t))
        return dynamics.rates(flat.reshape(shape), total).ravel()

    for k in range(samples + 1):
        t, command = k * law.period, np.zeros_like(torque)
        y = dynamics.readings(x)[:, read].tolist()
        for i in range(m):
            command[i, drive], memories[i] = law.step(t, y[i], memories[i])
        torque = np.clip(command, -ceiling, ceiling)
        end = min((k + 1) * law.period, duration)
        if k % every == 0 or k == samples:
            rows.append((t, x, command, torque))
        if end - t <= _TINY * law.period:  # but for the rounding of the clock this is the end
            break
        solver = RK45(
            rates, t, x.ravel(), end, first_step=end - t, rtol=tolerance, atol=tolerance / 100
        )
        with np.errstate(over="ignore", invalid="ignore"):  # a motion that blows up is told below
            while solver.status == "running":
                solver.step()
        if solver.status == "failed" or not np.all(np.isfinite(solver.y)):
            raise ArithmeticError(f"the motion cannot be integrated beyond t = {solver.t:.6g} s")
        x = solver.y.reshape(shape)
    else:
        rows.append((duration, x, command, torque))
    return _trajectories(dynamics, rows)


def closed_loop(
    dynamics: Dynamics, law: FilteredLaw, *, disturbance: Disturbance | None = None
) -> Callable[[float, Array], Array]:
    """Returns the rates of the continuous-time loop, a function of t and (x, zh).

    zh' = K (z - zh) is the state of the filter, w = z - zh.

    Args:
        dynamics: The plant.
        law: The law; its period is of no effect.
        disturbance: Torques added to those of the law.

    Raises:
        ValueError: If the plant lacks a reading or an input of the law.
    """
    read, drive = _wiring(dynamics, law)
    K = np.array(law.filter.cutoffs)

    def rates(t: float, state: Array) -> Array:
        n = len(state) - len(K)
        x, zh = state[:n], state[n:]
        y = dynamics.readings(x)[read].tolist()
        w = np.asarray(law.formula.filtered(t, y)) - zh
        u = np.zeros(len(dynamics.inputs)) if disturbance is None else np.array(disturbance(t))
        u[drive] += law.formula.command(t, y, w.tolist())
        return np.concatenate([dynamics.rates(x, u), K * w])

    return rates


def fly_continuous(
    dynamics: Dynamics,
    law: FilteredLaw,
    *,
    start: Array,
    times: Array,
    disturbance: Disturbance | None = None,
    tolerance: float = _TOLERANCE,
) -> Trajectory:
    """Flies the continuous-time loop, its filter started at the measured value.

    Args:
        dynamics: The plant.
        law: The law; its period is of no effect.
        start: State at the first of the times, shape (n,).
        times: Where rows are recorded, ascending, shape (k,), s.
        disturbance: Torques added to those of the law.
        tolerance: Relative error allowed in a step of the integration; absolute, a hundredth.

    Returns:
        The flight, with the filtered rates `w_1` .. among its signals.

    Raises:
        ValueError: If the plant lacks a reading or an input of the law.
        ArithmeticError: If the motion cannot be integrated on.
    """
    from scipy.integrate import solve_ivp

    read, drive = _wiring(dynamics, law)
    rates = closed_loop(dynamics, law, disturbance=disturbance)
    times = np.asarray(times, dtype=float)

    def filtered(t: float, x: Array) -> Array:
        return np.array(law.formula.filtered(t, dynamics.readings(x)[read].tolist()))

    zh = filtered(times[0], np.asarray(start, dtype=float))
    run = solve_ivp(
        rates,
        (times[0], times[-1]),
        np.concatenate([start, zh]),
        method="DOP853",
        t_eval=times,
        rtol=tolerance,
        atol=tolerance / 100,
    )
    if not run.success:
        raise ArithmeticError(f"the motion cannot be integrated on: {run.message}")
    n = len(start)
    rows, filters = [], []
    for t, state in zip(times, run.y.T, strict=True):
        w = filtered(t, state[:n]) - state[n:]
        y = dynamics.readings(state[:n])[read].tolist()
        u = np.zeros((1, len(dynamics.inputs)))
        u[0, drive] = law.formula.command(t, y, w.tolist())
        rows.append((t, state[None, :n], u, u))
        filters.append(w)
    (trajectory,) = _trajectories(dynamics, rows)
    for k, w in enumerate(np.array(filters).T):
        trajectory.signals[f"w_{k + 1}"], trajectory.units[f"w_{k + 1}"] = w, ""
    return trajectory


def _wiring(dynamics: Dynamics, law: Controller | FilteredLaw) -> tuple[list[int], list[int]]:
    """Where the law's sensors are among the readings, and its channels among the inputs."""
    found = []
    for kind, wanted, known in (
        ("sensor", law.sensors, list(dynamics.units)),
        ("input", law.thrusters, list(dynamics.inputs)),
    ):
        for name in wanted:
            if name not in known:
                raise ValueError(choices(kind, name, known, where=type(dynamics).__name__))
        found.append([known.index(name) for name in wanted])
    return found[0], found[1]


def _trajectories(
    dynamics: Dynamics, rows: Sequence[tuple[float, Array, Array, Array]]
) -> tuple[Trajectory, ...]:
    """Rows of (time, states, commands, torques) as one trajectory a flight."""
    time = np.array([row[0] for row in rows])
    states, commands, torques = (np.array([row[k] for row in rows]) for k in (1, 2, 3))
    readings = dynamics.readings(states)
    units = {
        **dynamics.units,
        **dict.fromkeys(dynamics.inputs, "N m"),
        **{f"{name}_command": "N m" for name in dynamics.inputs},
    }
    return tuple(
        Trajectory(
            time=time,
            signals=dict(
                zip(
                    units, np.hstack([readings[:, i], torques[:, i], commands[:, i]]).T, strict=True
                )
            ),
            units=dict(units),
        )
        for i in range(states.shape[1])
    )
