"""What laws draw: V against MuJoCo's energies, estimated rates, basins, paths on the sphere."""

from dataclasses import replace

import burkov_cases as cases
import mujoco
import numpy as np
import pytest
import rrd
from flown import flown
from scipy.signal import lfilter
from test_report import figures

from spacecraft_sim import beneath, record, record_law, run_folder, sphere
from spacecraft_sim.chart import charts_of, floor, histories, path_of, series, spheres
from spacecraft_sim.smooth_flight import fly
from spacecraft_sim.trajectory import selected

SINGLE = 1.2e-7  # relative rounding of rerun's vectors
NANOSECOND = 1.1e-9  # to which rerun rounds times
ARM, BODY = "burkov-position", "burkov-body-vectors"


def flight_of(name):
    return flown("duration=1.0", name=name)


def chart(flight, name):
    return next(c for c in charts_of(flight.mission.controller) if c.name == name)


def columns(flight, names):
    return np.stack([flight[name] for name in names], axis=1)


def filtered(z, cutoffs, period):
    """w of a straight line between samples, by scipy's filter: zero at first."""
    x = np.array(cutoffs) * period
    found = [
        lfilter([-np.expm1(-a) / a, np.expm1(-a) / a], [1, -np.exp(-a)], c - c[0])
        for c, a in zip(z.T, x, strict=True)
    ]
    return np.stack(found, axis=1)


def energies(flight, rates):
    """MuJoCo's own kinetic energy in each row, the velocities given, J."""
    model = flight.mission.mujoco.model.ptr
    data, names, found = mujoco.MjData(model), list(flight.measured.signals)[-model.nq :], []
    for q, v in zip(columns(flight.measured, names), rates, strict=True):
        data.qpos, data.qvel = q, v
        mujoco.mj_fwdPosition(model, data)
        mujoco.mj_fwdVelocity(model, data)
        mujoco.mj_energyVel(model, data)
        found.append(data.energy[1])
    return np.array(found)


def test_the_terms_of_v_of_an_arm_are_energies_of_mujoco():
    flight = flight_of(ARM)
    law, measured = flight.mission.controller, flight.measured
    q, v = (columns(measured, [f"joint_{k}{x}" for k in (1, 2)]) for x in ("", "_rate"))
    time, values = series(chart(flight, "energy"), measured, len(measured.time))
    np.testing.assert_array_equal(time, measured.time)
    x = q - law.formula.target
    w = filtered(q, law.filter.cutoffs, law.period)
    wanted = [
        energies(flight, v),
        np.einsum("ki,ij,kj->k", x, np.array(law.formula.K1), x) / 2,
        w**2 @ np.array(law.formula.K2) / 2,
    ]
    # Rounding of sums of some hundred J; the filters sum a thousand samples.
    np.testing.assert_allclose(values[:, 1:].T, wanted, rtol=1e-10, atol=1e-9)
    np.testing.assert_allclose(values[:, 0], np.sum(wanted, axis=0), rtol=1e-10)


def test_the_terms_of_v_of_a_body_are_energies_of_mujoco():
    flight = flight_of(BODY)
    law, measured = flight.mission.controller, flight.measured
    model = flight.mission.mujoco.model.ptr
    frame = np.zeros(9)
    mujoco.mju_quat2Mat(frame, model.body_iquat[model.body("bus").id])
    rates = columns(measured, ["rate_x", "rate_y", "rate_z"]) @ frame.reshape(3, 3).T
    still = np.zeros((len(rates), model.nv - 3))
    _, values = series(chart(flight, "energy"), measured, len(measured.time))
    s = columns(measured, law.sensors)
    w = filtered(s, law.filter.cutoffs, law.period)
    (k2, k3), (r2, r3) = law.formula.k, np.array(law.formula.r)
    wanted = [
        energies(flight, np.hstack([still, rates])),
        k2 * (1 - s[:, :3] @ r2) + k3 * (1 - s[:, 3:] @ r3),  # |s - r|^2/2 of unit vectors
        w**2 @ np.ravel(law.formula.G) / 2,
    ]
    np.testing.assert_allclose(values[:, 1:].T, wanted, rtol=1e-9, atol=1e-10)


