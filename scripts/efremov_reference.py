"""Reference figures of the paper's example, and the exact ones held against them.

An independent event-exact simulator made them, its peaks and instants sampled every 0.02 s from
each event on.  So an exact figure may differ in the last digit where a sampled one agrees.
"""

from collections.abc import Mapping
from decimal import Decimal

# Column: unit of the law's "beta" depends on the case.  A row for each case, in the same order; a
# figure stands as text because its last digit says how far it is known.
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


def marks(reference: Mapping[str, str], found: Mapping[str, tuple[float, float]]) -> dict[str, str]:
    """Returns the mark of each figure of a case.

    Args:
        reference: Reference figures by name.
        found: Exact and sampled figures by name.
    """
    return {name: mark(text, *found[name]) for name, text in reference.items()}


def heading() -> str:
    """Returns the heads of the columns."""
    return " " * 10 + "".join(f"{head:>13}" for head in COLUMNS.values())


def lines(
    title: str, reference: Mapping[str, str], found: Mapping[str, tuple[float, float]]
) -> str:
    """Returns the lines of a case: title, exact figures, reference figures with their marks.

    Args:
        title: What the case is.
        reference: Reference figures by name.
        found: Exact and sampled figures by name.
    """
    verdict = marks(reference, found)
    exact = "".join(f"{_shown(found[name][0]):>12} " for name in COLUMNS)
    given = "".join(f"{reference[name]:>12}{verdict[name]}" for name in COLUMNS)
    return f"{title}\n     exact{exact}\n reference{given}"


def _shown(figure: float) -> str:
    """A figure with one digit more than its reference has at most."""
    return f"{figure:d}" if isinstance(figure, int) else f"{figure:.6g}"
