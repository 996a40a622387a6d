"""Which file a layout's name means, and what stands in it."""

from pathlib import Path

from app.assets import asset_folder
from app.errors import RobotError
from app.robot.skin_file import SkinTable
from app.toml import read_toml

NONE = "none"


def find_layout(wanted: str, folder: Path, robot: str) -> Path:
    """The file of a layout by path, by name in `folder/skin`, or as ROBOT/LAYOUT of another one.

    folder, robot: whose layouts are looked through first, for messages as well.
    """
    inside = (folder / wanted, folder / "skin" / f"{wanted}.toml")
    for path in (Path(wanted), *inside, *_of_another(wanted)):
        if path.is_file():
            return path
    known = ", ".join(sorted(p.stem for p in (folder / "skin").glob("*.toml")))
    raise RobotError(
        f"skin {wanted!r} is neither a file nor a layout of {robot}; known: {known or 'none'}"
    )


def read_layout(path: Path) -> SkinTable:
    """A layout's tables; raises `RobotError` naming file, entry, key and remedy."""
    return read_toml(path, SkinTable, RobotError)


def _of_another(wanted: str) -> tuple[Path, ...]:
    robot, _, layout = wanted.partition("/")
    folder = asset_folder("robots") / robot / "skin"
    return (folder / f"{layout}.toml",) if layout and folder.is_dir() else ()
