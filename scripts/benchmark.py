"""Prints what a flight costs, as ratios taken in one run: medians of several interleaved rounds.

Times of one machine say little; the ratios carry over.
"""

import argparse
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import mujoco
import numpy as np

from spacecraft_sim import mission

FLAGSHIP = "efremov-nonlocal"


def seconds(action: Callable[[], object]) -> float:
    """Returns the wall time of one call, s."""
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def controlled_step(span: float, rounds: int) -> None:
    """Prints `Environment.step` with the law closed over a bare C loop of `mj_step`."""
    flagship = mission.assemble(mission.load_scenario(FLAGSHIP))
    environment, model = flagship.environment(), flagship.mujoco.model.ptr
    action = np.zeros(environment.action_spec().shape)
    data, dt = mujoco.MjData(model), model.opt.timestep
    controls = round(span / environment.control_timestep())
    bare_steps = round(span / dt)
    environment.reset()
    for phase, skip in (("attraction", 0.0), ("relay", 50.0)):
        while environment.physics.time() < skip:
            environment.step(action)
        ratios, bare = [], []
        for _ in range(rounds):
            bare.append(seconds(lambda: mujoco.mj_step(model, data, bare_steps)))
            flown = seconds(lambda: [environment.step(action) for _ in range(controls)])
            ratios.append(flown / bare[-1])
        print(
            f"controlled step / bare mj_step, {phase}: {statistics.median(ratios):.2f}"
            f"  ({min(ratios):.2f} to {max(ratios):.2f};"
            f" bare {statistics.median(bare) / bare_steps * 1e6:.1f} us)"
        )


def whole_run(rounds: int, duration: float) -> None:
    """Prints simulated over elapsed time of the command that users run, recording included."""
    factors = []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "spacecraft_sim.cli", "run", FLAGSHIP]
            command += ["--out", str(Path(folder) / "run"), "--set", f"duration={duration}"]
            elapsed = seconds(lambda c=command: subprocess.run(c, stdout=subprocess.DEVNULL))
            factors.append(duration / elapsed)
    print(
        f"whole run of {FLAGSHIP}: {statistics.median(factors):.0f} x real time"
        f"  ({min(factors):.0f} to {max(factors):.0f})"
    )


def main(argv: list[str] | None = None) -> int:
    """Runs the benchmarks.

    Args:
        argv: Words of the command line; those of the process if left out.
    """
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounds", type=int, default=7, help="interleaved rounds")
    parser.add_argument("--span", type=float, default=5.0, help="simulated time of a round, s")
    parser.add_argument("--duration", type=float, default=448.8, help="of the whole run, s")
    arguments = parser.parse_args(argv)
    controlled_step(arguments.span, arguments.rounds)
    whole_run(min(arguments.rounds, 3), arguments.duration)
    return 0


if __name__ == "__main__":
    sys.exit(main())
