"""What a scenario consists of and what theory says of it, as rows of text."""

import inspect
import re
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from spacecraft_sim.config import unit_of
from spacecraft_sim.guarantee import Guarantee
from spacecraft_sim.mission import asked_for, parameters_of
from spacecraft_sim.scenario import Scenario
from spacecraft_sim.spacecraft import Spacecraft

Row = tuple[str, ...]

_UNITS = re.compile(r",\s*((?:rad|kg|N|m|s|1/s)(?:[ /^*a-z0-9N]*)?)(?:;|\.|$)")


def parameters(
    scenario: Scenario, machine: Spacecraft, design: Callable
) -> list[tuple[str, list[Row]]]:
    """Returns (heading, rows of name, value, default, unit, description) for every parameter.

    Args:
        scenario: The scenario.
        machine: Its spacecraft.
        design: The design function of its law.
    """
    law = list(_law(design, scenario.controller))
    if modulation := asked_for(scenario.controller):
        law += _fields(modulation, "controller.modulation.")
    return [
        ("scenario", list(_fields(scenario, ""))),
        (f"spacecraft {machine.name}", list(_fields(machine, ""))),
        (f"law {scenario.controller['law']}", law),
    ]


def predictions(guarantees: Sequence[Guarantee]) -> list[Row]:
    """Returns rows of claim, predicted figure, bound, unit and source.

    Args:
        guarantees: What is claimed.
    """
    return [
        (
            g.claim,
            "" if g.predicted is None else f"{g.predicted:.6g}",
            "from the flight" if g.bound is None else f"{g.bound:.6g}",
            g.unit,
            g.source,
        )
        for g in guarantees
    ]


def assumptions(guarantees: Sequence[Guarantee]) -> list[str]:
    """Returns each assumption once, with its numbers.

    Args:
        guarantees: What is claimed.
    """
    return list(dict.fromkeys(str(a) for g in guarantees for a in g.assumptions))


def _fields(model: BaseModel, prefix: str) -> Iterator[Row]:
    for name, field in type(model).model_fields.items():
        value, path = getattr(model, name), f"{prefix}{name}"
        if path in _SHOWN_ELSEWHERE:
            continue
        parts = _parts(value)
        for key, part in parts.items():
            yield from _fields(part, f"{path}.{key}." if key else f"{path}.")
        if not parts:
            text = "" if value is None else str(value)
            yield path, text, _default(field), unit_of(field), field.description or ""


_SHOWN_ELSEWHERE = ("title", "description", "controller", "versions", "xml")


def _parts(value: Any) -> dict[str, BaseModel]:
    """The tables inside a value, by name; the value itself under the name ""."""
    if isinstance(value, BaseModel):
        return {"": value}
    if isinstance(value, tuple):
        value = {getattr(part, "name", ""): part for part in value}
    if isinstance(value, dict):
        return {key: part for key, part in value.items() if isinstance(part, BaseModel)}
    return {}


def _default(field: FieldInfo) -> str:
    return "required" if field.is_required() else str(field.get_default(call_default_factory=True))


def _law(design: Callable, chosen: dict[str, Any]) -> Iterator[Row]:
    texts = _argument_texts(inspect.getdoc(design) or "")
    for name, parameter in parameters_of(design).items():
        default = "required" if parameter.default is parameter.empty else str(parameter.default)
        text = texts.get(name, "")
        unit = _UNITS.search(text)
        value = str(chosen.get(name, parameter.default))
        yield f"controller.{name}", value, default, unit[1].strip() if unit else "", text


def _argument_texts(doc: str) -> dict[str, str]:
    """Descriptions in the Args section of a Google docstring, by argument."""
    section = re.search(r"^Args:\n(.*?)(?:^\S|\Z)", doc, re.MULTILINE | re.DOTALL)
    if not section:
        return {}
    entries = re.findall(r"^    (\w+): (.*(?:\n {5,}.*)*)", section[1], re.MULTILINE)
    return {name: re.sub(r"\s+", " ", text) for name, text in entries}
