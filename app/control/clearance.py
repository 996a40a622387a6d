"""How far the arm is from itself and from the known, static cell.

Links are capsules, the cell is its crop boxes. Links that are neighbours, or that some part of
is always close, are no pair: they cannot be kept apart.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.control.capsules import fit_capsules
from app.messages import Array, CropBox
from app.robot.model import Robot
from app.robot.posture import Posture

# [m] distance that is kept between links, and between a link and a crop box: the capsules hold
# the meshes and the boxes have margins, so more of it only forbids postures that arms work in
KEPT = 0.005
CLOSE = 0.03  # [m] links that are as near as this at home, or in most postures, are no pair
SAMPLES = 300  # random postures that tell which links are always close
ALWAYS = 0.3  # share of them from which on a pair of links is left out
TURNS = 40  # of the search along a capsule; each shortens the bracket to two thirds


class Gaps(NamedTuple):
    """g nearest places: links (g,), distance (g,) [m], points (g, 3) and normal (g, 3), base.

    The normal points to link `a` from link `b`; b is -1 for the cell, which stands still.
    """

    a: NDArray[np.intp]
    b: NDArray[np.intp]
    distance: Array
    on_a: Array
    on_b: Array
    normal: Array


class Clearance:
    """The robot's own gaps and those to the cell, at a posture."""

    def __init__(self, robot: Robot, crops: Sequence[CropBox] = ()) -> None:
        c = fit_capsules(robot.bodies)
        self._ends = np.stack((c.a, c.b), axis=1)
        self._radius, self._link = c.radius, c.link
        self._T_box_base = np.array([np.linalg.inv(x.T_base_box) for x in crops]).reshape(-1, 4, 4)
        self._half = np.array([x.size / 2.0 for x in crops]).reshape(-1, 3)
        L, B = len(robot.links), len(crops)
        one, two = np.triu_indices(L, k=1)
        moved = (robot.supports[one] != robot.supports[two]).sum(axis=1)
        apart = moved > 1  # one joint between them: neighbours
        self._self = np.stack((one[apart], two[apart]), axis=1)
        moving = np.flatnonzero(robot.supports.any(axis=1))
        self._cell = np.array([(i, j) for i in moving for j in range(B)], dtype=np.intp)
        self._cell = self._cell.reshape(-1, 2)
        self._drop_always_close(robot)

    @property
    def pairs(self) -> NDArray[np.intp]:
        """(p, 2) pairs of links that are kept apart."""
        return self._self

    def measure(self, posture: Posture, within: float) -> Gaps:
        """Every gap below `within` [m], one for a pair of links and one for a link and box."""
        d, where = self._distances(posture, within)
        p = len(d)
        a, b, near = np.empty(p, dtype=np.int64), np.empty(p, dtype=np.int64), np.empty(p)
        on_a, on_b, normal = np.empty((p, 3)), np.empty((p, 3)), np.empty((p, 3))
        gaps = Gaps(a, b, near, on_a, on_b, normal)
        n = _gather(d, where, self._a, self._b, within, gaps)
        return Gaps(a[:n], b[:n], near[:n], on_a[:n], on_b[:n], normal[:n])

    def _distances(self, posture: Posture, within: float = np.inf) -> tuple[Array, Array]:
        """Distance (p,) and on_a, on_b, normal as (p, 3, 3) of all pairs, the cell's last.

        What is surely not `within` [m] is not measured and stays +inf.
        """
        p = len(self._self) + len(self._cell)
        distance, where = np.empty(p), np.empty((p, 3, 3))
        _measure(
            posture.T_base_link, self._ends, self._radius, self._link, self._self, self._cell,
            self._T_box_base, self._half, within, distance, where,
        )  # fmt: skip
        return distance, where

    def _drop_always_close(self, robot: Robot) -> None:
        """Leave out what is close at home, and links that are close in many postures."""
        rng = np.random.default_rng(0)
        low, high = np.maximum(robot.q_min, -np.pi), np.minimum(robot.q_max, np.pi)
        home, _ = self._distances(robot.posture(robot.home))
        close = np.zeros(len(home))
        for _ in range(SAMPLES):
            close += self._distances(robot.posture(rng.uniform(low, high)))[0] < CLOSE
        P = len(self._self)
        keep = (home >= CLOSE) & ((close < ALWAYS * SAMPLES) | (np.arange(len(home)) >= P))
        self._self, self._cell = self._self[keep[:P]], self._cell[keep[P:]]
        self._a = np.append(self._self[:, 0], self._cell[:, 0])
        self._b = np.append(self._self[:, 1], np.full(len(self._cell), -1, dtype=np.intp))


