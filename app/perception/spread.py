"""The compiled choice of several well-separated near points a link, for controllers with rows.

A wall gives hundreds of nearly equal pairs; one stands for its neighbours. Points are thinned
to one a voxel (the one whose lower bound is smallest), then taken from near to far while they
differ in direction or place from every row already taken. Exact distances are only computed
for points whose bound says that they may be next, and for no more than `LOOKS` a link: along
a long wall the rows found are the nearest, not always all.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.perception.nearest import box_distance2, nearest_face, to_link
from app.perception.tree import Forest

VOXEL = 0.05  # [m] one candidate each
TURN = float(np.cos(np.radians(25.0)))  # rows whose normals differ by more are kept both
APART = 0.08  # [m] as are rows whose points on the robot lie farther apart
LOOKS = 24  # exact distances computed for a link before its rows are called complete
TABLE = 4096  # places in the table of voxels: a power of two
CANDIDATES = 1024  # voxels a link may have within reach; the rest are farther than these


@compiled
def several_of_links(
    points: Array,
    use: NDArray[np.bool_],
    first: NDArray[np.int64],
    reach: float,
    T_base_link: Array,
    forest: Forest,
    distance: Array,
    row: NDArray[np.int64],
    on_link: Array,
    outward: Array,
) -> None:
    """Up to k pairs of every link, nearer than `reach` [m], the exact closest one first.

    first: (L,) rows that are the closest, -1 for none.   points: (n, 3) base frame.
    Writes distance (L, k) (+inf), row (L, k) (-1), on_link and outward (L, k, 3) base frame.
    """
    k = distance.shape[1]
    p, found = np.empty(3), np.empty(3)
    voxel_of = np.empty((TABLE, 3), dtype=np.int64)
    place = np.empty(TABLE, dtype=np.int64)
    key, which = np.empty(CANDIDATES), np.empty(CANDIDATES, dtype=np.int64)
    exact = np.empty(CANDIDATES, dtype=np.bool_)
    feet = np.empty((LOOKS, 3))
    foot, out = np.empty((CANDIDATES, 3)), np.empty((CANDIDATES, 3))
    for link in range(len(forest.root)):
        distance[link], row[link] = np.inf, -1
        if first[link] < 0:
            continue
        T = T_base_link[link]
        place[:] = -1
        n = 0
        for i in range(len(points)):
            if not use[i]:
                continue
            to_link(T, points[i], p)
            bound = box_distance2(p, forest.low, forest.high, link)
            if not (bound < reach * reach) and i != first[link]:
                continue
            if i == first[link]:
                bound = -np.inf  # stands for its voxel, and is looked at first
            x = int(np.floor(points[i, 0] / VOXEL))
            y = int(np.floor(points[i, 1] / VOXEL))
            z = int(np.floor(points[i, 2] / VOXEL))
            h = (x * 73856093 ^ y * 19349663 ^ z * 83492791) & (TABLE - 1)
            while place[h] >= 0 and not (
                voxel_of[h, 0] == x and voxel_of[h, 1] == y and voxel_of[h, 2] == z
            ):
                h = (h + 1) & (TABLE - 1)
            c = place[h]
            if c < 0:
                if n == CANDIDATES:
                    if i != first[link]:
                        continue
                    n -= 1
                c = n
                n += 1
                place[h] = c
                voxel_of[h, 0], voxel_of[h, 1], voxel_of[h, 2] = x, y, z
                key[c] = np.inf
            if bound < key[c]:
                key[c], which[c], exact[c] = bound, i, False
        taken = 0
        looks = 0
        known_feet = 0
        while taken < k:
            c = -1
            for j in range(n):
                if (exact[j] or looks < LOOKS) and key[j] < np.inf and (c < 0 or key[j] < key[c]):
                    c = j
            if c < 0:
                break
            if not exact[c]:
                looks += 1
                to_link(T, points[which[c]], p)
                bound = box_distance2(p, forest.low, forest.high, link)
                limit = np.inf if bound == 0.0 or which[c] == first[link] else reach * reach
                for j in range(known_feet):  # no farther than any foot that is known already
                    known = 1e-12
                    for a in range(3):
                        known += (p[a] - feet[j, a]) ** 2
                    limit = min(limit, known * 1.0001)
                d2, face, part = nearest_face(p, limit, link, forest, found)
                if face < 0:
                    key[c] = np.inf
                    continue
                feet[known_feet] = found
                known_feet += 1
                d = np.sqrt(d2)
                v = forest.normals[face, part]
                side = (
                    (p[0] - found[0]) * v[0] + (p[1] - found[1]) * v[1] + (p[2] - found[2]) * v[2]
                )
                key[c] = -d if bound == 0.0 and forest.closed[link] and side < 0.0 else d
                exact[c] = True
                size = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
                for a in range(3):
                    foot[c, a] = (
                        T[a, 0] * found[0] + T[a, 1] * found[1] + T[a, 2] * found[2] + T[a, 3]
                    )
                    out[c, a] = (T[a, 0] * v[0] + T[a, 1] * v[1] + T[a, 2] * v[2]) / size
                if which[c] != first[link]:
                    continue
            if _apart(
                c, points[which[c]], key[c], foot, out,
                taken, points, row[link], distance[link], on_link[link], outward[link],
            ):  # fmt: skip
                distance[link, taken], row[link, taken] = key[c], which[c]
                on_link[link, taken], outward[link, taken] = foot[c], out[c]
                taken += 1
            key[c] = np.inf


@compiled
def held_of_links(
    points: Array,
    use: NDArray[np.bool_],
    first: NDArray[np.int64],
    T_base_link: Array,
    forest: Forest,
    distance: Array,
    row: NDArray[np.int64],
    on_link: Array,
    outward: Array,
) -> None:
    """The exact distances of the pairs in `row` (L, k), each link's `first` (L,) in front.

    What is not there or in use any more, or is the first itself, is dropped: row -1, distance
    +inf.
    """
    p, found, feet = np.empty(3), np.empty(3), np.empty((row.shape[1], 3))
    for link in range(len(forest.root)):
        T, known = T_base_link[link], 0
        for i in range(row.shape[1]):
            r = first[link] if i == 0 else row[link, i]
            row[link, i], distance[link, i] = -1, np.inf
            if r < 0 or r >= len(points) or not use[r] or (i > 0 and r == first[link]):
                continue
            to_link(T, points[r], p)
            bound = box_distance2(p, forest.low, forest.high, link)
            limit = np.inf
            for j in range(known):  # no farther than any foot that is known already
                square = 1e-12
                for a in range(3):
                    square += (p[a] - feet[j, a]) ** 2
                limit = min(limit, square * 1.0001)
            d2, face, part = nearest_face(p, limit, link, forest, found)
            if face < 0:
                continue
            feet[known] = found
            known += 1
            v, side, size = forest.normals[face, part], 0.0, 0.0
            for a in range(3):
                side += (p[a] - found[a]) * v[a]
                size += v[a] * v[a]
            inside = bound == 0.0 and forest.closed[link] and side < 0.0
            row[link, i], distance[link, i] = r, -np.sqrt(d2) if inside else np.sqrt(d2)
            for a in range(3):
                on_link[link, i, a] = T[a, 3]
                outward[link, i, a] = 0.0
                for c in range(3):
                    on_link[link, i, a] += T[a, c] * found[c]
                    outward[link, i, a] += T[a, c] * v[c] / np.sqrt(size)


@compiled
def _apart(
    c: int,
    point: Array,
    d: float,
    foot: Array,
    out: Array,
    taken: int,
    points: Array,
    row: NDArray[np.int64],
    distance: Array,
    on_link: Array,
    outward: Array,
) -> bool:
    """Does candidate c differ in direction or place from every row that is taken?"""
    for r in range(taken):
        gap = 0.0
        cosine = 0.0
        for a in range(3):
            gap += (foot[c, a] - on_link[r, a]) ** 2
            mine = (foot[c, a] - point[a]) / d if abs(d) > 1e-6 else -out[c, a]
            other = -outward[r, a]
            if abs(distance[r]) > 1e-6:
                other = (on_link[r, a] - points[row[r], a]) / distance[r]
            cosine += mine * other
        if gap <= APART * APART and cosine >= TURN:
            return False
    return True
