"""The relay switching with a dwell that drives an output farthest, by dynamic programming.

Backwards from the instant of the peak, theta = T - t, the output of one channel is
y = s(0) u(0) + integral s'(theta) u(theta) d theta, s its response to a unit torque step.  A two-
level relay that switches at theta_1 < theta_2 < ... < theta_m, from rest at theta = T, gives
y = +-(2 s(theta_1) - 2 s(theta_2) + ... -+ s(T)); the best next switching depends on the last one
alone, so a table over theta holds the best that is left.  The same for {0, +-M0} with pulses of at
least the dwell and pauses of any length.  The channels add up, and each is best on its own.

A channel that the output does not feel switches as often as it may, the last time at the peak: a
relay has no rest, the bus does not spin up, and what small motion neglects is seen in a flight.

On a grid of theta the result is attained by the schedule returned, to the last digit; between grid
points a schedule may do better by some (omega step)^2/8 of it.
"""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from spacecraft_sim.checks import positive
from spacecraft_sim.elastic_modes import ElasticModel, find_modes
from spacecraft_sim.relay_channels import AXES, per_channel

Array = np.ndarray

_POINTS_PER_PERIOD = 200  # of the fastest mode that counts: (omega step)^2/8 = 1.2e-4
_COUNTS = 1e-2  # share of the largest ringing from which a mode counts for the step
_SETTLED = math.log(1000.0)  # horizon in time constants of the slowest mode
_MOST = 20_000_000  # grid points of a channel
_SILENT = 1e-9  # share of what it might be below which a response is rounding
_BLOCK = 1024


@dataclass(frozen=True, slots=True, kw_only=True)
class WorstCase:
    """A switching schedule from undeformed rest, and where it leads.

    Attributes:
        moment: The moment about the axis at t = duration, N m; for a deflection, rad or m.
        switch_times: Times of the switchings of each channel, ascending, s.
        levels: Torque of each channel from t = 0 on and after each switching, N m.
        duration: Time of the peak, s; a switching at that time has just taken place.
    """

    moment: float
    switch_times: tuple[Array, Array, Array]
    levels: tuple[Array, Array, Array]
    duration: float


def worst_case(
    elastic: ElasticModel,
    *,
    torque: float | Array | list[float],
    dwell: float | Array | list[float],
    axis: int | str,
    relay: Literal[2, 3] = 2,
    step: float | None = None,
    horizon: float | None = None,
    points: int | None = None,
) -> WorstCase:
    """Finds the switching that drives the moment of the elastic parts farthest about an axis.

    Args:
        elastic: The structure.
        torque: M0, the torque of each channel or of all, N m.
        dwell: Least time between switchings of each channel or of all, s; inf for one switching.
        axis: 0, 1, 2 or "x", "y", "z".
        relay: Levels of the relay: 2 for +-M0, 3 for {0, +-M0} with free pauses.
        step: Grid of switching times, s, shortened to divide the dwell; by default a 200th of the
            period of the fastest mode that counts.
        horizon: Length of the schedule, s; by default a dwell and the time in which the slowest
            mode dies out to a thousandth.
        points: Grid points of a channel at most: the default step is as long as that needs.

    Returns:
        The schedule.

    Raises:
        ValueError: If a number is not positive, the axis is none, the horizon is shorter than a
            dwell, or the grid is too fine.
    """
    if axis not in (0, 1, 2, *AXES):
        raise ValueError(f"axis must be 0, 1, 2 or one of x, y, z; got {axis!r}")
    e = AXES.index(axis) if isinstance(axis, str) else axis
    modes = find_modes(elastic)
    amplitudes = modes.accelerations(elastic.H)  # (k, 3, 3)
    output = _Output(
        eigenvalues=modes.eigenvalues,
        amplitudes=amplitudes[:, e],
        rest=np.zeros(3),
        scale=float(np.abs(amplitudes).sum(axis=0).max()),
    )
    return _search(output, torque, dwell, relay, step, horizon, points)


