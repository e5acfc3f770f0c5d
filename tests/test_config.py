"""Tables in and out: nothing is lost, every fault is named, at once and with its path."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from spacecraft_sim import checks, config
from spacecraft_sim.config import Model, quantity


class Part(Model):
    length: float = quantity("length", "m", gt=0)
    turns: int = quantity("turns", "", 1, ge=1)


class Whole(Model):
    name: str = quantity("name")
    spare: Part = quantity("a table", "", Part(length=1.0))
    parts: tuple[Part, ...] = quantity("a list of tables", "", ())
    named: dict[str, Part] = quantity("tables by name", "", {})
    maybe: Part | None = quantity("a table or nothing", "", None)


scalars = st.booleans() | st.integers(-(2**53), 2**53) | st.floats(allow_nan=False) | st.text()
keys = st.text(min_size=1, max_size=5)
tables = st.dictionaries(
    keys,
    st.recursive(scalars, lambda x: st.lists(x) | st.dictionaries(keys, x), max_leaves=5),
    max_size=4,
)


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """One file for all examples: a folder for each took seconds."""
    return tmp_path_factory.mktemp("toml") / "table.toml"


@settings(max_examples=30)
@given(table=tables)
def test_table_survives_the_file_to_the_last_bit(table, path):
    path.write_text(config.dumps(table), encoding="utf-8", newline="\n")
    assert config.read(path) == table


def test_missing_file_is_refused_by_its_path(tmp_path):
    with pytest.raises(ValueError, match=r"none\.toml: No such file"):
        config.read(tmp_path / "none.toml")


@pytest.mark.parametrize("content", [b"length = = 1", b'name = "\xff"'])
def test_file_that_is_not_toml_is_refused_by_its_path(content, tmp_path):
    path = tmp_path / "broken.toml"
    path.write_bytes(content)
    with pytest.raises(ValueError, match=r"broken\.toml: not TOML: "):
        config.read(path)


@pytest.mark.parametrize(
    ("assignment", "expected"),
    [
        ("a.b=3", {"a": {"b": 3}, "name": "x"}),
        ("a.c.d = [1, 2]", {"a": {"b": 1.5, "c": {"d": [1, 2]}}, "name": "x"}),
        ("name=gauss_jacobi", {"a": {"b": 1.5}, "name": "gauss_jacobi"}),
        ('name="a=b"', {"a": {"b": 1.5}, "name": "a=b"}),
        ("name=true", {"a": {"b": 1.5}, "name": True}),
    ],
)
def test_assignment_changes_one_key_of_a_copy(assignment, expected):
    table = {"a": {"b": 1.5}, "name": "x"}
    assert config.override(table, (assignment,)) == expected
    assert table == {"a": {"b": 1.5}, "name": "x"}


def test_later_assignments_win():
    assert config.override({}, ("a=1", "b.c=2", "a=3")) == {"a": 3, "b": {"c": 2}}


@pytest.mark.parametrize("assignment", ["duration", "=3", " =3"])
def test_assignment_without_key_or_value_is_refused(assignment):
    with pytest.raises(ValueError, match="write key=value"):
        config.override({}, (assignment,))


def test_assignment_through_a_value_is_refused():
    with pytest.raises(ValueError, match=r"'a\.b=1': 'a' is a value, not a table"):
        config.override({"a": 2.0}, ("a.b=1",))


def test_valid_table_has_no_faults():
    table = {"name": "x", "parts": [{"length": 2.0}]}
    assert config.faults(Whole, table) == []
    assert config.validate(Whole, table, where="here").parts[0] == Part(length=2.0)


@pytest.mark.parametrize(
    ("table", "fault"),
    [
        ({}, "  name: Field required"),
        ({"nane": "x", "name": "x"}, "  nane: unknown key; did you mean 'name'?"),
        (
            {"name": "x", "zzz": 1},
            "  zzz: unknown key; there are: name, spare, parts, named, maybe",
        ),
        (
            {"name": "x", "spare": {"lenght": 1, "length": 1}},
            "  spare.lenght: unknown key; did you mean 'length'?",
        ),
        (
            {"name": "x", "parts": [{"length": 1}, {"length": 1, "turn": 1}]},
            "  parts.1.turn: unknown key; did you mean 'turns'?",
        ),
        (
            {"name": "x", "named": {"left": {"length": 1, "turn": 1}}},
            "  named.left.turn: unknown key; did you mean 'turns'?",
        ),
        (
            {"name": "x", "maybe": {"length": 1, "turn": 1}},
            "  maybe.turn: unknown key; did you mean 'turns'?",
        ),
        (
            {"name": "x", "spare": {"length": 0.0}},
            "  spare.length: Input should be greater than 0, got 0.0",
        ),
        (
            {"name": "x", "spare": {"length": -2.0}},
            "  spare.length: Input should be greater than 0, got -2.0",
        ),
        (
            {"name": "x", "spare": {"length": math.inf}},
            "  spare.length: Input should be a finite number, got inf",
        ),
        (
            {"name": "x", "spare": {"length": "long"}},
            "  spare.length: Input should be a valid number, unable to parse string as a number,"
            " got 'long'",
        ),
    ],
)
def test_fault_is_one_line_with_path_limit_and_value(table, fault):
    assert config.faults(Whole, table) == [fault]


def test_all_faults_are_named_at_once_under_the_name_of_the_file():
    table = {"spare": {"length": math.nan, "turns": 0}, "prats": []}
    with pytest.raises(ValueError, match=r"file\.toml:") as error:
        config.validate(Whole, table, where="file.toml")
    first, *lines = str(error.value).splitlines()
    assert first == "file.toml:"
    assert sorted(line.split(":")[0].strip() for line in lines) == [
        "name", "prats", "spare.length", "spare.turns",
    ]  # fmt: skip


def test_prefix_places_a_table_in_a_larger_one():
    assert config.faults(Part, {}, prefix="booms.0.") == ["  booms.0.length: Field required"]


def test_unit_is_declared_with_the_field():
    assert config.unit_of(Part.model_fields["length"]) == "m"
    assert config.unit_of(Part.model_fields["turns"]) == ""


@pytest.mark.parametrize("bad", [0.0, -1.0, math.nan, math.inf, -math.inf])
def test_positive_names_each_value_at_fault_and_no_other(bad):
    with pytest.raises(ValueError, match="must be finite and > 0: b = ") as error:
        checks.positive(a=1.0, b=bad)
    assert "a = " not in str(error.value)


def test_zero_is_positive_only_where_it_is_allowed():
    checks.positive(zero=True, a=0.0)
    with pytest.raises(ValueError, match=r"must be finite and >= 0: a = -0\.5"):
        checks.positive(zero=True, a=-0.5)


def test_unknown_name_is_answered_with_the_nearest_and_all_choices():
    message = checks.choices("sensor", "yawrate", ["yaw_rate", "attitude"], where="two_boom")
    assert message == (
        "sensor 'yawrate' is not in two_boom; did you mean 'yaw_rate'? it has: attitude, yaw_rate"
    )
    assert checks.choices("sensor", "q", [], where="two_boom").endswith("it has: none")
