"""The misprints of Sokolov (2004), listed in controllers/ERRATA.md.

Each test shows that the corrected statement holds and that the printed one does not.

B. N. Sokolov, Guaranteed estimate of the influence of elastic structural elements on the dynamics
of the stabilization of its angular position under relay control; read in a text copy of the Russian
original, where lost dots on letters may be faults of the copy (1, 3, 4).  Numbers are those of the
tests.  Not proved here, for they contradict themselves on the page: the kinetic energy has r' and
not r; (12) compares rho omega-dot with r''; the sums over i in omega-dot and below (18) run over
coordinates; |l, xi| is |(l, xi)|.
"""

import functools

import mpmath
import mujoco
import numpy as np
import pytest

from spacecraft_sim.elastic_influence import ElasticModel, elastic_model, influence
from spacecraft_sim.elastic_modes import find_modes, moment_history
from spacecraft_sim.spacecraft import load
from spacecraft_sim.worst_case import worst_case


def compiled(name="two_boom_3d", *changes):
    text = load(name).xml.with_name(f"{name}.xml").read_text(encoding="utf-8")
    for old, new in changes:
        assert old in text
        text = text.replace(old, new)
    return mujoco.MjModel.from_xml_string(text)


@functools.cache
def structure(name="two_boom_3d"):
    return elastic_model(compiled(name))


# -- (2) and (11): kinematics of points that move in a turning frame -------------------------------


class Moving:
    """A frame that turns anyhow and points that move in it."""

    def __init__(self, seed=3):
        rng = np.random.default_rng(seed)
        self.masses = rng.uniform(1, 3, 3).tolist()
        self.places, self.swings = rng.normal(size=(3, 3)), rng.normal(size=(3, 3, 2))
        self.turns = rng.normal(size=(2, 2))

    def frame(self, t):
        """The rotation from the body to the fixed axes: about z, then about x."""
        a, b = (p * t + q * t**2 for p, q in self.turns)
        sa, ca, sb, cb = mpmath.sin(a), mpmath.cos(a), mpmath.sin(b), mpmath.cos(b)
        z = mpmath.matrix([[ca, -sa, 0], [sa, ca, 0], [0, 0, 1]])
        return z * mpmath.matrix([[1, 0, 0], [0, cb, -sb], [0, sb, cb]])

    def body(self, i, t):
        """r of a point in the axes of the body."""
        return mpmath.matrix([mpmath.sin(p * t) + q * t for p, q in self.swings[i]])

    def r(self, i, t):
        return self.frame(t) * self.body(i, t)

    def rho(self, i, t):
        return self.frame(t) * mpmath.matrix(self.places[i])

    def omega(self, t):
        W = rate(self.frame, t) * self.frame(t).T
        return mpmath.matrix([W[2, 1], W[0, 2], W[1, 0]])


def rate(f, t, n=1):
    """Derivative of a vector or matrix function."""
    shape = f(t)
    return mpmath.matrix([
        [mpmath.diff(lambda s, i=i, j=j: f(s)[i, j], t, n) for j in range(shape.cols)]
        for i in range(shape.rows)
    ])  # fmt: skip


def x(a, b):
    return mpmath.matrix([
        a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]
    ])  # fmt: skip


def size(v):
    return float(mpmath.norm(v))


@mpmath.workdps(30)
def test_01_the_rate_in_the_fixed_frame_is_that_in_the_body_and_the_turning():
    m, t = Moving(), mpmath.mpf("0.7")
    true = rate(lambda s: m.r(0, s), t)
    turning = x(m.omega(t), m.r(0, t))
    seen = m.frame(t) * rate(lambda s: m.body(0, s), t)  # r'
    dotted = rate(lambda s: m.frame(s) * rate(lambda w: m.body(0, w), s), t)  # the rate of r'
    # Thirty digits, of which numerical derivatives cost half.
    assert size(true - seen - turning) < 1e-12
    assert size(true - dotted - turning) > 0.1


def angular_momentum(m, t):
    """K of (7)."""
    total, w = mpmath.zeros(3, 1), m.omega(t)
    for i, mass in enumerate(m.masses):
        r, rho, v = m.r(i, t), m.rho(i, t), rate(lambda s, i=i: m.r(i, s), t)
        total += mass * (x(rho, x(w, rho)) + x(r, x(w, rho) + v) + x(rho, v))
    return total


