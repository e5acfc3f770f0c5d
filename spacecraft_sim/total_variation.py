"""Total variation over all time of sums of damped exponentials, from above and to 1e-9.

The largest value that a bounded input can drive an output to is the input's bound times
|s(0)| + integral |s'|, s the step response: the L1 norm of the impulse response.  Between its
extrema s runs monotonically, so the integral is the sum of their differences; the extrema are found
on an interpolant of s, s', s''.  What is left out, modes that have died out and the far end of the
time axis, enters with its own bound, so the result is never below the truth.
"""

import numpy as np

Array = np.ndarray

_STEPS = 48  # of the fastest period
_INTERPOLATION = 1e-9  # error of the quintic over such a step
_NEGLIGIBLE = 1e-10  # of what has been found: where modes count by their bounds alone
_BLOCK = 2048  # steps evaluated at a time
_BUDGET = 500  # blocks; what comes after them counts by its bound alone
_SILENT = 1e-12  # of the largest: what is rounding counts by its bound too
_BISECTIONS = 14  # an extremum is flat: to 6e-5 of a step it is known to 1e-11


def total_variation(eigenvalues: Array, amplitudes: Array) -> Array:
    """Returns the integral of |f'| from zero to infinity, f = Re sum a_k e^(lambda_k t).

    Args:
        eigenvalues: lambda_k with Re < 0, shape (k,), 1/s.
        amplitudes: a_k of each function, shape (k, ...).

    Returns:
        Upper bounds of shape (...), above the truth by some 1e-9 of it.  Where the slowest motion
        outlasts a million steps of the fastest that it overlaps with, by more: the rest then
        counts with the sum of the modes' own variations.
    """
    a = np.asarray(amplitudes, dtype=complex).reshape(len(eigenvalues), -1)
    shape = np.shape(amplitudes)[1:]
    rates = -np.real(eigenvalues)
    own = np.abs(a * eigenvalues[:, None]) / rates[:, None]  # a mode's own variation, from above
    whole = own.sum(axis=0)
    heard = whole > _SILENT * whole.max(initial=0.0)
    whole[heard] = _variations(eigenvalues, a[:, heard], rates, own[:, heard])
    return whole.reshape(shape) * (1 + _INTERPOLATION)


def _variations(x: Array, a: Array, rates: Array, own: Array) -> Array:
    """The integrals, block after block, until what is left counts by its bound."""
    total, t = np.zeros(a.shape[1]), 0.0
    alive, changed = np.any(a != 0, axis=1), True
    step, waves = 0.0, np.zeros((0, 0))
    for _ in range(_BUDGET):
        rest = own * np.exp(-rates * t)[:, None]
        fading = alive & np.all(rest <= _NEGLIGIBLE / len(a) * total, axis=1)
        total += rest[fading].sum(axis=0)
        alive &= ~fading
        changed |= bool(np.any(fading))
        if not np.any(alive):
            break
        if changed:
            step = 2 * np.pi / (_STEPS * np.max(np.abs(x[alive])))
            waves = np.exp(np.outer(x[alive], step * np.arange(_BLOCK + 1)))  # (alive, block + 1)
            changed = False
        now = a[alive] * np.exp(x[alive] * t)[:, None]
        total += _variation(now, x[alive] * step, waves)
        t += _BLOCK * step
    else:
        total += (own * np.exp(-rates * t)[:, None])[alive].sum(axis=0)
    return total


def _variation(amplitudes: Array, scaled: Array, waves: Array) -> Array:
    """Variation over one block; `scaled` are the eigenvalues times the step, slopes are by step."""
    f, slope, bend = (
        np.real(amplitudes.T * scaled**order @ waves)  # (functions, block + 1)
        for order in range(3)
    )
    total = np.abs(np.diff(f)).sum(axis=1)
    left, right = slope[:, :-1], slope[:, 1:]
    # An extremum, or two: the slope turns towards zero and away again within the step.
    one = left * right < 0
    two = (left * right > 0) & (left * bend[:, :-1] < 0) & (left * bend[:, 1:] > 0)
    for pick, extrema in ((one, 1), (two, 2)):
        row, j = np.nonzero(pick)
        if not len(row):
            continue
        ends = [part[row, k] for k in (j, j + 1) for part in (f, slope, bend)]
        extra = _excess(_quintic(*ends), extrema)
        total += np.bincount(row, weights=extra, minlength=len(total))
    return total


def _quintic(f0, v0, w0, f1, v1, w1) -> Array:
    """Coefficients, lowest first, shape (6, m), of the quintic with these ends on [0, 1]."""
    rise, d1, d2 = f1 - f0 - v0 - w0 / 2, v1 - v0 - w0, w1 - w0
    return np.array([
        f0, v0, w0 / 2,
        10 * rise - 4 * d1 + d2 / 2,
        -15 * rise + 7 * d1 - d2,
        6 * rise - 3 * d1 + d2 / 2,
    ])  # fmt: skip


def _excess(c: Array, extrema: int) -> Array:
    """Variation of quintics beyond |f(1) - f(0)|, with one extremum inside or perhaps two."""
    slope = c[1:] * np.arange(1, 6)[:, None]
    zero, one = np.zeros(c.shape[1]), np.ones(c.shape[1])
    if extrema == 1:
        places = [_root(slope, zero, one)]
        crosses = True
    else:
        bend = slope[1:] * np.arange(1, 5)[:, None]
        turn = _root(bend, zero, one)
        crosses = _horner(slope, turn) * slope[0] < 0
        places = [_root(slope, zero, turn), _root(slope, turn, one)]
    values = np.array([c[0], *(_horner(c, u) for u in places), c.sum(axis=0)])
    path = np.abs(np.diff(values, axis=0)).sum(axis=0)
    return np.where(crosses, path - np.abs(values[-1] - values[0]), 0.0)


def _horner(c: Array, u: Array) -> Array:
    value = np.zeros_like(u)
    for k in range(len(c) - 1, -1, -1):
        value = value * u + c[k]
    return value


def _root(c: Array, low: Array, high: Array) -> Array:
    """Where polynomials change their sign between low and high, by bisection."""
    start = np.signbit(_horner(c, low))
    for _ in range(_BISECTIONS):
        middle = (low + high) / 2
        same = np.signbit(_horner(c, middle)) == start
        low, high = np.where(same, middle, low), np.where(same, high, middle)
    return (low + high) / 2
