"""Solids into mesh files: turned parts, their normals, the union as one watertight body.

What the robots' modelling scripts and the covers of a layout are made with. Lengths are
millimetres here, and metres in what is written. The same input gives the same bytes.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import trimesh
from manifold3d import CrossSection, Manifold, OpType

from app.messages import Array

Field = Callable[[Array], Array]  # points (N, 3) [mm] -> signed distance (N,) [mm]
Materials = Mapping[str, tuple[tuple[int, int, int], float, float]]  # sRGB, metallic, roughness


@dataclass(frozen=True, kw_only=True)
class Detail:
    """How finely a mesh is made.

    segments: of a full turn of a lathe.   tolerance: how far simplification may move a surface
    [mm].   ornaments: whether what only the eye wants is there.
    """

    segments: int
    ornaments: bool
    tolerance: float


VISUAL = Detail(segments=72, ornaments=True, tolerance=0.03)
BODY = Detail(segments=28, ornaments=False, tolerance=0.1)


@dataclass(frozen=True)
class Part:
    """A solid [mm] of one material, with the field it was made from (for its normals) and place."""

    material: str
    solid: Manifold
    field: Field | None = None
    place: Array | None = None

    def placed(self) -> Manifold:
        """The solid in its link's frame [mm]."""
        return self.solid if self.place is None else self.solid.transform(self.place)


def lathe(profile: Sequence[tuple[float, float]], detail: Detail, segments: int = 0) -> Manifold:
    """Solid of revolution about the third axis; `profile` holds (position, radius) upwards."""
    steps = profile if profile[0][0] < profile[-1][0] else profile[::-1]
    outline = [(0.0, steps[0][0]), *((r, z) for z, r in steps), (0.0, steps[-1][0])]
    return CrossSection([outline]).simplify(detail.tolerance).revolve(segments or detail.segments)


def frame(origin: Sequence[float], u: Sequence[float], w: Sequence[float]) -> Array:
    """(3, 4) transform from the frame (u, v, w) at `origin` to its link's."""
    u_, w_ = np.asarray(u, float), np.asarray(w, float)
    return np.column_stack([u_, np.cross(w_, u_), w_, np.asarray(origin, float)])


def gradient(field: Field, p: Array, step: float = 1e-3) -> Array:
    """Unit outward direction of a field at points (N, 3)."""
    g = np.stack([field(p + step * e) - field(p - step * e) for e in np.eye(3)], axis=1)
    return np.asarray(g / np.maximum(np.linalg.norm(g, axis=1, keepdims=True), 1e-12))


def arrays(solid: Manifold) -> tuple[Array, Any]:
    """Vertices (V, 3) [mm] and faces (F, 3) of a solid."""
    mesh = solid.to_mesh()
    return np.asarray(mesh.vert_properties[:, :3], float), np.asarray(mesh.tri_verts, np.int64)


def corner_normals(p: Array, f: Any, field: Field | None, crease: float = 30.0) -> Array:
    """Normals (F, 3, 3) at the corners of faces, smooth up to a crease angle [deg].

    Where the surface is the field's, the field's gradient is the exact normal: long triangles left
    by the cuts then shade as smoothly as the others. Elsewhere faces round a vertex are averaged.
    """
    a, b, c = p[f[:, 0]], p[f[:, 1]], p[f[:, 2]]
    area = np.cross(b - a, c - a)
    face = area / np.maximum(np.linalg.norm(area, axis=1, keepdims=True), 1e-12)
    # Weighted by the area of the flat a face belongs to: flats stay flat beside roundings.
    surface = trimesh.Trimesh(p, f, process=False)
    level = surface.face_adjacency[surface.face_adjacency_angles < np.radians(0.5)]
    flat = trimesh.graph.connected_component_labels(level, node_count=len(f))
    weight = np.repeat(np.bincount(flat, np.linalg.norm(area, axis=1))[flat], 3)
    corner, owner = f.ravel(), np.repeat(np.arange(len(f)), 3)
    order = np.argsort(corner, kind="stable")
    starts = np.searchsorted(corner[order], np.arange(len(p) + 1))
    normals = np.zeros((len(corner), 3))
    limit = np.cos(np.radians(crease))
    for k in range(len(p)):
        here = order[starts[k] : starts[k + 1]]
        n = face[owner[here]]
        normals[here] = ((n @ n.T > limit) * weight[here]) @ n
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-12)
    if field is not None:
        exact = gradient(field, p)[corner]
        on = np.abs(field(p)[corner]) < 0.2
        on &= np.einsum("ij,ij->i", exact, face[owner]) > np.cos(np.radians(55))
        normals[on] = exact[on]
    return normals.reshape(-1, 3, 3)


def write_visual(parts: Sequence[Part], path: Path, materials: Materials) -> int:
    """One geometry a material, each corner's vertex shared where position and normal agree."""
    scene = trimesh.Scene()
    for name, (rgb, metallic, roughness) in materials.items():
        corners = [_corners(part) for part in parts if part.material == name]
        if not corners:
            continue
        stacked = np.vstack(corners)
        keys = np.round(stacked * [1e6, 1e6, 1e6, 100, 100, 100]).astype(np.int64)
        _, first, index = np.unique(keys, axis=0, return_index=True, return_inverse=True)
        linear = [(v / 255) ** 2.2 for v in rgb]
        material = trimesh.visual.material.PBRMaterial(
            name=name,
            baseColorFactor=[*linear, 1.0],
            metallicFactor=metallic,
            roughnessFactor=roughness,
        )
        mesh = trimesh.Trimesh(
            stacked[first, :3],
            index.reshape(-1, 3),
            vertex_normals=stacked[first, 3:],
            visual=trimesh.visual.TextureVisuals(material=material),
            process=False,
        )
        scene.add_geometry(mesh, node_name=name, geom_name=name)
    data: bytes = scene.export(file_type="glb", include_normals=True)
    path.write_bytes(data)
    return len(data)


def write_body(parts: Sequence[Part], path: Path) -> int:
    """The union of all parts as one watertight solid."""
    whole = Manifold.batch_boolean([part.placed() for part in parts], OpType.Add)
    # Parts are simplified already: more of it here would press thin overlaps into sheets.
    p, f = arrays(whole.simplify(0.02))
    mesh = trimesh.Trimesh((p * 1e-3).astype(np.float32), f)
    if not mesh.is_volume:
        raise ValueError(f"{path.name} is not watertight: take another pitch or tolerance")
    data = mesh.export(file_type="stl")
    assert isinstance(data, bytes)
    path.write_bytes(data)
    return len(f)


def _corners(part: Part) -> Array:
    """(3 F, 6) position [m] and normal of every face's corners, in the link's frame."""
    p, f = arrays(part.solid)
    n = corner_normals(p, f, part.field).reshape(-1, 3)
    p = p[f.ravel()]
    if part.place is not None:
        p, n = p @ part.place[:, :3].T + part.place[:, 3], n @ part.place[:, :3].T
    return np.hstack([p * 1e-3, n])