@compiled
def _measure(
    T_base_link: Array,
    ends: Array,
    radius: Array,
    link: NDArray[np.int64],
    links: NDArray[np.int64],
    cell: NDArray[np.int64],
    T_box_base: Array,
    half: Array,
    within: float,
    distance: Array,
    where: Array,
) -> None:
    C = len(radius)
    base, centre, ball = np.empty((C, 2, 3)), np.empty((C, 3)), np.empty(C)
    for c in range(C):
        T = T_base_link[link[c]]
        for e in range(2):
            for i in range(3):
                v = T[i, 3]
                for k in range(3):
                    v += T[i, k] * ends[c, e, k]
                base[c, e, i] = v
        length = 0.0
        for i in range(3):
            centre[c, i] = 0.5 * (base[c, 0, i] + base[c, 1, i])
            length += (base[c, 1, i] - base[c, 0, i]) ** 2
        ball[c] = 0.5 * np.sqrt(length) + radius[c]
    distance[:] = np.inf
    P = len(links)
    for p in range(P):
        for c in range(C):
            if link[c] != links[p, 0]:
                continue
            for o in range(C):
                if link[o] == links[p, 1] and _apart(centre[c], centre[o]) < (
                    within + ball[c] + ball[o]
                ):
                    x, y = _between(base[c, 0], base[c, 1], base[o, 0], base[o, 1])
                    _keep_nearer(x, y, radius[c], radius[o], distance, where, p)
    for p in range(len(cell)):
        for c in range(C):
            if link[c] == cell[p, 0]:
                box = cell[p, 1]
                if _to_centre(centre[c], T_box_base[box], half[box]) >= within + ball[c]:
                    continue
                x, y, inside = _to_box(base[c, 0], base[c, 1], T_box_base[box], half[box])
                _keep_nearer(x, y, radius[c], 0.0, distance, where, P + p, inside)


@compiled
def _gather(
    distance: Array,
    where: Array,
    a: NDArray[np.int64],
    b: NDArray[np.int64],
    within: float,
    out: Gaps,
) -> int:
    """Write down what is `within`; how many that are."""
    n = 0
    for p in range(len(distance)):
        if distance[p] < within:
            out.a[n], out.b[n], out.distance[n] = a[p], b[p], distance[p]
            for i in range(3):
                out.on_a[n, i], out.on_b[n, i] = where[p, 0, i], where[p, 1, i]
                out.normal[n, i] = where[p, 2, i]
            n += 1
    return n


@compiled
def _apart(a: Array, b: Array) -> float:
    return np.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)


@compiled
def _to_centre(p: Array, T: Array, half: Array) -> float:
    """Distance of p (3,), base frame, to a box; zero inside."""
    square = 0.0
    for i in range(3):
        x = T[i, 0] * p[0] + T[i, 1] * p[1] + T[i, 2] * p[2] + T[i, 3]
        square += max(abs(x) - half[i], 0.0) ** 2
    return np.sqrt(square)


@compiled
def _keep_nearer(
    x: Array,
    y: Array,
    rx: float,
    ry: float,
    distance: Array,
    where: Array,
    row: int,
    inside: bool = False,
) -> None:
    """Note the places x and y with radii rx, ry if they are nearer than what `row` has."""
    n = x - y
    length = np.sqrt((n * n).sum())
    gap = (-length if inside else length) - rx - ry
    if gap < distance[row]:
        # axes that cross: any direction leads out
        up = np.array([0.0, 0.0, 1.0])
        n = up if length < 1e-9 else n / (-length if inside else length)
        distance[row] = gap
        where[row, 0] = x - rx * n
        where[row, 1] = y + ry * n
        where[row, 2] = n


@compiled
def _between(a: Array, b: Array, c: Array, d: Array) -> tuple[Array, Array]:
    """Nearest points of segments ab and cd (Ericson, "Real-Time Collision Detection", 5.1.9)."""
    u, v, w = b - a, d - c, a - c
    uu, vv, uv = (u * u).sum(), (v * v).sum(), (u * v).sum()
    uw, vw = (u * w).sum(), (v * w).sum()
    tiny = 1e-12
    s = 0.0
    denominator = uu * vv - uv * uv
    if uu > tiny and denominator > tiny:
        s = min(max((uv * vw - uw * vv) / denominator, 0.0), 1.0)
    t = (uv * s + vw) / vv if vv > tiny else 0.0
    if t < 0.0 or t > 1.0 or vv <= tiny:
        t = min(max(t, 0.0), 1.0)
        s = min(max((uv * t - uw) / uu, 0.0), 1.0) if uu > tiny else 0.0
    return a + s * u, c + t * v


@compiled
def _to_box(a: Array, b: Array, T: Array, half: Array) -> tuple[Array, Array, bool]:
    """Where the segment ab is nearest to, or deepest in, a box, the box's place, and if inside.

    The signed distance to a box is convex along a line, so a bracket around its least value
    may be shortened from both sides.
    """
    R = np.ascontiguousarray(T[:3, :3])
    p, u = R @ a + T[:3, 3], R @ (b - a)
    low, high = 0.0, 1.0
    for _ in range(TURNS):
        one, two = low + (high - low) / 3.0, high - (high - low) / 3.0
        if _box_distance(p + one * u, half) <= _box_distance(p + two * u, half):
            high = two
        else:
            low = one
    s = 0.5 * (low + high)
    x = p + s * u
    y = np.minimum(np.maximum(x, -half), half)
    inside = _box_distance(x, half) < 0.0
    if inside:
        k = int(np.argmin(half - np.abs(x)))
        y[k] = half[k] if x[k] >= 0.0 else -half[k]
    return a + s * (b - a), np.ascontiguousarray(R.T) @ (y - T[:3, 3]), inside


@compiled
def _box_distance(x: Array, half: Array) -> float:
    """Signed distance of x, box frame."""
    outside, deepest = 0.0, -np.inf
    for i in range(3):
        d = abs(x[i]) - half[i]
        deepest = max(deepest, d)
        if d > 0.0:
            outside += d * d
    return np.sqrt(outside) if outside > 0.0 else deepest
