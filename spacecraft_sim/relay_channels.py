"""The numbers of three relay channels, given as one for all or one each."""

import numpy as np

Array = np.ndarray

AXES = "xyz"


def per_channel(
    name: str, value: float | Array | list[float], *, infinite: bool = False, zero: bool = False
) -> Array:
    """Returns three positive numbers.

    Args:
        name: What they are, for the error.
        value: One number for all channels, or three.
        infinite: Whether inf is allowed.
        zero: Whether zero is.

    Raises:
        ValueError: If they are not positive numbers, one or three.
    """
    given = np.asarray(value, dtype=float)
    if given.shape not in ((), (3,)):
        raise ValueError(f"{name} must be one number or three, got {value!r}")
    good = ((given > 0) | (zero & (given == 0))) & (infinite | np.isfinite(given))
    if not np.all(good):
        kind = ("" if infinite else "finite and ") + (">= 0" if zero else "> 0")
        raise ValueError(f"{name} must be {kind}, got {value!r}")
    return np.full(3, given) if given.ndim == 0 else given.copy()
