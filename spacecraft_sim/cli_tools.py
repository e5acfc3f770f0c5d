"""Commands beside the flight itself: compare, repair, margins, certify, export, video, doctor."""

import argparse
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich.console import Console
from rich.markup import escape
from rich.progress import MofNCompleteColumn, Progress, TextColumn
from rich.table import Table

from spacecraft_sim import terminal
from spacecraft_sim.terminal import FAILS, HOLDS
from spacecraft_sim.versions import require_supported_mujoco

if TYPE_CHECKING:
    from spacecraft_sim.margins import Relay, Saturation
    from spacecraft_sim.mission import Mission
    from spacecraft_sim.scenario import Scenario

# -- compare ---------------------------------------------------------------------------------------


def compare(arguments: argparse.Namespace) -> int:
    """Puts two runs in one recording, one figure and one table.

    Args:
        arguments: Words of the command.

    Returns:
        The exit code.
    """
    require_supported_mujoco()
    from spacecraft_sim import pair_folder, run_folder, run_pair

    factor = terminal.exaggeration(arguments)
    a, b = arguments.a, arguments.b
    compared = run_pair.pair(run_pair.read(a), run_pair.read(b))
    name = f"{a.resolve().name}-and-{b.resolve().name}"
    folder = run_folder.create(arguments.out, name)
    pair_folder.write(folder, compared, factor)
    heads = "\n".join(f"{x}: {escape(str(run))}" for x, run in (("A", a), ("B", b)))
    table = Table("", "A", "B", "B - A", box=None, title=heads, title_justify="left")
    for heading, rows in run_pair.table(compared):
        table.add_row(f"[bold]{heading}[/]")
        for what, *values in rows:
            table.add_row(f"  {escape(what)}", *values)
    console = terminal.console()
    console.print(table)
    console.print(f"{folder}: " + ", ".join(sorted(p.name for p in folder.iterdir())))
    console.print(f"open the recording:  rerun {folder / 'recording.rrd'}", highlight=False)
    return HOLDS


# -- repair ----------------------------------------------------------------------------------------


def repair(arguments: argparse.Namespace) -> int:
    """Makes a recording whole whose run was killed.

    Args:
        arguments: Words of the command.

    Returns:
        The exit code.
    """
    from spacecraft_sim import repair

    file = arguments.file / "recording.rrd" if arguments.file.is_dir() else arguments.file
    words = "repaired" if repair.repair(file) else "whole already"
    print(f"{file}: {words}; it reads up to t = {repair.end(file):.6g} s")
    return HOLDS


# -- margins ---------------------------------------------------------------------------------------


def margins(arguments: argparse.Namespace) -> int:
    """Says what delay, sampling period and torque limits a smooth law bears.

    Args:
        arguments: Words of the command.

    Returns:
        The exit code.
    """
    require_supported_mujoco()
    from controllers.modulation_claims import Pointing
    from spacecraft_sim import margins, run_folder
    from spacecraft_sim.mission import assemble, load_scenario

    def ready(*settings: str, pulsed: bool = False) -> "Mission":
        scenario = load_scenario(arguments.name, (*arguments.set, *settings))
        return assemble(scenario if pulsed else _unmodulated(scenario))

    scenario = load_scenario(arguments.name, tuple(arguments.set))
    torques = _UNPULSED if "modulation" in scenario.controller else ()
    mission = ready(*torques)
    settled = margins.settle(mission)
    found = margins.margins(settled, flown=not arguments.linear)
    table = Table("", "linear loop", "MuJoCo", title=scenario.title, box=None)
    for margin in found:
        table.add_row(margin.name, *map(_milliseconds, (margin.linear, margin.flown)))
    console = terminal.console()
    console.print(table)
    saturated, pulsed = (), ()
    if not arguments.linear:
        saturated = margins.saturation(
            mission, lambda limit: ready(*torques, f"thrusters.all.levels=[{limit!r}]")
        )
        console.print(_saturation_table(saturated))
    if not arguments.linear and isinstance(settled.law.formula, Pointing):
        trials = _relay_trials(arguments.relay)
        pulsed = margins.relays([ready(*trial, pulsed=True) for trial in trials])
        console.print(_relay_table(pulsed, arguments.relay))
    elif not arguments.linear:
        console.print(
            "relay thrusters: left out; what pulses leave is known of laws that turn a body to an "
            "attitude, as in burkov-body-vectors-free"
        )
    if arguments.out:
        folder = run_folder.create(arguments.out, scenario.name)
        run_folder.write_margins(folder, scenario, found, saturated, pulsed)
        console.print(f"{folder / 'margins.json'}")
    return HOLDS


