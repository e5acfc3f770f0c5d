"""What the tests share: one small planar machine, and settings that keep runs repeatable."""

import os

os.environ.setdefault("MUJOCO_GL", "disabled")  # no display is needed or touched

from collections.abc import Callable

import hypothesis
import pytest

from spacecraft_sim import spacecraft

hypothesis.settings.register_profile(
    "hermetic", deadline=None, derandomize=True, database=None, print_blob=False
)
hypothesis.settings.load_profile("hermetic")

# The boom of Efremov et al. (2006), section 5: 1.53 kg/m, 35 N m^2, 7.5 m at a radius of 3 m.
BOOM = {"length": 7.5, "linear_density": 1.53, "bending_stiffness": 35.0}

HUB = """
<mujoco model="hub">
  <option gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody>
    <body name="bus">
      {joint}
      <inertial pos="0 0 0" mass="100" diaginertia="30 30 30"/>
      <site name="left_root" pos="3 0 0"/>
      <site name="right_root" pos="-3 0 0" quat="0 0 0 1"/>
      <site name="centre"/>
    </body>
  </worldbody>
  <actuator>{actuators}</actuator>
  <sensor>{sensors}</sensor>
</mujoco>
"""
HINGE = '<joint name="attitude_z" type="hinge" axis="0 0 1"/>'
FREE = '<freejoint name="bus"/>'
MOTOR = '<motor name="thruster_z" site="centre" gear="0 0 0 0 0 1"/>'
PLANAR_SENSORS = (
    '<jointpos name="attitude_z" joint="attitude_z"/><jointvel name="rate_z" joint="attitude_z"/>'
)
FREE_SENSORS = (
    '<framequat name="attitude" objtype="body" objname="bus"/><gyro name="rate" site="centre"/>'
)

Builder = Callable[..., spacecraft.Spacecraft]


@pytest.fixture(scope="session")
def machine(tmp_path_factory: pytest.TempPathFactory) -> Builder:
    """Builds a bus with two booms; keywords change the booms, `free` lets the bus float.

    `xml` is a pair of texts, of which the first is replaced by the second in the MJCF.
    """

    def build(
        *,
        free: bool = False,
        xml: tuple[str, str] = ("", ""),
        thruster: dict | None = None,
        booms: tuple[str, ...] = ("left", "right"),
        **changes: object,
    ) -> spacecraft.Spacecraft:
        text = HUB.format(
            joint=FREE if free else HINGE,
            actuators=MOTOR,
            sensors=FREE_SENSORS if free else PLANAR_SENSORS,
        )
        if xml[0]:
            assert xml[0] in text
            text = text.replace(*xml)
        path = tmp_path_factory.mktemp("hub") / "hub.xml"
        path.write_text(text, encoding="utf-8")
        channel = {"name": "thruster_z", "levels": [1.0, 3.0]} | (thruster or {})
        return spacecraft.Spacecraft.model_validate(
            {
                "name": "hub",
                "xml": path,
                "booms": [{"name": b, "root": f"{b}_root", **BOOM, **changes} for b in booms],
                "thrusters": [channel],
            }
        )

    return build
