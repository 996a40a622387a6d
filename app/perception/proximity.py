"""Closest pairs between the world and the robot, for each control body and overall.

Whole-body (the paper): a control body is a link, its control point any point of its surface.
Sensor mounts (the baseline): a control body is a sensor, its control point the lens. Both
search the same cloud, so that nothing but the control point differs.
"""

import numpy as np

from app.messages import Array, Cloud, Pairs, Verdict, freeze
from app.perception.search import nearest_of_links, nearest_of_origins
from app.perception.tree import plant
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

TOUCHING = 1e-6  # [m] below this the direction of retreat comes from the surface's normal


class BodyPairs:
    """Closest pair of every link, by exact signed distance to its body mesh."""

    def __init__(self, robot: Robot) -> None:
        self._forest = plant(robot.bodies)
        self._links = np.arange(len(robot.links))
        self.reset()

    def reset(self) -> None:
        """Forget which points were nearest (it only makes the next search faster)."""
        self._hint = np.full(len(self._links), -1, dtype=np.int64)

    def update(self, cloud: Cloud, posture: Posture) -> Pairs:
        """One row a link."""
        return self.search(cloud.points, cloud.verdict == Verdict.KEPT, posture)

    def search(self, points: Array, use: np.ndarray, posture: Posture) -> Pairs:
        """The same for any points (n, 3), base frame; `use` (n,) bool. NaN rows are skipped."""
        L = len(self._links)
        distance, row = np.empty(L), np.empty(L, dtype=np.int64)
        on_robot, outward = np.full((L, 3), np.nan), np.full((L, 3), np.nan)
        nearest_of_links(
            points, use, posture.T_base_link, self._hint, *self._forest,
            distance, row, on_robot, outward,
        )  # fmt: skip
        self._hint = row
        return _pairs(self._links, points, distance, row, on_robot, -outward)


class MountPairs:
    """Nearest point of the cloud to every lens."""

    def __init__(self, skin: Skin) -> None:
        self._skin = skin

    def update(self, cloud: Cloud, posture: Posture) -> Pairs:
        """One row a sensor."""
        skin = self._skin
        T = posture.T_base_link[skin.link]
        lens = np.einsum("kij,kj->ki", T[:, :3, :3], skin.origin) + T[:, :3, 3]
        retreat = -np.einsum("kij,kj->ki", T[:, :3, :3], skin.axis)
        distance, row = np.empty(skin.count), np.empty(skin.count, dtype=np.int64)
        nearest_of_origins(cloud.points, cloud.verdict == Verdict.KEPT, lens, distance, row)
        return _pairs(skin.link, cloud.points, distance, row, lens, retreat)


def _pairs(
    link: np.ndarray,
    points: Array,
    distance: Array,
    row: np.ndarray,
    on_robot: Array,
    fallback: Array,
) -> Pairs:
    """Assemble rows; `fallback` (B, 3) is the retreat direction where the points touch."""
    some = row >= 0
    on_world = np.full((len(row), 3), np.nan)
    on_world[some] = points[row[some]]
    with np.errstate(invalid="ignore", divide="ignore"):
        normal = (on_robot - on_world) / distance[:, None]
    touching = some & (np.abs(distance) < TOUCHING)
    normal[touching] = fallback[touching]
    normal[~some] = np.nan
    closest = int(np.argmin(distance)) if some.any() else -1
    return Pairs(
        link=link,
        distance=freeze(distance),
        on_robot=freeze(on_robot),
        on_world=freeze(on_world),
        normal=freeze(normal),
        slot=freeze(row),
        closest=closest,
    )
