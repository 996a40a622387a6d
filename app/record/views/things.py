"""What is drawn once and then only moves, or does not: arm, sensors, cell, ground, bodies.

A viewer that jumps to a time is given the last message of each topic before it. So each message
tells its topic whole: all entities, after a deletion of those that may have been there.
"""

from collections.abc import Iterable
from functools import lru_cache

import numpy as np
from foxglove_schemas_protobuf.SceneEntityDeletion_pb2 import SceneEntityDeletion
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate

from app.cell.learned import EDGE
from app.cell.outline import CORNERS, FACES, bottom_of
from app.cell.parts import Cell
from app.colours import GREY, KNOWN, RGB
from app.messages import Array, BodyPose, BodyView, Snapshot
from app.record.views.frames import body_frame
from app.record.views.models import mesh_glb, model, scene_glb
from app.record.views.surface import surface_views
from app.record.views.values import Fields, View, colour_of, pose_of, time_of, vector_of
from app.robot.model import Robot

GROUND: RGB = (232, 235, 239)
SIDE, THIN = 6.0, 0.002  # [m] of the ground; of a plane's patch
GAP = 0.004  # [m] below what stands on the ground, so that the two do not flicker


def whole(entities: Iterable[Fields], at_ns: int) -> SceneUpdate:
    """A topic's entities, and no others from now on."""
    gone: Fields = {"timestamp": time_of(at_ns), "type": SceneEntityDeletion.ALL}
    return SceneUpdate(deletions=[gone], entities=list(entities))


def entity(name: str, frame: str, at_ns: int, **parts: list[Fields]) -> Fields:
    """A `SceneEntity` that stays where its frame is, for ever."""
    return {
        "timestamp": time_of(at_ns), "frame_id": frame, "id": name, "frame_locked": True, **parts
    }  # fmt: skip


@lru_cache(maxsize=2)
def robot_glbs(robot: Robot) -> tuple[bytes, ...]:
    """The visual meshes of each body link; some ten milliseconds of each."""
    return tuple(scene_glb(robot.visual(link)) for link in robot.links)


def robot_view(robot: Robot, at_ns: int) -> View:
    """`/robot`: the links' meshes, each in the frame of its link."""
    parts = zip(robot.links, robot_glbs(robot), strict=True)
    return "/robot", whole((entity(n, n, at_ns, models=[model(g)]) for n, g in parts), at_ns)


class ThingViews:
    """`/robot`, `/arm/<link>`, `/cell`, `/cell/learned` and `/obstacles`, each told when it is
    another."""

    def __init__(self, robot: Robot, cell: Cell, base: str) -> None:
        self._robot, self._cell, self._base = robot, cell, base
        self._told = False
        self._known: Array | None = None
        self._bodies: tuple[BodyView, ...] = ()
        self._ground = np.nan
        self._glbs: dict[int, bytes] = {}  # of the bodies' views, by id while they are held

    def of(self, s: Snapshot, at_ns: int) -> list[View]:
        """Topics that are new, or have changed."""
        out: list[View] = []
        if not self._told:
            out += [robot_view(self._robot, at_ns), *surface_views(self._robot, at_ns)]
        bodies = tuple(p.view for p in s.world)
        another = len(bodies) != len(self._bodies) or any(
            a is not b for a, b in zip(bodies, self._bodies, strict=True)
        )
        if another or not self._told:
            self._keep(bodies)
            out.append(("/obstacles", self._obstacles(at_ns)))
            ground = min(0.0, self._lowest(s.world)) - GAP
            if ground != self._ground:
                self._ground = ground
                out.append(("/cell", self._cell_view(at_ns)))
        if s.background.known is not self._known:
            self._known = s.background.known
            out.append(("/cell/learned", self._learned(self._known, at_ns)))
        self._told = True
        return out

    def _keep(self, bodies: tuple[BodyView, ...]) -> None:
        old, self._bodies = self._glbs, bodies
        self._glbs = {
            id(b): old[id(b)] if id(b) in old else mesh_glb(b.vertices, b.faces) for b in bodies
        }

    def _obstacles(self, at_ns: int) -> SceneUpdate:
        return whole(
            (
                entity(
                    b.name, body_frame(b.name), at_ns, models=[model(self._glbs[id(b)], b.colour)]
                )
                for b in self._bodies
            ),
            at_ns,
        )

    def _lowest(self, world: tuple[BodyPose, ...]) -> float:
        """Height [m] of the lowest thing that nobody moves, or of the cell where there is none."""
        still = [p for p in world if not p.view.movable]
        if not still:
            return bottom_of(self._cell)
        return min(
            float((p.view.vertices @ p.T_base_body[2, :3]).min() + p.T_base_body[2, 3])
            for p in still
        )

    def _cell_view(self, at_ns: int) -> SceneUpdate:
        below = np.eye(4)
        below[2, 3] = self._ground - THIN / 2
        ground = _slab(below, np.array([SIDE, SIDE, THIN]), GROUND)
        parts = [entity("ground", self._base, at_ns, cubes=[ground])]
        for box in self._cell.boxes:
            cube = _slab(box.T_base_box, box.size, GREY, 0.25)
            parts.append(entity(f"box/{box.name}", self._base, at_ns, cubes=[cube]))
        for plane in self._cell.planes:
            cube = _slab(plane.T_base_plane, np.append(plane.size, THIN), GREY, 0.15)
            parts.append(entity(f"plane/{plane.name}", self._base, at_ns, cubes=[cube]))
        return whole(parts, at_ns)

    def _learned(self, centres: Array, at_ns: int) -> SceneUpdate:
        """All learned cubes as one mesh."""
        if not len(centres):
            return whole((), at_ns)
        n, corners = len(centres), len(CORNERS)
        vertices = (centres[:, None] + CORNERS * EDGE).reshape(-1, 3)
        faces = (FACES[None] + corners * np.arange(n)[:, None, None]).reshape(-1, 3)
        cubes = model(mesh_glb(vertices, faces), KNOWN, 0.3)
        return whole([entity("learned", self._base, at_ns, models=[cubes])], at_ns)


def _slab(T: Array, size: Array, colour: RGB, opacity: float = 1.0) -> Fields:
    """A `CubePrimitive`."""
    return {"pose": pose_of(T), "size": vector_of(size), "color": colour_of(colour, opacity)}
