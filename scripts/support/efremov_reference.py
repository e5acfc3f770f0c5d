"""Reference figures of the paper's example, and the exact ones held against them.

An independent event-exact simulator made them, its peaks and instants sampled every 0.02 s from
each event on.  So an exact figure may differ in the last digit where a sampled one agrees.
"""

from collections import Counter
from decimal import Decimal
from itertools import pairwise

import numpy as np

from controllers.efremov import limit_cycle
from spacecraft_sim.relay_system import Row, Run
from support.efremov_example import ACCURACY, CASES, DELAY, LEVEL, C, Flight, fly

FINAL = 60.0  # the end of a run over which final figures are taken, s
SAMPLING = 0.02  # how finely the reference figures were sampled from each event on, s

COLUMNS = {
    "T1": "T1, s",
    "T2": "T2, s",
    "beta": "beta(T2+h)",
    "v": "v(T2+h)",
    "T_eps": "T_eps-T2, s",
    "|beta|/eps": "|beta|/eps",
    "|v|/eps": "|v|/eps",
    "|gamma|": "|gamma|, rad",
    "|q|": "|q|, m",
    "max |q|": "max |q|, m",
    "switches": "switches",
    "period": "period, s",
}
# A row for each case, in their order.  Text, because the last digit says how far a figure is known.
_TABLE = """
13.3   30.9   297        -7.54     208.9  .0505 .2352 3.9e-7  2.9e-6  .1   539 .8362
13.3   30.9   .251       -.01015   10.73  .0213 .2066 1.63e-4 3.51e-4 .118 965 .82644
18.213 48.259 -2.317     .0012     17.60  .0505 .2353 3.1e-7  5.3e-7  .1   948 .8352
18.213 48.259 -.001958   1e-6      0      .0213 .2066 1.63e-4 3.50e-4 .1   968 .82644
13.3   30.9   -.436      .100      12.05  .0505 .2353 3.1e-7  5.8e-7  .1   951 .8361
13.3   30.9   -3.7e-4    1.1e-4    0      .0213 .2066 1.63e-4 3.50e-4 .1   969 .82644
13.3   30.9   .01098     -1.3e-4   1.76   .0214 .2067 .0890   .725    1.81 967 .82644
13.457 31.209 -.001925   1.4e-4    0      .0214 .2067 .0995   .811    1.78 968 .82644
13.457 31.209 -.827      .0113     14.37  .0505 .2353 .0995   .813    1.78 954 .8362
13.457 31.209 -.001925   1.4e-4    0      .0214 .2067 .0980   .794    1.82 484 .82644
18.391 48.614 -.001958   7e-7      0      .0213 .2066 3.11e-3 .0230   .176 968 .82644
"""
REFERENCE = tuple(
    dict(zip(COLUMNS, line.split(), strict=True)) for line in _TABLE.strip().splitlines()
)
AGREES, SAMPLED, DIFFERS = "=", "~", "!"
MARKS = {
    AGREES: "the exact figure agrees to the last digit shown",
    SAMPLED: "the exact figure does not, the one sampled like the reference does",
    DIFFERS: "neither does",
}


