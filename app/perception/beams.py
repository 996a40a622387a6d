"""The compiled parts of the self filter: aim rays at links, weigh what they hit, place points.

Embree casts; around it a frame costs three calls. No loop over zones runs in Python. The
kernels are compiled by numba on first use and kept in its cache.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import SLOTS, Array, Verdict
from app.robot.skin import NOISE_FLOOR, NOISE_SHARE, PULSE, PULSE_SHARE

KEPT, SELF, BEHIND, STATIC = (
    int(v) for v in (Verdict.KEPT, Verdict.SELF, Verdict.BEHIND, Verdict.STATIC)
)
BAD_STATUS, NO_TARGET, OUT_OF_RANGE, EMPTY = (
    int(v) for v in (Verdict.BAD_STATUS, Verdict.NO_TARGET, Verdict.OUT_OF_RANGE, Verdict.EMPTY)
)
SECANT = 1.2  # a zone's ray is no longer than this share of its depth
WIDTH = 0.055  # of the depth: no ray of a zone is farther than this from its centre ray
SLACK = 1e-4  # [m] boxes are this much larger, so that float32 never culls a hit


@compiled
def aim(
    sensors: NDArray[np.intp],
    rays: int,
    near: float,
    depth: Array,
    slack: float,
    sigmas: float,
    mount: NDArray[np.int64],
    welded: NDArray[np.bool_],
    origin: Array,
    axis: Array,
    direction: NDArray[np.float32],
    cosine: NDArray[np.float32],
    cone: float,
    T_base_link: Array,
    centre: Array,
    radius: Array,
    low: Array,
    high: Array,
    out_origin: NDArray[np.float32],
    out_direction: NDArray[np.float32],
    out_index: NDArray[np.int32],
    end: NDArray[np.int64],
    cast: NDArray[np.uint8],
) -> None:
    """Move the rays of `sensors` (m,) into every link's frame and keep those that may hit it.

    A ray may hit when its sensor's cone (half angle `cone`) reaches the link's sphere and the
    ray itself its box; links fixed to the sensor's (`welded` (L, L)) are left out. A zone's
    centre ray always counts; the others only where the point measured, at `depth` (m, 64),
    lies so near a link's box that the link may explain it with a threshold of `slack` [m] and
    `sigmas` of the noise. Writes origins and directions (n, 3) in the link's frame, the index
    of each ray (row of sensors * 64 * rays + zone * rays + ray), end (L,): rays of link i are
    those from end[i - 1] to end[i], and cast (m, 64): rays of each zone that count.
    """
    links, m = len(T_base_link), len(sensors)
    R, at = np.empty((links, m, 3, 3)), np.empty((links, m, 3))
    reached = np.zeros((links, m), dtype=np.bool_)
    for row in range(m):
        cast[row] = 1
        k = sensors[row]
        A = T_base_link[mount[k]]
        for link in range(links):
            if welded[mount[k], link]:
                continue
            B = T_base_link[link]
            here, turn = at[link, row], R[link, row]
            for i in range(3):
                here[i] = 0.0
                for j in range(3):
                    here[i] += B[j, i] * (A[j, 3] - B[j, 3])
                    turn[i, j] = B[0, i] * A[0, j] + B[1, i] * A[1, j] + B[2, i] * A[2, j]
                for j in range(3):
                    here[i] += turn[i, j] * origin[k, j]
            along = 0.0
            square = 0.0
            for i in range(3):
                v = centre[link, i] - here[i]
                square += v * v
                along += v * (
                    turn[i, 0] * axis[k, 0] + turn[i, 1] * axis[k, 1] + turn[i, 2] * axis[k, 2]
                )
            distance = np.sqrt(square)
            if distance > radius[link]:
                angle = np.arccos(min(1.0, max(-1.0, along / distance)))
                if angle > cone + np.arcsin(radius[link] / distance):
                    continue
            reached[link, row] = True
            if rays > 1:
                _come_near(
                    depth[row], slack, sigmas, rays, here, turn, direction[k], cosine[k],
                    low[link], high[link], cast[row],
                )  # fmt: skip
    n = 0
    o = np.empty(3)
    d = np.empty(3)
    for link in range(links):
        for row in range(m):
            if not reached[link, row]:
                continue
            k = sensors[row]
            here, turn = at[link, row], R[link, row]
            for zone in range(SLOTS):
                for ray in range(cast[row, zone]):
                    first, last = 0.0, np.inf
                    for i in range(3):
                        d[i] = (
                            turn[i, 0] * direction[k, zone, ray, 0]
                            + turn[i, 1] * direction[k, zone, ray, 1]
                            + turn[i, 2] * direction[k, zone, ray, 2]
                        )
                        o[i] = here[i] + near * d[i]
                        if d[i] == 0.0:
                            if o[i] < low[link, i] - SLACK or o[i] > high[link, i] + SLACK:
                                last = -1.0
                            continue
                        a = (low[link, i] - SLACK - o[i]) / d[i]
                        b = (high[link, i] + SLACK - o[i]) / d[i]
                        first = max(first, min(a, b))
                        last = min(last, max(a, b))
                    if first <= last:
                        for i in range(3):
                            out_origin[n, i] = o[i]
                            out_direction[n, i] = d[i]
                        out_index[n] = (row * SLOTS + zone) * rays + ray
                        n += 1
        end[link] = n


@compiled
def _come_near(
    depth: Array,
    slack: float,
    sigmas: float,
    rays: int,
    at: Array,
    R: Array,
    direction: NDArray[np.float32],
    cosine: NDArray[np.float32],
    low: Array,
    high: Array,
    cast: NDArray[np.uint8],
) -> None:
    """Set cast (64,) to `rays` where a zone's point may be a return from a link's box.

    What explains a point lies within the threshold and the depth of a pulse along the ray,
    and within the zone's width across it.
    """
    for zone in range(SLOTS):
        z = depth[zone]
        limit = slack + sigmas * max(NOISE_FLOOR, NOISE_SHARE * abs(z))
        pulse = max(PULSE, PULSE_SHARE * (z + limit))
        margin = SECANT * (limit + pulse) + WIDTH * (z + limit + pulse)
        length = z / cosine[zone, 0]
        inside = True
        for i in range(3):
            p = at[i] + length * (
                R[i, 0] * direction[zone, 0, 0]
                + R[i, 1] * direction[zone, 0, 1]
                + R[i, 2] * direction[zone, 0, 2]
            )
            inside &= low[i] - margin <= p <= high[i] + margin
        if inside:
            cast[zone] = rays


@compiled
def weigh(
    sensors: NDArray[np.intp],
    rays: int,
    depth: Array,
    mount: NDArray[np.int64],
    own: NDArray[np.float32],
    own_link: NDArray[np.int16],
    cosine: NDArray[np.float32],
    hit: NDArray[np.float32],
    index: NDArray[np.int32],
    end: NDArray[np.int64],
    cast: NDArray[np.uint8],
    eps_base: Array,
    eps_least: Array,
    eps_sigmas: float,
    two_sided: bool,
    verdict: NDArray[np.uint8],
    way: NDArray[np.int16],
    gap: Array,
    eps: Array,
    edge: NDArray[np.bool_],
) -> None:
    """Compare the depth of every zone with what the body would return to it.

    A sensor answers for the nearest group of returns that merge into one pulse, so the body's
    rays are gathered into such groups; each predicts one depth. A zone whose rays are not all
    in the first group lies across an edge: a little more or less of the nearer part decides
    what it reports, so every group counts there and the threshold is another one.

    own, own_link: (K, 64, 9) ray lengths to what is fixed to the sensor, and to which link.
    hit, index, end, cast: of the rays of `aim`. eps_base, eps_least: (L, 2) [m], inside and across
    an edge. Writes verdict, way (link or -1), gap, eps and edge (m, 64).
    """
    m = len(sensors)
    best = np.empty(m * SLOTS * rays, dtype=np.float32)
    link = np.empty(m * SLOTS * rays, dtype=np.int16)
    for row in range(m):
        k = sensors[row]
        for zone in range(SLOTS):
            for ray in range(cast[row, zone]):
                i = (row * SLOTS + zone) * rays + ray
                best[i] = own[k, zone, ray]
                link[i] = own_link[k, zone, ray]
    first = 0
    for body in range(len(end)):
        for n in range(first, end[body]):
            if hit[n] < best[index[n]]:
                best[index[n]] = hit[n]
                link[index[n]] = body
        first = end[body]
    sorted_depth = np.empty(rays)
    sorted_link = np.empty(rays, dtype=np.int16)
    for row in range(m):
        k = sensors[row]
        for zone in range(SLOTS):
            z = depth[row, zone]
            noise = eps_sigmas * max(NOISE_FLOOR, NOISE_SHARE * abs(z))
            seen = 0
            for ray in range(cast[row, zone]):
                i = (row * SLOTS + zone) * rays + ray
                if link[i] < 0:
                    continue
                # depths are compared along the optical axis, which is what is measured
                d = best[i] * cosine[k, zone, ray]
                at = seen
                while at > 0 and sorted_depth[at - 1] > d:
                    sorted_depth[at], sorted_link[at] = sorted_depth[at - 1], sorted_link[at - 1]
                    at -= 1
                sorted_depth[at], sorted_link[at] = d, link[i]
                seen += 1
            nearest, nearest_link = np.inf, -1
            front, front_link = np.inf, -1
            across = 0
            i = 0
            while i < seen:
                reach = sorted_depth[i] + max(PULSE, PULSE_SHARE * sorted_depth[i])
                total = 0.0
                j = i
                while j < seen and sorted_depth[j] <= reach:
                    total += sorted_depth[j]
                    j += 1
                g = total / (j - i) - z
                if i == 0:
                    front, front_link = g, sorted_link[0]
                    across = 1 if j < cast[row, zone] else 0
                if abs(g) < abs(nearest):  # this group explains the measurement best
                    nearest, nearest_link = g, sorted_link[i]
                i = j
            who = nearest_link if nearest_link >= 0 else mount[k]
            limit = max(eps_least[who, across], eps_base[who, across] + noise)
            way[row, zone] = nearest_link
            gap[row, zone] = nearest
            eps[row, zone] = limit
            edge[row, zone] = across == 1
            if abs(nearest) <= limit:
                verdict[row, zone] = SELF
                continue
            verdict[row, zone] = KEPT
            if front_link >= 0 and not two_sided:
                base, least = eps_base[front_link, across], eps_least[front_link, across]
                if front < -max(least, base + noise):
                    verdict[row, zone] = BEHIND


@compiled
def place(
    sensors: NDArray[np.intp],
    mount: NDArray[np.int64],
    origin: Array,
    reach: Array,
    used: NDArray[np.bool_],
    T_base_link: Array,
    depth: Array,
    status: NDArray[np.uint8],
    targets: NDArray[np.uint8],
    trusted: NDArray[np.bool_],
    range_min: float,
    range_max: float,
    verdict: NDArray[np.uint8],
    points: Array,
) -> None:
    """Put every zone's point into the base frame and let the sensor's own word overrule.

    trusted: (256,) by target status. Changes verdict (m, 64) and writes points (m, 64, 3),
    NaN where there is no target.
    """
    for row in range(len(sensors)):
        k = sensors[row]
        T = T_base_link[mount[k]]
        for zone in range(SLOTS):
            slot = k * SLOTS + zone
            z = depth[row, zone]
            nothing = targets[row, zone] == 0 or status[row, zone] == 255
            for a in range(3):
                points[row, zone, a] = np.nan
            if not used[slot]:
                verdict[row, zone] = EMPTY
                continue
            if nothing:
                verdict[row, zone] = NO_TARGET
                continue
            if not trusted[status[row, zone]]:
                verdict[row, zone] = BAD_STATUS
            elif not (range_min <= z <= range_max):
                verdict[row, zone] = OUT_OF_RANGE
            for a in range(3):
                points[row, zone, a] = T[a, 3]
            for j in range(3):
                v = origin[k, j] + z * reach[slot, j]
                for a in range(3):
                    points[row, zone, a] += T[a, j] * v


@compiled
def inside(
    points: Array, T_base_box: Array, half: Array, normal: Array, offset: Array
) -> NDArray[np.bool_]:
    """(n,) is a point in one of the boxes or behind one of the planes? NaN is nowhere."""
    out = np.zeros(len(points), dtype=np.bool_)
    for i in range(len(points)):
        p = points[i]
        if not (np.isfinite(p[0]) and np.isfinite(p[1]) and np.isfinite(p[2])):
            continue
        for b in range(len(half)):
            T = T_base_box[b]
            x, y, z = p[0] - T[0, 3], p[1] - T[1, 3], p[2] - T[2, 3]
            within = True
            for a in range(3):
                within &= abs(T[0, a] * x + T[1, a] * y + T[2, a] * z) <= half[b, a]
            out[i] |= within
        for b in range(len(offset)):
            height = normal[b, 0] * p[0] + normal[b, 1] * p[1] + normal[b, 2] * p[2]
            out[i] |= height <= offset[b]
    return out
