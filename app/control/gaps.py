"""Gaps between capsules, and between capsules and the cell: what they are, and where.

Links are capsules, long ones cut into pieces. Everything is culled with balls around them
first; what is left is exact. The arrays are few: handing one to a kernel costs 0.15 us.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

# [m] distance that is kept between links, and between a link and the cell: the capsules hold
# the meshes and the cell has margins, so more of it only forbids postures that arms work in
KEPT = 0.005


class Gaps(NamedTuple):
    """g nearest places.

    who:      (g, 4) which of the clearance's pairs it is, links a and b, and the part of the
              cell. b is -1 for the cell, which stands still; the part is one of `Cell.names`,
              -1 where there is a link b.
    distance: (g,) [m] signed.
    where:    (g, 3, 3) points on a and on b, and the normal, which points to a; base frame.
    """

    who: NDArray[np.int64]
    distance: Array
    where: Array

    @property
    def pair(self) -> NDArray[np.int64]:
        return self.who[:, 0]

    @property
    def a(self) -> NDArray[np.int64]:
        return self.who[:, 1]

    @property
    def b(self) -> NDArray[np.int64]:
        return self.who[:, 2]

    @property
    def part(self) -> NDArray[np.int64]:
        return self.who[:, 3]

    @property
    def on_a(self) -> Array:
        return self.where[:, 0]

    @property
    def on_b(self) -> Array:
        return self.where[:, 1]

    @property
    def normal(self) -> Array:
        return self.where[:, 2]


class Pieces(NamedTuple):
    """Q capsules: ends (Q, 2, 3) link frame, radius (Q,), link (Q,); link i's begin at first[i]."""

    ends: Array
    radius: Array
    link: NDArray[np.int64]
    first: NDArray[np.int64]


class Placed(NamedTuple):
    """The same, base frame: ends (Q, 2, 3), radius (Q,), balls around them (Q, 3) and (Q,)."""

    ends: Array
    radius: Array
    centre: Array
    ball: Array


@compiled
def room_for(most: int) -> Gaps:
    """Room for gaps."""
    return Gaps(np.empty((most, 4), np.int64), np.empty(most), np.empty((most, 3, 3)))


@compiled
def first_of(gaps: Gaps, n: int) -> Gaps:
    """The first n of them."""
    return Gaps(gaps.who[:n], gaps.distance[:n], gaps.where[:n])


@compiled
def place(T_base_link: Array, pieces: Pieces) -> Placed:
    """The pieces at a posture, T_base_link (L, 4, 4)."""
    Q = len(pieces.radius)
    ends, centre, ball = np.empty((Q, 2, 3)), np.empty((Q, 3)), np.empty(Q)
    for q in range(Q):
        T = T_base_link[pieces.link[q]]
        for e in range(2):
            for i in range(3):
                v = T[i, 3]
                for k in range(3):
                    v += T[i, k] * pieces.ends[q, e, k]
                ends[q, e, i] = v
        square = 0.0
        for i in range(3):
            centre[q, i] = 0.5 * (ends[q, 0, i] + ends[q, 1, i])
            square += (ends[q, 1, i] - ends[q, 0, i]) ** 2
        ball[q] = 0.5 * np.sqrt(square) + pieces.radius[q]
    return Placed(ends, pieces.radius, centre, ball)


@compiled
def lead_out(rx: float, ry: float, sign: float, where: Array) -> None:
    """Move the places on two axes, or on an axis and the cell, out by radii rx, ry; the normal.

    where: (3, 3), a row of `Gaps.where`.   sign: -1 where the first lies in the cell, so that the
    way out is from it to the second.
    """
    square = 0.0
    for i in range(3):
        square += (where[0, i] - where[1, i]) ** 2
    length = np.sqrt(square)
    for i in range(3):
        n = 1.0 if i == 2 else 0.0  # axes that cross: any direction leads out
        if length >= 1e-9:
            n = sign * (where[0, i] - where[1, i]) / length
        where[0, i] -= rx * n
        where[1, i] += ry * n
        where[2, i] = n
