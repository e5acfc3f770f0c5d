"""Where names stand in a plane so that none covers another."""

from collections.abc import Sequence

import numpy as np

Array = np.ndarray

LETTER, HEIGHT = 0.075, 0.24  # of a letter's width and a name's height, in half windows
BELOW = 0.15  # from the place of a name to its middle: the viewer writes below it
WINDOW = (1.0, 0.95)  # within which names stand, half width and half height
PLACES = 60  # on each line that are tried


def spread(lines: Sequence[Array], names: Sequence[str]) -> list[Array | None]:
    """Returns a place on each line for its name, as clear of the others and the middle as can be.

    The names with the fewest places to stand choose first.

    Args:
        lines: Visible points of each line, each of shape (n, 2); y is down.
        names: The names.

    Returns:
        The places, each of shape (2,); None for a line of which nothing is visible.
    """
    found: list[Array | None] = [None] * len(lines)
    boxes: list[tuple[Array, Array]] = []  # middle and half size of each name that stands
    for k in sorted(range(len(lines)), key=lambda k: len(lines[k])):
        inside = lines[k][np.all(np.abs(lines[k]) <= WINDOW, axis=1)]
        if not len(inside):
            continue
        places = inside[np.unique(np.linspace(0, len(inside) - 1, PLACES).astype(int))]
        half = np.array([len(names[k]) * LETTER, HEIGHT]) / 2
        middles = places + (0.0, BELOW)
        cost = np.zeros(len(places))
        for middle, other in boxes:
            lap = np.maximum(half + other - np.abs(middles - middle), 0.0)
            cost += 1e3 * lap[:, 0] * lap[:, 1]
        best = int(np.argmin(cost - np.linalg.norm(places, axis=1)))
        found[k] = places[best]
        boxes.append((middles[best], half))
    return found
