"""Two runs beside each other: one table, one figure, one recording."""

import json
from dataclasses import replace

import numpy as np
import pytest
import rrd
from matplotlib.figure import Figure
from written import faults, texts

from spacecraft_sim import cli, pair_folder, plots_pair, run_pair, signal_groups
from spacecraft_sim.plots_panel import AXES
from spacecraft_sim.trajectory import Trajectory, channel_units

NAME = "efremov-nonlocal"
SETTINGS = {
    "one": ("duration=12.0",),
    "seed": ("duration=12.0", "initial.attitude_scatter=0.05", "seed=3"),
    "boom": ("duration=9.0", "booms.left.n_hinges=4", "simulation.timestep=0.01",
             "controller.attraction_level=0.0", "reduced.source='mjcf'"),
}  # fmt: skip


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """Folders of runs by name; the law differs in `local`, the machine in `free`."""
    base = tmp_path_factory.mktemp("pair")
    for name, settings in SETTINGS.items():
        cli.main(["run", NAME, "--out", str(base / name), "--set", *settings])
    cli.main(["run", "efremov-local", "--out", str(base / "local"), "--set", "duration=12.0"])
    free = ("spacecraft='two_boom_free'", "reduced.source='mjcf'", "duration=12.0",
            "controller.attraction_level=0.2")  # fmt: skip
    cli.main(["run", NAME, "--out", str(base / "free"), "--set", *free])
    for name, scenario in (("arm", "burkov-position"), ("axes", "sokolov-quasi-rigid")):
        words = ["run", scenario, "--out", str(base / name), "--set", "duration=1.5"]
        cli.main(words)
    return base


def compared(runs, a, b):
    return run_pair.pair(run_pair.read(runs / a), run_pair.read(runs / b))


def test_a_run_beside_itself_differs_in_nothing(runs):
    found = compared(runs, "one", "one")
    assert found.settings == ()
    assert found.figures
    assert found.claims
    for row in (*found.figures, *found.claims):
        assert row.difference == 0.0 or row.a is None, row
    assert any(row.a is None for row in found.claims)  # too short a flight for the end
    for difference in found.signals:
        assert difference.max_error == 0.0


def test_the_settings_that_differ_and_no_others(runs):
    rows = {row.what: (row.a, row.b) for row in compared(runs, "one", "seed").settings}
    assert rows == {"seed": (0, 3), "initial.attitude_scatter": (0.0, 0.05)}
    rows = {row.what: (row.a, row.b) for row in compared(runs, "one", "boom").settings}
    assert rows["duration"] == (12.0, 9.0)
    left = rows.pop("booms.left.n_hinges")
    assert left[1] == 4
    assert left[0] != 4
    others = {"simulation.timestep", "controller.attraction_level", "reduced.source"}
    assert set(rows) == {"duration", *others}


def test_two_laws_differ_in_their_parameters(runs):
    rows = {row.what: (row.a, row.b) for row in compared(runs, "one", "local").settings}
    assert rows["controller.law"] == ("efremov_nonlocal", "efremov_local")
    assert rows["controller.gain"][1] is None


def test_figures_are_those_of_the_trajectories(runs):
    found = compared(runs, "one", "seed")
    flights = [Trajectory.load(runs / name / "trajectory.parquet") for name in ("one", "seed")]
    rows = {row.what: row for row in found.figures}
    for row, values in (
        (rows["largest attitude"], [np.abs(f["attitude_z"]).max() for f in flights]),
        (rows["impulse spent by thruster_z"], [f["thruster_z_spent"][-1] for f in flights]),
        (rows["largest deflection of boom left"], [abs(f["left_tip_y"]).max() for f in flights]),
        (
            rows["changes of command of thruster_z"],
            [np.count_nonzero(np.diff(f["thruster_z_command"])) for f in flights],
        ),
    ):
        assert (row.a, row.b) == tuple(values)
        assert row.difference == values[1] - values[0]


