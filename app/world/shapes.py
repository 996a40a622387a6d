"""Shapes of the simulated bodies, made from a table as in a scene file.

A round shape is a profile turned about z. Its mesh is inscribed: 48 steps a turn keep it
within 1 mm of the true surface at a radius of 0.2 m.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.errors import WorldError, options
from app.messages import Array, freeze
from app.raycast import RigidMesh
from app.world.tables import Table, expect_keys, number, typed, vector

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


def make_shape(table: Table, folder: Path, where: str) -> Shape:
    """The shape that `table` describes; a mesh file is looked for in `folder`.

    Raises WorldError, beginning with `where`, for anything that cannot be used.
    """
    kind = table.get("kind")
    if kind is None:
        raise WorldError(f"{where}: shape has no kind; {options('', _MAKERS)}")
    if not isinstance(kind, str) or kind not in _MAKERS:
        raise WorldError(f"{where}: unknown shape kind {kind!r}; {options(str(kind), _MAKERS)}")
    return _MAKERS[kind](table, folder, f"{where}: {kind}")


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


def _make_box(table: Table, folder: Path, where: str) -> Shape:
    expect_keys(table, where, ["kind", "size_m"])
    size = vector(table, "size_m", where, positive=True)
    return Shape("box", tuple(map(float, size)), *_box(size))


def _make_panel(table: Table, folder: Path, where: str) -> Shape:
    expect_keys(table, where, ["kind", "size_m"], ["thickness_m"])
    size = vector(table, "size_m", where, length=2, positive=True)
    size = np.append(size, number(table, "thickness_m", where, 0.01, positive=True))
    return Shape("panel", tuple(map(float, size)), *_box(size))


def _make_sphere(table: Table, folder: Path, where: str) -> Shape:
    expect_keys(table, where, ["kind", "radius_m"])
    radius = number(table, "radius_m", where, positive=True)
    arc = np.linspace(0.0, np.pi, TURN // 2 + 1)
    profile = radius * np.column_stack([np.sin(arc), np.cos(arc)])
    return Shape("sphere", (radius,), *_turned(profile))


def _make_cylinder(table: Table, folder: Path, where: str) -> Shape:
    radius, length = _round(table, where)
    profile = np.array([[0, 0.5], [1, 0.5], [1, -0.5], [0, -0.5]]) * [radius, length]
    return Shape("cylinder", (radius, length), *_turned(profile))


def _make_capsule(table: Table, folder: Path, where: str) -> Shape:
    return capsule(*_round(table, where))


def _round(table: Table, where: str) -> tuple[float, float]:
    expect_keys(table, where, ["kind", "radius_m", "length_m"])
    return (
        number(table, "radius_m", where, positive=True),
        number(table, "length_m", where, positive=True),
    )


def _make_mesh(table: Table, folder: Path, where: str) -> Shape:
    expect_keys(table, where, ["kind", "file"], ["scale"])
    scale = number(table, "scale", where, 1.0, positive=True)
    path = folder / typed(table, "file", where, str, "")
    if not path.is_file():
        raise WorldError(f"{where}: file {path} is missing; put it there or mend 'file'")
    try:
        mesh = trimesh.load_mesh(path, process=False)
    except Exception as e:  # every format's reader raises its own kind
        why = " ".join(str(e).split())
        told = f"{where}: file {path} cannot be read ({why}); give STL, OBJ or GLB"
        raise WorldError(told) from e
    faces = np.array(getattr(mesh, "faces", ()), dtype=np.int64)
    if len(faces) == 0:
        raise WorldError(f"{where}: file {path} has no faces; export it as a surface mesh")
    vertices = np.array(mesh.vertices, dtype=np.float64) * scale
    if not np.isfinite(vertices).all():
        raise WorldError(f"{where}: file {path} has points at infinity; export it again")
    return Shape("mesh", (), vertices, faces)


_MAKERS: dict[str, Callable[[Table, Path, str], Shape]] = {
    "box": _make_box,
    "panel": _make_panel,
    "sphere": _make_sphere,
    "cylinder": _make_cylinder,
    "capsule": _make_capsule,
    "mesh": _make_mesh,
}
