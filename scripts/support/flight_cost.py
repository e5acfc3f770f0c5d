"""What a flight costs: a controlled step over a bare one, and the whole command."""

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
_STATE = int(mujoco.mjtState.mjSTATE_INTEGRATION)


def seconds(action: Callable[[], object]) -> float:
    """Returns the wall time of one call, s.

    Args:
        action: What to call.
    """
    start = time.perf_counter()
    action()
    return time.perf_counter() - start


def spread(values: list[float], digits: int = 2) -> str:
    """Returns median, least and largest of some values as text.

    Args:
        values: The values.
        digits: Decimals.
    """
    low, middle, high = min(values), statistics.median(values), max(values)
    return f"{middle:.{digits}f}  ({low:.{digits}f} to {high:.{digits}f})"


def controlled_step(*, span: float, rounds: int) -> None:
    """Prints `Environment.step` with the law closed over a bare C loop of `mj_step`.

    The bare loop starts each round from the state of the flight: from rest a step is a tenth
    cheaper, since MuJoCo skips what is zero.

    Args:
        span: Simulated time of a round, s.
        rounds: Interleaved rounds.
    """
    settings = ("simulation.timestep=0.01", "simulation.substeps=10")
    flagship = mission.assemble(mission.load_scenario(FLAGSHIP, settings))
    environment, model = flagship.environment(), flagship.mujoco.model.ptr
    action = np.zeros(environment.action_spec().shape)
    flown, data = flagship.mujoco.data.ptr, mujoco.MjData(model)
    state = np.zeros(mujoco.mj_stateSize(model, _STATE))
    steps = round(span / model.opt.timestep)
    controls = round(span / environment.control_timestep())
    environment.reset()
    for phase, start in (("attraction", 0.0), ("relay, 2 switchings in 0.83 s", 50.0)):
        while environment.physics.time() < start:
            environment.step(action)
        ratios, bare = [], []
        for _ in range(rounds):
            mujoco.mj_getState(model, flown, state, _STATE)
            mujoco.mj_setState(model, data, state, _STATE)
            bare.append(seconds(lambda: mujoco.mj_step(model, data, steps)))
            controlled = seconds(lambda: [environment.step(action) for _ in range(controls)])
            ratios.append(controlled / bare[-1])
        step = statistics.median(bare) / steps * 1e6
        print(f"controlled step / bare mj_step, {phase}: {spread(ratios)}; bare {step:.1f} us")


def whole_run(*, duration: float, rounds: int) -> None:
    """Prints simulated over elapsed time of the command that users run, recording included.

    Args:
        duration: Length of the flight, s.
        rounds: How often.
    """
    factors = []
    for _ in range(rounds):
        with tempfile.TemporaryDirectory() as folder:
            command = [sys.executable, "-m", "spacecraft_sim.cli", "run", FLAGSHIP]
            command += ["--out", str(Path(folder) / "run"), "--set", f"duration={duration}"]
            elapsed = seconds(lambda c=command: subprocess.run(c, stdout=subprocess.DEVNULL))
            factors.append(duration / elapsed)
    print(f"whole run of {FLAGSHIP}, x real time: {spread(factors, 0)}")
