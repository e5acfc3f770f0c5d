"""What the README shows runs as it stands there."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest

from spacecraft_sim import cli, library

TEXT = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")


def shown(language):
    """The one block of a language."""
    (block,) = re.findall(rf"```{language}\n(.*?)```", TEXT, re.DOTALL)
    return block


def test_a_controller_of_ones_own_flies(tmp_path):
    command = [sys.executable, "-c", shown("python")]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    angle, _, report = done.stdout.split()
    assert abs(float(angle)) < 0.01  # what it asks for
    assert (tmp_path / report).is_file()


def test_a_scenario_of_ones_own_flies(tmp_path, monkeypatch, capsys):
    path = tmp_path / "mine.toml"
    path.write_text(shown("toml"))
    monkeypatch.chdir(tmp_path)
    assert cli.main(["run", str(path), "--set", "duration=10.0"]) == 0
    assert "1 of 1" in (tmp_path / "runs" / "mine" / "report.html").read_text(encoding="utf-8")


@pytest.mark.parametrize(
    "line", re.findall(r"^    spacecraft-sim (.*?)(?:  +#.*)?$", TEXT, re.MULTILINE)
)
def test_commands_have_the_words_that_are_shown(line):
    arguments = cli._parser().parse_args(shlex.split(line))
    name = getattr(arguments, "name", None)
    known = {*library.scenario_names(), *library.spacecraft_names(), "machine.xml"}
    assert name is None or name in known
