"""One flight of a gallery: the folder of a run, a small picture, a card."""

from pathlib import Path

from spacecraft_sim import beneath, mission, record, run_folder
from support import gallery_page


def fly(name: str, duration: float | None, out: Path) -> gallery_page.Card:
    """Flies one scenario and writes its folder and its picture.

    Args:
        name: The scenario.
        duration: Length of the flight at most, s; its own if None.
        out: The gallery.

    Raises:
        ArithmeticError: If a flight diverges.
    """
    length = mission.load_scenario(name).duration
    settings = (f"duration={min(length, duration or length)!r}",)
    ready = mission.assemble(mission.load_scenario(name, settings))
    measured, predicted = ready.fly(), ready.fly("reduced")
    for flight in (measured, predicted):
        if reason := flight.meta.get("diverged"):
            raise ArithmeticError(reason)
    comparison = ready.judge(measured, predicted)
    folder = run_folder.create(out / name, name)
    run_folder.write_flights(folder, ready.scenario, measured, predicted)
    run_folder.write_verdicts(folder, ready, comparison)
    subject = run_folder.subject(ready)
    below = beneath.reduced(subject, predicted)
    record.write(folder / "recording.rrd", subject, measured, below, comparison.verdicts)
    run_folder.write_pictures(folder, ready, measured, predicted, comparison)
    gallery_page.shrink(folder / "summary.png", out / f"{name}.png")
    law = ready.scenario.controller["law"]
    return gallery_page.Card(
        name=name,
        title=ready.scenario.title,
        description=" ".join(ready.scenario.description.split()),
        facts=(ready.machine.name, law, f"{measured.time[-1]:g} s"),
        kept=sum(verdict.holds for verdict in comparison.verdicts),
        claims=len(comparison.verdicts),
    )