def _unmodulated(scenario: "Scenario") -> "Scenario":
    """The same flight with the torques of its law as they are."""
    table = {k: value for k, value in scenario.controller.items() if k != "modulation"}
    return scenario.model_copy(update={"controller": table})


_UNPULSED = ("thrusters.all.proportional=true", "thrusters.all.min_on_time=0.0")
# Ten samples of PWPF in a period of PWM; flights long enough for a limit cycle.
_RELAYS = {  # period and minimum on-times by modulation, s
    "pwm": (0.1, (0.01, 0.02, 0.05)),
    "pwpf": (0.01, (0.02, 0.03)),
}
_RELAY_DURATION = 360.0  # s


def _relay_trials(level: float) -> Iterator[tuple[str, ...]]:
    """Settings of flights with relay thrusters of one level, N m."""
    for kind, (period, on_times) in _RELAYS.items():
        for least in on_times:
            yield (
                f"duration={_RELAY_DURATION}",
                f"controller.period={period}",
                f'controller.modulation={{kind="{kind}"}}',
                f"thrusters.all={{proportional=false, levels=[{level!r}], min_on_time={least}}}",
            )


def _saturation_table(rows: "Sequence[Saturation]") -> Table:
    table = Table("torques up to", "settled after", "distance in the end", box=None)
    for row in rows:
        table.add_row(f"{row.limit:.5g} N m", f"{row.settling:.5g} s", f"{row.distance:.3g}")
    return table


def _relay_table(rows: "Sequence[Relay]", level: float) -> Table:
    """Angles and rates beside the rules of the modulators, and their shares of these."""
    table = Table(
        f"relays of {level:.5g} N m", "least pulse", "angle left", "dead band", "share",
        "rate left", "one pulse", "share", "firings", "within", box=None,
    )  # fmt: skip
    for row in rows:
        table.add_row(
            row.modulation.upper(),
            f"{1e3 * row.min_on_time:.5g} ms",
            f"{row.angle:.3g} rad",
            f"{row.dead_band:.3g} rad",
            f"{row.angle / row.dead_band:.2f}",
            f"{row.rate:.3g} rad/s",
            f"{row.impulse:.3g} rad/s",
            f"{row.rate / row.impulse:.2f}",
            f"{row.firings:.2g} 1/s",
            "yes" if row.within else "no",
        )
    return table


def _milliseconds(time: float) -> str:
    """Nothing for what was not sought or not found."""
    return "" if math.isnan(time) else f"{1e3 * time:.5g} ms"


# -- certify ---------------------------------------------------------------------------------------

# Options of one number for all axes or three, for x, y and z.
CERTIFIED = (
    ("torque", "N_m", "torque of the channels; that of the thrusters if left out"),
    ("dwell", "s", "least time between switchings; the minimum on-times if left out"),
    ("delay", "s", "longest delay of the thrust; that of the thrusters if left out"),
    ("disturbance", "N_m", "constant torques on the bus; none if left out"),
)


