"""The compiled parts of the memory: a hash grid in flat arrays.

A voxel lives in one row of the arrays for as long as it lives, so that a row is an identity;
the table maps its cell to the row. Rows are used again after a death.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

EDGE = 0.03  # [m] of a voxel
RADIUS, HEIGHT = 1.5, 2.0  # [m] around the base axis, up and down: what is farther is let go
WEIGHT = 8  # points that the running mean remembers
CONFIRM = 0.3  # [s] within which a second hit in or beside a voxel confirms it
STATIC_FRAMES = 10  # frames that saw a voxel before it counts as standing still
UNDECIDED, MOVING, STATIC = 0, 1, 2  # kinds
SPREAD = 0.25  # [m] around a voxel that left, what is undecided has probably moved too
TABLE = 65536
FREE = -1


class Voxels(NamedTuple):
    """Rows (N,): point [m] base frame; cell, -1 for a free row; when it was born, last seen and
    its place last looked at [s]; hits, frames and misses counted; kind; confirmed; near the arm.
    table: (TABLE,) rows. top: (1,) rows ever used.
    """

    point: Array
    cell: NDArray[np.int64]
    born: Array
    seen: Array
    looked: Array
    hits: NDArray[np.int64]
    frames: NDArray[np.int64]
    strong: NDArray[np.int64]
    weak: NDArray[np.int64]
    inside: NDArray[np.int64]
    kind: NDArray[np.uint8]
    confirmed: NDArray[np.bool_]
    near: NDArray[np.bool_]
    table: NDArray[np.int64]
    top: NDArray[np.int64]


def empty(capacity: int) -> Voxels:
    """No voxel yet, room for `capacity`."""
    count = [np.zeros(capacity, dtype=np.int64) for _ in range(5)]
    return Voxels(
        point=np.full((capacity, 3), np.nan),
        cell=np.full(capacity, FREE, dtype=np.int64),
        born=np.zeros(capacity),
        seen=np.full(capacity, -np.inf),
        looked=np.full(capacity, -np.inf),
        hits=count[0],
        frames=count[1],
        strong=count[2],
        weak=count[3],
        inside=count[4],
        kind=np.zeros(capacity, dtype=np.uint8),
        confirmed=np.zeros(capacity, dtype=bool),
        near=np.zeros(capacity, dtype=bool),
        table=np.full(TABLE, FREE, dtype=np.int64),
        top=np.zeros(1, dtype=np.int64),
    )


@compiled
def cell_of(x: int, y: int, z: int) -> int:
    """Cells are numbered from the corner of a 128^3 block around the base."""
    return ((x + 64) << 16) | ((y + 64) << 8) | (z + 128)


@compiled
def find(v: Voxels, cell: int) -> int:
    """Row of a cell, -1 if there is none."""
    h = (cell * 2654435761) & (TABLE - 1)
    while v.table[h] >= 0:
        if v.cell[v.table[h]] == cell:
            return int(v.table[h])
        h = (h + 1) & (TABLE - 1)
    return -1


@compiled
def insert(
    v: Voxels, points: Array, use: NDArray[np.bool_], sure: NDArray[np.bool_], now: float
) -> None:
    """Take the used `points` (n, 3) of one frame in; a full grid replaces its oldest voxels.

    sure: (n,) it is not the arm itself; another point only renews what is there already.
    """
    next_free = 0
    for i in range(len(points)):
        p = points[i]
        if not use[i] or not (p[0] ** 2 + p[1] ** 2 < RADIUS**2 and abs(p[2]) < HEIGHT):
            continue
        x, y, z = (
            int(np.floor(p[0] / EDGE)),
            int(np.floor(p[1] / EDGE)),
            int(np.floor(p[2] / EDGE)),
        )
        cell = cell_of(x, y, z)
        row = find(v, cell)
        if row < 0 and not sure[i]:
            continue
        if row < 0:
            while next_free < v.top[0] and v.cell[next_free] >= 0:
                next_free += 1
            row = next_free
            if row == len(v.cell):
                _make_room(v)
                row = 0
                while v.cell[row] >= 0:
                    row += 1
                next_free = row
            v.top[0] = max(v.top[0], row + 1)
            v.cell[row] = cell
            v.point[row] = p
            v.born[row], v.hits[row], v.frames[row] = now, 1, 1
            v.kind[row], v.confirmed[row], v.near[row] = UNDECIDED, False, True
            v.looked[row] = -np.inf
            v.strong[row], v.weak[row], v.inside[row] = 0, 0, 0
            h = (cell * 2654435761) & (TABLE - 1)
            while v.table[h] >= 0:
                h = (h + 1) & (TABLE - 1)
            v.table[h] = row
        else:
            v.confirmed[row] |= now - v.seen[row] <= CONFIRM
            v.hits[row] += 1
            share = 1.0 / min(v.hits[row], WEIGHT)
            for a in range(3):
                v.point[row, a] += share * (p[a] - v.point[row, a])
            if v.seen[row] < now:
                v.frames[row] += 1
            v.strong[row], v.weak[row] = 0, 0
            if v.kind[row] != MOVING and v.confirmed[row] and v.frames[row] >= STATIC_FRAMES:
                v.kind[row] = STATIC
        v.seen[row] = now
        if not v.confirmed[row]:
            _ask_neighbours(v, row, x, y, z, now)


@compiled
def _ask_neighbours(v: Voxels, row: int, x: int, y: int, z: int, now: float) -> None:
    for dx in range(-1, 2):
        for dy in range(-1, 2):
            for dz in range(-1, 2):
                other = find(v, cell_of(x + dx, y + dy, z + dz))
                if other >= 0 and other != row and now - v.seen[other] <= CONFIRM:
                    v.confirmed[row] = True
                    v.confirmed[other] = True


@compiled
def mark_moving(v: Voxels, centres: Array, since: float) -> None:
    """What was seen since then around any of `centres` (m, 3) [m] moves."""
    for row in range(v.top[0]):
        if v.cell[row] >= 0 and v.seen[row] >= since and v.kind[row] != MOVING:
            for i in range(len(centres)):
                near = 0.0
                for a in range(3):
                    near += (v.point[row, a] - centres[i, a]) ** 2
                if near < SPREAD * SPREAD:
                    v.kind[row] = MOVING
                    break


@compiled
def review(
    v: Voxels,
    first: int,
    last: int,
    now: float,
    life: Array,
    T_base_link: Array,
    box: Array,
    reach: float,
) -> None:
    """Look through rows first..last: bury the old, and mark what is in reach of a link's box.

    life: (3,) [s] by kind.   box: (2, L, 3) low and high corner of the links' boxes, link frame.
    """
    for row in range(first, min(last, v.top[0])):
        if v.cell[row] < 0:
            continue
        age = now - v.seen[row]
        unconfirmed = not v.confirmed[row] and age > CONFIRM
        if age > _life(v, row, life) or unconfirmed or v.inside[row] >= 3:
            remove(v, row)
        else:
            v.near[row] = not is_apart(v.point[row], T_base_link, box, reach)
    while v.top[0] > 0 and v.cell[v.top[0] - 1] < 0:
        v.top[0] -= 1


@compiled
def _life(v: Voxels, row: int, life: Array) -> float:
    """[s] that a voxel stays without being seen: what nobody has looked at is not gone."""
    if v.kind[row] == UNDECIDED and v.looked[row] <= v.seen[row]:
        return float(life[STATIC])
    return float(life[v.kind[row]])


@compiled
def is_apart(point: Array, T_base_link: Array, box: Array, reach: float) -> bool:
    """Is a point (3,) of the base frame farther than `reach` [m] from all links' boxes?"""
    for link in range(len(T_base_link)):
        T, square = T_base_link[link], 0.0
        x, y, z = point[0] - T[0, 3], point[1] - T[1, 3], point[2] - T[2, 3]
        for a in range(3):
            u = T[0, a] * x + T[1, a] * y + T[2, a] * z
            square += max(max(box[0, link, a] - u, u - box[1, link, a]), 0.0) ** 2
        if square < reach * reach:
            return False
    return True


@compiled
def remove(v: Voxels, row: int) -> None:
    """Let one voxel die and close the gap that it leaves in the table (linear probing)."""
    mask = TABLE - 1
    h = (v.cell[row] * 2654435761) & mask
    while v.table[h] != row:
        h = (h + 1) & mask
    v.cell[row] = FREE
    v.point[row] = np.nan
    v.confirmed[row] = False
    v.seen[row] = -np.inf
    hole = h
    while True:
        h = (h + 1) & mask
        other = v.table[h]
        if other < 0:
            break
        home = (v.cell[other] * 2654435761) & mask
        if (h - home) & mask >= (h - hole) & mask:
            v.table[hole] = other
            hole = h
    v.table[hole] = FREE


@compiled
def _make_room(v: Voxels) -> None:
    """Let the twentieth of the voxels die that has not been seen for longest."""
    limit = np.sort(v.seen)[len(v.seen) // 20]
    for row in range(len(v.cell)):
        if v.cell[row] >= 0 and v.seen[row] <= limit:
            remove(v, row)
