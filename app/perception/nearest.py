"""The compiled descent into one link's tree: the nearest face to a point, exactly.

float64 throughout but for the boxes, which are float32 and a little too large, so that they
never hide a face.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.perception.tree import Forest

DEPTH = 64  # of the traversal stack; the trees are balanced, 2^64 faces do not exist
SHRINK = 1.0 - 1e-6  # of squared box distances: float32 axes are not quite of unit length


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


@compiled
def _bound2(p: Array, box: NDArray[np.float32], node: int) -> float:
    """Lower bound of the squared distance from p to the faces below a node."""
    total = 0.0
    for a in range(3):
        along = box[node, 3 * a] * p[0] + box[node, 3 * a + 1] * p[1] + box[node, 3 * a + 2] * p[2]
        beyond = abs(along - box[node, 9 + a]) - box[node, 12 + a]
        if beyond > 0.0:
            total += beyond * beyond
    return total * SHRINK


@compiled
def nearest_face(
    p: Array, limit: float, link: int, forest: Forest, out: Array
) -> tuple[float, int, int]:
    """Squared distance, face and part nearest to p; face -1 when none is nearer than `limit`
    (squared). Writes the point into out. Nodes are visited near to far, farther ones dropped.
    """
    stack = np.empty(DEPTH, dtype=np.int64)
    bounds = np.empty(DEPTH)
    q = np.empty(3)
    best, best_face, best_part = limit, -1, 0
    stack[0], bounds[0] = forest.root[link], 0.0
    top = 1
    while top > 0:
        top -= 1
        node = stack[top]
        if bounds[top] >= best:
            continue
        child, faces = forest.child[node], forest.faces[node]
        if faces > 0:
            for f in range(child, child + faces):
                part = _on_triangle(p, forest.corners[f], q)
                d2 = (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2
                if d2 < best:
                    best, best_face, best_part = d2, f, part
                    out[:] = q
            continue
        a, b = child, child + 1
        da, db = _bound2(p, forest.box, a), _bound2(p, forest.box, b)
        if da > db:
            a, b, da, db = b, a, db, da
        if db < best:
            stack[top], bounds[top] = b, db
            top += 1
        if da < best:
            stack[top], bounds[top] = a, da
            top += 1
    return best, best_face, best_part


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
