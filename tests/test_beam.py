"""Closed forms of the cantilever, against quadrature and against the paper's figures."""

import numpy as np
import pytest
import scipy.linalg
from scipy.integrate import quad
from scipy.special import roots_jacobi

from spacecraft_sim import beam

BOOM = {"length": 7.5, "linear_density": 1.53, "bending_stiffness": 35.0}
HUB = {"bus_inertia": 30.0, "root_radius": 3.0}
RULES = ("gauss_jacobi", "gauss_legendre", "equal", "mid")


def integral(function, length=BOOM["length"]):
    return quad(function, 0.0, length, epsabs=1e-12, epsrel=1e-12, limit=200)[0]


def shape(order, x, derivative=0, length=BOOM["length"]):
    return beam.mode_shape(order, x, length, derivative=derivative)


def coefficients(**changes):
    return beam.galerkin(**{**BOOM, **HUB, "damping_time": 0.018542, "n_modes": 3, **changes})


def coupled_by_galerkin(n_modes):
    g = coefficients(n_modes=n_modes)
    # (1.6): (J A - 2 p p^T) q'' + J C q = 0
    return np.sqrt(
        scipy.linalg.eigh(g.J * np.diag(g.c), g.J * np.diag(g.a) - 2 * np.outer(g.p, g.p))[0]
    )


def test_wave_numbers_solve_the_clamped_free_equation():
    z = beam.wave_numbers(10)
    # The root is known to one ulp of z, and cos has slope up to one there.
    np.testing.assert_allclose(np.cos(z), -1 / np.cosh(z), atol=1e-13, rtol=0)
    # As printed in the paper, eight digits.
    np.testing.assert_allclose(z[:3], [1.8751041, 4.6940911, 7.8547574], atol=5e-8, rtol=0)
    assert np.all(np.abs(np.diff(z) / np.pi - 1) < 0.11)  # none is skipped: they lie pi apart


def test_cantilever_frequencies_are_those_of_the_partial_differential_equation():
    # Reference figures of seven digits after the point.
    np.testing.assert_allclose(
        beam.cantilever_frequencies(**BOOM, n=3), [0.2989624, 1.8735652, 5.2460368], atol=6e-8
    )


@pytest.mark.parametrize("order", [1, 2, 3, 5, 8, 10, 12, 15, 20])
def test_shape_satisfies_its_four_boundary_conditions_and_its_scale(order):
    length, z = BOOM["length"], beam.wave_numbers(order)[-1]
    root = [float(shape(order, 0.0, k)) * (length / z) ** k for k in range(4)]
    tip = [float(shape(order, length, k)) * (length / z) ** k for k in range(4)]
    # Values are of order one in these units and the phase is exact to a few z ulp.
    tolerance = 1e-11
    assert root[:2] == pytest.approx([0, 0], abs=tolerance)
    assert tip[2:] == pytest.approx([0, 0], abs=tolerance)
    assert tip[0] == pytest.approx(2 * (-1) ** (order - 1), abs=tolerance)
    assert root[2] == pytest.approx(2, abs=tolerance)


@pytest.mark.parametrize("order", [1, 2, 3, 6])
@pytest.mark.parametrize("derivative", [1, 2, 3, 4])
def test_derivative_of_the_shape_is_the_limit_of_differences(order, derivative):
    x, h = np.linspace(0.5, 7.0, 14), 1e-4
    difference = (shape(order, x + h, derivative - 1) - shape(order, x - h, derivative - 1)) / (
        2 * h
    )
    wave = beam.wave_numbers(order)[-1] / BOOM["length"]
    # Central differences: (k h)^2/6 < 2e-8 for k < 2.3 1/m, and rounding 1e-16/h.
    np.testing.assert_allclose(
        shape(order, x, derivative), difference, atol=3e-7 * wave**derivative, rtol=0
    )


