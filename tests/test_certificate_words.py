"""What a certificate says in words: the result, reasons, remedies, symbols."""

import math
import re
from dataclasses import replace

import numpy as np
import pytest
from relatives import relative

from controllers.contour import guaranteed_accuracy
from spacecraft_sim import certificate_input, certificate_report, certificate_words, cli
from spacecraft_sim.certificate import certify
from spacecraft_sim.certificate_curves import Curves
from spacecraft_sim.dwell_axes import Accuracy
from spacecraft_sim.elastic_mjcf import elastic_model
from spacecraft_sim.guarantee import Assumption, Verdict
from spacecraft_sim.remedy import Remedy

NONE = Curves(
    axis="x", dwell=2.0, bound=np.zeros((0, 2)), l1=0.0, worst=np.zeros((0, 2)),
    measured=np.zeros((0, 3)), here=0.0, left_out=(),
)  # fmt: skip
LAW = "thrust against M1 alone"


def certified(name, **numbers):
    craft = certificate_input.read(name)
    elastic = elastic_model(craft.model)
    found = certify(
        elastic, torque=craft.torque, dwell=craft.dwell, regulators={LAW: guaranteed_accuracy},
        **numbers,
    )  # fmt: skip
    return craft, found


@pytest.fixture(scope="module")
def four():
    return certified("four_boom")


@pytest.fixture(scope="module")
def light():
    return certified("two_boom_light")


@pytest.fixture(scope="module")
def asymmetric():
    return certified("asymmetric_booms")


def page(found, attacks=None, flights=0):
    craft, certificates = found
    return certificate_report.page(craft, certificates, (NONE,) * 3, attacks or {}, flights)


def verdict(measured, bound, failed=()):
    return Verdict(
        claim="", source="", unit="N m", kind="at most", predicted=None, measured=measured,
        bound=bound, margin=1 - measured / bound, t_worst=0.0, assumptions=failed, failed=failed,
        holds=measured <= bound and not failed,
    )  # fmt: skip


def failing(certificates):
    broken = Assumption(text="small motion: deflection of boom", value=0.05, limit=0.03)
    return tuple(replace(c, assumptions=(*c.assumptions, broken)) for c in certificates)


# -- the result ------------------------------------------------------------------------------------


def test_the_result_names_the_bound_of_each_axis(light):
    said = page(light).result
    totals = [f'{c.axis} {math.degrees(c.attitude.total) * 3600:.4g}"' for c in light[1]]
    assert said == (
        f"guaranteed about {', '.join(totals)} (relay on the attitude); every assumption holds"
    )


def test_the_result_says_why_nothing_is_guaranteed_and_what_is_by_the_other_angle(four):
    e = [f"{c.disturbance:.4g}" for c in four[1]]
    rigid = [f'{c.axis} {math.degrees(c.quasi_rigid.total) * 3600:.4g}"' for c in four[1]]
    assert page(four).result == (
        "not certified: about x, y and z nothing is guaranteed because the disturbance, e = "
        f"{e[0]}, {e[1]} and {e[2]} times the thrust, is not below 1 - |F| = 1; a relay on the "
        f"quasi-rigid angle is guaranteed about {', '.join(rigid)}"
    )


def test_an_axis_that_others_may_turn_says_so(asymmetric):
    said = page(asymmetric).result
    assert "about x and z nothing is guaranteed because the disturbance, e = 8.44 and" in said
    assert "about y nothing is guaranteed because x and z, about which nothing holds" in said


def test_axes_that_turn_each_other_too_fast_say_so(light):
    # Thrust over inertia so large that in a dwell the bus turns by a radian.
    craft, _ = light
    elastic = relative(0.1, 0.05)[1]
    torque = 0.3 * np.diag(elastic.J) / 4.0
    certificates = certify(elastic, torque=torque, dwell=2.0)
    assert all(math.isfinite(c.attitude.contour) for c in certificates)
    assert not any(math.isfinite(c.attitude.total) for c in certificates)
    said = page((craft, certificates)).result
    assert "about x, y and z nothing is guaranteed because the axes turn each other too" in said
    assert "u0 dwell^2 is x 0.3 rad, y 0.3 rad, z 0.3 rad" in said


def test_an_assumption_that_fails_leaves_no_figure_in_the_result(light, four):
    for craft, certificates in (light, four):
        found = page((craft, failing(certificates)))
        assert not found.holds
        assert found.result.startswith("not certified: ")
        assert found.result.endswith(
            "an assumption does not hold (small motion: deflection of boom: not 0.05 < 0.03)"
        )


def test_a_bound_that_a_flight_passed_is_not_certified(light):
    slow = Assumption(text="slow rotation", value=2.0, limit=1.0)
    beyond = page(light, {"x": verdict(2.0, 1.0, (slow,)), "z": verdict(0.5, 1.0)})
    assert beyond.holds  # what is not guaranteed is not broken
    passed = page(light, {"x": verdict(0.5, 1.0), "z": verdict(2.0, 1.0)}, 12)
    assert not passed.holds
    assert passed.result == "not certified: a flight passed the bound M_e about z"


def test_the_result_begins_with_guaranteed_if_and_only_if_it_holds(four, light, asymmetric):
    for found in (four, light, asymmetric, (light[0], failing(light[1]))):
        said = page(found)
        assert said.holds == said.result.startswith("guaranteed about ")
        assert said.holds == (not said.result.startswith("not certified: "))


# -- the table and the picture ---------------------------------------------------------------------


