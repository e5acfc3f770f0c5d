"""controllers/ERRATA.md: every row has its proof, every proof its row, every run its papers."""

import re
from pathlib import Path

import pytest

import controllers
from spacecraft_sim import errata, library, mission

TEXT = Path(controllers.__file__ or "").with_name("ERRATA.md").read_text(encoding="utf-8")
TESTS = Path(__file__).parent
PAPERS = {  # of a scenario, by the first word of its name: whose errata its report gives
    "burkov": {"Burkov"},
    "efremov": {"Efremov, Polyakov, Strygin"},
    "gorelov": {"Gorelov", "Efremov, Polyakov, Strygin"},  # whose law may hold what is left
    "ivanova": {"Ivanova, Sokolov"},
    "sokolov": {"Sokolov", "Ivanova, Sokolov", "Efremov, Polyakov, Strygin"},
}


def rows(section):
    return [line.split(" | ") for line in section.text.splitlines() if re.match(r"\| \d", line)]


def test_every_proof_is_listed_and_every_listed_proof_exists():
    listed = set(re.findall(r"tests/(\w+)\.py::(\w+)", TEXT))
    files = {file for file, _ in listed} | {path.stem for path in TESTS.glob("test_*_errata.py")}
    proofs = {
        (file, name)
        for file in files
        for name in re.findall(
            r"^def (test_g?\d\w*)\(", (TESTS / f"{file}.py").read_text(encoding="utf-8"), re.M
        )
    }
    assert len(proofs) > 50
    assert listed == proofs


@pytest.mark.parametrize("section", errata.sections(TEXT), ids=lambda s: s.authors[0])
def test_every_row_is_numbered_and_says_how_it_is_proved(section):
    found = rows(section)
    assert [int(cells[0].strip("| ")) for cells in found] == list(range(1, len(found) + 1))
    for cells in found:
        assert len(cells) == 5
        assert "::test_" in cells[4] or "text" in cells[4]


@pytest.mark.parametrize("name", library.scenario_names())
def test_every_run_has_the_errata_of_its_papers(name):
    found = mission.assemble(mission.load_scenario(name)).errata
    assert {", ".join(section.authors) for section in found} == PAPERS[name.partition("-")[0]]
