"""Boom chains in MJCF: the beam they stand for, the names they carry, what is refused."""

import re
from decimal import Decimal

import mujoco
import numpy as np
import pytest
import scipy.linalg

from spacecraft_sim import beam, linearize, mission, mjcf
from spacecraft_sim.readings import undeformed_mass_matrix
from spacecraft_sim.trajectory import channel_units

BOOM = {"length": 7.5, "linear_density": 1.53, "bending_stiffness": 35.0}
HUB = {"bus_inertia": 30.0, "root_radius": 3.0}
RULES = ("equal", "mid", "gauss_legendre", "gauss_jacobi")

# Relative frequency errors of chains for the boom of Efremov et al. (2006), modes 1, 2, 3 of the
# clamped boom, then of the free machine, to the digits that are written.
ERRORS = {
    ("equal", 4): "-.028 -.088 -.138 .012 -.014 -.10",
    ("equal", 8): "-7.1e-3 -.024 -.039 3.0e-3 -1.9e-3 -.015",
    ("equal", 16): "-1.79e-3 -6.18e-3 -1.01e-2 7.46e-4 -4.03e-4 -3.19e-3",
    ("equal", 32): "-4.5e-4 -1.6e-3 -2.6e-3 1.9e-4 -9.7e-5 -7.7e-4",
    ("mid", 4): ".015 .052 .075 -6.4e-3 -4.5e-4 -1e-4",
    ("mid", 8): "3.6e-3 .013 .020 -1.5e-3 5.4e-4 5.1e-3",
    ("mid", 16): "8.97e-4 3.12e-3 5.10e-3 -3.74e-4 1.77e-4 1.46e-3",
    ("mid", 32): "2.2e-4 7.8e-4 1.3e-3 -9.3e-5 4.7e-5 3.8e-4",
    ("gauss_legendre", 4): "-6.2e-5 4.7e-3 -.17 -5.7e-4 4.9e-3 -.17",
    ("gauss_legendre", 8): "-3.9e-6 -2.9e-4 -2.7e-3 -3.6e-5 -5.6e-4 -3.9e-3",
    ("gauss_legendre", 16): "-2.7e-7 -1.9e-5 -1.4e-4 -2.5e-6 -3.4e-5 -1.8e-4",
    ("gauss_jacobi", 4): "-1.7e-5 -1.6e-3 -.035 -1.6e-4 -3.0e-3 -.063",
    ("gauss_jacobi", 8): "-1.9e-6 -1.4e-4 -1.2e-3 -1.8e-5 -2.7e-4 -1.7e-3",
    ("gauss_jacobi", 16): "-1.8e-7 -1.2e-5 -9.0e-5 -1.6e-6 -2.3e-5 -1.2e-4",
    ("gauss_jacobi", 32): "-1.40e-8 -9.5e-7 -6.7e-6 -1.3e-7 -1.7e-6 -8.8e-6",
}


def compiled(spacecraft, **options):
    return mjcf.compile(spacecraft, timestep=0.01, **options)


def frequencies(model, boom):
    """Clamped and free frequencies of two equal booms, each shape (n_hinges,), rad/s."""
    linear = linearize.linearize(model)
    left, right = (
        [int(model.joint(f"{side}_{j + 1}").dofadr[0]) for j in range(boom.n_hinges)]
        for side in ("left", "right")
    )
    bus = list(linear.rigid)
    M, K = linear.M, linear.K[np.ix_(left, left)]
    elastic = M - M[:, bus] @ np.linalg.solve(M[np.ix_(bus, bus)], M[bus])
    # Equal angles of both booms are the antisymmetric motion.
    free = elastic[np.ix_(left, left)] + elastic[np.ix_(left, right)]
    # K is the norm: the slow modes, the largest of 1/omega^2, then keep all digits.
    return [
        np.sqrt(1 / scipy.linalg.eigh(mass, K, eigvals_only=True)[::-1])
        for mass in (M[np.ix_(left, left)], free)
    ]


def frequency_errors(spacecraft):
    clamped, free = frequencies(compiled(spacecraft), spacecraft.booms[0])
    return np.r_[
        clamped[:3] / beam.cantilever_frequencies(**BOOM, n=3) - 1,
        free[:3] / beam.coupled_frequencies(**BOOM, **HUB, n=3) - 1,
    ]


