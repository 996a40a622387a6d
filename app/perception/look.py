"""The exact look: how far points of the world are from one link, and by which way.

Every pair of the whole body comes from here, whoever asks for it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.perception.nearest import Batch, batch, box_distance2, nearest_faces, to_link
from app.perception.tree import Forest

TOUCHING = 1e-6  # [m] below this the direction of retreat comes from the surface's normal


class Links(NamedTuple):
    """What is known of the L body links: trees, `field` of `app.perception.field`, and which of
    them move (L,) bool.
    """

    forest: Forest
    field: NDArray[np.float32]
    moves: NDArray[np.bool_]


class Found(NamedTuple):
    """B pairs, as in `app.messages.Pairs`; the same number of rows for every link, in order.

    distance (B,) +inf and row (B,) of the world's point -1 where there is none; on_robot,
    on_world, normal (B, 3) base frame, NaN there.
    """

    distance: Array
    row: NDArray[np.int64]
    on_robot: Array
    on_world: Array
    normal: Array


@compiled
def room(n: int) -> Found:
    """For n pairs."""
    return Found(
        np.empty(n), np.empty(n, dtype=np.int64), np.empty((n, 3)), np.empty((n, 3)),
        np.empty((n, 3)),
    )  # fmt: skip


@compiled
def look(
    points: Array, T: Array, link: int, limit: float, forest: Forest, out: Found, first: int,
    last: int,
) -> None:  # fmt: skip
    """Write the pairs of a link posed at T with the points that rows first..last of `out` name.

    What is not nearer than `limit` [m] is erased, and what names none; inside the link's box
    there is no limit, for the deeper a point is the nearer it is.
    """
    asked = batch(last - first)
    for i in range(last - first):
        row = out.row[first + i]
        asked.p[i], asked.square[i] = 0.0, 0.0
        if row >= 0:
            to_link(T, points[row], asked.p[i])
            inside = box_distance2(asked.p[i], forest.low, forest.high, link) == 0.0
            asked.square[i] = np.inf if inside else limit * limit
    nearest_faces(asked, link, forest)
    for i in range(last - first):
        if asked.face[i] < 0:
            erase(out, first + i)
        else:
            _write(points[out.row[first + i]], T, link, forest, asked, i, out, first + i)


@compiled
def _write(
    point: Array, T: Array, link: int, forest: Forest, asked: Batch, i: int, out: Found, b: int
) -> None:
    """Write to row b the pair of a point with the foot that was found for it."""
    p, foot, on, normal = asked.p[i], asked.foot[i], out.on_robot[b], out.normal[b]
    outward, side, size = forest.normals[asked.face[i], asked.part[i]], 0.0, 0.0
    for a in range(3):
        side += (p[a] - foot[a]) * outward[a]
        size += outward[a] * outward[a]
    d = np.sqrt(asked.square[i])
    if forest.closed[link] and side < 0.0:
        d = -d
    out.distance[b] = d
    for a in range(3):
        on[a], normal[a] = T[a, 3], 0.0
        for c in range(3):
            on[a] += T[a, c] * foot[c]
            normal[a] -= T[a, c] * outward[c] / np.sqrt(size)
        out.on_world[b, a] = point[a]
        if abs(d) >= TOUCHING:
            normal[a] = (on[a] - point[a]) / d


@compiled
def copy(a: Found, i: int, out: Found, b: int) -> None:
    """Write pair i of `a` to row b."""
    out.distance[b], out.row[b] = a.distance[i], a.row[i]
    for k in range(3):
        out.on_robot[b, k], out.on_world[b, k] = a.on_robot[i, k], a.on_world[i, k]
        out.normal[b, k] = a.normal[i, k]


@compiled
def erase(out: Found, b: int) -> None:
    """No pair in row b."""
    out.distance[b], out.row[b] = np.inf, -1
    for k in range(3):
        out.on_robot[b, k] = out.on_world[b, k] = out.normal[b, k] = np.nan


@compiled
def closest(out: Found, moves: NDArray[np.bool_]) -> int:
    """Row of the smallest distance of what moves (L,), -1 if it has no pair."""
    first, k = -1, len(out.row) // len(moves)
    for b in range(len(out.row)):
        nearer = first < 0 or out.distance[b] < out.distance[first]
        if moves[b // k] and out.row[b] >= 0 and nearer:
            first = b
    return first


@compiled
def measure_rows(
    points: Array, use: NDArray[np.bool_], T_base_link: Array, links: Links, out: Found
) -> int:
    """Write the pair of every link with the point that `row` (L,) names; returns the closest.

    points: (n, 3) base frame, use: (n,). What is not there or in use any more is erased.
    """
    for link in range(len(links.moves)):
        if not 0 <= out.row[link] < len(points) or not use[out.row[link]]:
            out.row[link] = -1
        look(points, T_base_link[link], link, np.inf, links.forest, out, link, link + 1)
    return closest(out, links.moves)