@mpmath.workdps(30)
def test_03_and_04_accelerations_in_the_rate_of_the_angular_momentum():
    m, t = Moving(), mpmath.mpf("0.4")
    true = rate(lambda s: angular_momentum(m, s), t)
    w, spin = m.omega(t), rate(m.omega, t)
    first = {"r''": mpmath.zeros(3, 1), "r'": mpmath.zeros(3, 1)}
    second = {"dotted": mpmath.zeros(3, 1), "plain": mpmath.zeros(3, 1)}
    for i, mass in enumerate(m.masses):
        r, rho = m.r(i, t), m.rho(i, t)
        velocity, acceleration = (rate(lambda s, i=i: m.r(i, s), t, n) for n in (1, 2))
        rigid = mass * (x(rho, x(spin, rho)) + x(w, x(rho, x(w, rho))))  # J o w' + w x J o w
        carried = x(spin, rho) + x(w, x(w, rho))  # (w x rho)'
        for name, moved in (("r''", acceleration), ("r'", velocity)):
            first[name] += rigid + mass * (x(r, carried + moved) + x(rho, moved))
        for name, turned in (("dotted", carried), ("plain", x(w, rho))):
            second[name] += rigid + mass * (x(r + rho, acceleration) + x(r, turned))
    assert size(true - first["r''"]) < 1e-10 * size(true)
    assert size(true - second["dotted"]) < 1e-10 * size(true)
    assert size(true - first["r'"]) > 0.03 * size(true)
    assert size(true - second["plain"]) > 0.03 * size(true)


# -- (25)-(27): the bound --------------------------------------------------------------------------


def test_07_the_jump_adds_to_the_amplitude_and_not_to_the_exponent():
    modes = find_modes(structure())
    k = 1  # the antisymmetric mode about x
    gamma = modes.residues[k, 0, 0] / 2  # of a unit jump, times xi of the first joint
    half = np.pi / modes.eigenvalues[k].imag
    alpha = gamma
    for _ in range(5):  # reversals half a period apart: the jumps alternate
        kept, jump = alpha * np.exp(modes.eigenvalues[k] * half), -gamma
        beta = kept + jump
        printed = abs(alpha * np.exp((modes.eigenvalues[k] * half).real + jump))
        assert printed < 0.9 * abs(beta)  # no bound at all
        assert (
            abs(beta) <= abs(alpha) * np.exp(modes.eigenvalues[k].real * half) + abs(jump) + 1e-18
        )
        alpha, gamma = beta, -gamma


def test_08_the_moment_carries_the_masses():
    model, elastic = compiled(), structure()
    printed = np.zeros((3, 4))  # (e, sum rho_i x H_is): no mass
    for boom, side in enumerate((1, -1)):
        rho, arm = np.array([0, 5.0 * side, 0]), np.array([0, 4.0 * side, 0])
        for i, axis in enumerate(([1, 0, 0], [0, 0, 1])):
            printed[:, 2 * boom + i] = np.cross(rho, np.cross(axis, arm))
    assert elastic.H[0, 0] == pytest.approx(40, rel=1e-9)
    assert printed[0, 0] == 20
    np.testing.assert_allclose(elastic.H, 2 * printed, rtol=1e-9, atol=1e-12)
    # J omega' + H q'' = M in MuJoCo, from rest in the reference configuration.
    data = mujoco.MjData(model)
    torque = np.array([0.3, -0.2, 0.5])
    for axis in range(3):
        data.ctrl[2 * axis : 2 * axis + 2] = torque[axis] / 2
    mujoco.mj_forward(model, data)
    turned = elastic.J @ data.qacc[3:6]
    assert turned + elastic.H @ data.qacc[6:] == pytest.approx(torque, abs=1e-14)
    assert np.abs(turned + printed @ data.qacc[6:] - torque).max() > 0.05


def test_10_small_deflections_alone_do_not_make_the_motion_linear():
    model, elastic = compiled(), structure()
    moments = []
    for spin in (0.0, 0.01, 0.1):
        data = mujoco.MjData(model)
        data.qvel[3:6] = spin
        mujoco.mj_forward(model, data)  # r = r' = 0: (12) asks for nothing more
        # What the deflections feel beyond G (omega x J omega): omega x (omega x rho), dropped.
        gyroscopic = np.cross(data.qvel[3:6], elastic.J @ data.qvel[3:6])
        linear = np.linalg.solve(elastic.D, elastic.G @ gyroscopic)
        moments.append(np.abs(elastic.H @ (data.qacc[6:] - linear)).max())
    assert moments[0] == 0
    assert moments[2] == pytest.approx(100 * moments[1], rel=1e-9)  # quadratic in the spin
    # 0.1 rad/s makes more of it than all thrusters at 0.02 N m may with any switching.
    assert moments[2] > influence(elastic, torque=0.02, dwell=1.0).moment_l1.max()


SPINDLE = """<mujoco><option gravity="0 0 0"/><worldbody><body><freejoint/>
<inertial pos="0 0 0" mass="10" diaginertia="{inertia} 30 30"/>
<body><joint axis="1 0 0" stiffness="3" damping="1"/>
<inertial pos="0 1 0" mass="1" diaginertia="1e-13 1e-13 1e-13"/>
<body><inertial pos="0 -1 0" mass="1" diaginertia="1e-13 1e-13 1e-13"/></body></body>
</body></worldbody></mujoco>"""


