"""The compiled search of the paper's Algorithm 2: the nearest point of each link, exactly.

The point that was nearest last time is looked at first. Its distance dismisses nearly all
others, by a box around the link and a coarse table; the tree is asked for the few that are
left, the most promising first. float64.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.perception.field import least_square
from app.perception.gathered import Gathered, box_squares, gather
from app.perception.look import TOUCHING, Found, Links, closest, copy, erase, look, room
from app.perception.nearest import to_link

FEW = 32  # points that a link's table is asked for without a better guess before


@compiled
def nearest_of_links(
    points: Array,
    use: NDArray[np.bool_],
    T_base_link: Array,
    hint: NDArray[np.int64],
    links: Links,
    out: Found,
) -> int:
    """Write the pair of every link with the nearest of the used points (n, 3), base frame.

    hint: (L,) row that was nearest last time, -1 for none. Points with NaN are passed over.
    Returns the link of the closest pair of what moves, -1 if there is none.
    """
    who, other = gather(points, use), room(1)
    m = len(who.row)
    square, ahead = np.empty(m), np.empty(m, dtype=np.int64)
    for link in range(len(links.moves)):
        T, known = T_base_link[link], 0 <= hint[link] < len(points) and use[hint[link]]
        out.row[link] = hint[link] if known else -1
        look(points, T, link, np.inf, links.forest, out, link, link + 1)
        box_squares(who, T, link, links.forest, square)
        i = _better_guess(square, out.distance[link])
        if i >= 0:
            other.row[0] = who.row[i]
            look(points, T, link, np.inf, links.forest, other, 0, 1)
            if other.distance[0] < out.distance[link]:
                copy(other, 0, out, link)
        n, first = _promising(who, T, link, links, out, square, ahead)
        for j in range(-1, n):
            i = ahead[first if j < 0 else j]
            best = max(out.distance[link], 0.0)
            if n > 0 and j != first and square[i] < best * best:
                other.row[0] = who.row[i]
                look(points, T, link, best, links.forest, other, 0, 1)
                if other.distance[0] < out.distance[link]:
                    copy(other, 0, out, link)
    return closest(out, links.moves)


@compiled
def _better_guess(square: Array, distance: float) -> int:
    """The point whose box is nearest where a pair this far dismisses too few; -1: it will do.

    One look is dearer than a few rows of the table, and dearer still are all rows of it.
    """
    limit, few, nearest = max(distance, 0.0) ** 2, 0, -1
    for i in range(len(square)):
        few += square[i] < limit
        if nearest < 0 or square[i] < square[nearest]:
            nearest = i
    return nearest if few > FEW else -1


@compiled
def _promising(
    who: Gathered, T: Array, link: int, links: Links, out: Found, square: Array,
    ahead: NDArray[np.int64],
) -> tuple[int, int]:  # fmt: skip
    """Write to `ahead` which points may be nearer than the link's pair, to `square` a better
    bound of each; how many, and which of them promises most.

    Any point inside the link's box may lie inside the link, the deeper the nearer: -1.
    """
    n, first, p = 0, 0, np.empty(3)
    limit = max(out.distance[link], 0.0) ** 2
    for i in range(len(square)):
        if (square[i] >= limit and square[i] > 0.0) or who.row[i] == out.row[link]:
            continue
        if square[i] == 0.0:
            square[i] = -1.0
        else:
            p[0], p[1], p[2] = who.x[i], who.y[i], who.z[i]
            to_link(T, p, p)
            square[i] = max(square[i], least_square(p, link, links.forest, links.field))
        if square[i] < limit:
            if n == 0 or square[i] < square[ahead[first]]:
                first = n
            ahead[n] = i
            n += 1
    return n, first


@compiled
def nearest_of_origins(
    points: Array, use: NDArray[np.bool_], origins: Array, retreat: Array, out: Found
) -> int:
    """Write the pair of each origin (K, 3) with the nearest used point, base frame; the closest.

    retreat: (K, 3) unit direction to lead away to where the point is at the origin itself.
    """
    nearest = -1
    for k in range(len(origins)):
        best, row = np.inf, -1
        for i in range(len(points)):
            if use[i]:
                x = points[i, 0] - origins[k, 0]
                y = points[i, 1] - origins[k, 1]
                z = points[i, 2] - origins[k, 2]
                if x * x + y * y + z * z < best:
                    best, row = x * x + y * y + z * z, i
        erase(out, k)
        if row < 0:
            continue
        out.distance[k], out.row[k] = np.sqrt(best), row
        out.on_robot[k], out.on_world[k], out.normal[k] = origins[k], points[row], retreat[k]
        if out.distance[k] >= TOUCHING:
            for a in range(3):
                out.normal[k, a] = (origins[k, a] - points[row, a]) / out.distance[k]
        if nearest < 0 or out.distance[k] < out.distance[nearest]:
            nearest = k
    return nearest
