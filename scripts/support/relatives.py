"""Relatives of shipped machines: other tip masses and dampings at the same frequencies."""

import re
from pathlib import Path

from spacecraft_sim import library

_TIP, _RATIO = 2.0, 0.01  # kg at the end of each boom and its damping ratio, as shipped
_TIPS = {"two_boom_3d": 'mass="2"', "four_boom": 'mass="1"'}  # a tip, or either end of a cross-bar
_JOINT = re.compile(r'(<joint [^>]*stiffness=)"(\S+)" damping="(\S+)"')
_TOML = """title = "{name} with tips of {tip:g} kg, damped at {ratio:g} of critical"
xml = "relative.xml"
booms = []
"""
_THRUSTER = """
[[thrusters]]
name = "thruster_{axis}"
actuators = ["thruster_{axis}_{ends[0]}", "thruster_{axis}_{ends[1]}"]
levels = [{level!r}]
min_on_time = {dwell!r}
"""
_ENDS = {"x": ("top", "bottom"), "y": ("top", "bottom"), "z": ("front", "back")}


def mjcf(name: str, *, tip: float, ratio: float) -> str:
    """Returns the MJCF of a relative.

    Args:
        name: The shipped machine, two_boom_3d or four_boom.
        tip: Mass at the end of each boom, kg.
        ratio: Damping over critical damping, with the bus held.
    """
    path = library.folder("models") / name / f"{name}.xml"
    scale = tip / _TIP
    bare = _TIPS[name]
    mass = float(bare.split('"')[1]) * scale

    def joint(found: re.Match[str]) -> str:
        stiffness, damping = float(found[2]) * scale, float(found[3]) * scale * ratio / _RATIO
        return f'{found[1]}"{stiffness!r}" damping="{damping!r}"'

    return _JOINT.sub(joint, path.read_text(encoding="utf-8")).replace(bare, f'mass="{mass!r}"')


def write(
    folder: Path, name: str, *, tip: float, ratio: float, torque: float, dwell: float
) -> Path:
    """Writes a relative as a spacecraft with ideal thrusters.

    Args:
        folder: An existing folder.
        name: The shipped machine, two_boom_3d or four_boom.
        tip: Mass at the end of each boom, kg.
        ratio: Damping over critical damping, with the bus held.
        torque: M0 of each channel, N m.
        dwell: Minimum on-time of each, s.

    Returns:
        Its TOML file.
    """
    (folder / "relative.xml").write_text(mjcf(name, tip=tip, ratio=ratio), encoding="utf-8")
    thrusters = [
        _THRUSTER.format(axis=axis, ends=ends, level=torque / 2, dwell=dwell)
        for axis, ends in _ENDS.items()
    ]
    text = _TOML.format(name=name, tip=tip, ratio=ratio) + "".join(thrusters)
    path = folder / "relative.toml"
    path.write_text(text, encoding="utf-8")
    return path
