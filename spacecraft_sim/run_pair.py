"""Two runs beside each other: what was set differently, and what came of it."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from spacecraft_sim import mission
from spacecraft_sim.compare import Difference, differences
from spacecraft_sim.guarantee import Verdict
from spacecraft_sim.mission import Mission
from spacecraft_sim.trajectory import Trajectory, channel_units
from spacecraft_sim.versions import versions

Array = np.ndarray
Figures = dict[tuple[str, str], float | None]  # by name and unit; None if there is no such figure
LATE = 0.1  # share of a flight that counts as its end
SAME = ("identical", "", "", "")  # a row of the table where nothing differs
_WORDS = ("name", "title", "description", "versions")  # of a scenario: they fly nothing


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run that is over.

    Attributes:
        folder: Its folder.
        mission: What was flown.
        flight: The flight of the MuJoCo plant.
        verdicts: What became of its claims.
    """

    folder: Path
    mission: Mission
    flight: Trajectory
    verdicts: tuple[Verdict, ...]

    @property
    def title(self) -> str:
        """Names of the scenario and of the folder."""
        return f"{self.mission.scenario.name} ({self.folder.resolve().name})"


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A line of the table of differences.

    Attributes:
        what: What is compared.
        unit: Unit of both, empty if there is none.
        a: Of run A; None if it has no such thing, or no figure for it.
        b: Of run B; likewise.
    """

    what: str
    unit: str
    a: Any
    b: Any

    @property
    def difference(self) -> float | None:
        """B minus A; None where they are no numbers."""
        numbers = all(isinstance(x, (int, float)) for x in (self.a, self.b))
        return self.b - self.a if numbers and not isinstance(self.a, bool) else None


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """Two runs and how they differ.

    Attributes:
        a: One run.
        b: The other.
        settings: Settings that differ.
        figures: Figures of the flights.
        claims: What the claims measured, those of both first.
        signals: B minus A, signal by signal, at the instants that both have.
    """

    a: Run
    b: Run
    settings: tuple[Row, ...]
    figures: tuple[Row, ...]
    claims: tuple[Row, ...]
    signals: tuple[Difference, ...]


def read(folder: Path) -> Run:
    """Reads the folder of a run and checks its claims again.

    Args:
        folder: The folder.

    Raises:
        ValueError: If it is not the folder of a run.
    """
    scenario, track = folder / "scenario.toml", folder / "trajectory.parquet"
    for path in (scenario, track):
        if not path.is_file():
            raise ValueError(f"{folder}: not the folder of a run; it has no {path.name}")
    flown = mission.assemble(mission.load_scenario(scenario))
    flight = Trajectory.load(track)
    verdicts = tuple(guarantee.check(flight) for guarantee in flown.guarantees)
    return Run(folder=folder, mission=flown, flight=flight, verdicts=verdicts)


def pair(a: Run, b: Run) -> Pair:
    """Compares two runs.

    Args:
        a: One run.
        b: The other.
    """
    return Pair(
        a=a,
        b=b,
        settings=tuple(_settings(a, b)),
        figures=tuple(_beside(_figures(a), _figures(b))),
        claims=tuple(_claims(a, b)),
        signals=_signals(a.flight, b.flight),
    )


def write_json(path: Path, compared: Pair) -> None:
    """Writes `comparison.json`.

    Args:
        path: The file.
        compared: The runs.
    """
    table = {
        **{
            key: {
                "folder": str(run.folder),
                "scenario": run.mission.scenario.name,
                "holds": all(v.holds for v in run.verdicts),
            }
            for key, run in (("a", compared.a), ("b", compared.b))
        },
        **{
            name: [{**asdict(row), "difference": row.difference} for row in rows]
            for name, rows in (
                ("settings", compared.settings),
                ("figures", compared.figures),
                ("claims", compared.claims),
            )
        },
        "signals": [asdict(difference) for difference in compared.signals],
        "versions": versions(),
    }
    text = json.dumps(_finite(table), indent=2, allow_nan=False, ensure_ascii=False)
    path.write_text(text + "\n", encoding="utf-8")


def _finite(value: Any) -> Any:
    """JSON has no word for what is not finite: null."""
    if isinstance(value, dict):
        return {key: _finite(x) for key, x in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(x) for x in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def table(compared: Pair) -> list[tuple[str, list[tuple[str, ...]]]]:
    """Returns the table of differences as words: headings, and below each (what, A, B, B - A).

    Args:
        compared: The runs.
    """
    groups = (
        ("settings", compared.settings),
        ("figures of the flights", compared.figures),
        ("claims, as measured", compared.claims),
    )
    lines = [(heading, [_cells(row) for row in rows] or [SAME]) for heading, rows in groups]
    return [*lines, ("signals", _differing(compared.signals))]


def _differing(signals: Sequence[Difference]) -> list[tuple[str, ...]]:
    """The motions that differ; if none does, what there is to say of the signals."""
    found = [
        (d.signal, "", "", f"at most {d.max_error:.4g} {d.unit}, rms {d.rms_error:.4g}")
        for d in signals
        if d.unit in ("rad", "rad/s", "m") and "." not in d.signal and d.max_error > 0
    ]
    if not signals:
        return [("no signal in common", "", "", "")]
    if any(d.max_error > 0 for d in signals):
        return found or [("no angle, rate or deflection differs", "", "", "")]
    return [SAME]


def _cells(row: Row) -> tuple[str, ...]:
    unit = f" [{row.unit}]" if row.unit else ""
    difference = "" if row.difference is None else f"{row.difference:+.4g}"
    return f"{row.what}{unit}", _word(row.a), _word(row.b), difference


def _word(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, list):
        return ", ".join(_word(x) for x in value) or "none"
    return f"{value:.6g}" if isinstance(value, float) else str(value)


def _settings(a: Run, b: Run) -> Iterator[Row]:
    tables = [dict(_flat(_flown(run))) for run in (a, b)]
    for key in dict.fromkeys([*tables[0], *tables[1]]):
        mine, other = (table.get(key) for table in tables)
        if mine != other:
            yield Row(what=key, unit="", a=mine, b=other)


def _flown(run: Run) -> dict[str, Any]:
    """The scenario, and of the machine what its file and the scenario make of it together."""
    table = run.mission.scenario.model_dump(mode="json")
    for words in (*_WORDS, "booms", "thrusters", "actual"):
        table.pop(words)
    machine = run.mission.machine.model_dump(mode="json", include={"booms", "thrusters"})
    parts = {kind: {part.pop("name"): part for part in parts} for kind, parts in machine.items()}
    return table | parts


def _flat(table: dict[str, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    for key, value in table.items():
        if isinstance(value, dict):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _figures(run: Run) -> Figures:
    flight = run.flight
    late = flight.time >= flight.time[0] + (1 - LATE) * (flight.time[-1] - flight.time[0])
    found: Figures = {("flight", "s"): float(flight.time[-1])}
    kinds = {
        kind: [f"{kind}_{axis}" for axis in "xyz" if f"{kind}_{axis}" in flight.signals]
        for kind in ("attitude", "quasi_rigid_angle", "rate")
    }
    joints = {name: [name] for name in flight.signals if f"{name}_rate" in flight.signals}
    for kind, names in {**kinds, **joints}.items():
        if names:
            size = np.linalg.norm([flight[name] for name in names], axis=0)
            words, unit = kind.replace("quasi_", "quasi-").replace("_", " "), flight.units[names[0]]
            found[f"largest {words}", unit] = float(size.max())
            found[f"largest {words} in the last tenth", unit] = float(size[late].max())
    for boom in run.mission.machine.booms:  # other elastic parts have no one way to bend
        deflection = float(np.abs(flight[f"{boom.name}_tip_y"]).max())
        found[f"largest deflection of boom {boom.name}", "m"] = deflection
    for channel, unit in channel_units(run.flight).items():
        changes = float(np.count_nonzero(np.diff(flight[f"{channel}_command"])))
        found[f"changes of command of {channel}", ""] = changes
        found[f"impulse spent by {channel}", f"{unit} s"] = float(flight[f"{channel}_spent"][-1])
    return found


def _claims(a: Run, b: Run) -> Iterator[Row]:
    measured = [
        {(v.claim, v.unit): v.measured if math.isfinite(v.measured) else None for v in run.verdicts}
        for run in (a, b)
    ]
    yield from _beside(*measured)
    holds = [sum(v.holds for v in run.verdicts) for run in (a, b)]
    yield Row(what="claims that hold", unit="", a=holds[0], b=holds[1])


def _beside(a: Figures, b: Figures) -> Iterator[Row]:
    for what, unit in dict.fromkeys([*(k for k in a if k in b), *a, *b]):
        yield Row(what=what, unit=unit, a=a.get((what, unit)), b=b.get((what, unit)))


def _signals(a: Trajectory, b: Trajectory) -> tuple[Difference, ...]:
    """At common instants; on steps that never meet, B between its rows."""
    if len(np.intersect1d(a.time, b.time)) < 3:
        both = a.time[a.time <= b.time[-1]]
        signals = {name: np.interp(both, b.time, value) for name, value in b.signals.items()}
        b = Trajectory(time=both, signals=signals, units=b.units)
    return differences(b, a)
