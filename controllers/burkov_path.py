"""Burkov (1998), section 3: a path followed without velocities, and planned anew when far off.

The paper asks of the new path that it start with q and q' of the mechanism; q' is not measured.
Here it is q_p' + K3 K4^-1 w, to which the filter brings it in some 3/(nu K3) seconds; before that
it is close to q_p', with which the filter starts.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from controllers.burkov_charts import path_charts
from controllers.burkov_claims import PAPER, as_commanded, decaying
from controllers.burkov_laws import Path
from controllers.gains import Numbers, positive_entries
from controllers.programmes import Harmonic, Return
from controllers.velocity_filter import Hold, SampledLaw, VelocityFilter, sampled
from controllers.velocity_filter import Memory as FilterMemory
from spacecraft_sim.chart import Charts
from spacecraft_sim.checks import positive
from spacecraft_sim.guarantee import Assumption, Guarantee, Measurement
from spacecraft_sim.loop_margins import Loop, close
from spacecraft_sim.mechanisms import Mechanism, linear_mechanism
from spacecraft_sim.thrusters import Thrusters
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray
_INSTANTS = 40  # of a programme, at which its frozen loop and its torque are looked at
_HIGHER_ORDER = 1.1  # what 1/gamma^2 and the swing of the torque between instants may add


class Memory(NamedTuple):
    """The path being followed, as its formula, and the state of the filter."""

    formula: Path
    filter: FilterMemory


@dataclass(frozen=True, slots=True, kw_only=True)
class Replanning:
    """A law that follows a path and, once too far from it, a new one that leads back.

    Attributes:
        formula: The law on the programme itself.
        filter: Its filter.
        sensors: Joint angles.
        thrusters: The motors.
        above: |q - q_p| at which the path is planned anew, rad.
        blend: How long the new path takes to reach the programme, s.
        charts: What it would draw of a flight.
    """

    formula: Path
    filter: VelocityFilter
    sensors: tuple[str, ...]
    thrusters: tuple[str, ...]
    above: float
    blend: float
    charts: Charts = field(default=(), compare=False)

    @property
    def period(self) -> float:
        """Sampling period, s."""
        return self.filter.period

    def init(self) -> Memory | None:
        """Returns the memory before the first sample."""
        return None

    def step(
        self, t: float, y: Sequence[float], memory: Memory | None
    ) -> tuple[Sequence[float], Memory]:
        """Returns the torques and the new memory.

        Args:
            t: Time, s.
            y: Joint angles, rad.
            memory: What the last step returned.
        """
        memory = self.after(t, y, memory)
        return memory.formula.command(t, y, memory.filter.w), memory

    def after(self, t: float, y: Sequence[float], memory: Memory | None) -> Memory:
        """Returns the new memory alone.

        Args:
            t: Time, s.
            y: Joint angles, rad.
            memory: What the last step returned.
        """
        formula = memory.formula if memory else self.formula
        before = memory.filter if memory else None
        after = self.filter.step(formula.filtered(t, y), before)
        if math.dist(y, formula.programme(t).q) > self.above:
            formula = replace(formula, programme=self._way_back(t, y, formula, after.w))
            after = self.filter.step(formula.filtered(t, y), None)
        return Memory(formula, after)

    def events(self, t: float, y: Sequence[float], memory: Memory | None) -> tuple[float, ...]:
        """Returns nothing: the law is sampled.

        Args:
            t: Time, s.
            y: Readings.
            memory: Memory.
        """
        return ()

    def _way_back(self, t: float, y: Sequence[float], formula: Path, w: Numbers) -> Return:
        """A path from where the joints are, at the rate that the filter has found, to q_p."""
        old, new = formula.programme(t), self.formula.programme(t)
        parts = zip(self.filter.cutoffs, formula.scale, w, old.v, new.v, strict=True)
        return Return(
            programme=self.formula.programme,
            start=t,
            end=t + self.blend,
            deviation=tuple(q - p for q, p in zip(y, new.q, strict=True)),
            rate=tuple(v + K * x / scale - v_p for K, scale, x, v, v_p in parts),
        )


def path(
    model: Mechanism | None = None,
    thrusters: Thrusters | None = None,
    *,
    programme: Harmonic,
    K0: tuple[float, ...],
    K1: tuple[float, ...],
    K3: tuple[float, ...],
    K4: tuple[float, ...],
    gamma: float,
    nu: float,
    kappa: float = 1.0,
    feedforward: bool = True,
    replan_above: float | None = None,
    blend: float = 2.0,
    hold: Hold = "first-order hold",
    period: float = 1e-3,
    accuracy: float = 1e-3,
) -> tuple[SampledLaw | Replanning, tuple[Guarantee, ...]]:
    """Designs the law that follows a path by joint angles alone, (3.1) or (3.7) with (3.2).

    Args:
        model: The mechanism; without it there is no torque of the path and nothing is guaranteed.
        thrusters: The motors, by name; any if left out.
        programme: q_p(t).
        K0: Stiffness over gamma, N m/rad.
        K1: Damping over gamma and kappa, N m/rad.
        K3: Cutoffs of the filter over nu, 1/s.
        K4: Scale of what is filtered, over nu.
        gamma: Common gain, to be large enough.
        nu: Common speed of the filter, to be large enough.
        kappa: Common gain of the damping, to be large enough; 1 without feedforward.
        feedforward: Whether the torque M_p of the path is added, (3.1), or not, (3.7).
        replan_above: |q - q_p| at which the path is planned anew, rad; never if left out.
        blend: How long a new path takes to reach the programme, s.
        hold: What the filter assumes of an angle between samples.
        period: Sampling period, s.
        accuracy: |q - q_p| that is asked for in the end with feedforward, rad.

    Returns:
        The law and its guarantees.

    Raises:
        ValueError: If a gain is not positive, or there is no mechanism to feed forward from.
    """
    positive(gamma=gamma, nu=nu, kappa=kappa, blend=blend, accuracy=accuracy)
    n = len(programme.mean)
    if feedforward and model is None:
        raise ValueError(
            "feedforward needs a mechanism; without one set feedforward = false, (3.7)"
        )
    if model is not None and n != model.count:
        raise ValueError(f"programme is of {n} joints; the machine has {model.count}")
    if not feedforward and kappa != 1:
        raise ValueError(f"kappa = {kappa:.6g}: (3.7), without feedforward, has kappa = 1")
    gains = {"K0": K0, "K1": K1, "K3": K3, "K4": K4}
    k0, k1, k3, k4 = (positive_entries(name, values, n) for name, values in gains.items())
    formula = Path(
        programme=programme,
        stiffness=tuple(gamma * x for x in k0),
        damping=tuple(gamma * kappa * x for x in k1),
        scale=tuple(nu * x for x in k4),
        mechanism=model if feedforward else None,
    )
    law: SampledLaw | Replanning = sampled(
        formula,
        cutoffs=tuple(nu * x for x in k3),
        hold=hold,
        period=period,
        sensors=tuple(f"joint_{k + 1}" for k in range(n)),
        channels=tuple(f"motor_{k + 1}" for k in range(n)),
        thrusters=thrusters,
    )
    claims = () if model is None else _claims(law, formula, model, programme, accuracy)
    if replan_above is not None:
        positive(replan_above=replan_above)
        law = Replanning(
            formula=formula,
            filter=law.filter,
            sensors=law.sensors,
            thrusters=law.thrusters,
            above=replan_above,
            blend=blend,
        )
    return replace(
        law, charts=path_charts(law, formula, replanned=replan_above is not None)
    ), claims


def frozen_loops(law: SampledLaw, mechanism: Mechanism, times: Sequence[float]) -> list[Loop]:
    """Returns the linear loops about a path, frozen at each time.

    Args:
        law: A law whose formula follows a path.
        mechanism: The mechanism.
        times: When, s.

    Raises:
        ValueError: If the formula is no path.
    """
    if not isinstance(law.formula, Path):
        raise ValueError(f"the law follows no path: it is a {type(law.formula).__name__}")
    found = []
    for t in times:
        motion = law.formula.programme(t)
        plant = linear_mechanism(mechanism, q=motion.q, v=motion.v, a=motion.a)
        found.append(close(law, plant, t=t))
    return found


def _claims(
    law: SampledLaw, formula: Path, model: Mechanism, programme: Harmonic, accuracy: float
) -> tuple[Guarantee, ...]:
    times = np.linspace(0, 2 * math.pi / min(programme.frequency), _INSTANTS).tolist()
    loops = frozen_loops(law, model, times)
    slowest = max(x.real for loop in loops for x in loop.eigenvalues().tolist())
    stable = Assumption(
        text="poles frozen along the path: largest real part (no bound of the gains is known)",
        value=slowest,
        limit=0.0,
        unit="1/s",
    )
    settling = 20 / -slowest if slowest < 0 else math.inf
    M_p = np.array([model.inverse_dynamics(*programme(t)) for t in times])
    if formula.mechanism is None:
        source = f"{PAPER}, Theorem 3.2: |M_p|/(gamma K0) to first order in 1/gamma"
        bound = float(np.linalg.norm(np.max(np.abs(M_p), axis=0) / formula.stiffness))
    else:
        # What a torque leaves that is half a period late.
        late_by = law.period / 2 * np.gradient(M_p, times, axis=0)
        left = [_yielding(loop) @ torque for loop, torque in zip(loops, late_by, strict=True)]
        source = f"{PAPER}, Theorem 3.1; accuracy, and what the hold of M_p leaves"
        bound = accuracy + float(np.max(np.linalg.norm(left, axis=1)))

    def late(trajectory: Trajectory) -> Measurement:
        rows = np.flatnonzero(trajectory.time >= min(settling, trajectory.time[-1]))
        q = np.array([trajectory[name][rows] for name in law.sensors]).T
        distances = [
            math.dist(x, programme(t).q)
            for t, x in zip(trajectory.time[rows].tolist(), q.tolist(), strict=True)
        ]
        worst = int(np.argmax(distances))
        settled = Assumption(
            text="flight lasts until the frozen loop has settled",
            value=float(trajectory.time[-1]),
            limit=settling,
            relation=">=",
            unit="s",
        )
        return Measurement(
            distances[worst],
            float(trajectory.time[rows[worst]]),
            assumptions=(settled, as_commanded(law, trajectory)),
        )

    claim = Guarantee(
        claim="distance from the path once settled",
        source=source,
        unit="rad",
        bound=_HIGHER_ORDER * bound,
        measure=late,
        assumptions=(stable, decaying(loops, law.period)),
    )
    return (claim,)


def _yielding(loop: Loop) -> Array:
    """How far the joints give way to unit torques that stay, shape (n, n), rad/(N m)."""
    n = loop.B.shape[1]
    matrix = loop.matrix()
    push = np.zeros((len(matrix), n))
    push[: len(loop.B)] = loop.B
    return -np.linalg.solve(matrix, push)[:n]
