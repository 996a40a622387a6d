"""The compiled search of the paper's Algorithm 2: the nearest point of each link, exactly.

One branch-and-bound over points and tree nodes with a running minimum: once a near point is
known, nearly every other point falls at its first box test. float64 throughout, compiled by
numba on first use and kept in its cache; it does not hold the interpreter's lock.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

AROUND = 0.25  # [m] around a link's box in which least distances are tabulated
DEPTH = 64  # of the traversal stack; the trees are balanced, 2^64 faces do not exist


@compiled
def nearest_of_links(
    points: Array,
    use: NDArray[np.bool_],
    T_base_link: Array,
    hint: NDArray[np.int64],
    hinted_only: bool,
    floor: Array,
    low: Array,
    high: Array,
    child: NDArray[np.int64],
    start: NDArray[np.int64],
    count: NDArray[np.int64],
    corners: Array,
    normals: Array,
    root: NDArray[np.int64],
    closed: NDArray[np.bool_],
    distance: Array,
    row: NDArray[np.int64],
    on_link: Array,
    outward: Array,
) -> None:
    """Signed nearest distance of every link to the used `points` (n, 3), base frame.

    hint: (L,) row that was nearest last time, tried first; -1 for none. `hinted_only` looks at
    no other. floor: (L, G, G, G) least signed distance in the cells of `distance_floor`.
    Writes distance (L,) (+inf without a point), row (L,) (-1), on_link (L, 3) base frame and
    outward (L, 3), the body's outward pseudonormal there, base frame. Points with NaN are
    passed over.
    """
    p = np.empty(3)
    best_point = np.empty(3)
    found = np.empty(3)
    for link in range(len(root)):
        T = T_base_link[link]
        node = root[link]
        best = np.inf
        best_row = -1
        best_face = -1
        best_part = 0
        # a sphere around the link's box, base frame, dismisses most points before they are moved
        radius = 0.0
        centre = np.empty(3)
        for a in range(3):
            p[a] = 0.5 * (low[node, a] + high[node, a])
            radius += (high[node, a] - p[a]) ** 2
        radius = np.sqrt(radius)
        for a in range(3):
            centre[a] = T[a, 0] * p[0] + T[a, 1] * p[1] + T[a, 2] * p[2] + T[a, 3]
        # the hinted row comes first, as row -1 of the loop, so that the rest is pruned
        # and so does the row that the link before this one has found
        for step in range(-1 if hinted_only else -2, 0 if hinted_only else len(points)):
            i = step
            if step == -1:
                i = hint[link]
            elif step == -2:
                i = row[link - 1] if link > 0 else -1
            if i < 0 or i >= len(points) or not use[i] or (step >= 0 and i == best_row):
                continue
            far = radius + max(best, 0.0)
            x = points[i, 0] - centre[0]
            y = points[i, 1] - centre[1]
            z = points[i, 2] - centre[2]
            if x * x + y * y + z * z > far * far:
                continue
            x = points[i, 0] - T[0, 3]
            y = points[i, 1] - T[1, 3]
            z = points[i, 2] - T[2, 3]
            p[0] = T[0, 0] * x + T[1, 0] * y + T[2, 0] * z
            p[1] = T[0, 1] * x + T[1, 1] * y + T[2, 1] * z
            p[2] = T[0, 2] * x + T[1, 2] * y + T[2, 2] * z
            bound = box_distance2(p, low, high, node)
            if bound > 0.0:
                # outside the box, so outside the body: only a nearer surface matters
                limit = best * best if best > 0.0 else 0.0
                if not (bound < limit):
                    continue
            elif bound == 0.0:
                limit = np.inf  # perhaps inside: the deepest point wins, not the nearest
            else:
                continue  # NaN
            least = _floor(p, low, high, node, floor[link])
            if least >= best:
                continue
            if least > 0.0:
                limit = best * best
            d2, face, part = nearest_face(
                p, limit, node, low, high, child, start, count, corners, found
            )
            if face < 0:
                continue
            d = np.sqrt(d2)
            if bound == 0.0 and closed[link]:
                n = normals[face, part]
                side = (
                    (p[0] - found[0]) * n[0] + (p[1] - found[1]) * n[1] + (p[2] - found[2]) * n[2]
                )
                if side < 0.0:
                    d = -d
            if d < best:
                best = d
                best_row = i
                best_face = face
                best_part = part
                best_point[:] = found
        distance[link] = best
        row[link] = best_row
        if best_row >= 0:
            n = normals[best_face, best_part]
            length = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
            for a in range(3):
                on_link[link, a] = (
                    T[a, 0] * best_point[0]
                    + T[a, 1] * best_point[1]
                    + T[a, 2] * best_point[2]
                    + T[a, 3]
                )
                outward[link, a] = (T[a, 0] * n[0] + T[a, 1] * n[1] + T[a, 2] * n[2]) / length


@compiled
def distance_floor(
    low: Array,
    high: Array,
    child: NDArray[np.int64],
    start: NDArray[np.int64],
    count: NDArray[np.int64],
    corners: Array,
    normals: Array,
    root: NDArray[np.int64],
    closed: NDArray[np.bool_],
    out: Array,
) -> None:
    """Write a lower bound [m] of the signed distance in each cell (L, G, G, G) of the box
    around a link, `AROUND` larger on every side; -inf where the cell may lie inside.
    """
    G = out.shape[1]
    p, found = np.empty(3), np.empty(3)
    for link in range(len(root)):
        node = root[link]
        size = (high[node] - low[node] + 2.0 * AROUND) / G
        reach = 0.5 * np.sqrt((size * size).sum())
        for x in range(G):
            for y in range(G):
                limit = np.inf
                for z in range(G):
                    p[0] = low[node, 0] - AROUND + (x + 0.5) * size[0]
                    p[1] = low[node, 1] - AROUND + (y + 0.5) * size[1]
                    p[2] = low[node, 2] - AROUND + (z + 0.5) * size[2]
                    d2, face, part = nearest_face(
                        p, limit, node, low, high, child, start, count, corners, found
                    )
                    d = np.sqrt(d2)
                    n = normals[face, part]
                    side = 0.0
                    for a in range(3):
                        side += (p[a] - found[a]) * n[a]
                    out[link, x, y, z] = d - reach
                    if closed[link] and (side <= 0.0 or d <= reach):
                        out[link, x, y, z] = -np.inf
                    # the next cell's centre is no farther from the surface than this
                    limit = (d + size[2]) ** 2 * 1.001 + 1e-9


@compiled
def _floor(p: Array, low: Array, high: Array, node: int, floor: Array) -> float:
    """Lower bound of the signed distance of p, -inf where nothing is known."""
    G = len(floor)
    x = (p[0] - low[node, 0] + AROUND) / (high[node, 0] - low[node, 0] + 2.0 * AROUND) * G
    y = (p[1] - low[node, 1] + AROUND) / (high[node, 1] - low[node, 1] + 2.0 * AROUND) * G
    z = (p[2] - low[node, 2] + AROUND) / (high[node, 2] - low[node, 2] + 2.0 * AROUND) * G
    if not (0.0 <= x < G and 0.0 <= y < G and 0.0 <= z < G):
        return -np.inf
    return float(floor[int(x), int(y), int(z)])


@compiled
def nearest_of_origins(
    points: Array, use: NDArray[np.bool_], origins: Array, distance: Array, row: NDArray[np.int64]
) -> None:
    """Nearest used point of each origin (K, 3): writes distance (K,) (+inf) and row (K,) (-1)."""
    for k in range(len(origins)):
        best = np.inf
        best_row = -1
        for i in range(len(points)):
            if use[i]:
                x = points[i, 0] - origins[k, 0]
                y = points[i, 1] - origins[k, 1]
                z = points[i, 2] - origins[k, 2]
                d2 = x * x + y * y + z * z
                if d2 < best:
                    best = d2
                    best_row = i
        distance[k] = np.sqrt(best)
        row[k] = best_row


@compiled
def to_link(T: Array, point: Array, p: Array) -> None:
    """Write a point of the base frame in the frame of a posed link into p."""
    x, y, z = point[0] - T[0, 3], point[1] - T[1, 3], point[2] - T[2, 3]
    for a in range(3):
        p[a] = T[0, a] * x + T[1, a] * y + T[2, a] * z


@compiled
def box_distance2(p: Array, low: Array, high: Array, node: int) -> float:
    """Squared distance from p to a node's box; 0 inside, NaN for NaN."""
    total = 0.0
    for a in range(3):
        v = p[a]
        if v < low[node, a]:
            total += (low[node, a] - v) ** 2
        elif v > high[node, a]:
            total += (v - high[node, a]) ** 2
        elif v != v:
            return np.nan
    return total


@compiled
def nearest_face(
    p: Array,
    limit: float,
    root: int,
    low: Array,
    high: Array,
    child: NDArray[np.int64],
    start: NDArray[np.int64],
    count: NDArray[np.int64],
    corners: Array,
    out: Array,
) -> tuple[float, int, int]:
    """Nearest surface point closer than sqrt(limit): (distance^2, face, part), face -1 if none."""
    stack = np.empty(DEPTH, dtype=np.int64)
    bounds = np.empty(DEPTH)
    q = np.empty(3)
    best, best_face, best_part = limit, -1, 0
    stack[0], bounds[0], top = root, 0.0, 1
    while top > 0:
        top -= 1
        node = stack[top]
        if bounds[top] >= best:
            continue
        if child[node] < 0:
            for f in range(start[node], start[node] + count[node]):
                part = _on_triangle(p, corners[f], q)
                d2 = (p[0] - q[0]) ** 2 + (p[1] - q[1]) ** 2 + (p[2] - q[2]) ** 2
                if d2 < best:
                    best, best_face, best_part = d2, f, part
                    out[:] = q
            continue
        a, b = child[node], child[node] + 1
        da, db = box_distance2(p, low, high, a), box_distance2(p, low, high, b)
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
