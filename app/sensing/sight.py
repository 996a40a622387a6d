"""What the sensors of a skin would see: rays against the world AND the robot's own links.

A zone integrates over its solid angle, so it is simulated with sub-rays, as many as its type
says; the nearest cluster of distances is what it reports, never the mean. The rays of all sensors
that measure at one time are cast together, body by body: first the links, which hide what lies
behind them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.raycast import Beams, Hits, RigidMesh, Solids
from app.robot.model import Robot
from app.robot.skin import Sensor, Skin, zone_directions, zone_rays
from app.sensing import zones
from app.sensing.error_model import Reading
from app.world.world import World


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
        rays = [_sub_rays(s) for s in skin.sensors]
        kinds = [s.type for s in skin.sensors]
        self._zones = [t.zones for t in kinds]
        cosine = [r @ a for r, a in zip(rays, skin.axis, strict=True)]
        self._fan = zones.Fan(
            link=link,
            lens=np.array(skin.origin),
            axis=np.array(skin.axis),
            half_angle=np.array([_half_angle(s) for s in skin.sensors]),
            first=np.append(0, np.cumsum([len(r) for r in rays])).astype(np.int64),
            zone=np.array(skin.first),
            direction=np.concatenate(rays),
            report=np.concatenate(
                [np.ones_like(c) if t.radial else c for c, t in zip(cosine, kinds, strict=True)]
            ),
            separate=np.array([t.separate_m for t in kinds]),
            pulse=skin.traits.pulse,
        )
        far = np.repeat([t.most_m for t in kinds], [len(r) for r in rays]).astype(np.float32)
        self._own = Hits(far, np.full(len(far), zones.NOTHING, dtype=np.int16))
        # what is fixed to a sensor's own link is hit where it always is; cast once
        self._own = self._rays_to_links(np.arange(skin.count), links.T_base_link, ~self._fixed)[1]

    def read(self, sensors: Sequence[int], T_base_link: Array) -> list[Reading]:
        """The truth in each zone of some sensors, links posed at T_base_link (L, 4, 4)."""
        who = np.array(sensors, dtype=np.int64)
        beams, hits = self._rays_to_links(who, T_base_link, self._fixed[who])
        self._world.end_rays(beams, hits)
        first = list(accumulate((self._zones[k] for k in sensors), initial=0))
        seen = zones.no_reading(first[-1])
        zones.merge_rays(who, hits, self._fan, seen)
        return [
            Reading(seen.depth[a:b], seen.merged[a:b], seen.label[a:b], seen.pure[a:b])
            for a, b in pairwise(first)
        ]

    def _rays_to_links(
        self, who: NDArray[np.int64], T_base_link: Array, blind: NDArray[np.bool_]
    ) -> tuple[Beams, Hits]:
        """The rays of sensors `who` (m,) ended by the links, but for those that are `blind` (m, L)
        to a link."""
        poses = np.array(T_base_link)
        beams, hits = zones.rays_in_base(self._fan, self._own, who, poses)
        self._links.end_rays(poses, beams, blind, hits)
        return beams, hits


def _sub_rays(sensor: Sensor) -> Array:
    """(zones * footprint^2, 3) unit directions in the link frame, zone by zone."""
    d = zone_rays(sensor).reshape(-1, 3) @ sensor.T_link_sensor[:3, :3].T
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


def _half_angle(sensor: Sensor) -> float:
    """[rad] of the cone round the axis that holds the whole field of view: its corners."""
    corner = zone_directions(sensor, np.array([-0.5]), np.array([-0.5]))[0]
    return float(np.arctan(np.hypot(corner[0], corner[1])))
