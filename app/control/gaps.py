"""The compiled part of the clearance: capsules against capsules, boxes, half-spaces and cubes.

Everything is culled with balls around the capsules first; what is left is exact. The arrays are
few: handing one to a kernel costs a quarter of a microsecond.
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


class Body(NamedTuple):
    """Q capsules: ends (Q, 2, 3) link frame, radius (Q,), link (Q,); link i's begin at first[i]."""

    ends: Array
    radius: Array
    link: NDArray[np.int64]
    first: NDArray[np.int64]


class Cases(NamedTuple):
    """What is measured: links (p, 2) two links, cell (c, 2) a capsule and a part of the cell."""

    links: NDArray[np.int64]
    cell: NDArray[np.int64]


class Parts(NamedTuple):
    """The parts of the cell in their order: boxes (B, 4, 4) and (B, 3), planes, learned cubes.

    plane: (H, 4) normal and height along it.
    """

    T_box_base: Array
    half: Array
    plane: Array
    cubes: Cubes


@compiled
def measure(
    T_base_link: Array, body: Body, cases: Cases, parts: Parts, within: float, links_within: float,
    out: Gaps,
) -> int:  # fmt: skip
    """Write down the gaps to the cell that are `within`, and those of links; how many all are."""
    ends, centre, ball = place(T_base_link, body)
    n = 0
    for k in range(len(cases.links)):
        if _between_links(ends, centre, ball, body, cases.links[k], links_within, n, out):
            out.who[n, 0], out.who[n, 1], out.who[n, 2] = k, cases.links[k, 0], cases.links[k, 1]
            out.who[n, 3] = -1
            n += 1
    boxes, planes = len(parts.half), len(parts.plane)
    p, u, x, y = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for k in range(len(cases.cell)):
        q, part = cases.cell[k, 0], cases.cell[k, 1]
        if part < boxes:
            T, half = parts.T_box_base[part], parts.half[part]
            if _from_centre(centre, q, T, half) >= within + ball[q]:
                continue
            distance = _to_box(ends[q], body.radius[q], T, half, p, u, x, y, out.where[n])
        elif part < boxes + planes:
            plane = parts.plane[part - boxes]
            distance = _to_plane(ends[q], body.radius[q], plane, out.where[n])
        else:
            distance = _to_cube(ends[q], body.radius[q], parts.cubes, within, x, y, out.where[n])
        if distance < within:
            out.who[n, 0], out.who[n, 1], out.who[n, 2] = len(cases.links) + k, body.link[q], -1
            out.who[n, 3], out.distance[n] = part, distance
            n += 1
    return n


@compiled
def place(T_base_link: Array, body: Body) -> tuple[Array, Array, Array]:
    """Ends (Q, 2, 3) of the capsules, base frame, and the balls around them: (Q, 3), (Q,)."""
    Q = len(body.radius)
    ends, centre, ball = np.empty((Q, 2, 3)), np.empty((Q, 3)), np.empty(Q)
    for q in range(Q):
        T = T_base_link[body.link[q]]
        for e in range(2):
            for i in range(3):
                v = T[i, 3]
                for k in range(3):
                    v += T[i, k] * body.ends[q, e, k]
                ends[q, e, i] = v
        square = 0.0
        for i in range(3):
            centre[q, i] = 0.5 * (ends[q, 0, i] + ends[q, 1, i])
            square += (ends[q, 1, i] - ends[q, 0, i]) ** 2
        ball[q] = 0.5 * np.sqrt(square) + body.radius[q]
    return ends, centre, ball


@compiled
def _between_links(
    ends: Array,
    centre: Array,
    ball: Array,
    body: Body,
    links: NDArray[np.int64],
    within: float,
    n: int,
    out: Gaps,
) -> bool:
    """Is some capsule of one link `within` one of the other? Writes the places of the nearest."""
    least = within
    for c in range(body.first[links[0]], body.first[links[0] + 1]):
        for o in range(body.first[links[1]], body.first[links[1] + 1]):
            square = 0.0
            for i in range(3):
                square += (centre[c, i] - centre[o, i]) ** 2
            if square >= (least + ball[c] + ball[o]) ** 2:
                continue
            a, b, rx, ry = ends[c], ends[o], body.radius[c], body.radius[o]
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
                    out.where[n, 0, i] = a[0, i] + s * (a[1, i] - a[0, i])
                    out.where[n, 1, i] = b[0, i] + t * (b[1, i] - b[0, i])
                _lead_out(rx, ry, 1.0, out.where[n])
                out.distance[n] = distance
    return least < within


@compiled
def _from_centre(centre: Array, q: int, T: Array, half: Array) -> float:
    """Distance [m] of the q-th of the places centre (Q, 3) to a box, 0 inside."""
    square = 0.0
    for i in range(3):
        v = T[i, 0] * centre[q, 0] + T[i, 1] * centre[q, 1] + T[i, 2] * centre[q, 2] + T[i, 3]
        square += max(abs(v) - half[i], 0.0) ** 2
    return np.sqrt(square)


@compiled
def _to_box(
    ends: Array,
    radius: float,
    T: Array,
    half: Array,
    p: Array,
    u: Array,
    x: Array,
    y: Array,
    where: Array,
) -> float:
    """Distance [m] of a capsule to a box, T (4, 4) its frame; p, u, x, y: scratch (3,)."""
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
    _lead_out(radius, 0.0, -1.0 if face >= 0 else 1.0, where)
    return distance - radius


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
def _to_cube(
    ends: Array, radius: float, cubes: Cubes, within: float, x: Array, y: Array, where: Array
) -> float:
    """Distance [m] of a capsule to the nearest learned cube, less `BESIDE`."""
    more = radius + BESIDE
    distance = nearest_cube(ends[0], ends[1], within + more, cubes, x, y)
    if distance == np.inf:
        return np.inf
    for i in range(3):
        where[0, i], where[1, i] = x[i], y[i]
    _lead_out(radius, 0.0, -1.0 if distance < 0.0 else 1.0, where)
    return distance - more


@compiled
def _lead_out(rx: float, ry: float, sign: float, where: Array) -> None:
    """Move the places on two axes, or on an axis and the cell, out by radii rx, ry; the normal.

    sign: -1 where the first lies in the cell, so that the way out is from it to the second.
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


@compiled
def always_in(T: Array, body: Body, cubes: Cubes, out: NDArray[np.bool_]) -> None:
    """Set out (Q,) where a capsule is too close to a cube in all postures T (m, L, 4, 4)."""
    out[:] = len(cubes.centre) > 0
    x, y = np.empty(3), np.empty(3)
    for m in range(len(T)):
        if not out.any():
            return
        ends, _, _ = place(T[m], body)
        for q in range(len(out)):
            if out[q]:
                most = KEPT + BESIDE + body.radius[q]
                out[q] = nearest_cube(ends[q, 0], ends[q, 1], most, cubes, x, y) < most