def test_signals_are_compared_at_common_instants_as_b_minus_a(runs):
    found = {d.signal: d for d in compared(runs, "one", "seed").signals}
    a, b = (Trajectory.load(runs / name / "trajectory.parquet") for name in ("one", "seed"))
    _, i, j = np.intersect1d(a.time, b.time, return_indices=True)
    assert len(i) > 100
    wanted = np.abs(b["attitude_z"][j] - a["attitude_z"][i]).max()
    assert found["attitude_z"].max_error == wanted > 0.001


def test_claims_of_both_come_first_and_those_of_one_have_a_gap(runs):
    rows = compared(runs, "one", "local").claims
    claims = [{v.claim for v in run_pair.read(runs / n).verdicts} for n in ("one", "local")]
    both = [all(row.what in known for known in claims) for row in rows[:-1]]
    assert both == sorted(both, reverse=True)
    assert not all(both)
    assert rows[-1].what == "claims that hold"


@pytest.mark.parametrize(("a", "b"), [("one", "seed"), ("one", "local"), ("free", "boom")])
def test_the_command_writes_table_figure_and_recording(a, b, runs, tmp_path, capsys):
    out = tmp_path / "out"
    assert cli.main(["compare", str(runs / a), str(runs / b), "--out", str(out)]) == 0
    shown = capsys.readouterr().out
    assert "B - A" in shown
    assert "largest attitude [rad]" in shown
    assert {p.name for p in out.iterdir()} == {
        "comparison.json", "comparison.png", "recording.rrd"
    }  # fmt: skip
    assert (out / "comparison.png").read_bytes().startswith(b"\x89PNG")
    table = json.loads((out / "comparison.json").read_text())
    assert table["a"]["folder"].endswith(a)
    assert table["b"]["folder"].endswith(b)
    for group in ("settings", "figures", "claims"):
        for row in table[group]:
            assert {"what", "unit", "a", "b", "difference"} == set(row)
    entities = rrd.read(out / "recording.rrd")
    assert rrd.stores(out / "recording.rrd") == (1, 1)
    for key, name in (("A", a), ("B", b)):
        flight = Trajectory.load(runs / name / "trajectory.parquet")
        found = entities[f"/attitude/{key}"]
        np.testing.assert_allclose(found.time, flight.time, rtol=0, atol=1.1e-9)
        last = [
            flight[f"attitude_{axis}"][-1] for axis in "xyz" if f"attitude_{axis}" in flight.signals
        ]
        assert set(found.values["Scalars:scalars"][-1]) <= set(last)
        assert found.values["Scalars:scalars"][-1][-1] == flight["attitude_z"][-1]
        assert f"/relay/thruster_z/{key}_delivered" in entities
        assert entities[f"/world/{key}/bus"].time[-1] == pytest.approx(flight.time[-1])
    (page,) = entities["/verdicts"].static["TextDocument:text"]
    assert page.startswith("# A: ")
    for row in table["settings"]:
        assert row["what"] in page


def test_units_are_those_of_the_channels_and_booms_those_of_the_machine(runs):
    rows = {(row.what, row.unit) for row in compared(runs, "one", "seed").figures}
    assert ("impulse spent by thruster_z", "N m s") in rows
    assert ("largest deflection of boom left", "m") in rows


@pytest.mark.parametrize(
    ("a", "b"), [("one", "seed"), ("one", "local"), ("free", "boom"), ("boom", "arm"),
                 ("axes", "seed"), ("one", "one")]
)  # fmt: skip
def test_all_that_is_written_in_the_figure_can_be_read(a, b, runs, tmp_path, monkeypatch):
    kept, save = [], Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda f, *x, **k: (kept.append(f), save(f, *x, **k)))
    pair_folder.write(tmp_path, compared(runs, a, b), None)
    (figure,) = kept
    assert faults(figure) == []
    named = " ".join(words for words, _ in texts(figure))
    units = set()
    for key, name in (("A", a), ("B", b)):  # the channels of both
        found = channel_units(run_pair.read(runs / name).flight)
        units |= set(found.values())
        for channel in found:
            assert f"{key}: {channel}" in named
    thrusts = [words for words, _ in texts(figure) if words.startswith("Thrust as delivered, ")]
    assert len(thrusts) == 2
    assert all(unit in title for title in thrusts for unit in units)
    assert (units == {"N", "N m"}) == (a in ("free", "axes"))  # which have forces


