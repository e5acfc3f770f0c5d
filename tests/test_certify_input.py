"""What the command `certify` reads of a machine, and what it says to bad input."""

import re

import pytest

from spacecraft_sim import certificate_input, cli, library
from spacecraft_sim.spacecraft import load


def certify(out, name, *words):
    return cli.main(["certify", str(name), "--out", str(out), *words])


# -- bad input -------------------------------------------------------------------------------------

CRAFT = """<mujoco><option gravity="0 0 {g}">{contacts}</option><worldbody>
<body name="bus">{free}<inertial pos="0 0 0" mass="10" diaginertia="{inertia} 30 30"/>
<geom size="1" mass="0"/>
<body name="panel"><joint name="hinge" axis="1 0 0" {joint}/>
<inertial pos="0 1 0" mass="1" diaginertia="1e-13 1e-13 1e-13"/>
<body><inertial pos="0 -1 0" mass="1" diaginertia="1e-13 1e-13 1e-13"/>
<geom size="1" mass="0"/></body></body>
</body></worldbody></mujoco>"""
GOOD = {
    "g": 0, "contacts": '<flag contact="disable"/>', "free": "<freejoint/>", "inertia": 20,
    "joint": 'stiffness="3" damping="1"',
}  # fmt: skip


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"free": ""}, r"it needs one free joint, on the bus; it has none, but hinge hinge"),
        ({"joint": 'damping="1"'}, r"joint hinge has stiffness 0\.0, needs > 0"),
        ({"joint": 'stiffness="-3" damping="1"'}, r"joint hinge has stiffness -3\.0, needs > 0"),
        ({"joint": 'stiffness="3 1" damping="1"'}, "polynomial stiffness or damping"),
        ({"joint": 'stiffness="3" damping="1" springref="0.1"'}, "set springref = ref"),
        ({"joint": 'stiffness="3"'}, "a guaranteed bound needs damping in every motion"),
        ({"inertia": "1e-10"}, r"D is not positive definite.*\(a collinear rod\)"),
        ({"g": -9.81}, "gravity is on"),
        ({"contacts": ""}, "contacts are on"),
    ],
)
def test_what_is_no_free_elastic_structure_ends_with_2(changes, message, tmp_path, capsys):
    path = tmp_path / "craft.xml"
    path.write_text(CRAFT.format(**{**GOOD, **changes}), encoding="utf-8")
    assert certify(tmp_path / "out", path, "--torque", "1", "--dwell", "1") == 2
    error = capsys.readouterr().err
    assert re.search(message, error), error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("name", "words", "message"),
    [
        ("two_boom_3d", ("--dwell", "0"), "--dwell must be finite and > 0, got 0.0"),
        ("two_boom_3d", ("--dwell", "1", "-1", "1"), "--dwell must be finite and > 0"),
        ("two_boom_3d", ("--torque", "0"), "--torque must be finite and > 0, got 0.0"),
        ("two_boom_3d", ("--torque", "1", "2"), "--torque takes one number or three"),
        ("two_boom_3d", ("--delay", "-1"), "--delay must be finite and >= 0, got -1.0"),
        ("two_boom_3d", ("--disturbance", "1", "2"), "--disturbance takes one number or three"),
        ("two_boom_3d", ("--disturbance", "0.02"), "about x, 0.02 N m, must be below the torque"),
        ("two_boom_3d", ("--timestep", "-1"), "timestep = -1.0"),
        ("two_bom_3d", (), "did you mean 'two_boom_3d'?"),
        ("two_bom_3d", (), "or give the path of an MJCF file, ending in .xml"),
        ("missing.xml", ("--torque", "1", "--dwell", "1"), "missing.xml: no such file"),
        ("two_boom_free", (), "does not say what --torque and --dwell of its channels are"),
        ("rigid_bus", ("--torque", "1", "--dwell", "1"), "nothing in it is elastic"),
        ("two_boom", ("--torque", "1", "--dwell", "1"), "it needs one free joint"),
    ],
)
def test_bad_numbers_and_names_end_with_2(name, words, message, tmp_path, capsys):
    assert certify(tmp_path / "out", name, *words) == 2
    assert message in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_a_file_needs_torque_and_dwell(tmp_path, capsys):
    path = tmp_path / "craft.xml"
    path.write_text(CRAFT.format(**GOOD), encoding="utf-8")
    assert certify(tmp_path / "out", path, "--torque", "1") == 2
    assert "craft does not say what --dwell of its channels are" in capsys.readouterr().err
    path.write_text("<mujoco><nothing/></mujoco>", encoding="utf-8")
    assert certify(tmp_path / "out", path, "--torque", "1", "--dwell", "1") == 2
    assert "craft.xml: XML Error" in capsys.readouterr().err
    (tmp_path / "out").mkdir()
    assert certify(tmp_path / "out", "two_boom_light") == 2
    assert "exists already" in capsys.readouterr().err


