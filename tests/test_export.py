"""`spacecraft-sim export`: one file that plain MuJoCo loads, with every digit."""

import mujoco
import numpy as np
import pytest

from spacecraft_sim import cli, library, mjcf, spacecraft


@pytest.mark.parametrize("name", [*library.spacecraft_names(), "efremov-nonlocal"])
def test_export_writes_one_file_that_plain_mujoco_flies(name, tmp_path, capsys):
    path = tmp_path / "machine.xml"
    assert cli.main(["export", name, str(path)]) == 0
    assert [p.name for p in tmp_path.iterdir()] == ["machine.xml"]
    model = mujoco.MjModel.from_xml_path(str(path))
    data = mujoco.MjData(model)
    machine = name if name in library.spacecraft_names() else "two_boom"  # that of the scenario
    compiled = mjcf.compile(spacecraft.load(machine), timestep=0.01)
    # All digits are written: rounding.
    np.testing.assert_allclose(model.body_mass, compiled.body_mass, rtol=1e-13)
    np.testing.assert_allclose(model.body_inertia, compiled.body_inertia, rtol=1e-13, atol=1e-15)
    data.ctrl[:] = 1.0
    mujoco.mj_step(model, data, 10)
    assert not data.warning.number.any()
    assert np.any(data.qvel != 0)


def test_export_overwrites_nothing_and_says_what_it_cannot_write(tmp_path, capsys):
    path = tmp_path / "precious.xml"
    path.write_text("mine")
    assert cli.main(["export", "two_boom", str(path)]) == 2
    assert path.read_text() == "mine"
    assert "exists already" in capsys.readouterr().err
    assert cli.main(["export", "two_boom", str(tmp_path / "no" / "x.xml")]) == 2
    assert "cannot be written" in capsys.readouterr().err