def drawn(runs, monkeypatch, tmp_path, a, b):
    """The panels of the figure of two runs by title, and the figure."""
    kept, save = [], Figure.savefig
    monkeypatch.setattr(Figure, "savefig", lambda f, *x, **k: (kept.append(f), save(f, *x, **k)))
    pair_folder.write(tmp_path, compared(runs, a, b), None)
    return {axes.get_title(loc="left"): axes for axes in kept[0].axes}, kept[0]


def relay(end, busy=(0.0, 0.0), strength=1.0, period=0.5):
    """A flight whose relay stands still but for a while."""
    time = np.linspace(0.0, end, round(100 * end) + 1)
    inside = (busy[0] <= time) & (time < busy[1])
    thrust = strength * np.where(inside & (np.floor(time / period) % 2 == 1), 1.0, -1.0)
    signals = {"jet": thrust, "jet_command": thrust}
    return Trajectory(time=time, signals=signals, units=dict.fromkeys(signals, "N"))


def test_thrust_is_shown_where_it_changes_most():
    start, end = plots_pair.busiest([relay(100.0, (41.0, 53.0)), relay(120.0)])
    assert end - start == plots_pair.NEAR
    assert start == pytest.approx(41.0, abs=1.0)  # windows begin a twelfth of one apart
    # However strong: each is measured against its own peak.
    flights = relay(100.0, (60.0, 64.0), strength=50.0), relay(100.0, (30.0, 42.0), strength=0.1)
    assert plots_pair.busiest(flights)[0] == pytest.approx(30.0, abs=1.0)
    assert plots_pair.busiest([relay(20.0, (2.0, 9.0)), relay(900.0)]) == (0.0, 20.0)


def test_the_end_of_each_flight_is_shown_whatever_their_lengths():
    flights = relay(100.0, (90.0, 100.0)), relay(75.0, (70.0, 75.0))
    axes = Figure().add_subplot()
    plots_pair._thrust_at_the_end(axes, flights=(("A", flights[0]), ("B", flights[1])))
    low, high = axes.get_xlim()
    assert (low, high) == (-plots_pair.NEAR, 0.0)
    for flight, line in zip(flights, axes.lines, strict=True):
        x, y = map(np.asarray, line.get_data())
        assert x[0] <= low
        assert x[-1] == 0.0
        seen = flight.time >= flight.time[-1] + low
        changes = np.count_nonzero(np.diff(flight["jet"][seen]))
        assert np.count_nonzero(np.diff(y)) == changes > 5
    assert "A at 100 s and of B at 75 s" in axes.get_xlabel()


def test_a_weaker_thrust_has_a_scale_of_its_own():
    for ratio, count in ((2.0, 1), (50.0, 2)):
        figure = Figure()
        flights = ("A", relay(30.0, (0.0, 30.0))), ("B", relay(30.0, (0.0, 30.0), ratio))
        plots_pair._thrust(figure.add_subplot(), flights=flights)
        assert len(figure.axes) == count
        for axes, strength in zip(figure.axes, (1.0, ratio), strict=False):
            assert axes.get_ylim()[1] < 1.3 * (ratio if count == 1 else strength)
        assert figure.axes[0].get_legend_handles_labels()[1] == ["A: jet", "B: jet"]


def test_the_last_cycles_are_few():
    time = np.linspace(0.0, 1000.0, 100_001)
    turn = 2 * np.pi * time
    signals = {"quasi_rigid_angle_z": np.cos(turn), "quasi_rigid_rate_z": -np.sin(turn),
               "jet": np.sign(np.sin(turn)), "jet_command": np.sign(np.sin(turn))}  # fmt: skip
    flight = Trajectory(time=time, signals=signals, units=dict.fromkeys(signals, "rad"))
    axes, names = Figure().add_subplot(), ("quasi_rigid_angle_z", "quasi_rigid_rate_z")
    plots_pair._phase_plane(axes, flights=(("A", flight), ("B", flight)), names=names, late=True)
    for line in axes.lines:
        x, y = line.get_data()
        turns = np.ptp(np.unwrap(np.arctan2(y, x))) / (2 * np.pi)
        assert 1 <= turns <= plots_pair.CYCLES + 1  # the last one may have just begun


