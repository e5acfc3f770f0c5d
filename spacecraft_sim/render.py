"""Frames of a recorded flight from MuJoCo's own renderer; runs as a process of its own.

    python -m spacecraft_sim.render probe
    python -m spacecraft_sim.render frames FOLDER CAMERA WIDTH HEIGHT START STEP COUNT

OpenGL without a display is chosen by MUJOCO_GL before MuJoCo is imported and can end a process
that lacks it, so the program itself never loads it. Raw RGB goes to the standard output.
"""

# pyright: reportAttributeAccessIssue=false, reportMissingImports=false
# (MuJoCo is a compiled module without type stubs)

import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import mujoco
import numpy as np

from spacecraft_sim import config, drawing, mjcf, sketch, spacecraft
from spacecraft_sim.checks import choices
from spacecraft_sim.drawing import turned
from spacecraft_sim.scenario import Scenario
from spacecraft_sim.trajectory import Trajectory

Array = np.ndarray

_TINY = "<mujoco><worldbody><geom size='1'/></worldbody></mujoco>"
_PLUME = 0.16  # length of a plume, as a share of the machine's extent
_FLAMES = (((1.0, 0.30, 0.04, 0.55), 1.0), ((1.0, 0.80, 0.35, 0.9), 0.5))  # colour, share of length
_SAMPLES = 8  # a pixel: booms are thinner than one


def machine_of(folder: Path) -> spacecraft.Spacecraft:
    """Returns the spacecraft that flew on MuJoCo.

    Args:
        folder: The folder of a run.

    Raises:
        ValueError: If there is no resolved scenario in it.
    """
    path = folder / "scenario.toml"
    scenario = config.validate(Scenario, config.read(path), where=str(path))
    nominal = spacecraft.load(scenario.spacecraft).with_parts(**scenario.changes())
    return nominal.with_parts(**scenario.actual_changes())


def frames(folder: Path, camera: str, size: tuple[int, int], times: Array) -> Iterator[Array]:
    """Renders a flight between its recorded rows, the coordinates being linear between two.

    Args:
        folder: The folder of the run.
        camera: A camera of the machine's scene; if empty `side` if there is one, else the first.
        size: Width and height, pixels.
        times: Instants, s.

    Yields:
        Pictures, shape (height, width, 3), bytes.

    Raises:
        ValueError: If there is no such run or camera.
    """
    machine, flight = machine_of(folder), Trajectory.load(folder / "trajectory.parquet")
    model = mjcf.assemble(machine).compile()
    cameras = [model.camera(k).name for k in range(model.ncam)]
    if not cameras:
        raise ValueError(f"{machine.xml}: has no camera; add a <camera> to its world")
    camera = camera or ("side" if "side" in cameras else cameras[0])
    if camera not in cameras:
        raise ValueError(choices("camera", camera, cameras, where=machine.xml.name))
    visual = model.vis.global_
    visual.offwidth, visual.offheight = np.maximum(size, [visual.offwidth, visual.offheight])
    model.vis.quality.offsamples = _SAMPLES
    model.site_rgba[:, 3] = 0.0
    drawn = drawing.draw(model, machine, flight, frames=2)
    plumes = [
        (j, {s: sketch.exhausts(j, drawn.shapes, s) for s in (-1.0, 1.0)}) for j in drawn.jets
    ]
    coordinates = [flight[name] for name in list(flight.signals)[-model.nq :]]
    data, (width, height) = mujoco.MjData(model), size
    with mujoco.Renderer(model, height, width) as renderer:
        for time in times:
            row = int(np.searchsorted(flight.time, time, side="right")) - 1
            data.qpos[:] = [np.interp(time, flight.time, values) for values in coordinates]
            mujoco.mj_kinematics(model, data)
            mujoco.mj_camlight(model, data)
            renderer.update_scene(data, camera=camera)
            # Nothing to fall on, and more than half of the time.
            renderer.scene.flags[mujoco.mjtRndFlag.mjRND_SHADOW] = 0
            for jet, exhausts in plumes:
                if level := float(np.sign(flight[jet.channel][row])):
                    _plume(renderer.scene, model, data, jet.body, exhausts[level])
            yield renderer.render()


def _plume(scene, model, data, name: str, exhausts: Sequence[tuple[Array, Array]]) -> None:
    """Adds what blows out of a body."""
    body = model.body(name).id
    place, turn = data.xpos[body], data.xquat[body]
    length = _PLUME * model.stat.extent
    for point, way in exhausts:
        away = turned(turn, way)
        matrix, start = np.zeros(9), place + turned(turn, point)
        mujoco.mju_quat2Mat(matrix, _onto(away))
        for color, share in _FLAMES:
            if scene.ngeom == scene.maxgeom:
                return
            half = 0.5 * share * length
            mujoco.mjv_initGeom(
                scene.geoms[scene.ngeom],
                mujoco.mjtGeom.mjGEOM_ELLIPSOID,
                np.array([0.16 * half, 0.16 * half, half]),
                start + half * away,
                matrix,
                np.array(color, dtype=np.float32),
            )
            scene.geoms[scene.ngeom].emission = 0.8
            scene.geoms[scene.ngeom].specular = 0.0
            scene.ngeom += 1


def _onto(way: Array) -> Array:
    """The quaternion that turns the z axis onto a unit vector."""
    quaternion = np.zeros(4)
    mujoco.mju_quatZ2Vec(quaternion, way)
    return quaternion


def probe() -> str:
    """Renders one small frame; returns what renders."""
    with mujoco.Renderer(mujoco.MjModel.from_xml_string(_TINY), 32, 32) as renderer:
        renderer.render()
        from OpenGL import GL

        return bytes(GL.glGetString(GL.GL_RENDERER) or b"unknown").decode()


def main(words: Sequence[str]) -> int:
    """Writes what is asked for to the standard output.

    Args:
        words: `probe`, or `frames` with folder, camera, width, height, start, step and count.
    """
    if words[0] == "probe":
        sys.stdout.write(f"{probe()}\n")
        return 0
    folder, camera, width, height, start, step, count = words[1:]
    times = float(start) + float(step) * np.arange(int(count))
    try:
        for picture in frames(Path(folder), camera, (int(width), int(height)), times):
            sys.stdout.buffer.write(picture.tobytes())
    except ValueError as error:
        sys.stderr.write(f"{error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
