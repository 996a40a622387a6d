"""Which space nobody looks into while some zones cannot tell what is before them.

A zone that cannot tell leaves a cone of space unseen, except where others on the same link look.
What a person puts there is longer than a hand's breadth on either side: a hand hangs on an arm. So
a point counts as unseen if no zone that can tell has a ray within `BREADTH` of it. What no zone has
ever looked into, the wedges between the sensors, is not counted: it is no new blindness.

Zones are taken two by two in rows and columns, where there are so many. Their cones are stood for
by points in the frame of the sensor's link, a few centimetres apart, up to where an arm that comes
as fast as an arm should can stop. So which points are unseen follows from which zones cannot tell,
at every posture, and is asked only when these change.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.robot.skin import Skin

BREADTH = 0.08  # [m] half the length of the shortest part of a person: a hand is 18 cm long
DEPTHS = (0.0, 0.03, 0.06, 0.10, 0.15, 0.20, 0.25, 0.30, 0.36)  # [m] along a ray
SPACING = 0.045  # [m] between points of one sensor
SPLIT = 4  # rows or columns from which on zones are taken two by two


class UnseenPoints(NamedTuple):
    """n points: where, in the frame of their link, (n, 3) [m]; the link and the sensor (n,)."""

    point: Array
    link: NDArray[np.int64]
    sensor: NDArray[np.int64]


class _Rays(NamedTuple):
    """The middle of each of B blocks of zones: its sensor and link (B,), lens and unit ray (B, 3)
    in the link's frame."""

    owner: NDArray[np.int64]
    link: NDArray[np.int64]
    origin: Array
    ray: Array


class Cones:
    """The cones of a skin's zones as points, and which rays pass near each of them."""

    def __init__(self, skin: Skin) -> None:
        self._skin = skin
        self._block = _blocks(skin)  # (S,) of each zone
        B = int(self._block[-1]) + 1
        self.owner = np.zeros(B, dtype=np.int64)  # (B,) sensor of each block
        self.owner[self._block] = skin.sensor_of
        ray = np.zeros((B, 3))
        np.add.at(ray, self._block, skin.reach / np.linalg.norm(skin.reach, axis=1)[:, None])
        ray /= np.linalg.norm(ray, axis=1)[:, None]
        origin, link = skin.origin[self.owner], skin.link[self.owner]
        rays = _Rays(self.owner, link.astype(np.int64), origin, ray)
        point, block = _samples(rays)
        self._of = block  # (n,) block of each point
        self.everything = UnseenPoints(point, rays.link[block], self.owner[block])
        self._beside = np.zeros((len(point), B), dtype=bool)
        _find_beside(self.everything, rays, self._beside)

    def blocks(self, zones: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """(B,) the blocks with any of these zones (S,)."""
        out = np.zeros(len(self.owner), dtype=bool)
        out[self._block[zones]] = True
        return out

    def unseen(self, lost: NDArray[np.bool_], told: NDArray[np.bool_]) -> UnseenPoints:
        """The points of the blocks that are `lost` (B,) and that none of those that can tell,
        `told` (B,), looks at."""
        rows = np.flatnonzero(lost[self._of])
        rows = rows[~self._beside[np.ix_(rows, np.flatnonzero(told))].any(axis=1)]
        every = self.everything
        return UnseenPoints(every.point[rows], every.link[rows], every.sensor[rows])


@lru_cache(maxsize=8)
def cones_of(skin: Skin) -> Cones:
    """Those of a skin, which never change."""
    return Cones(skin)


def _blocks(skin: Skin) -> NDArray[np.int64]:
    """(S,) which block each zone belongs to, numbered from 0, sensor by sensor."""
    out, count = np.empty(skin.slots, dtype=np.int64), 0
    for k, (rows, columns) in enumerate(skin.grid.tolist()):
        high, wide = (2 if n >= SPLIT else 1 for n in (rows, columns))
        row, column = np.divmod(np.arange(rows * columns), columns)
        across = -(-columns // wide)
        out[skin.zones(k)] = count + row // high * across + column // wide
        count += -(-rows // high) * across
    return out


@compiled
def _samples(rays: _Rays) -> tuple[Array, NDArray[np.int64]]:
    """Points (n, 3) on the rays and the blocks (n,) that they belong to, sensor by sensor from near
    to far; none of a sensor nearer to another of it than `SPACING`."""
    B = len(rays.owner)
    point, block, n = np.empty((B * len(DEPTHS), 3)), np.empty(B * len(DEPTHS), np.int64), 0
    for k in range(rays.owner[-1] + 1):
        first = n
        for depth in DEPTHS:
            for b in range(B):
                if rays.owner[b] == k:
                    point[n] = rays.origin[b] + depth * rays.ray[b]
                    if _is_apart(point, first, n):
                        block[n] = b
                        n += 1
    return point[:n].copy(), block[:n].copy()


@compiled
def _is_apart(point: Array, first: int, last: int) -> bool:
    """Is point number `last` at least `SPACING` from those before it, from the `first` on?"""
    for m in range(first, last):
        square = 0.0
        for i in range(3):
            square += (point[m, i] - point[last, i]) ** 2
        if square < SPACING**2:
            return False
    return True


@compiled
def _find_beside(points: UnseenPoints, rays: _Rays, beside: NDArray[np.bool_]) -> None:
    """Set `beside` (n, B) where a point is within `BREADTH` of a block's ray, of one link."""
    for n in range(len(points.link)):
        for b in range(len(rays.link)):
            if points.link[n] != rays.link[b]:
                continue
            along, square = 0.0, 0.0
            for i in range(3):
                along += (points.point[n, i] - rays.origin[b, i]) * rays.ray[b, i]
            along = max(along, 0.0)
            for i in range(3):
                square += (points.point[n, i] - rays.origin[b, i] - along * rays.ray[b, i]) ** 2
            beside[n, b] = square <= BREADTH**2
