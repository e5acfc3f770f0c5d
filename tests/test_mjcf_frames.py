"""Root sites and defaults of a user's MJCF: what is meant is what is grown."""

import numpy as np
import pytest

from spacecraft_sim import linearize, mjcf, spacecraft

SITE = 'name="right_root" pos="-3 0 0" quat="0 0 0 1"'


def machine(tmp_path, *changes):
    original = spacecraft.load("two_boom")
    text = original.xml.with_name("two_boom.xml").read_text()
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    path = tmp_path / "bus.xml"
    path.write_text(text)
    return original.model_copy(update={"xml": path})


@pytest.mark.parametrize(
    "turned",
    ['euler="0 0 180"', 'xyaxes="-1 0 0 0 -1 0"', 'axisangle="0 0 1 180"'],
)
def test_a_root_may_be_turned_in_any_way_that_mjcf_knows(turned, tmp_path):
    spelt = machine(tmp_path, (SITE, f'name="right_root" pos="-3 0 0" {turned}'))
    plain = spacecraft.load("two_boom")
    found, wanted = (linearize.linearize(mjcf.compile(m, timestep=0.01)) for m in (spelt, plain))
    # cos and sin of 180 degrees are rounded.
    np.testing.assert_allclose(found.M, wanted.M, rtol=0, atol=1e-9)


def test_a_root_may_stand_in_a_frame(tmp_path):
    inside = '<frame pos="-3 0 0" quat="0 0 0 1"><site name="right_root" size="0.08"/></frame>'
    spelt = machine(tmp_path, (f'<site {SITE} size="0.08"/>', inside))
    found = linearize.linearize(mjcf.compile(spelt, timestep=0.01)).M
    wanted = linearize.linearize(mjcf.compile(spacecraft.load("two_boom"), timestep=0.01)).M
    np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-9)


def test_defaults_of_the_bus_do_not_reach_the_booms(tmp_path):
    spelt = machine(
        tmp_path,
        ("<worldbody>", '<default><joint armature="5" frictionloss="1"/></default><worldbody>'),
        ('axis="0 0 1"/>', 'axis="0 0 1" armature="0" frictionloss="0"/>'),
    )
    model = mjcf.compile(spelt, timestep=0.01)
    assert not model.dof_armature.any()
    assert not model.dof_frictionloss.any()


def test_a_thruster_that_clips_its_force_is_refused(tmp_path):
    clipped = machine(tmp_path, ("<motor ", '<motor forcerange="-1 1" '))
    with pytest.raises(ValueError, match=r"thruster_z.*forcerange"):
        mjcf.compile(clipped, timestep=0.01)


@pytest.mark.filterwarnings("ignore:compiler attribute 'settotalmass'")  # MuJoCo's own word on it
def test_a_compiler_setting_that_rescales_the_booms_is_refused(tmp_path):
    scaled = machine(tmp_path, ("<worldbody>", '<compiler settotalmass="50"/><worldbody>'))
    with pytest.raises(ValueError, match=r"boom 'left' weighs .* settotalmass"):
        mjcf.compile(scaled, timestep=0.01)