@pytest.mark.parametrize("order", [1, 2, 3])
def test_coefficients_are_the_integrals_of_the_shapes(order):
    g, i = coefficients(), order - 1
    m, EI, r = BOOM["linear_density"], BOOM["bending_stiffness"], HUB["root_radius"]
    # Adaptive quadrature to 1e-12 of integrands of order one.
    tolerance = 1e-11
    assert g.p[i] == pytest.approx(integral(lambda x: m * (x + r) * shape(order, x)), rel=tolerance)
    assert g.a[i] == pytest.approx(integral(lambda x: m * shape(order, x) ** 2), rel=tolerance)
    assert g.c[i] == pytest.approx(integral(lambda x: EI * shape(order, x, 2) ** 2), rel=tolerance)
    assert g.b[i] == pytest.approx(0.018542 * g.c[i], rel=1e-15)


def test_shapes_are_orthogonal():
    for i, j in ((1, 2), (1, 3), (2, 3)):
        # The norm is 7.5; quadrature leaves some 1e-12.
        assert abs(integral(lambda x, i=i, j=j: shape(i, x) * shape(j, x))) < 1e-10


def test_inertia_is_that_of_the_undeformed_machine():
    booms = 2 * integral(lambda x: BOOM["linear_density"] * (x + HUB["root_radius"]) ** 2)
    assert pytest.approx(HUB["bus_inertia"] + booms, rel=1e-14) == coefficients().J


def test_printed_example_of_the_paper_is_the_second_mode_in_its_scale():
    g = coefficients()
    z = beam.wave_numbers(2)[-1]
    # The paper scales the shape so that (sinh - sin) has the coefficient 1: kappa = l/sigma^2.
    sigma = (np.cosh(z) + np.cos(z)) / (np.sinh(z) + np.sin(z))
    found = [g.J, g.p[1] / sigma, g.a[1] / sigma**2, g.c[1] / sigma**2]
    # Figures of seven digits.
    np.testing.assert_allclose(found, [1183.2375, 22.33735, 11.06263, 38.83257], rtol=1e-6)


def test_coupled_frequencies_are_those_of_the_free_machine():
    # Reference figures of seven digits.
    np.testing.assert_allclose(
        beam.coupled_frequencies(**BOOM, **HUB, n=3), [0.7396290, 2.686849, 6.165607], rtol=2e-7
    )


@pytest.mark.parametrize(("modes", "frequency"), [(1, 0.768785), (3, 0.739730)])
def test_galerkin_frequency_of_few_modes_is_the_reference_figure(modes, frequency):
    # Six digits are given.
    assert coupled_by_galerkin(modes)[0] == pytest.approx(frequency, rel=1e-6)


def test_galerkin_frequencies_fall_to_the_exact_ones_as_modes_are_added():
    exact = beam.coupled_frequencies(**BOOM, **HUB, n=2)
    errors = np.array([coupled_by_galerkin(n)[:2] / exact - 1 for n in (2, 3, 4, 6, 8)])
    assert np.all(np.diff(errors, axis=0) < 0)  # Rayleigh-Ritz: from above, ever closer
    assert np.all(errors > 0)
    # The first mode neglected has z = 26.7; what its share leaves falls like z^-4.
    assert errors[-1, 0] < 1e-5


def test_heavy_bus_clamps_the_booms():
    exact = beam.coupled_frequencies(**BOOM, bus_inertia=1e12, root_radius=3.0, n=3)
    # First order in the ratio of inertias, 1153/1e12.
    np.testing.assert_allclose(exact, beam.cantilever_frequencies(**BOOM, n=3), rtol=1e-8)


def test_booms_without_a_bus_are_pinned_free_beams():
    frequencies = beam.coupled_frequencies(**BOOM, bus_inertia=0.0, root_radius=0.0, n=2)
    z = np.array([3.92660231, 7.06858275])  # tan z = tanh z, nine digits
    exact = z**2 * np.sqrt(35.0 / 1.53) / 7.5**2
    np.testing.assert_allclose(frequencies, exact, rtol=3e-9)


@pytest.mark.parametrize("n", [1, 2, 5, 8])
@pytest.mark.parametrize(("rule", "decay"), [("gauss_legendre", 0), ("gauss_jacobi", 4)])
def test_gauss_rules_integrate_polynomials_up_to_their_degree(rule, decay, n):
    s, w = beam.hinge_rule(rule, n)
    for degree in range(2 * n):
        # int (1-s)^decay s^degree is a beta function.
        exact = np.prod([i / (degree + i) for i in range(1, decay + 1)]) / (degree + decay + 1)
        found = w @ ((1 - s) ** decay * s**degree)
        assert found == pytest.approx(exact, rel=1e-12)  # rounding of n terms


