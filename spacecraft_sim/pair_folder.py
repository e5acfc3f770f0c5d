"""The folder that a comparison of two runs leaves."""

from pathlib import Path

from spacecraft_sim import plots_pair, record_pair, run_pair
from spacecraft_sim.run_pair import Pair, Run


def write(folder: Path, compared: Pair, factor: float | None) -> None:
    """Writes `comparison.json`, `comparison.png` and `recording.rrd` of two runs.

    Args:
        folder: The folder.
        compared: The runs.
        factor: How many times too far booms are bent; a round factor if left out.
    """
    run_pair.write_json(folder / "comparison.json", compared)
    a, b = compared.a, compared.b
    plots_pair.page(
        folder / "comparison.png",
        a=a.flight,
        b=b.flight,
        title=f"A: {a.title},  B: {b.title}",
        booms=[x.name for x in a.mission.machine.booms if x.name in _booms(b)],
        bands=(a.mission.bands, b.mission.bands),
        table=run_pair.table(compared),
    )
    record_pair.write(folder / "recording.rrd", compared, factor)


def _booms(run: Run) -> set[str]:
    return {boom.name for boom in run.mission.machine.booms}