def test_gravity_is_in_v_where_the_law_only_knows_it_at_the_target():
    law, _ = cases.position(gravity="at the target", period=8e-3)
    (run,) = fly(cases.ARM, law, starts=np.array([1.2, -0.5, 0.5, 0.5]), duration=0.4)
    energy = next(c for c in law.charts if c.name == "energy")
    time, values = series(energy, run, 10_000)
    arm, (p1, p2) = cases.ARM, cases.TARGET

    def height(a, b):  # of two links that hang: -g (sum of m times depth)
        (l1, _), (c1, c2), (m1, m2) = arm.lengths, arm.centres, arm.masses
        return -arm.g * ((m1 * c1 + m2 * l1) * np.cos(a) + m2 * c2 * np.cos(a + b))

    q = columns(run, law.sensors)[np.searchsorted(run.time, time)]
    wanted = height(*q.T) - height(p1, p2) - (q - law.formula.target) @ np.array(law.formula.bias)
    np.testing.assert_allclose(values[:, -1], wanted, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(values[:, 0], values[:, 1:].sum(axis=1), rtol=1e-12)


@pytest.mark.parametrize("name", [ARM, BODY])
def test_true_rates_are_derivatives_and_estimates_are_those_of_the_filter(name):
    flight = flight_of(name)
    law, measured = flight.mission.controller, flight.measured
    z = columns(measured, law.sensors)
    estimated = filtered(z, law.filter.cutoffs, law.period) * law.filter.cutoffs
    rates = [c for c in law.charts if c.name in ("rates", "s2_rate", "s3_rate")]
    found = [series(c, measured, len(measured.time))[1] for c in rates]
    true, thin = (np.hstack([values[:, k::2] for values in found]) for k in (0, 1))
    np.testing.assert_allclose(thin, estimated, rtol=1e-9, atol=1e-9)
    slopes = np.gradient(z, measured.time, axis=0)[1:-1]
    # Central differences: a sixth of the square of the period times the third derivative.
    third = np.abs(np.diff(z, n=3, axis=0)).max() / law.period**3
    np.testing.assert_allclose(true[1:-1], slopes, rtol=0, atol=law.period**2 * third / 3)


def test_a_path_is_measured_against_its_programme_even_while_it_is_planned_anew():
    for changes in ({}, {"replan_above": 0.2}):
        law, _ = cases.path(period=2e-3, **changes)
        start = np.array([0.4, 0.0, 1.2, 1.0])
        (run,) = fly(cases.ARM, law, starts=start, duration=3.5, tolerance=1e-8)
        away, rates = (next(c for c in law.charts if c.name == n) for n in ("distance", "rates"))
        time, values = series(away, run, 10_000)
        wanted = columns(run, law.sensors) - [cases.PROGRAMME(t).q for t in run.time.tolist()]
        np.testing.assert_allclose(values[:, 1:], np.abs(wanted)[: len(time)], atol=1e-12)
        np.testing.assert_allclose(values[:, 0], np.linalg.norm(wanted, axis=1)[: len(time)])
        _, pairs = series(rates, run, 10_000)
        late = time > 3.0
        # w is 1/(nu K3) = 0.03 s behind x', of which some 1e-4 rad/s are left by then.
        np.testing.assert_allclose(pairs[late, 1::2], pairs[late, ::2], rtol=0, atol=1e-4)


@pytest.mark.parametrize("name", [ARM, BODY])
def test_parts_of_a_flight_make_the_curves_of_the_whole(name):
    flight = flight_of(name)
    history, measured = chart(flight, "energy"), flight.measured
    everything = np.ones(len(measured.time), dtype=bool)
    whole = history.measure(measured, everything, None)
    memory, found = None, []
    for k in range(0, len(everything), 7):
        part = selected(measured, slice(k, k + 7))
        _, values, memory = history.measure(part, everything[k : k + 7], memory)
        found.append(values)
    np.testing.assert_array_equal(np.vstack(found), whole.values)


def test_a_flight_that_lacks_samples_is_refused():
    flight = flight_of(BODY)
    rows = np.delete(np.arange(len(flight.measured.time)), 5)
    with pytest.raises(ValueError, match=r"no row at the sample of its law at 0\.05 s"):
        series(chart(flight, "energy"), selected(flight.measured, rows), 100)


def test_a_flight_without_the_signals_shows_nothing():
    flight = flight_of(BODY)
    bare = replace(flight.measured, signals={"rate_x": flight.measured["rate_x"]})
    assert histories(charts_of(flight.mission.controller), bare) == []
    assert spheres(charts_of(flight.mission.controller), bare) == []


@pytest.mark.parametrize("i", [0, 1])
def test_the_border_of_a_basin_is_where_the_least_v_reaches_its_limit(i):
    law, _ = cases.vectors(rated=True)
    (globe,) = (c for c in law.charts if c.name == "vectors")
    (k, other), (r, r_other) = law.formula.k, np.array(law.formula.r)
    if i:
        (k, other), (r, r_other) = (other, k), (r_other, r)
    angle = np.linspace(0, 2 * np.pi, 3601)[:, None]
    reached = 0
    for s in globe.arrows[i].basin[::9]:
        side = np.cross(s, np.eye(3)[np.argmin(np.abs(s))])
        side /= np.linalg.norm(side)
        at_right_angles = np.cos(angle) * side + np.sin(angle) * np.cross(s, side)
        V = k * (1 - s @ r) + other * (1 - at_right_angles @ r_other)
        if s @ r > -1 + 1e-9:  # else the ray has come to the opposite pole
            reached += 1
            # The border is found to a quarter of a degree, 0.0044 rad, and V is not steeper than
            # k2 + k3 = 3.2 J/rad.
            assert V.min() == pytest.approx(2 * min(law.formula.k), abs=0.0044 * 3.2)
    assert reached > 5


def test_a_sphere_is_seen_with_its_goals_in_front():
    for law, _ in (cases.vectors(rated=True), cases.vectors(rated=False)):
        (globe,) = (c for c in law.charts if c.name == "vectors")
        view = sphere.view(globe)
        frame = np.stack([view.right, view.up, view.near])
        np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-12)
        assert np.linalg.det(frame) == pytest.approx(1.0)
        for arrow in globe.arrows:
            assert np.array(arrow.target) @ view.near > 0.3
    front, back = sphere.sides(sphere.net()[0], view.near)
    assert np.nanmin(front @ view.near) > -0.05  # the point that joins on to the other side
    assert np.nanmax(back @ view.near) < 0.05
    assert not np.any(np.isnan(front) & np.isnan(back))