@pytest.mark.parametrize(("rule", "n"), ERRORS)
def test_frequency_errors_of_the_compiled_chain_are_those_of_its_rule(machine, rule, n):
    errors = frequency_errors(machine(rule=rule, n_hinges=n))
    for found, printed in zip(errors, map(Decimal, ERRORS[rule, n].split()), strict=True):
        # Half of the last digit, and half of the next: the figures were rounded twice.
        half_a_digit = 0.55 * 10.0 ** printed.as_tuple().exponent
        assert found == pytest.approx(float(printed), abs=half_a_digit, rel=0)


@pytest.mark.parametrize(
    ("rule", "order", "slack"),
    # The next term of equal chains is h^2 smaller. Gauss rules converge like n^-4 in the limit, as
    # the clamped end sees it; at these n they are within half an order.
    [("equal", 2, 0.02), ("mid", 2, 0.02), ("gauss_legendre", 4, 0.3), ("gauss_jacobi", 4, 0.7)],
)
def test_chain_converges_with_the_order_of_its_rule(machine, rule, order, slack):
    coarse, fine = (abs(frequency_errors(machine(rule=rule, n_hinges=n))[0]) for n in (8, 16))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=slack)


def test_four_jacobi_hinges_beat_thirty_two_equal_ones_on_the_first_mode(machine):
    few = frequency_errors(machine(rule="gauss_jacobi", n_hinges=4))
    many = frequency_errors(machine(rule="equal", n_hinges=32))
    assert abs(few[0]) < abs(many[0])
    assert abs(few[3]) < abs(many[3])


@pytest.mark.parametrize("rule", RULES)
def test_inertia_and_mass_are_exact_for_any_number_of_hinges(machine, rule):
    for n in (1, 3, 8):
        model = compiled(machine(rule=rule, n_hinges=n))
        # Closed form J = 30 + 2 m (10.5^3 - 3^3)/3, to rounding of the sum over the links; each rod
        # has a millionth of its bending inertia along its axis, across the plane none of it.
        assert undeformed_mass_matrix(model)[0, 0] == pytest.approx(1183.2375, rel=1e-13)
        assert model.body_mass.sum() == pytest.approx(100 + 2 * 7.5 * 1.53, rel=1e-14)


@pytest.mark.parametrize("rule", RULES)
def test_damping_ratio_of_the_slow_modes_is_half_of_chi_omega(machine, rule):
    model = compiled(machine(rule=rule, damping_time=0.018542))
    eigenvalues = linearize.linearize(model).eigenvalues()
    modes = eigenvalues[eigenvalues.imag > 1e-3]
    modes = modes[np.argsort(np.abs(modes))][:6]  # modes 1-3, clamped and free
    ratio = -modes.real / np.abs(modes)
    # The damping is chi times the stiffness, so this is exact; eigenvalues lose some 1e-11.
    np.testing.assert_allclose(ratio, 0.018542 * np.abs(modes) / 2, atol=1e-8, rtol=0)
    assert np.all(ratio > 1e-3)


def test_hinge_has_the_stiffness_and_damping_of_its_weight(machine):
    spacecraft = machine(rule="mid", n_hinges=4, damping_time=0.02)
    model = compiled(spacecraft)
    for name in mjcf.hinge_names(spacecraft.booms[0]):
        k = np.ravel(model.joint(name).stiffness)[0]
        assert k == pytest.approx(35.0 / (7.5 / 4), rel=1e-15)
        assert np.ravel(model.joint(name).damping)[0] == pytest.approx(0.02 * k, rel=1e-15)


def test_hinges_stand_where_the_rule_puts_them(machine):
    spacecraft = machine(rule="gauss_jacobi", n_hinges=5)
    model, data = compiled(spacecraft), None
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    s, _ = beam.hinge_rule("gauss_jacobi", 5)
    for side, sign in (("left", 1), ("right", -1)):
        anchors = [data.joint(f"{side}_{j + 1}").xanchor for j in range(5)]
        np.testing.assert_allclose(np.array(anchors)[:, 0], sign * (3 + 7.5 * s), rtol=1e-14)
        tip = data.site(f"{side}_tip").xpos
        np.testing.assert_allclose(tip, [sign * 10.5, 0, 0], atol=1e-14)  # rounding


def test_tip_mass_adds_its_inertia_at_the_tip(machine):
    model = compiled(machine(tip_mass=2.0))
    # A millionth of 2 kg m^2 is left to each point, as MuJoCo wants a positive inertia.
    inertia = 1183.2375 + 2 * 2.0 * (10.5**2 + 1e-6)
    assert undeformed_mass_matrix(model)[0, 0] == pytest.approx(inertia, rel=1e-12)


