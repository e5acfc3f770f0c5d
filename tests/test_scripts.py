"""Every script runs without a display, and every shipped scenario assembles and explains itself."""

import importlib.util
import subprocess
import sys
from pathlib import Path

import pytest

from controllers import REGISTRY
from spacecraft_sim import cli, library, mission

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "scripts"
SCRIPTS = [p for p in sorted(FOLDER.glob("*.py")) if "def main(" in p.read_text(encoding="utf-8")]
# Small arguments, by script; a script that is not here is run as it stands.
ARGUMENTS = {
    "benchmark": ["--rounds", "1", "--span", "0.2", "--duration", "2.0"],
    "manoeuvres": ["--short", "--out", "manoeuvres.png"],
    "regulators": ["--short", "--duration", "20.0"],
    "gallery": ["efremov-local", "--duration", "2.0", "--out", "gallery"],
    "reproduce": ["efremov", "--duration", "5.0", "--out", "figures"],
}


@pytest.fixture(autouse=True)
def beside_the_scripts(monkeypatch):
    """As when Python runs a script: its neighbours can be imported."""
    monkeypatch.syspath_prepend(FOLDER)


def loaded(path):
    spec = importlib.util.spec_from_file_location(f"script_{path.stem}", path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.slow
@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_scripts_run_with_small_arguments(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("DISPLAY", raising=False)
    assert loaded(path).main(ARGUMENTS.get(path.stem, [])) in (0, None)
    assert capsys.readouterr().out.strip()


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_scripts_say_what_they_do(path, capsys):
    with pytest.raises(SystemExit) as end:
        loaded(path).main(["--help"])
    assert end.value.code == 0
    assert "usage:" in capsys.readouterr().out


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_scripts_are_guarded_and_refuse_what_they_do_not_know(path):
    done = subprocess.run(
        [sys.executable, str(path), "--no-such-option"], capture_output=True, text=True
    )
    assert done.returncode == 2
    assert "usage:" in done.stderr


def test_there_are_scripts_and_scenarios():
    assert "benchmark" in [path.stem for path in SCRIPTS]
    assert "efremov-nonlocal" in library.scenario_names()


@pytest.mark.parametrize("name", library.scenario_names())
def test_shipped_scenarios_assemble(name):
    ready = mission.assemble(mission.load_scenario(name))
    assert ready.scenario.name == name
    assert ready.scenario.title
    assert ready.scenario.description.strip()
    assert ready.guarantees
    for guarantee in ready.guarantees:
        # What a shipped design rests on holds; only a flight can decide the rest.
        assert [str(a) for a in guarantee.assumptions if not a.holds] == []


@pytest.mark.parametrize("name", library.scenario_names())
def test_shipped_scenarios_explain_themselves(name, capsys):
    assert cli.main(["explain", name]) == 0
    shown = capsys.readouterr().out
    ready = mission.assemble(mission.load_scenario(name))
    assert ready.scenario.title in shown
    for heading in ("scenario", "spacecraft", "law", "what theory predicts"):
        assert heading in shown
    for guarantee in ready.guarantees:
        assert guarantee.claim in shown
    # Every parameter of the law is listed with a description of its own.
    for parameter in mission.parameters_of(REGISTRY[ready.scenario.controller["law"]]):
        start = f"controller.{parameter} "
        (line,) = [x for x in shown.splitlines() if x.strip().startswith(start)]
        assert len(line.split()) > 4, parameter
