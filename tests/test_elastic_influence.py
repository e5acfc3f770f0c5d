"""Bounds of the elastic influence: reference figures, superposition, monotony, what is refused."""

import functools
import time

import mujoco
import numpy as np
import pytest
import scipy.linalg

from spacecraft_sim.elastic_influence import elastic_model, influence, least_dwell
from spacecraft_sim.elastic_modes import ElasticModel, find_modes, moment_history
from spacecraft_sim.spacecraft import load

# The machines in the order of the reference models T1, T2, F1.
MACHINES = ("two_boom_3d", "asymmetric_booms", "four_boom")
M0 = 0.02  # N m


@functools.cache
def structure(name):
    return elastic_model(mujoco.MjModel.from_xml_path(str(load(name).xml)))


# -- reference figures -----------------------------------------------------------------------------


def test_matrices_of_the_two_booms():
    found = structure("two_boom_3d")
    # Closed forms of two points of 2 kg; digits given, and 1e-9 kg m^2 of the points themselves.
    assert np.diag(found.J) == pytest.approx([366.66667, 293.33333, 353.33333], rel=1e-7)
    D = found.D
    figures = [27.4779477956, -4.2052205222, 27.3132822724, -4.3698860454]
    assert [D[0, 0], D[0, 2], D[1, 1], D[1, 3]] == pytest.approx(figures, rel=1e-9)
    assert [found.G[0, 0], found.G[1, 2]] == pytest.approx([0.1090909091, 0.1132075472], rel=1e-9)
    assert found.H[0, 0] == pytest.approx(40.0, rel=1e-9)
    eigenvalues = influence(found, torque=1, dwell=1).eigenvalues
    sizes = [1.0049875621, 1.1726039399, 1.3064838307, 1.5352867039]
    assert np.abs(eigenvalues) == pytest.approx(sizes, rel=1e-9)
    assert eigenvalues.real == pytest.approx([-0.0101, -0.01375, -0.01313, -0.0181315789], rel=1e-8)


# M_e for 0.02 N m in all channels about x, y, z by dwell.
MOMENTS = {
    "two_boom_3d": {
        1: (1.098502, 0, 0.878807),
        2.66: (0.4176906, 0, 0.3353603),
        5: (0.2257833, 0, 0.1821922),
        np.inf: (0.0150010, 0, 0.0157906),
    },
    "asymmetric_booms": {
        1: (0.578137, 0.025565, 0.521714),
        2.66: (0.220099, 0.009760, 0.199076),
        5: (0.119207, 0.005308, 0.108176),
        np.inf: (0.0086353, 0.0004568, 0.0091893),
    },
    "four_boom": {
        1: (0.841839, 1.018428, 1.781510),
        2.66: (0.321358, 0.387296, 0.679937),
        5: (0.174682, 0.209412, 0.369469),
        np.inf: (0.0153857, 0.0139870, 0.0323028),
    },
}
# The same for any switching.
L1 = {
    "two_boom_3d": (0.414707, 0, 0.433529),
    "asymmetric_booms": (0.168739, 0.006858, 0.221709),
    "four_boom": (0.411199, 0.379110, 0.736435),
}


@pytest.mark.parametrize("name", MOMENTS)
def test_moments_of_the_reference_table(name):
    for dwell, figures in MOMENTS[name].items():
        found = influence(structure(name), torque=M0, dwell=dwell).moment
        for value, figure in zip(found, figures, strict=True):
            digits = len(f"{figure:.7f}".rstrip("0").partition(".")[2])
            assert abs(value - figure) < 0.51 * 10.0 ** -max(digits, 6)
        # Its y column of the two booms is zero to rounding.
        assert (found[1] < 1e-15) == (name == "two_boom_3d")


def test_moments_to_all_digits():
    found = influence(structure("two_boom_3d"), torque=M0, dwell=2.66).moment
    assert found == pytest.approx([0.4176906346, 0, 0.3353602616], rel=1e-9, abs=1e-15)


@pytest.mark.parametrize("name", L1)
def test_moments_for_any_switching(name):
    found = influence(structure(name), torque=M0, dwell=1.0).moment_l1
    # The reference cut its integral off: from below, to 3e-4.
    assert found == pytest.approx(L1[name], rel=3e-4, abs=1e-15)
    assert np.all(found >= np.array(L1[name]) - 5e-7)


