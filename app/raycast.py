"""First hits of rays on a rigid mesh, through Embree.

A rigid body's tree is built once, in the body's own frame; it is the rays that are moved.
Embree computes in float32, about 1e-6 m at arm's length. Never transform a mesh that backs
a scene: the scene would go on answering for the old shape without a word (trimesh#2324).
"""

import numpy as np
from embreex import rtcore, rtcore_scene
from embreex.mesh_construction import TriangleMesh
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

MISS = np.float32(np.inf)
_DEVICE = rtcore.EmbreeDevice()  # one for all: with a thousand of its own the process crashed


class RigidMesh:
    """A mesh ready to be hit: vertices (V, 3) [m] and faces (F, 3), both in the body frame."""

    def __init__(self, vertices: Array, faces: NDArray[np.int64]) -> None:
        if len(faces) == 0:
            raise ValueError("a mesh without faces cannot be hit; leave the body out instead")
        self._scene = rtcore_scene.EmbreeScene(_DEVICE)
        self._mesh = TriangleMesh(
            self._scene,
            np.ascontiguousarray(vertices, dtype=np.float32),
            np.ascontiguousarray(faces, dtype=np.int32),
        )
        # the smallest sphere is not needed; one around the box's centre culls well enough
        used = vertices[np.unique(faces)]
        self.centre: Array = (used.min(axis=0) + used.max(axis=0)) / 2.0
        self.radius = float(np.linalg.norm(used - self.centre, axis=1).max())

    def cast(
        self, origins: NDArray[np.float32], directions: NDArray[np.float32]
    ) -> NDArray[np.float32]:
        """Distances (n,) [m] along unit `directions` (n, 3) from `origins` (n, 3), body frame.

        `MISS` (+inf) where nothing is hit. Rays that start inside hit the inner side.
        """
        if len(origins) == 0:
            return np.empty(0, dtype=np.float32)
        t: NDArray[np.float32] = self._scene.run(origins, directions, query="DISTANCE")
        t[t >= 1e30] = MISS
        return t


@compiled
def to_body(
    T_base_body: Array, points: Array, directions: Array
) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Base-frame points (n, 3) and directions (n, 3) in the frame of a posed body, float32."""
    T = T_base_body
    at, way = np.empty(points.shape, np.float32), np.empty(points.shape, np.float32)
    for n in range(len(points)):
        x, y, z = points[n, 0] - T[0, 3], points[n, 1] - T[1, 3], points[n, 2] - T[2, 3]
        for i in range(3):
            at[n, i] = T[0, i] * x + T[1, i] * y + T[2, i] * z
            way[n, i] = (
                T[0, i] * directions[n, 0] + T[1, i] * directions[n, 1] + T[2, i] * directions[n, 2]
            )
    return at, way
