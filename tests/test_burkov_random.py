"""Burkov (1998): random starts with limited torques, with k2 = k3, and on paths of seven links."""

import math
from dataclasses import replace

import burkov_cases as cases
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from controllers import burkov
from controllers.programmes import Harmonic
from spacecraft_sim import equations, mission, spacecraft
from spacecraft_sim.smooth_flight import fly, fly_continuous

BODY = cases.BODY


def random_states(count, seed):
    random = np.random.default_rng(seed)
    return BODY.state(
        rate=random.uniform(-1, 1, (count, 3)),
        attitude=Rotation.random(count, random_state=seed).as_matrix(),
    )


def distances(law, run):
    return np.linalg.norm(cases.named(run, law.sensors) - np.ravel(law.formula.r), axis=1)


# Largest torque about each axis, N m; length of the flight and median settling time known, s.
CLIPS = [(0.05, 200.0, 81.6), (0.2, 80.0, 22.5), (0.5, 60.0, 13.1), (1.0, 60.0, 10.0),
         (math.inf, 60.0, 9.5)]  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize(("clip", "duration", "median"), CLIPS)
def test_limited_torques_turn_the_body_more_slowly(clip, duration, median):
    law, _ = cases.vectors(rated=False, period=2e-2)
    runs = fly(
        BODY, law, starts=random_states(6, 21), duration=duration, limits=(clip,) * 3,
        tolerance=1e-8,
    )  # fmt: skip
    settled = []
    for run in runs:
        distance = distances(law, run)
        assert distance[-1] < 1e-9
        settled.append(run.time[np.flatnonzero(distance > 0.01)[-1]])
    # Six other starts: their settling times are scattered by half of the median.
    assert np.median(settled) == pytest.approx(median, rel=0.3)


@pytest.mark.slow
def test_equal_stiffnesses_still_attract():
    """k2 /= k3 isolates the other equilibria; that the goal attracts does not rest on it."""
    law, _ = cases.vectors(rated=False, period=2e-2)
    law = replace(law, formula=replace(law.formula, k=(1.5, 1.5)))
    for run in fly(BODY, law, starts=random_states(12, 5), duration=40.0, every=50, tolerance=1e-8):
        assert distances(law, run)[-1] < 1e-5  # e^-15 of the slowest pole, near -0.4


# -- a path of seven links ---------------------------------------------------------------------

SEVEN = range(1, 8)
SWAYING = Harmonic(
    mean=(0.3,) * 7,
    amplitude=(0.2,) * 7,
    frequency=tuple(np.linspace(1, 2, 7).tolist()),
    phase=tuple(map(float, range(7))),
)


def seven_gains():
    """Those of the shipped law at a position, over gamma = 50 and nu = 30."""
    held = mission.load_scenario("burkov-position-7r").controller
    K1, K2, K3 = (np.array(held[name]) for name in ("K1", "K2", "K3"))
    gains = {"K0": K1 / 50, "K1": K2 / 1500, "K3": K3 / 30, "K4": np.ones(7)}
    return {name: tuple(x.tolist()) for name, x in gains.items()}


def off_the_path(count):
    motion, random = SWAYING(0.0), np.random.default_rng(7)
    return [np.r_[motion.q, motion.v] + random.uniform(-0.5, 0.5, 14) for _ in range(count)]


@pytest.mark.slow
def test_seven_links_reach_their_path_in_continuous_time():
    arm = equations.dynamics_of(spacecraft.load("arm7"))
    law, _ = burkov.path(arm, programme=SWAYING, gamma=50.0, nu=30.0, **seven_gains())
    for start in off_the_path(3):
        run = fly_continuous(arm, law, start=start, times=np.array([0.0, 10.0]))
        end = [run[f"joint_{k}"][-1] for k in SEVEN]
        assert np.linalg.norm(start[:7] - SWAYING(0.0).q) > 0.5
        # e^-14.6 of the slowest frozen pole, -1.466, is 4e-7.
        assert math.dist(end, SWAYING(10.0).q) < 1e-6


@pytest.mark.slow
def test_seven_links_reach_their_path_on_mujoco():
    programme = {name: list(getattr(SWAYING, name)) for name in SWAYING.__slots__}
    table = {"law": "burkov_path", "programme": programme, "gamma": 50.0, "nu": 30.0}
    scenario = mission.load_scenario("burkov-position-7r", ("duration=15.0",))
    scenario = scenario.model_copy(update={"controller": {**table, **seven_gains()}})
    for start in off_the_path(3):
        joints = {f"joint_{k}": float(start[k - 1]) for k in SEVEN}
        rates = {f"joint_{k}": float(start[6 + k]) for k in SEVEN}
        initial = scenario.initial.model_validate({"joints": joints, "joint_rates": rates})
        flown = mission.assemble(scenario.model_copy(update={"initial": initial}))
        (claim,) = flown.guarantees
        verdict = claim.check(flown.fly())
        assert verdict.holds
        assert verdict.measured < 2e-3  # what a torque of the path leaves that is held for 1 ms
