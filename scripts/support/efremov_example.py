"""Section 5 of Efremov, Polyakov & Strygin (2006) in all its readings, propagated exactly.

The printed example mixes two booms and leaves its units open (controllers/ERRATA.md, 3 to 7), so it
has eleven readings: which plant, which thrust, which switching times, and whether the law compares
beta and v in kg m^2 rad or, divided by J, in rad.  In each the spacecraft is attracted by two
pulses, then held by the multi-level relay while f = 0.001 sin t N m disturbs.
"""

from dataclasses import dataclass

import numpy as np

from controllers.efremov import attracting
from spacecraft_sim import beam
from spacecraft_sim.disturbance import Torque
from spacecraft_sim.modal_form import modal_form, row_of, system_of
from spacecraft_sim.reduced import galerkin_model
from spacecraft_sim.relay_system import Row, Run, State, propagate

C, LEVEL, THRESHOLD, LEVELS = 0.31, 0.007, 0.0045, 4  # c, p, v_1, N
DELAY, ACCURACY, DISTURBANCE = 0.2, 0.007, 0.001  # h, s; eps; amplitude of f, N m
ATTITUDE, RATE, BENDING = 0.7, -0.01, 0.1  # start: gamma, rad; its rate, rad/s; q of mode 1, m

# (5.1) as printed; 22.335 is half of 44.67.
PRINTED = beam.Galerkin(
    J=1183.24, p=np.array([22.335]), a=np.array([11.06]), b=np.array([0.72]), c=np.array([38.83])
)


def boom(density: float, stiffness: float, damping_time: float, modes: int = 1) -> beam.Galerkin:
    """Returns the coefficients of the example's bus with given booms.

    Args:
        density: Mass per length, kg/m.
        stiffness: EI, N m^2.
        damping_time: chi, s.
        modes: Number of cantilever modes.
    """
    return beam.galerkin(
        bus_inertia=30.0,
        root_radius=3.0,
        length=7.5,
        linear_density=density,
        bending_stiffness=stiffness,
        damping_time=damping_time,
        n_modes=modes,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """One reading of the example.

    Attributes:
        title: What is read how.
        plant: Galerkin coefficients.
        thrust: U of the two pulses, N m.
        by_inertia: Whether the law's beta, v and u are divided by J.
        times: T1 and T2, s; those that fit plant and thrust if None.
        duration: Length of the run after T2, s.
    """

    title: str
    plant: beam.Galerkin
    thrust: float = 1.0
    by_inertia: bool = True
    times: tuple[float, float] | None = None
    duration: float = 400.0


LISTED = (0.53, 3.5, 0.001)  # kg/m, N m^2, s: the data in the text
AUTHORS = (1.53, 35.0, 0.72 / 38.83)  # the boom that (5.1) came from; chi = b/c
PAPER_TIMES = (13.3, 30.9)
CASES = (
    Case(title="(5.1), paper's times, U = 1", plant=PRINTED, by_inertia=False, times=PAPER_TIMES),
    Case(title="(5.1), paper's times, U = 1", plant=PRINTED, times=PAPER_TIMES),
    Case(title="(5.1), own times, U = 1", plant=PRINTED, by_inertia=False),
    Case(title="(5.1), own times, U = 1", plant=PRINTED),
    Case(
        title="(5.1), paper's times, U = 2.775",
        plant=PRINTED,
        thrust=2.775,
        by_inertia=False,
        times=PAPER_TIMES,
    ),
    Case(
        title="(5.1), paper's times, U = 2.775", plant=PRINTED, thrust=2.775, times=PAPER_TIMES
    ),
    Case(title="listed boom, paper's times", plant=boom(*LISTED), times=PAPER_TIMES),
    Case(title="listed boom, own times", plant=boom(*LISTED)),
    Case(title="listed boom, own times", plant=boom(*LISTED), by_inertia=False),
    Case(title="listed boom, modes 1 to 3, own times", plant=boom(*LISTED, 3), duration=200.0),
    Case(title="authors' boom, mode 1, own times", plant=boom(*AUTHORS)),
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Flight:
    """A case, propagated.

    Attributes:
        run: What was found.
        times: T1 and T2, s.
        unit: What one unit of the law's beta, v and u is in rad, rad/s and rad/s^2.
        rows: gamma and q of mode 1 over the states of the run.
    """

    run: Run
    times: tuple[float, float]
    unit: float
    rows: dict[str, Row]


def fly(case: Case) -> Flight:
    """Propagates a case from event to event.

    Args:
        case: The reading.
    """
    J, n = case.plant.J, len(case.plant.p)
    model = galerkin_model(case.plant, torques={"u": 1.0}, tips={})
    unit = 1.0 if case.by_inertia else 1 / J
    system = system_of(
        model,
        channel="u",
        switching={"quasi_rigid_angle_z": C, "quasi_rigid_rate_z": 1.0},
        thresholds=tuple(THRESHOLD * unit * 3**k for k in range(LEVELS)),
        levels=tuple(LEVEL * unit * 3**k for k in range(LEVELS + 1)),
    )
    _, _, shapes = modal_form(model, "u")
    position = model.projection @ [ATTITUDE, BENDING, *[0.0] * (n - 1)]
    velocity = model.projection @ [RATE, *[0.0] * n]
    pairs = np.hstack([shapes, shapes.conj()])
    z = np.linalg.solve(pairs, np.r_[position[1:], velocity[1:]])[:n]
    U = case.thrust / J
    pulses = attracting(position[0], velocity[0], U)
    T1, T2 = case.times or pulses[1:]
    run = propagate(
        system,
        start=State(position[0], velocity[0], tuple(z.tolist())),
        duration=T2 + case.duration,
        delay=DELAY,
        pending=[(DELAY, pulses.sign * U), (T1 + DELAY, -pulses.sign * U)],
        feedback_from=T2,
        disturbance=Torque(amplitude=DISTURBANCE / J, frequency=1.0),
    )
    bending = np.linalg.inv(model.projection)[1, 1:] @ shapes[:n]
    rows = {"gamma": row_of(model, "attitude_z", shapes), "q": Row(modes=tuple(bending.tolist()))}
    return Flight(run=run, times=(T1, T2), unit=unit, rows=rows)
