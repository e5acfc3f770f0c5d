"""A physical testbed in MuJoCo for control theorems about flexible spacecraft.

`load(name)` returns a scenario as a dm_control environment; `beam` has the closed forms of booms.
"""

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from spacecraft_sim.simulate import Environment

__all__ = ["load"]


def load(name: str, *settings: str) -> "Environment":
    """Returns the environment of a scenario on the MuJoCo plant, the law closed inside its task.

    Args:
        name: Name of a shipped scenario, or path of a TOML file.
        *settings: `key=value` assignments, as in "initial.boom_amplitude=0.0".

    Raises:
        ValueError: If the scenario is not valid.
    """
    from spacecraft_sim.versions import require_supported_mujoco

    require_supported_mujoco()
    from spacecraft_sim import mission

    return mission.assemble(mission.load_scenario(name, settings)).environment()


def __getattr__(name: str) -> Any:
    """Gives `spacecraft_sim.beam` without an import of its own."""
    if name == "beam":
        import importlib

        return importlib.import_module("spacecraft_sim.beam")
    raise AttributeError(f"module 'spacecraft_sim' has no attribute {name!r}")
