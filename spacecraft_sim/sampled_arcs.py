"""A double integrator under a sampled law with delayed thrust, propagated exactly.

As `parabola_arcs`, but the law is any object with `init` and `step`, called at every sample, and a
command takes effect after an on-delay or an off-delay.
"""

import math
from typing import Any, Protocol

import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.parabola_arcs import Disturbance, Flight


class SampledLaw(Protocol):
    """What is needed of a controller here."""

    def init(self) -> Any:
        """Returns the memory before the first step."""
        ...

    def step(self, t: float, y: Any, memory: Any) -> tuple[Any, Any]:
        """Returns the command and the new memory.

        Args:
            t: Time.
            y: (x, v).
            memory: What the last step returned.
        """
        ...


def propagate_sampled(
    law: SampledLaw,
    *,
    start: tuple[float, float],
    bias: float,
    disturbance: Disturbance,
    period: float,
    duration: float,
    on_delay: float = 0.0,
    off_delay: float = 0.0,
) -> Flight:
    """Propagates the sampled loop from t = 0, the thrust off; samples fall on multiples of Ts.

    Args:
        law: The law; it reads (x, v) and commands -1, 0 or +1.
        start: (x, v) at t = 0.
        bias: F, the constant disturbance over the thrust.
        disturbance: eps; |F| - |eps| and 1 - |F| - |eps| must stay positive.
        period: Ts.
        duration: Length of the flight.
        on_delay: Time from a command other than 0 to its effect.
        off_delay: Time from a command 0 to its effect.

    Returns:
        The flight; its switchings are those of the thrust.

    Raises:
        ValueError: If a number is not positive, or eps turns the bias or the thrust over.
    """
    positive(period=period, duration=duration)
    positive(on_delay=on_delay, off_delay=off_delay, zero=True)
    x, v = map(float, start)
    t, sample, count = 0.0, 0, 0
    memory, command, level = law.init(), 0, 0
    queue: list[tuple[float, int]] = []
    arcs: list[tuple[float, float, float, float, int]] = []
    switched: list[int] = []
    peaked: list[int] = []
    while t < duration:
        while queue and queue[0][0] <= t:
            new = queue.pop(0)[1]
            if new != level:
                level, count = new, count + 1
                switched.append(len(arcs))
        if t >= sample * period:
            (u,), memory = law.step(t, (x, v), memory)
            sample += 1
            if round(u) != command:
                command = round(u)
                effect = t + (on_delay if command else off_delay)
                queue = [pair for pair in queue if pair[0] < effect]
                queue.append((effect, command))
                continue
        rising = level + bias > 0
        eps, until, rate = disturbance(t, v, level, rising, count)
        a = level + bias + eps
        if (a > 0) != rising or a == 0:
            raise ValueError(f"eps = {eps} at level {level} turns the sign of v' over")
        end = min(duration, until, sample * period, queue[0][0] if queue else math.inf)
        tau = end - t
        turns = reaches = False
        if v * a < 0 and -v / a <= tau:
            tau, turns = -v / a, True
        if (rate - v) * a > 0 and (rate - v) / a < tau:
            tau, turns, reaches = (rate - v) / a, False, True
        arcs.append((t, x, v, a, level))
        x, v = x + tau * (v + tau * a / 2), v + tau * a
        t = end if tau == end - t else t + tau
        if turns:
            v = 0.0
            peaked.append(len(arcs))
        elif reaches:
            v = rate
    table = np.array([*arcs, (t, x, v, 0.0, level)], dtype=float).T
    return Flight(
        times=table[0],
        x=table[1],
        v=table[2],
        accelerations=table[3, :-1],
        levels=table[4],
        switch_arcs=np.array(switched, dtype=int),
        peak_arcs=np.array(peaked, dtype=int),
    )