def certify(arguments: argparse.Namespace) -> int:
    """Certifies the pointing accuracy of a machine with elastic parts.

    Args:
        arguments: Words of the command.

    Returns:
        The exit code.
    """
    require_supported_mujoco()
    from controllers.contour import guaranteed_accuracy
    from spacecraft_sim import (
        attack_search,
        certificate_curves,
        certificate_input,
        certificate_report,
        run_folder,
    )
    from spacecraft_sim.certificate import certify as certified
    from spacecraft_sim.elastic_influence import influence
    from spacecraft_sim.elastic_mjcf import elastic_model, with_elastic_masses

    craft = certificate_input.read(
        arguments.name, torque=arguments.torque, dwell=arguments.dwell, delay=arguments.delay
    )
    elastic = elastic_model(craft.model)
    certificates = certified(
        elastic,
        torque=craft.torque,
        dwell=craft.dwell,
        disturbance=certificate_input.steady(arguments.disturbance),
        timestep=arguments.timestep,
        delay=craft.delay,
        regulators={"thrust against M1 alone, Ivanova & Sokolov": guaranteed_accuracy},
        lighter=lambda factor: elastic_model(with_elastic_masses(craft.model, factor)),
    )
    attacks = {}
    if arguments.attack:
        found = influence(elastic, torque=craft.torque, dwell=craft.dwell)
        attacks = attack_search.attack(craft.model, elastic, found, evaluations=arguments.attack)
    curves = certificate_curves.curves(craft.model, elastic, torque=craft.torque, dwell=craft.dwell)
    folder = run_folder.create(arguments.out, f"certificate-{craft.name}")
    page = certificate_report.page(craft, certificates, curves, attacks, arguments.attack)
    certificate_report.write(folder, craft, page, certificates, curves, attacks)
    console = terminal.console()
    mark = "bold green" if page.holds else "bold red"
    console.print(escape(page.result), style=mark, highlight=False)
    table = Table("", "x", "y", "z", title=page.title, box=None)
    for row in page.rows:
        table.add_row(
            *map(escape, row), style="bold" if row[0] == certificate_report.BOUND else None
        )
    console.print(table)
    for heading, lines in page.sections.items():
        if lines:
            console.print(f"[bold]{heading}[/]")
        for line in lines:
            console.print(escape(f"  {line}"), highlight=False)
    console.print(f"{folder}: " + ", ".join(sorted(p.name for p in folder.iterdir())))
    return HOLDS if page.holds else FAILS


# -- export ----------------------------------------------------------------------------------------


def export(arguments: argparse.Namespace) -> int:
    """Writes the complete MJCF of a spacecraft as one file.

    Args:
        arguments: Words of the command.

    Returns:
        The exit code.
    """
    require_supported_mujoco()
    from spacecraft_sim import config, library, mjcf, spacecraft

    name = arguments.name
    own = name.endswith(".toml") and "spacecraft" in config.read(Path(name))
    if own or name in library.scenario_names():
        from spacecraft_sim import mission

        scenario = mission.load_scenario(name)
        machine = spacecraft.load(scenario.spacecraft).with_parts(**scenario.changes())
    else:
        machine = spacecraft.load(name)
    if arguments.file.exists():
        raise ValueError(f"{arguments.file}: exists already; name a file that does not")
    try:
        mjcf.export(machine, arguments.file)
    except OSError as error:
        raise ValueError(f"{arguments.file}: cannot be written: {error.strerror}") from error
    terminal.console().print(f"{arguments.file}: {machine.title}")
    return HOLDS


# -- video, doctor ---------------------------------------------------------------------------------


def video(arguments: argparse.Namespace) -> int:
    """Renders the flight in the folder of a run, without a display.

    Args:
        arguments: Words of the command.

    Returns:
        The exit code.
    """
    from spacecraft_sim import video

    console = Console(stderr=True)
    columns = TextColumn("rendering"), MofNCompleteColumn(), TextColumn("frames")
    watched = console.is_terminal
    with Progress(*columns, console=console, transient=True, disable=not watched) as progress:
        task = progress.add_task("", total=None)
        written = video.write(
            arguments.folder,
            camera=arguments.camera,
            fps=arguments.fps,
            speed=arguments.speed,
            out=arguments.out,
            progress=lambda done, total: progress.update(task, completed=done, total=total),
        )
    terminal.console().print(f"{written}: {written.stat().st_size / 1e6:.2f} MB", highlight=False)
    return HOLDS


def doctor(arguments: argparse.Namespace) -> int:
    """Says what this machine can do, what is missing, and what to install.

    Args:
        arguments: Words of the command; there are none.

    Returns:
        The exit code.
    """
    from spacecraft_sim import doctor

    table = Table("", "what", "found", "to do", box=None, pad_edge=False, header_style="bold")
    marks = {"ok": "[green]ok[/]", "limited": "[yellow]limited[/]", "missing": "[red]missing[/]"}
    for check in doctor.checks():
        table.add_row(marks[check.state], check.subject, escape(check.found), escape(check.advice))
    terminal.console().print(table)
    return HOLDS