NOT = "is not a free bus with elastic parts:"
NO_FREE = f"{NOT} it needs one free joint, on the bus; it has none, but"
SHIPPED = (
    "Shipped machines that are: asymmetric_booms, four_boom, two_boom_3d, two_boom_light; with "
    "--torque and --dwell hub_two_booms, two_boom_free"
)


@pytest.mark.parametrize(
    ("name", "has"),
    [
        ("arm2", f"arm2 {NO_FREE} hinge joint_1, hinge joint_2. "),
        ("arm7", f"arm7 {NO_FREE} hinge joint_1, "),
        ("flexible_joint_arm", f"flexible_joint_arm {NO_FREE} hinge link_1, "),
        ("rigid_body_ball", f"rigid_body_ball {NO_FREE} ball bus. "),
        ("rigid_body_free", f"rigid_body_free {NOT} no joint but the free one"),
        ("rigid_bus", f"rigid_bus {NOT} no joint but the free one"),
        ("two_boom", f"two_boom {NO_FREE} hinge attitude_z, hinge left_1, hinge left_2, "),
        ("two_boom_twin", f"two_boom_twin {NO_FREE} hinge attitude_z, "),
    ],
)
def test_shipped_machines_that_are_not_free_or_not_elastic_hear_which_are(
    name, has, tmp_path, capsys
):
    assert certify(tmp_path / "out", name) == 2
    error = capsys.readouterr().err
    assert has in error
    assert SHIPPED in error
    assert "at unit level" not in error


@pytest.mark.parametrize("name", library.spacecraft_names())
def test_each_shipped_machine_is_read_or_refused_for_a_reason(name):
    if name in ("asymmetric_booms", "four_boom", "two_boom_3d", "two_boom_light"):
        assert certificate_input.read(name).name == name
        return
    with pytest.raises(ValueError, match=f"{NOT}|does not say what --"):
        certificate_input.read(name)
    if name in ("hub_two_booms", "two_boom_free"):
        assert certificate_input.read(name, torque=[1.0], dwell=[2.0]).name == name


def test_a_motor_of_an_elastic_joint_is_no_torque_on_the_bus(tmp_path):
    machine = load("two_boom_light")
    text = machine.xml.with_name("two_boom_light.xml").read_text(encoding="utf-8")
    joint = re.search(r'<joint name="(left_x)"', text)
    assert joint
    motor = '<actuator><motor name="bender" joint="left_x"/>'
    (tmp_path / "odd.xml").write_text(text.replace("<actuator>", motor, 1), encoding="utf-8")
    table = machine.xml.with_name("two_boom_light.toml").read_text(encoding="utf-8")
    table = table.replace('["thruster_x_top", "thruster_x_bottom"]', '["bender"]')
    path = tmp_path / "odd.toml"
    path.write_text(table.replace('"scene.xml"', '"odd.xml"'), encoding="utf-8")
    with pytest.raises(ValueError, match=r"a torque \[0\. 0\. 0\.\] N m on the bus"):
        certificate_input.read(str(path))


def test_help_names_the_folder_that_is_written(capsys):
    with pytest.raises(SystemExit):
        cli.main(["certify", "--help"])
    assert "default runs/certificate-NAME, numbered" in " ".join(capsys.readouterr().out.split())


# -- what is read of a machine ---------------------------------------------------------------------


def test_torques_are_levels_times_arms():
    found = certificate_input.read("two_boom_3d")
    assert found.torque == pytest.approx([0.02] * 3, rel=1e-14)  # 0.01 N, two arms of 1 m
    assert found.dwell.tolist() == [2.66, 2.0, 2.04]
    assert found.delay.tolist() == [0.12, 0.1, 0.08]
    other = certificate_input.read("two_boom_3d", torque=[1.0, 2.0, 3.0], delay=[0.0])
    assert other.torque.tolist() == [1.0, 2.0, 3.0]
    assert other.dwell.tolist() == [2.66, 2.0, 2.04]
    assert other.delay.tolist() == [0.0] * 3
    free = certificate_input.read("two_boom_free", torque=[50.0], dwell=[0.05])
    assert free.torque.tolist() == [50.0] * 3
    assert free.delay.tolist() == [0.0] * 3


@pytest.mark.parametrize(
    ("motors", "message"),
    [
        ('["thruster_x_top"]', r"thruster_x at unit level is a force .* needs pure torques"),
        ('["thruster_y_top", "thruster_y_bottom"]', "thruster_x and thruster_y both turn y"),
    ],
)
def test_thrusters_that_are_no_pure_torques_are_refused(motors, message, tmp_path):
    machine = load("two_boom_light")
    text = machine.xml.with_name("two_boom_light.toml").read_text(encoding="utf-8")
    text = text.replace('["thruster_x_top", "thruster_x_bottom"]', motors)
    text = text.replace('"scene.xml"', f'"{machine.xml}"')
    path = tmp_path / "odd.toml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ValueError, match=message):
        certificate_input.read(str(path))
    # Numbers of one's own do not need them.
    assert certificate_input.read(str(path), torque=[1.0], dwell=[1.0]).name == "odd"
