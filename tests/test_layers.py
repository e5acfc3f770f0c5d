"""Who may import whom, what is documented, and what no file may contain."""

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parent.parent
SPACECRAFT_SIM = sorted((ROOT / "spacecraft_sim").rglob("*.py"))
CONTROLLERS = sorted((ROOT / "controllers").rglob("*.py"))
SCRIPTS = sorted((ROOT / "scripts").glob("*.py"))
TESTS = sorted((ROOT / "tests").glob("*.py"))
SOURCES = [*SPACECRAFT_SIM, *CONTROLLERS]


def short(path):
    return path.relative_to(ROOT).as_posix()


def every(paths):
    return pytest.mark.parametrize("path", paths, ids=short)


def imported(path):
    """Full dotted names of what a file imports, wherever in it."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{short(path)}: relative import"
            found |= {f"{node.module}.{alias.name}" for alias in node.names}
    return found


def imports(path, module):
    return any(name == module or name.startswith(f"{module}.") for name in imported(path))


ONLY_IN = {
    "mujoco": {
        "mjcf",
        "readings",
        "physics",
        "linearize",
        "drawing",
        "elastic_mjcf",
        "compiled_mechanism",
        "compiled_dynamics",
        "render",
        "elastic_flight",
    },
    "dm_control": {"physics", "reduced", "equations", "task", "simulate"},
    "rerun": {"recorder", "record_stream", "repair"},  # record_stream takes its types alone
    "matplotlib": {
        "plots",
        "plots_chart",
        "plots_film",
        "plots_law",
        "plots_smooth",
        "plots_table",
        "plots_pair",
        "plots_panel",
        "plots_certificate",
    },
    "controllers": {"mission", "cli", "cli_tools"},
}


@pytest.mark.parametrize("module", ONLY_IN)
def test_libraries_are_imported_only_where_they_belong(module):
    found = {short(path) for path in SPACECRAFT_SIM if imports(path, module)}
    allowed = {f"spacecraft_sim/{name}.py" for name in ONLY_IN[module]}
    assert found <= allowed
    assert found  # the rule speaks of something that is there


def test_the_reduced_model_takes_only_the_interface_of_dm_control():
    path = ROOT / "spacecraft_sim" / "reduced.py"
    assert {n for n in imported(path) if n.startswith("dm_control")} == {"dm_control.rl.control"}


@every(CONTROLLERS)
@pytest.mark.parametrize(
    "module",
    ["mujoco", "dm_control", "rerun", "matplotlib"]
    + [f"spacecraft_sim.{name}" for name in ("task", "simulate", "record", "physics", "mission")],
)
def test_controllers_know_no_simulator(path, module):
    assert not imports(path, module)


@every([*SOURCES, *SCRIPTS])
def test_no_test_library_in_what_is_shipped(path):
    assert not imports(path, "pytest")
    assert not imports(path, "tests")


COMMAND_LINE = ("cli.py", "cli_tools.py", "terminal.py")


@every([path for path in SOURCES if path.name not in COMMAND_LINE])
def test_only_the_command_line_prints(path):
    calls = [
        node.func.id
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    ]
    assert "print" not in calls
    assert not imports(path, "rich")


HEAVY = ("mujoco", "rerun", "scipy.optimize", "matplotlib")


@pytest.mark.parametrize("words", [["--help"], ["list"], ["run", "--help"]])
def test_help_and_list_load_nothing_heavy(words):
    program = f"""
import sys
from spacecraft_sim import cli
try:
    code = cli.main({words!r})
except SystemExit as end:
    code = end.code
loaded = [name for name in {HEAVY!r} if name in sys.modules]
print("loaded:", loaded, file=sys.stderr)
sys.exit(9 if loaded else code)
"""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()


# -- what files look like --------------------------------------------------------------------------


@every([*SOURCES, *SCRIPTS, *TESTS])
def test_no_file_is_longer_than_400_lines(path):
    assert len(path.read_text(encoding="utf-8").splitlines()) <= 400


@every(SCRIPTS)
def test_scripts_are_short_and_have_a_main(path):
    text = path.read_text(encoding="utf-8")
    assert len(text.splitlines()) < 80
    functions = [n for n in ast.parse(text).body if isinstance(n, ast.FunctionDef)]
    (main,) = [f for f in functions if f.name == "main"]
    assert [a.arg for a in main.args.args] == ["argv"]


def public_functions(path):
    """(qualified name, node) of functions and methods whose names have no underscore in front."""
    found = []

    def collect(body, prefix):
        for node in body:
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
                collect(node.body, f"{prefix}{node.name}.")
            elif isinstance(node, ast.FunctionDef) and not node.name.startswith("_"):
                found.append((f"{prefix}{node.name}", node))

    collect(ast.parse(path.read_text(encoding="utf-8")).body, "")
    return found


def documented_arguments(doc):
    """Names in the Args section of a Google docstring."""
    section = re.search(r"^Args:\n((?:    .*\n|\n)*)", inspect.cleandoc(doc) + "\n", re.MULTILINE)
    return set(re.findall(r"^    \*{0,2}(\w+):", section[1], re.MULTILINE)) if section else set()


def test_the_docstring_helper_reads_google_style():
    doc = "One.\n\n    Args:\n        a: First,\n            more: of it.\n        *b: Rest.\n\n"
    assert documented_arguments(doc + "    Raises:\n        E: c") == {"a", "b"}


@every([*SOURCES, *SCRIPTS])
def test_every_public_function_documents_each_argument(path):
    faults = []
    for name, node in public_functions(path):
        arguments = [*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs]
        arguments += [a for a in (node.args.vararg, node.args.kwarg) if a]
        wanted = {a.arg for a in arguments} - {"self", "cls"}
        wanted = {a for a in wanted if not a.startswith("_")}
        doc = ast.get_docstring(node)
        if not doc:
            faults.append(f"{name}: no docstring")
            continue
        if missing := wanted - documented_arguments(doc):
            faults.append(f"{name}: {', '.join(sorted(missing))}")
        if strange := documented_arguments(doc) - wanted:
            faults.append(f"{name}: documents {', '.join(sorted(strange))}, which it has not")
    assert faults == []


@every([*SOURCES, *SCRIPTS, *TESTS])
def test_every_module_says_what_it_is(path):
    assert ast.get_docstring(ast.parse(path.read_text(encoding="utf-8")))


def tracked():
    """Text files under version control, or, in an unpacked archive, all that lie here."""
    done = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if done.returncode == 0:
        names = done.stdout.splitlines()
    else:
        hidden = [p for p in ROOT.rglob("*") if p.is_file() and ".venv" not in p.parts]
        names = [short(p) for p in hidden if p.suffix in (".py", ".toml", ".md", ".xml", ".txt")]
    return [ROOT / name for name in names if not name.endswith((".png", ".gif"))]


# Spelt in pieces, so that this file does not find itself.
MACHINE_PATHS = re.compile("/(ho" + "me|ro" + "ot|wo" + "rk|Us" + "ers)/")
REGISTRIES = re.compile(r"index-" + r"url|trusted-" + r"host|pypi" + r"\.org|python" + "hosted")


@pytest.mark.parametrize("pattern", [MACHINE_PATHS, REGISTRIES], ids=["paths", "registries"])
def test_tracked_files_name_no_machine(pattern):
    files = [path for path in tracked() if path.exists()]
    assert len(files) > 20
    found = []
    for path in files:
        lines = path.read_text(encoding="utf-8").splitlines()
        found += [f"{short(path)}:{k}" for k, line in enumerate(lines, 1) if pattern.search(line)]
    assert found == []
