"""Disturbance torques: the formula, and the straight line that stands for it in a step."""

import math

import numpy as np
import pytest
from scipy.integrate import quad

from spacecraft_sim.disturbance import Disturbance, Torque

WAVE = Torque(constant=0.2, amplitude=0.5, frequency=3.0, phase=0.4)


def test_torque_is_a_constant_and_a_sine():
    assert WAVE(1.3) == 0.2 + 0.5 * math.sin(3.0 * 1.3 + 0.4)
    assert Torque()(5.0) == 0.0


def test_inputs_are_named_by_axis_in_the_order_given():
    disturbance = Disturbance({"z": WAVE, "x": Torque(constant=2.0)})
    assert disturbance.names == ("disturbance_z", "disturbance_x")
    assert disturbance.value(1.0) == [WAVE(1.0), 2.0]


def test_no_torque_is_no_input():
    assert Disturbance({}).names == ()
    assert Disturbance({}).line(0.0, 1.0) == ([], [])


def test_line_of_a_constant_is_the_constant():
    (value,), (rate,) = Disturbance({"z": Torque(constant=0.3)}).line(2.0, 2.5)
    assert value == pytest.approx(0.3, rel=1e-15)  # rounding
    assert rate == 0.0


def test_line_passes_through_the_gauss_points():
    t0, t1 = 0.7, 1.1
    (value,), (rate,) = Disturbance({"z": WAVE}).line(t0, t1)
    for node in np.polynomial.legendre.leggauss(2)[0]:
        offset = (1 + node) / 2 * (t1 - t0)
        assert value + rate * offset == pytest.approx(WAVE(t0 + offset), rel=1e-14)  # rounding


@pytest.mark.parametrize("moment", [0, 1])
def test_mean_and_first_moment_are_kept_to_the_fifth_order(moment):
    def error(span):
        (value,), (rate,) = Disturbance({"z": WAVE}).line(1.0, 1.0 + span)

        def integrand(s):
            return (s - span / 2) ** moment * (WAVE(1.0 + s) - value - rate * s)

        return abs(quad(integrand, 0, span, epsabs=1e-16)[0])

    # The next term is one power of the span higher, here up to 5 % of the first.
    assert math.log2(error(0.02) / error(0.01)) == pytest.approx(5, abs=0.1)


@pytest.mark.parametrize("bad", [math.nan, math.inf])
@pytest.mark.parametrize("name", ["constant", "amplitude", "frequency", "phase"])
def test_torque_must_be_finite(name, bad):
    with pytest.raises(ValueError, match=f"{name}\n.*finite"):
        Torque.model_validate({name: bad})