def test_11_a_collinear_bus_makes_the_mass_matrix_singular():
    # Two points a metre off the axis of a rod, turning about it: D = 2 I/(2 + I).
    for inertia, least in ((1.0, 0.6667), (0.001, 0.0009995)):
        model = mujoco.MjModel.from_xml_string(SPINDLE.format(inertia=inertia))
        D = elastic_model(model).D
        assert D[0, 0] == pytest.approx(2 * inertia / (2 + inertia), rel=1e-9)
        assert D[0, 0] == pytest.approx(least, rel=1e-4)  # digits given
    with pytest.raises(ValueError, match=r"D is not positive definite.*collinear rod"):
        elastic_model(mujoco.MjModel.from_xml_string(SPINDLE.format(inertia=1e-10)))


def printed_bound(elastic, shapes, dwell):
    """(27) for M0 = 1 with these real mode shapes of one double eigenvalue, a column each."""
    d, b, c = (float(matrix[0, 0]) for matrix in (elastic.D, elastic.B, elastic.C))
    z = (-b + 1j * np.sqrt(4 * d * c - b * b)) / (2 * d)
    # C^-1 G dM = sum gamma xi + cc and sum z gamma xi + cc = 0.
    gamma = (shapes.T @ np.linalg.solve(elastic.C, elastic.G)) * -np.conj(z) / (z - np.conj(z))
    beta = np.abs(2 * gamma).sum(axis=1) / (1 - np.exp(z.real * dwell))
    return 2 * abs(z) ** 2 * np.abs(elastic.H @ shapes) @ beta


def twin(angle):
    """Equal motions about x and z, in coordinates turned into each other by an angle."""
    R = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    H = np.array([[2.0, 0.0], [0.0, 0.0], [0.0, 2.0]]) @ R
    J = np.diag([20.0, 30.0, 20.0])
    return ElasticModel(
        D=2.0 * np.eye(2), B=0.05 * np.eye(2), C=3.0 * np.eye(2),
        H=H, G=np.linalg.solve(J, H).T, J=J,
    ), R  # fmt: skip


def test_12_contributions_of_a_repeated_eigenvalue_are_added_before_moduli():
    dwell = 2.0
    straight, _ = twin(0.0)
    right = influence(straight, torque=1.0, dwell=dwell).moment
    for angle in (0.0, 0.2, 0.5, np.pi / 4):
        # Any rotation of eigenvectors of a double eigenvalue is as good: the printed bound moves.
        R = twin(angle)[1]
        printed = printed_bound(straight, R, dwell)
        growth = 1 + np.sin(2 * angle)  # 201.0, 279.3, 370.2, 402.0 in the reference
        assert printed == pytest.approx(growth * right, rel=1e-12, abs=1e-12)
        turned, _ = twin(angle)
        merged = influence(turned, torque=1.0, dwell=dwell)
        assert merged.moment == pytest.approx(right, rel=1e-9, abs=1e-9)
        assert len(merged.eigenvalues) == 1
        # It is a bound: the worst switching stays below.
        worst = worst_case(turned, torque=1.0, dwell=dwell, axis="x").moment
        assert 0.3 * right[0] < worst < right[0]
    assert [201.0 * (1 + np.sin(2 * a)) for a in (0.2, 0.5, np.pi / 4)] == pytest.approx(
        [279.3, 370.2, 402.0], abs=0.1
    )  # digits given


def test_13_overdamped_parts_have_no_complex_pairs():
    # zeta = 1.5 with the bus held.
    model = compiled("two_boom_3d", ('damping="0.64"', 'damping="96"'), ('"0.832"', '"124.8"'))
    elastic = elastic_model(model)
    found = influence(elastic, torque=0.02, dwell=2.0)
    assert np.all(found.eigenvalues.imag == 0)
    assert len(found.eigenvalues) == 2 * len(elastic.D)
    assert np.all(found.moment == np.inf)
    assert found.deflection([1, 0, 0, 0]) == np.inf
    assert "8 real eigenvalues (overdamped parts)" in found.refused
    # The bound for any switching serves, and is nearly reached where the dwell is short.
    assert np.array_equal(found.bound, found.moment_l1)
    worst = worst_case(elastic, torque=0.02, dwell=0.05, axis="x")
    assert 0.9 * found.moment_l1[0] < worst.moment <= found.moment_l1[0]
    (moment,) = moment_history(
        elastic, switch_times=worst.switch_times, levels=worst.levels, times=[worst.duration]
    )
    assert abs(moment[0]) == pytest.approx(worst.moment, rel=1e-12)
    assert influence(structure(), torque=0.02, dwell=2.0).refused == ""
