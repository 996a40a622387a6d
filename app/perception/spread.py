"""The compiled choice of several well-separated near points a link, for controllers with rows.

A wall gives hundreds of nearly equal pairs; one stands for its neighbours. Points are thinned
to one a voxel (the one nearest to the link's box), then taken from near to far while they
differ in direction or place from every row already taken. Exact distances are computed for no
more than `LOOKS` of them a link, those whose voxels are nearest to its box: along a long wall
the rows found are the nearest, not always all.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.perception.gathered import Gathered, box_squares, gather
from app.perception.look import Found, Links, closest, copy, erase, look, room

VOXEL = 0.05  # [m] one candidate each
TURN = float(np.cos(np.radians(25.0)))  # rows whose normals differ by more are kept both
APART = 0.08  # [m] as are rows whose points on the robot lie farther apart
LOOKS = 24  # exact distances computed for a link, its nearest point's among them


class Voxels(NamedTuple):
    """The v voxels that m points lie in: which (m,); of each voxel, the least square [m^2] of
    the distance to a link's box (v,) and the point it is of (v,).
    """

    of: NDArray[np.int64]
    square: Array
    point: NDArray[np.int64]


@compiled
def several_of_links(
    points: Array,
    use: NDArray[np.bool_],
    T_base_link: Array,
    nearest: Found,
    due: NDArray[np.bool_],
    reach: float,
    links: Links,
    out: Found,
) -> int:
    """Write up to k pairs of every link, each link's `nearest` first.

    points: (n, 3) base frame.   due: (L,) whose rows are chosen anew, from near to far and
    within `reach` [m], where the nearest need not be; the others' are the pairs that `row` of
    `out` (L k) names, as they are now.
    Returns the row of the closest pair of what moves, -1 if there is none.
    """
    k = len(out.row) // len(links.moves)
    who = gather(points, use & due.any())  # nobody is due: no point need be gathered
    voxels, square, pool = _voxels(who), np.empty(len(who.row)), room(LOOKS)
    for link in range(len(links.moves)):
        first, T, n = nearest.row[link], T_base_link[link], 0
        if not due[link]:
            _hold(points, use, T, link, nearest, links, out)
            continue
        if first >= 0:
            box_squares(who, T, link, links.forest, square)
            _thin(who, square, first, reach, voxels)
            copy(nearest, link, pool, 0)
            n = _pick(who, voxels, first, pool)
            look(points, T, link, reach, links.forest, pool, 1, n)
        _choose(pool, n, out, link * k, link * k + k)
    return closest(out, links.moves)


@compiled
def _hold(
    points: Array, use: NDArray[np.bool_], T: Array, link: int, nearest: Found, links: Links,
    out: Found,
) -> None:  # fmt: skip
    """Measure a link's rows of `out` again, its `nearest` in front.

    What is not there or in use any more, or is the nearest itself, is erased.
    """
    k = len(out.row) // len(links.moves)
    first, last = link * k + 1, link * k + k
    copy(nearest, link, out, first - 1)
    for b in range(first, last):
        row = out.row[b]
        if not 0 <= row < len(points) or not use[row] or row == nearest.row[link]:
            out.row[b] = -1
    look(points, T, link, np.inf, links.forest, out, first, last)


@compiled
def _voxels(who: Gathered) -> Voxels:
    """Number the voxels in order of appearance."""
    m = len(who.row)
    size = 64
    while size < 2 * m:
        size *= 2
    of, at = np.empty(m, dtype=np.int64), np.empty((m, 3), dtype=np.int64)
    table, n = np.full(size, -1, dtype=np.int64), 0
    for i in range(m):
        x = int(np.floor(who.x[i] / VOXEL))
        y = int(np.floor(who.y[i] / VOXEL))
        z = int(np.floor(who.z[i] / VOXEL))
        h = (x * 73856093 ^ y * 19349663 ^ z * 83492791) & (size - 1)
        while table[h] >= 0:
            v = table[h]
            if at[v, 0] == x and at[v, 1] == y and at[v, 2] == z:
                break
            h = (h + 1) & (size - 1)
        if table[h] < 0:
            table[h] = n
            at[n, 0], at[n, 1], at[n, 2] = x, y, z
            n += 1
        of[i] = table[h]
    return Voxels(of, np.empty(n), np.empty(n, dtype=np.int64))


@compiled
def _thin(who: Gathered, square: Array, first: int, reach: float, voxels: Voxels) -> None:
    """Write which point stands for each voxel and its square, +inf where none is within reach.

    The nearest to the box; where it is there, row `first`, which is not within a box: -1.
    """
    voxels.square[:] = np.inf
    limit = reach * reach
    for i in range(len(square)):
        v, d = voxels.of[i], square[i]
        if who.row[i] == first:
            d = -1.0
        if d < limit and d < voxels.square[v]:
            voxels.square[v], voxels.point[v] = d, i


@compiled
def _pick(who: Gathered, voxels: Voxels, first: int, pool: Found) -> int:
    """Write the rows of the nearest voxels' points to the pool, from near to far, behind that of
    `first`; how many there are then.
    """
    square, n = pool.distance, 1
    for v in range(len(voxels.square)):
        d, row = voxels.square[v], who.row[voxels.point[v]] if voxels.square[v] < np.inf else -1
        if row < 0 or row == first or (n == LOOKS and d >= square[n - 1]):
            continue
        n = min(n, LOOKS - 1)
        at = n
        while at > 1 and square[at - 1] > d:
            square[at], pool.row[at] = square[at - 1], pool.row[at - 1]
            at -= 1
        square[at], pool.row[at] = d, row
        n += 1
    return n


@compiled
def _choose(pool: Found, n: int, out: Found, first: int, last: int) -> None:
    """Write to rows first..last the nearest of n pairs that are apart from those before them."""
    taken = first
    for _ in range(n):
        c = -1
        for i in range(n):
            if pool.row[i] >= 0 and (c < 0 or pool.distance[i] < pool.distance[c]):
                c = i
        if c < 0 or taken == last:
            break
        if _apart(pool, c, out, first, taken):
            copy(pool, c, out, taken)
            taken += 1
        pool.row[c] = -1
    for b in range(taken, last):
        erase(out, b)


@compiled
def _apart(pool: Found, c: int, out: Found, first: int, last: int) -> bool:
    """Does pair c differ in direction or place from rows first..last?"""
    for r in range(first, last):
        gap, cosine = 0.0, 0.0
        for a in range(3):
            gap += (pool.on_robot[c, a] - out.on_robot[r, a]) ** 2
            cosine += pool.normal[c, a] * out.normal[r, a]
        if gap <= APART * APART and cosine >= TURN:
            return False
    return True
