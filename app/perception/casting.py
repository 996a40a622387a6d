"""Which rays of the zones may meet which link: the compiled part of the self filter before Embree.

A cast is dear, and most rays miss most links. So a sensor's rays are moved into a link's frame
only where the cone that holds them reaches the sphere around the link, and are cast only where
they enter its box. A zone's centre ray is always cast; the others only where the link may explain
what the zone measured, and those between them only where the first ones did not.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.footprint import Fan
from app.perception.uncertainty import (
    WIDEST,
    Known,
    published_threshold,
    spread,
    threshold,
)

NEAR = 0.015  # [m] rays start here: before it is the sensor's own window, after it what it measures
SLACK = 1e-4  # [m] boxes are this much larger, so that float32 never culls a hit
# [m] behind where a ray meets it, the body may still be seen: its surface recedes towards its
# outline, between two rays, by as much as a limb is thick; and two parts of it within a pulse, a
# quarter of the 0.6 m at which the maker tells two targets apart, are reported somewhere between
DEPTH = 0.2
LONGEST = 2.0  # metres of a ray per depth, at most: a zone 60 degrees off the axis
KEPT = int(Verdict.KEPT)


class Hulls(NamedTuple):
    """What surely holds L links, link frames, and how near they explain a return; all [m].

    centre: (L, 3), radius: (L,) of a sphere.   low, high: (L, 3) corners of a box.
    fixed:  (L, L) do two links move as one? What is fixed to a sensor is not cast at: it never
            changes.
    measured: (L, 2) thresholds without the noise that were measured, NaN where none were; the
            second column is for zones across an edge.   slack: (1,) the largest of them, or 0.
    """

    centre: Array
    radius: Array
    low: Array
    high: Array
    fixed: NDArray[np.bool_]
    measured: Array
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
    """K sensors as L links see them, link frames: rotation (L, K, 3, 3), lens (L, K, 3) [m], how
    the link moves for the sensor (L, K, 6): [m/s] at the frame's origin and [rad/s]; and whether
    the sensor's cone reaches the link at all (L, K)."""

    R_link_mount: Array
    lens: Array
    twist: Array
    reached: NDArray[np.bool_]


class Aims(NamedTuple):
    """How the zones (S,) are looked at.

    done, rays: rays from `done` on, up to `rays`, are to be cast.
    spread:     half widths of the zone over which they are spread.
    eps:        [m] how far from the body a return is still its own.
    """

    done: NDArray[np.uint8]
    rays: NDArray[np.uint8]
    spread: Array
    eps: Array


@compiled
def aim(
    sensors: NDArray[np.intp],
    T_base_link: Array,
    twist: Array,
    fan: Fan,
    hulls: Hulls,
    views: Views,
) -> None:
    """See the `sensors` (m,) from every link: their rows of `views` are written.

    twist: (L, 6) of the links, see `Posture.link_twists`.
    """
    for k in sensors:
        own = fan.link[k]
        A = T_base_link[own]
        for link in range(len(T_base_link)):
            views.reached[link, k] = False
            if hulls.fixed[own, link]:
                continue
            B, R, lens = T_base_link[link], views.R_link_mount[link, k], views.lens[link, k]
            for i in range(3):
                lens[i] = 0.0
                for j in range(3):
                    lens[i] += B[j, i] * (A[j, 3] - B[j, 3])
                    R[i, j] = B[0, i] * A[0, j] + B[1, i] * A[1, j] + B[2, i] * A[2, j]
                for j in range(3):
                    lens[i] += R[i, j] * fan.origin[k, j]
            along, square = 0.0, 0.0
            for i in range(3):
                v = hulls.centre[link, i] - lens[i]
                square += v * v
                along += v * (
                    R[i, 0] * fan.axis[k, 0] + R[i, 1] * fan.axis[k, 1] + R[i, 2] * fan.axis[k, 2]
                )
            views.reached[link, k] = _reaches(
                along, np.sqrt(square), hulls.radius[link], fan.cone[k]
            )
            if views.reached[link, k]:
                _relative_twist(twist[link] - twist[own], B, views.twist[link, k])