# -- in a report and in a recording ----------------------------------------------------------------


def test_histories_and_spheres_of_a_law_are_there():
    flight = flown("duration=1.0", name="burkov-body-vectors")
    found, column = figures(flight)
    energy = found["chart_energy"]
    assert energy["log"]
    names = ["V, reduced", "V", "kinetic", "potential of the law", "filter"]
    assert [t["name"] for t in energy["traces"]] == names
    total, *terms = (10 ** column(t["y"]).astype(float) for t in energy["traces"][1:])
    # Logarithms in single precision: 1e-7 of some ten, times ln 10; terms are cut off at 1e-12 V.
    np.testing.assert_allclose(total, np.sum(terms, axis=0), rtol=1e-5)
    globe = found["chart_vectors"]
    tracks = [t for t in globe["tracks"] if t["name"] == "s2, MuJoCo"]
    x = np.stack([column(t["x"]) for t in tracks])
    assert np.all(np.isfinite(x).any(axis=0))  # at each instant in front or at the back
    radius = np.hypot(*(np.concatenate([column(t[c]) for t in tracks]) for c in "xy"))
    assert np.nanmax(radius) <= 1 + 1e-6
    assert [p["name"] for p in globe["points"]] == ["goal of s2", "goal of s3"]


@pytest.fixture(scope="module", params=[ARM, BODY])
def recorded(request, tmp_path_factory):
    """A flight and the entities of its recording."""
    flight, path = flight_of(request.param), tmp_path_factory.mktemp("law") / "recording.rrd"
    subject = run_folder.subject(flight.mission)
    under = beneath.reduced(subject, flight.predicted)
    record.write(path, subject, flight.measured, under, flight.comparison.verdicts)
    return flight, rrd.read(path)


