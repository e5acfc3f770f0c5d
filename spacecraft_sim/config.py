"""TOML files in and out of validated models, with errors that name every fault at once."""

import difflib
import tomllib
from pathlib import Path
from typing import Any, TypeVar, get_args

import tomli_w
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from pydantic.fields import FieldInfo

Table = dict[str, Any]


class Model(BaseModel):
    """A frozen table: unknown keys are refused, arrays are tuples."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


ModelT = TypeVar("ModelT", bound=Model)


def quantity(description: str, unit: str = "", default: Any = ..., **limits: Any) -> Any:
    """Declares a field with its unit, so that the same line validates and explains.

    Args:
        description: What it is, a few words.
        unit: SI unit; empty for a pure number or a name.
        default: Value when the key is left out; `...` makes it required.
        **limits: pydantic's limits, such as `gt=0`.

    Returns:
        The pydantic field.
    """
    return Field(default, description=description, json_schema_extra={"unit": unit}, **limits)


def unit_of(field: FieldInfo) -> str:
    """Returns the unit that `quantity` declared.

    Args:
        field: A field of a model.
    """
    extra = field.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def read(path: Path) -> Table:
    """Reads a TOML file.

    Args:
        path: The file.

    Raises:
        ValueError: If the file is missing or is not TOML; the message says where.
    """
    try:
        return tomllib.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise ValueError(f"{path}: {error.strerror}") from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ValueError(f"{path}: not TOML: {error}") from error


def dumps(table: Table) -> str:
    """Returns a table as TOML; floats keep every bit.

    Args:
        table: Plain data without None.
    """
    return tomli_w.dumps(table)


def override(table: Table, assignments: tuple[str, ...]) -> Table:
    """Applies `path.to.key=value` assignments.

    Args:
        table: The table to start from; it is left as it is.
        assignments: Each a dotted key, `=`, and a TOML value; a bare word counts as a string.

    Returns:
        A new table.

    Raises:
        ValueError: If an assignment has no `=` or reaches through a value that is not a table.
    """
    for assignment in assignments:
        key, equals, text = assignment.partition("=")
        if not equals or not key.strip():
            raise ValueError(f"--set {assignment!r}: write key=value, as in duration=100.0")
        try:
            value = tomllib.loads(f"value = {text}")["value"]
        except tomllib.TOMLDecodeError:
            value = text.strip()
        table = _assigned(table, key.strip().split("."), value, assignment)
    return table


def _assigned(table: Table, path: list[str], value: Any, assignment: str) -> Table:
    head, *rest = path
    if not rest:
        return {**table, head: value}
    inner = table.get(head, {})
    if not isinstance(inner, dict):
        raise ValueError(f"--set {assignment!r}: {head!r} is a value, not a table")
    return {**table, head: _assigned(inner, rest, value, assignment)}


def validate(model: type[ModelT], table: Table, *, where: str) -> ModelT:
    """Turns a table into its model.

    Args:
        model: The model.
        table: Plain data.
        where: What to call the table in an error, usually a path.

    Raises:
        ValueError: One line for each fault, with its path and, for an unknown key, the nearest one.
    """
    if found := faults(model, table):
        raise ValueError("\n".join([f"{where}:", *found]))
    return model.model_validate(table)


def faults(model: type[Model], table: Table, *, prefix: str = "") -> list[str]:
    """Returns one line for each fault of a table, none if it is valid.

    Args:
        model: The model.
        table: Plain data.
        prefix: Path of the table in a larger one, with its dot.
    """
    try:
        model.model_validate(table)
    except ValidationError as error:
        return [_fault(model, fault, prefix) for fault in error.errors()]
    return []


def _fault(model: type[BaseModel], fault: Any, prefix: str) -> str:
    path = prefix + ".".join(str(part) for part in fault["loc"])
    if fault["type"] == "extra_forbidden":
        known = _keys(model, fault["loc"][:-1])
        near = difflib.get_close_matches(str(fault["loc"][-1]), known, n=1)
        hint = f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(known)}"
        return f"  {path}: unknown key; {hint}"
    message = fault["msg"].removeprefix("Value error, ")
    value = "" if fault["type"] == "missing" else f", got {fault['input']!r}"
    return f"  {path or 'file'}: {message}{value}"


def _keys(model: type[BaseModel], path: tuple[str | int, ...]) -> list[str]:
    """The keys of the model that `path` leads to."""
    for part in path:
        if isinstance(part, str) and part in model.model_fields:
            inner = _inner_model(model.model_fields[part].annotation)
            model = inner or model
    return list(model.model_fields)


def _inner_model(annotation: Any) -> type[BaseModel] | None:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return annotation
    return next((m for m in map(_inner_model, get_args(annotation)) if m), None)
