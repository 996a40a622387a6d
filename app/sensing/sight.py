"""What the sensors of a skin would see: rays against the world AND the robot's own links.

A zone integrates over its solid angle, so it is simulated with sub-rays, as many as its type
says; the nearest cluster of distances is what it reports, never the mean. The rays of all sensors
that measure at one time are cast together, body by body: first the links, which hide what lies
behind them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.raycast import Beams, Hits, RigidMesh, Solids
from app.robot.skin import Sensor, Skin, zone_directions, zone_rays
from app.sensing import zones
from app.sensing.budget import Budget
from app.sensing.error_model import Reading
from app.sensing.truth import Truth
from app.world.world import World


@dataclass(frozen=True, eq=False, slots=True)
class Links:
    """The body links of an arm (L of them) as rays meet them.

    bodies:      one a link, link frame.   welded: (L, L) bool, do two links move as one?
    covers:      (L,) bool, which of them are covers, that go along with their sensors.
    T_base_link: (L, 4, 4) at some posture: how links that are welded lie to each other.
    """

    bodies: tuple[RigidMesh, ...]
    welded: NDArray[np.bool_]
    covers: NDArray[np.bool_]
    T_base_link: Array


class Eyes(NamedTuple):
    """The sensors of an arm as they are, without its joints: what is known of a `Truth` where
    rays are cast, be it another process."""

    links: Links
    skin: Skin
    laid_out: Skin
    budget: Budget


def eyes_of(truth: Truth) -> Eyes:
    """What sees, of a truth."""
    robot = truth.robot
    covers = np.isin(robot.links, robot.covers)
    links = Links(robot.rigid, robot.welded, covers, robot.posture(robot.home).T_base_link)
    return Eyes(links, truth.skin, truth.laid_out, truth.budget)


class Sight:
    """Sees for all sensors of `eyes` in `world`."""

    def __init__(self, eyes: Eyes, world: World) -> None:
        links, skin = eyes.links, eyes.skin
        self._links = Solids(links.bodies, np.arange(len(links.bodies), dtype=np.int16))
        self._world = world
        self._fixed: NDArray[np.bool_] = links.welded[skin.link]  # (K, L) to the sensor's link?
        self._zones = [s.type.zones for s in skin.sensors]
        self._fan = _fan(skin)
        far = np.repeat([s.type.most_m for s in skin.sensors], np.diff(self._fan.first))
        nothing = np.full(len(far), zones.NOTHING, dtype=np.int16)
        self._own = Hits(far.astype(np.float32), nothing)
        # what is fixed to a sensor's own link is hit where it always is; cast once
        everyone, T = np.arange(skin.count), links.T_base_link
        for fan, mine in (
            (self._fan, self._fixed & ~links.covers),
            (_fan(eyes.laid_out), self._fixed & links.covers),
        ):
            self._own = self._rays_to_links(fan, everyone, T, ~mine)[1]

    def read(self, sensors: Sequence[int], T_base_link: Array) -> list[Reading]:
        """The truth in each zone of some sensors, links posed at T_base_link (L, 4, 4)."""
        who = np.array(sensors, dtype=np.int64)
        beams, hits = self._rays_to_links(self._fan, who, T_base_link, self._fixed[who])
        self._world.end_rays(beams, hits)
        first = list(accumulate((self._zones[k] for k in sensors), initial=0))
        seen = zones.no_reading(first[-1])
        zones.merge_rays(who, hits, self._fan, seen)
        return [
            Reading(seen.depth[a:b], seen.merged[a:b], seen.label[a:b], seen.pure[a:b])
            for a, b in pairwise(first)
        ]

    def _rays_to_links(
        self, fan: zones.Fan, who: NDArray[np.int64], T_base_link: Array, blind: NDArray[np.bool_]
    ) -> tuple[Beams, Hits]:
        """The rays of sensors `who` (m,) ended by the links, but for those that are `blind` (m, L)
        to a link."""
        poses = np.array(T_base_link)
        beams, hits = zones.rays_in_base(fan, self._own, who, poses)
        self._links.end_rays(poses, beams, blind, hits)
        return beams, hits


def _fan(skin: Skin) -> zones.Fan:
    rays = [_sub_rays(s) for s in skin.sensors]
    kinds = [s.type for s in skin.sensors]
    cosine = [r @ a for r, a in zip(rays, skin.axis, strict=True)]
    return zones.Fan(
        link=np.array(skin.link, dtype=np.int64),
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


def _sub_rays(sensor: Sensor) -> Array:
    """(zones * footprint^2, 3) unit directions in the link frame, zone by zone."""
    d = zone_rays(sensor).reshape(-1, 3) @ sensor.T_link_sensor[:3, :3].T
    return np.asarray(d / np.linalg.norm(d, axis=1, keepdims=True))


def _half_angle(sensor: Sensor) -> float:
    """[rad] of the cone round the axis that holds the whole field of view: its corners."""
    corner = zone_directions(sensor, np.array([-0.5]), np.array([-0.5]))[0]
    return float(np.arctan(np.hypot(corner[0], corner[1])))
