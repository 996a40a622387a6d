"""Scene files: a cell, its people and its goal, in TOML.

Lengths in metres, angles in degrees, base frame: x ahead of the arm at its home posture, y to
its left, z up from the table top on which the base stands.
"""

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from msgspec.structs import replace

from app.assets import asset_folder, find_asset
from app.cell.parts import Cell
from app.errors import WorldError
from app.messages import Array, Goal, freeze
from app.poses import pose
from app.toml import read_toml
from app.world.entries import body_of, crop_of, person_of, plane_of
from app.world.people import people_instead
from app.world.tables import BodyTable, CropTable, PersonTable, PlaneTable, SceneTable
from app.world.world import Body


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene file.

    bodies:  for a `World`.   cell: what of them is known and static, with crops and planes.
    goal:    where the tool should go at first, None = stay at home.
    home:    (n,) [rad] posture to begin in, None = the robot's own.
    robot:   name of the robot that `home` is a posture of; another one begins in its own.
             Empty: of whichever robot comes.
    """

    name: str
    title: str
    bodies: tuple[Body, ...]
    cell: Cell
    goal: Goal | None
    home: Array | None
    robot: str = ""


def find_scene(name_or_path: str) -> Path:
    """The file of a shipped scene's name, or of a path to a `.toml`."""
    return find_asset(name_or_path, asset_folder("static_assets") / "scenes", ".toml", WorldError)


def load_scene(path: Path, seed: int = 0, people: str = "") -> Scene:
    """The scene in a file; `seed` varies the people that have a seed of their own.

    people: who is there instead of the scene's own, see `app.world.people`.
    Raises WorldError naming the file, the entry, the key and the remedy.
    """
    return scene_of(read_scene(path), path, seed, people)


def read_scene(path: Path) -> SceneTable:
    """What stands in a file, for who changes it before it becomes a scene."""
    return read_toml(path, SceneTable, WorldError, path.name)


def scene_of(table: SceneTable, path: Path, seed: int = 0, people: str = "") -> Scene:
    """The scene that a table describes; `path` names it, and its folder has its files."""
    where, folder = path.name, path.parent
    table = replace(table, person=people_instead(table.person, people))
    for kind, entries in (
        ("body", table.body), ("person", table.person),
        ("crop", table.crop), ("plane", table.plane),
    ):  # fmt: skip
        _check_names(entries, f"{where}: {kind}")
    read = [body_of(entry, folder, f"{where}: body {entry.name!r}") for entry in table.body]
    bodies = [body for body, _ in read]
    boxes = [box for _, box in read if box is not None]
    for person in table.person:
        bodies += person_of(person, folder, seed, f"{where}: person {person.name!r}")
    boxes += map(crop_of, table.crop)
    goal, home = table.goal, table.home_deg
    return Scene(
        name=path.stem,
        title=table.title,
        bodies=tuple(bodies),
        cell=Cell(table.title, tuple(boxes), tuple(map(plane_of, table.plane))),
        goal=None if goal is None else Goal(pose(goal.position_m, goal.rpy_deg)),
        home=None if home is None else freeze(np.radians(home)),
        robot=table.robot,
    )


def _check_names(
    entries: Iterable[BodyTable | PersonTable | CropTable | PlaneTable], where: str
) -> None:
    seen = set()
    for entry in entries:
        if entry.name in seen:
            raise WorldError(f"{where} {entry.name!r} comes twice; rename one")
        seen.add(entry.name)
