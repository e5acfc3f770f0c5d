"""The folder that a run leaves: trajectories, verdicts, resolved scenario, picture, recording."""

import json
import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from spacecraft_sim import config
from spacecraft_sim.chart import Map, charts_of, vectors
from spacecraft_sim.compare import Comparison
from spacecraft_sim.families import is_quasi_rigid
from spacecraft_sim.guarantee import Assumption, Verdict
from spacecraft_sim.margins import Margin, Relay, Saturation
from spacecraft_sim.mission import Mission
from spacecraft_sim.scenario import Scenario
from spacecraft_sim.trajectory import Trajectory
from spacecraft_sim.versions import versions

if TYPE_CHECKING:
    from spacecraft_sim.beneath import Subject
    from spacecraft_sim.record import Recording


def create(path: Path | None, name: str) -> Path:
    """Makes the folder of a run.

    Args:
        path: Where; `runs/<name>`, numbered if that is taken, if left out.
        name: Name of the scenario.

    Raises:
        ValueError: If the folder exists or cannot be made.
    """
    numbered = (Path("runs") / (name if k == 1 else f"{name}-{k}") for k in range(1, 1_000_000))
    folder = path or next(p for p in numbered if not p.exists())
    try:
        folder.mkdir(parents=True)
    except FileExistsError:
        raise ValueError(f"--out {folder}: exists already; name a folder that does not") from None
    except OSError as error:
        raise ValueError(f"--out {folder}: cannot be written: {error.strerror}") from error
    return folder


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """What came of a run.

    Attributes:
        measured: Flight of the MuJoCo plant.
        predicted: Flight of the reduced plant.
        comparison: How the claims came out; None if a flight diverged.
        lost_viewer: Why the viewer did not get all of the recording; None if it did.
        lost_file: Why the file did not, likewise.
    """

    measured: Trajectory
    predicted: Trajectory
    comparison: Comparison | None
    lost_viewer: str | None
    lost_file: str | None


def fly(
    folder: Path,
    mission: Mission,
    *,
    viewer: str | None = None,
    exaggeration: float | None = None,
    flown: Callable[..., Trajectory] = Mission.fly,
) -> Run:
    """Flies a mission on both plants and writes all that a run leaves.

    Args:
        folder: The folder, which exists.
        mission: What is flown.
        viewer: Address of an open viewer that is to show it; None for none.
        exaggeration: How many times too far elastic parts are drawn bent; a round factor if None.
        flown: Flies a plant, as `Mission.fly` does.

    Raises:
        OSError: If a file cannot be written; the recording alone may be lost, which is told.
            Whatever is raised has a note of what of the recording was lost.
    """
    from spacecraft_sim import beneath, record

    about, comparison = subject(mission), None
    recording = record.Recording(about, folder / "recording.rrd", viewer)
    with _losses_noted(recording), recording:
        predicted = flown(mission, "reduced")
        recording.expect(beneath.reduced(about, predicted, exaggeration))
        measured = flown(mission, "mujoco", watch=recording.take)
        write_flights(folder, mission.scenario, measured, predicted)
        if reason := measured.meta.get("diverged") or predicted.meta.get("diverged"):
            recording.stop(reason)
        else:
            comparison = mission.judge(measured, predicted)
            recording.conclude(comparison.verdicts)
            # While the recording is written to its end.
            write_verdicts(folder, mission, comparison)
            write_pictures(folder, mission, measured, predicted, comparison, exaggeration)
    return Run(
        measured=measured,
        predicted=predicted,
        comparison=comparison,
        lost_viewer=recording.lost_viewer,
        lost_file=recording.lost_file,
    )


@contextmanager
def _losses_noted(recording: "Recording") -> Iterator[None]:
    try:
        yield
    except BaseException as error:
        for trouble in filter(None, (recording.lost_viewer, recording.lost_file)):
            error.add_note(f"spacecraft-sim: {trouble}")
        raise


def write_flights(folder: Path, scenario: Scenario, *flights: Trajectory) -> None:
    """Writes the resolved scenario and `trajectory.parquet`, and the others by their plant's name.

    Args:
        folder: The folder of the run.
        scenario: The scenario that was flown.
        *flights: The MuJoCo flight first.
    """
    (folder / "scenario.toml").write_text(resolved(scenario), encoding="utf-8")
    for k, flight in enumerate(flights):
        name = "trajectory" if k == 0 else flight.meta["plant"]
        flight.save(folder / f"{name}.parquet")


def resolved(scenario: Scenario) -> str:
    """Returns a scenario as TOML, every default spelt out, with the versions in use.

    Args:
        scenario: The scenario.
    """
    table = scenario.model_dump(mode="json", exclude_none=True)
    changes = {**scenario.changes(), "actual": scenario.actual_changes()}
    return config.dumps({**table, **changes, "versions": versions()})


