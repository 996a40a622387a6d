"""Thousands of learned cubes, made ready to be asked which of them is nearest to a capsule.

They are sorted along a Z curve, so that neighbours in space are neighbours in the list, and
`LEAF` at a time make a box; two boxes make one of the next level, up to the one of all. A
query goes down where a box may still hold something nearer than what has been found.

A cube that touches others is left only through its open faces: the way out of a wall or of a
post is not into the next cube of it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import EDGE, STEPS, Learned, hold, keys_of
from app.compiled import compiled
from app.control.segments import TOUCHING, deepest, to_box
from app.messages import Array

LEAF = 8  # cubes
DEEP = 64  # boxes that wait for their turn: more than twice the levels there can be


class Cubes(NamedTuple):
    """n cubes and the boxes around them; the arrays are writable, as kernels want them.

    box:    (2 m, 2, 3) [m] low and high corners of the boxes: 1 is around all, 2 i and 2 i + 1
            are the halves of i, the last m hold `LEAF` cubes each; an empty one has low > high.
    centre: (n, 3) [m], base frame.   open: (n, 6) is the face +x, -x, +y, ... an outer one?
    """

    box: Array
    centre: Array
    open: NDArray[np.bool_]


def make_cubes(learned: Learned) -> Cubes:
    """Ready for `nearest_cube`; a millisecond for thousands. Compiles nothing."""
    order = np.argsort(_along_curve(learned.cells), kind="stable")
    cells, n = learned.cells[order], len(order)
    m = 1
    while m * LEAF < n:
        m *= 2
    low, high = np.full((2 * m, 3), np.inf), np.full((2 * m, 3), -np.inf)
    first = np.arange(0, n, LEAF)
    if n:
        low[m : m + len(first)] = np.minimum.reduceat(cells, first) * EDGE
        high[m : m + len(first)] = (np.maximum.reduceat(cells, first) + 1) * EDGE
    while m > 1:
        m //= 2
        low[m : 2 * m] = low[2 * m : 4 * m].reshape(m, 2, 3).min(axis=1)
        high[m : 2 * m] = high[2 * m : 4 * m].reshape(m, 2, 3).max(axis=1)
    keys = keys_of(learned.cells)
    inner = [hold(keys, keys + side * step) for step in STEPS for side in (1, -1)]
    centre = np.asarray((cells + 0.5) * EDGE, dtype=np.float64)
    return Cubes(np.stack((low, high), axis=1), centre, ~np.stack(inner, axis=1)[order])


def _along_curve(cells: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) places of cells (n, 3) along a Z curve (Morton, 1966)."""
    if not len(cells):
        return np.empty(0, dtype=np.int64)
    i = cells - cells.min(axis=0)
    out = np.zeros(len(cells), dtype=np.int64)
    for bit in range(int(i.max()).bit_length()):
        for axis in range(3):
            out |= ((i[:, axis] >> bit) & 1) << (3 * bit + axis)
    return out


@compiled
def nearest_cube(
    a: Array, b: Array, within: float, cubes: Cubes, on_axis: Array, on_cube: Array
) -> float:
    """Signed distance [m] of the segment ab (3,) to the nearest cube, +inf if not `within`.

    Writes the places on the segment and on the cube (3,), base frame.
    """
    least = within
    if len(cubes.centre) == 0:
        return np.inf
    low, high, u, p = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    half = np.full(3, 0.5 * EDGE)
    for i in range(3):
        low[i], high[i], u[i] = min(a[i], b[i]), max(a[i], b[i]), b[i] - a[i]
    found, share, out = -1, 0.0, -1
    m = len(cubes.box) // 2
    waiting, count = np.empty(DEEP, dtype=np.int64), 1
    waiting[0] = 1
    while count > 0:
        count -= 1
        box = waiting[count]
        if _apart(low, high, cubes.box[box]) >= max(least, 1e-9):
            continue
        if box < m:
            one, two = 2 * box, 2 * box + 1
            near = _apart(low, high, cubes.box[one])
            if near <= _apart(low, high, cubes.box[two]):
                one, two = two, one
            waiting[count], waiting[count + 1] = one, two  # the nearer one comes next
            count += 2
            continue
        first = (box - m) * LEAF
        for c in range(first, min(first + LEAF, len(cubes.centre))):
            away = 0.0
            for i in range(3):
                x = cubes.centre[c, i]
                gap = max(x - half[i] - high[i], low[i] - x - half[i], 0.0)
                away += gap * gap
                p[i] = a[i] - x
            if away >= max(least, 1e-9) ** 2:
                continue
            s, square = to_box(p, u, half)
            distance, enters = np.sqrt(square), square <= TOUCHING
            face = -1
            if enters:
                s, depth, face = deepest(p, u, half, cubes.open[c])
                distance = -depth
            if distance < least:
                least, found, share, out = distance, c, s, face
    if found < 0:
        return np.inf
    for i in range(3):
        p[i] = a[i] - cubes.centre[found, i]
        on_axis[i] = a[i] + share * u[i]
        on_cube[i] = cubes.centre[found, i] + min(max(p[i] + share * u[i], -half[i]), half[i])
    if out >= 0:
        side = half[out // 2] if out % 2 == 0 else -half[out // 2]
        on_cube[out // 2] = cubes.centre[found, out // 2] + side
    return least


@compiled
def _apart(low: Array, high: Array, box: Array) -> float:
    """Distance of two boxes whose edges lie along the axes, zero where they overlap."""
    square = 0.0
    for i in range(3):
        square += max(box[0, i] - high[i], low[i] - box[1, i], 0.0) ** 2
    return float(np.sqrt(square))
