"""The compiled descent into one link's tree: the nearest face to a point, exactly.

float64 throughout but for the boxes, which are float32 and a little too large, so that they
never hide a face.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.perception.tree import LEAF, WIDE, Forest

ROOM = 256  # nodes ahead of a search: eight a level, and 8^32 faces do not exist
TINY = 1e-12  # [m^2]
SHRINK = 1.0 - 2e-6  # of squared distances to boxes: float32 rounds these and the boxes' axes


@compiled
def to_link(T: Array, point: Array, p: Array) -> None:
    """Write a point of the base frame in the frame of a posed link into p."""
    x, y, z = point[0] - T[0, 3], point[1] - T[1, 3], point[2] - T[2, 3]
    for a in range(3):
        p[a] = T[0, a] * x + T[1, a] * y + T[2, a] * z


@compiled
def box_distance2(p: Array, low: Array, high: Array, link: int) -> float:
    """Squared distance from p to a link's axis-aligned box; 0 inside, NaN for NaN."""
    total = 0.0
    for a in range(3):
        v = p[a]
        if v < low[link, a]:
            total += (low[link, a] - v) ** 2
        elif v > high[link, a]:
            total += (v - high[link, a]) ** 2
        elif v != v:
            return np.nan
    return total


class Batch(NamedTuple):
    """B points that are asked for together, and what is found.

    p: (B, 3) link frame.   square: (B,) the limit before, the squared distance after.
    foot: (B, 3) nearest point of the link.   face, part: (B,) it lies on, face -1 for none.
    """

    p: Array
    square: Array
    foot: Array
    face: NDArray[np.int64]
    part: NDArray[np.int64]


@compiled
def batch(size: int) -> Batch:
    """Room for that many points."""
    return Batch(
        np.empty((size, 3)), np.empty(size), np.empty((size, 3)),
        np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64),
    )  # fmt: skip


@compiled
def nearest_faces(asked: Batch, link: int, forest: Forest) -> None:
    """Find the face nearest to each point, none where it is not within the point's limit.

    No point is farther than any foot that was found for one before it: neighbours help.
    """
    node, ahead = np.empty(ROOM, dtype=np.int64), np.empty(ROOM)
    boxes, faces = np.empty(WIDE, dtype=np.float32), np.empty(LEAF)
    for i in range(len(asked.p)):
        p, best, face, top = asked.p[i], _limit(asked, i), -1, 1
        node[0], ahead[0] = forest.root[link], 0.0
        while top > 0:  # the nearest node is on top; those farther than the best are dropped
            top -= 1
            here = node[top]
            if ahead[top] >= best:
                continue
            if here < 0:
                _faces(p, forest.leaf[-1 - here], faces)
                for c in range(LEAF):
                    if faces[c] < best:
                        best, face = faces[c], LEAF * (-1 - here) + c
                continue
            _boxes(p, forest.box[here], boxes)
            low = top
            for c in range(WIDE):
                least = boxes[c] * SHRINK
                if least < best:
                    at = top
                    while at > low and ahead[at - 1] < least:
                        node[at], ahead[at] = node[at - 1], ahead[at - 1]
                        at -= 1
                    node[at], ahead[at] = forest.child[here, c], least
                    top += 1
        asked.face[i], foot = face, asked.foot[i]
        foot[0], foot[1], foot[2] = np.inf, np.inf, np.inf
        if face >= 0:
            asked.part[i] = _on_triangle(p, forest.corners[face], foot)
            best = (p[0] - foot[0]) ** 2 + (p[1] - foot[1]) ** 2 + (p[2] - foot[2]) ** 2
        asked.square[i] = best


@compiled
def _limit(asked: Batch, i: int) -> float:
    """The limit of point i, and what the feet of those before it allow, rounded up."""
    limit, p = float(asked.square[i]), asked.p[i]
    for j in range(i):
        square = 0.0
        for a in range(3):
            square += (p[a] - asked.foot[j, a]) ** 2
        limit = min(limit, square * 1.0001 + TINY)
    return limit


# Below, the loops ask for their length although it is always the same: one that the compiler knows
# would be written out instead of becoming vector instructions.


@compiled
def _boxes(p: Array, box: NDArray[np.float32], least: NDArray[np.float32]) -> None:
    """Write the squared distances (8,) from p to boxes (15, 8); see `SHRINK`."""
    x, y, z = p[0], p[1], p[2]
    for c in range(box.shape[1]):
        a = abs(box[0, c] * x + box[1, c] * y + box[2, c] * z - box[9, c]) - box[12, c]
        b = abs(box[3, c] * x + box[4, c] * y + box[5, c] * z - box[10, c]) - box[13, c]
        d = abs(box[6, c] * x + box[7, c] * y + box[8, c] * z - box[11, c]) - box[14, c]
        a, b, d = max(a, 0.0), max(b, 0.0), max(d, 0.0)
        least[c] = a * a + b * b + d * d