@compiled
def _relative_twist(twist: Array, T: Array, out: Array) -> None:
    """A twist (6,) at the base's origin, as one at the origin and in the axes of a frame T."""
    x, y, z = T[0, 3], T[1, 3], T[2, 3]
    v = (
        twist[0] + twist[4] * z - twist[5] * y,
        twist[1] + twist[5] * x - twist[3] * z,
        twist[2] + twist[3] * y - twist[4] * x,
    )
    for i in range(3):
        out[i] = T[0, i] * v[0] + T[1, i] * v[1] + T[2, i] * v[2]
        out[3 + i] = T[0, i] * twist[3] + T[1, i] * twist[4] + T[2, i] * twist[5]


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
def first_look(
    sensors: NDArray[np.intp],
    reported: Array,
    widely: bool,
    fan: Fan,
    hulls: Hulls,
    known: Known,
    views: Views,
    aims: Aims,
) -> None:
    """Let rays stand for each zone of `sensors` (m,): its centre ray, and where its point may be
    a return from a link and `widely` is true, all of the first look. Rows of `aims` are written.

    What explains a point lies within the threshold behind it and `DEPTH` before it along the ray,
    and within the zone's spread across it: that part of the ray enters the box with this margin.
    """
    p, u = np.empty(3), np.empty(3)
    for k in sensors:
        for zone in range(fan.first[k], fan.first[k + 1]):
            aims.done[zone], aims.rays[zone] = 0, 1
            aims.spread[zone] = spread(known, k, reported[zone], 0.0)
            aims.eps[zone] = (
                threshold(known, k, reported[zone], 0.0)
                if widely
                else published_threshold(known, k, reported[zone])
            )
        for link in range(len(hulls.radius)):
            if not (widely and views.reached[link, k]):
                continue
            R, lens, w = views.R_link_mount[link, k], views.lens[link, k], views.twist[link, k]
            low, high = hulls.low[link], hulls.high[link]
            turning = LONGEST * np.sqrt(w[3] ** 2 + w[4] ** 2 + w[5] ** 2)
            along, across = _speeds(w, lens, fan.axis[k])
            speed = np.hypot(along, across)  # of the link at the lens
            for zone in range(fan.first[k], fan.first[k + 1]):
                z, c = max(reported[zone], 0.01), fan.centre[zone]
                for i in range(3):
                    u[i] = R[i, 0] * c[0] + R[i, 1] * c[1] + R[i, 2] * c[2]
                late = known.time[k] * (speed + turning * z)  # at most
                limit = hulls.slack[0] + aims.eps[zone] + known.sigmas[0] * late
                wide = aims.spread[zone] + known.sigmas[1] * late / (known.half[k] * z)
                aside = fan.width[k] * min(wide, WIDEST)
                begin = fan.depth[zone] * (1.0 - aside) * max(z - limit - DEPTH, 0.0)
                end = fan.depth[zone] * (1.0 + aside) * (z + limit)
                margin = aside * end
                for i in range(3):
                    step = u[i] if abs(u[i]) > 1e-30 else 1e-30
                    t, s = (low[i] - margin - lens[i]) / step, (high[i] + margin - lens[i]) / step
                    begin, end = max(begin, min(t, s)), min(end, max(t, s))
                if begin <= end:
                    aims.rays[zone] = fan.looks[k, 0]
                    for i in range(3):
                        p[i] = lens[i] + z * fan.depth[zone] * u[i]
                    along, across = _speeds(w, p, u)
                    aims.spread[zone] = max(aims.spread[zone], spread(known, k, z, across))
                    aims.eps[zone] = max(aims.eps[zone], threshold(known, k, z, along))


@compiled
def _speeds(twist: Array, p: Array, u: Array) -> tuple[float, float]:
    """[m/s] at which a point p (3,) of what moves with `twist` (6,) moves along u (3,) and across,
    all in one frame."""
    x = twist[0] + twist[4] * p[2] - twist[5] * p[1]
    y = twist[1] + twist[5] * p[0] - twist[3] * p[2]
    z = twist[2] + twist[3] * p[1] - twist[4] * p[0]
    along = (x * u[0] + y * u[1] + z * u[2]) / np.sqrt(u[0] ** 2 + u[1] ** 2 + u[2] ** 2)
    return along, np.sqrt(max(x * x + y * y + z * z - along * along, 0.0))


@compiled
def second_look(sensors: NDArray[np.intp], verdict: NDArray[np.uint8], fan: Fan, aims: Aims) -> int:
    """Let the rays between them stand for the zones whose verdict (S,) is KEPT though a first look
    was had at them; the others get none. Returns how many zones have more rays."""
    more = 0
    for k in sensors:
        for zone in range(fan.first[k], fan.first[k + 1]):
            again = verdict[zone] == KEPT and 1 < aims.rays[zone] < fan.looks[k, 1]
            aims.done[zone] = aims.rays[zone]
            if again:
                aims.rays[zone] = fan.looks[k, 1]
                more += 1
    return more


@compiled
def enter_boxes(
    sensors: NDArray[np.intp], fan: Fan, hulls: Hulls, views: Views, aims: Aims, casts: Casts
) -> None:
    """Fill `casts` with the rays of `sensors` (m,) that enter a link's box, by the slabs between
    its faces."""
    o, d, n, R_rays = np.empty(3), np.empty(3), 0, fan.offset.shape[1]
    for link in range(len(hulls.radius)):
        for k in sensors:
            if not views.reached[link, k]:
                continue
            R, lens = views.R_link_mount[link, k], views.lens[link, k]
            for zone in range(fan.first[k], fan.first[k + 1]):
                c, across, down = fan.centre[zone], fan.across[zone], fan.down[zone]
                for ray in range(aims.done[zone], aims.rays[zone]):
                    a = aims.spread[zone] * fan.offset[k, ray, 0]
                    b = aims.spread[zone] * fan.offset[k, ray, 1]
                    x = c[0] + a * across[0] + b * down[0]
                    y = c[1] + a * across[1] + b * down[1]
                    z = c[2] + a * across[2] + b * down[2]
                    unit = 1.0 / np.sqrt(x * x + y * y + z * z)
                    near, far = 0.0, np.inf
                    for i in range(3):
                        d[i] = unit * (R[i, 0] * x + R[i, 1] * y + R[i, 2] * z)
                        o[i] = lens[i] + NEAR * d[i]
                        low, high = hulls.low[link, i] - SLACK, hulls.high[link, i] + SLACK
                        if d[i] == 0.0:
                            if o[i] < low or o[i] > high:
                                far = -1.0
                            continue
                        t, s = (low - o[i]) / d[i], (high - o[i]) / d[i]
                        near, far = max(near, min(t, s)), min(far, max(t, s))
                    if near <= far:
                        for i in range(3):
                            casts.origin[n, i] = o[i]
                            casts.direction[n, i] = d[i]
                        casts.zone_ray[n] = zone * R_rays + ray
                        n += 1
        casts.end[link] = n
