"""Scene files: a cell, its people and its goal, in TOML.

Lengths in metres, angles in degrees, base frame: x ahead of the arm at its home posture, y to
its left, z up from the table top on which the base stands.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.assets import asset_folder, find_asset
from app.cell.parts import Cell
from app.errors import WorldError
from app.messages import Array, Goal, freeze
from app.toml import read_toml
from app.world.entries import (
    entries,
    read_angles,
    read_body,
    read_crop,
    read_person,
    read_plane,
    read_preset,
)
from app.world.person import person_bodies
from app.world.tables import expect_keys, pose, typed
from app.world.world import Body

KEYS = ("body", "person", "crop", "plane", "goal", "home_deg", "robot", "preset")
PRESETS: Mapping[str, Mapping[str, Any]] = {  # where a scene names none
    "ball": {"kind": "sphere", "radius_m": 0.10},
    "box": {"kind": "box", "size_m": [0.20, 0.20, 0.30]},
    "post": {"kind": "cylinder", "radius_m": 0.05, "length_m": 1.0},
    "arm": {"kind": "capsule", "radius_m": 0.05, "length_m": 0.40},
    "panel": {"kind": "panel", "size_m": [0.60, 0.60]},
}


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene file.

    bodies:  for a `World`.   cell: what of them is known and static, with crops and planes.
    goal:    where the tool should go at first, None = stay at home.
    home:    (n,) [rad] posture to begin in, None = the robot's own.
    robot:   name of the robot that `home` is a posture of; another one begins in its own.
             Empty: of whichever robot comes.
    presets: shape tables by name, which the page offers as new obstacles.
    """

    name: str
    title: str
    bodies: tuple[Body, ...]
    cell: Cell
    goal: Goal | None
    home: Array | None
    presets: Mapping[str, Mapping[str, Any]]
    robot: str = ""


def find_scene(name_or_path: str) -> Path:
    """The file of a shipped scene's name, or of a path to a `.toml`."""
    return find_asset(name_or_path, asset_folder("static_assets") / "scenes", ".toml", WorldError)


def load_scene(path: Path, seed: int = 0) -> Scene:
    """The scene in a file; `seed` varies the people that have a seed of their own.

    Raises WorldError naming the file, the entry, the key and the remedy.
    """
    table = read_toml(path, dict, WorldError)
    where, folder = path.name, path.parent
    expect_keys(table, where, ["title"], KEYS)

    read = [read_body(entry, folder, here) for entry, here in entries(table, "body", where)]
    bodies = [body for body, _ in read]
    boxes = [box for _, box in read if box is not None]
    for entry, here in entries(table, "person", where):
        bodies += person_bodies(read_person(entry, seed, here))
    boxes += [read_crop(entry, here) for entry, here in entries(table, "crop", where)]
    planes = [read_plane(entry, here) for entry, here in entries(table, "plane", where)]
    named = entries(table, "preset", where)
    presets = {entry["name"]: read_preset(entry, folder, here) for entry, here in named}

    goal = None
    if "goal" in table:
        entry = typed(table, "goal", where, dict, {})
        expect_keys(entry, f"{where}: goal", ["position_m"], ["rpy_deg"])
        goal = Goal(freeze(pose(entry, f"{where}: goal")))
    title = typed(table, "title", where, str, "")
    return Scene(
        name=path.stem,
        title=title,
        bodies=tuple(bodies),
        cell=Cell(title, tuple(boxes), tuple(planes)),
        goal=goal,
        home=read_angles(table, "home_deg", where),
        presets=presets or PRESETS,
        robot=typed(table, "robot", where, str, ""),
    )
