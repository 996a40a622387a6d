"""Robots of the public collection `robot_descriptions`, an optional extra.

It fetches a description on first use, so it is imported only when one is asked for.
"""

from importlib import import_module
from pathlib import Path

from app.errors import RobotError

PREFIX = "robot_descriptions:"


def find_description(name: str) -> Path:
    """The URDF file of a description such as `panda_description`; it may be fetched now."""
    try:
        import_module("robot_descriptions")
    except ImportError as e:
        raise RobotError(
            f"{PREFIX}{name} needs the package robot_descriptions; "
            "install it: pip install 'flinch[descriptions]'"
        ) from e
    try:
        found = import_module(f"robot_descriptions.{name}")
    except ModuleNotFoundError as e:
        raise RobotError(
            f"robot_descriptions has no {name!r}; list them: python -m robot_descriptions list"
        ) from e
    except Exception as e:  # git, network and disk each have their own
        reason = " ".join(str(e).split())[:200]
        raise RobotError(
            f"{PREFIX}{name} cannot be fetched ({reason}); check the network and try again"
        ) from e
    path = getattr(found, "URDF_PATH", None)
    if path is None:
        raise RobotError(f"{PREFIX}{name} is no URDF; choose a description that has one")
    return Path(path)
