"""The covers of a layout to print: one STL a ring, millimetres, its axis upwards."""

from pathlib import Path

import numpy as np
import trimesh

from app.errors import RobotError
from app.robot.cover_solid import cover
from app.robot.covers import shapes_of
from app.robot.meshes import BodyMesh
from app.robot.model import Robot
from app.robot.skin_file import SkinTable
from app.robot.solids import VISUAL, arrays
from app.toml import read_toml


def write_prints(layout: Path, robot: Robot, folder: Path) -> list[Path]:
    """Write `cover-RING.stl` of every covered ring of a layout into `folder`.

    robot: bare, for the bores. Raises `RobotError` where a cover does not fit.
    """

    def body_of(link: str) -> BodyMesh:
        return robot.bodies[robot.link_index(link)]

    table, out = read_toml(layout, SkinTable, RobotError), []
    covered = [r for r in table.ring if r.cover]
    shapes = shapes_of(table, layout, body_of)
    for link in dict.fromkeys(r.link for r in covered):
        for ring, shape in zip((r for r in covered if r.link == link), shapes[link], strict=True):
            vertices, faces = arrays(cover(shape, VISUAL)[0].solid)
            lying = vertices - [0.0, 0.0, vertices[:, 2].min()]
            path = folder / f"cover-{ring.name}.stl"
            trimesh.Trimesh(lying.astype(np.float32), faces, process=False).export(path)
            out.append(path)
    return out
