"""Recordings: nothing is lost in the file, and peaks are found between the samples."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from spacecraft_sim.trajectory import Recorder, Trajectory, between_rows, peak

NUMBERS = st.floats(width=64)  # NaN, infinities and minus zero too


def flight(time, **signals):
    return Trajectory(
        time=np.asarray(time, dtype=float),
        signals={name: np.asarray(values, dtype=float) for name, values in signals.items()},
        units=dict.fromkeys(signals, "rad"),
        meta={"plant": "mujoco", "scenario": {"duration": 1.5, "booms": ["left"]}},
    )


def hermite(coefficients, time):
    cubic = np.polynomial.Polynomial(coefficients)
    return time, cubic(time), cubic.deriv()(time)


@given(table=arrays.arrays(np.float64, st.tuples(st.just(3), st.integers(0, 40)), elements=NUMBERS))
def test_flight_survives_the_file_bit_for_bit(table, tmp_path_factory):
    path = tmp_path_factory.mktemp("flight") / "flight.parquet"
    saved = flight(table[0], angle=table[1], rate=table[2])
    saved.save(path)
    loaded = Trajectory.load(path)
    assert loaded.time.tobytes() == saved.time.tobytes()
    assert list(loaded.signals) == ["angle", "rate"]
    for name, values in saved.signals.items():
        assert loaded[name].dtype == np.float64
        assert loaded[name].tobytes() == values.tobytes()
    assert loaded.units == saved.units
    assert loaded.meta == saved.meta


def test_file_says_the_unit_of_each_column(tmp_path):
    import pyarrow.parquet as pq

    flight([0.0], angle=[1.0]).save(tmp_path / "flight.parquet")
    schema = pq.read_schema(tmp_path / "flight.parquet")
    assert schema.field("time").metadata == {b"unit": b"s"}
    assert schema.field("angle").metadata == {b"unit": b"rad"}


def test_other_parquet_file_is_refused_by_its_path(tmp_path):
    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(pa.table({"time": [0.0]}), tmp_path / "other.parquet")
    with pytest.raises(ValueError, match=r"other\.parquet: not a trajectory"):
        Trajectory.load(tmp_path / "other.parquet")


def test_file_that_is_not_parquet_is_refused_by_its_path(tmp_path):
    (tmp_path / "other.parquet").write_bytes(b"not parquet at all")
    with pytest.raises(ValueError, match=r"other\.parquet"):
        Trajectory.load(tmp_path / "other.parquet")


def test_missing_signal_is_refused_with_those_there_are():
    with pytest.raises(KeyError, match="signal 'yaw' is not recorded; there are: angle, rate"):
        flight([0.0], angle=[1.0], rate=[2.0])["yaw"]


def test_recorder_keeps_rows_in_order_and_the_last_of_an_instant():
    recorder = Recorder({"angle": "rad"})
    for row in ([0.0, 1.0], [0.5, 2.0], [0.5, 3.0], [1.0, 4.0]):
        recorder.add(row)
    recorded = recorder.trajectory({"plant": "reduced"})
    assert recorded.time.tolist() == [0.0, 0.5, 1.0]
    assert recorded["angle"].tolist() == [1.0, 3.0, 4.0]
    assert recorded.meta == {"plant": "reduced"}


def test_recorded_arrays_are_read_only():
    recorder = Recorder({"angle": "rad"})
    recorder.add([0.0, 1.0])
    recorded = recorder.trajectory({})
    for array in (recorded.time, recorded["angle"]):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 2.0


def test_flight_without_rows_has_its_signals():
    recorded = Recorder({"angle": "rad"}).trajectory({})
    assert len(recorded.time) == len(recorded["angle"]) == 0


def test_peak_of_a_parabola_between_two_samples_is_its_vertex():
    value, time = peak(*hermite([0.0, 1.0, -0.5], np.array([0.0, 3.0])))  # t - t^2/2
    assert value == pytest.approx(1.5, rel=1e-15)  # at the end: -1.5 beats 0.5 at the vertex
    assert time == 3.0
    value, time = peak(*hermite([0.0, 1.0, -0.5], np.array([0.0, 1.75])))
    assert (value, time) == pytest.approx((0.5, 1.0), rel=1e-15)  # rounding


@pytest.mark.parametrize("vertex", [0.05, 0.3, 0.5, 0.7, 0.95])
@pytest.mark.parametrize("cubic", [0.0, 0.3])
def test_extremum_is_found_wherever_it_lies_between_two_samples(vertex, cubic):
    # sign (1 - (t - v)^2 + k (t - v)^3) is largest at v, where it is 1.
    shifted = np.polynomial.Polynomial([1.0, 0.0, -1.0, cubic])(
        np.polynomial.Polynomial([-vertex, 1.0])
    )
    for sign in (1, -1):
        found = peak(*hermite(sign * shifted.coef, np.array([0.0, 1.0])))
        assert found == pytest.approx((1.0, vertex), rel=1e-13)  # a root of a quadratic


@given(
    coefficients=st.lists(
        st.just(0.0) | st.floats(1e-6, 5) | st.floats(-5, -1e-6), min_size=4, max_size=4
    ),
    inner=st.lists(st.floats(-0.95, 0.95), max_size=4, unique=True),
)
def test_peak_of_a_cubic_is_found_exactly_however_it_is_sampled(coefficients, inner):
    cubic = np.polynomial.Polynomial(coefficients)
    time = np.array([-1.0, *sorted(inner), 1.0])
    stationary = [t.real for t in cubic.deriv().roots() if abs(t.imag) < 1e-12]
    largest = max(abs(cubic(t)) for t in (-1.0, 1.0, *(t for t in stationary if -1 < t < 1)))
    value, at = peak(*hermite(coefficients, time))
    # Rounding of terms up to 20; a double root is known to its square root alone, its value not.
    assert value == pytest.approx(largest, rel=1e-12)
    assert abs(cubic(at)) == pytest.approx(largest, rel=1e-12)


def test_peak_of_samples_alone_is_the_largest():
    assert peak(np.array([2.0]), np.array([-3.0]), np.array([1.0])) == (3.0, 2.0)


def test_peak_of_nothing_is_refused():
    with pytest.raises(ValueError, match="no samples"):
        peak(np.array([]), np.array([]), np.array([]))


def test_between_rows_an_arc_of_constant_torque_is_exact():
    time = np.array([0.0, 0.3, 1.0, 2.5])
    path = between_rows(time, 1 - 2 * time + 3 * time**2, -2 + 6 * time, pieces=4)
    assert path.shape == (3, 5, 2)
    fine = time[:-1, None] + np.diff(time)[:, None] * np.linspace(0, 1, 5)
    # A parabola is a cubic, and its rate is linear: rounding.
    np.testing.assert_allclose(path[..., 0], 1 - 2 * fine + 3 * fine**2, atol=1e-13)
    np.testing.assert_allclose(path[..., 1], -2 + 6 * fine, atol=1e-13)
