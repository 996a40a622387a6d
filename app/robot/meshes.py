"""Meshes of a URDF, in link frames, read through yourdfpy and trimesh.

Bodies (`collision` entries) are what distances are measured to and rays are cast against;
visuals are what the page shows. Paths may be relative to the URDF or `package://`.
"""

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import trimesh
import yourdfpy
from numpy.typing import NDArray

from app.errors import RobotError, options
from app.messages import Array, freeze


@dataclass(frozen=True, eq=False, slots=True)
class BodyMesh:
    """A closed surface: vertices (V, 3) [m] and faces (F, 3), link frame, read-only."""

    vertices: Array
    faces: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Description:
    """The URDF's links and where their meshes are."""

    path: Path
    links: dict[str, Any] = field(repr=False)

    @property
    def body_links(self) -> tuple[str, ...]:
        """Links that have a collision entry, in the URDF's order."""
        return tuple(name for name, link in self.links.items() if link.collisions)

    def body(self, link: str) -> BodyMesh:
        """All collision shapes of a link as one surface; a link without one is refused."""
        entries = self._link(link).collisions
        if not entries:
            raise RobotError(
                f"{self.path}: link {link!r} has no collision mesh, so nothing can be kept clear "
                "of it; add one or leave the link out of `links` in robot.toml"
            )
        parts = [m for e in entries for m in self._meshes(e, link)]
        mesh: Any = trimesh.util.concatenate(parts)
        return BodyMesh(
            freeze(np.array(mesh.vertices, dtype=np.float64)),
            freeze(np.array(mesh.faces, dtype=np.int64)),
        )

    def visual(self, link: str) -> trimesh.Scene:
        """The visual meshes of a link, with their materials."""
        entry = self._link(link)
        scene = trimesh.Scene()
        for e in entry.visuals or entry.collisions:
            for mesh in self._meshes(e, link):
                scene.add_geometry(mesh)
        return scene

    def _link(self, name: str) -> Any:
        if name not in self.links:
            raise RobotError(f"{self.path}: no link {name!r}; {options(name, self.links)}")
        return self.links[name]

    def _meshes(self, entry: Any, link: str) -> list[trimesh.Trimesh]:
        """An entry's geometry in the link frame."""
        g = entry.geometry
        T = np.eye(4) if entry.origin is None else np.asarray(entry.origin)
        if g.mesh is not None:
            meshes = self._load(g.mesh.filename, link)
            scale = np.ones(3) if g.mesh.scale is None else np.broadcast_to(g.mesh.scale, 3)
            T = T @ np.diag([*scale, 1.0])
        elif g.box is not None:
            meshes = [trimesh.creation.box(extents=g.box.size)]
        elif g.sphere is not None:
            meshes = [trimesh.creation.icosphere(subdivisions=3, radius=g.sphere.radius)]
        elif g.cylinder is not None:
            c = g.cylinder
            meshes = [trimesh.creation.cylinder(radius=c.radius, height=c.length, sections=48)]
        else:
            raise RobotError(f"{self.path}: link {link!r} has an empty geometry; give it a mesh")
        for m in meshes:
            m.apply_transform(T)
        return meshes

    def _load(self, filename: str, link: str) -> list[trimesh.Trimesh]:
        path = self._resolve(filename)
        if path is None:
            raise RobotError(
                f"{self.path}: mesh {filename!r} of link {link!r} is missing; put the file there "
                "or mend the path"
            )
        try:
            scene = trimesh.load_scene(path)
        except Exception as e:  # every format has its own parser and its own errors
            raise RobotError(f"{path}: not a readable mesh ({e}); export it again") from e
        meshes = [m for m in scene.dump() if isinstance(m, trimesh.Trimesh) and len(m.faces)]
        if not meshes:
            raise RobotError(f"{path}: has no faces; export it as a triangle mesh")
        return meshes

    def _resolve(self, filename: str) -> Path | None:
        """Relative and file:// paths beside the URDF; package://NAME/rest in a parent folder."""
        name = filename.removeprefix("file://")
        folder = self.path.parent
        if not name.startswith("package://"):
            candidates = [folder / name]
        else:
            package, _, rest = name.removeprefix("package://").partition("/")
            parents = [folder, *folder.resolve().parents]
            candidates = [p / rest for p in parents if p.name == package]
            candidates += [p / package / rest for p in parents] + [folder / rest]
        return next((c for c in candidates if c.is_file()), None)


def read_description(urdf: Path) -> Description:
    """Parse a URDF file; raises `RobotError` when it is not one."""
    try:
        ElementTree.parse(urdf)  # yourdfpy would guess around broken XML, pinocchio would not
        robot = yourdfpy.URDF.load(
            str(urdf), build_scene_graph=False, load_meshes=False, mesh_dir=str(urdf.parent)
        ).robot
    except Exception as e:  # lxml and yourdfpy raise many kinds
        raise RobotError(
            f"{urdf}: not a readable URDF ({' '.join(str(e).split())}); mend it"
        ) from e
    return Description(urdf, {link.name: link for link in robot.links})
