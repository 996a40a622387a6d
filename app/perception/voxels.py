"""The compiled parts of the memory: a hash grid in flat arrays.

A voxel lives in one row of the arrays for as long as it lives, so that a row is an identity;
the table maps its cell to the row. Rows are used again after a death.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.nearest import box_distance2, to_link
from app.robot.skin import NOISE_FLOOR, NOISE_SHARE

EDGE = 0.03  # [m] of a voxel
RADIUS, HEIGHT = 1.5, 2.0  # [m] around the base axis, up and down: what is farther is let go
WEIGHT = 8  # points that the running mean remembers
CONFIRM = 0.3  # [s] within which a second hit in or beside a voxel confirms it
STATIC_FRAMES = 10  # frames that saw a voxel before it counts as standing still
UNDECIDED, MOVING, STATIC = 0, 1, 2  # kinds
MARGIN, SIGMAS = 0.08, 3.0  # [m] and multiples of the noise that a ray stops short of its depth
WITHOUT_ECHO = 0.5  # [m] that a zone without a target is taken to be free
KEPT, STATIC_CELL, SELF, BEHIND, NO_TARGET = (
    int(x) for x in (Verdict.KEPT, Verdict.STATIC, Verdict.SELF, Verdict.BEHIND, Verdict.NO_TARGET)
)
STRONG, WEAK = 2, 5  # misses until a voxel dies: rays that went on, rays without an echo
SPREAD = 0.25  # [m] around a voxel that left, what is undecided has probably moved too
TABLE = 65536
FREE = -1


class Voxels(NamedTuple):
    """Rows (N,): point [m] base frame; cell, -1 for a free row; born, seen [s]; hits, frames
    and misses counted; kind; confirmed; near the arm.
    table: (TABLE,) rows. top: (1,) rows ever used.
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
    farthest = clear.max()
    points, T = v.point, T_sensor_base
    za, zb, zc, zd = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
    left = np.empty((32, 3))
    for row in range(v.top[0]):
        a, b, c = points[row, 0], points[row, 1], points[row, 2]
        depth = za * a + zb * b + zc * c + zd
        if not (0.02 <= depth < farthest):  # NaN of a free row neither
            continue
        x = T[0, 0] * a + T[0, 1] * b + T[0, 2] * c + T[0, 3]
        y = T[1, 0] * a + T[1, 1] * b + T[1, 2] * c + T[1, 3]
        if abs(x) >= limit * depth or abs(y) >= limit * depth:
            continue
        x, y = x / depth, y / depth
        column = int(np.round(np.arctan(turn[0, 0] * x + turn[0, 1] * y) / pitch + middle))
        line = int(np.round(np.arctan(turn[1, 0] * x + turn[1, 1] * y) / pitch + middle))
        zone = min(max(line, 0), size - 1) * size + min(max(column, 0), size - 1)
        if depth >= clear[zone] or v.seen[row] >= now:
            continue
        if weak[zone]:
            v.weak[row] += 1
        else:
            v.strong[row] += 1
        if v.strong[row] >= STRONG or v.weak[row] >= WEAK:
            if dead < len(left):
                left[dead] = points[row]
            remove(v, row)
            dead += 1
    for i in range(min(dead, len(left))):
        for row in range(v.top[0]):
            if v.cell[row] >= 0 and v.kind[row] == UNDECIDED:
                near = 0.0
                for a in range(3):
                    near += (v.point[row, a] - left[i, a]) ** 2
                if near < SPREAD * SPREAD:
                    v.kind[row] = MOVING
    return dead


@compiled
def clear_depths(
    points: Array,
    verdict: NDArray[np.uint8],
    gap: Array,
    T_sensor_base: Array,
    size: int,
    clear: Array,
    weak: NDArray[np.bool_],
) -> None:
    """Write up to which depth every zone is free of the world, 0 where it says nothing.

    The nearest echo of a zone and its eight neighbours counts: zones at an edge see both
    sides of it. Arrays are (64,) and (64, 3) of one sensor.
    """
    n = size * size
    echo = np.full(n, np.inf)
    for zone in range(n):
        kind = verdict[zone]
        if kind in (KEPT, STATIC_CELL, SELF, BEHIND):
            p = points[zone]
            T = T_sensor_base
            echo[zone] = T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3]
            if kind in (SELF, BEHIND):
                echo[zone] = min(echo[zone], echo[zone] + gap[zone])  # never beyond the body
    for zone in range(len(clear)):
        clear[zone], weak[zone] = 0.0, False
        if zone >= n or not (echo[zone] < np.inf or verdict[zone] == NO_TARGET):
            continue
        weak[zone] = verdict[zone] == NO_TARGET
        nearest = WITHOUT_ECHO if weak[zone] else np.inf
        row, column = zone // size, zone % size
        for r in range(max(0, row - 1), min(size, row + 2)):
            for c in range(max(0, column - 1), min(size, column + 2)):
                nearest = min(nearest, echo[r * size + c])
        noise = max(NOISE_FLOOR, NOISE_SHARE * nearest)
        clear[zone] = nearest - max(MARGIN, SIGMAS * noise)


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
def review(
    v: Voxels,
    first: int,
    last: int,
    now: float,
    life: Array,
    T_base_link: Array,
    low: Array,
    high: Array,
    reach: float,
) -> None:
    """Look through rows first..last: bury the old, and mark what is in reach of a link's box.

    life: (3,) [s] by kind.   low, high: (L, 3) boxes of the links, link frame.
    """
    p = np.empty(3)
    for row in range(first, min(last, v.top[0])):
        if v.cell[row] < 0:
            continue
        age = now - v.seen[row]
        unconfirmed = not v.confirmed[row] and age > CONFIRM
        if age > life[v.kind[row]] or unconfirmed or v.inside[row] >= 3:
            remove(v, row)
            continue
        near = False
        for link in range(len(T_base_link)):
            to_link(T_base_link[link], v.point[row], p)
            near |= box_distance2(p, low, high, link) < reach * reach
        v.near[row] = near
    while v.top[0] > 0 and v.cell[v.top[0] - 1] < 0:
        v.top[0] -= 1


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
