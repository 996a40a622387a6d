"""The compiled parts of the memory: a hash grid in flat arrays.

A voxel lives in one row of the arrays for as long as it lives, so that a row is an identity;
the table maps its cell to the row. Rows are used again after a death.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.messages import Array
from app.perception.search import compiled

EDGE = 0.03  # [m] of a voxel
RADIUS, HEIGHT = 1.5, 2.0  # [m] around the base axis, up and down: what is farther is let go
WEIGHT = 8  # points that the running mean remembers
CONFIRM = 0.3  # [s] within which a second hit in or beside a voxel confirms it
STATIC_FRAMES = 10  # frames that saw a voxel before it counts as standing still
UNDECIDED, MOVING, STATIC = 0, 1, 2
STRONG, WEAK = 2, 5  # misses until a voxel dies: rays that went on, rays without an echo
SPREAD = 0.25  # [m] around a voxel that left, what is undecided has probably moved too
TABLE = 65536
FREE = -1


class Voxels(NamedTuple):
    """Rows (N,): point [m] base frame; cell, -1 for a free row; born, seen [s]; hits, frames
    and misses counted; kind; confirmed. table: (TABLE,) rows. top: (1,) rows ever used.
    """

    point: Array
    cell: NDArray[np.int64]
    born: Array
    seen: Array
    hits: NDArray[np.int64]
    frames: NDArray[np.int64]
    strong: NDArray[np.int64]
    weak: NDArray[np.int64]
    inside: NDArray[np.int64]
    kind: NDArray[np.uint8]
    confirmed: NDArray[np.bool_]
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
        hits=count[0],
        frames=count[1],
        strong=count[2],
        weak=count[3],
        inside=count[4],
        kind=np.zeros(capacity, dtype=np.uint8),
        confirmed=np.zeros(capacity, dtype=bool),
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
            return v.table[h]
        h = (h + 1) & (TABLE - 1)
    return -1


@compiled
def insert(v: Voxels, points: Array, use: NDArray[np.bool_], now: float) -> None:
    """Take the used `points` (n, 3) of one frame in; a full grid replaces its oldest voxels."""
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
        if row < 0:
            while next_free < v.top[0] and v.cell[next_free] >= 0:
                next_free += 1
            row = next_free
            if row == len(v.cell):
                row = int(np.argmin(v.seen))
                v.cell[row] = FREE
                rebuild(v)
            v.top[0] = max(v.top[0], row + 1)
            v.cell[row] = cell
            v.point[row] = p
            v.born[row], v.hits[row], v.frames[row] = now, 1, 1
            v.kind[row], v.confirmed[row] = UNDECIDED, False
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
def carve(
    v: Voxels,
    now: float,
    T_sensor_base: Array,
    size: int,
    pitch: float,
    turn: Array,
    clear: Array,
    weak: NDArray[np.bool_],
) -> int:
    """Count misses of voxels that a frame's rays have passed through; the dead are removed.

    T_sensor_base: (4, 4).   turn: (2, 2) takes image coordinates to the order of the zones.
    clear: (64,) [m] depth up to which a zone is free, 0 where it says nothing.
    weak: (64,) the zone had no echo. Returns how many voxels died.
    """
    dead = 0
    limit = np.tan(pitch * size / 2.0)
    middle = (size - 1) / 2.0
    left = np.empty((32, 3))
    for row in range(v.top[0]):
        if v.cell[row] < 0 or v.seen[row] >= now:
            continue
        p = v.point[row]
        T = T_sensor_base
        depth = T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3]
        if depth < 0.02:
            continue
        x = (T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2] + T[0, 3]) / depth
        y = (T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2] + T[1, 3]) / depth
        if abs(x) >= limit or abs(y) >= limit:
            continue
        column = int(np.round(np.arctan(turn[0, 0] * x + turn[0, 1] * y) / pitch + middle))
        line = int(np.round(np.arctan(turn[1, 0] * x + turn[1, 1] * y) / pitch + middle))
        zone = min(max(line, 0), size - 1) * size + min(max(column, 0), size - 1)
        if depth >= clear[zone]:
            continue
        if weak[zone]:
            v.weak[row] += 1
        else:
            v.strong[row] += 1
        if v.strong[row] >= STRONG or v.weak[row] >= WEAK:
            if dead < len(left):
                left[dead] = p
            v.cell[row] = FREE
            dead += 1
    for i in range(min(dead, len(left))):
        for row in range(v.top[0]):
            if v.cell[row] >= 0 and v.kind[row] == UNDECIDED:
                near = 0.0
                for a in range(3):
                    near += (v.point[row, a] - left[i, a]) ** 2
                if near < SPREAD * SPREAD:
                    v.kind[row] = MOVING
    if dead:
        rebuild(v)
    return dead


@compiled
def mark_moving(v: Voxels, centre: Array, since: float) -> None:
    """What was seen since then around `centre` (3,) [m] moves."""
    for row in range(v.top[0]):
        if v.cell[row] >= 0 and v.seen[row] >= since:
            near = 0.0
            for a in range(3):
                near += (v.point[row, a] - centre[a]) ** 2
            if near < SPREAD * SPREAD:
                v.kind[row] = MOVING


@compiled
def decay(v: Voxels, now: float, life: Array) -> None:
    """Let voxels die that were not seen for `life` (3,) [s] of their kind."""
    dead = 0
    for row in range(v.top[0]):
        if v.cell[row] >= 0:
            age = now - v.seen[row]
            unconfirmed = not v.confirmed[row] and age > CONFIRM
            if age > life[v.kind[row]] or unconfirmed or v.inside[row] >= 3:
                v.cell[row] = FREE
                dead += 1
    if dead:
        rebuild(v)


@compiled
def rebuild(v: Voxels) -> None:
    """Make the table anew after deaths, and forget the dead rows at the top."""
    v.table[:] = FREE
    top = 0
    for row in range(v.top[0]):
        cell = v.cell[row]
        if cell < 0:
            v.confirmed[row] = False
            v.seen[row] = -np.inf
            continue
        top = row + 1
        h = (cell * 2654435761) & (TABLE - 1)
        while v.table[h] >= 0:
            h = (h + 1) & (TABLE - 1)
        v.table[h] = row
    v.top[0] = top
