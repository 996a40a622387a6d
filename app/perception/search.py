"""The compiled search of the paper's Algorithm 2: the nearest point of each link, exactly.

First every point gets bounds of its distance, from a sphere, a box and a coarse table. The
smallest upper bound dismisses nearly all of them; the tree is asked for the few that are
left, the most promising first. float64.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.perception.field import bounds
from app.perception.nearest import box_distance2, nearest_face, to_link
from app.perception.tree import Forest


@compiled
def nearest_of_links(
    points: Array,
    use: NDArray[np.bool_],
    T_base_link: Array,
    hint: NDArray[np.int64],
    hinted_only: bool,
    forest: Forest,
    field: NDArray[np.float32],
    distance: Array,
    row: NDArray[np.int64],
    on_link: Array,
    outward: Array,
) -> None:
    """Signed nearest distance of every link to the used `points` (n, 3), base frame.

    hint: (L,) row that was nearest last time, bounded first; -1 for none. `hinted_only` looks
    at no other. field: of `app.perception.field`.
    Writes distance (L,) (+inf without a point), row (L,) (-1), on_link (L, 3) base frame and
    outward (L, 3), the body's outward pseudonormal there, base frame. Points with NaN are
    passed over.
    """
    n = len(points)
    p, found, best_point, centre = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    at, least, most = np.empty((n + 2, 3)), np.empty(n + 2), np.empty(n + 2)
    which = np.empty(n + 2, dtype=np.int64)
    for link in range(len(forest.root)):
        T = T_base_link[link]
        # a sphere around the link's box, base frame, dismisses most points before they are moved
        radius = 0.0
        for a in range(3):
            p[a] = 0.5 * (forest.low[link, a] + forest.high[link, a])
            radius += (forest.high[link, a] - p[a]) ** 2
        radius = np.sqrt(radius)
        for a in range(3):
            centre[a] = T[a, 0] * p[0] + T[a, 1] * p[1] + T[a, 2] * p[2] + T[a, 3]
        ceiling = np.inf  # some point is no farther than this
        left = 0
        first = -1
        # the hinted row comes first, and the one that the link before this one has found
        for step in range(-2, 0 if hinted_only else n):
            i = step
            if step == -2:
                i = hint[link]
            elif step == -1:
                i = row[link - 1] if link > 0 and not hinted_only else -1
            if i < 0 or i >= n or not use[i]:
                continue
            far = radius + max(ceiling, 0.0)
            x, y, z = points[i, 0] - centre[0], points[i, 1] - centre[1], points[i, 2] - centre[2]
            if x * x + y * y + z * z > far * far:
                continue
            to_link(T, points[i], p)
            outside = np.sqrt(box_distance2(p, forest.low, forest.high, link))
            if not (outside <= max(ceiling, 0.0)):
                continue  # NaN among others
            low, high = bounds(p, link, forest, field)
            if outside > 0.0:
                low = max(low, outside)
            if low > ceiling:
                continue
            ceiling = min(ceiling, high)
            at[left], least[left], most[left], which[left] = p, low, high, i
            if first < 0 or low < least[first]:
                first = left
            left += 1
        best, best_row, best_face, best_part = np.inf, -1, -1, 0
        for step in range(-1, left):
            c = first if step < 0 else step
            if c < 0 or (step == first) or not (least[c] < best and least[c] <= ceiling):
                continue
            # from outside only a surface nearer than the best matters; inside the deepest wins
            limit = most[c] if most[c] == np.inf else max(abs(least[c]), abs(most[c]))
            if least[c] > 0.0 or not forest.closed[link]:
                limit = min(limit, best)
            limit = limit * limit if limit == np.inf else limit * limit * 1.0000001 + 1e-18
            d2, face, part = nearest_face(at[c], limit, link, forest, found)
            if face < 0:
                continue
            d = np.sqrt(d2)
            if least[c] <= 0.0 and forest.closed[link]:
                side = 0.0
                for a in range(3):
                    side += (at[c, a] - found[a]) * forest.normals[face, part, a]
                if side < 0.0:
                    d = -d
            if d < best:
                best, best_row, best_face, best_part = d, which[c], face, part
                best_point[:] = found
        distance[link], row[link] = best, best_row
        if best_row >= 0:
            v = forest.normals[best_face, best_part]
            length = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
            for a in range(3):
                on_link[link, a] = T[a, 3]
                outward[link, a] = 0.0
                for i in range(3):
                    on_link[link, a] += T[a, i] * best_point[i]
                    outward[link, a] += T[a, i] * v[i] / length


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