def write_verdicts(folder: Path, mission: Mission, comparison: Comparison) -> None:
    """Writes `verdict.json`.

    Args:
        folder: The folder of the run.
        mission: What was flown.
        comparison: How it came out.
    """
    table = {
        "scenario": mission.scenario.name,
        "holds": all(verdict.holds for verdict in comparison.verdicts),
        "verdicts": [
            {**_plain(verdict), "reduced": _number(reduced.measured)}
            for verdict, reduced in zip(comparison.verdicts, comparison.reduced, strict=True)
        ],
        "comparison": [asdict(difference) for difference in comparison.differences],
        "versions": versions(),
    }
    text = json.dumps(table, indent=2, allow_nan=False, ensure_ascii=False)
    (folder / "verdict.json").write_text(text + "\n", encoding="utf-8")


def subject(mission: Mission) -> "Subject":
    """Returns what the recording of a mission is about.

    Args:
        mission: What is flown.
    """
    from spacecraft_sim.beneath import Subject

    return Subject(
        title=mission.scenario.title,
        scenario=resolved(mission.scenario),
        model=mission.mujoco.model.ptr,
        machine=mission.machine,
        bands=mission.bands,
        charts=charts_of(mission.controller),
    )


def write_margins(
    folder: Path,
    scenario: Scenario,
    found: Sequence[Margin],
    saturated: Sequence[Saturation],
    pulsed: Sequence[Relay],
) -> None:
    """Writes `margins.json`, in SI units.

    Args:
        folder: The folder.
        scenario: The scenario.
        found: Delay and sampling periods.
        saturated: Flights with limited torques.
        pulsed: Flights with relay thrusters.
    """
    table = {
        "scenario": scenario.name,
        "margins": [{k: _number(v) for k, v in asdict(margin).items()} for margin in found],
        "saturation": [{k: _number(v) for k, v in asdict(row).items()} for row in saturated],
        "relays": [{k: _number(v) for k, v in asdict(row).items()} for row in pulsed],
        "versions": versions(),
    }
    text = json.dumps(table, indent=2, allow_nan=False, ensure_ascii=False)
    (folder / "margins.json").write_text(text + "\n", encoding="utf-8")


def write_pictures(
    folder: Path,
    mission: Mission,
    measured: Trajectory,
    predicted: Trajectory,
    comparison: Comparison,
    exaggeration: float | None = None,
) -> None:
    """Writes `summary.png`, `report.html` and, for a law that has maps, `charts.png`.

    Args:
        folder: The folder of the run.
        mission: What was flown.
        measured: Flight of the MuJoCo plant.
        predicted: Flight of the reduced plant.
        comparison: How it came out.
        exaggeration: As for `fly`.
    """
    from spacecraft_sim import drawing, frames, plots, plots_chart, plots_law, plots_smooth, report

    title, charts = mission.scenario.title, charts_of(mission.controller)
    model, machine = mission.mujoco.model.ptr, mission.machine
    factor = exaggeration or frames.suited_factor(model, machine, predicted)
    drawn = drawing.draw(model, machine, measured, factor=factor)
    plots.summary(
        folder / "summary.png",
        measured=measured,
        predicted=predicted,
        drawing=drawn,
        verdicts=comparison.verdicts,
        title=title,
        bands=mission.bands,
        histories=None
        if is_quasi_rigid(predicted)
        else plots_smooth.panels(measured, vectors(charts, measured)),
        law=plots_law.panels(charts, measured),
    )
    if any(isinstance(chart, Map) for chart in charts):
        plots_chart.page(folder / "charts.png", measured=measured, charts=charts, title=title)
    report.write(
        folder / "report.html",
        mission=mission,
        measured=measured,
        predicted=predicted,
        drawing=drawn,
        comparison=comparison,
        scenario_toml=resolved(mission.scenario),
    )


def _plain(verdict: Verdict) -> dict[str, Any]:
    plain = {name: _number(value) for name, value in asdict(verdict).items()}
    plain["outcome"] = verdict.outcome
    plain["assumptions"] = [_assumption(a) for a in verdict.assumptions]
    plain["failed"] = [a.text for a in verdict.failed]
    return plain


def _assumption(assumption: Assumption) -> dict[str, Any]:
    return {**asdict(assumption), "value": _number(assumption.value), "holds": assumption.holds}


def _number(value: Any) -> Any:
    """JSON has no word for what is not finite: null."""
    return None if isinstance(value, float) and not math.isfinite(value) else value
