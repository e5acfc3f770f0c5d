"""Other ways to propagate a delayed relay, for comparison: adaptive integration, a fixed step.

All of them solve one case: a bus with one elastic mode, its own attitude and rate fed back,
u = -p sign(c gamma + gamma') with a delay, 129 switchings in 100 s.
"""

import numpy as np
import scipy.linalg
from scipy.integrate import solve_ivp

from spacecraft_sim import beam, reduced
from spacecraft_sim.modal_form import real_form, system_of
from spacecraft_sim.relay_system import RelaySystem, Run, State, propagate

C, LEVEL, DELAY, DURATION, ANGLE = 0.31, 0.007, 0.3664, 100.0, 0.001


def system(modes: int = 1) -> RelaySystem:
    """Returns the case with some Galerkin modes of the authors' booms.

    Args:
        modes: How many.
    """
    coefficients = beam.galerkin(
        bus_inertia=30.0,
        root_radius=3.0,
        length=7.5,
        linear_density=1.53,
        bending_stiffness=35.0,
        damping_time=0.018542 / max(1.0, modes / 3) ** 2,  # keeps every mode underdamped
        n_modes=modes,
    )
    model = reduced.galerkin_model(coefficients, torques={"u": 1.0}, tips={})
    feedback = {"attitude_z": C, "rate_z": 1.0}
    return system_of(model, channel="u", switching=feedback, levels=(LEVEL,))


def exact(case: RelaySystem, duration: float = DURATION) -> Run:
    """Propagates the case from event to event.

    Args:
        case: The system.
        duration: Length of the run, s.
    """
    start = State(ANGLE, 0.0, (0j,) * len(case.eigenvalues))
    return propagate(case, start=start, duration=duration, delay=DELAY)


def adaptive(case: RelaySystem, *, rtol: float, duration: float = DURATION) -> np.ndarray:
    """Propagates by DOP853, stopped at every effect and every zero of s; returns the switchings.

    Args:
        case: The system.
        rtol: Relative tolerance.
        duration: Length of the run, s.
    """
    A, b, (c,) = real_form(case, [case.switching])
    x, t, u, pending, switches = np.zeros(len(b)), 0.0, 0.0, [], []
    x[0] = ANGLE
    sign = 1.0
    switches.append(0.0)
    pending.append((DELAY, -LEVEL))
    while t < duration:
        end = min(pending[0][0] if pending else duration, duration)

        def crossing(_: float, y: np.ndarray, sign: float = sign) -> float:
            return sign * (c @ y)

        crossing.terminal, crossing.direction = True, -1
        found = solve_ivp(
            lambda _, y, u=u: A @ y + b * u, (t, end), x, "DOP853",
            events=crossing, rtol=rtol, atol=rtol * 1e-4,
        )  # fmt: skip
        t, x = float(found.t[-1]), found.y[:, -1]
        if found.status == 1:
            sign = -sign
            switches.append(t)
            pending.append((t + DELAY, -sign * LEVEL))
        elif pending and t >= pending[0][0]:
            u = pending.pop(0)[1]
    return np.array(switches)


def fixed_step(case: RelaySystem, *, dt: float, duration: float = DURATION) -> np.ndarray:
    """Propagates by the exact map of a fixed step, a ring buffer of commands; returns switchings.

    Args:
        case: The system.
        dt: Step, s.
        duration: Length of the run, s.
    """
    A, b, (c,) = real_form(case, [case.switching])
    n = len(b)
    joint = np.zeros((n + 1, n + 1))
    joint[:n, :n], joint[:n, n] = A * dt, b * dt
    joint = scipy.linalg.expm(joint)
    step, gain = joint[:n, :n], joint[:n, n]
    x, late = np.zeros(n), round(DELAY / dt)
    x[0] = ANGLE
    ring, switches, last = [0.0] * late, [], 0.0
    for k in range(round(duration / dt)):
        command = -LEVEL if c @ x >= 0 else LEVEL
        if command != last:
            switches.append(k * dt)
            last = command
        acting, ring[k % late] = ring[k % late], command
        x = step @ x + gain * acting
    return np.array(switches)
