"""MuJoCo flights of a free bus with elastic parts under given torques, and the moment they feel.

The torque acts on the bus as a pure couple in its own axes and is constant between switchings; each
piece is a whole number of RK4 steps, so the order of the integrator survives the switchings.  What
is measured, M - J omega', is H q'' in the linear theory; here it is all that turns the bus beside
the torque, products of small motions included.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo is a compiled module without type stubs)

import copy
import math
from collections.abc import Sequence
from itertools import pairwise

import mujoco
import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.elastic_mjcf import elastic_model
from spacecraft_sim.elastic_modes import ElasticModel, find_modes
from spacecraft_sim.relay_channels import AXES
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray
Schedule = Sequence[Array | Sequence[float]]  # of each of the three channels

# |lambda| h of what rings on: its phase is off by 1e-6 a radian.  Of what dies at once, or is over
# a hundred times as fast as the slowest: stable.
_ACCURATE, _STABLE = 0.1, 1.5
_LASTING, _FAST = 0.2, 100.0
_HUGE = 1e6  # rad/s: no spacecraft gets there


def longest_step(elastic: ElasticModel) -> float:
    """Returns a step at which what rings is accurate and everything stable, s.

    Args:
        elastic: The structure.
    """
    eigenvalues = find_modes(elastic).eigenvalues
    size = np.abs(eigenvalues)
    rings = (-np.real(eigenvalues) < _LASTING * size) & (size < _FAST * size.min())
    fastest = float(np.max(size[rings], initial=float(size.min())))
    return min(_ACCURATE / fastest, _STABLE / float(size.max()))


def fly(
    model: mujoco.MjModel,
    *,
    switch_times: Schedule,
    levels: Schedule,
    duration: float,
    timestep: float | None = None,
    spin: Sequence[float] = (0.0, 0.0, 0.0),
    disturbance: Sequence[float] = (0.0, 0.0, 0.0),
) -> Trajectory:
    """Flies a schedule of torques from undeformed rest, or from a rotation without deformation.

    Args:
        model: A compiled model as `elastic_model` takes it; it is not changed.
        switch_times: Times of the switchings of each of the three channels, ascending, > 0, s.
        levels: Torque of each channel from t = 0 on and after each switching, one more, N m.
        duration: Length of the flight, s; a switching at its end still counts.
        timestep: Longest step, s; that of `longest_step` if left out.
        spin: Rate of the bus at t = 0 in its axes, rad/s.
        disturbance: Constant torque on the bus in its axes, N m.

    Returns:
        About each axis of the bus: `torque`, the schedule's alone; `moment`; `rate`; `spin`, the
        rate without the elastic vibration, omega + G^T q'; and `gyroscopic`, omega x J omega.  Then
        the deflections by name.  Rows stand at every step, and twice at a switching, before and
        after it.

    Raises:
        ValueError: If the model is not such a structure, times and levels do not fit together, or
            the motion is not finite.
    """
    elastic = elastic_model(model)
    h = longest_step(elastic) if timestep is None else timestep
    positive(timestep=h, duration=duration)
    edges, torques = _pieces(switch_times, levels, duration)
    push = np.asarray(disturbance, dtype=float)
    model = copy.copy(model)
    data = mujoco.MjData(model)
    data.qvel[3:6] = spin
    table = _table(model, data, edges, torques, push, h)
    n = len(elastic.D)
    if not np.all(np.isfinite(table)) or np.max(np.abs(table[:, 4:7])) > _HUGE:
        raise ValueError(f"the motion is not finite with a step of {h:.4g} s; take a smaller one")
    time, torque, rate, acceleration, bending, bent = np.split(table, (1, 4, 7, 10, 10 + n), axis=1)
    kinds = {
        "torque": torque,
        "moment": torque + push - acceleration @ elastic.J,
        "rate": rate,
        "spin": rate + bending @ elastic.G,
        "gyroscopic": np.cross(rate, rate @ elastic.J),
    }
    signals = {f"{k}_{a}": v[:, i] for k, v in kinds.items() for i, a in enumerate(AXES)}
    units = {k: "rad/s" if k.startswith(("rate", "spin")) else "N m" for k in signals}
    deflections = dict(zip(elastic.coordinates, bent.T, strict=True))
    return Trajectory(
        time=time[:, 0],
        signals=signals | deflections,
        units=units | dict.fromkeys(deflections, "rad or m"),
        meta={"timestep": h},
    )


def _pieces(switch_times: Schedule, levels: Schedule, duration: float) -> tuple[Array, Array]:
    """Edges of the pieces and the torques in each, and after the last edge."""
    channels = []
    for axis, times, torques in zip(AXES, switch_times, levels, strict=True):
        at, values = np.asarray(times, dtype=float), np.asarray(torques, dtype=float)
        if len(values) != len(at) + 1 or np.any(np.diff(at, prepend=0.0) <= 0):
            raise ValueError(
                f"channel {axis}: {len(at)} switch times, ascending and > 0, need {len(at) + 1} "
                f"levels; got {len(values)}, times {at}"
            )
        channels.append((at, values))
    inner = np.unique(np.concatenate([at for at, _ in channels]))
    edges = np.r_[0.0, inner[inner < duration], duration]
    torques = [values[np.searchsorted(at, edges, side="right")] for at, values in channels]
    return edges, np.stack(torques, axis=1)


def _table(
    model: mujoco.MjModel,
    data: mujoco.MjData,
    edges: Array,
    torques: Array,
    push: Array,
    h: float,
) -> Array:
    """Rows of time, torque, rate, angular acceleration, rates of bending and deflections."""
    qpos, qvel, qacc, applied = data.qpos, data.qvel, data.qacc, data.qfrc_applied
    scalar = model.nq == model.nv + 1  # no ball joint: coordinates are angles
    rest, moved = model.qpos0.copy(), np.zeros(model.nv)
    rows: list[Array] = []

    def note(t: float, torque: Array) -> None:
        mujoco.mj_forwardSkip(model, data, mujoco.mjtStage.mjSTAGE_NONE, 1)  # no sensors
        if scalar:
            bent = qpos[7:] - rest[7:]
        else:
            mujoco.mj_differentiatePos(model, moved, 1.0, rest, qpos)
            bent = moved[6:]
        rows.append(np.concatenate(([t], torque, qvel[3:6], qacc[3:6], qvel[6:], bent)))

    for (start, end), torque in zip(pairwise(edges), torques, strict=False):
        applied[3:6] = torque + push
        steps = max(math.ceil((end - start) / h * (1 - 1e-9)), 1)
        model.opt.timestep = (end - start) / steps
        for i in range(steps):
            note(start + i * (end - start) / steps, torque)
            mujoco.mj_RungeKutta(model, data, 4)
        note(end, torque)
    applied[3:6] = torques[-1] + push
    note(edges[-1], torques[-1])
    return np.array(rows)
