"""One flight of a gallery: the folder of a run, a small picture, a card."""

from pathlib import Path

from spacecraft_sim import mission, run_folder
from support import gallery_page


def fly(name: str, duration: float | None, out: Path) -> gallery_page.Card:
    """Flies one scenario and writes its folder and its picture.

    Args:
        name: The scenario.
        duration: Length of the flight at most, s; its own if None.
        out: The gallery.

    Raises:
        ArithmeticError: If a flight diverges.
        OSError: If a file cannot be written to its end.
    """
    length = mission.load_scenario(name).duration
    settings = (f"duration={min(length, duration or length)!r}",)
    ready = mission.assemble(mission.load_scenario(name, settings))
    folder = run_folder.create(out / name, name)
    done = run_folder.fly(folder, ready)
    if done.comparison is None:
        raise ArithmeticError(done.measured.meta.get("diverged") or done.predicted.meta["diverged"])
    if done.lost_file:
        raise OSError(done.lost_file)
    verdicts = done.comparison.verdicts
    gallery_page.shrink(folder / "summary.png", out / f"{name}.png")
    law = ready.scenario.controller["law"]
    return gallery_page.Card(
        name=name,
        title=ready.scenario.title,
        description=" ".join(ready.scenario.description.split()),
        facts=(ready.machine.name, law, f"{done.measured.time[-1]:g} s"),
        kept=sum(verdict.holds for verdict in verdicts),
        claims=len(verdicts),
    )
