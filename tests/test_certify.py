"""The command `certify`: tables, files, exit codes."""

import json
import re
import subprocess
import sys

import numpy as np
import pytest

from spacecraft_sim import cli
from spacecraft_sim.spacecraft import load

slow = pytest.mark.slow


def certify(out, name, *words):
    return cli.main(["certify", str(name), "--out", str(out), *words])


@pytest.fixture(scope="module")
def light(tmp_path_factory):
    """(exit code, folder, what was printed) of a machine that is certified."""
    out = tmp_path_factory.mktemp("certificates") / "light"
    program = [sys.executable, "-m", "spacecraft_sim.cli", "certify", "two_boom_light"]
    done = subprocess.run(
        [*program, "--out", str(out), "--timestep", "0.01"], capture_output=True, text=True
    )
    assert done.stderr == ""
    return done.returncode, out, done.stdout


def test_a_machine_that_is_certified_ends_with_0(light):
    code, out, shown = light
    assert code == 0
    assert (out / "certificate.png").read_bytes().startswith(b"\x89PNG")
    lines = {line.strip().split("  ")[0]: line for line in shown.splitlines()}
    assert "0.1 N m" in lines["torque M0"]
    assert "0.03876604 N m" in lines["M_e, printed bound"]
    assert lines["e, disturbance over thrust"].split()[-3:] == ["0.256585", "0", "0.269969"]
    assert "(left_x)" in lines["A_m of the worst joint"]
    assert '0.0004356 rad = 89.85"' in lines["relay on the attitude: p0 u0 dwell^2"]
    alone = lines["thrust against M1 alone, Ivanova & Sokolov"]
    assert "vacuous: eps = 0.256585 must be < F = 0" in alone
    assert shown.startswith(
        'guaranteed about x 93.25", y 36.71", z 102.4" (relay on the attitude); every assumption'
    )
    assert shown.count("|theta| at most") == 2
    assert "small motion: deflection of" in shown
    assert "slow rotation: rate over the slowest decay: 0.01" in shown
    assert "x: e = 0.2566 < 1 - |F| = 1; by one mode: 2 mu/(1 - mu) = 0.0375 <" in shown
    assert "y: nothing elastic is felt" in shown


def test_the_json_says_all_of_it(light):
    found = json.loads((light[1] / "certificate.json").read_text(encoding="utf-8"))
    assert found["spacecraft"] == "two_boom_light"
    assert found["holds"] is True
    assert light[2].startswith(found["result"])
    assert [axis["axis"] for axis in found["axes"]] == ["x", "y", "z"]
    x, y, _ = found["axes"]
    parts = ("contour", "sampling", "coupling", "lean")
    assert x["attitude"]["total"] == pytest.approx(sum(x["attitude"][p] for p in parts), rel=1e-15)
    assert x["quasi_rigid"]["lean"] > 0 == x["attitude"]["lean"]
    assert x["others"] == {"thrust against M1 alone, Ivanova & Sokolov": None}  # infinite
    assert x["remedy"] is None
    assert all(a["holds"] and a["value"] < a["limit"] for a in x["assumptions"])
    assert y["curves"]["worst_case"] == []
    for axis in (x, found["axes"][2]):
        curves = {name: np.array(axis["curves"][name]) for name in ("bound", "worst_case")}
        measured = {dwell: peak for dwell, peak, small in axis["curves"]["measured"] if small}
        worst = dict(curves["worst_case"].tolist())
        assert len(measured) >= 2
        assert max(dwell for dwell, *_ in axis["curves"]["measured"]) not in measured  # it spins up
        for dwell, peak in measured.items():
            # Small motion here: to 5 mrad, and steps of a quarter of a radian.
            assert peak == pytest.approx(worst[dwell], rel=3e-3)
        assert worst[2.0] == axis["exact_worst_case"]
        bound = np.interp(list(worst), *curves["bound"].T)
        # Between 81 points of a convex curve the chord is above it.
        assert np.all(np.array(list(worst.values())) <= bound)
        assert max(worst.values()) <= axis["moment_l1"]


def test_a_certificate_can_be_attacked(tmp_path, capsys):
    words = ("--attack", "12", "--torque", "0.02", "--dwell", "2.66")
    assert certify(tmp_path / "a", "two_boom_3d", *words) == 1  # vacuous on the attitude
    shown = capsys.readouterr().out
    attacks = json.loads((tmp_path / "a" / "certificate.json").read_text())["attacks"]
    assert set(attacks) == {"x", "z"}  # nothing elastic is felt about y
    for axis, verdict in attacks.items():
        assert 0.05 * verdict["bound"] < verdict["measured"] < verdict["bound"]
        assert verdict["word"] == "holds" or verdict["word"].startswith("not guaranteed: slow")
        assert f"{axis}: the worst of 12 flights reaches {verdict['measured']:.6g} N m" in shown
    assert certify(tmp_path / "b", "two_boom_3d", "--attack", "-3") == 2
    assert "evaluations = -3 must be >= 1" in capsys.readouterr().err
    assert not (tmp_path / "b").exists()


def test_the_page_is_written_as_it_is_printed(light):
    _, out, shown = light
    page = (out / "certificate.md").read_text(encoding="utf-8")
    assert f"**{shown.splitlines()[0]}**" in page
    table = [line for line in page.splitlines() if line.startswith("| ")]
    assert all(len(re.findall(r"(?<!\\)\|", line)) == 5 for line in table)
    assert sum("theta" in line for line in table) == 2
    for heading in ("symbols", "axis by axis", "assumptions"):
        assert f"## {heading}" in page
    assert "## attacked" not in page  # it was not


@slow
def test_a_machine_that_is_not_ends_with_1_and_says_what_would_help(tmp_path, capsys):
    assert certify(tmp_path / "out", "two_boom_3d") == 1
    shown = capsys.readouterr().out
    assert "x: vacuous on the attitude; e = 20.74 >= 1 - |F| = 1" in shown
    assert "a dwell above 100.8 s, or 44.7 times the damping, or elastic masses times 0.18" in shown
    assert shown.startswith("not certified: about x and z nothing is guaranteed because the dist")
    assert "x: sampling period and delay within the dwell: 0.12 <= 2.66 s" in shown
    found = json.loads((tmp_path / "out" / "certificate.json").read_text(encoding="utf-8"))
    assert found["holds"] is False
    assert found["axes"][0]["attitude"]["total"] is None
    assert found["axes"][0]["quasi_rigid"]["total"] == pytest.approx(8.76e-4, abs=5e-7)
    # The reference, at 2.66 s.
    assert found["axes"][0]["moment"] == pytest.approx(0.4176906346, rel=1e-9)


@slow
def test_any_file_will_do_with_torque_and_dwell(tmp_path, capsys):
    path = load("two_boom_light").xml.with_name("two_boom_light.xml")
    words = ("--torque", "0.1", "--dwell", "2", "2", "2", "--disturbance", "0.01", "0", "-0.01")
    assert certify(tmp_path / "out", path, *words) == 0
    shown = capsys.readouterr().out
    assert "MJCF file two_boom_light.xml" in shown
    lines = {line.strip().split("  ")[0]: line.split() for line in shown.splitlines()}
    assert lines["constant disturbance F = M1/M0"][-3:] == ["0.1", "0", "-0.1"]
