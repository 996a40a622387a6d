"""The arm as points, for viewers that draw clouds and frames but no meshes of a `SceneUpdate`.

Each link's points hang on its frame, so that they are told once and move with it.
"""

from functools import lru_cache
from typing import Any

import numpy as np
import trimesh

from app.record.views.clouds import PACKED, cloud
from app.record.views.values import View
from app.robot.meshes import BodyMesh
from app.robot.model import Robot

COUNT = 1200  # points a link
LIGHT = np.array([0.3, -0.5, 0.81])  # from where it seems to come: a form needs some shade
DARK, BRIGHT = 70.0, 215.0


def surface_topic(link: str) -> str:
    """Of a link's points."""
    return f"/arm/{link}"


def surface_views(robot: Robot, at_ns: int) -> list[View]:
    """`/arm/<link>` of every body link."""
    points = surfaces(robot)
    return [
        (surface_topic(link), cloud(link, data, at_ns))
        for link, data in zip(robot.links, points, strict=True)
    ]


@lru_cache(maxsize=2)
def surfaces(robot: Robot) -> tuple[bytes, ...]:
    """Packed points all over each body link, link frame; the same every time."""
    return tuple(_points(body) for body in robot.bodies)


def _points(body: BodyMesh) -> bytes:
    mesh: Any = trimesh.Trimesh(body.vertices, body.faces, process=False)
    places, faces = trimesh.sample.sample_surface(mesh, COUNT, seed=0)
    shade = DARK + (BRIGHT - DARK) * (0.5 + 0.5 * mesh.face_normals[faces] @ LIGHT)
    packed = np.zeros(COUNT, dtype=PACKED)
    packed["xyz"] = places
    packed["rgba"][:, :3] = shade[:, None].round()
    packed["rgba"][:, 3] = 255
    return packed.tobytes()
