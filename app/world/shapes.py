"""Shapes of the simulated bodies, made from a table as in a scene file.

A round shape is a profile turned about z. Its mesh is inscribed: 48 steps a turn keep it
within 1 mm of the true surface at a radius of 0.2 m.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import WorldError
from app.messages import Array, freeze
from app.raycast import RigidMesh
from app.surface import check_surface, read_surfaces
from app.toml import checked
from app.world.tables import (
    BoxShape,
    CapsuleShape,
    CylinderShape,
    MeshShape,
    PanelShape,
    ShapeTable,
    SphereShape,
)

TURN = 48  # steps of one turn
Mesh = tuple[Array, NDArray[np.int64]]


@dataclass(frozen=True, eq=False)
class Shape:
    """A body's form in its own frame, origin at its middle (a mesh keeps its own origin).

    kind and dims [m]: box (x, y, z), panel (width x, height y, thickness z), sphere (radius),
        cylinder (radius, length), capsule (radius, length of the straight part), both along
        z; mesh has no dims.
    vertices: (V, 3) [m].   faces: (F, 3), seen from outside counter-clockwise.
    hit:      the same mesh, ready for rays.
    """

    kind: str
    dims: tuple[float, ...]
    vertices: Array
    faces: NDArray[np.int64]
    hit: RigidMesh = field(init=False, repr=False)

    def __post_init__(self) -> None:
        freeze(self.vertices)
        freeze(self.faces)
        object.__setattr__(self, "hit", RigidMesh(self.vertices, self.faces))


def make_shape(table: Mapping[str, Any], folder: Path, where: str) -> Shape:
    """The shape that a table describes as in a scene file; see `shape_of`."""
    return shape_of(checked(table, ShapeTable, where, WorldError, "shape"), folder, where)


def shape_of(table: ShapeTable, folder: Path, where: str) -> Shape:
    """The shape of a scene's table; a mesh file is looked for in `folder`.

    Raises WorldError, beginning with `where`, for anything that cannot be used.
    """
    match table:
        case BoxShape(size_m=size):
            return Shape("box", size, *_box(np.array(size)))
        case PanelShape(size_m=(width, height), thickness_m=thickness):
            size = (width, height, thickness)
            return Shape("panel", size, *_box(np.array(size)))
        case SphereShape(radius_m=radius):
            arc = np.linspace(0.0, np.pi, TURN // 2 + 1)
            profile = radius * np.column_stack([np.sin(arc), np.cos(arc)])
            return Shape("sphere", (radius,), *_turned(profile))
        case CylinderShape(radius_m=radius, length_m=length):
            profile = np.array([[0, 0.5], [1, 0.5], [1, -0.5], [0, -0.5]]) * [radius, length]
            return Shape("cylinder", (radius, length), *_turned(profile))
        case CapsuleShape(radius_m=radius, length_m=length):
            return capsule(radius, length)
        case MeshShape():
            return _mesh(table, folder, f"{where}: mesh")


def capsule(radius: float, length: float) -> Shape:
    """A capsule along z: radius [m], length of its straight part [m]."""
    arc = np.linspace(0.0, np.pi / 2, TURN // 4 + 1)
    half = np.column_stack([radius * np.sin(arc), radius * np.cos(arc) + length / 2])
    profile = np.vstack([half, half[::-1] * [1, -1]])
    return Shape("capsule", (radius, length), *_turned(profile))


def _box(size: Array) -> Mesh:
    corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    faces = [(a, b, c) for a, b, c, _ in quads] + [(a, c, d) for a, _, c, d in quads]
    return corners * size / 2, np.array(faces, dtype=np.int64)


def _turned(profile: Array) -> Mesh:
    """Turn a profile (n, 2) of (radius, z) about z; it runs from the upper to the lower pole."""
    angle = np.arange(TURN) * (2 * np.pi / TURN)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.ones(TURN)])
    body = profile[1:-1]
    rows = [ring * [r, r, z] for r, z in body]
    poles = [[0.0, 0.0, profile[0, 1]], [0.0, 0.0, profile[-1, 1]]]
    top, bottom = TURN * len(body), TURN * len(body) + 1
    i = np.arange(TURN)
    j = (i + 1) % TURN
    last = TURN * (len(body) - 1)
    faces = [
        np.column_stack([np.full(TURN, top), i, j]),
        np.column_stack([np.full(TURN, bottom), last + j, last + i]),
    ]
    for upper in range(0, last, TURN):
        lower = upper + TURN
        faces.append(np.column_stack([upper + i, lower + i, lower + j]))
        faces.append(np.column_stack([upper + i, lower + j, upper + j]))
    return np.vstack([*rows, poles]), np.vstack(faces).astype(np.int64)


def _mesh(table: MeshShape, folder: Path, where: str) -> Shape:
    path = folder / table.file
    if not path.is_file():
        raise WorldError(f"{where}: file {path} is missing; put it there or mend 'file'")
    mesh = read_surfaces(path, WorldError, merge=False, where=f"{where}: file ").to_mesh()
    faces = np.array(mesh.faces, dtype=np.int64)
    vertices = np.array(mesh.vertices, dtype=np.float64) * table.scale
    check_surface(vertices, faces, f"{where}: file {path}", WorldError)
    return Shape("mesh", (), vertices, faces)
