"""The few checks of arguments that every module makes in the same words."""

import difflib
import math
from collections.abc import Iterable


def positive(*, zero: bool = False, **values: float) -> None:
    """Refuses values that are not finite and positive.

    Args:
        zero: Whether zero is allowed too.
        **values: The values by the name the user knows them by.

    Raises:
        ValueError: Naming every value at fault.
    """
    limit = ">= 0" if zero else "> 0"
    bad = [
        f"{name} = {value!r}"
        for name, value in values.items()
        if not (math.isfinite(value) and (value > 0 or (zero and value == 0)))
    ]
    if bad:
        raise ValueError(f"must be finite and {limit}: {', '.join(bad)}")


def choices(kind: str, name: str, known: Iterable[str], *, where: str) -> str:
    """Words the error about a name that does not exist, nearest choice first.

    Args:
        kind: What the name should be, as in "sensor".
        name: The name that was asked for.
        known: The names there are.
        where: Where they are looked for, as in "two_boom".

    Returns:
        One sentence with the nearest name, if any is near, and all choices.
    """
    known = sorted(known)
    near = difflib.get_close_matches(name, known, n=1)
    hint = f"did you mean {near[0]!r}? " if near else ""
    return f"{kind} {name!r} is not in {where}; {hint}it has: {', '.join(known) or 'none'}"
