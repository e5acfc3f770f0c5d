"""Relay thrusters under Burkov's law (5.8) against the rules of their modulators, and the command.

Reference figures are of another implementation, from one start a row: the largest angle and rate in
the last 60 s of 180 s.  A limit cycle is not the same from another start; the rules are.
"""

import json
import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from spacecraft_sim import cli, library, margins, mission

PLANTS = ("burkov-body-vectors-free", "burkov-hub-two-booms")
# Modulation, period and minimum on-time, s; reference: angle, rad, and rate, rad/s, left on the
# free body, and with booms.
ROWS = {
    ("pwm", 0.1, 0.01): ((0.114, 0.018), (0.144, 0.018)),
    ("pwm", 0.1, 0.02): ((0.309, 0.038), (0.227, 0.039)),
    ("pwm", 0.1, 0.05): ((0.824, 0.081), (0.551, 0.077)),
    ("pwpf", 0.01, 0.02): ((0.123, 0.031), (0.129, 0.036)),
}


def slews(name, count):
    """Attitudes at rest 1.2 rad from the goal, about random axes, as rotation vectors."""
    ready = mission.assemble(mission.load_scenario(name))
    r2, r3 = ready.scenario.controller["r2"], ready.scenario.controller["r3"]
    goal = np.array([np.cross(r2, r3), r2, r3])  # R_wb R_i
    bus = ready.mujoco.model.ptr.body("bus")
    axes = Rotation.from_quat(bus.iquat, scalar_first=True).as_matrix()
    if "hub" in name:
        axes = np.eye(3)  # readings are in the hub's own axes there
    vectors = np.random.default_rng(3).normal(size=(count, 3))
    turns = 1.2 * vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
    return [
        Rotation.from_matrix(goal @ Rotation.from_rotvec(turn).as_matrix() @ axes.T).as_rotvec()
        for turn in turns
    ]


def pulsed(name, row, attitude):
    kind, period, least = row
    settings = (
        f"initial.attitude={attitude.tolist()}",
        "initial.rate=[0.0, 0.0, 0.0]",
        "duration=180.0",
        f"controller.period={period}",
        f'controller.modulation={{kind="{kind}"}}',
        f"thrusters.all={{proportional=false, levels=[1.5], min_on_time={least}}}",
    )
    return mission.assemble(mission.load_scenario(name, settings))


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANTS)
def test_what_pulses_leave_agrees_with_the_rules_as_the_reference_does(name):
    angles, rates = [], []
    for row, reference in ROWS.items():
        found = margins.relays([pulsed(name, row, start) for start in slews(name, 4)])
        dead_band, impulse = found[0].dead_band, found[0].impulse
        angle, rate = reference[PLANTS.index(name)]
        assert angle < 1.35 * dead_band
        assert rate < 1.2 * impulse  # its inertia is that of its own hub
        angles += [x.angle / dead_band for x in found]
        rates += [x.rate / impulse for x in found]
    # Of 64 flights from eight starts, 63 keep within 35 % of the dead band; the other one, at the
    # longest least pulse and at 0.9 rad, where the law pulls less than in proportion, has 54 %.
    assert np.mean(np.array(angles) < 1.35) > 0.9
    assert max(angles) < 1.6
    # Within 17 % of one least pulse are all of the free body; with booms, that swing along, 27 of
    # 32, and the others 28 % to 68 % above.
    assert np.mean(np.array(rates) < 1.17) >= (0.7 if "hub" in name else 1.0)
    assert max(rates) < 1.75
    # They are no loose bounds either: in the middle they are what is seen, as with the reference.
    assert np.median(angles) == pytest.approx(1.0, abs=0.35)
    assert np.median(rates) == pytest.approx(1.0, abs=0.35)


@pytest.mark.slow
def test_the_command_judges_relays_of_several_minimum_on_times(tmp_path, capsys):
    words = ["margins", "burkov-pwm", "--relay", "1.5", "--out", str(tmp_path / "out")]
    assert cli.main(words) == 0
    shown = capsys.readouterr().out
    assert "relays of 1.5 N m" in shown
    table = json.loads((tmp_path / "out" / "margins.json").read_text())
    assert table["margins"][0]["linear"] == pytest.approx(0.2197, rel=1e-3)  # of the smooth law
    rows = {(x["modulation"], x["min_on_time"]): x for x in table["relays"]}
    assert list(rows) == [
        ("pwm", 0.01),
        ("pwm", 0.02),
        ("pwm", 0.05),
        ("pwpf", 0.02),
        ("pwpf", 0.03),
    ]
    assert all(row["within"] for row in rows.values())
    assert rows["pwm", 0.02]["dead_band"] == pytest.approx(0.25)
    assert rows["pwpf", 0.02]["impulse"] == pytest.approx(1.5 * 0.02 / 0.9)
    assert len(table["saturation"]) == 5


@pytest.mark.slow
@pytest.mark.parametrize(
    "name", [n for n in library.scenario_names() if n.startswith("burkov-") and n != "burkov-path"]
)
def test_every_scenario_has_linear_margins(name, capsys):
    assert cli.main(["margins", name, "--linear"]) == 0
    lines = [line.split() for line in capsys.readouterr().out.splitlines() if " ms" in line]
    found = [float(line[line.index("ms") - 1]) for line in lines]
    assert len(found) in (2, 5)
    assert all(math.isfinite(x) and x > 0 for x in found)


def test_a_path_is_told_to_stand_still(capsys):
    assert cli.main(["margins", "burkov-path", "--linear"]) == 2
    said = capsys.readouterr().err
    assert "make its programme constant: controller.programme.amplitude=[0.0, 0.0]" in said
    words = ["controller.programme.amplitude=[0.0, 0.0]", "duration=12.0"]
    assert cli.main(["margins", "burkov-path", "--linear", "--set", *words]) == 0
