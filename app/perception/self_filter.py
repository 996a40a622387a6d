"""The paper's Algorithm 1: which zones see the robot itself.

A ray is cast from the lens through each zone. Where it meets the robot's body near the
measured depth, the zone saw the robot; where the measurement lies well before the body, it
saw something in between. The tree of each link is built once in the link's own frame and
the rays are moved there. Rays against the sensor's own link and what is fixed to it, such as
the cover around the sensor, never change and are cast once.

Beyond the paper, and switchable back (`two_sided`, `footprint`):
- A point well BEHIND the body cannot be an obstacle; it is a wrong pose or multipath.
- A zone is a cone of 5.6 degrees, 10 cm wide at 1 m, so four rays near its corners are cast
  too; otherwise links' edges pass as obstacles.

Depths are compared along the optical axis, which is what the sensor measures.
"""

import numpy as np
from numpy.typing import NDArray

from app.config import Params
from app.messages import SLOTS, Array
from app.perception.beams import aim, weigh
from app.raycast import MISS, RigidMesh
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import CORNER_SHARE, FIELD_OF_VIEW, Skin

RAYS = 5  # the zone's centre and four towards its corners
CONE = float(np.arctan(np.sqrt(2.0) * np.tan(FIELD_OF_VIEW / 2.0) * (1.0 + CORNER_SHARE) / 2.0))


class SelfFilter:
    """Judges the zones of some sensors at one posture; everything constant is kept."""

    def __init__(self, robot: Robot, skin: Skin) -> None:
        self._meshes: tuple[RigidMesh, ...] = robot.rigid
        self._centre = np.array([m.centre for m in robot.rigid])
        self._radius = np.array([m.radius for m in robot.rigid]) * (1.0 + 1e-6)  # float32 meshes
        self._low = np.array([b.vertices[np.unique(b.faces)].min(axis=0) for b in robot.bodies])
        self._high = np.array([b.vertices[np.unique(b.faces)].max(axis=0) for b in robot.bodies])
        self._own_eps = robot.eps
        self._link = skin.link.astype(np.int64)
        self._welded = robot.welded
        self._origin, self._axis = skin.origin, skin.axis
        length = np.linalg.norm(skin.reach, axis=1, keepdims=True)
        rays = np.empty((skin.count, SLOTS, RAYS, 3))
        rays[:, :, 0] = (skin.reach / length).reshape(-1, SLOTS, 3)
        rays[:, :, 1:] = skin.corners.reshape(-1, SLOTS, 4, 3)
        # unused slots look along the axis: they are never judged, and NaN rays are slow
        rays = np.where(np.isfinite(rays), rays, skin.axis[:, None, None, :])
        self._rays = rays.astype(np.float32)
        self._cosine = np.einsum("kzrc,kc->kzr", rays, skin.axis).astype(np.float32)
        self._own_near: float | None = None
        self._own = np.empty((0, SLOTS, RAYS), dtype=np.float32)
        self._own_link = np.empty((0, SLOTS, RAYS), dtype=np.int16)
        most = len(self._meshes) * skin.count * SLOTS * RAYS
        self._o, self._d = (np.empty((most, 3), dtype=np.float32) for _ in range(2))
        self._index, self._hit = np.empty(most, dtype=np.int32), np.empty(most, dtype=np.float32)

    def judge(
        self, sensors: NDArray[np.intp], depth: Array, posture: Posture, params: Params
    ) -> tuple[NDArray[np.uint8], NDArray[np.int16], Array, Array]:
        """Verdict KEPT, SELF or BEHIND of each zone, the link in its way, gap and threshold.

        sensors: (m,) indices.   depth: (m, 64) [m], any value where there is no target.
        Returns verdict (m, 64), link (m, 64) or -1, gap (m, 64) [m] = depth of the body minus
        depth measured (+inf where no body is in the way), eps (m, 64) [m].
        """
        rays = RAYS if params.footprint else 1
        near = params.near_cut
        if self._own_near != near:
            self._own, self._own_link = self._own_hits(near)
            self._own_near = near
        end = np.empty(len(self._meshes), dtype=np.int64)
        aim(
            sensors, rays, near, self._link, self._welded, self._origin, self._axis, self._rays,
            CONE, posture.T_base_link, self._centre, self._radius, self._low, self._high,
            self._o, self._d, self._index, end,
        )  # fmt: skip
        first = 0
        for mesh, last in zip(self._meshes, end.tolist(), strict=True):
            if last > first:
                t = mesh.cast(self._o[first:last], self._d[first:last])
                np.add(t, np.float32(near), out=self._hit[first:last])
            first = last
        verdict, way = np.empty(depth.shape, dtype=np.uint8), np.empty(depth.shape, dtype=np.int16)
        gap, eps = np.empty(depth.shape), np.empty(depth.shape)
        base = np.where(np.isnan(self._own_eps), params.eps_base, self._own_eps)
        weigh(
            sensors, rays, depth, self._link, self._own, self._own_link, self._cosine,
            self._hit, self._index, end, params.eps_min, base, params.eps_sigmas,
            params.two_sided, verdict, way, gap, eps,
        )  # fmt: skip
        return verdict, way, gap, eps

    def _own_hits(self, near: float) -> tuple[NDArray[np.float32], NDArray[np.int16]]:
        """Ray lengths (K, 64, 5) to each sensor's own link and what is fixed to it, and which."""
        own = np.full(self._rays.shape[:3], MISS)
        link = np.full(own.shape, -1, dtype=np.int16)
        for k, mount in enumerate(self._link):
            d = self._rays[k].reshape(-1, 3)
            o = self._origin[k].astype(np.float32) + np.float32(near) * d
            for i in np.flatnonzero(self._welded[mount]):
                t = self._meshes[i].cast(o, d).reshape(SLOTS, RAYS) + np.float32(near)
                link[k][t < own[k]] = i
                own[k] = np.minimum(own[k], t)
        return own, link


def _in_cone(offset: Array, axis: Array, radius: float) -> NDArray[np.bool_]:
    """(m,) may a ray of each sensor's cone reach a sphere at `offset` (m, 3) from its lens?"""
    distance = np.sqrt(np.einsum("ij,ij->i", offset, offset))
    along = np.einsum("ij,ij->i", offset, axis)
    with np.errstate(divide="ignore", invalid="ignore"):
        angle = np.arccos(np.clip(along / distance, -1.0, 1.0))
        widen = np.arcsin(np.clip(radius / distance, 0.0, 1.0))
    return (distance <= radius) | (angle <= CONE + widen)
