"""The cell that a person names: a shipped one, a file of their own, or what a scene knows."""

from pathlib import Path

from app.assets import asset_folder
from app.cell.files import CellTable, load_cell
from app.cell.parts import Cell
from app.errors import ConfigError, options
from app.toml import read_toml
from app.world.scene import load_scene
from app.world.tables import SceneTable

FOLDERS = ("cells", "scenes")


def find_cell(name_or_path: str) -> Path:
    """The file of a shipped cell's or scene's name, or of a path to a `.toml` of either kind."""
    given = Path(name_or_path)
    if given.suffix == ".toml" and given.is_file():
        return given
    assets = asset_folder("static_assets")
    files = [f for folder in FOLDERS for f in sorted((assets / folder).glob("*.toml"))]
    for file in files:
        if file.stem == name_or_path:
            return file
    known = options(name_or_path, dict.fromkeys(f.stem for f in files))
    raise ConfigError(f"cell {name_or_path!r} is no file and no name in cells/ or scenes/; {known}")


def read_cell(path: Path) -> Cell:
    """The cell in a cell's file, or of a scene's.

    Raises a ConfigError or a WorldError naming the file, the entry and the remedy.
    """
    return load_scene(path).cell if is_scene(path) else load_cell(path)


def is_scene(path: Path) -> bool:
    """Does the file hold what only a scene has? Nothing learned is written to a scene."""
    only = set(SceneTable.__struct_fields__) - set(CellTable.__struct_fields__)
    return not only.isdisjoint(read_toml(path, dict, ConfigError))
