"""Closest pairs between the world and the robot, for each control body and overall.

Whole-body (the paper): a control body is a link, its control point any point of its surface.
Sensor mounts (the baseline): a control body is a sensor, its control point the lens. Both
search the same cloud, so that nothing but the control point differs.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Cloud, Pairs, Verdict, freeze
from app.perception.field import surveyed
from app.perception.search import nearest_of_links, nearest_of_origins
from app.perception.spread import held_of_links, several_of_links
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

PAIRS = 4  # rows a link of `several`
RENEW = 0.007  # [s] between two choices of them: every second tick at 250 Hz
TOUCHING = 1e-6  # [m] below this the direction of retreat comes from the surface's normal


class BodyPairs:
    """Closest pair of every link, by exact signed distance to its body mesh."""

    def __init__(self, robot: Robot) -> None:
        self._forest, self._field = surveyed(robot.bodies)
        self._links = np.arange(len(robot.links))
        # (L,) the base is measured, never acted on
        self.moves = np.asarray(robot.supports.any(axis=1))
        self.reset()

    def reset(self) -> None:
        """Forget which points were nearest (it only makes the next search faster)."""
        # read-only as those of later ticks are: another kind of array is another compiled kernel
        self._hint = freeze(np.full(len(self._links), -1, dtype=np.int64))

    def update(self, cloud: Cloud, posture: Posture) -> Pairs:
        """One row a link."""
        return self.search(cloud.points, cloud.verdict == Verdict.KEPT, posture)

    def search(self, points: Array, use: np.ndarray, posture: Posture) -> Pairs:
        """The same for any points (n, 3), base frame; `use` (n,) bool. NaN rows are skipped."""
        pairs = self._search(points, use, posture, self._hint, False)
        self._hint = pairs.slot
        return pairs

    def measure(self, points: Array, use: np.ndarray, posture: Posture, row: np.ndarray) -> Pairs:
        """The pair of every link with its own `row` (L,) of the points; -1 for none."""
        return self._search(points, use, posture, row, True)

    def _search(
        self, points: Array, use: np.ndarray, posture: Posture, hint: np.ndarray, only: bool
    ) -> Pairs:
        L = len(self._links)
        distance, row = np.empty(L), np.empty(L, dtype=np.int64)
        on_robot, outward = np.full((2, L, 3), np.nan)
        nearest_of_links(
            points, use, posture.T_base_link, hint, only, self._forest, self._field,
            distance, row, on_robot, outward,
        )  # fmt: skip
        return _pairs(self._links, points, distance, row, on_robot, -outward, self.moves)

    def several(
        self, points: Array, use: np.ndarray, posture: Posture, closest: Pairs, reach: float
    ) -> Pairs:
        """Up to four well-separated pairs of every link, row 4 * link + i from near to far.

        closest: what `search` answered for the same points.   reach: [m], farther pairs are
        left out, but for the closest of each link.
        """
        L = len(self._links)
        distance, row = np.empty((L, PAIRS)), np.empty((L, PAIRS), dtype=np.int64)
        on_robot, outward = np.full((2, L, PAIRS, 3), np.nan)
        several_of_links(
            points, use, closest.slot, reach, posture.T_base_link, self._forest,
            distance, row, on_robot, outward,
        )  # fmt: skip
        return self._many(points, distance, row, on_robot, outward)

    def held(
        self, points: Array, use: np.ndarray, posture: Posture, closest: Pairs, slot: np.ndarray
    ) -> Pairs:
        """The pairs of an earlier `several`, whose `slot` (4 L,) it was, as they are now."""
        L = len(self._links)
        distance, row = np.empty((L, PAIRS)), slot.reshape(L, PAIRS).copy()
        on_robot, outward = np.full((2, L, PAIRS, 3), np.nan)
        held_of_links(
            points, use, closest.slot, posture.T_base_link, self._forest,
            distance, row, on_robot, outward,
        )  # fmt: skip
        return self._many(points, distance, row, on_robot, outward)

    def _many(
        self, points: Array, distance: Array, row: np.ndarray, on_robot: Array, outward: Array
    ) -> Pairs:
        return _pairs(
            np.repeat(self._links, PAIRS), points, distance.ravel(), row.ravel(),
            on_robot.reshape(-1, 3), -outward.reshape(-1, 3), np.repeat(self.moves, PAIRS),
        )  # fmt: skip


class ManyPairs:
    """Several pairs a link, chosen anew every `RENEW` seconds and measured anew in each tick.

    The closest pair of each link is always the present one; the choice beside it costs as much
    as the rest of a tick, and frames do not come faster.
    """

    def __init__(self, body: BodyPairs) -> None:
        self._body = body
        self.reset()

    def reset(self) -> None:
        """Choose anew at the next tick."""
        self._slot: NDArray[np.intp] | None = None
        self._chosen = -np.inf  # [s]

    def update(
        self, closest: Pairs, points: Array, use: np.ndarray, posture: Posture, reach: float,
        now: float,
    ) -> Pairs:  # fmt: skip
        """closest: what `search` answered for the same points, at `now` [s]."""
        if self._slot is not None and 0.0 <= now - self._chosen < RENEW:
            return self._body.held(points, use, posture, closest, self._slot)
        pairs = self._body.several(points, use, posture, closest, reach)
        self._slot, self._chosen = pairs.slot, now
        return pairs


class SteadyPairs:
    """Holds on to each link's last point while no other is nearer by more than a margin.

    On a flat wall the nearest point changes many times a second between equals, and the
    control point with it. What is held is a zone (or a voxel of the memory), so its point
    still moves as the world does; the distance reported is its own, at most `hold` larger.
    """

    def __init__(self, body: BodyPairs) -> None:
        self._body = body
        self.reset()

    def reset(self) -> None:
        """Hold on to nothing."""
        self._slot = np.empty(0, dtype=np.int64)

    def update(
        self, closest: Pairs, points: Array, use: np.ndarray, posture: Posture, hold: float
    ) -> Pairs:
        """The exact `closest` pairs with rows replaced by those that are held on to."""
        if hold == 0.0 or closest.closest < 0 or len(self._slot) == 0:
            self._slot = closest.slot
            return closest
        old = self._body.measure(points, use, posture, self._slot)
        keep = (old.slot >= 0) & (old.distance <= closest.distance + hold)
        pick = np.where(keep, old.slot, closest.slot)
        self._slot = pick

        def chosen(a: Array, b: Array) -> Array:
            return freeze(np.where(keep.reshape(-1, *[1] * (a.ndim - 1)), a, b))

        distance = chosen(old.distance, closest.distance)
        return Pairs(
            link=closest.link,
            distance=distance,
            on_robot=chosen(old.on_robot, closest.on_robot),
            on_world=chosen(old.on_world, closest.on_world),
            normal=chosen(old.normal, closest.normal),
            slot=freeze(pick),
            closest=_closest(distance, self._body.moves),
        )


class MountPairs:
    """Nearest point of the cloud to every lens."""

    def __init__(self, skin: Skin) -> None:
        self._skin = skin

    def update(self, cloud: Cloud, posture: Posture) -> Pairs:
        """One row a sensor."""
        return self.search(cloud.points, cloud.verdict == Verdict.KEPT, posture)

    def search(self, points: Array, use: np.ndarray, posture: Posture) -> Pairs:
        """The same for any points (n, 3), base frame; `use` (n,) bool."""
        skin = self._skin
        T = posture.T_base_link[skin.link]
        lens = np.einsum("kij,kj->ki", T[:, :3, :3], skin.origin) + T[:, :3, 3]
        retreat = -np.einsum("kij,kj->ki", T[:, :3, :3], skin.axis)
        distance, row = np.empty(skin.count), np.empty(skin.count, dtype=np.int64)
        nearest_of_origins(points, use, lens, distance, row)
        everyone = np.ones(skin.count, dtype=bool)
        return _pairs(skin.link, points, distance, row, lens, retreat, everyone)


def _closest(distance: Array, moves: np.ndarray) -> int:
    """Row of the smallest distance of what can move, -1 if it has no pair."""
    row = int(np.argmin(np.where(moves, distance, np.inf)))
    return row if moves[row] and np.isfinite(distance[row]) else -1


def _pairs(
    link: np.ndarray,
    points: Array,
    distance: Array,
    row: np.ndarray,
    on_robot: Array,
    fallback: Array,
    moves: np.ndarray,
) -> Pairs:
    """Assemble rows; `fallback` (B, 3) is the retreat direction where the points touch."""
    on_world, normal = np.empty((len(row), 3)), np.empty((len(row), 3))
    _retreat(points, distance, row, on_robot, fallback, on_world, normal)
    return Pairs(
        link=link,
        distance=freeze(distance),
        on_robot=freeze(on_robot),
        on_world=freeze(on_world),
        normal=freeze(normal),
        slot=freeze(row),
        closest=_closest(distance, moves),
    )


@compiled
def _retreat(
    points: Array,
    distance: Array,
    row: np.ndarray,
    on_robot: Array,
    fallback: Array,
    on_world: Array,
    normal: Array,
) -> None:
    for b in range(len(row)):
        for i in range(3):
            if row[b] < 0:
                on_world[b, i] = normal[b, i] = np.nan
                continue
            on_world[b, i] = points[row[b], i]
            if abs(distance[b]) < TOUCHING:
                normal[b, i] = fallback[b, i]
            else:
                normal[b, i] = (on_robot[b, i] - on_world[b, i]) / distance[b]
