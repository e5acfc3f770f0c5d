"""Short flights with everything that a run folder is made of, for the tests of what is written."""

import functools
from dataclasses import dataclass

import numpy as np

from controllers import REGISTRY
from spacecraft_sim import drawing, mission
from spacecraft_sim.chart import Line, Map, Portrait, Region
from spacecraft_sim.compare import Comparison
from spacecraft_sim.drawing import Drawing
from spacecraft_sim.frames import suited_factor
from spacecraft_sim.trajectory import Trajectory

BOX = np.array([(-0.02, -0.01), (0.02, -0.01), (0.02, 0.01), (-0.02, 0.01), (-0.02, -0.01)])


@dataclass(frozen=True)
class Flown:
    mission: mission.Mission
    measured: Trajectory
    predicted: Trajectory
    drawing: Drawing
    comparison: Comparison


@dataclass(frozen=True)
class Charted:
    """A dead zone that brings charts."""

    thrusters: tuple[str, ...]
    sensors: tuple[str, ...] = ("attitude_z", "rate_z")
    period: float = 0.05

    @property
    def charts(self):
        lines = (
            Line(name="contour", points=BOX, look="bound"),
            Line(name="switching", points=np.array([(-1, 0.1), (np.nan, np.nan), (1, -0.1)])),
        )
        portrait = Portrait(
            name="plane",
            title="Contour & <flight>",
            signals=("attitude_z", "rate_z"),
            channel=self.thrusters[0],
            min_on_time=0.3,
            band=0.02,
            lines=lines,
            regions=(Region(name="inside", outline=BOX[:-1]),),
        )
        plane = Map(
            name="map",
            title="Where the law works",
            labels=("delay, s", "gain"),
            point=(0.2, 1.5),
            lines=(Line(name="border", points=np.array([(0.0, 1.0), (0.4, 2.0)])),),
            regions=(
                Region(name="stable", outline=np.array([(0.0, 1.0), (0.4, 1.0), (0.4, 2.0)])),
            ),
        )
        return portrait, plane

    def init(self):
        return None

    def step(self, t, y, memory):
        s = y[0] + 10 * y[1]
        return (0.0 if abs(s) < 0.005 else -1.0 if s > 0 else 1.0,), memory

    def events(self, t, y, memory):
        return ()


def charted(model, thrusters):
    """A law that brings charts."""
    return Charted(thrusters=("thruster_z",)), ()


LAWS = {**REGISTRY, "charted": charted}
ON_AN_AXIS = ("controller={law='charted'}", "initial.attitude=[0.0, 0.0, 0.01]")
FREE = ("spacecraft=two_boom_free", "reduced.source=mjcf", "initial.attitude=[0.1, 0.2, 0.01]")


@functools.cache
def flown(*settings, name="efremov-nonlocal"):
    """A flight of a shipped scenario with some keys changed."""
    ready = mission.assemble(mission.load_scenario(name, settings, LAWS), LAWS)
    measured, predicted = ready.fly(), ready.fly("reduced")
    model, machine = ready.mujoco.model.ptr, ready.machine
    factor = suited_factor(model, machine, predicted)
    return Flown(
        mission=ready,
        measured=measured,
        predicted=predicted,
        drawing=drawing.draw(model, machine, measured, factor=factor),
        comparison=ready.judge(measured, predicted),
    )
