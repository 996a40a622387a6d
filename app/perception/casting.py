"""Which rays of the zones may meet which link: the compiled part of the self filter before Embree.

A cast is dear, and most rays miss most links. So a sensor's rays are moved into a link's frame
only where the cone that holds them reaches the sphere around the link, and are cast only where
they enter its box. A zone's centre ray is always cast; the others only where the link may explain
what the zone measured.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.robot.traits import Traits, noise_of, pulse_of

SIGMAS = 3.0  # of a range's noise belong to its threshold: 99.7 % of a normal distribution
NEAR = 0.015  # [m] rays start here: before it is the sensor's own window, after it what it measures
SLACK = 1e-4  # [m] boxes are this much larger, so that float32 never culls a hit


class Fan(NamedTuple):
    """The rays of K sensors, S zones and up to R rays a zone, in the frames of their links.

    first:  (K + 1,) zones of each sensor.   link: (K,).   origin: (K, 3) [m].   axis: (K, 3) unit.
    cone:   (K,) [rad] half angle round the axis.   ray_count: (K,) that stand for a zone.
    direction: (S, R, 3) unit, a zone's centre ray first.
    report: (S, R) reported distance per metre of ray.
    longest: (K,) most metres of ray per reported distance.
    width:  (K,) farthest of a zone's rays from its centre ray, per reported distance.
    """

    first: NDArray[np.int64]
    link: NDArray[np.int64]
    origin: Array
    axis: Array
    cone: Array
    ray_count: NDArray[np.int64]
    direction: NDArray[np.float32]
    report: NDArray[np.float32]
    longest: Array
    width: Array
    traits: Traits


class Hulls(NamedTuple):
    """What surely holds L links, link frames, and how near they explain a return; all [m].

    centre: (L, 3), radius: (L,) of a sphere.   low, high: (L, 3) corners of a box.
    fixed:  (L, L) do two links move as one? What is fixed to a sensor is not cast at: it never
            changes.
    base, least: (L, 2) threshold = max(least, base + SIGMAS * noise); the second column is for
            zones across an edge.   slack: (1,) the largest of both.
    """

    centre: Array
    radius: Array
    low: Array
    high: Array
    fixed: NDArray[np.bool_]
    base: Array
    least: Array
    slack: Array


class Casts(NamedTuple):
    """Rays to cast, link by link: of link i those from end[i - 1] to end[i].

    origin, direction: (n, 3) in the link's frame.   zone_ray: (n,) zone * R + ray.
    hit: (n,) [m] where they end, filled in by the cast.   end: (L,).
    """

    origin: NDArray[np.float32]
    direction: NDArray[np.float32]
    zone_ray: NDArray[np.int32]
    hit: NDArray[np.float32]
    end: NDArray[np.int64]


class Views(NamedTuple):
    """m sensors as L links see them: rotation (L, m, 3, 3), lens (L, m, 3) [m], and whether the
    sensor's cone reaches the link at all (L, m)."""

    R_link_mount: Array
    lens: Array
    reached: NDArray[np.bool_]


@compiled
def select_rays(
    sensors: NDArray[np.intp],
    reported: Array,
    T_base_link: Array,
    footprint: bool,
    fan: Fan,
    hulls: Hulls,
    casts: Casts,
    rays: NDArray[np.uint8],
) -> None:
    """Fill `casts` with the rays of `sensors` (m,) that may meet a link, and rays (S,), how many
    stand for each of their zones.

    reported: (S,) [m] distances.   footprint: may more rays than its centre's stand for a zone?
    """
    views = _views(sensors, T_base_link, fan, hulls)
    for row in range(len(sensors)):
        k = sensors[row]
        rays[fan.first[k] : fan.first[k + 1]] = 1
        for link in range(len(T_base_link)):
            if footprint and views.reached[link, row]:
                _widen(k, row, link, reported, views, fan, hulls, rays)
    end = 0
    for link in range(len(T_base_link)):
        casts.end[link] = end
        for row in range(len(sensors)):
            if views.reached[link, row]:
                _enter(sensors[row], row, link, views, fan, hulls, rays, casts)
        end = casts.end[link]


