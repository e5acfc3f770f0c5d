"""Two runs in one recording: B over A, whose spacecraft is the ghost."""

from collections.abc import Sequence
from pathlib import Path

from spacecraft_sim import record, run_folder
from spacecraft_sim.beneath import Beneath, Subject, bent, channels
from spacecraft_sim.frames import Frames, at_rest, drawn_bodies, simulated, suited_factor
from spacecraft_sim.record_text import cell, verdict_table
from spacecraft_sim.run_pair import Pair, Run, table
from spacecraft_sim.trajectory import Trajectory


def write(path: Path, compared: Pair, factor: float | None = None) -> None:
    """Writes the recording of two runs.

    Args:
        path: The .rrd file.
        compared: The runs.
        factor: How many times too far booms are bent; a round factor that shows it if left out.
    """
    a, b = compared.a, compared.b
    below, above = run_folder.subject(a.mission), run_folder.subject(b.mission)
    names = {chart.name for chart in above.charts}
    subject = Subject(
        title=f"A: {a.title}, B: {b.title}",
        scenario=f"# A: {a.folder}\n{below.scenario}\n\n# B: {b.folder}\n{above.scenario}",
        model=above.model,
        machine=above.machine,
        bands={s: half for s, half in above.bands.items() if below.bands.get(s) == half},
        charts=(*above.charts, *(x for x in below.charts if x.name not in names)),
    )
    if factor is None:
        factor = min(_factor(run) for run in (a, b))
    rest = at_rest(below.model, below.machine)

    def frames(part: Trajectory, beside: Frames, over: Trajectory) -> Frames:
        return simulated(below.model, below.machine, part, factor)

    beneath = Beneath(
        flight=a.flight,
        known=(a.flight, b.flight),
        key="A",
        name="A",
        over_key="B",
        over_name="B",
        rest=rest,
        bodies=drawn_bodies(rest),
        frames=frames,
        factor=factor,
        channels=channels(a.flight, below.machine, (a.flight, b.flight)),
        charts=below.charts,
        notes=tuple(
            x for x in (bent(above.model, above.machine, factor), "Translucent: run A.") if x
        ),
    )
    record.write(path, subject, b.flight, beneath, b.verdicts, page(compared, beneath.notes))


def page(compared: Pair, notes: Sequence[str]) -> str:
    """Returns the table of differences as Markdown.

    Args:
        compared: The runs.
        notes: What is to be said of the recording.
    """
    lines = [f"# A: {compared.a.title}, B: {compared.b.title}", *notes]
    for heading, rows in table(compared):
        lines += ["", f"**{heading}**", "", "|  | A | B | B - A |", "|:--|--:|--:|--:|"]
        lines += [f"| {' | '.join(cell(text) for text in row)} |" for row in rows]
    for word, run in (("A", compared.a), ("B", compared.b)):
        lines += ["", f"**claims of {word}**", "", *verdict_table(run.verdicts)]
    return "\n".join(lines)


def _factor(run: Run) -> float:
    return suited_factor(run.mission.mujoco.model.ptr, run.mission.machine, run.flight)
