"""The paper's Algorithm 1: which zones see the robot itself.

A ray is cast from the lens through each zone. Where it meets the robot's body near the
measured depth, the zone saw the robot; where the measurement lies well before the body, it
saw something in between. The tree of each link is built once in the link's own frame and
the rays are moved there. Rays against the sensor's own link and what is fixed to it, such as
the cover around the sensor, never change and are cast once.

Beyond the paper, and switchable back (`two_sided`, `footprint`):
- A point well BEHIND the body cannot be an obstacle; it is a wrong pose or multipath.
- A zone is a cone of 5.6 degrees, 10 cm wide at 1 m, so nine rays stand for it and are
  weighed as the sensor weighs its returns; otherwise links' edges pass as obstacles.

Depths are compared along the optical axis, which is what the sensor measures.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.config import Params
from app.messages import SLOTS, Array
from app.perception.beams import aim, weigh
from app.raycast import MISS, RigidMesh
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import AROUND, Skin

RAYS = 1 + len(AROUND)  # the zone's centre and those around it
CALIBRATED = 1e-3  # [m] smallest threshold of a link with one of its own: meshes are no better


class Judgement(NamedTuple):
    """What became of m frames, (m, 64) each.

    verdict: KEPT, SELF or BEHIND.   link: in the zone's way, or -1.
    gap:     [m] depth of the body minus depth measured; +inf where no body is in the way.
    eps:     [m] threshold.   edge: the zone lies across an edge of what is in its way.
    rays:    that stood for the zone: all where a link may explain the point, else the centre's.
    """

    verdict: NDArray[np.uint8]
    link: NDArray[np.int16]
    gap: Array
    eps: Array
    edge: NDArray[np.bool_]
    rays: NDArray[np.uint8]


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
        self._T_link_link = robot.T_link_link
        self._origin, self._axis = skin.origin, skin.axis
        length = np.linalg.norm(skin.reach, axis=1, keepdims=True)
        rays = np.empty((skin.count, SLOTS, RAYS, 3))
        rays[:, :, 0] = (skin.reach / length).reshape(-1, SLOTS, 3)
        rays[:, :, 1:] = skin.around.reshape(-1, SLOTS, RAYS - 1, 3)
        # unused slots look along the axis: they are never judged, and NaN rays are slow
        rays = np.where(np.isfinite(rays), rays, skin.axis[:, None, None, :])
        self._rays = rays.astype(np.float32)
        self._cosine = np.einsum("kzrc,kc->kzr", rays, skin.axis).astype(np.float32)
        self._cone = float(np.arccos(self._cosine.min()))
        self._own_near: float | None = None
        self._limits_of = np.nan, np.nan
        self._own = np.empty((0, SLOTS, RAYS), dtype=np.float32)
        self._own_link = np.empty((0, SLOTS, RAYS), dtype=np.int16)
        most = len(self._meshes) * skin.count * SLOTS * RAYS
        self._o, self._d = (np.empty((most, 3), dtype=np.float32) for _ in range(2))
        self._index, self._hit = np.empty(most, dtype=np.int32), np.empty(most, dtype=np.float32)

    def judge(
        self, sensors: NDArray[np.intp], depth: Array, posture: Posture, params: Params
    ) -> Judgement:
        """Verdict of each zone, and why.

        sensors: (m,) indices.   depth: (m, 64) [m], any value where there is no target.
        """
        rays = RAYS if params.footprint else 1
        near = params.near_cut
        if self._own_near != near:
            self._own, self._own_link = self._own_hits(near)
            self._own_near = near
        end = np.empty(len(self._meshes), dtype=np.int64)
        if self._limits_of != (params.eps_base, params.eps_min):
            self._limit(params.eps_base, params.eps_min)
        cast = np.empty(depth.shape, dtype=np.uint8)
        aim(
            sensors, rays, near, depth, self._slack, params.eps_sigmas,
            self._link, self._welded, self._origin, self._axis, self._rays, self._cosine,
            self._cone, posture.T_base_link, self._centre, self._radius, self._low, self._high,
            self._o, self._d, self._index, end, cast,
        )  # fmt: skip
        first = 0
        for mesh, last in zip(self._meshes, end.tolist(), strict=True):
            if last > first:
                t = mesh.cast(self._o[first:last], self._d[first:last])
                np.add(t, np.float32(near), out=self._hit[first:last])
            first = last
        out = Judgement(
            np.empty(depth.shape, dtype=np.uint8), np.empty(depth.shape, dtype=np.int16),
            np.empty(depth.shape), np.empty(depth.shape), np.empty(depth.shape, dtype=np.bool_),
            cast,
        )  # fmt: skip
        weigh(
            sensors, rays, depth, self._link, self._own, self._own_link, self._cosine,
            self._hit, self._index, end, cast, self._base, self._least, params.eps_sigmas,
            params.two_sided, *out[:5],
        )  # fmt: skip
        return out

    def _limit(self, base: float, least: float) -> None:
        """Thresholds (L, 2) [m] of links that have none of their own are the setting's."""
        general = np.isnan(self._own_eps)
        self._base = np.where(general, base, self._own_eps)
        self._least = np.where(general, least, CALIBRATED)
        self._slack = max(float(self._base.max()), float(self._least.max()))
        self._limits_of = base, least

    def _own_hits(self, near: float) -> tuple[NDArray[np.float32], NDArray[np.int16]]:
        """Ray lengths (K, 64, 9) to each sensor's own link and what is fixed to it, and which."""
        own = np.full(self._rays.shape[:3], MISS)
        link = np.full(own.shape, -1, dtype=np.int16)
        for k, mount in enumerate(self._link):
            rays = self._rays[k].reshape(-1, 3)
            for i in np.flatnonzero(self._welded[mount]):
                T = self._T_link_link(int(i), int(mount))  # a fixed part may have another frame
                d = rays @ T[:3, :3].T.astype(np.float32)
                o = (T[:3, :3] @ self._origin[k] + T[:3, 3]).astype(np.float32)
                o = o + np.float32(near) * d
                t = self._meshes[i].cast(o, d).reshape(SLOTS, RAYS) + np.float32(near)
                link[k][t < own[k]] = i
                own[k] = np.minimum(own[k], t)
        return own, link