@pytest.mark.parametrize(
    ("axis", "frequency", "decay"), [(0, 1.1726039399, 0.01375), (2, 1.5352867039, 0.0181315789)]
)
def test_the_bound_for_any_switching_is_the_closed_form_of_one_mode(axis, frequency, decay):
    elastic = structure("two_boom_3d")
    damped = np.sqrt(frequency**2 - decay**2)
    # H q'' = -(H D^-1 G) d/dt (e^(-st) sin(wt))/w x (...): impulse from rest, s(0) its start.
    start = (elastic.H @ np.linalg.solve(elastic.D, elastic.G))[axis, axis]

    def s(t):  # s'' + 2 decay s' + frequency^2 s = 0, s(0) = start, s'(0) = -2 decay start
        return (
            start * np.exp(-decay * t) * (np.cos(damped * t) - decay / damped * np.sin(damped * t))
        )

    # s' = 0 where tan = -2 decay damped/(damped^2 - decay^2), the first time past half a turn.
    first = (np.pi - np.arctan2(2 * decay * damped, damped**2 - decay**2)) / damped
    half = np.pi / damped
    ratio = np.exp(-decay * half)
    norm = s(0) + abs(s(first) - s(0)) + abs(s(first + half) - s(first)) / (1 - ratio)
    found = influence(elastic, torque=M0, dwell=1.0).moment_l1[axis]
    assert found == pytest.approx(M0 * norm, rel=3e-9)


def test_amplitude_of_the_reference():
    figures = {1: 0.01005456184546, 2.66: 0.00386536940507, np.inf: 0.00020455483052}
    for dwell, figure in figures.items():
        found = influence(structure("two_boom_3d"), torque=M0, dwell=dwell)
        assert found.deflection([1, 0, 0, 0]) == pytest.approx(figure, rel=1e-10)
    assert influence(structure("two_boom_3d"), torque=M0, dwell=5).deflection(
        [1, 0, 0, 0]
    ) == pytest.approx(0.00212076, abs=5e-9)


# -- what the bounds are made of -------------------------------------------------------------------


@pytest.mark.parametrize("name", MACHINES)
def test_jumps_superpose_to_the_exact_motion(name):
    elastic, rng = structure(name), np.random.default_rng(1)
    n = len(elastic.D)
    inverse = np.linalg.inv(elastic.D)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-inverse @ elastic.C, -inverse @ elastic.B]])
    b = np.vstack([np.zeros((n, 3)), -inverse @ elastic.G])
    times, torques = np.cumsum(rng.exponential(2.0, 12)), rng.normal(size=(13, 3))
    state, expected, t = np.zeros(2 * n), [], 0.0
    for at, M in zip([*times, times[-1] + 3], torques, strict=True):
        # x' = A x + b M with constant M, exactly.
        whole = scipy.linalg.expm(
            np.block([[A, (b @ M)[:, None]], [np.zeros((1, 2 * n + 1))]]) * (at - t)
        )
        state, t = (whole @ np.r_[state, 1.0])[:-1], at
        expected.append(elastic.H @ (A @ state + b @ M)[n:])
    found = moment_history(
        elastic,
        switch_times=[times] * 3,
        levels=list(torques.T),
        times=np.r_[np.nextafter(times, 0), times[-1] + 3],
    )
    # Rounding of expm and of a dozen jumps.
    assert found == pytest.approx(np.array(expected), rel=1e-10, abs=1e-12)


@pytest.mark.parametrize("name", MACHINES)
def test_bounds_fall_with_the_dwell(name):
    elastic = structure(name)
    direction = np.linspace(1, 2, len(elastic.D))
    bounds = [influence(elastic, torque=M0, dwell=dwell) for dwell in np.geomspace(0.01, 200, 400)]
    moments = np.array([bound.moment for bound in bounds])
    swings = np.array([bound.deflection(direction) for bound in bounds])
    # Where a bound no longer falls, or is zero, it may differ by rounding.
    assert np.all(np.diff(moments, axis=0) <= 1e-15)
    assert np.all(np.diff(swings) <= 1e-15)
    heard = moments[0] > 1e-12
    assert np.all(moments[0, heard] > 50 * moments[-1, heard])
    assert np.all(bounds[0].bound == bounds[0].moment_l1)
    assert np.all(bounds[-1].bound == bounds[-1].moment)


