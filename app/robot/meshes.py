"""Meshes of a URDF, in link frames, read through yourdfpy and trimesh.

Bodies (`collision` entries, or `visual` ones where asked for) are what distances are measured
to and rays are cast against; visuals are what the page shows. Paths may be relative to the URDF
or `package://`. Every mesh of a link in use must be there: no arm runs with a link that nobody
can see or keep clear of.
"""

import os
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from io import BytesIO
from pathlib import Path
from typing import Any, NamedTuple
from xml.etree import ElementTree

import numpy as np
import trimesh
import yourdfpy
from numpy.typing import NDArray

from app.errors import RobotError, options
from app.messages import Array, freeze
from app.robot.tables import Bodies
from app.surface import check_surface, read_surfaces

PACKAGE = re.compile(r"(?:package|model)://([^/]+)/+|\$\(find\s+([^)\s]+)\)/+")
NAMED = re.compile(r"<name>\s*([^<\s]+)\s*</name>")


@dataclass(frozen=True, eq=False, slots=True)
class BodyMesh:
    """A closed surface: vertices (V, 3) [m] and faces (F, 3), link frame, read-only."""

    vertices: Array
    faces: NDArray[np.int64]


class Place(NamedTuple):
    """What a URDF says of a joint, as it stands there.

    away: [m] from its parent's frame.   turn: the largest of its rpy [rad], at any size.
    axis: length of its axis, NaN of a fixed joint.
    """

    joint: str
    away: float
    turn: float
    axis: float


@dataclass(frozen=True, eq=False)
class Description:
    """The URDF's links, joints, and where its meshes are; `bodies` says what distances are
    measured to."""

    path: Path
    links: dict[str, Any] = field(repr=False)
    places: tuple[Place, ...] = field(repr=False)
    bodies: Bodies = "collision"

    @property
    def body_links(self) -> tuple[str, ...]:
        """Links that have a shape, in the URDF's order."""
        shapes = {name: link.collisions or link.visuals for name, link in self.links.items()}
        return tuple(name for name, shape in shapes.items() if shape)

    def body(self, link: str) -> BodyMesh:
        """All collision shapes of a link as one surface; a link without one is refused."""
        entry = self._link(link)
        entries = entry.collisions
        if self.bodies == "visual":
            entries = entry.visuals or entry.collisions
        if not entries:
            raise RobotError(
                f"{self.path}: link {link!r} has no collision mesh, so nothing can be kept clear "
                "of it; add one, measure to the visual meshes with --bodies visual, or leave the "
                "link out of `links` in robot.toml"
            )
        for e in (*entry.visuals, *entry.collisions):
            if e.geometry.mesh is not None:
                self._file(e.geometry.mesh.filename, link)
        parts = [m for e in entries for m in self._meshes(e, link)]
        mesh: Any = trimesh.util.concatenate(parts)
        vertices = np.array(mesh.vertices, dtype=np.float64)
        faces = np.array(mesh.faces, dtype=np.int64)
        check_surface(vertices, faces, f"{self.path}: the body of link {link!r}", RobotError)
        return BodyMesh(freeze(vertices), freeze(faces))

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
        path = self._file(filename, link)
        scene = read_surfaces(path, RobotError)
        if path.suffix.lower() == ".dae":
            scene = scene.scaled(_metres(scene.units))
        meshes = []
        for node in scene.graph.nodes_geometry:
            T, name = scene.graph[node]
            shape = scene.geometry[name]
            if isinstance(shape, trimesh.Trimesh) and len(shape.faces):
                # with its cache: a file's own normals lie there, and Scene.dump drops them
                meshes.append(shape.copy(include_cache=True).apply_transform(T))
        if not meshes:
            raise RobotError(f"{path}: has no faces; export it as a triangle mesh")
        return meshes

    def _file(self, filename: str, link: str) -> Path:
        path = self.find(filename)
        if path is None:
            package, _ = in_package(filename)
            where = f"; its package {package!r} is looked for above and beside the URDF"
            raise RobotError(
                f"{self.path}: mesh {filename!r} of link {link!r} is missing; put the file there "
                f"or mend the path{where if package else ''}"
            )
        return path

    def find(self, filename: str) -> Path | None:
        """Relative and file:// paths beside the URDF; package://NAME/rest in the package of that
        name and in no other."""
        folder = self.path.parent
        package, rest = in_package(filename)
        if not package:
            candidates = [folder / rest]
        else:
            candidates = [p / rest for p in packages(package, folder.resolve())]
        return next((c for c in candidates if c.is_file()), None)


def in_package(filename: str) -> tuple[str, str]:
    """The package that a mesh's name asks for, empty for none, and the path in it."""
    name = filename.replace("\\", "/").removeprefix("file://")
    match = PACKAGE.match(name)
    return (match[1] or match[2], name[match.end() :]) if match else ("", name)


def packages(name: str, folder: Path) -> Iterator[Path]:
    """Folders that may be the package `name`, as seen from `folder`: above it, beside what is
    above it, and where ROS is told to look."""
    for parent in (folder, *folder.parents):
        if parent.name == name or _is_package(parent, name):
            yield parent
        yield parent / name
    for root in os.environ.get("ROS_PACKAGE_PATH", "").split(os.pathsep):
        if root:
            yield from (
                (Path(root), Path(root) / name) if Path(root).name == name else (Path(root) / name,)
            )
    for root in os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep):
        if root:
            yield Path(root) / "share" / name


def _is_package(folder: Path, name: str) -> bool:
    """Does the folder's own package.xml say that it is this package, whatever it is called?"""
    try:
        text = (folder / "package.xml").read_text("utf-8", errors="replace")
    except OSError:
        return False
    found = NAMED.search(text)
    return found is not None and found[1] == name


def describe(xml: str, urdf: Path, bodies: Bodies = "collision") -> Description:
    """The links of a URDF's text; `urdf` is where its relative paths begin."""
    try:
        file = BytesIO(xml.encode())
        robot = yourdfpy.URDF.load(
            file, build_scene_graph=False, load_meshes=False, mesh_dir=str(urdf.parent)
        ).robot
    except Exception as e:  # lxml and yourdfpy raise many kinds
        raise RobotError(
            f"{urdf}: not a readable URDF ({' '.join(str(e).split())}); mend it"
        ) from e
    links = {link.name: link for link in robot.links}
    return Description(urdf, links, _places(xml), bodies)


def _places(xml: str) -> tuple[Place, ...]:
    """The joints of a URDF's text."""
    out = []
    for joint in ElementTree.fromstring(xml).findall("joint"):
        at, turn = _vector(joint, "origin", "xyz"), _vector(joint, "origin", "rpy")
        axis = _vector(joint, "axis", "xyz") if joint.find("axis") is not None else np.ones(1)
        length = np.nan if joint.get("type") == "fixed" else float(np.linalg.norm(axis))
        name = joint.get("name", "")
        out.append(Place(name, float(np.linalg.norm(at)), float(np.abs(turn).max()), length))
    return tuple(out)


def _vector(joint: Any, tag: str, key: str) -> Array:
    """Three numbers of a joint's element, zeros where there are none."""
    element = joint.find(tag)
    text = "" if element is None else element.get(key, "")
    return np.array([float(v) for v in text.split()] or [0.0] * 3)


def _metres(units: str | None) -> float:
    """A COLLADA file tells its unit, "meters" or "0.001 * meters"; other formats tell none."""
    share, _, unit = (units or "meters").rpartition("*")
    return float(share) if share and unit.strip() == "meters" else 1.0
