"""The compiled carving of the memory: what a frame says of the places that it has looked at."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.voxels import MOVING, SPREAD, UNDECIDED, Voxels, remove
from app.robot.traits import noise_of

MARGIN, SIGMAS = 0.08, 3.0  # [m] and multiples of the noise that a ray stops short of its depth
WITHOUT_ECHO = 0.5  # [m] that a zone without a target is taken to be free
NEAREST = 0.02  # [m] from the lens: before it nothing is carved
KEPT, STATIC_CELL, SELF, BEHIND, NO_TARGET = (
    int(x) for x in (Verdict.KEPT, Verdict.STATIC, Verdict.SELF, Verdict.BEHIND, Verdict.NO_TARGET)
)
STRONG, WEAK = 2, 5  # misses until a voxel dies: rays that went on, rays without an echo
LEFT = 32  # voxels of one frame that left and whose neighbourhood is looked at


class Eyes(NamedTuple):
    """What is constant of K sensors, their S zones and L links.

    mount: (K,) link of each sensor.   T_link_sensor: (K, 4, 4).   first: (K + 1,) zones.
    grid:  (K, 2) rows and columns.   pitch: (K, 2) [rad] from row to row and column to column.
    turn:  (K, 2, 2) from the image plane to (column, row) in the order of the zones.
    depth: (S,) depth along the axis per reported distance.   noise: (K, 2), see `Traits`.
    box:   (2, L, 3) [m] low and high corners of the links' boxes, link frame.
    aside: (K,) [rad] from a zone's middle to the farthest that it may look.
    """

    mount: NDArray[np.int64]
    T_link_sensor: Array
    first: NDArray[np.int64]
    grid: NDArray[np.int64]
    pitch: Array
    turn: Array
    depth: Array
    box: Array
    noise: Array
    aside: Array


class Seen(NamedTuple):
    """The parts of an `app.messages.Cloud` that a memory is made of; doubted: (S,) as in
    `app.perception.windows`."""

    points: Array
    verdict: NDArray[np.uint8]
    gap: Array
    eps: Array
    stamp: Array
    doubted: NDArray[np.bool_]


class Sight(NamedTuple):
    """What one frame says of its zones (n,).

    echo:  [m] depth of it, +inf without one, NaN where the zone says nothing.
    past:  [m] depth up to which it has looked past, -inf where it says nothing.
    clear: [m] depth up to which it is free of the world, -inf where it says nothing.
    weak:  the zone had no echo.
    """

    echo: Array
    past: Array
    clear: Array
    weak: NDArray[np.bool_]


@compiled
def what_is_free(
    k: int,
    seen: Seen,
    T_sensor_base: Array,
    eyes: Eyes,
) -> Sight:
    """What the frame of sensor k says.

    Clear is it up to the nearest echo of a zone and its eight neighbours: zones at an edge see
    both sides of it.
    """
    first, rows, columns = eyes.first[k], eyes.grid[k, 0], eyes.grid[k, 1]
    n, T, floor, share = rows * columns, T_sensor_base, eyes.noise[k, 0], eyes.noise[k, 1]
    points, verdict, gap = seen.points, seen.verdict, seen.gap
    sight = Sight(np.empty(n), np.empty(n), np.empty(n), np.empty(n, dtype=np.bool_))
    for zone in range(n):
        slot = first + zone
        x, y, z = points[slot, 0], points[slot, 1], points[slot, 2]
        depth = T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3]
        sight.weak[zone] = verdict[slot] == NO_TARGET
        sight.echo[zone] = _echo(verdict[slot], depth, gap[slot] * eyes.depth[slot])
    for zone in range(n):
        sight.past[zone] = sight.clear[zone] = -np.inf
        if np.isnan(sight.echo[zone]):
            continue
        nearest = WITHOUT_ECHO if sight.weak[zone] else np.inf
        row, column = zone // columns, zone % columns
        for r in range(max(0, row - 1), min(rows, row + 2)):
            for c in range(max(0, column - 1), min(columns, column + 2)):
                if sight.echo[r * columns + c] < nearest:
                    nearest = sight.echo[r * columns + c]
        sight.past[zone] = _before(sight.echo[zone], floor, share)
        sight.clear[zone] = _before(nearest, floor, share)
    return sight


@compiled
def _echo(verdict: int, depth: float, gap: float) -> float:
    """Depth [m] along the axis of what a zone saw at `depth`, but never beyond the robot's body,
    `gap` [m] behind it."""
    if verdict == NO_TARGET:
        return np.inf
    if verdict in (SELF, BEHIND):
        return min(depth, depth + gap)
    return depth if verdict in (KEPT, STATIC_CELL) else np.nan


@compiled
def _before(echo: float, floor: float, share: float) -> float:
    """Depth [m] up to which an echo surely says that nothing is there."""
    if echo == np.inf:
        return echo
    return echo - max(MARGIN, SIGMAS * noise_of(floor, share, echo))


@compiled
def carve(v: Voxels, k: int, now: float, T_sensor_base: Array, eyes: Eyes, sight: Sight) -> int:
    """Note which voxels the frame of sensor k has looked at and count misses of those that its
    rays have passed through; the dead are removed.

    T_sensor_base: (4, 4).   Returns how many voxels died.
    """
    dead = 0
    rows, columns = eyes.grid[k, 0], eyes.grid[k, 1]
    down, across = eyes.pitch[k, 0], eyes.pitch[k, 1]
    most_down, most_across = np.tan(down * rows / 2.0), np.tan(across * columns / 2.0)
    farthest = sight.past.max()
    points, T, turn = v.point, T_sensor_base, eyes.turn[k]
    za, zb, zc, zd = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
    left = np.empty((LEFT, 3))
    for row in range(v.top[0]):
        a, b, c = points[row, 0], points[row, 1], points[row, 2]
        depth = za * a + zb * b + zc * c + zd
        if not (NEAREST <= depth < farthest):  # NaN of a free row neither
            continue
        x = T[0, 0] * a + T[0, 1] * b + T[0, 2] * c + T[0, 3]
        y = T[1, 0] * a + T[1, 1] * b + T[1, 2] * c + T[1, 3]
        right, below = turn[0, 0] * x + turn[0, 1] * y, turn[1, 0] * x + turn[1, 1] * y
        outside = abs(right) >= most_across * depth or abs(below) >= most_down * depth
        if outside or v.seen[row] >= now:
            continue
        column = _nearest(right / depth, across, columns)
        zone = _nearest(below / depth, down, rows) * columns + column
        if depth < sight.past[zone]:
            v.looked[row] = now
        if depth < sight.clear[zone] and _missed(v, row, sight.weak[zone]):
            if dead < LEFT:
                left[dead] = points[row]
            remove(v, row)
            dead += 1
    _suspect(v, left[: min(dead, LEFT)])
    return dead


@compiled
def _nearest(tangent: float, pitch: float, count: int) -> int:
    """The zone of `count` in a row whose angle atan(tangent) is."""
    zone = int(np.round(np.arctan(tangent) / pitch + (count - 1) / 2.0))
    return min(max(zone, 0), count - 1)


@compiled
def _missed(v: Voxels, row: int, weak: bool) -> bool:
    """A ray has passed through a voxel; is that enough?"""
    if weak:
        v.weak[row] += 1
    else:
        v.strong[row] += 1
    return bool(v.strong[row] >= STRONG or v.weak[row] >= WEAK)


@compiled
def _suspect(v: Voxels, left: Array) -> None:
    """What is undecided around voxels that left, at `left` (n, 3), probably moves too."""
    for i in range(len(left)):
        for row in range(v.top[0]):
            if v.cell[row] >= 0 and v.kind[row] == UNDECIDED:
                near = 0.0
                for a in range(3):
                    near += (v.point[row, a] - left[i, a]) ** 2
                if near < SPREAD * SPREAD:
                    v.kind[row] = MOVING