def test_channels_add_up_with_their_own_torque_and_dwell():
    elastic, torque, dwell = structure("asymmetric_booms"), [0.1, 0.2, 0.3], [1.0, 3.0, np.inf]
    together = influence(elastic, torque=torque, dwell=dwell)
    alone = [
        # Others next to nothing.
        influence(elastic, torque=np.where(np.arange(3) == c, torque, 1e-30), dwell=dwell)
        for c in range(3)
    ]
    assert together.moment == pytest.approx(sum(a.moment for a in alone), rel=1e-13)
    assert together.moment_l1 == pytest.approx(sum(a.moment_l1 for a in alone), rel=1e-13)


def test_a_bus_in_another_frame_has_the_same_bounds():
    # Wherever the bus starts and however it is turned: the axes are its own.
    text = load("two_boom_3d").xml.with_name("two_boom_3d.xml").read_text(encoding="utf-8")
    moved = text.replace(
        '<body name="bus">', '<body name="bus" pos="3 1 2" quat="0.5 0.5 -0.5 0.5">'
    )
    assert moved != text
    elastic = elastic_model(mujoco.MjModel.from_xml_string(moved))
    for name in ("D", "G", "H", "J"):
        assert getattr(elastic, name) == pytest.approx(
            getattr(structure("two_boom_3d"), name), rel=1e-12, abs=1e-12
        )


def test_moment_of_the_deflection_bound_serves_the_quasi_rigid_feedback():
    # H q/J is what keeps theta from the quasi-rigid angle; its bound is that of a direction.
    elastic = structure("two_boom_3d")
    found = influence(elastic, torque=M0, dwell=2.66)
    lean = found.deflection_l1(elastic.H[0]) / elastic.J[0, 0]
    assert 0 < lean < found.deflection(elastic.H[0]) / elastic.J[0, 0]


def test_bounds_of_many_rows_are_those_of_each():
    elastic = structure("asymmetric_booms")
    rng = np.random.default_rng(2)
    rows = rng.normal(size=(5, len(elastic.D)))
    for dwell in (0.05, 2.0, 30.0):  # any switching is the smaller bound at first, printed at last
        found = influence(elastic, torque=[1.0, 2.0, 0.5], dwell=dwell)
        each = [min(found.deflection(row), found.deflection_l1(row)) for row in rows]
        # Modes that have died out count by their bounds once the others are known to 1e-10.
        np.testing.assert_allclose(found.deflections(rows), each, rtol=1e-8)
        rates = [found.bending_rates(row[None])[0] for row in rows]
        np.testing.assert_allclose(found.bending_rates(rows), rates, rtol=1e-8)


@pytest.mark.parametrize("name", MACHINES)
def test_least_dwell_meets_its_limit(name):
    elastic = structure(name)
    for axis in (0, 2):
        for limit in (0.05, 0.5, 40.0):
            dwell = least_dwell(elastic, torque=M0, axis=axis, limit=limit)
            found = influence(elastic, torque=M0, dwell=dwell)
            assert found.moment[axis] == pytest.approx(limit, rel=1e-9)  # of the root found
    assert least_dwell(elastic, torque=M0, axis=0, limit=1e-4) == np.inf
    with pytest.raises(ValueError, match=r"limit = 0\.0"):
        least_dwell(elastic, torque=M0, axis=0, limit=0.0)


def test_bounds_of_four_booms_are_quick():
    fresh = elastic_model(mujoco.MjModel.from_xml_path(str(load("four_boom").xml)))
    start = time.perf_counter()
    influence(fresh, torque=M0, dwell=2.0)
    assert time.perf_counter() - start < 1.0  # some 0.05 s when nothing else runs


# -- what is refused -------------------------------------------------------------------------------


