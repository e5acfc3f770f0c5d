"""Columns of numbers for the figures of a report, packed, and thinned where they are too long.

A curve of more than `LIMIT` points keeps the least and the largest value of each group of rows.
Thrust is never thinned: rows at which nothing changes say nothing.
"""

import base64
from typing import Any

import numpy as np

Array = np.ndarray
Figure = dict[str, Any]

LIMIT = 24_000  # points of a curve


class Columns:
    """Columns of numbers, each kept once, little-endian and in base64.

    Attributes:
        packed: Type and data by key.
    """

    def __init__(self):
        self.packed: dict[str, dict[str, str]] = {}
        self._keys: dict[bytes, str] = {}

    def add(self, values: Array, kind: str = "f4") -> str:
        """Returns the key of a column.

        Args:
            values: The numbers.
            kind: `f4` or `f8`; times are f8, so that switchings stay apart.
        """
        data = np.ascontiguousarray(values, dtype=f"<{kind}").tobytes()
        key = self._keys.setdefault(kind.encode() + data, f"c{len(self._keys)}")
        if key not in self.packed:
            self.packed[key] = {"type": kind, "data": base64.b64encode(data).decode()}
        return key


def extremes(values: Array, limit: int) -> Array:
    """Returns rows that keep the least and the largest value of each group, and both ends.

    Args:
        values: Samples, shape (n,).
        limit: How many rows to keep at most, about; all are kept if there are no more.
    """
    n = len(values)
    if n <= limit:
        return np.arange(n)
    size = -(-2 * n // limit)
    whole = n // size * size
    groups = values[:whole].reshape(-1, size)
    first = np.arange(0, whole, size)
    rows = [first + groups.argmin(axis=1), first + groups.argmax(axis=1), np.arange(whole, n)]
    return np.unique(np.concatenate([[0], *rows, [n - 1]]))


def curve(columns: Columns, time: Array, values: Array) -> dict[str, str]:
    """Packs a curve over time, thinned if it is long.

    Args:
        columns: Where to.
        time: Times of the rows, shape (n,), s.
        values: Shape (n,).
    """
    rows = extremes(values, LIMIT)
    return {"t": columns.add(time[rows], "f8"), "y": columns.add(values[rows])}


def steps(columns: Columns, time: Array, values: Array) -> dict[str, str]:
    """Packs only the rows at which a value that holds changes, and the last.

    Args:
        columns: Where to.
        time: Times of the rows, shape (n,), s.
        values: Shape (n,).
    """
    rows = np.flatnonzero(np.r_[True, values[1:] != values[:-1]])
    rows = np.unique(np.append(rows, len(values) - 1))
    return {"t": columns.add(time[rows], "f8"), "y": columns.add(values[rows])}


def track(columns: Columns, time: Array, x: Array, y: Array) -> dict[str, str]:
    """Packs two quantities over each other, thinned if they are long.

    Args:
        columns: Where to.
        time: Times of the rows, shape (n,), s.
        x: Shape (n,).
        y: Shape (n,).
    """
    rows = np.union1d(extremes(x, LIMIT // 2), extremes(y, LIMIT // 2))
    rows = rows if len(x) > LIMIT else np.arange(len(x))
    pair = {"x": columns.add(x[rows]), "y": columns.add(y[rows])}
    return {"t": columns.add(time[rows], "f8"), **pair}


def plane(name: str, title: str, x: Figure, y: Figure) -> Figure:
    """Returns an empty plane.

    Args:
        name: Name of the figure.
        title: What it shows.
        x: Name and unit of the x axis.
        y: Name and unit of the y axis.
    """
    parts = {part: [] for part in ("regions", "lines", "tracks", "bands", "points")}
    return {"id": name, "kind": "plane", "title": title, "x": x, "y": y, "window": None, **parts}
