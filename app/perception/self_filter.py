"""The paper's Algorithm 1: which zones see the robot itself.

A ray is cast from the lens through each zone. Where it meets the robot's body near the
measured distance, the zone saw the robot; where the measurement lies well before the body, it
saw something in between. The tree of each link is built once in the link's own frame and
the rays are moved there. Rays against the sensor's own link and what is fixed to it, such as
the cover around the sensor, never change and are cast once.

Beyond the paper, and switchable back (`two_sided`, `footprint`):
- A point well BEHIND the body cannot be an obstacle; it is a wrong pose or multipath.
- A zone is a cone of 5.6 degrees, 10 cm wide at 1 m, so several rays stand for it and are
  weighed as the sensor weighs its returns; otherwise links' edges pass as obstacles.

Distances are compared as the sensor reports them, along its axis or along its rays.
"""

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.perception.casting import NEAR, Casts, Fan, Hulls, select_rays
from app.perception.returns import Judgement, Returns, explain_returns
from app.perception.rules import Rules
from app.raycast import MISS, RigidMesh
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

# of links without thresholds of their own (`flinch calibrate filter`): meshes, poses and the bias
# of zones together are off by up to 2 cm; below 3 cm edges of links pass as obstacles
BASE, LEAST = 0.02, 0.03  # [m]
CALIBRATED = 1e-3  # [m] smallest threshold of a link with one of its own: meshes are no better


def no_judgement(slots: int) -> Judgement:
    """Room for the judgement of so many zones."""
    return Judgement(
        np.zeros(slots, dtype=np.uint8), np.full(slots, -1, dtype=np.int16),
        np.full(slots, np.inf), np.full(slots, np.nan), np.zeros(slots, dtype=np.bool_),
        np.zeros(slots, dtype=np.uint8),
    )  # fmt: skip


class SelfFilter:
    """Judges the zones of some sensors at one posture; everything constant is kept."""

    def __init__(self, robot: Robot, skin: Skin) -> None:
        self._meshes: tuple[RigidMesh, ...] = robot.rigid
        self._hulls = _hulls(robot)
        self._fan = _fan(skin)
        self._own = self._own_returns(robot)
        self._casts = _room_for_casts(len(self._meshes), len(self._meshes) * self._own.link.size)

    def judge(
        self,
        sensors: NDArray[np.intp],
        reported: Array,
        posture: Posture,
        rules: Rules,
        into: Judgement | None = None,
    ) -> Judgement:
        """Verdict of each zone of `sensors` (m,), and why, by slot.

        reported: (S,) [m] distances, any value where there is no target.   into: written and
        returned; rows of other sensors stay. Without it they are those of `no_judgement`.
        """
        judged = no_judgement(len(reported)) if into is None else into
        casts = self._casts
        select_rays(
            sensors, reported, posture.T_base_link, rules.footprint, self._fan, self._hulls,
            casts, judged.rays,
        )  # fmt: skip
        first = 0
        for mesh, last in zip(self._meshes, casts.end.tolist(), strict=True):
            if last > first:
                t = mesh.cast(casts.origin[first:last], casts.direction[first:last])
                np.add(t, np.float32(NEAR), out=casts.hit[first:last])
            first = last
        explain_returns(
            sensors, reported, rules.two_sided, self._fan, self._hulls, self._own, casts, judged
        )
        return judged

    def _own_returns(self, robot: Robot) -> Returns:
        """Where rays end on each sensor's own link and what is fixed to it."""
        fan = self._fan
        own = Returns(np.full(fan.report.shape, MISS), np.full(fan.report.shape, -1, np.int16))
        for k, mount in enumerate(fan.link):
            mine = slice(fan.first[k], fan.first[k + 1])
            length, link = own.length[mine], own.link[mine]
            rays = fan.direction[mine].reshape(-1, 3)
            for i in np.flatnonzero(self._hulls.fixed[mount]):
                T = robot.T_link_link(int(i), int(mount))  # a fixed part may have another frame
                d = rays @ T[:3, :3].T.astype(np.float32)
                o = (T[:3, :3] @ fan.origin[k] + T[:3, 3]).astype(np.float32)
                o = o + np.float32(NEAR) * d
                t = self._meshes[i].cast(o, d).reshape(length.shape) + np.float32(NEAR)
                link[t < length] = i
                length[:] = np.minimum(length, t)
        return own


def _room_for_casts(links: int, most: int) -> Casts:
    return Casts(
        origin=np.empty((most, 3), dtype=np.float32),
        direction=np.empty((most, 3), dtype=np.float32),
        zone_ray=np.empty(most, dtype=np.int32),
        hit=np.empty(most, dtype=np.float32),
        end=np.empty(links, dtype=np.int64),
    )


def _fan(skin: Skin) -> Fan:
    """The skin's rays, and margins that are rounded up, so that rounding never culls."""
    direction, report = skin.rays.astype(np.float32), skin.report
    unit = skin.rays / report[..., None]  # rays of unit report
    width = np.linalg.norm(unit - unit[:, :1], axis=2)
    # beyond a sensor's own rays stand others, along its axis
    width[np.arange(report.shape[1]) >= skin.ray_count[skin.sensor_of, None]] = 0.0
    return Fan(
        first=skin.first, link=skin.link.astype(np.int64), origin=skin.origin, axis=skin.axis,
        cone=skin.cone, ray_count=skin.ray_count, direction=direction,
        report=report.astype(np.float32),
        longest=np.ceil(10.0 * _most(1.0 / report, skin)) / 10.0,
        width=np.ceil(200.0 * _most(width, skin)) / 200.0,
        noise=skin.traits.noise, pulse=skin.traits.pulse,
    )  # fmt: skip


def _most(of_rays: Array, skin: Skin) -> Array:
    """(K,) the largest value (S, R) of each sensor's rays."""
    return np.asarray(np.maximum.reduceat(of_rays.max(axis=1), skin.first[:-1]))


def _hulls(robot: Robot) -> Hulls:
    """Spheres, boxes and thresholds; a link without thresholds of its own has the general ones."""
    used = [b.vertices[np.unique(b.faces)] for b in robot.bodies]
    general = np.isnan(robot.eps)
    base = np.where(general, BASE, robot.eps)
    least = np.where(general, LEAST, CALIBRATED)
    return Hulls(
        centre=np.array([m.centre for m in robot.rigid]),
        radius=np.array([m.radius for m in robot.rigid]) * (1.0 + 1e-6),  # float32 meshes
        low=np.array([v.min(axis=0) for v in used]),
        high=np.array([v.max(axis=0) for v in used]),
        fixed=robot.welded, base=base, least=least,
        slack=np.array([max(base.max(), least.max())]),
    )  # fmt: skip
