"""The compiled carving of the memory: what a frame says of the places that it has looked at."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import SLOTS, Array, Verdict
from app.perception.voxels import MOVING, SPREAD, UNDECIDED, Voxels, remove
from app.robot.skin import NOISE_FLOOR, NOISE_SHARE

MARGIN, SIGMAS = 0.08, 3.0  # [m] and multiples of the noise that a ray stops short of its depth
WITHOUT_ECHO = 0.5  # [m] that a zone without a target is taken to be free
KEPT, STATIC_CELL, SELF, BEHIND, NO_TARGET = (
    int(x) for x in (Verdict.KEPT, Verdict.STATIC, Verdict.SELF, Verdict.BEHIND, Verdict.NO_TARGET)
)
STRONG, WEAK = 2, 5  # misses until a voxel dies: rays that went on, rays without an echo
LEFT = 32  # voxels of one frame that left and whose neighbourhood is looked at


class Sight(NamedTuple):
    """What one frame says of its zones (64,).

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
def no_sight() -> Sight:
    """Room for what a frame says."""
    return Sight(
        np.empty(SLOTS), np.empty(SLOTS), np.empty(SLOTS), np.empty(SLOTS, dtype=np.bool_)
    )  # fmt: skip


@compiled
def look_along(
    points: Array,
    verdict: NDArray[np.uint8],
    gap: Array,
    T_sensor_base: Array,
    size: int,
    sight: Sight,
) -> None:
    """Write what a frame says; arrays are (64,) and (64, 3) of one sensor.

    Clear is it up to the nearest echo of a zone and its eight neighbours: zones at an edge see
    both sides of it.
    """
    T = T_sensor_base
    for zone in range(size * size):
        kind, p = verdict[zone], points[zone]
        sight.echo[zone], sight.weak[zone] = np.nan, kind == NO_TARGET
        if kind == NO_TARGET:
            sight.echo[zone] = np.inf
        elif kind in (KEPT, STATIC_CELL, SELF, BEHIND):
            echo = T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3]
            if kind in (SELF, BEHIND):
                echo = min(echo, echo + gap[zone])  # never beyond the body
            sight.echo[zone] = echo
    for zone in range(size * size):
        sight.past[zone] = sight.clear[zone] = -np.inf
        if np.isnan(sight.echo[zone]):
            continue
        nearest = WITHOUT_ECHO if sight.weak[zone] else np.inf
        row, column = zone // size, zone % size
        for r in range(max(0, row - 1), min(size, row + 2)):
            for c in range(max(0, column - 1), min(size, column + 2)):
                if sight.echo[r * size + c] < nearest:
                    nearest = sight.echo[r * size + c]
        sight.past[zone], sight.clear[zone] = _before(sight.echo[zone]), _before(nearest)


@compiled
def _before(echo: float) -> float:
    """Depth [m] up to which an echo surely says that nothing is there."""
    if echo == np.inf:
        return echo
    return echo - max(MARGIN, SIGMAS * max(NOISE_FLOOR, NOISE_SHARE * echo))


@compiled
def carve(
    v: Voxels, now: float, T_sensor_base: Array, size: int, pitch: float, turn: Array, sight: Sight
) -> int:
    """Note which voxels a frame has looked at and count misses of those that its rays have passed
    through; the dead are removed.

    T_sensor_base: (4, 4).   turn: (2, 2) takes image coordinates to the order of the zones.
    Returns how many voxels died.
    """
    dead = 0
    limit = np.tan(pitch * size / 2.0)
    middle = (size - 1) / 2.0
    farthest = sight.past[: size * size].max()
    points, T = v.point, T_sensor_base
    za, zb, zc, zd = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
    left = np.empty((LEFT, 3))
    for row in range(v.top[0]):
        a, b, c = points[row, 0], points[row, 1], points[row, 2]
        depth = za * a + zb * b + zc * c + zd
        if not (0.02 <= depth < farthest):  # NaN of a free row neither
            continue
        x = T[0, 0] * a + T[0, 1] * b + T[0, 2] * c + T[0, 3]
        y = T[1, 0] * a + T[1, 1] * b + T[1, 2] * c + T[1, 3]
        if abs(x) >= limit * depth or abs(y) >= limit * depth or v.seen[row] >= now:
            continue
        x, y = x / depth, y / depth
        column = int(np.round(np.arctan(turn[0, 0] * x + turn[0, 1] * y) / pitch + middle))
        line = int(np.round(np.arctan(turn[1, 0] * x + turn[1, 1] * y) / pitch + middle))
        zone = min(max(line, 0), size - 1) * size + min(max(column, 0), size - 1)
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