def test_a_recording_has_the_histories_at_its_own_pace(recorded):
    flight, entities = recorded
    measured = flight.measured
    for history in histories(charts_of(flight.mission.controller), measured):
        entity = entities[f"/law/{history.name}/simulated"]
        every = record_law.spacing(float(measured.time[-1]))
        # One row in each interval, and the last.
        assert len(entity.time) == len(set(np.floor(measured.time / every + 1e-6)))
        assert entity.time[-1] == measured.time[-1]
        _, values = series(history, measured, len(measured.time))
        rows = np.searchsorted(measured.time, entity.time - NANOSECOND)
        np.testing.assert_array_equal(entity.array("Scalars:scalars"), values[rows])
        names = entity.static["SeriesLines:names"]
        assert len(names) == len(history.curves)
        assert all(name.endswith(f"[{history.unit}]") for name in names)
        if not history.decades:
            continue
        powers = entities[f"/law/{history.name}_log10/simulated"].array("Scalars:scalars")
        seen = values[rows] >= floor(history, values[0])
        np.testing.assert_array_equal(np.isnan(powers), ~seen)
        np.testing.assert_allclose(powers[seen], np.log10(values[rows][seen]), rtol=SINGLE)
        head = entities[f"/law/{history.name}/reduced"]  # V alone
        _, values = series(history, flight.predicted, len(flight.predicted.time))
        assert head.values["Scalars:scalars"][-1] == [values[-1, 0]]


def test_a_recording_has_the_vectors_on_their_sphere(recorded):
    flight, entities = recorded
    drawn = spheres(charts_of(flight.mission.controller), flight.measured)
    assert bool(drawn) == (flight.mission.scenario.name == BODY)
    for globe in drawn:
        for arrow in globe.arrows:
            goal = entities[f"/sphere/{globe.name}/goals/{arrow.name}"].static
            np.testing.assert_allclose(goal["Points3D:positions"], [arrow.target], rtol=SINGLE)
            off = entities[f"/sphere/{globe.name}/opposite/{arrow.name}"].static
            np.testing.assert_allclose(
                off["Points3D:positions"], -np.array([arrow.target]), rtol=SINGLE
            )
            for key, run in (("simulated", flight.measured), ("reduced", flight.predicted)):
                path = f"/sphere/{globe.name}/flights/{key}/{arrow.name}"
                now, way = entities[f"{path}/now"], path_of(arrow, run)
                rows = np.searchsorted(run.time, now.time - NANOSECOND)
                vectors = now.array("Arrows3D:vectors")[:, 0]
                np.testing.assert_allclose(vectors, way[rows], rtol=SINGLE, atol=1e-9)
                assert now.time[-1] == run.time[-1]
                strips = entities[f"{path}/track"].values["LineStrips3D:strips"]
                track = np.array([strip for (strip,) in strips])
                np.testing.assert_array_equal(track[1:, 0], track[:-1, -1])  # no gap
                np.testing.assert_allclose(track[-1, -1], way[-1], rtol=SINGLE, atol=1e-9)
