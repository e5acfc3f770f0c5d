"""Spacecraft as data: delays that can be inverted, and every fault named when it is read."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from spacecraft_sim import spacecraft
from spacecraft_sim.spacecraft import Boom, Delay, Spacecraft, Thruster

BOOM = {
    "name": "left",
    "root": "left_root",
    "length": 7.5,
    "linear_density": 1.53,
    "bending_stiffness": 35.0,
}
JET = {"name": "jet", "levels": [3.0, 1.0]}


def table(**changes):
    return {"name": "probe", "xml": "probe.xml", "booms": [BOOM], "thrusters": [JET]} | changes


def write(folder, text):
    path = folder / "probe.toml"
    path.write_text(text, encoding="utf-8")
    return path


# -- delays ------------------------------------------------------------------------------------

delays = st.tuples(
    st.floats(1e-3, 10), st.floats(-1, 1), st.floats(-0.999, 0.999), st.floats(0, 6.3)
).map(
    lambda x: Delay(
        mean=x[0],
        amplitude=x[0] * x[1],
        frequency=x[2] / abs(x[0] * x[1]) if abs(x[1]) > 1e-3 else x[2] / x[0],
        phase=x[3],
    )
)


@given(delay=delays, t=st.floats(0, 1e4))
def test_arrival_inverts_the_clock(delay, t):
    a = delay.arrival(t)
    # One ulp of a, and one of the sine's argument, which moves h by ulp(frequency a) amplitude.
    tolerance = 4 * math.ulp(a) * (1 + abs(delay.amplitude * delay.frequency)) + 1e-14
    assert a - delay(a) == pytest.approx(t, abs=tolerance, rel=0)


@given(delay=delays, t=st.floats(0, 1e4), later=st.floats(1e-6, 10))
def test_commands_arrive_in_the_order_of_issue_within_the_longest_delay(delay, t, later):
    a, b = delay.arrival(t), delay.arrival(t + later)
    rounding = 1e-11  # of a clock up to 1e4 s, magnified by a slope near zero
    assert a - rounding <= b
    assert t - rounding <= a <= t + delay.longest + rounding


@pytest.mark.parametrize("share", [0.9, 0.999, 1 - 1e-9])
@pytest.mark.parametrize("phase", [0.0, 1.0, 3.1, 4.6])
def test_arrival_is_found_where_the_delay_almost_runs_backwards(share, phase):
    delay = Delay(mean=0.2, amplitude=0.15, frequency=share / 0.15, phase=phase)
    for i in range(200):
        t = 0.037 * i
        a = delay.arrival(t)
        assert a - delay(a) == pytest.approx(t, abs=1e-14, rel=0)  # ulp of 8 s is 2e-15


def test_constant_delay_is_a_shift_to_the_bit():
    assert Delay(mean=0.2).arrival(0.1) == 0.1 + 0.2
    assert Delay(mean=0.0).arrival(7.3) == 7.3


def test_longest_delay_is_the_bound_that_is_reached():
    delay = Delay(mean=0.2, amplitude=-0.1, frequency=2.0)
    assert delay.longest == pytest.approx(0.3, rel=1e-15)
    assert delay(3 * math.pi / 4) == pytest.approx(0.3, rel=1e-15)


def test_delay_that_goes_negative_is_refused():
    with pytest.raises(ValueError, match=r"goes negative: amplitude -0\.3 s > mean 0\.2 s"):
        Delay(mean=0.2, amplitude=-0.3)


def test_delay_that_runs_backwards_is_refused():
    with pytest.raises(ValueError, match=r"runs backwards: amplitude \* frequency = 1\.0\d* >= 1"):
        Delay(mean=0.2, amplitude=0.1, frequency=10.0)


def test_number_stands_for_a_constant_delay():
    assert Thruster.model_validate(JET | {"delay": 0.2}).delay == Delay(mean=0.2)


# -- limits ------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [math.nan, math.inf, -1.0, 0.0])
@pytest.mark.parametrize("name", ["length", "linear_density", "bending_stiffness"])
def test_boom_numbers_must_be_finite_and_positive(name, bad):
    with pytest.raises(ValueError, match=rf"{name}\n.*(finite|greater than 0)"):
        Boom.model_validate(BOOM | {name: bad})


@pytest.mark.parametrize(
    ("part", "name", "bad"),
    [
        (Boom, "damping_time", -1e-9),
        (Boom, "tip_mass", -1.0),
        (Boom, "n_hinges", 0),
        (Boom, "rule", "simpson"),
        (Thruster, "min_on_time", -0.1),
        (Thruster, "rise_time", math.nan),
        (Thruster, "fall_time", -0.1),
        (Thruster, "delay", -0.2),
        (Thruster, "levels", []),
        (Thruster, "levels", [1.0, 0.0]),
        (Thruster, "levels", [-1.0]),
        (Thruster, "levels", [math.nan]),
        (Thruster, "failure", {"time": -1.0}),
    ],
)
def test_number_outside_its_limits_is_refused_by_name(part, name, bad):
    with pytest.raises(ValueError, match=name):
        part.model_validate((BOOM if part is Boom else JET) | {name: bad})


def test_levels_are_kept_in_ascending_order():
    assert Thruster.model_validate(JET).levels == (1.0, 3.0)


def test_parts_cannot_be_changed_in_place():
    with pytest.raises(ValueError, match="frozen"):
        Boom.model_validate(BOOM).length = 1.0


@pytest.mark.parametrize(("kind", "part"), [("booms", BOOM), ("thrusters", JET)])
def test_names_that_are_given_twice_are_refused(kind, part):
    with pytest.raises(ValueError, match=f"given twice: {part['name']}"):
        Spacecraft.model_validate(table(**{kind: [part, part]}))


# -- changes and files -------------------------------------------------------------------------


def test_changes_for_all_come_before_changes_by_name():
    probe = Spacecraft.model_validate(table(booms=[BOOM, BOOM | {"name": "right"}]))
    changed = probe.with_parts(
        booms={"all": {"length": 5.0, "n_hinges": 4}, "right": {"length": 6.0}},
        thrusters={"jet": {"delay": 0.1}},
    )
    assert [(b.length, b.n_hinges) for b in changed.booms] == [(5.0, 4), (6.0, 4)]
    assert changed.thrusters[0].delay.mean == 0.1
    assert [b.length for b in probe.booms] == [7.5, 7.5]


@pytest.mark.parametrize(
    ("booms", "thrusters", "message"),
    [
        ({"lefd": {}}, {}, "boom 'lefd' is not in probe; did you mean 'left'.*all, left"),
        ({}, {"jetty": {}}, "thruster 'jetty' is not in probe; did you mean 'jet'"),
        ({"left": {"lenght": 1.0}}, {}, r"booms\.0\.lenght: unknown key; did you mean 'length'"),
        ({"left": {"length": -1.0}}, {}, r"booms\.0\.length: .*greater than 0, got -1\.0"),
        ({}, {"all": {"levels": [0.0]}}, r"thrusters\.0\.levels: levels are amplitudes, all > 0"),
    ],
)
def test_change_that_makes_no_sense_is_refused(booms, thrusters, message):
    with pytest.raises(ValueError, match=message):
        Spacecraft.model_validate(table()).with_parts(booms=booms, thrusters=thrusters)


def test_file_gives_its_stem_as_name_and_its_folder_to_the_mjcf(tmp_path):
    path = write(tmp_path, 'xml = "bus.xml"\n[[thrusters]]\nname = "jet"\nlevels = [1.0]\n')
    probe = spacecraft.load(path)
    assert probe.name == "probe"
    assert probe.xml == tmp_path / "bus.xml"
    assert spacecraft.load(str(path)) == probe


def test_unknown_spacecraft_is_refused_with_the_nearest():
    with pytest.raises(ValueError, match="'two_bom' is not in the library; did you mean 'two_boom"):
        spacecraft.load("two_bom")


def test_missing_file_is_refused_by_its_path(tmp_path):
    with pytest.raises(ValueError, match=r"nowhere\.toml: No such file"):
        spacecraft.load(tmp_path / "nowhere.toml")


def test_every_fault_of_a_file_is_named_at_once(tmp_path):
    path = write(
        tmp_path,
        """
        xlm = "bus.xml"
        [[booms]]
        name = "left"
        root = "left_root"
        lenght = 7.5
        linear_density = 1.53
        bending_stiffness = nan
        [[thrusters]]
        name = "jet"
        levels = [-1.0]
        delay = {mean = 0.1, amplitude = 0.2}
        """,
    )
    with pytest.raises(ValueError, match=r"probe\.toml") as fault:
        spacecraft.load(path)
    message = str(fault.value)
    for part in (
        "xml: Field required",
        "xlm: unknown key; did you mean 'xml'?",
        "booms.0.length: Field required",
        "booms.0.lenght: unknown key; did you mean 'length'?",
        "booms.0.bending_stiffness: Input should be a finite number, got nan",
        "thrusters.0.levels: levels are amplitudes, all > 0",
        "thrusters.0.delay: the delay goes negative: amplitude 0.2 s > mean 0.1 s",
    ):
        assert part in message
    assert len(message.splitlines()) == 8  # the path, then one line a fault
