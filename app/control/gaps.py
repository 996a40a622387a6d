"""The compiled part of the clearance: capsules against capsules, boxes, half-spaces and cubes.

Everything is culled with balls around the capsules first; what is left is exact.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import EDGE
from app.compiled import compiled
from app.control.cubes import Cubes, nearest_cube
from app.control.segments import TOUCHING, between, deepest, to_box
from app.messages import Array

# [m] distance that is kept between links, and between a link and the cell: the capsules hold
# the meshes and the cell has margins, so more of it only forbids postures that arms work in
KEPT = 0.005
# [m] more, to learned cubes: the static filter hides what is in a neighbour of one as well, and
# whatever is hidden has to bound
BESIDE = EDGE


class Gaps(NamedTuple):
    """g nearest places: links (g,), distance (g,) [m], points (g, 3) and normal (g, 3), base.

    The normal points to link `a` from link `b`; b is -1 for the cell, which stands still.
    pair: (g,) which of the clearance's pairs it is.   part: (g,) of `Cell.names`, -1 for a link.
    """

    pair: NDArray[np.int64]
    a: NDArray[np.int64]
    b: NDArray[np.int64]
    part: NDArray[np.int64]
    distance: Array
    on_a: Array
    on_b: Array
    normal: Array


class Body(NamedTuple):
    """C capsules: ends (C, 2, 3) link frame, radius (C,), those of link i from first[i] on.

    Q pieces of them: of (Q,) which capsule, share (Q, 2) from where to where of its axis.
    """

    ends: Array
    radius: Array
    link: NDArray[np.int64]
    first: NDArray[np.int64]
    of: NDArray[np.int64]
    share: Array


class Cases(NamedTuple):
    """What is measured: two links, (piece, box), (piece, plane), (piece, all that was learned)."""

    links: NDArray[np.int64]  # (p, 2)
    boxes: NDArray[np.int64]  # (b, 2)
    planes: NDArray[np.int64]  # (h, 2)
    learned: NDArray[np.int64]  # (l,)


class Parts(NamedTuple):
    """The cell: boxes (B, 4, 4) and (B, 3), planes (H, 4) normal and height along it."""

    T_box_base: Array
    half: Array
    plane: Array


@compiled
def measure(
    T_base_link: Array,
    body: Body,
    pairs: Cases,
    parts: Parts,
    cubes: Cubes,
    within: float,
    out: Gaps,
) -> int:
    """Write down what is `within`; how many that are."""
    base, centre, ball = _place(T_base_link, body)
    n = _to_links(base, centre, ball, body, pairs.links, within, out)
    ends, centre, ball = _cut(base, body)
    n = _to_boxes(ends, centre, ball, body, pairs, parts, within, n, out)
    n = _to_planes(ends, body, pairs, parts, within, n, out)
    return _to_cubes(ends, body, pairs, parts, cubes, within, n, out)


@compiled
def _place(T_base_link: Array, body: Body) -> tuple[Array, Array, Array]:
    """Ends (C, 2, 3) of the capsules, base frame, and the balls around them: (C, 3), (C,)."""
    C = len(body.radius)
    base, centre, ball = np.empty((C, 2, 3)), np.empty((C, 3)), np.empty(C)
    for c in range(C):
        T = T_base_link[body.link[c]]
        for e in range(2):
            for i in range(3):
                v = T[i, 3]
                for k in range(3):
                    v += T[i, k] * body.ends[c, e, k]
                base[c, e, i] = v
        _surround(base[c], body.radius[c], c, centre, ball)
    return base, centre, ball


@compiled
def _cut(base: Array, body: Body) -> tuple[Array, Array, Array]:
    """Ends (Q, 2, 3) of the pieces, base frame, and the balls around them: (Q, 3), (Q,)."""
    Q = len(body.of)
    ends, centre, ball = np.empty((Q, 2, 3)), np.empty((Q, 3)), np.empty(Q)
    for q in range(Q):
        c = body.of[q]
        for e in range(2):
            t = body.share[q, e]
            for i in range(3):
                ends[q, e, i] = (1.0 - t) * base[c, 0, i] + t * base[c, 1, i]
        _surround(ends[q], body.radius[c], q, centre, ball)
    return ends, centre, ball


@compiled
def _surround(ends: Array, radius: float, row: int, centre: Array, ball: Array) -> None:
    square = 0.0
    for i in range(3):
        centre[row, i] = 0.5 * (ends[0, i] + ends[1, i])
        square += (ends[1, i] - ends[0, i]) ** 2
    ball[row] = 0.5 * np.sqrt(square) + radius


@compiled
def _to_links(
    base: Array,
    centre: Array,
    ball: Array,
    body: Body,
    links: NDArray[np.int64],
    within: float,
    out: Gaps,
) -> int:
    """The nearest two capsules of each pair of links."""
    n = 0
    x, y = np.empty(3), np.empty(3)
    for p in range(len(links)):
        a, b, least = links[p, 0], links[p, 1], within
        for c in range(body.first[a], body.first[a + 1]):
            for o in range(body.first[b], body.first[b + 1]):
                square = 0.0
                for i in range(3):
                    square += (centre[c, i] - centre[o, i]) ** 2
                if square >= (within + ball[c] + ball[o]) ** 2:
                    continue
                s, t = between(base[c, 0], base[c, 1], base[o, 0], base[o, 1])
                square = 0.0
                for i in range(3):
                    x[i] = (1.0 - s) * base[c, 0, i] + s * base[c, 1, i]
                    y[i] = (1.0 - t) * base[o, 0, i] + t * base[o, 1, i]
                    square += (x[i] - y[i]) ** 2
                distance = np.sqrt(square) - body.radius[c] - body.radius[o]
                if distance < least:
                    least = distance
                    _write(x, y, body.radius[c], body.radius[o], 1.0, out, n)
                    out.pair[n], out.a[n], out.b[n], out.part[n] = p, a, b, -1
                    out.distance[n] = distance
        if least < within:
            n += 1
    return n


@compiled
def _to_boxes(
    ends: Array,
    centre: Array,
    ball: Array,
    body: Body,
    pairs: Cases,
    parts: Parts,
    within: float,
    n: int,
    out: Gaps,
) -> int:
    """Append the gaps between pieces and boxes; how many there are then."""
    p, u, x, y = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    every = np.ones(6, dtype=np.bool_)
    for k in range(len(pairs.boxes)):
        q, box = pairs.boxes[k, 0], pairs.boxes[k, 1]
        T, half = parts.T_box_base[box], parts.half[box]
        square = 0.0
        for i in range(3):
            v = T[i, 3]
            for j in range(3):
                v += T[i, j] * centre[q, j]
            square += max(abs(v) - half[i], 0.0) ** 2
        if square >= (within + ball[q]) ** 2:
            continue
        for i in range(3):
            p[i], u[i] = T[i, 3], 0.0
            for j in range(3):
                p[i] += T[i, j] * ends[q, 0, j]
                u[i] += T[i, j] * (ends[q, 1, j] - ends[q, 0, j])
        s, square = to_box(p, u, half)
        radius, face = body.radius[body.of[q]], -1
        distance = np.sqrt(square) - radius
        if square <= TOUCHING:
            s, depth, face = deepest(p, u, half, every)
            distance = -depth - radius
        if distance >= within:
            continue
        for i in range(3):
            x[i] = p[i] + s * u[i] - T[i, 3]
            y[i] = min(max(p[i] + s * u[i], -half[i]), half[i]) - T[i, 3]
        if face >= 0:
            y[face // 2] = (half[face // 2] if face % 2 == 0 else -half[face // 2]) - T[
                face // 2, 3
            ]
        _turn_back(T, x)
        _turn_back(T, y)
        _write(x, y, radius, 0.0, -1.0 if face >= 0 else 1.0, out, n)
        out.pair[n], out.part[n] = len(pairs.links) + k, box
        out.a[n], out.b[n], out.distance[n] = body.link[body.of[q]], -1, distance
        n += 1
    return n


@compiled
def _turn_back(T: Array, x: Array) -> None:
    """Turn x (3,) by the inverse of the rotation of T (4, 4)."""
    a, b, c = x[0], x[1], x[2]
    for i in range(3):
        x[i] = T[0, i] * a + T[1, i] * b + T[2, i] * c


@compiled
def _to_planes(
    ends: Array, body: Body, pairs: Cases, parts: Parts, within: float, n: int, out: Gaps
) -> int:
    """Append the gaps between pieces and half-spaces: one end of a piece is the lowest."""
    for k in range(len(pairs.planes)):
        q, plane = pairs.planes[k, 0], parts.plane[pairs.planes[k, 1]]
        radius, lowest, height = body.radius[body.of[q]], 0, np.inf
        for e in range(2):
            h = -plane[3]
            for i in range(3):
                h += plane[i] * ends[q, e, i]
            if h < height:
                lowest, height = e, h
        if height - radius >= within:
            continue
        for i in range(3):
            out.normal[n, i] = plane[i]
            out.on_a[n, i] = ends[q, lowest, i] - radius * plane[i]
            out.on_b[n, i] = ends[q, lowest, i] - height * plane[i]
        out.pair[n] = len(pairs.links) + len(pairs.boxes) + k
        out.part[n] = len(parts.half) + pairs.planes[k, 1]
        out.a[n], out.b[n], out.distance[n] = body.link[body.of[q]], -1, height - radius
        n += 1
    return n


@compiled
def _to_cubes(
    ends: Array,
    body: Body,
    pairs: Cases,
    parts: Parts,
    cubes: Cubes,
    within: float,
    n: int,
    out: Gaps,
) -> int:
    """Append the gap between each piece and the learned cube that is nearest to it."""
    x, y = np.empty(3), np.empty(3)
    for k in range(len(pairs.learned) if len(cubes.centre) else 0):
        q = pairs.learned[k]
        radius = body.radius[body.of[q]]
        more = radius + BESIDE
        distance = nearest_cube(ends[q, 0], ends[q, 1], within + more, cubes, x, y)
        if distance - more >= within:
            continue
        _write(x, y, radius, 0.0, -1.0 if distance < 0.0 else 1.0, out, n)
        out.pair[n] = len(pairs.links) + len(pairs.boxes) + len(pairs.planes) + k
        out.part[n] = len(parts.half) + len(parts.plane)
        out.a[n], out.b[n], out.distance[n] = body.link[body.of[q]], -1, distance - more
        n += 1
    return n


@compiled
def stuck(T: Array, body: Body, cubes: Cubes, out: NDArray[np.bool_]) -> None:
    """Set out (Q,) where a piece is too close to a cube in all postures T (m, L, 4, 4)."""
    out[:] = len(cubes.centre) > 0
    x, y = np.empty(3), np.empty(3)
    for m in range(len(T)):
        if not out.any():
            return
        ends, _, _ = _cut(_place(T[m], body)[0], body)
        for q in range(len(out)):
            if out[q]:
                most = KEPT + BESIDE + body.radius[body.of[q]]
                out[q] = nearest_cube(ends[q, 0], ends[q, 1], most, cubes, x, y) < most


@compiled
def _write(x: Array, y: Array, rx: float, ry: float, sign: float, out: Gaps, row: int) -> None:
    """Note the places x and y (3,) on two axes or on an axis and the cell, with radii rx, ry.

    sign: -1 where x lies in the cell, so that the way out is from x to y.
    """
    square = 0.0
    for i in range(3):
        square += (x[i] - y[i]) ** 2
    length = np.sqrt(square)
    for i in range(3):
        n = 1.0 if i == 2 else 0.0  # axes that cross: any direction leads out
        if length >= 1e-9:
            n = sign * (x[i] - y[i]) / length
        out.normal[row, i] = n
        out.on_a[row, i], out.on_b[row, i] = x[i] - rx * n, y[i] + ry * n
