"""A theorem as something that can be checked: assumptions, a bound, a measured figure, a margin."""

import math
import operator
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from spacecraft_sim.trajectory import Trajectory

Relation = Literal["<", "<=", ">", ">="]
_HOLDS = {"<": operator.lt, "<=": operator.le, ">": operator.gt, ">=": operator.ge}
Outcome = Literal["holds", "FAILS", "not guaranteed", "not judged"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Assumption:
    """A hypothesis of a theorem with the numbers it is judged by.

    Attributes:
        text: The hypothesis in the symbols of the source.
        value: Its left side.
        limit: Its right side.
        relation: What must hold between the two.
        unit: Unit of both.
    """

    text: str
    value: float
    limit: float
    relation: Relation = "<"
    unit: str = ""

    @property
    def holds(self) -> bool:
        """Whether the numbers satisfy the hypothesis; NaN never does."""
        return bool(_HOLDS[self.relation](self.value, self.limit))

    def __str__(self) -> str:
        unit = f" {self.unit}" if self.unit else ""
        word = "" if self.holds else "not "
        return f"{self.text}: {word}{self.value:.6g} {self.relation} {self.limit:.6g}{unit}"


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What became of a guarantee on one trajectory.

    Attributes:
        claim: The claim in words.
        source: Paper and equation.
        unit: Unit of predicted, measured and bound.
        kind: `at most`: |measured| <= bound; `within`: |measured - predicted| <= bound.
        predicted: What theory expects; None where it gives the bound alone.
        measured: The figure of the trajectory.
        bound: The bound.
        margin: Share of the bound that is left; negative when the claim is broken.
        t_worst: Time of the worst instant, s; None where the figure has no single instant.
        assumptions: All that the claim rests on.
        failed: Those that do not hold; with any of these the claim is not guaranteed.
        holds: Whether the bound is kept and nothing failed.
    """

    claim: str
    source: str
    unit: str
    kind: Literal["at most", "within"]
    predicted: float | None
    measured: float
    bound: float
    margin: float
    t_worst: float | None
    assumptions: tuple[Assumption, ...]
    failed: tuple[Assumption, ...]
    holds: bool

    @property
    def outcome(self) -> Outcome:
        """What became of the claim, in a word; the bound counts only where it is guaranteed."""
        if self.holds:
            return "holds"
        if math.isnan(self.measured):
            return "not judged"
        return "not guaranteed" if self.failed else "FAILS"


@dataclass(frozen=True, slots=True)
class Measurement:
    """The figure that a claim speaks of, taken from a trajectory.

    Attributes:
        value: The figure; NaN if the trajectory cannot give it.
        t_worst: Time of the worst instant, s, if there is one.
        predicted: Prediction that depends on the flight (its initial state); None if it does not.
        bound: Bound that depends on the flight; None if it does not.
        assumptions: Hypotheses that only the flight can tell.
    """

    value: float
    t_worst: float | None = None
    predicted: float | None = None
    bound: float | None = None
    assumptions: tuple[Assumption, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Guarantee:
    """A claim about every trajectory that satisfies its assumptions.

    Attributes:
        claim: The claim in words, for people.
        source: Paper and equation.
        unit: Unit of the figures.
        kind: `at most`: |measured| <= bound; `within`: |measured - predicted| <= bound.
        measure: Takes the figure from a trajectory.
        bound: The bound; None where each flight has its own.
        predicted: What theory expects; None where it gives the bound alone.
        assumptions: Hypotheses that the design alone decides.
        signals: Readings that `measure` needs beside those of the law.
    """

    claim: str
    source: str
    unit: str
    measure: Callable[[Trajectory], Measurement]
    kind: Literal["at most", "within"] = "at most"
    bound: float | None = None
    predicted: float | None = None
    assumptions: tuple[Assumption, ...] = ()
    signals: tuple[str, ...] = ()

    def check(self, trajectory: Trajectory) -> Verdict:
        """Measures the claim on a trajectory.

        Args:
            trajectory: A flight of either plant.

        Returns:
            The verdict; it holds only if the bound is kept and every assumption holds.
        """
        m = self.measure(trajectory)
        predicted = self.predicted if m.predicted is None else m.predicted
        bound = self.bound if m.bound is None else m.bound
        if bound is None:
            raise ValueError(f"{self.claim}: neither the design nor the flight gives a bound")
        error = abs(m.value - (predicted or 0.0)) if self.kind == "within" else abs(m.value)
        margin = 1 - error / bound if bound > 0 else (0.0 if error == 0 else -math.inf)
        assumptions = self.assumptions + m.assumptions
        failed = tuple(a for a in assumptions if not a.holds)
        return Verdict(
            claim=self.claim,
            source=self.source,
            unit=self.unit,
            kind=self.kind,
            predicted=predicted,
            measured=m.value,
            bound=bound,
            margin=margin,
            t_worst=m.t_worst,
            assumptions=assumptions,
            failed=failed,
            holds=error <= bound and not failed,
        )
