"""Closest pairs between the world and the robot, for each control body and overall.

Whole-body (the paper): a control body is a link, its control point any point of its surface.
Sensor mounts (the baseline): a control body is a sensor, its control point the lens. Both
search the same cloud, so that nothing but the control point differs.
"""

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, Cloud, Pairs, Verdict, freeze
from app.perception.field import surveyed
from app.perception.look import Found, Links, measure_rows
from app.perception.search import nearest_of_links, nearest_of_origins
from app.perception.spread import several_of_links
from app.robot.model import Robot
from app.robot.posture import Posture
from app.robot.skin import Skin

PAIRS = 4  # rows a link of `several`
RENEW = 0.008  # [s] between two choices of a link's: every second tick at 250 Hz


class BodyPairs:
    """Closest pair of every link, by exact signed distance to its body mesh."""

    def __init__(self, robot: Robot) -> None:
        self._link = freeze(np.arange(len(robot.links)))
        self._links = freeze(np.repeat(self._link, PAIRS))
        # (L,) the base is measured, never acted on
        self.moves = np.asarray(robot.supports.any(axis=1))
        self._known = Links(*surveyed(robot.bodies), self.moves)
        self.reset()

    def reset(self) -> None:
        """Forget which points were nearest (it only makes the next search faster)."""
        self._hint = np.full(len(self._link), -1, dtype=np.int64)

    def update(self, cloud: Cloud, posture: Posture) -> Pairs:
        """One row a link."""
        return self.search(cloud.points, cloud.verdict == Verdict.KEPT, posture)

    def search(self, points: Array, use: NDArray[np.bool_], posture: Posture) -> Pairs:
        """The same for any points (n, 3), base frame; `use` (n,) bool. NaN rows are skipped."""
        out = _room(len(self._link))
        T = posture.T_base_link
        closest = nearest_of_links(points, use, T, self._hint, self._known, out)
        self._hint = out.row
        return _pairs(self._link, out, closest)

    def measure(
        self, points: Array, use: NDArray[np.bool_], posture: Posture, row: NDArray[np.intp]
    ) -> Pairs:
        """The pair of every link with its own `row` (L,) of the points; -1 for none."""
        out = _room(len(self._link), row)
        closest = measure_rows(points, use, posture.T_base_link, self._known, out)
        return _pairs(self._link, out, closest)

    def several(
        self, points: Array, use: NDArray[np.bool_], posture: Posture, nearest: Pairs,
        reach: float, slot: NDArray[np.intp] | None = None, due: NDArray[np.bool_] | None = None,
    ) -> Pairs:  # fmt: skip
        """Up to four well-separated pairs of every link, row 4 * link + i.

        nearest: what `search` answered for the same points.   due: (L,) bool, whose rows are
        chosen, from near to far; all by default.   reach: [m], farther ones are not, but for
        the nearest of each link.   slot: (4 L,) of an earlier answer: the others' rows are
        those pairs as they are now.
        """
        out, T = _room(len(self._links), slot), posture.T_base_link
        due = np.ones(len(self._link), dtype=bool) if due is None else due
        closest = several_of_links(points, use, T, _found(nearest), due, reach, self._known, out)
        return _pairs(self._links, out, closest)


class ManyPairs:
    """Several pairs a link, chosen anew every `RENEW` seconds and measured anew in each tick.

    The closest pair of each link is always the present one; the choice beside it costs as much
    as the rest of a tick, and frames do not come faster. The links take turns, so that no tick
    pays for all.
    """

    def __init__(self, body: BodyPairs) -> None:
        self._body = body
        self.reset()

    def reset(self) -> None:
        """Choose anew at the next tick."""
        self._slot: NDArray[np.intp] | None = None
        self._chosen = np.full(len(self._body.moves), -np.inf)  # [s] of each link's rows
        self._last = -np.inf  # [s]

    def update(
        self, closest: Pairs, points: Array, use: np.ndarray, posture: Posture, reach: float,
        now: float,
    ) -> Pairs:  # fmt: skip
        """closest: what `search` answered for the same points, at `now` [s]."""
        due = self._due(now)
        pairs = self._body.several(points, use, posture, closest, reach, self._slot, due)
        self._slot, self._last, self._chosen[due] = pairs.slot, now, now
        return pairs

    def _due(self, now: float) -> NDArray[np.bool_]:
        """(L,) bool: the links whose choice is the oldest, as many as have their turn now."""
        links, passed = len(self._chosen), (now - self._last) / RENEW
        due = np.ones(links, dtype=bool)
        if 0.0 <= passed < 1.0:
            turns = int(np.ceil(links * passed - 1e-6))  # 4 ms are half of 8
            due[np.argsort(self._chosen, kind="stable")[turns:]] = False
        return due


class HeldPairs:
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

    def search(self, points: Array, use: NDArray[np.bool_], posture: Posture) -> Pairs:
        """The same for any points (n, 3), base frame; `use` (n,) bool."""
        skin = self._skin
        T = posture.T_base_link[skin.link]
        lens = np.einsum("kij,kj->ki", T[:, :3, :3], skin.origin) + T[:, :3, 3]
        retreat = -np.einsum("kij,kj->ki", T[:, :3, :3], skin.axis)
        out = _room(skin.count)
        return _pairs(skin.link, out, nearest_of_origins(points, use, lens, retreat, out))


def _closest(distance: Array, moves: NDArray[np.bool_]) -> int:
    """Row of the smallest distance of what can move, -1 if it has no pair."""
    row = int(np.argmin(np.where(moves, distance, np.inf)))
    return row if moves[row] and np.isfinite(distance[row]) else -1


def _room(rows: int, row: NDArray[np.intp] | None = None) -> Found:
    """For as many pairs, with a point for each where the question names them."""
    on_robot, on_world, normal = np.empty((3, rows, 3))
    asked = np.empty(rows, dtype=np.int64) if row is None else row.copy()
    return Found(np.empty(rows), asked, on_robot, on_world, normal)


def _found(pairs: Pairs) -> Found:
    return Found(pairs.distance, pairs.slot, pairs.on_robot, pairs.on_world, pairs.normal)


def _pairs(link: NDArray[np.intp], found: Found, closest: int) -> Pairs:
    for array in found:
        array.flags.writeable = False
    return Pairs(
        link, found.distance, found.on_robot, found.on_world, found.normal, found.row, closest
    )  # fmt: skip
