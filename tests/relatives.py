"""Relatives of shipped machines for tests: the generator of the scripts, compiled."""

import functools
import importlib.util
from pathlib import Path

import mujoco

from spacecraft_sim.elastic_influence import elastic_model
from spacecraft_sim.spacecraft import load

_PATH = Path(__file__).parent.parent / "scripts" / "support" / "relatives.py"


def generator():
    """The module of the scripts."""
    spec = importlib.util.spec_from_file_location("relatives_of_scripts", _PATH)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@functools.cache
def relative(tip, ratio, name="two_boom_3d"):
    """(compiled model, its structure) with tips of so many kg damped at that ratio."""
    model = mujoco.MjModel.from_xml_string(generator().mjcf(name, tip=tip, ratio=ratio))
    return model, elastic_model(model)


@functools.cache
def shipped(name):
    """(compiled model, its structure) of a shipped machine."""
    model = mujoco.MjModel.from_xml_path(str(load(name).xml))
    return model, elastic_model(model)
