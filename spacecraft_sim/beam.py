"""Euler-Bernoulli cantilever booms: frequencies, shapes, Galerkin coefficients, hinge rules.

A boom of length l, linear density m and bending stiffness EI is clamped to a bus at the distance r
from its axis.  Two identical booms bend antisymmetrically while the bus turns by the angle gamma;
the deflection in the bus frame is y(x, t) = sum q_i(t) Phi_i(x).  Kelvin-Voigt damping adds
EI chi d/dt to EI.

Source: Efremov, Polyakov & Strygin (2006), equations (1.1)-(1.6), where the printed example mixes
two data sets (controllers/ERRATA.md).
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.polynomial.legendre import leggauss

from spacecraft_sim.checks import positive

Array = np.ndarray
Rule = Literal["gauss_jacobi", "gauss_legendre", "equal", "mid"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Galerkin:
    """Coefficients of (1.4)-(1.5): J g'' + 2 p.q'' = u + f,  p g'' + a q'' + b q' + c q = 0.

    Attributes:
        J: Inertia of bus and undeformed booms about the axis, kg m^2.
        p: Coupling integral of m (x + r) Phi_i, shape (n_modes,), kg m.
        a: Modal masses m kappa, shape (n_modes,), kg.
        b: Modal damping, shape (n_modes,), kg/s.
        c: Modal stiffness, shape (n_modes,), kg/s^2.
    """

    J: float
    p: Array
    a: Array
    b: Array
    c: Array


def wave_numbers(n: int) -> Array:
    """Returns the first n roots z of cos z cosh z = -1, shape (n,).

    Args:
        n: How many.
    """
    # 1/cosh keeps the function bounded; the roots lie pi apart, close to (i - 1/2) pi.
    z = (np.arange(1, n + 1) - 0.5) * np.pi
    for _ in range(8):  # Newton from the inner side: digits double from 0.3 off at worst
        sech = 1 / np.cosh(z)
        z += (np.cos(z) + sech) / (np.sin(z) + sech * np.tanh(z))
    return z


def cantilever_frequencies(
    *, length: float, linear_density: float, bending_stiffness: float, n: int
) -> Array:
    """Returns the first n natural frequencies of the clamped boom.

    Args:
        length: Boom length l, m.
        linear_density: Mass per length m, kg/m.
        bending_stiffness: EI, N m^2.
        n: How many frequencies.

    Returns:
        Angular frequencies in ascending order, shape (n,), rad/s.

    Raises:
        ValueError: If an argument is not positive and finite.
    """
    positive(length=length, linear_density=linear_density, bending_stiffness=bending_stiffness, n=n)
    return wave_numbers(n) ** 2 * np.sqrt(bending_stiffness / linear_density) / length**2


def mode_shape(order: int, x: Array, length: float, *, derivative: int = 0) -> Array:
    """Evaluates the cantilever shape Phi scaled so that the integral of Phi^2 is the length.

    With this scale the tip deflects by 2 for a unit modal coordinate.

    Args:
        order: Mode number, from 1.
        x: Distances from the root, any shape, m.
        length: Boom length, m.
        derivative: Order of the x-derivative.

    Returns:
        Phi or its derivative at `x`, same shape, 1/m^derivative.

    Raises:
        ValueError: If `order` or `length` is not positive.
    """
    positive(order=order, length=length)
    z = wave_numbers(order)[-1]
    sigma, e = _sigma(z), np.exp(-z)
    phase = np.asarray(x) * z / length
    quarter = derivative * np.pi / 2
    # Phi = cosh - cos - sigma (sinh - sin).  For high modes cosh - sigma sinh cancels: its growing
    # part (1 - sigma)/2 e^phase is written with (1 - sigma)/2 = growing e^-z in closed form.
    growing = (np.sin(z) - np.cos(z) - e) / (1 - e * e + 2 * e * np.sin(z))
    decaying = (1 + sigma) / 2 * (-1) ** derivative
    shape = (
        growing * np.exp(phase - z)
        + decaying * np.exp(-phase)
        - np.cos(phase + quarter)
        + sigma * np.sin(phase + quarter)
    )
    return shape * (z / length) ** derivative


def _root(function: Callable[[float], float], low: float, high: float) -> float:
    from scipy.optimize import brentq  # a heavy import that most uses of this module do without

    return brentq(function, low, high, xtol=1e-14)  # pyright: ignore[reportReturnType]


def _sigma(z: Array | float) -> Array | float:
    """(cosh z + cos z)/(sinh z + sin z), divided through by e^z/2 so that it never overflows."""
    e = np.exp(-z)
    return (1 + e * e + 2 * e * np.cos(z)) / (1 - e * e + 2 * e * np.sin(z))


def total_inertia(
    *, bus_inertia: float, root_radius: float, length: float, linear_density: float
) -> float:
    """Returns J = J0 + 2 times the integral of m (x + r)^2 over one boom, kg m^2.

    Args:
        bus_inertia: J0, kg m^2.
        root_radius: r, m.
        length: l, m.
        linear_density: m, kg/m.
    """
    booms = (length + root_radius) ** 3 - root_radius**3
    return bus_inertia + 2 * linear_density * booms / 3


def galerkin(
    *,
    bus_inertia: float,
    root_radius: float,
    length: float,
    linear_density: float,
    bending_stiffness: float,
    damping_time: float,
    n_modes: int,
) -> Galerkin:
    """Returns the Bubnov-Galerkin coefficients of a bus with two antisymmetric booms.

    Args:
        bus_inertia: J0 about the axis, kg m^2.
        root_radius: Distance r from the axis to the boom root, m.
        length: l, m.
        linear_density: m, kg/m.
        bending_stiffness: EI, N m^2.
        damping_time: Kelvin-Voigt time chi, s.
        n_modes: Number of cantilever shapes, scaled so that kappa = length.

    Returns:
        The coefficients J, p, a, b, c of Efremov (1.4)-(1.5).

    Raises:
        ValueError: If an argument is negative, not finite, or zero where that has no meaning.
    """
    positive(
        length=length,
        linear_density=linear_density,
        bending_stiffness=bending_stiffness,
        n_modes=n_modes,
    )
    positive(bus_inertia=bus_inertia, root_radius=root_radius, damping_time=damping_time, zero=True)
    z = wave_numbers(n_modes)
    # Closed forms over xi = x/l:  int Phi = 2 sigma/z,  int xi Phi = 2/z^2.
    p = linear_density * (2 * length**2 / z**2 + 2 * root_radius * length * _sigma(z) / z)
    c = bending_stiffness * (z / length) ** 4 * length
    return Galerkin(
        J=total_inertia(
            bus_inertia=bus_inertia,
            root_radius=root_radius,
            length=length,
            linear_density=linear_density,
        ),
        p=p,
        a=np.full(n_modes, linear_density * length),
        b=damping_time * c,
        c=c,
    )


def coupled_frequencies(
    *,
    bus_inertia: float,
    root_radius: float,
    length: float,
    linear_density: float,
    bending_stiffness: float,
    n: int,
) -> Array:
    """Returns the exact elastic frequencies of the free bus with two antisymmetric booms.

    The total displacement w = (x + r) gamma + y obeys EI w'''' = m omega^2 w with w'' = w''' = 0 at
    the tip, w(0) = r w'(0) at the root, and -J0 omega^2 w'(0) = 2 EI (w''(0) - r w'''(0)).

    Args:
        bus_inertia: J0 about the axis, kg m^2.
        root_radius: r, m.
        length: l, m.
        linear_density: m, kg/m.
        bending_stiffness: EI, N m^2.
        n: How many frequencies, the rigid rotation at zero not counted.

    Returns:
        Angular frequencies in ascending order, shape (n,), rad/s.

    Raises:
        ValueError: If an argument is negative, not finite, or zero where that has no meaning.
    """
    positive(length=length, linear_density=linear_density, bending_stiffness=bending_stiffness, n=n)
    positive(bus_inertia=bus_inertia, root_radius=root_radius, zero=True)
    rho = root_radius / length
    inertia = bus_inertia / (2 * linear_density * length**3)  # 2 EI k^4 l^3 J0/(2 m l^3) = J0 w^2

    def determinant(z: float) -> float:
        # Solutions with a free tip, s = (l - x)/l:  cos + cosh and sin + sinh of z s; each column
        # is divided by cosh z.
        c, s, h, t = np.cos(z) / np.cosh(z), np.sin(z) / np.cosh(z), 1.0, np.tanh(z)
        column = []
        for w0, w1, w2, w3 in (
            (h + c, -(t - s), h - c, -(t + s)),
            (t + s, -(h + c), t - s, -(h - c)),
        ):  # w, w'/z, w''/z^2, w'''/z^3 at the root, in units of l
            column.append((w0 - rho * z * w1, inertia * z**3 * w1 + w2 - rho * z * w3))
        (a, b), (e, f) = column
        return a * f - b * e

    # Freeing the bus lifts one constraint, so each root lies between two clamped wave numbers.
    z = wave_numbers(n + 1)
    roots = np.array([_root(determinant, lo, hi) for lo, hi in pairwise(z)])
    return roots**2 * np.sqrt(bending_stiffness / linear_density) / length**2


def hinge_rule(rule: Rule, n: int) -> tuple[Array, Array]:
    """Returns hinge positions and weights of a boom of unit length.

    A chain of rigid links is a quadrature rule for the bending energy: the integral of EI y''^2 is
    the sum of EI w_j (theta_j / w_j)^2, so the hinge at s_j has the stiffness EI/w_j.

    Args:
        rule: `gauss_jacobi` with weight (1 - s)^4, the decay of y''^2 to the free end, the best
            for its number of hinges; `gauss_legendre`; `equal` links with a root spring of
            2 EI/h; `mid`-link hinges.
        n: Number of hinges, at least 1.

    Returns:
        Positions s_j in ascending order, shape (n,), and weights w_j, shape (n,).

    Raises:
        ValueError: If the rule is unknown or `n` is below 1.
    """
    positive(n_hinges=n)
    rules: dict[str, Callable[[int], tuple[Array, Array]]] = {
        "gauss_jacobi": _gauss_jacobi,
        "gauss_legendre": _gauss_legendre,
        "equal": lambda n: (np.arange(n) / n, np.r_[0.5, np.ones(n - 1)] / n),
        "mid": lambda n: ((np.arange(n) + 0.5) / n, np.full(n, 1 / n)),
    }
    if rule not in rules:
        raise ValueError(f"hinge rule {rule!r} is not known; there are: {', '.join(rules)}")
    return rules[rule](n)


def _gauss_legendre(n: int) -> tuple[Array, Array]:
    x, w = leggauss(n)
    return (1 + x) / 2, w / 2


def _gauss_jacobi(n: int) -> tuple[Array, Array]:
    """The weight is (1 - s/l)^4: nodes are the zeros of the Jacobi polynomial P_n^(4,0).

    Written out, because scipy.special takes longer to import than a short flight to fly.
    """
    # Golub & Welsch (1969); their eigenvectors would lose digits of the weights near the tip.
    k = np.arange(n)
    below = k[1:] * (k[1:] + 4) / ((k[1:] + 2) * np.sqrt((2 * k[1:] + 3) * (2 * k[1:] + 5)))
    x = np.linalg.eigvalsh(np.diag(-4 / ((k + 2) * (k + 3))) + np.diag(below, -1))
    for _ in range(2):  # Newton, from a few units in the last place
        value, slope = _jacobi(n, x)
        x = x - value / slope
    slope = _jacobi(n, x)[1]
    return (1 + x) / 2, 16 / ((1 - x * x) * slope**2 * (1 - x) ** 4)


def _jacobi(n: int, x: Array) -> tuple[Array, Array]:
    """P_n^(4,0) and its derivative by the recurrence in n (DLMF 18.9.2 and 18.9.17)."""
    before, value = np.zeros_like(x), np.ones_like(x)
    for k in range(1, n + 1):
        ahead = (2 * k + 3) * ((k + 2) * (k + 1) * x + 4) * value
        ahead -= (k + 3) * (k - 1) * (k + 2) * before
        before, value = value, ahead / (k * (k + 1) * (k + 4))
    slope = n * ((2 - (n + 2) * x) * value + (n + 4) * before) / ((n + 2) * (1 - x * x))
    return value, slope