@compiled
def _views(sensors: NDArray[np.intp], T_base_link: Array, fan: Fan, hulls: Hulls) -> Views:
    """T_link_mount = inverse(T_base_link) * T_base_mount of every sensor and link."""
    links, m = len(T_base_link), len(sensors)
    views = Views(
        np.empty((links, m, 3, 3)), np.empty((links, m, 3)), np.zeros((links, m), dtype=np.bool_)
    )
    for row in range(m):
        k = sensors[row]
        A = T_base_link[fan.link[k]]
        for link in range(links):
            if hulls.fixed[fan.link[k], link]:
                continue
            B = T_base_link[link]
            R, lens = views.R_link_mount[link, row], views.lens[link, row]
            for i in range(3):
                lens[i] = 0.0
                for j in range(3):
                    lens[i] += B[j, i] * (A[j, 3] - B[j, 3])
                    R[i, j] = B[0, i] * A[0, j] + B[1, i] * A[1, j] + B[2, i] * A[2, j]
                for j in range(3):
                    lens[i] += R[i, j] * fan.origin[k, j]
            views.reached[link, row] = _reaches(k, link, R, lens, fan, hulls)
    return views


@compiled
def _reaches(k: int, link: int, R: Array, lens: Array, fan: Fan, hulls: Hulls) -> bool:
    """Does the cone of sensor k reach the link's sphere? It does unless the sphere's centre is
    farther from the axis than the cone and the sphere's own half angle, asin(radius / distance)."""
    along = 0.0
    square = 0.0
    for i in range(3):
        v = hulls.centre[link, i] - lens[i]
        square += v * v
        along += v * (
            R[i, 0] * fan.axis[k, 0] + R[i, 1] * fan.axis[k, 1] + R[i, 2] * fan.axis[k, 2]
        )
    distance = np.sqrt(square)
    if distance <= hulls.radius[link]:
        return True
    angle = np.arccos(min(1.0, max(-1.0, along / distance)))
    return bool(angle <= fan.cone[k] + np.arcsin(hulls.radius[link] / distance))


@compiled
def _widen(
    k: int,
    row: int,
    link: int,
    reported: Array,
    views: Views,
    fan: Fan,
    hulls: Hulls,
    rays: NDArray[np.uint8],
) -> None:
    """Let all rays stand for the zones of sensor k whose point may be a return from the link's box.

    What explains a point lies within the threshold and the depth of a pulse along the ray, and
    within the zone's width across it.
    """
    R, lens = views.R_link_mount[link, row], views.lens[link, row]
    low, high = hulls.low[link], hulls.high[link]
    for zone in range(fan.first[k], fan.first[k + 1]):
        z = reported[zone]
        limit = hulls.slack[0] + SIGMAS * noise_of(fan.traits, k, z)
        pulse = pulse_of(fan.traits, k, z + limit)
        margin = fan.longest[k] * (limit + pulse) + fan.width[k] * (z + limit + pulse)
        length = z / fan.report[zone, 0]
        inside = True
        for i in range(3):
            p = lens[i] + length * (
                R[i, 0] * fan.direction[zone, 0, 0]
                + R[i, 1] * fan.direction[zone, 0, 1]
                + R[i, 2] * fan.direction[zone, 0, 2]
            )
            inside &= low[i] - margin <= p <= high[i] + margin
        if inside:
            rays[zone] = fan.ray_count[k]


@compiled
def _enter(
    k: int,
    row: int,
    link: int,
    views: Views,
    fan: Fan,
    hulls: Hulls,
    rays: NDArray[np.uint8],
    casts: Casts,
) -> None:
    """Append the rays of sensor k that enter the link's box, by the slabs between its faces."""
    R, lens = views.R_link_mount[link, row], views.lens[link, row]
    o, d = np.empty(3), np.empty(3)
    n = casts.end[link]
    for zone in range(fan.first[k], fan.first[k + 1]):
        for ray in range(rays[zone]):
            near, far = 0.0, np.inf
            for i in range(3):
                d[i] = (
                    R[i, 0] * fan.direction[zone, ray, 0]
                    + R[i, 1] * fan.direction[zone, ray, 1]
                    + R[i, 2] * fan.direction[zone, ray, 2]
                )
                o[i] = lens[i] + NEAR * d[i]
                low, high = hulls.low[link, i] - SLACK, hulls.high[link, i] + SLACK
                if d[i] == 0.0:
                    if o[i] < low or o[i] > high:
                        far = -1.0
                    continue
                a, b = (low - o[i]) / d[i], (high - o[i]) / d[i]
                near, far = max(near, min(a, b)), min(far, max(a, b))
            if near <= far:
                for i in range(3):
                    casts.origin[n, i] = o[i]
                    casts.direction[n, i] = d[i]
                casts.zone_ray[n] = zone * fan.direction.shape[1] + ray
                n += 1
    casts.end[link] = n
