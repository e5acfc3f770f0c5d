"""Reproduces the numerical example of a paper, in all its readings, and flies it on MuJoCo.

    python scripts/reproduce.py efremov

prints exact figures beside reference figures, and writes `figure.png` and `recording.rrd`: the full
plant and the reduced model, one over the other.
"""

import argparse
import sys
from pathlib import Path

from spacecraft_sim import beneath, mission, record, run_folder
from support import efremov_figure as figure
from support import efremov_reference as reference

SCENARIO = "efremov-nonlocal"  # the authors' boom under the law of Theorem 2


def fly(ready: mission.Mission, folder: Path) -> None:
    """Flies a mission on both plants and draws them, one over the other.

    Args:
        ready: The mission.
        folder: Where the pictures go.
    """
    measured, predicted = ready.fly(), ready.fly("reduced")
    figure.write(folder / "figure.png", measured, predicted, ready.scenario)
    subject = run_folder.subject(ready)
    verdicts = ready.judge(measured, predicted).verdicts
    below = beneath.reduced(subject, predicted)
    record.write(folder / "recording.rrd", subject, measured, below, verdicts)


def main(argv: list[str] | None = None) -> int:
    """Reproduces the example; returns 0 if every figure agrees, 1 if one differs.

    Args:
        argv: Words of the command line; those of the process if left out.
    """
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("paper", choices=["efremov"], help="whose example")
    parser.add_argument("--out", type=Path, help="a new folder; runs/<name> if left out")
    parser.add_argument("--duration", type=float, help="of the flight on MuJoCo, s")
    arguments = parser.parse_args(argv)
    settings = ["simulation.substeps=2"]  # rows every 0.02 s, for smooth curves
    if arguments.duration is not None:
        settings.append(f"duration={arguments.duration}")
    try:
        ready = mission.assemble(mission.load_scenario(SCENARIO, tuple(settings)))
        folder = run_folder.create(arguments.out, f"{arguments.paper}-paper")
    except ValueError as error:
        parser.error(str(error))
    text, marks = reference.table()
    print(text)
    fly(ready, folder)
    print(f"written: {folder / 'figure.png'}, {folder / 'recording.rrd'}")
    return 1 if marks[reference.DIFFERS] else 0


if __name__ == "__main__":
    sys.exit(main())
