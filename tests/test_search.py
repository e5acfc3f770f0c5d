"""The search for parameters of Theorems 1 and 2 that meet a requirement."""

import math

import pytest

from controllers.efremov import design_local, design_nonlocal
from controllers.efremov_search import choose_local, choose_nonlocal

NEED = {"max_delay": 0.2, "accuracy": 0.007, "disturbance": 8.5e-7}


@pytest.mark.parametrize("aim", ["margin", "thrust"])
def test_a_choice_is_accepted_by_the_design_and_keeps_the_requirement(aim):
    choice = choose_nonlocal(**NEED, radius=0.1, thrust=0.6, aim=aim)
    law, guarantees = design_nonlocal(
        max_delay=0.2, accuracy=0.007, radius=0.1, c=choice.c, gain=choice.gain
    )
    assert law.levels[0] == pytest.approx(choice.lowest, rel=1e-12)
    assert law.levels[-1] == pytest.approx(choice.highest, rel=1e-12)
    assert choice.highest <= 0.6
    assert law.thresholds[0] * choice.c / 2 >= NEED["disturbance"]
    assert all(a.holds for a in guarantees[0].assumptions)


def test_the_local_margin_is_where_two_slacks_meet():
    # 1 - c h0/ln(6/5) falls with c and 1 - 4 f/(c^2 eps) rises: the best c makes them equal.
    choice = choose_local(**NEED, thrust=1.0)
    falls = 1 - choice.c * 0.2 / math.log(6 / 5)
    rises = 1 - 4 * 8.5e-7 / (choice.c**2 * 0.007)
    assert falls == pytest.approx(rises, abs=1e-4)  # the last grid is finer than that
    assert choice.margin == pytest.approx(falls, abs=1e-4)
    design_local(max_delay=0.2, accuracy=0.007, c=choice.c)


def test_least_thrust_of_the_local_law_is_at_the_disturbance_bound():
    choice = choose_local(**NEED, thrust=1.0, aim="thrust")
    # c^2 eps/4 = f, so p = (3/2) c^2 eps = 6 f.
    assert choice.lowest == pytest.approx(6 * 8.5e-7, rel=1e-3)  # from above, by the grid's width
    assert choice.lowest >= 6 * 8.5e-7


def test_aiming_at_thrust_needs_less_of_it_than_aiming_at_margin():
    thrifty = choose_nonlocal(**NEED, radius=0.1, thrust=0.6, aim="thrust")
    safe = choose_nonlocal(**NEED, radius=0.1, thrust=0.6, aim="margin")
    assert thrifty.highest < safe.highest
    assert thrifty.margin < safe.margin


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"thrust": 0.01}, "exclude each other.*v1 c/2.*thrust"),
        ({"disturbance": 1.0}, r"\|f\| < v1 c/2"),
        ({"radius": 0.007}, "eps < R"),
        ({"thrust": -1.0}, "thrust = -1.0"),
        ({"max_delay": float("nan")}, "max_delay = nan"),
    ],
)
def test_why_there_is_no_choice_is_said(changes, message):
    with pytest.raises(ValueError, match=message):
        choose_nonlocal(**{**NEED, "radius": 0.1, "thrust": 0.6, **changes})


def test_a_local_requirement_beyond_the_thrust_is_refused():
    with pytest.raises(ValueError, match="within the thrust"):
        choose_local(**NEED, thrust=1e-6)
