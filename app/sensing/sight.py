"""What the sensors of a skin would see: rays against the world AND the robot's own links.

A zone integrates over its solid angle, so it is simulated with many rays (`app.sensing.fan`), of
which it reports the first strong pulse (`app.sensing.response`), never the mean. The rays of all
sensors that measure at one time are cast together, body by body: first the links, which hide
what lies behind them.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.raycast import Beams, Hits, RigidMesh, Solids, no_hits
from app.robot.skin import Skin
from app.sensing import zones
from app.sensing.budget import Budget
from app.sensing.error_model import Reading
from app.sensing.fan import fan_of
from app.sensing.finish import Finish
from app.sensing.response import first_pulses
from app.sensing.truth import Truth
from app.world.world import World


@dataclass(frozen=True, eq=False, slots=True)
class Links:
    """The body links of an arm (L of them) as rays meet them.

    bodies:      one a link, link frame.   welded: (L, L) bool, do two links move as one?
    covers:      (L,) bool, which of them are covers.
    modelled:    one a link, as its sensors were laid out on it.
    T_base_link: (L, 4, 4) at some posture: how links that are welded lie to each other.
    """

    bodies: tuple[RigidMesh, ...]
    welded: NDArray[np.bool_]
    covers: NDArray[np.bool_]
    modelled: tuple[RigidMesh, ...]
    T_base_link: Array


class Eyes(NamedTuple):
    """The sensors of an arm as they are, without its joints: what is known of a `Truth` where
    rays are cast, be it another process."""

    links: Links
    skin: Skin
    laid_out: Skin
    budget: Budget
    seed: int


def eyes_of(truth: Truth) -> Eyes:
    """What sees, of a truth."""
    robot = truth.robot
    covers = np.isin(robot.links, robot.covers)
    T_base_link, modelled = robot.posture(robot.home).T_base_link, truth.modelled.rigid
    links = Links(robot.rigid, robot.welded, covers, modelled, T_base_link)
    return Eyes(links, truth.skin, truth.laid_out, truth.budget, truth.seed)


class Sight:
    """Sees for all sensors of `eyes` in `world`."""

    def __init__(self, eyes: Eyes, world: World) -> None:
        links, skin = eyes.links, eyes.skin
        names = np.arange(len(links.bodies), dtype=np.int16)
        self._links = Solids(links.bodies, names)
        self._world = world
        self._fixed: NDArray[np.bool_] = links.welded[skin.link]  # (K, L) to the sensor's link?
        self._zones = [s.type.zones for s in skin.sensors]
        self._fan, self._real = fan_of(skin, eyes.budget, eyes.seed), eyes.budget.zones > 0.0
        self._finish = Finish(eyes.budget, eyes.seed, len(links.bodies), skin)
        rays = np.diff(self._fan.ray[self._fan.zone])
        far = np.repeat([s.type.most_m for s in skin.sensors], rays)
        self._own = no_hits(far.astype(np.float32), zones.NOTHING)
        # what is fixed to a sensor's own link is hit where it always is; cast once
        glued = self._fixed & (links.covers | (names == np.array(skin.link)[:, None]))
        laid_out = fan_of(eyes.laid_out, eyes.budget, eyes.seed)
        for fan, solids, mine in (
            (self._fan, self._links, self._fixed & ~glued),
            (laid_out, Solids(links.modelled, names), glued),
        ):
            _, self._own = self._rays_to_links(
                fan, solids, np.arange(skin.count), links.T_base_link, ~mine
            )

    @property
    def window(self) -> Array:
        """(K,) [m] from each lens to its dirty window; 0: it is clean."""
        return self._finish.window

    def read(self, sensors: Sequence[int], T_base_link: Array) -> list[Reading]:
        """The truth in each zone of some sensors, links posed at T_base_link (L, 4, 4)."""
        who = np.array(sensors, dtype=np.int64)
        blind = self._fixed[who]
        beams, hits = self._rays_to_links(self._fan, self._links, who, T_base_link, blind)
        self._world.end_rays(beams, hits)
        first = list(accumulate((self._zones[k] for k in sensors), initial=0))
        seen = zones.no_reading(first[-1])
        if self._real:
            surfaces = self._finish.surfaces(self._world.bodies)
            first_pulses(who, hits, self._fan, surfaces, seen)
        else:
            zones.merge_rays(who, hits, self._fan, seen)
        return [Reading._make(column[a:b] for column in seen) for a, b in pairwise(first)]

    def _rays_to_links(
        self, fan: zones.Fan, solids: Solids, who: NDArray[np.int64], T_base_link: Array,
        blind: NDArray[np.bool_],
    ) -> tuple[Beams, Hits]:  # fmt: skip
        """The rays of sensors `who` (m,) ended by the links, but for those that are `blind` (m, L)
        to a link."""
        poses = np.array(T_base_link)
        beams, hits = zones.rays_in_base(fan, self._own, who, poses)
        # a bundle is a zone
        blind = np.repeat(blind, [self._zones[k] for k in who], axis=0)
        solids.end_rays(poses, beams, blind, hits)
        return beams, hits