def test_axes_have_colours_and_smaller_swings_lie_over_larger_ones():
    time = np.linspace(0, 10, 101)
    sizes = {"rate_x": 1, "rate_y": 3, "rate_z": 2}
    signals = {name: size * np.sin(time) for name, size in sizes.items()}
    flight = Trajectory(time=time, signals=signals, units=dict.fromkeys(signals, "rad/s"))
    (group,) = signal_groups.groups((flight, flight), ())
    axes = Figure().add_subplot()
    plots_pair._history(axes, flights=(("A", flight), ("B", flight)), group=group)
    drawn = [line.get_color() for line in sorted(axes.lines, key=lambda line: line.get_zorder())]
    assert drawn == [AXES[axis][k] for k in (1, 0) for axis in "yzx"]


@pytest.mark.parametrize(("a", "b"), [("one", "one"), ("one", "arm"), ("one", "local")])
def test_no_half_of_the_page_is_blank(a, b, runs, monkeypatch, tmp_path):
    _, figure = drawn(runs, monkeypatch, tmp_path, a, b)
    boxes = [box for _, box in texts(figure)] + [axes.bbox for axes in figure.axes if axes.axison]
    page = figure.bbox
    for x in np.linspace(0.05, 0.95, 19):  # no upright strip is blank for half of the height
        here = [
            box
            for box in boxes
            if box.x0 <= (x + 0.05) * page.x1 and box.x1 >= (x - 0.05) * page.x1
        ]
        edges = np.sort([0.0, page.y1, *(y for box in here for y in (box.y0, box.y1))])
        assert np.diff(edges).max() < 0.5 * page.y1


def test_what_does_not_differ_is_said_to_be_identical_and_what_is_not_shared_to_be_so(runs):
    same = dict(run_pair.table(compared(runs, "one", "one")))
    assert [row[0] for row in same["settings"]] == ["identical"]
    assert [row[0] for row in same["signals"]] == ["identical"]
    other = dict(run_pair.table(compared(runs, "one", "arm")))
    assert [row[0] for row in other["signals"]] == ["no signal in common"]
    assert len(other["settings"]) > 10
    seed = dict(run_pair.table(compared(runs, "one", "seed")))
    assert "attitude_z" in [row[0] for row in seed["signals"]]
    found = compared(runs, "one", "one")
    spent = [replace(d, max_error=1.0 if d.unit.endswith("s") and "spent" in d.signal else 0.0)
             for d in found.signals]  # fmt: skip
    words = dict(run_pair.table(replace(found, signals=tuple(spent))))["signals"][0][0]
    assert words == "no angle, rate or deflection differs"


def test_the_printed_table_names_the_folders(runs, tmp_path, capsys):
    words = ["compare", str(runs / "one"), str(runs / "arm"), "--out", str(tmp_path / "out")]
    assert cli.main(words) == 0
    head = "".join(capsys.readouterr().out.split("settings")[0].split())  # a long path is broken
    assert f"A:{runs / 'one'}" in head
    assert f"B:{runs / 'arm'}" in head


@pytest.mark.parametrize("missing", ["scenario.toml", "trajectory.parquet"])
def test_what_is_not_the_folder_of_a_run_is_refused(missing, runs, tmp_path, capsys):
    for path in (runs / "one").iterdir():
        if path.name != missing:
            (tmp_path / path.name).write_bytes(path.read_bytes())
    out = tmp_path / "out"
    assert cli.main(["compare", str(runs / "one"), str(tmp_path), "--out", str(out)]) == 2
    message = capsys.readouterr().err
    assert str(tmp_path) in message
    assert missing in message
    assert not out.exists()


def test_an_old_folder_is_not_touched(runs, tmp_path, capsys):
    (tmp_path / "notes.txt").write_text("precious")
    words = ["compare", str(runs / "one"), str(runs / "seed"), "--out", str(tmp_path)]
    assert cli.main(words) == 2
    assert "exists already" in capsys.readouterr().err
    assert [p.name for p in tmp_path.iterdir()] == ["notes.txt"]
