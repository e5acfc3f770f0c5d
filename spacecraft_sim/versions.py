"""Versions of the libraries that decide a trajectory's last bits."""

import platform
from importlib.metadata import version

_DECISIVE = ("spacecraft-sim", "mujoco", "dm-control", "numpy", "scipy")


def versions() -> dict[str, str]:
    """Returns the versions of Python and of the libraries that compute."""
    return {"python": platform.python_version(), **{name: version(name) for name in _DECISIVE}}


def require_supported_mujoco(installed: str | None = None) -> None:
    """Refuses MuJoCo 4, with which dm_control cannot be imported.

    Args:
        installed: Version to judge; the installed one if left out.

    Raises:
        ValueError: Saying what to install.
    """
    installed = version("mujoco") if installed is None else installed
    if int(installed.split(".")[0]) >= 4:
        raise ValueError(
            f"MuJoCo {installed} is installed, but dm_control does not work with MuJoCo 4; "
            'run: pip install "mujoco>=3.17,<4"'
        )
