"""What a recording costs: its share of a run, and its size."""

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

from support.flight_cost import FLAGSHIP, seconds, spread

HOUR, MEGABYTE = 3600.0, 1e6
# The command with everything but the recording.
WITHOUT = """
import sys
from spacecraft_sim import cli, record

class Nothing:
    lost_viewer = lost_file = None
    def __init__(self, *_): pass
    def __enter__(self): return self
    def __exit__(self, *_): pass
    def expect(self, beneath): pass
    def take(self, part): pass
    def conclude(self, verdicts): pass

record.Recording = Nothing
sys.exit(cli.main(sys.argv[1:]))
"""


def recording(*, duration: float, rounds: int, name: str = FLAGSHIP) -> None:
    """Prints what recording adds to the command that users run, and MB an hour of flight.

    Args:
        duration: Length of the flight, s.
        rounds: Interleaved rounds.
        name: The scenario.
    """
    shares, processor, sizes = [], [], []
    for k in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            words = ["run", name, "--set", f"duration={duration}", "--out"]
            commands = (
                ["-m", "spacecraft_sim.cli", *words, f"{folder}/with"],
                ["-c", WITHOUT, *words, f"{folder}/without"],
            )
            # The first of two is often the slower: they take turns.
            found = {c[-1]: _cost(c) for c in commands[:: -1 if k % 2 else 1]}
            (taken, used), (bare, least) = (found[c[-1]] for c in commands)
            shares.append((taken - bare) / taken)
            processor.append((used - least) / used)
            size = Path(folder, "with", "recording.rrd").stat().st_size
            sizes.append(size / MEGABYTE * HOUR / duration)
    print(f"recording / whole run of {name}, on {os.cpu_count()} cores: {spread(shares)}")
    print(f"recording / processor time of the run: {spread(processor)}")
    print(f"recording, MB an hour of simulated flight: {spread(sizes, 1)}")


def _cost(words: list[str]) -> tuple[float, float]:
    """Wall time and processor time of a Python program with all that it starts, s."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    command = [sys.executable, *words]
    taken = seconds(lambda: subprocess.run(command, stdout=subprocess.DEVNULL))
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return taken, sum(getattr(after, x) - getattr(before, x) for x in ("ru_utime", "ru_stime"))
