"""Objects of another library, described here and made in another process.

A recipe is a name with what is taken from it and called on it, in order; it goes over a pipe as a
line of JSON, and behind it the bytes of its arrays.  Nothing but attributes and calls can be told.
"""

import json
from collections.abc import Mapping
from typing import IO, Any

import numpy as np

Call = tuple[tuple, dict[str, Any]]
END = b"\n"  # of all recipes, if it can be told


class Recipe:
    """How an object comes about: taking attributes of a recipe, or calling it, is a longer one."""

    __slots__ = ("_name", "_steps")

    def __init__(self, name: str, steps: tuple[str | Call, ...] = ()):
        """Describes what has a name where the object will be made.

        Args:
            name: The name.
            steps: Attributes and calls, in order.
        """
        self._name, self._steps = name, steps

    def __getattr__(self, attribute: str) -> "Recipe":
        if attribute.startswith("_"):
            raise AttributeError(f"a recipe tells no private names, such as {attribute}")
        return Recipe(self._name, (*self._steps, attribute))

    def __call__(self, *words: Any, **named: Any) -> "Recipe":
        """Returns the recipe of what this one's object gives when it is called."""
        return Recipe(self._name, (*self._steps, (words, named)))

    def __repr__(self) -> str:
        called = "".join(f".{s}" if isinstance(s, str) else "(...)" for s in self._steps)
        return f"{self._name}{called}"

    def encoded(self) -> bytes:
        """Returns the recipe as bytes.

        Raises:
            TypeError: If a part is neither plain data, nor an array of numbers, nor a recipe.
        """
        arrays: list[np.ndarray] = []
        text = json.dumps(_plain(self, arrays))
        return b"".join([text.encode(), b"\n", *(array.tobytes() for array in arrays)])


def made(file: IO[bytes], names: Mapping[str, Any]) -> Any:
    """Reads a recipe and makes its object.

    Args:
        file: Where encoded recipes are read.
        names: What has a name.

    Raises:
        EOFError: If there is no further recipe, only a part of one, or the end.
        AttributeError, KeyError: If a name is not there.
    """
    line = file.readline()
    if line == END or not line.endswith(b"\n"):
        raise EOFError("no further recipe")
    return _object(json.loads(line), file, names)


def _plain(value: Any, arrays: list[np.ndarray]) -> Any:
    """A value as JSON has it; what JSON does not have is an object of one tag."""
    if value is None or isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, list):
        return [_plain(x, arrays) for x in value]
    if isinstance(value, tuple):
        return {"tuple": [_plain(x, arrays) for x in value]}
    if isinstance(value, dict):
        return {"dict": [[key, _plain(x, arrays)] for key, x in value.items()]}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, np.ndarray) and not value.dtype.hasobject:
        arrays.append(value)
        return {"array": [value.dtype.str, value.shape]}
    if isinstance(value, Recipe):
        steps = [s if isinstance(s, str) else _plain(s, arrays) for s in value._steps]
        return {"recipe": [value._name, *steps]}
    raise TypeError(f"a recipe takes plain data and arrays of numbers, not {value!r}")


def _object(plain: Any, file: IO[bytes], names: Mapping[str, Any]) -> Any:
    """The other way; arrays are read in the order in which they were met."""
    if isinstance(plain, list):
        return [_object(x, file, names) for x in plain]
    if not isinstance(plain, dict):
        return plain
    ((tag, content),) = plain.items()
    if tag == "tuple":
        return tuple(_object(x, file, names) for x in content)
    if tag == "dict":
        return {key: _object(x, file, names) for key, x in content}
    if tag == "array":
        return _array(file, np.dtype(content[0]), content[1])
    found, *steps = content
    found = names[found]
    for step in steps:
        if isinstance(step, str):
            found = getattr(found, step)
        else:
            words, named = _object(step, file, names)
            found = found(*words, **named)
    return found


def _array(file: IO[bytes], kind: np.dtype, shape: list[int]) -> np.ndarray:
    size = kind.itemsize * int(np.prod(shape, dtype=int))
    data = file.read(size)
    if len(data) < size:
        raise EOFError("a recipe without its arrays")
    return np.frombuffer(data, kind).reshape(shape)
