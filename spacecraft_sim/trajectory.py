"""A recorded flight: time, signals by name, units; how it is collected, saved and loaded."""

import json
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

Array = np.ndarray


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """A flight of one plant.

    Rows stand at every control step and at every instant at which a command or a thrust changes;
    thrust and command are those just after the instant.

    Attributes:
        time: Time of each row, ascending, shape (n,), s.
        signals: Values by name, each of shape (n,).
        units: SI unit of each signal.
        meta: Plain data about the flight: plant, scenario, versions.
    """

    time: Array
    signals: dict[str, Array]
    units: dict[str, str]
    meta: dict[str, Any] = field(default_factory=dict)

    def __getitem__(self, name: str) -> Array:
        if name not in self.signals:
            raise KeyError(f"signal {name!r} is not recorded; there are: {', '.join(self.signals)}")
        return self.signals[name]

    def save(self, path: Path) -> None:
        """Writes a Parquet file: a column `time` and one a signal, units in the metadata.

        Args:
            path: The file.
        """
        import pyarrow as pa
        import pyarrow.parquet as pq

        units = {"time": "s", **self.units}
        columns = {"time": self.time, **self.signals}
        schema = pa.schema(
            [pa.field(name, pa.float64(), metadata={"unit": units[name]}) for name in columns],
            metadata={"spacecraft_sim": json.dumps({"units": units, "meta": self.meta})},
        )
        table = pa.table([pa.array(column) for column in columns.values()], schema=schema)
        pq.write_table(table, path, compression="zstd")

    @staticmethod
    def load(path: Path) -> "Trajectory":
        """Reads a file that `save` wrote.

        Args:
            path: The file.

        Raises:
            ValueError: If the file is not such a file.
        """
        import pyarrow.parquet as pq

        table = pq.read_table(path)
        described = (table.schema.metadata or {}).get(b"spacecraft_sim")
        if described is None:
            raise ValueError(f"{path}: not a trajectory; it has no metadata 'spacecraft_sim'")
        about = json.loads(described)
        signals = {name: table[name].to_numpy() for name in table.column_names}
        time = signals.pop("time")
        about["units"].pop("time")
        return Trajectory(time=time, signals=signals, units=about["units"], meta=about["meta"])


class Recorder:
    """Collects the rows of a flight.

    Attributes:
        units: Signal names, in the order of every row, with their units.
    """

    def __init__(self, units: dict[str, str]):
        self.units = units
        self._rows: list[list[float]] = []

    def add(self, row: list[float]) -> None:
        """Appends a row, or replaces the last one if it stands at the same instant.

        Args:
            row: Time, then the signals in order.
        """
        if self._rows and self._rows[-1][0] == row[0]:
            self._rows[-1] = row
        else:
            self._rows.append(row)

    def __len__(self) -> int:
        return len(self._rows)

    def trajectory(
        self, meta: dict[str, Any], start: int = 0, stop: int | None = None
    ) -> Trajectory:
        """Returns what was recorded so far, or some of its rows.

        Args:
            meta: Plain data about the flight.
            start: The first row.
            stop: The row after the last; all if left out.
        """
        rows = self._rows[start:stop]
        table = np.array(rows, dtype=float).reshape(-1, 1 + len(self.units)).T
        table.setflags(write=False)
        signals = dict(zip(self.units, table[1:], strict=True))
        return Trajectory(time=table[0], signals=signals, units=self.units, meta=meta)


def selected(trajectory: Trajectory, rows: Any) -> Trajectory:
    """Returns some rows of a flight.

    Args:
        trajectory: The flight.
        rows: A slice, or row numbers or truth values of shape (n,).
    """
    signals = {name: value[rows] for name, value in trajectory.signals.items()}
    return replace(trajectory, time=trajectory.time[rows], signals=signals)


