"""Where the models and scenarios that come with the package lie."""

from pathlib import Path

_PACKAGE = Path(__file__).parent


def folder(kind: str) -> Path:
    """Returns the folder of the shipped `models` or `scenarios`.

    An installed wheel carries them inside the package; a checkout has them beside it.

    Args:
        kind: `models` or `scenarios`.
    """
    inside = _PACKAGE / "data" / kind
    beside = {"models": "models", "scenarios": "scripts/scenarios"}[kind]
    return inside if inside.is_dir() else _PACKAGE.parent / beside


def spacecraft_names() -> list[str]:
    """Returns the names of the shipped spacecraft."""
    return sorted(path.parent.name for path in folder("models").glob("*/*.toml"))


def scenario_names() -> list[str]:
    """Returns the names of the shipped scenarios."""
    return sorted(path.stem for path in folder("scenarios").glob("*.toml"))