def figures(flight: Flight) -> dict[str, tuple[float, float]]:
    """Measures a flight twice: exactly, and as samples every 0.02 s from each event on show it.

    Args:
        flight: A flight.

    Returns:
        By name the exact figure and the sampled one.
    """
    run, (T1, T2), unit = flight.run, flight.times, flight.unit
    end, rows, eps = float(run.times[-1]), flight.rows, ACCURACY * unit
    knots = np.unique(np.r_[run.times, run.switch_times, T1, T2])
    knots = knots[np.r_[True, np.diff(knots) > 1e-9]]  # one instant, reached by two sums
    pieces = (np.arange(a, b, SAMPLING) for a, b in pairwise(knots))
    samples = np.r_[np.concatenate(list(pieces)), end]
    beta, v, modes = run.at(samples)
    landing = int(np.searchsorted(samples, T2 + DELAY + 1e-9))
    (miss,), (slip,), _ = run.at([T2 + DELAY])
    outside = np.flatnonzero((samples >= T2) & ((abs(beta) >= eps) | (abs(v) >= eps)))
    last, first = samples[outside[-1] + [0, 1]].tolist() if len(outside) else (T2, T2)
    effects = run.switch_times + DELAY
    effects = effects[effects <= end]
    late = effects[effects > end - FINAL]
    period = 2 * float(np.diff(late).mean())

    def peak(row: Row, after: float, scale: float = 1.0) -> tuple[float, float]:
        values = row.angle * beta + row.rate * v
        for d, z in zip(row.modes, modes.T, strict=False):
            values = values + 2 * (d * z).real
        sampled = np.abs(values[samples >= after]).max()
        return run.peak(row, after=after)[0] / scale, float(sampled) / scale

    return {
        "T1": (T1, T1),
        "T2": (T2, T2),
        "beta": (miss / unit, beta[landing] / unit),
        "v": (slip / unit, v[landing] / unit),
        "T_eps": (_entry(run, eps, last, first) - T2, first - T2),
        "|beta|/eps": peak(Row(angle=1.0), end - FINAL, eps),
        "|v|/eps": peak(Row(rate=1.0), end - FINAL, eps),
        "|gamma|": peak(rows["gamma"], end - FINAL),
        "|q|": peak(rows["q"], end - FINAL),
        "max |q|": peak(rows["q"], 0.0),
        "switches": (len(effects), len(effects)),
        "period": (period, period),
    }


def _entry(run: Run, eps: float, outside: float, inside: float) -> float:
    """The instant between the two from which |beta|, |v| < eps, s."""
    while outside < (middle := (outside + inside) / 2) < inside:
        (beta,), (v,), _ = run.at([middle])
        if max(abs(beta), abs(v)) < eps:
            inside = middle
        else:
            outside = middle
    return inside


def mark(reference: str, exact: float, sampled: float) -> str:
    """Returns how a figure compares with its reference, rounded to the last digit shown.

    Args:
        reference: The reference figure as text.
        exact: The exact figure.
        sampled: The figure sampled as the reference was.
    """
    last = Decimal(reference).as_tuple().exponent
    assert isinstance(last, int)  # a finite figure
    # Half a unit of the last digit, and room for the binary rounding of a tie.
    near = 0.5 * 10.0**last * (1 + 1e-6)
    if abs(exact - float(reference)) <= near:
        return AGREES
    return SAMPLED if abs(sampled - float(reference)) <= near else DIFFERS


def table() -> tuple[str, Counter[str]]:
    """Returns the example in all its readings as text, and how often each mark is in it."""
    text = [
        "Efremov, Polyakov & Strygin (2006), section 5, in all its readings: exact figures, and",
        "reference figures with a mark. beta and v in the unit of the law; |beta|/eps to |q| and",
        "the period over the last 60 s; switchings of u after T2.",
        "",
        " " * 10 + "".join(f"{head:>13}" for head in COLUMNS.values()),
    ]
    marks = Counter()
    for case, row in zip(CASES, REFERENCE, strict=True):
        found = figures(fly(case))
        marked = {name: mark(given, *found[name]) for name, given in row.items()}
        marks.update(marked.values())
        exact = "".join(f"{_shown(found[name][0]):>12} " for name in COLUMNS)
        given = "".join(f"{row[name]:>12}{marked[name]}" for name in COLUMNS)
        unit = "law in rad" if case.by_inertia else "law in kg m^2 rad"
        text += [f"{case.title}, {unit}", f"     exact{exact}", f" reference{given}"]
    cycle = limit_cycle(c=C, delay=DELAY, level=LEVEL)
    text += [
        "without disturbance, in closed form (law in rad): "
        f"|beta|/eps {cycle.beta_max / ACCURACY:.6g}, |v|/eps {cycle.v_max / ACCURACY:.6g}, "
        f"period {cycle.period:.6g} s",
        "",
    ]
    text += [f"{m} {marks[m]:3d} figures: {meaning}" for m, meaning in MARKS.items()]
    return "\n".join(text), marks


def _shown(figure: float) -> str:
    """A figure with one digit more than its reference has at most."""
    return f"{figure:d}" if isinstance(figure, int) else f"{figure:.6g}"