def sample_rows(time: Array, period: float) -> tuple[Array, Array]:
    """Returns the rows of a flight that are at samples, and the numbers of these samples.

    Of several rows at one instant the last counts: it has what the sample decided.

    Args:
        time: Times of the rows, shape (n,), s.
        period: Sampling period, s.
    """
    count = time / period
    number = np.round(count)
    rows = np.flatnonzero(np.abs(count - number) < 1e-6)
    rows = rows[np.diff(number[rows], append=np.inf) > 0]
    return rows, number[rows].astype(int)


def peak(time: Array, value: Array, rate: Array) -> tuple[float, float]:
    """Finds the largest |value| of a sampled signal with known rates, between the samples too.

    Each interval is a cubic Hermite polynomial, whose interior extrema are roots of a quadratic.

    Args:
        time: Sample times, shape (n,), s.
        value: Samples, shape (n,).
        rate: Time derivatives of the samples, shape (n,).

    Returns:
        The largest |value| and its time, s.

    Raises:
        ValueError: If there are no samples.
    """
    if len(time) == 0:
        raise ValueError("no samples: the flight ended before the interval that is measured")
    span = np.diff(time)
    x0, x1, d0, d1 = value[:-1], value[1:], rate[:-1] * span, rate[1:] * span
    # x(s) = x0 + d0 s + b s^2 + a s^3 on 0 <= s <= 1
    a, b = 2 * (x0 - x1) + d0 + d1, 3 * (x1 - x0) - 2 * d0 - d1
    root = np.sqrt(np.maximum(b * b - 3 * a * d0, 0.0))
    q = -(b + np.copysign(root, b))
    with np.errstate(divide="ignore", invalid="ignore"):
        candidates = np.stack([q / (3 * a), d0 / q])
    s = np.where((candidates > 0) & (candidates < 1), candidates, 0.0)
    inner = np.abs(x0 + s * (d0 + s * (b + s * a)))
    times, values = np.r_[time, (time[:-1] + s * span).ravel()], np.r_[np.abs(value), inner.ravel()]
    worst = int(np.argmax(values))
    return float(values[worst]), float(times[worst])


def between_rows(time: Array, value: Array, rate: Array, pieces: int = 8) -> Array:
    """Returns a signal and its rate between the rows: the rate linear, the signal cubic.

    Args:
        time: Times of the rows, shape (n,), s.
        value: The signal, shape (n,).
        rate: Its time derivative, shape (n,).
        pieces: Into how many pieces each interval is divided.

    Returns:
        Signal and rate at both ends of every piece, shape (n - 1, pieces + 1, 2).
    """
    s = np.linspace(0, 1, pieces + 1)
    x0, x1, v0, v1 = value[:-1, None], value[1:, None], rate[:-1, None], rate[1:, None]
    cubic = (1 + 2 * s) * (1 - s) ** 2 * x0 + s**2 * (3 - 2 * s) * x1
    cubic += np.diff(time)[:, None] * (s * (1 - s) ** 2 * v0 - s**2 * (1 - s) * v1)
    return np.stack([cubic, v0 + s * (v1 - v0)], axis=2)


def moving_axes(trajectory: Trajectory, kind: str) -> list[str]:
    """Returns the axes of a vector signal that move at all, the most moving first.

    Args:
        trajectory: The flight.
        kind: Name of the signal without its axis, such as `attitude`.
    """
    signals = {axis: trajectory.signals.get(f"{kind}_{axis}") for axis in "xyz"}
    peaks = {axis: float(np.abs(x).max()) for axis, x in signals.items() if x is not None}
    least = 1e-3 * max(peaks.values(), default=0.0)
    return sorted((a for a in peaks if peaks[a] >= least), key=lambda axis: -peaks[axis])


def channel_units(trajectory: Trajectory) -> dict[str, str]:
    """Returns the thruster channels of a flight with their units.

    Args:
        trajectory: The flight.
    """
    names = [name for name in trajectory.signals if f"{name}_command" in trajectory.signals]
    return {name: trajectory.units[name] for name in names}