@compiled
def _faces(p: Array, leaf: Array, square: Array) -> None:
    """Write the squared distances (4,) from p to the faces of a leaf (13, 4), see `Forest`.

    The least over the three edges, and over the plane where p's foot lies within the face.
    """
    for c in range(leaf.shape[1]):
        px, py, pz = p[0] - leaf[0, c], p[1] - leaf[1, c], p[2] - leaf[2, c]
        ux, uy, uz = leaf[3, c], leaf[4, c], leaf[5, c]  # ab
        vx, vy, vz = leaf[6, c], leaf[7, c], leaf[8, c]  # ac
        wx, wy, wz = vx - ux, vy - uy, vz - uz  # bc
        qx, qy, qz = px - ux, py - uy, pz - uz  # p from b
        up, vp = ux * px + uy * py + uz * pz, vx * px + vy * py + vz * pz
        t = min(max(up * leaf[9, c], 0.0), 1.0)
        x, y, z = px - t * ux, py - t * uy, pz - t * uz
        best = x * x + y * y + z * z
        t = min(max(vp * leaf[10, c], 0.0), 1.0)
        x, y, z = px - t * vx, py - t * vy, pz - t * vz
        best = min(best, x * x + y * y + z * z)
        t = min(max((wx * qx + wy * qy + wz * qz) * leaf[11, c], 0.0), 1.0)
        x, y, z = qx - t * wx, qy - t * wy, qz - t * wz
        best = min(best, x * x + y * y + z * z)
        uu, vv, uv = (
            ux * ux + uy * uy + uz * uz, vx * vx + vy * vy + vz * vz, ux * vx + uy * vy + uz * vz,
        )  # fmt: skip
        s, t = (vv * up - uv * vp) * leaf[12, c], (uu * vp - uv * up) * leaf[12, c]
        x, y, z = px - s * ux - t * vx, py - s * uy - t * vy, pz - s * uz - t * vz
        flat = min(best, x * x + y * y + z * z)
        square[c] = flat if min(min(s, t), 1.0 - s - t) >= 0.0 else best


@compiled
def _on_triangle(p: Array, t: Array, q: Array) -> int:
    """Write the nearest point of triangle t (3, 3) to p into q; return the part it lies on.

    Parts: 0 face, 1..3 vertices a b c, 4..6 edges ab bc ca. Regions by the signs of
    barycentric determinants (Ericson, "Real-Time Collision Detection", 5.1.5).
    """
    a, b, c = t[0], t[1], t[2]
    abx, aby, abz = b[0] - a[0], b[1] - a[1], b[2] - a[2]
    acx, acy, acz = c[0] - a[0], c[1] - a[1], c[2] - a[2]
    x, y, z = p[0] - a[0], p[1] - a[1], p[2] - a[2]
    d1 = abx * x + aby * y + abz * z
    d2 = acx * x + acy * y + acz * z
    if d1 <= 0.0 and d2 <= 0.0:
        q[:] = a
        return 1
    x, y, z = p[0] - b[0], p[1] - b[1], p[2] - b[2]
    d3 = abx * x + aby * y + abz * z
    d4 = acx * x + acy * y + acz * z
    if d3 >= 0.0 and d4 <= d3:
        q[:] = b
        return 2
    vc = d1 * d4 - d3 * d2
    if vc <= 0.0 and d1 >= 0.0 and d3 <= 0.0:
        v = d1 / (d1 - d3)
        q[0], q[1], q[2] = a[0] + v * abx, a[1] + v * aby, a[2] + v * abz
        return 4
    x, y, z = p[0] - c[0], p[1] - c[1], p[2] - c[2]
    d5 = abx * x + aby * y + abz * z
    d6 = acx * x + acy * y + acz * z
    if d6 >= 0.0 and d5 <= d6:
        q[:] = c
        return 3
    vb = d5 * d2 - d1 * d6
    if vb <= 0.0 and d2 >= 0.0 and d6 <= 0.0:
        w = d2 / (d2 - d6)
        q[0], q[1], q[2] = a[0] + w * acx, a[1] + w * acy, a[2] + w * acz
        return 6
    va = d3 * d6 - d5 * d4
    if va <= 0.0 and d4 - d3 >= 0.0 and d5 - d6 >= 0.0:
        w = (d4 - d3) / ((d4 - d3) + (d5 - d6))
        q[0] = b[0] + w * (c[0] - b[0])
        q[1] = b[1] + w * (c[1] - b[1])
        q[2] = b[2] + w * (c[2] - b[2])
        return 5
    denominator = 1.0 / (va + vb + vc)
    v, w = vb * denominator, vc * denominator
    q[0] = a[0] + v * abx + w * acx
    q[1] = a[1] + v * aby + w * acy
    q[2] = a[2] + v * abz + w * acz
    return 0
