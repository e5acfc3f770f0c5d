"""The command `spacecraft-sim`: flights, and what is done beside them.

Exit codes: 0 all claims hold, 1 one does not, 2 usage or bad input, 3 the run diverged or crashed,
or what it leaves cannot be written.
A certificate holds if the attitude is guaranteed about each axis, every assumption holds and no
flight passed a bound; its first line says so, or why not.
"""

# Heavy modules are imported by the commands that need them.

import argparse
import gc
import math
import os
import sys
import traceback
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import Progress, TextColumn, TimeRemainingColumn
from rich.table import Table

from spacecraft_sim import cli_tools, terminal
from spacecraft_sim.terminal import BAD_INPUT, BROKEN, FAILS, HOLDS

if TYPE_CHECKING:
    from spacecraft_sim.compare import Comparison
    from spacecraft_sim.mission import Mission
    from spacecraft_sim.plant import PlantName
    from spacecraft_sim.trajectory import Trajectory

# The matrices are small: threads of the linear algebra would only wait for each other.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
# Rows, figures and imports make many objects and hardly a cycle: to look for cycles after every
# 700 of them takes a seventh of a run.
gc.set_threshold(100_000, 20, 100)


SOURCED = 120  # least width of a terminal in which the verdicts have their sources, characters


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command.

    Args:
        argv: Its words; those of the process if left out.

    Returns:
        The exit code.
    """
    arguments = _parser().parse_args(argv)
    try:
        return arguments.command(arguments)
    except ValueError as error:
        print(f"spacecraft-sim: {error}", file=sys.stderr)
        return BAD_INPUT
    except OSError as error:
        print(f"spacecraft-sim: {error}", file=sys.stderr)
        return BROKEN


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        prog="spacecraft-sim", description=(__doc__ or "").partition("\n\n")[2]
    )
    commands = parser.add_subparsers(required=True, metavar="COMMAND")

    def command(function: Callable, summary: str) -> argparse.ArgumentParser:
        name = function.__name__.strip("_")
        found = commands.add_parser(name, help=summary, description=summary)
        found.set_defaults(command=function)
        return found

    settings = {"nargs": "+", "action": "extend", "default": [], "metavar": "key=value"}
    command(_list, "list scenarios, spacecraft and laws")
    explain = command(_explain, "say what a scenario shows, its parameters, what theory predicts")
    explain.add_argument("name", metavar="NAME", help="scenario, or path of a TOML file")
    explain.add_argument("--set", help="change a key of the scenario", **settings)
    run = command(_run, "fly a scenario on MuJoCo and on the reduced model and print the verdicts")
    run.add_argument("name", metavar="NAME", help="scenario, or path of a TOML file")
    run.add_argument("--out", type=Path, help="folder to write; default runs/NAME, numbered")
    run.add_argument("--set", help="change a key of the scenario", **settings)
    factor = "how many times too far the recording bends booms; a round factor if left out"
    run.add_argument("--exaggeration", type=float, metavar="FACTOR", help=factor)
    live = run.add_mutually_exclusive_group()
    shown = "show the flight in a viewer that is open on this machine; 127.0.0.1:9876 if left out"
    live.add_argument("--connect", nargs="?", const="", metavar="ADDRESS", help=shown)
    live.add_argument("--spawn", action="store_true", help="show the flight in a new viewer")
    compare = command(cli_tools.compare, "put two runs in one recording, one figure and one table")
    compare.add_argument("a", type=Path, metavar="A", help="folder of a run")
    compare.add_argument("b", type=Path, metavar="B", help="folder of another")
    compare.add_argument("--out", type=Path, help="folder to write; default runs/A-and-B, numbered")
    compare.add_argument("--exaggeration", type=float, metavar="FACTOR", help=factor)
    repair = command(cli_tools.repair, "make a recording whole whose run was killed")
    repair.add_argument(
        "file",
        type=Path,
        metavar="FILE.rrd",
        help="recording, or the folder of its run; it is replaced",
    )
    margins = command(
        cli_tools.margins, "say what delay, sampling period and torque limits a smooth law bears"
    )
    margins.add_argument("name", metavar="NAME", help="scenario, or path of a TOML file")
    margins.add_argument("--out", type=Path, help="folder to write margins.json to")
    margins.add_argument("--linear", action="store_true", help="leave out the flights")
    margins.add_argument(
        "--relay", type=float, default=1.5, metavar="N_m", help="level of relay thrusters, N m"
    )
    margins.add_argument("--set", help="change a key of the scenario", **settings)
    export = command(cli_tools.export, "write the complete MJCF of a spacecraft as one file")
    export.add_argument("name", metavar="NAME", help="spacecraft or scenario, or path of its TOML")
    export.add_argument("file", type=Path, metavar="FILE.xml", help="file to write")
    video = command(
        cli_tools.video, "render the flight in the folder of a run with MuJoCo, without a display"
    )
    video.add_argument("folder", type=Path, metavar="RUN_FOLDER", help="folder that `run` wrote")
    video.add_argument("--camera", metavar="NAME", help="camera of the machine's scene.xml")
    video.add_argument("--fps", type=float, default=25.0, help="frames a second; default 25")
    video.add_argument("--speed", type=float, help="simulated over shown time; default: about 30 s")
    video.add_argument("--out", type=Path, metavar="FILE", help=".webp or .mp4 file to write")
    command(cli_tools.doctor, "say what this machine can do, what is missing, and what to install")
    certify = command(
        cli_tools.certify, "guaranteed pointing accuracy of a machine with elastic parts"
    )
    what = "spacecraft, path of its TOML, or any MJCF file.xml with a free joint"
    certify.add_argument("name", metavar="NAME", help=what)
    for key, unit, words in cli_tools.CERTIFIED:
        certify.add_argument(f"--{key}", type=float, nargs="+", metavar=unit, help=words)
    words = "sampling period of the regulator, s; continuous time if left out"
    certify.add_argument("--timestep", type=float, default=0.0, metavar="s", help=words)
    words = "search for the worst switchings in so many flights on MuJoCo about each axis"
    certify.add_argument("--attack", type=int, default=0, metavar="FLIGHTS", help=words)
    words = "folder to write; default runs/certificate-NAME, numbered"
    certify.add_argument("--out", type=Path, help=words)
    return parser


# -- list ------------------------------------------------------------------------------------------


def _list(_: argparse.Namespace) -> int:
    from controllers import REGISTRY
    from spacecraft_sim import config, library

    table = Table("name", "what it is", box=None, pad_edge=False, header_style="bold")
    for kind, names, title in (
        ("scenarios", library.scenario_names(), "scenarios"),
        ("models", library.spacecraft_names(), "spacecraft"),
    ):
        table.add_row(f"[bold]{title}[/]")
        for name in names:
            folder = library.folder(kind)
            path = (
                folder / f"{name}.toml" if kind == "scenarios" else folder / name / f"{name}.toml"
            )
            table.add_row(f"  {name}", config.read(path).get("title", ""))
    table.add_row("[bold]laws[/]")
    for name, design in REGISTRY.items():
        table.add_row(f"  {name}", (design.__doc__ or "").partition("\n")[0])
    terminal.console().print(table)
    return HOLDS


# -- explain ---------------------------------------------------------------------------------------


def _explain(arguments: argparse.Namespace) -> int:
    mission = terminal.assemble(arguments)
    from controllers import REGISTRY
    from spacecraft_sim import explain

    console = terminal.console()
    scenario = mission.scenario
    console.print(f"[bold]{scenario.name}[/]: {scenario.title}\n\n{scenario.description.strip()}\n")
    law = REGISTRY[scenario.controller["law"]]
    for heading, rows in explain.parameters(scenario, mission.machine, law):
        table = Table("parameter", "value", "default", "unit", "what", title=heading, box=None)
        terminal.fill(table, rows)
        console.print(table)
    claims = Table(
        "claim", "theory", "bound", "unit", "source", title="what theory predicts", box=None
    )
    terminal.fill(claims, explain.predictions(mission.guarantees))
    console.print(claims)
    console.print("[bold]assumptions that the design decides[/]")
    for line in explain.assumptions(mission.guarantees):
        console.print(f"  {line}", highlight=False)
    return HOLDS


# -- run -------------------------------------------------------------------------------------------


def _run(arguments: argparse.Namespace) -> int:
    mission = terminal.assemble(arguments)
    from spacecraft_sim import run_folder, viewer

    factor = terminal.exaggeration(arguments)
    address = viewer.spawn() if arguments.spawn else viewer.found(arguments.connect)
    folder = run_folder.create(arguments.out, mission.scenario.name)
    try:
        done = run_folder.fly(folder, mission, viewer=address, exaggeration=factor, flown=_fly)
    except OSError as error:
        notes = getattr(error, "__notes__", ())
        text = f"spacecraft-sim: {folder} cannot be written to its end: {error}"
        print("\n".join([text, *notes]), file=sys.stderr)
        return BROKEN
    except Exception:
        traceback.print_exc()
        print(f"spacecraft-sim: the run crashed; what it wrote is in {folder}", file=sys.stderr)
        return BROKEN
    for trouble in filter(None, (done.lost_viewer, done.lost_file)):
        print(f"spacecraft-sim: {trouble}", file=sys.stderr)
    if (comparison := done.comparison) is None:
        reasons = [flight.meta.get("diverged") for flight in (done.measured, done.predicted)]
        text = "\n".join(filter(None, reasons))
        print(f"spacecraft-sim: {text}\nrecorded so far: {folder}", file=sys.stderr)
        return BROKEN
    console = terminal.console()
    console.print(_verdict_table(comparison, console.width))
    for line in _failed_assumptions(comparison):
        console.print(line, style="red", highlight=False)
    console.print(_difference_line(comparison))
    console.print(f"{folder}: " + ", ".join(sorted(p.name for p in folder.iterdir())))
    if done.lost_file:
        return BROKEN
    console.print(f"open the recording:  rerun {folder / 'recording.rrd'}", highlight=False)
    return HOLDS if all(verdict.holds for verdict in comparison.verdicts) else FAILS


def _fly(
    mission: "Mission",
    plant: "PlantName",
    watch: "Callable[[Trajectory], None] | None" = None,
) -> "Trajectory":
    """Flies one plant with a progress line, if a person is watching."""
    console = Console(stderr=True)
    if not console.is_terminal:
        return mission.fly(plant, watch=watch)
    columns = (
        TextColumn("{task.description:>8}"),
        TextColumn("{task.completed:8.1f} of {task.total:.1f} s simulated"),
        TextColumn("{task.fields[factor]:6.0f} x real time"),
        TimeRemainingColumn(),
    )
    with Progress(*columns, console=console, transient=True) as progress:
        task = progress.add_task(plant, total=mission.scenario.duration, factor=0.0)
        started = progress.get_time()

        def show(time: float) -> None:
            elapsed = max(progress.get_time() - started, 1e-9)
            progress.update(task, completed=time, factor=time / elapsed)

        return mission.fly(plant, progress=show, watch=watch)


def _verdict_table(comparison: "Comparison", width: int) -> Table:
    """The verdicts; sources only where the terminal is wide enough for them, in characters."""
    table = Table("", "claim", title="MuJoCo", box=None, pad_edge=False)
    for head in ("predicted", "measured", "bound", "margin"):  # no digit is left out
        table.add_column(head, no_wrap=True)
    if sourced := width >= SOURCED:
        table.add_column("source")
    for verdict in comparison.verdicts:
        mark = f"[{'green' if verdict.holds else 'red'}]{verdict.outcome}[/]"
        sign = "+-" if verdict.kind == "within" else "  "
        table.add_row(
            mark,
            verdict.claim,
            _figure(verdict.predicted),
            _figure(verdict.measured),
            f"{sign}{_figure(verdict.bound)} {verdict.unit}",
            "" if math.isnan(verdict.margin) else f"{verdict.margin:.1%}",
            *([verdict.source] if sourced else []),
        )
    return table


def _failed_assumptions(comparison: "Comparison") -> Iterator[str]:
    """Each assumption that does not hold, once, with how many claims rest on it."""
    found = Counter(str(a) for verdict in comparison.verdicts for a in verdict.failed)
    for text, count in found.items():
        yield f"assumption fails: {text} ({count} claim{'s' * (count > 1)})"


def _difference_line(comparison: "Comparison") -> str:
    parts = []
    for kind in ("attitude", "quasi_rigid_angle", "quasi_rigid_rate"):  # of each the worst axis
        axes = [d for d in comparison.differences if d.signal.rpartition("_")[0] == kind]
        if axes:
            worst = max(axes, key=lambda d: d.max_error)
            parts.append(f"{worst.signal} {worst.max_error:.3g} {worst.unit}")
    if not parts:  # no such signals: the readings that differ most
        worst = sorted(comparison.differences, key=lambda d: -d.max_error)[:3]
        parts = [f"{d.signal} {d.max_error:.3g} {d.unit}" for d in worst]
    return "MuJoCo minus reduced model, at most: " + ", ".join(parts)


def _figure(value: float | None) -> str:
    return "" if value is None or math.isnan(value) else f"{value:.6g}"


if __name__ == "__main__":
    sys.exit(main())
