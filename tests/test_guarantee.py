"""Verdicts: what holds, by how much, and why not."""

import math
from dataclasses import replace

import numpy as np
import pytest

from spacecraft_sim.guarantee import Assumption, Guarantee, Measurement
from spacecraft_sim.trajectory import Trajectory

FLIGHT = Trajectory(
    time=np.array([0.0, 1.0, 2.0]),
    signals={"angle": np.array([0.1, -0.4, 0.2])},
    units={"angle": "rad"},
)
FALSE = Assumption(text="h < h0", value=0.3, limit=0.2, unit="s")
TRUE = Assumption(text="c > 0", value=0.31, limit=0.0, relation=">")


def largest(trajectory):
    worst = int(np.argmax(np.abs(trajectory["angle"])))
    return Measurement(float(trajectory["angle"][worst]), float(trajectory.time[worst]))


def giving(value, **more):
    return lambda _: Measurement(value, **more)


BOUNDED = Guarantee(
    claim="the angle stays small", source="Theorem 1", unit="rad", measure=largest, bound=0.5
)


@pytest.mark.parametrize(
    ("value", "relation", "limit", "holds"),
    [
        (1.0, "<", 1.0, False),
        (1.0, "<=", 1.0, True),
        (1.0, ">", 1.0, False),
        (1.0, ">=", 1.0, True),
        (0.9, "<", 1.0, True),
        (1.1, ">", 1.0, True),
        (1.1, "<=", 1.0, False),
        (0.9, ">=", 1.0, False),
        (math.nan, "<", 1.0, False),
        (math.nan, ">=", 1.0, False),
        (0.0, "<=", math.nan, False),
    ],
)
def test_assumption_holds_when_its_relation_does(value, relation, limit, holds):
    assert Assumption(text="x", value=value, limit=limit, relation=relation).holds is holds


def test_assumption_says_its_numbers():
    assert str(FALSE) == "h < h0: not 0.3 < 0.2 s"
    assert str(TRUE) == "c > 0: 0.31 > 0"


def test_bound_is_checked_on_the_magnitude_with_the_margin_left():
    verdict = BOUNDED.check(FLIGHT)
    assert verdict.holds
    assert verdict.measured == -0.4
    assert verdict.t_worst == 1.0
    assert verdict.margin == pytest.approx(0.2, rel=1e-14)  # 1 - 0.4/0.5


def test_broken_bound_does_not_hold_and_has_a_negative_margin():
    verdict = replace(BOUNDED, bound=0.25).check(FLIGHT)
    assert not verdict.holds
    assert verdict.failed == ()
    assert verdict.margin == pytest.approx(-0.6, rel=1e-14)


def test_bound_that_is_just_reached_holds():
    verdict = replace(BOUNDED, bound=0.4).check(FLIGHT)
    assert verdict.holds
    assert verdict.margin == 0.0


def test_kept_bound_is_no_guarantee_where_an_assumption_failed():
    verdict = replace(BOUNDED, assumptions=(TRUE, FALSE)).check(FLIGHT)
    assert verdict.failed == (FALSE,)
    assert not verdict.holds
    assert verdict.margin > 0


def test_assumptions_of_the_flight_count_too():
    measure = giving(0.1, assumptions=(FALSE,))
    verdict = replace(BOUNDED, measure=measure, assumptions=(TRUE,)).check(FLIGHT)
    assert verdict.assumptions == (TRUE, FALSE)
    assert verdict.failed == (FALSE,)
    assert not verdict.holds


@pytest.mark.parametrize(
    ("value", "holds"), [(1.9, True), (2.2, True), (2.3, False), (-2.0, False)]
)
def test_prediction_is_met_within_the_bound(value, holds):
    within = replace(
        BOUNDED, kind="within", predicted=2.0, bound=0.25, measure=giving(value)
    ).check(FLIGHT)
    assert within.holds is holds
    assert within.margin == pytest.approx(1 - abs(value - 2.0) / 0.25, rel=1e-14)


def test_figures_of_the_flight_replace_those_of_the_design():
    measure = giving(3.0, predicted=2.9, bound=0.2)
    verdict = replace(BOUNDED, kind="within", predicted=0.0, measure=measure).check(FLIGHT)
    assert (verdict.predicted, verdict.bound) == (2.9, 0.2)
    assert verdict.holds


def test_figure_that_is_not_a_number_never_holds():
    assert not replace(BOUNDED, measure=giving(math.nan)).check(FLIGHT).holds
    assert not replace(BOUNDED, bound=math.nan).check(FLIGHT).holds


@pytest.mark.parametrize(("value", "holds", "margin"), [(0.0, True, 0.0), (1e-9, False, -math.inf)])
def test_bound_of_zero_allows_zero_alone(value, holds, margin):
    verdict = replace(BOUNDED, bound=0.0, measure=giving(value)).check(FLIGHT)
    assert (verdict.holds, verdict.margin) == (holds, margin)


def test_guarantee_without_a_bound_is_refused_by_its_claim():
    with pytest.raises(
        ValueError, match="the angle stays small: neither the design nor the flight"
    ):
        replace(BOUNDED, bound=None).check(FLIGHT)


@pytest.mark.parametrize(
    ("value", "assumptions", "outcome"),
    [
        (0.4, (TRUE,), "holds"),
        (0.6, (TRUE,), "FAILS"),
        (0.4, (FALSE,), "not guaranteed"),
        (0.6, (FALSE,), "not guaranteed"),  # nothing was promised
        (math.nan, (TRUE,), "not judged"),
        (math.nan, (FALSE,), "not judged"),
    ],
)
def test_the_outcome_tells_a_broken_bound_from_one_that_was_not_promised(
    value, assumptions, outcome
):
    claim = replace(BOUNDED, measure=giving(value), assumptions=assumptions)
    verdict = claim.check(FLIGHT)
    assert verdict.outcome == outcome
    assert verdict.holds == (outcome == "holds")
