"""Lines of a plane: what of them is seen, and where their names stand clear of each other."""

from collections.abc import Sequence

import numpy as np

Array = np.ndarray

LETTER, HEIGHT = 0.075, 0.24  # of a letter's width and a name's height, in half windows
BELOW = 0.15  # from the place of a name to its middle: the viewer writes below it
WINDOW = (1.0, 0.95)  # within which names stand, half width and half height
EDGE = 1.08  # within which they are whole
LEAST = 0.9  # of a line that gets a name, likewise
PLACES = 60  # on each line that are tried


def spread(lines: Sequence[Array], names: Sequence[str]) -> list[Array | None]:
    """Returns a place on each line for its name, as clear of the others and the middle as can be.

    The names with the fewest places to stand choose first.

    Args:
        lines: Visible points of each line, each of shape (n, 2); y is down.
        names: The names.

    Returns:
        The places, each of shape (2,); None for a line of which nothing is visible, or so little
        that its name would cover it.
    """
    found: list[Array | None] = [None] * len(lines)
    boxes: list[tuple[Array, Array]] = []  # middle and half size of each name that stands
    for k in sorted(range(len(lines)), key=lambda k: len(lines[k])):
        seen = lines[k][np.all(np.abs(lines[k]) <= WINDOW, axis=1)]
        if not len(seen) or np.ptp(seen, axis=0).max() < LEAST:
            continue
        places = seen[np.unique(np.linspace(0, len(seen) - 1, PLACES).astype(int))]
        half = np.array([len(names[k]) * LETTER, HEIGHT]) / 2
        middles = places + np.array([0.0, BELOW])
        outside = np.maximum(np.abs(middles) + half - EDGE, 0.0)
        cost = 1e2 * outside.sum(axis=1)
        for middle, other in boxes:
            lap = np.maximum(half + other - np.abs(middles - middle), 0.0)
            cost += 1e3 * lap[:, 0] * lap[:, 1]
        best = int(np.argmin(cost - np.linalg.norm(places, axis=1)))
        found[k] = places[best]
        boxes.append((middles[best], half))
    return found


def pieces(points: Array) -> list[Array]:
    """Returns a line without its breaks, each piece of shape (n, 2).

    Args:
        points: Its points, shape (n, 2); NaN breaks it.
    """
    broken = np.flatnonzero(np.isnan(points).any(axis=1))
    parts = np.split(points, broken)
    return [p for p in (part[~np.isnan(part).any(axis=1)] for part in parts) if len(p) > 1]


def inside(points: Array, box: Array) -> Array:
    """Returns the segments of a line cut to |x|, |y| <= box: their ends, shape (n, 2, 2).

    Args:
        points: Points of the line, shape (n, 2); NaN breaks it.
        box: Half width and half height, shape (2,).
    """
    start, way = points[:-1], np.diff(points, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        bounds = np.sort([(-box - start) / way, (box - start) / way], axis=0)
    ends = np.stack([np.maximum(bounds[0].max(axis=1), 0), np.minimum(bounds[1].min(axis=1), 1)])
    cut = ends[0] < ends[1]  # not where a coordinate is NaN: a break, or a segment along an edge
    return start[cut, None] + ends.T[cut, :, None] * way[cut, None]
