"""What a recording holds, read with rerun's own chunk reader."""

import warnings
from dataclasses import dataclass, field

import numpy as np
from rerun.chunk import RrdReader


@dataclass
class Entity:
    """Rows of one entity: times, s, and the values of each component, in the order of time."""

    static: dict = field(default_factory=dict)
    time: np.ndarray = field(default_factory=lambda: np.zeros(0))
    values: dict = field(default_factory=dict)

    def array(self, component):
        """A component whose rows all have the same shape."""
        return np.array(self.values[component], dtype=float)


def read(path):
    """Entities of a recording by path; a file without its footer reads as well."""
    rows, static = {}, {}
    for chunk in _reader(path).stream():
        batch, name = chunk.to_record_batch(), str(chunk.entity_path)
        components = [c for c in batch.schema.names if ":" in c]
        if chunk.is_static:
            found = {c: batch.column(c).to_pylist()[-1] for c in components}
            static.setdefault(name, {}).update(found)  # the last one counts
            continue
        time = batch.column("sim_time").cast("int64").to_numpy() / 1e9
        values = {c: batch.column(c).to_pylist() for c in components}
        for k, t in enumerate(time):
            rows.setdefault(name, []).append((t, {c: v[k] for c, v in values.items()}))
    found = {}
    for name in {*rows, *static}:
        ordered = sorted(rows.get(name, []), key=lambda row: row[0])
        values = {c: [row[c] for _, row in ordered] for c in (ordered[0][1] if ordered else {})}
        time = np.array([t for t, _ in ordered])
        found[name] = Entity(static=static.get(name, {}), time=time, values=values)
    return found


def stores(path):
    """How many recordings and how many blueprints a file holds."""
    reader = _reader(path)
    return len(reader.recordings()), len(reader.blueprints())


def application(path):
    """Name of the application of a recording, which that of its layout must be."""
    reader = _reader(path)
    (name,) = {entry.application_id for entry in (*reader.recordings(), *reader.blueprints())}
    return name


def chunks(path):
    """How many chunks a file with a footer holds; a file without one is refused by rerun."""
    return len(_reader(path).store())


def _reader(path):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # a file without a footer is read on purpose
        return RrdReader(path)