@pytest.mark.parametrize("order", [1, 2, 3])
@pytest.mark.parametrize("rule", RULES)
def test_tip_of_a_boom_bent_into_a_mode_converges_to_twice_the_modal_coordinate(
    machine, rule, order
):
    def error(n):
        boom = machine(rule=rule, n_hinges=n).booms[0]
        angles = mjcf.bent(boom, order, 0.1)
        assert list(angles) == mjcf.hinge_names(boom)
        s, _ = beam.hinge_rule(rule, n)
        tip = np.array(list(angles.values())) @ (boom.length * (1 - s))
        return abs(tip - 0.2 * (-1) ** (order - 1))

    # The quadrature of int Phi'' (l - x) dx = Phi(l), an entire function.
    if rule == "gauss_legendre":
        assert error(16) < 1e-13  # rounding
    elif rule == "gauss_jacobi":
        # (1 - s)^3 over its weight (1 - s)^4 leaves a pole at the tip; order 8 in the limit.
        assert 6.4 < np.log2(error(16) / error(32)) < 8
    else:
        # Euler-Maclaurin; the next term is (z/16)^2 smaller, z^2 = 62 for mode 3.
        assert np.log2(error(16) / error(32)) == pytest.approx(2, abs=0.01)


def test_flight_model_is_rk4_without_automatic_reset_at_the_given_step(machine):
    model = compiled(machine())
    assert model.opt.integrator == mujoco.mjtIntegrator.mjINT_RK4
    assert model.opt.disableflags & mujoco.mjtDisableBit.mjDSBL_AUTORESET
    assert model.opt.timestep == 0.01


def test_inputs_are_channels_then_disturbances_with_their_actuators(machine):
    thruster = {"name": "pair", "actuators": ["thruster_z"]}
    spacecraft = machine(thruster=thruster)
    assert mjcf.channels(spacecraft, ["disturbance_z"]) == {
        "pair": ("thruster_z",),
        "disturbance_z": ("disturbance_z",),
    }
    assert mjcf.motors(machine().thrusters[0]) == ("thruster_z",)


MOTORS = """<mujoco><worldbody>
  <body><freejoint/><geom size="1"/><site name="jet" euler="0 90 0"/>
    <body><joint name="hinge"/><geom size="1"/>
      <body><joint name="slide" type="slide"/><geom size="1"/></body></body></body>
</worldbody><actuator>
  <motor name="push" site="jet" gear="0 2 0 0 0 0"/>
  <motor name="turn" site="jet" gear="0 0 0 0 1 0"/>
  <motor name="at_hinge" joint="hinge"/><motor name="at_slide" joint="slide"/>
</actuator></mujoco>"""


def test_units_of_inputs_are_those_of_what_they_do():
    model = mujoco.MjModel.from_xml_string(MOTORS)
    one = {name: (name,) for name in ("push", "turn", "at_hinge", "at_slide")}
    wanted = {"push": "N", "turn": "N m", "at_hinge": "N m", "at_slide": "N"}
    assert mjcf.input_units(model, one) == wanted
    assert mjcf.input_units(model, {"jets": ("turn", "push")}) == {"jets": "N"}


@pytest.mark.parametrize(
    ("name", "units"),
    [("efremov-nonlocal", {"N m"}), ("ivanova-sokolov-two-axes", {"N", "N m"}),
     ("burkov-position", {"N m"})],
)  # fmt: skip
def test_both_flights_of_a_scenario_know_the_units_of_their_thrusts(name, units):
    ready = mission.assemble(mission.load_scenario(name, ("duration=1.0",)))
    for plant in ("mujoco", "reduced"):
        flight = ready.fly(plant)
        channels = channel_units(flight)
        assert set(flight.units[n] for n in ready.mujoco.inputs) == units
        for channel, unit in channels.items():
            assert flight.units[f"{channel}_command"] == unit
            assert flight.units[f"{channel}_impulse"] == flight.units[f"{channel}_spent"]
            assert flight.units[f"{channel}_spent"] == f"{unit} s"


@pytest.mark.parametrize(("axis", "k"), [("x", 0), ("y", 1), ("z", 2)])
def test_disturbance_is_a_torque_on_the_bus_about_its_axis(machine, axis, k):
    name = f"disturbance_{axis}"
    linear = linearize.linearize(compiled(machine(free=True), disturbances=[name]))
    force = linear.B[:, linear.actuators.index(name)]
    assert force[:6].tolist() == [0, 0, 0, *np.eye(3)[k]]
    assert not np.any(force[6:])