def worst_deflection(
    elastic: ElasticModel,
    *,
    torque: float | Array | list[float],
    dwell: float | Array | list[float],
    direction: Array | list[float],
    relay: Literal[2, 3] = 2,
    step: float | None = None,
    horizon: float | None = None,
) -> WorstCase:
    """Finds the switching that drives a combination of deflections farthest.

    Args:
        elastic: The structure.
        torque: M0, the torque of each channel or of all, N m.
        dwell: Least time between switchings of each channel or of all, s; inf for one switching.
        direction: l, coefficients of the elastic coordinates, shape (n,).
        relay: Levels of the relay: 2 for +-M0, 3 for {0, +-M0} with free pauses.
        step: Grid of switching times, s; by default as for `worst_case`.
        horizon: Length of the schedule, s; by default as for `worst_case`.

    Returns:
        The schedule; `moment` is the deflection, rad or m.

    Raises:
        ValueError: If a number is not positive, the direction does not fit, the horizon is shorter
            than a dwell, or the grid is too fine.
    """
    row = np.asarray(direction, dtype=float)
    if row.shape != (len(elastic.D),):
        raise ValueError(f"a direction has one coefficient a coordinate, {len(elastic.D)}")
    modes = find_modes(elastic)
    output = _Output(
        eigenvalues=modes.eigenvalues,
        amplitudes=row @ modes.residues,
        rest=-row @ modes.deflection,  # q settles at -C^-1 G M
        scale=float((np.abs(row) @ np.abs(modes.residues)).sum(axis=0).max()),
    )
    return _search(output, torque, dwell, relay, step, horizon)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Output:
    """s = rest + Re sum a_k e^(lambda_k theta) of the three channels; scale of what they may be."""

    eigenvalues: Array
    amplitudes: Array  # (k, 3)
    rest: Array  # (3,)
    scale: float


def _search(
    output: _Output,
    torque: float | Array | list[float],
    dwell: float | Array | list[float],
    relay: int,
    step: float | None,
    horizon: float | None,
    points: int | None = None,
) -> WorstCase:
    """Each channel on its own."""
    eigenvalues, amplitudes = output.eigenvalues, output.amplitudes
    M0 = per_channel("torque", torque)
    hold = per_channel("dwell", dwell, infinite=True)
    if relay not in (2, 3):
        raise ValueError(f"a relay has 2 levels or 3, got {relay!r}")
    # What has been held until all is at rest may as well have been held for ever.
    settled = float(_SETTLED / np.min(-np.real(eigenvalues)))
    lasting = np.minimum(hold, settled)
    T = settled + min(float(lasting.max()), settled / 2) if horizon is None else horizon
    # What each mode builds up to at its worst, as in (26): fast ones that die at once are little.
    heard = np.abs(amplitudes).sum(axis=0) > _SILENT * output.scale
    built = (np.abs(amplitudes) / -np.expm1(np.outer(np.real(eigenvalues), hold)))[:, heard]
    built = built.max(axis=1, initial=0.0)
    period = 2 * np.pi / float(np.max(np.abs(eigenvalues)[built >= _COUNTS * built.max()]))
    if step is None:
        wanted = max(period / _POINTS_PER_PERIOD, T / points if points else 0.0)
    else:
        wanted = step
    positive(step=wanted, horizon=T)
    if max(lasting.max(), wanted) >= T:
        raise ValueError(
            f"horizon = {T} s leaves no room for a switching: it must be longer than the dwell, "
            f"{lasting.max():.6g} s, and the step, {wanted:.6g} s"
        )
    moment, times, levels = 0.0, [], []
    for channel in range(3):
        dwelt = float(lasting[channel])
        h = dwelt / math.ceil(dwelt / wanted * (1 - 1e-12)) if wanted <= dwelt else wanted
        count = math.floor(T / h * (1 + 1e-12)) + 1
        if count > _MOST:
            raise ValueError(
                f"{count} grid points of {h:.3g} s over {T:.6g} s, limit {_MOST}: raise step to "
                f"{T / _MOST:.3g} s or shorten horizon"
            )
        gap = math.ceil(dwelt / h * (1 - 1e-12))
        if heard[channel]:
            a, rest = amplitudes[:, channel], output.rest[channel]
            s = rest + _samples(eigenvalues, a, h, count)
            end = rest + float(np.real(np.exp(eigenvalues * T) @ a))
            solve = _two_levels if relay == 2 else _three_levels
            value, at, signs = solve(s, end, gap)
            moment += M0[channel] * value
        else:
            at, signs = _restless(count, gap)
        at_time, torques = T - h * at[::-1], M0[channel] * signs[::-1]
        if len(at) and at_time[0] <= 1e-9 * T:  # a switching at t = 0 is the start
            at_time, torques = at_time[1:], torques[1:]
        times.append(at_time)
        levels.append(torques)
    return WorstCase(
        moment=float(moment),
        switch_times=(times[0], times[1], times[2]),
        levels=(levels[0], levels[1], levels[2]),
        duration=T,
    )


