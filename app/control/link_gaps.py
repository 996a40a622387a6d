"""The compiled clearance of links from each other: capsules against capsules."""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.control.gaps import Gaps, Pieces, Placed, first_of, lead_out, place, room_for
from app.control.segments import between
from app.messages import Array


@compiled
def links_within(
    T_base_link: Array, pieces: Pieces, pairs: NDArray[np.int64], within: float
) -> Gaps:
    """The gap of every two links, `pairs` (p, 2), that are nearer than `within` [m]."""
    placed, out, n = place(T_base_link, pieces), room_for(len(pairs)), 0
    for k in range(len(pairs)):
        if _nearest(placed, pieces, pairs[k], within, n, out):
            out.who[n, 0], out.who[n, 1], out.who[n, 2] = k, pairs[k, 0], pairs[k, 1]
            out.who[n, 3] = -1
            n += 1
    return first_of(out, n)


@compiled
def _nearest(
    placed: Placed, pieces: Pieces, pair: NDArray[np.int64], within: float, n: int, out: Gaps
) -> bool:
    """Is some capsule of one link `within` one of the other? Writes gap n, of the nearest."""
    least, where = within, out.where[n]
    for c in range(pieces.first[pair[0]], pieces.first[pair[0] + 1]):
        for o in range(pieces.first[pair[1]], pieces.first[pair[1] + 1]):
            square = 0.0
            for i in range(3):
                square += (placed.centre[c, i] - placed.centre[o, i]) ** 2
            if square >= (least + placed.ball[c] + placed.ball[o]) ** 2:
                continue
            a, b, rx, ry = placed.ends[c], placed.ends[o], placed.radius[c], placed.radius[o]
            s, t = between(a[0], a[1], b[0], b[1])
            square = 0.0
            for i in range(3):
                square += (
                    a[0, i] + s * (a[1, i] - a[0, i]) - b[0, i] - t * (b[1, i] - b[0, i])
                ) ** 2
            distance = np.sqrt(square) - rx - ry
            if distance < least:
                least = distance
                for i in range(3):
                    where[0, i] = a[0, i] + s * (a[1, i] - a[0, i])
                    where[1, i] = b[0, i] + t * (b[1, i] - b[0, i])
                lead_out(rx, ry, 1.0, where)
                out.distance[n] = distance
    return least < within


@compiled
def times_near(T: Array, pieces: Pieces, pairs: NDArray[np.int64], within: float) -> Array:
    """(p,) in how many of the postures T (m, L, 4, 4) links are nearer than `within` [m]."""
    times = np.zeros(len(pairs))
    for m in range(len(T)):
        for k in links_within(T[m], pieces, pairs, within).who[:, 0]:
            times[k] += 1
    return times