def test_exported_file_is_the_same_machine_for_plain_mujoco(machine, tmp_path):
    spacecraft = machine(damping_time=0.018542, tip_mass=0.5)
    mjcf.export(spacecraft, tmp_path / "hub.xml")
    there = mujoco.MjModel.from_xml_path(str(tmp_path / "hub.xml"))
    here = mjcf.assemble(spacecraft).compile()
    for kind in ("njnt", "nu", "nsensor", "nsite", "nbody"):
        assert getattr(there, kind) == getattr(here, kind)
    assert [there.joint(j).name for j in range(there.njnt)] == [
        here.joint(j).name for j in range(here.njnt)
    ]
    # Rounding of decimal numbers that carry every bit.
    exact = {"rtol": 1e-13, "atol": 1e-15}
    M = undeformed_mass_matrix(here)
    np.testing.assert_allclose(undeformed_mass_matrix(there), M, rtol=0, atol=1e-13 * M.max())
    np.testing.assert_allclose(there.jnt_stiffness, here.jnt_stiffness, **exact)
    np.testing.assert_allclose(there.dof_damping, here.dof_damping, **exact)


# -- what is refused ---------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("xml", "message"),
    [
        (('name="bus">', 'name="buss">'), "body 'bus' is not in hub.xml; did you mean 'buss'"),
        (("left_root", "left_rot"), "site 'left_root' is not in hub.xml; did you mean 'left_rot'"),
        (
            ('motor name="thruster_z"', 'motor name="thruster_y"'),
            "actuator 'thruster_z' is not in hub.xml; did you mean 'thruster_y'",
        ),
        (('gravity="0 0 0"', 'gravity="0 0 -1"'), r"gravity is on: \[.*-1.*\]; set <option"),
        (("<option gravity", '<option density="1" gravity'), "density or viscosity"),
        (("<option gravity", '<option viscosity="1" gravity'), "density or viscosity"),
        (("<motor", '<position kp="2"'), "'thruster_z' drives a thruster and must be a <motor>"),
        (('gear="0 0 0 0 0 1"', 'ctrlrange="-2 2" gear="0 0 0 0 0 1"'),
         r"'thruster_z' has the level 3\.0, outside the ctrlrange \[-2\.0, 2\.0\]"),
        (('gear="0 0 0 0 0 1"', 'ctrlrange="-2 5" gear="0 0 0 0 0 1"'),
         r"'thruster_z' has the level 3\.0, outside the ctrlrange \[-2\.0, 5\.0\]"),
        (("<site name=\"centre\"/>", "<sight/>"), r"(?s)hub\.xml: .*sight"),
    ],
)  # fmt: skip
def test_machine_that_cannot_fly_is_refused(machine, xml, message):
    with pytest.raises(ValueError, match=message):
        compiled(machine(xml=xml))


def test_contacts_are_refused_unless_they_cannot_happen(machine):
    shapes = '<geom size="1" mass="0"/><geom size="1" mass="0"/>'
    on = ('<flag contact="disable"/></option>', "</option>")
    compiled(machine(xml=on))  # only booms, which touch nothing
    touching = machine(xml=on)
    text = touching.xml.read_text(encoding="utf-8")
    touching.xml.write_text(text.replace('<site name="centre"/>', f'<site name="centre"/>{shapes}'))
    with pytest.raises(ValueError, match='contacts are on; set <flag contact="disable"/>'):
        compiled(touching)


def test_all_reasons_not_to_fly_are_given_at_once(machine):
    with pytest.raises(ValueError, match=r"gravity is on.*density"):
        compiled(machine(xml=('gravity="0 0 0"', 'gravity="0 0 -1" density="1"')))


def test_missing_mjcf_is_refused_by_its_path(machine, tmp_path):
    nowhere = machine().model_copy(update={"xml": tmp_path / "nowhere.xml"})
    with pytest.raises(ValueError, match=re.escape(str(tmp_path / "nowhere.xml"))):
        mjcf.assemble(nowhere)


def test_disturbance_about_an_unknown_axis_is_refused_by_name(machine):
    with pytest.raises(ValueError, match="disturbance_w"):
        compiled(machine(), disturbances=["disturbance_w"])
