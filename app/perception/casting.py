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
from app.robot.traits import noise_of, pulse_of

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
    noise, pulse: (K, 2) of the sensors' types, see `app.robot.traits.Traits`.
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
    noise: Array
    pulse: Array


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
    for k in sensors:
        rays[fan.first[k] : fan.first[k + 1]] = 1
    views = _views(sensors, T_base_link, fan, hulls)
    if footprint:
        _widen_zones(sensors, reported, views, fan, hulls, rays)
    for link in range(len(T_base_link)):
        casts.end[link] = casts.end[link - 1] if link > 0 else 0
        _enter_box(link, sensors, views, fan, hulls, rays, casts)


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
            along = 0.0
            square = 0.0
            for i in range(3):
                v = hulls.centre[link, i] - lens[i]
                square += v * v
                along += v * (
                    R[i, 0] * fan.axis[k, 0] + R[i, 1] * fan.axis[k, 1] + R[i, 2] * fan.axis[k, 2]
                )
            distance = np.sqrt(square)
            views.reached[link, row] = _reaches(along, distance, hulls.radius[link], fan.cone[k])
    return views


@compiled
def _reaches(along: float, distance: float, radius: float, cone: float) -> bool:
    """Does a cone reach a sphere whose centre is so far from its tip, and so far along its axis?

    It does unless the centre is farther from the axis, as an angle, than the cone's half angle and
    the sphere's own, asin(radius / distance).
    """
    if distance <= radius:
        return True
    angle = np.arccos(min(1.0, max(-1.0, along / distance)))
    return bool(angle <= cone + np.arcsin(radius / distance))


@compiled
def _widen_zones(
    sensors: NDArray[np.intp],
    reported: Array,
    views: Views,
    fan: Fan,
    hulls: Hulls,
    rays: NDArray[np.uint8],
) -> None:
    """Let all rays stand for the zones whose point may be a return from a link's box.

    What explains a point lies within the threshold and the depth of a pulse along the ray, and
    within the zone's width across it.
    """
    for row in range(len(sensors)):
        k = sensors[row]
        floor, share = fan.noise[k, 0], fan.noise[k, 1]
        least, more = fan.pulse[k, 0], fan.pulse[k, 1]
        for link in range(len(hulls.radius)):
            if not views.reached[link, row]:
                continue
            R, lens = views.R_link_mount[link, row], views.lens[link, row]
            low, high = hulls.low[link], hulls.high[link]
            for zone in range(fan.first[k], fan.first[k + 1]):
                z = reported[zone]
                limit = hulls.slack[0] + SIGMAS * noise_of(floor, share, z)
                pulse = pulse_of(least, more, z + limit)
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
def _enter_box(
    link: int,
    sensors: NDArray[np.intp],
    views: Views,
    fan: Fan,
    hulls: Hulls,
    rays: NDArray[np.uint8],
    casts: Casts,
) -> None:
    """Append the rays that enter the link's box, by the slabs between its faces."""
    o, d = np.empty(3), np.empty(3)
    n = casts.end[link]
    for row in range(len(sensors)):
        if not views.reached[link, row]:
            continue
        k, R, lens = sensors[row], views.R_link_mount[link, row], views.lens[link, row]
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
