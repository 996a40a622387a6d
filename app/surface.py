"""Mesh files, and surfaces of triangles, checked before anything native is given them.

A face that points outside its vertices, a corner at infinity or a body without any area make
compiled code read where nothing is, or work for minutes. What a mesh file refers to is read only
from its own folder.
"""

from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from trimesh.resolvers import FilePathResolver

from app.errors import FlinchError
from app.messages import Array
from app.text_file import check_file

KINDS = ("stl", "obj", "dae", "glb", "gltf", "ply", "off")
LARGEST = 256 * 2**20  # bytes of a file
MOST = 4_000_000  # faces of a surface
FAR = 1000.0  # [m] from its frame: the largest robots and cells are a tenth of that
LEAST = 1e-9  # [m] height of a face that has an area


def read_surfaces(
    path: Path, error: type[FlinchError], merge: bool = True, where: str = ""
) -> trimesh.Scene:
    """The meshes of a file; raises `error` in one line that begins with `where`, and the path.

    merge: make one vertex of those that lie at one place.
    """
    name = f"{where}{path}"
    kind = path.suffix.lower().removeprefix(".")
    if kind not in KINDS:
        raise error(
            f"{name}: a mesh file of this kind is not read; export one of {', '.join(KINDS)}"
        )
    check_file(path, error, LARGEST)
    try:
        with path.open("rb") as file:
            # unprocessed: trimesh would leave out what lies at infinity without a word
            scene = trimesh.load_scene(
                file, file_type=kind, resolver=FilePathResolver(str(path)), process=False
            )
    except Exception as e:  # every format has its own parser and its own errors
        why = " ".join(str(e).split())[:200] or type(e).__name__
        raise error(f"{name}: not a readable mesh ({why}); export it again") from e
    for mesh in scene.geometry.values():
        if isinstance(mesh, trimesh.Trimesh):
            vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
            _check_indices(vertices, faces, name, error)
            if not np.isfinite(vertices[faces]).all():
                raise error(f"{name} has points at infinity; export it again")
            if merge:
                mesh.process()
    return scene


def check_surface(
    vertices: Array, faces: NDArray[np.int64], where: str, error: type[FlinchError]
) -> None:
    """Raises `error`, beginning with `where`, unless vertices (V, 3) [m] and faces (F, 3) make a
    surface that can be measured: finite, near, and with an area."""
    _check_indices(vertices, faces, where, error)
    if len(faces) == 0:
        raise error(f"{where} has no faces; export it as a triangle mesh")
    if len(faces) > MOST:
        raise error(f"{where} has {len(faces)} faces; simplify it to {MOST} at most")
    corners = vertices[faces]
    if not np.isfinite(corners).all():
        raise error(f"{where} has points at infinity; export it again")
    farthest = float(np.abs(corners).max())
    if farthest > FAR:
        raise error(
            f"{where} reaches {farthest:.3g} m from its frame; mend its units, or the vertex that "
            f"lies beyond {FAR:g} m"
        )
    a, b = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    double = np.linalg.norm(np.cross(a, b), axis=1)
    longest = np.sqrt(np.maximum(np.maximum((a * a).sum(1), (b * b).sum(1)), ((b - a) ** 2).sum(1)))
    if not (double > LEAST * longest).any():
        raise error(f"{where} has no face with an area; export it as a solid")


def _check_indices(
    vertices: Array, faces: NDArray[np.int64], where: str, error: type[FlinchError]
) -> None:
    if len(faces) and not 0 <= faces.min() <= faces.max() < len(vertices):
        raise error(
            f"{where}: a face names vertex {faces.max() if faces.min() >= 0 else faces.min()}, "
            f"there are {len(vertices)}; export it again"
        )
