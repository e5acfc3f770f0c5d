"""Reproduces the numerical example of a paper, in all its readings, and flies it on MuJoCo.

    python scripts/reproduce.py efremov

prints a table of exact figures beside reference figures, and writes `figure.png` and
`recording.rrd`: the full plant and the reduced model, one over the other.
"""

import argparse
import sys
from collections import Counter
from pathlib import Path

sys.path.append(str(Path(__file__).parent))  # the modules beside this one, however it is loaded

import efremov_example as example
import efremov_figure as figure
import efremov_reference as reference

from spacecraft_sim import drawing, mission, record, run_folder

SCENARIO = "efremov-nonlocal"  # the authors' boom under the law of Theorem 2


def table() -> Counter[str]:
    """Prints the example in all its readings; returns how often each mark stands in it."""
    print("Efremov, Polyakov & Strygin (2006), section 5, in all its readings.")
    print("beta and v of the law in rad, rad/s (divided by J) or kg m^2, kg m^2/s; the last seven")
    print("columns but max |q| speak of the last 60 s and of all switchings after T2.\n")
    print(reference.heading())
    found = Counter()
    for case, row in zip(example.CASES, reference.REFERENCE, strict=True):
        figures = example.figures(example.fly(case))
        unit = "in rad" if case.by_inertia else "in kg m^2"
        print(reference.lines(f"{case.title}, {unit}", row, figures))
        found.update(reference.marks(row, figures).values())
    return found


def fly(folder: Path, duration: float | None) -> None:
    """Flies the authors' boom on both plants and draws them, one over the other.

    Args:
        folder: Where the pictures go.
        duration: Length of the flight, s; that of the scenario if None.
    """
    settings = ("simulation.substeps=2",)  # rows every 0.02 s, for smooth curves
    settings += () if duration is None else (f"duration={duration}",)
    ready = mission.assemble(mission.load_scenario(SCENARIO, settings))
    measured, predicted = ready.fly(), ready.fly("reduced")
    figure.write(folder / "figure.png", measured, predicted, ready.scenario)
    record.write(
        folder / "recording.rrd",
        measured=measured,
        predicted=predicted,
        drawing=drawing.draw(ready.mujoco.model.ptr, ready.machine, measured),
        verdicts=ready.judge(measured, predicted).verdicts,
        scenario_toml=run_folder.resolved(ready.scenario),
        title=ready.scenario.title,
        band=ready.scenario.controller["accuracy"],
    )


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
    try:
        folder = run_folder.create(arguments.out, f"{arguments.paper}-paper")
        found = table()
        for mark, meaning in reference.MARKS.items():
            print(f"{mark} {found[mark]:3d} figures: {meaning}")
        fly(folder, arguments.duration)
    except ValueError as error:
        parser.error(str(error))
    print(f"written: {folder / 'figure.png'}, {folder / 'recording.rrd'}")
    return 1 if found[reference.DIFFERS] else 0


if __name__ == "__main__":
    sys.exit(main())
