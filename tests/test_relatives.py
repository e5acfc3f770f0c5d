"""Relatives of shipped machines: those of its own numbers are the machine itself, others scale."""

import mujoco
import numpy as np
import pytest
from relatives import generator, relative, shipped

from spacecraft_sim import spacecraft
from spacecraft_sim.elastic_influence import elastic_model, influence


def test_with_its_own_numbers_it_is_the_machine():
    own, twin = shipped("two_boom_3d")[1], relative(2.0, 0.01)[1]
    for name in ("D", "B", "C", "G", "H", "J"):
        np.testing.assert_allclose(getattr(twin, name), getattr(own, name), rtol=1e-15)
    light, same = shipped("two_boom_light")[1], relative(0.1, 0.05)[1]
    for name in ("D", "B", "C", "G", "H", "J"):
        np.testing.assert_allclose(getattr(same, name), getattr(light, name), rtol=1e-15)


@pytest.mark.parametrize(("tip", "ratio"), [(0.01, 0.2), (1.0, 0.005)])
def test_frequency_and_damping_ratio_stay_with_the_bus_held(tip, ratio):
    model, elastic = relative(tip, ratio)
    held = elastic.D + elastic.G @ elastic.H
    # A free bus also shifts: 2 tip/400 of it with both booms the same way.
    rates = np.sqrt(np.diag(elastic.C) / np.diag(held))
    assert rates == pytest.approx([1.0, 1.3, 1.0, 1.3], rel=3e-3)
    ratios = np.diag(elastic.B) / (2 * np.sqrt(np.diag(elastic.C) * np.diag(held)))
    assert ratios == pytest.approx([ratio] * 4, rel=3e-3)
    assert model.body_mass.sum() == pytest.approx(400 + 2 * tip, rel=1e-14)


def test_a_relative_is_written_as_a_spacecraft(tmp_path):
    path = generator().write(tmp_path, "two_boom_3d", tip=0.3, ratio=0.05, torque=0.7, dwell=0.5)
    machine = spacecraft.load(path)
    assert [t.levels for t in machine.thrusters] == [(0.35,)] * 3
    assert [t.min_on_time for t in machine.thrusters] == [0.5] * 3
    assert [t.delay.mean for t in machine.thrusters] == [0.0] * 3
    elastic = elastic_model(mujoco.MjModel.from_xml_path(str(machine.xml)))
    found = influence(elastic, torque=1.0, dwell=0.5)
    assert found.moment_l1 == pytest.approx(
        influence(relative(0.3, 0.05)[1], torque=1.0, dwell=0.5).moment_l1, rel=1e-12
    )