def _samples(eigenvalues: Array, amplitudes: Array, step: float, count: int) -> Array:
    """Re sum a_k e^(lambda_k step j) for j < count."""
    blocks = -(-count // _BLOCK)
    inner = np.exp(np.outer(eigenvalues, step * np.arange(_BLOCK)))
    outer = np.exp(np.outer(step * _BLOCK * np.arange(blocks), eigenvalues)) * amplitudes
    return np.real(outer @ inner).ravel()[:count]


def _two_levels(s: Array, end: float, gap: int) -> tuple[float, Array, Array]:
    """Best value, grid indices of switchings from the peak backwards, and signs of the levels."""
    n = len(s)
    last = n - gap  # switchings before it leave the dwell to the first level
    # rise[j]: the best of 2 s_k - 2 s_l + ... with j <= k <= l - gap ..., fall[j]: of its negative.
    rise, fall = np.full(n + gap, end), np.full(n + gap, -end)
    for low in range(last - 1, -1, -gap):
        block = slice(max(low - gap + 1, 0), low + 1)
        ahead = slice(block.start + gap, block.stop + gap)
        up, down = 2 * s[block] + fall[ahead], rise[ahead] - 2 * s[block]
        rise[block] = np.maximum(_best_from(up), rise[block.stop])
        fall[block] = np.maximum(_best_from(down), fall[block.stop])
    sign, j, at, signs = (1.0, 0, [], [1.0]) if rise[0] >= fall[0] else (-1.0, 0, [], [-1.0])
    value = max(rise[0], fall[0])
    losses = {1.0: (-rise, end), -1.0: (-fall, -end)}  # ascending
    while True:
        loss, stop = losses[sign]
        if j >= n or -loss[j] <= stop:
            break
        # The table changes only where its best switching is left behind.
        k = int(np.searchsorted(loss, loss[j], side="right")) - 1
        at.append(k)
        sign, j = -sign, k + gap
        signs.append(sign)
    return float(value), np.array(at, dtype=int), np.array(signs)


def _three_levels(s: Array, end: float, gap: int) -> tuple[float, Array, Array]:
    """As `_two_levels`, with pulses that last for the gap and pauses of any length."""
    n = len(s)
    # free[j]: the best that is left if no pulse reaches back over j; high[j], low[j]: the best of
    # free_k + s_k and free_k - s_k with k >= j, a pulse from t = 0 on included.
    free = np.zeros(n + 1)
    high, low = np.full(n + gap, -np.inf), np.full(n + gap, -np.inf)
    high[n - 1], low[n - 1] = max(end, s[-1]), max(-end, -s[-1])
    for stop in range(n - 1, 0, -gap):
        block = slice(max(stop - gap, 0), stop)
        ahead = slice(block.start + gap, block.stop + gap)
        pulse = np.maximum(high[ahead] - s[block], low[ahead] + s[block])
        free[block] = np.maximum(_best_from(pulse), free[stop])
        high[block] = np.maximum(_best_from(free[block] + s[block]), high[stop])
        low[block] = np.maximum(_best_from(free[block] - s[block]), low[stop])
    options = (free[0], high[0], low[0])
    state = int(np.argmax(options))
    value, j, at, signs = options[state], 0, [], []
    losses = -free, -high[:n], -low[:n]  # ascending
    while True:
        if state == 0:
            signs.append(0.0)
            if free[j] <= 0:
                break
            k = int(np.searchsorted(losses[0], losses[0][j], side="right")) - 1
            at.append(k)
            state = 1 if high[k + gap] - s[k] >= low[k + gap] + s[k] else 2
            j = k + gap
        signs.append(1.0 if state == 1 else -1.0)
        table, ends = (high, end) if state == 1 else (low, -end)
        k = int(np.searchsorted(losses[state], losses[state][j], side="right")) - 1
        if k == n - 1 and table[j] == ends:
            break
        at.append(k)
        state, j = 0, k
    return float(value), *_tidy(at, signs)


def _restless(count: int, gap: int) -> tuple[Array, Array]:
    """Switchings as often as the gap allows, off before the first of them."""
    at = gap * np.arange((count - 1) // gap + 1)
    return at, np.r_[(-1.0) ** np.arange(len(at)), 0.0]


def _tidy(at: list[int], signs: list[float]) -> tuple[Array, Array]:
    """Drops pauses of no length, and switchings between equal levels."""
    times, levels = [], signs[:1]
    for k, sign in zip(at, signs[1:], strict=True):
        if times and times[-1] == k:
            levels.pop()
            times.pop()
        if sign != levels[-1]:
            times.append(k)
            levels.append(sign)
    return np.array(times, dtype=int), np.array(levels)


def _best_from(values: Array) -> Array:
    """The largest value from each place on."""
    return np.maximum.accumulate(values[::-1])[::-1]
