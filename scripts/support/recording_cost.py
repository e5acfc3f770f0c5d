"""What a recording costs: its share of a run, and its size."""

import subprocess
import sys
import tempfile
from pathlib import Path

from spacecraft_sim import beneath, mission, record, run_folder
from support.flight_cost import FLAGSHIP, seconds, spread

HOUR, MEGABYTE = 3600.0, 1e6
# What a run loads for its other files is not put down to the recording.
START = """
from time import perf_counter
import pyarrow.parquet
from spacecraft_sim import cli, drawing, frames, mission, plots, report, run_folder
start = perf_counter()
from spacecraft_sim import record
print(perf_counter() - start)
"""


def recording(*, duration: float, rounds: int) -> None:
    """Prints what recording adds to the command that users run, and MB an hour of flight.

    Args:
        duration: Length of the flight, s.
        rounds: Interleaved rounds.
    """
    settings = (f"duration={duration}",)
    ready = mission.assemble(mission.load_scenario(FLAGSHIP, settings))
    added, shares, starts, sizes = [], [], [], []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            plain = seconds(lambda: (ready.fly("reduced"), ready.fly()))
            path = Path(folder) / "recording.rrd"
            recorded = seconds(lambda p=path: _record(ready, p))
            sizes.append(path.stat().st_size / MEGABYTE * HOUR / duration)
            command = [sys.executable, "-m", "spacecraft_sim.cli", "run", FLAGSHIP]
            command += ["--out", str(Path(folder) / "run"), "--set", *settings]
            whole = seconds(lambda c=command: subprocess.run(c, stdout=subprocess.DEVNULL))
            start = float(subprocess.check_output([sys.executable, "-c", START]))
            added.append((recorded - plain) / plain)
            shares.append((recorded - plain) / whole)
            starts.append(start / whole)
    print(f"recording / both flights: {spread(added)}")
    print(f"recording / whole run of {FLAGSHIP}: {spread(shares)}; starting rerun {spread(starts)}")
    print(f"recording, MB an hour of simulated flight: {spread(sizes, 1)}")


def _record(ready: mission.Mission, path: Path) -> None:
    subject = run_folder.subject(ready)
    with record.Recording(subject, path) as recording:
        recording.expect(beneath.reduced(subject, ready.fly("reduced")))
        ready.fly(watch=recording.take)
        recording.conclude(())
