"""The compiled clearance from the known cell: capsules against boxes, half-spaces and cubes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import EDGE
from app.compiled import compiled
from app.control.cubes import Cubes, nearest_cube
from app.control.gaps import KEPT, Gaps, Pieces, Placed, first_of, lead_out, place, room_for
from app.control.segments import TOUCHING, deepest, to_box
from app.messages import Array

# [m] more, to learned cubes: the static filter hides what is in a neighbour of one as well, and
# whatever is hidden has to bound
BESIDE = EDGE


class Parts(NamedTuple):
    """The parts of the cell in their order: boxes (B, 4, 4) and (B, 3), planes, learned cubes.

    plane: (H, 4) normal and height along it.
    """

    T_box_base: Array
    half: Array
    plane: Array
    cubes: Cubes


@compiled
def cell_within(
    T_base_link: Array, pieces: Pieces, cases: NDArray[np.int64], parts: Parts, within: float
) -> Gaps:
    """The gaps below `within` [m] of the `cases` (c, 2), each a capsule and a part of the cell."""
    placed, out, n = place(T_base_link, pieces), room_for(len(cases)), 0
    boxes = len(parts.half)
    for k in range(len(cases)):
        q, part = cases[k, 0], cases[k, 1]
        if part < boxes and within + placed.ball[q] <= _from_centre(
            placed.centre, q, parts.T_box_base[part], parts.half[part]
        ):
            continue
        distance = _to_part(placed, q, parts, part, within, out.where[n])
        if distance < within:
            out.who[n, 0], out.who[n, 1], out.who[n, 2] = k, pieces.link[q], -1
            out.who[n, 3], out.distance[n] = part, distance
            n += 1
    return first_of(out, n)


@compiled
def _to_part(placed: Placed, q: int, parts: Parts, part: int, within: float, where: Array) -> float:
    """Distance [m] of capsule q to a part of the cell; +inf of cubes that are not `within`."""
    boxes, planes = len(parts.half), len(parts.plane)
    ends, radius = placed.ends[q], placed.radius[q]
    if part < boxes:
        return _to_box(ends, radius, parts.T_box_base[part], parts.half[part], where)
    if part < boxes + planes:
        return _to_plane(ends, radius, parts.plane[part - boxes], where)
    return _to_cube(ends, radius, parts.cubes, within, where)


@compiled
def _from_centre(centre: Array, q: int, T: Array, half: Array) -> float:
    """Distance [m] of the q-th of places (Q, 3) to a box, T (4, 4) its frame; 0 inside."""
    square = 0.0
    for i in range(3):
        v = T[i, 0] * centre[q, 0] + T[i, 1] * centre[q, 1] + T[i, 2] * centre[q, 2] + T[i, 3]
        square += max(abs(v) - half[i], 0.0) ** 2
    return float(np.sqrt(square))


@compiled
def _to_box(ends: Array, radius: float, T: Array, half: Array, where: Array) -> float:
    """Distance [m] of a capsule to a box, T (4, 4) its frame."""
    p, u, x, y = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for i in range(3):
        p[i], u[i] = T[i, 3], 0.0
        for j in range(3):
            p[i] += T[i, j] * ends[0, j]
            u[i] += T[i, j] * (ends[1, j] - ends[0, j])
    s, square = to_box(p, u, half)
    distance, face = np.sqrt(square), -1
    if square <= TOUCHING:
        s, depth, face = deepest(p, u, half, np.ones(6, dtype=np.bool_))
        distance = -depth
    for i in range(3):
        x[i] = p[i] + s * u[i]
        y[i] = min(max(x[i], -half[i]), half[i])
    if face >= 0:
        y[face // 2] = half[face // 2] if face % 2 == 0 else -half[face // 2]
    for i in range(3):
        where[0, i], where[1, i] = 0.0, 0.0
        for j in range(3):
            where[0, i] += T[j, i] * (x[j] - T[j, 3])
            where[1, i] += T[j, i] * (y[j] - T[j, 3])
    lead_out(radius, 0.0, -1.0 if face >= 0 else 1.0, where)
    return float(distance - radius)


@compiled
def _to_plane(ends: Array, radius: float, plane: Array, where: Array) -> float:
    """Distance [m] of a capsule to a half-space: one of its ends is the lowest."""
    lowest, height = 0, np.inf
    for e in range(2):
        h = plane[0] * ends[e, 0] + plane[1] * ends[e, 1] + plane[2] * ends[e, 2] - plane[3]
        if h < height:
            lowest, height = e, h
    for i in range(3):
        where[0, i] = ends[lowest, i] - radius * plane[i]
        where[1, i] = ends[lowest, i] - height * plane[i]
        where[2, i] = plane[i]
    return height - radius


@compiled
def _to_cube(ends: Array, radius: float, cubes: Cubes, within: float, where: Array) -> float:
    """Distance [m] of a capsule to the nearest learned cube, less `BESIDE`."""
    more, x, y = radius + BESIDE, np.empty(3), np.empty(3)
    distance = nearest_cube(ends[0], ends[1], within + more, cubes, x, y)
    if distance == np.inf:
        return np.inf
    for i in range(3):
        where[0, i], where[1, i] = x[i], y[i]
    lead_out(radius, 0.0, -1.0 if distance < 0.0 else 1.0, where)
    return distance - more


@compiled
def times_near_cell(
    T: Array, pieces: Pieces, cases: NDArray[np.int64], parts: Parts, within: float
) -> Array:
    """(c,) in how many of the postures T (m, L, 4, 4) a case is nearer than `within` [m]."""
    times = np.zeros(len(cases))
    for m in range(len(T)):
        for k in cell_within(T[m], pieces, cases, parts, within).who[:, 0]:
            times[k] += 1
    return times


@compiled
def always_in(T: Array, pieces: Pieces, cubes: Cubes, out: NDArray[np.bool_]) -> None:
    """Set out (Q,) where a capsule is too close to a cube in all postures T (m, L, 4, 4)."""
    out[:] = len(cubes.centre) > 0
    x, y = np.empty(3), np.empty(3)
    for m in range(len(T)):
        if not out.any():
            return
        ends = place(T[m], pieces).ends
        for q in range(len(out)):
            if out[q]:
                most = KEPT + BESIDE + pieces.radius[q]
                out[q] = nearest_cube(ends[q, 0], ends[q, 1], most, cubes, x, y) < most
