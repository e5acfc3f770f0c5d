"""The regulator for a minimum on-time on MuJoCo: its bound, its limit cycles, its disturbances."""

import numpy as np
import pytest

from controllers.ivanova_sokolov import guaranteed_accuracy, kappa
from spacecraft_sim import mission, mjcf, spacecraft
from spacecraft_sim.chart import pulses
from spacecraft_sim.elastic_influence import elastic_model, influence
from spacecraft_sim.trajectory import peak

M0, J, LEAST = 0.02, 80.0, 0.5  # N m, kg m^2, s: rigid_bus about z
UNIT = M0 / J * LEAST**2  # of angles, rad
SCENARIOS = [
    "ivanova-sokolov", "ivanova-sokolov-sampled", "ivanova-sokolov-two-axes",
    "ivanova-sokolov-flexible",
]  # fmt: skip


def flown(name, *settings, plant="mujoco"):
    ready = mission.assemble(mission.load_scenario(name, settings))
    track = ready.fly(plant)
    return ready, track, [g.check(track) for g in ready.guarantees]


def at(F, e, waveform, *more):
    """Settings for F and e in units of the thrust."""
    return (
        f"controller.bias={F * M0!r}", f"controller.disturbance={e * M0!r}",
        f"disturbance.z.constant={F * M0!r}", f"disturbance.z.amplitude={e * M0!r}",
        f'disturbance.z.waveform="{waveform}"',
        f"initial.attitude=[0.0, 0.0, {-6 * guaranteed_accuracy(F, e) * UNIT!r}]", *more,
    )  # fmt: skip


def turning_points(track):
    """Angles at which the rate passes zero, in units of u0 Dt^2, with their times."""
    rate, found = track["rate_z"], []
    for i in np.flatnonzero(rate[:-1] * rate[1:] < 0):
        pair = slice(i, i + 2)
        size, when = peak(track.time[pair], track["attitude_z"][pair], rate[pair])
        found.append((when, np.copysign(size, track["attitude_z"][i]) / UNIT))
    return np.array(found)


# Steady left and right peaks over p0 and the period over Dt, exact parabolas, six digits.
CYCLES = {
    "with_rate": (-1.0, 1.0, 1.880089),
    "against_rate": (-0.927277, 0.655511, 1.672534),
    "leftmost": (-1.0, 0.626087, 1.608760),
    "rightmost": (-0.893023, 1.0, 1.826827),
}


@pytest.mark.parametrize("waveform", CYCLES)
def test_limit_cycles_on_mujoco_are_those_of_exact_parabolas(waveform):
    F, e = 2 / 3, 0.05
    p0 = guaranteed_accuracy(F, e)
    _, track, verdicts = flown("ivanova-sokolov", *at(F, e, waveform, "duration=60.0"))
    assert all(verdict.holds for verdict in verdicts)
    turns = turning_points(track)[-20:]
    left, right, period = CYCLES[waveform]
    x = turns[:, 1] / p0
    assert x[x < 0] == pytest.approx(left, abs=1e-6)  # as many digits as the reference has
    assert x[x > 0] == pytest.approx(right, abs=1e-6)
    assert np.diff(turns[x < 0, 0]) / LEAST == pytest.approx(period, abs=1e-6)
    assert pulses(track.time, track["thruster_z"])[1].min() >= LEAST - 1e-10


@pytest.mark.parametrize("rule", ["example_1", "example_2"])
@pytest.mark.parametrize(("F", "e"), [(2 / 3, 0.05), (0.8, 0.1), (0.8, 0.14), (0.9, 0.07)])
def test_the_worst_disturbance_comes_to_the_bound_and_not_over_it(F, e, rule):
    settings = at(F, e, "with_rate", "duration=150.0", f'controller.rule="{rule}"')
    _, track, verdicts = flown("ivanova-sokolov", *settings)
    late = track.time > 100.0
    worst, _ = peak(track.time[late], track["attitude_z"][late], track["rate_z"][late])
    # The right end is always reached, the left one where kappa1 <= kappa2; switchings are found to
    # 1e-11 s and what convergence has left is below 1e-6.
    assert 0.999 <= worst / UNIT / guaranteed_accuracy(F, e) <= 1 + 1e-6
    assert verdicts[0].holds
    assert min(kappa(F, e)) ** -2 == guaranteed_accuracy(F, e)


def test_a_negative_bias_is_mirrored_to_the_last_digits():
    one = flown("ivanova-sokolov", "duration=40.0")[1]
    other = flown(
        "ivanova-sokolov", "duration=40.0", "controller.bias=-0.016",
        "disturbance.z.constant=-0.016", "initial.attitude=[0.0, 0.0, 2.4e-5]",
    )[1]  # fmt: skip
    # At control steps: one of them has a row at 1e-11 s, where the rate takes its sign.
    _, i, j = np.intersect1d(one.time.round(9), other.time.round(9), return_indices=True)
    assert len(i) > 400
    # Switchings are found from either side, to 1e-11 s, at rates of 3e-5 rad/s.
    np.testing.assert_allclose(other["attitude_z"][j], -one["attitude_z"][i], atol=2e-15)


@pytest.mark.parametrize("name", SCENARIOS)
def test_shipped_scenarios_hold_on_both_plants(name):
    for plant in ("mujoco", "reduced"):
        _, track, verdicts = flown(name, plant=plant)
        assert [v.claim for v in verdicts if not v.holds] == []
        assert "diverged" not in track.meta


def test_the_printed_rule_is_fragile_and_the_guard_is_not():
    # Steadily a thousandth over the bound: 13.9 p0 by exact parabolas, without the guard.
    F, e = 2 / 3, 0.05
    steady = f"disturbance.z.constant={(F + 1.001 * e) * M0!r}"
    settings = at(F, e, "sine", "disturbance.z.amplitude=0.0", steady, "duration=150.0")
    p, worst = guaranteed_accuracy(F, e) * UNIT, {}
    for guarded in ("true", "false"):
        _, track, verdicts = flown("ivanova-sokolov", *settings, f"controller.guarded={guarded}")
        worst[guarded] = np.abs(track["attitude_z"][track.time > 100]).max() / p
        assert not verdicts[0].holds
        assert "|eps| <= e" in verdicts[0].failed[0].text
    assert worst["true"] < 1.01
    assert 12 < worst["false"] < 15


def test_the_elastic_disturbance_of_the_scenario_is_bounded_by_what_its_law_counts_on():
    scenario = mission.load_scenario("ivanova-sokolov-flexible")
    machine = spacecraft.load(scenario.spacecraft).with_parts(**scenario.changes())
    elastic = elastic_model(mjcf.compile(machine, timestep=0.01))
    torque = 5.0 * machine.thrusters[0].levels[0]  # the couple has an arm of 5 m
    bound = influence(elastic, torque=torque, dwell=0.5).bound[2]
    assert bound < scenario.controller["disturbance"] < 1.05 * bound


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        (("controller.disturbance=0.0041",), "must be below the acceleration of the thrust"),
        (("controller.bias=0.001",), "infinite"),
        (("controller.bias=0.0133333", "controller.disturbance=0.005"), "example_2"),
        (("thrusters.thruster_z.min_on_time=0.0", "thrusters.thruster_z.delay=0.1"),
         "minimum on-time"),
        (("controller.period=0.6",), "longer than the minimum on-time"),
    ],
)  # fmt: skip
def test_bad_input_is_refused_with_the_way_out(settings, words):
    with pytest.raises(ValueError, match=words):
        mission.assemble(mission.load_scenario("ivanova-sokolov", settings))