def test_gauss_jacobi_hinges_are_those_of_scipy():
    for n in (1, 3, 8, 16, 32):
        s, w = beam.hinge_rule("gauss_jacobi", n)
        x, v = roots_jacobi(n, 4, 0)
        np.testing.assert_allclose(s, (1 + x) / 2, atol=1e-15)  # a few units of the last place
        # scipy's own error at n = 32, against 60 digits, is 3e-13; here it is 2e-14.
        np.testing.assert_allclose(w, v / (1 - x) ** 4 / 2, rtol=5e-13)


def test_equal_and_mid_hinges_stand_where_they_must():
    s, w = beam.hinge_rule("equal", 4)
    assert s.tolist() == [0, 0.25, 0.5, 0.75]
    assert w.tolist() == [0.125, 0.25, 0.25, 0.25]  # root spring 2 EI/h
    s, w = beam.hinge_rule("mid", 4)
    assert s.tolist() == [0.125, 0.375, 0.625, 0.875]
    assert w.tolist() == [0.25] * 4


@pytest.mark.parametrize(("rule", "order"), [("equal", 2), ("mid", 2)])
def test_equal_and_mid_rules_are_of_second_order_on_bending_energy(rule, order):
    def error(n):
        s, w = beam.hinge_rule(rule, n)
        return abs(w @ beam.mode_shape(1, s, 1.0, derivative=2) ** 2 - beam.wave_numbers(1)[0] ** 4)

    # Euler-Maclaurin: the next term is h^2 smaller.
    assert np.log2(error(32) / error(64)) == pytest.approx(order, abs=0.01)


@pytest.mark.parametrize("rule", RULES)
@pytest.mark.parametrize("n", [1, 3, 16])
def test_hinges_ascend_inside_the_boom_with_positive_weights(rule, n):
    s, w = beam.hinge_rule(rule, n)
    assert len(s) == len(w) == n
    assert s[0] >= 0
    assert s[-1] < 1
    assert np.all(np.diff(s) > 0)
    assert np.all(w > 0)


def test_unknown_rule_is_refused_with_the_choices():
    with pytest.raises(ValueError, match=r"'simpson' is not known.*gauss_jacobi.*mid"):
        beam.hinge_rule("simpson", 4)


@pytest.mark.parametrize("bad", [0.0, -1.0, np.nan, np.inf])
@pytest.mark.parametrize("name", ["length", "linear_density", "bending_stiffness"])
@pytest.mark.parametrize("function", [beam.cantilever_frequencies, beam.coupled_frequencies])
def test_numbers_without_meaning_are_refused_by_name(function, name, bad):
    hub = HUB if function is beam.coupled_frequencies else {}
    with pytest.raises(ValueError, match=rf"must be finite and > 0: {name} = "):
        function(**{**BOOM, **hub, "n": 2, name: bad})


@pytest.mark.parametrize("name", ["bus_inertia", "root_radius", "damping_time"])
def test_zero_bus_is_allowed_but_not_a_negative_one(name):
    coefficients(**{name: 0.0})
    with pytest.raises(ValueError, match=rf"must be finite and >= 0: {name} = -1"):
        coefficients(**{name: -1.0})


def test_all_faults_are_named_at_once():
    with pytest.raises(ValueError, match=r"length = -1\.0, linear_density = nan"):
        coefficients(length=-1.0, linear_density=np.nan)


@pytest.mark.parametrize("count", [0, -2])
def test_counts_below_one_are_refused(count):
    with pytest.raises(ValueError, match=f"n_hinges = {count}"):
        beam.hinge_rule("mid", count)
    with pytest.raises(ValueError, match=f"n_modes = {count}"):
        coefficients(n_modes=count)
    with pytest.raises(ValueError, match=f"n = {count}"):
        beam.cantilever_frequencies(**BOOM, n=count)


@pytest.mark.parametrize("order", [0, -1])
def test_mode_below_the_first_is_refused(order):
    with pytest.raises(ValueError, match=str(order)):
        beam.mode_shape(order, np.array([0.1]), 1.0)