def by_hand(**changes):
    """Two coordinates that x and z drive."""
    parts = {
        "D": np.diag([2.0, 3.0]),
        "B": np.diag([0.1, 0.1]),
        "C": np.diag([4.0, 5.0]),
        "H": np.array([[1.0, 0.0], [0.0, 0.0], [0.0, 2.0]]),
        "J": np.diag([10.0, 12.0, 14.0]),
    }
    parts |= changes
    G = np.linalg.solve(parts["J"], parts["H"]).T if "G" not in changes else changes["G"]
    return ElasticModel(**{**parts, "G": G})


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"D": np.diag([2.0, 0.0])}, "D is not positive definite"),
        ({"D": np.array([[2.0, 2.0], [2.0, 2.0]])}, "D is not positive definite"),
        ({"D": np.array([[2.0, 0.1], [0.0, 2.0]])}, "D must be symmetric"),
        ({"C": np.diag([4.0, -1.0])}, "C must be positive definite"),
        ({"B": np.diag([0.1, -0.1])}, "B must not drive the motion"),
        ({"G": np.zeros((3, 2))}, r"G must be finite and of shape \(2, 3\), got \(3, 2\)"),
        ({"C": np.diag([4.0, np.nan])}, "C must be finite"),
        ({"coordinates": ("a",)}, "2 coordinates need 2 names"),
        ({"D": np.zeros((0, 0))}, "no elastic coordinates|must be finite"),
    ],
)
def test_matrices_that_are_no_structure_are_refused(changes, message):
    with pytest.raises(ValueError, match=message):
        by_hand(**changes)


def test_a_motion_that_does_not_decay_is_refused_and_named():
    with pytest.raises(ValueError, match=r"2 eigenvalues do not decay.* without damping: q1"):
        find_modes(by_hand(B=np.diag([0.0, 0.1])))
    # A coordinate without damping of its own is welcome if the others damp it.
    coupled = by_hand(B=np.diag([0.0, 0.1]), C=np.array([[4.0, 1.0], [1.0, 5.0]]))
    assert np.all(influence(coupled, torque=1, dwell=1).eigenvalues.real < 0)


def test_critical_damping_is_refused_and_its_neighbours_agree():
    norms = []
    for share in (1 - 1e-6, 1.0, 1 + 1e-6):
        elastic = by_hand(D=np.diag([1.0, 3.0]), C=np.diag([1.0, 5.0]), B=np.diag([2 * share, 0.1]))
        if share == 1.0:
            with pytest.raises(ValueError, match="change a damping or stiffness by a millionth"):
                influence(elastic, torque=1.0, dwell=1.0)
            continue
        norms.append(influence(elastic, torque=1.0, dwell=1.0).moment_l1[0])
    # s = -x e^-t (1 - t), x = 1/10: |s(0)| and its fall to -x e^-2 at t = 2 and back.
    assert norms == pytest.approx([0.1 * (2 + 2 * np.exp(-2.0))] * 2, rel=1e-6)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"torque": 0.0, "dwell": 1.0}, r"torque must be finite and > 0, got 0\.0"),
        ({"torque": [1, 1, -1], "dwell": 1.0}, "torque must be finite and > 0"),
        ({"torque": 1.0, "dwell": 0.0}, r"dwell must be > 0, got 0\.0"),
        ({"torque": 1.0, "dwell": [1, 2]}, "dwell must be one number or three"),
    ],
)
def test_bad_numbers_are_refused(arguments, message):
    with pytest.raises(ValueError, match=message):
        influence(by_hand(), **arguments)
    with pytest.raises(ValueError, match="a direction has one coefficient a coordinate, 2"):
        influence(by_hand(), torque=1.0, dwell=1.0).deflection([1.0, 2.0, 3.0])


def test_histories_need_a_level_more_than_switchings():
    with pytest.raises(ValueError, match=r"channel 1: 1 switch times.* need 2 levels; got 1"):
        moment_history(by_hand(), switch_times=[[], [1], []], levels=[[1]] * 3, times=[1.0])


def test_what_is_kept_cannot_be_changed():
    found = influence(by_hand(), torque=1.0, dwell=1.0)
    for array in (found.modes.residues, found.eigenvalues, by_hand().D):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0.0
