"""What the sensors of a skin would see: rays against the world AND the robot's own links.

A zone integrates over its solid angle, so it is simulated with 3 x 3 sub-rays; the nearest
cluster of depths is what it reports, never the mean. The rays of all sensors that measure at one
time are cast together, body by body: first the links, which hide what lies behind them.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.messages import SLOTS, Array
from app.raycast import Beams, Hits, RigidMesh, Solids
from app.robot.model import Robot
from app.robot.skin import FIELD_OF_VIEW, Skin, zone_directions
from app.sensing import zones
from app.sensing.error_model import Reading
from app.world.world import World

FAR = 4.0  # [m] nothing is seen beyond
CONE = float(np.arctan(np.sqrt(2.0) * np.tan(FIELD_OF_VIEW / 2.0)))  # holds the whole pyramid
SUB = 9  # sub-rays a zone


@dataclass(frozen=True, eq=False, slots=True)
class Links:
    """The body links of an arm (L of them) as rays meet them.

    bodies:      one a link, link frame.   welded: (L, L) bool, do two links move as one?
    T_base_link: (L, 4, 4) at some posture: how links that are welded lie to each other.
    """

    bodies: tuple[RigidMesh, ...]
    welded: NDArray[np.bool_]
    T_base_link: Array


def links_of(robot: Robot) -> Links:
    """The links of a robot."""
    return Links(robot.rigid, robot.welded, robot.posture(robot.home).T_base_link)


class Sight:
    """Sees for every sensor of `skin` on `links` in `world`."""

    def __init__(self, links: Links, skin: Skin, world: World) -> None:
        self._links = Solids(links.bodies, np.arange(len(links.bodies), dtype=np.int16))
        self._world = world
        link = np.array(skin.link, dtype=np.int64)
        self._fixed: NDArray[np.bool_] = links.welded[link]  # (K, L) to the sensor's link?
        rays = [_sub_rays(skin, k) for k in range(skin.count)]
        self._fan = zones.Fan(
            link=link,
            lens=np.array(skin.origin),
            axis=np.array(skin.axis),
            half_angle=CONE,
            first=np.append(0, np.cumsum([len(r) for r in rays])).astype(np.int64),
            direction=np.concatenate(rays),
            cosine=np.concatenate([r @ a for r, a in zip(rays, skin.axis, strict=True)]),
        )
        n = len(self._fan.direction)
        self._own = Hits(np.full(n, np.float32(FAR)), np.full(n, zones.NOTHING, dtype=np.int16))
        # what is fixed to a sensor's own link is hit where it always is; cast once
        self._own = self._rays_to_links(np.arange(skin.count), links.T_base_link, ~self._fixed)[1]

    def read(self, sensors: Sequence[int], T_base_link: Array) -> list[Reading]:
        """The truth in each zone of some sensors, links posed at T_base_link (L, 4, 4)."""
        who = np.array(sensors, dtype=np.int64)
        beams, hits, cosine = self._rays_to_links(who, T_base_link, self._fixed[who])
        self._world.end_rays(beams, hits)
        m = len(who)
        depth, label = np.empty((m, SLOTS)), np.empty((m, SLOTS), dtype=np.int16)
        merged, pure = (np.empty((m, SLOTS), dtype=np.bool_) for _ in range(2))
        zones.merge_rays(beams.first, hits, cosine, SUB, depth, merged, label, pure)
        return [Reading(*zone) for zone in zip(depth, merged, label, pure, strict=True)]

    def _rays_to_links(
        self, who: NDArray[np.int64], T_base_link: Array, blind: NDArray[np.bool_]
    ) -> tuple[Beams, Hits, Array]:
        """The rays of sensors `who` (m,) ended by the links, but for those that are `blind` (m, L)
        to a link; and the cosines of the rays."""
        poses = np.array(T_base_link)
        beams, hits, cosine = zones.rays_in_base(self._fan, self._own, who, poses)
        self._links.end_rays(poses, beams, blind, hits)
        return beams, hits, cosine


def _sub_rays(skin: Skin, k: int) -> Array:
    """(zones * 9, 3) unit directions in the link frame, zone by zone."""
    sensor = skin.sensors[k]
    n = sensor.resolution
    row, column = np.divmod(np.arange(n * n, dtype=np.float64), n)
    step_row, step_column = np.divmod(np.arange(SUB, dtype=np.float64), 3)
    rows = (row[:, None] + (step_row - 1.0) / 3.0).ravel()
    columns = (column[:, None] + (step_column - 1.0) / 3.0).ravel()
    d = zone_directions(sensor, rows, columns) @ sensor.T_link_sensor[:3, :3].T
    return d / np.linalg.norm(d, axis=1, keepdims=True)