def test_what_is_vacuous_has_its_reason_beside_it(four, light, asymmetric):
    for found in (four, light, asymmetric):
        cells = [cell for row in page(found).rows for cell in row[1:]]
        bare = [cell for cell in cells if re.fullmatch(r".*vacuous\W*|unbounded|inf", cell)]
        assert bare == []
        assert any("vacuous: " in cell for cell in cells)  # of the thrust against M1, if no other
    table = {row[0]: row[1:] for row in page(asymmetric).rows}
    assert table["relay on the attitude: p0 u0 dwell^2"][::2] == ("vacuous: e >= 1 - |F|",) * 2
    assert "vacuous: x, z turn it" in table["  axes turning each other"] + next(
        row for row in page(asymmetric).rows if row[0] == certificate_report.BOUND
    )
    assert table[LAW] == (
        "vacuous: F + eps = 8.44048 must be < 1",
        "vacuous: eps = 0.335632 must be < F = 0",
        "vacuous: F + eps = 11.087 must be < 1",
    )


def test_the_quasi_rigid_angle_has_a_reason_too(four):
    craft, certificates = four
    x, y, z = certificates
    lost = (replace(x, quasi_rigid=Accuracy(contour=math.inf)),)
    turned = [replace(c, quasi_rigid=replace(c.quasi_rigid, coupling=math.inf)) for c in (y, z)]
    said = page((craft, (*lost, *turned)))
    _, total = (row for row in said.rows if row[0] == certificate_report.BOUND)
    assert total[1:] == ("vacuous: torques about other axes", *("vacuous: x turns it",) * 2)
    lines = "\n".join(said.sections["axis by axis"])
    assert "vacuous on the quasi-rigid angle; the torques about the other axes" in lines
    assert "vacuous on the quasi-rigid angle; x, about which nothing holds the bus" in lines
    assert "relay on the quasi-rigid angle is guaranteed" not in said.result


def test_the_picture_says_of_an_axis_what_the_table_says(four, light, asymmetric):
    for craft, certificates in (four, light, asymmetric):
        table = [
            r[1:] for r in page((craft, certificates)).rows if r[0] == certificate_report.BOUND
        ]
        for k, c in enumerate(certificates):
            lines = certificate_words.promise(certificates, c).splitlines()
            for cells, line in zip(table, lines, strict=True):
                assert cells[k].rpartition(" = ")[2] in line
                assert ("vacuous" in cells[k]) == ("vacuous" in line)


# -- what would help -------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (
            Remedy(dwell=100.8, damping=44.7, mass=0.186),
            "a dwell above 100.8 s, or 44.7 times the damping, or elastic masses times 0.186 would "
            "do about z, the rest unchanged",
        ),
        (
            Remedy(dwell=math.inf, damping=math.inf, mass=0.469),
            "elastic masses times 0.469 would do about z, the rest unchanged; no dwell is long "
            "enough, no damping is enough",
        ),
        (
            Remedy(dwell=math.inf, damping=3.0, mass=math.nan),
            "3 times the damping would do about z, the rest unchanged; no dwell is long enough",
        ),
        (
            Remedy(dwell=math.inf, damping=math.inf, mass=0.0),
            "no single change would do about z, the rest unchanged; no dwell is long enough, no "
            "damping is enough, no elastic mass is small enough",
        ),
    ],
)
def test_what_would_help_is_parted_from_what_would_not(found, words):
    assert certificate_words.remedy("z", found) == words


# -- symbols ---------------------------------------------------------------------------------------


def test_symbols_are_explained_if_and_only_if_they_are_shown():
    def symbols(shown):
        return [line.partition(":")[0] for line in certificate_words.glossary(shown)]

    assert symbols("mass of the bus") == []
    assert symbols("sup |H q|/J") == ["H q", "sup"]
    assert symbols("sup |H q'|/J") == ["sup"]
    assert symbols("e = 0.3 < 1 - |F|") == ["F", "e"]
    assert symbols("swing with mu = 0.1, sigma = 2 1/s") == ["mu", "sigma"]
    assert symbols("the axes turn each other") == []


def test_every_symbol_of_the_table_has_a_line(four):
    lines = page(four).sections["symbols"]
    shown = {line.partition(":")[0] for line in lines}
    assert shown >= {"p0", "u0", "A_m", "H q", "mu", "sigma", "e", "F", "M_e", "L1", "theta"}
    assert "axes turning each other" in shown
    assert len(lines) == len(shown)


# -- the exit code ---------------------------------------------------------------------------------


def test_code_1_is_explained_by_the_first_line(tmp_path, capsys):
    # No moment is felt about y, and that about x and z is within the thrust; what bends is too far.
    words = ("--torque", "1", "--dwell", "2", "--out", str(tmp_path / "out"))
    assert cli.main(["certify", "two_boom_light", *words]) == 1
    first, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith("not certified: an assumption does not hold (small motion: deflection")
    assert "; slow rotation: rate over the slowest decay: not 0.1" in first


def test_what_is_left_out_of_the_curves_is_said(tmp_path, capsys):
    # So strong a thrust bends the booms by radians, and the flight of the worst schedule diverges.
    words = ("--torque", "20", "--dwell", "40", "--out", str(tmp_path / "out"))
    assert cli.main(["certify", "two_boom_light", *words]) == 1
    shown = capsys.readouterr().out
    assert shown.startswith("not certified: ")
    assert "left out" in shown
    assert re.search(r"[xz]: flight at \d+ s: the motion is not finite", shown)
