"""What the robot's own body would return to each zone, and whether that explains a measurement.

A sensor answers for the nearest group of returns that merge into one pulse. So the rays of a zone
that met the body are gathered into such groups, and each predicts one distance, the mean of its
rays'. A zone whose rays are not all in the first group lies across an edge: a little more or less
of the nearer part decides what it reports, so every group counts there, with another threshold.

    gap = predicted - reported        threshold = max(least, base + SIGMAS * noise(reported))

|gap| <= threshold: the zone saw the robot. gap of the nearest group < -threshold: the point lies
behind the body, which is impossible.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.casting import SIGMAS, Casts, Fan, Hulls
from app.robot.traits import noise_of, pulse_of

KEPT, SELF, BEHIND = int(Verdict.KEPT), int(Verdict.SELF), int(Verdict.BEHIND)


class Judgement(NamedTuple):
    """What became of S zones.

    verdict: KEPT, SELF or BEHIND.   link: in the zone's way, or -1.
    gap:     [m] predicted less reported distance; +inf where no body is in the way.
    eps:     [m] threshold.   edge: the zone lies across an edge of what is in its way.
    rays:    that stood for the zone: all where a link may explain the point, else the centre's.
    """

    verdict: NDArray[np.uint8]
    link: NDArray[np.int16]
    gap: Array
    eps: Array
    edge: NDArray[np.bool_]
    rays: NDArray[np.uint8]


class Returns(NamedTuple):
    """Where the rays of S zones end on the body: length (S, R) [m], link (S, R), -1 for none."""

    length: NDArray[np.float32]
    link: NDArray[np.int16]


class Pulses(NamedTuple):
    """What the returns of n zones of a sensor come to: of the group that explains the measurement
    best and of the nearest one, gap (n,) [m] and link (n,), +inf and -1 without any; across (n,):
    1 over an edge, else 0."""

    gap: Array
    link: NDArray[np.int16]
    front_gap: Array
    front_link: NDArray[np.int16]
    across: NDArray[np.int64]


@compiled
def _nearest_hits(
    sensors: NDArray[np.intp], first: NDArray[np.int64], own: Returns, casts: Casts
) -> Returns:
    """Where each ray of `sensors` ends: on what is fixed to the sensor or on what was cast at.

    Rows of other sensors are not set.   first: (K + 1,) zones of each sensor.
    """
    out = Returns(np.empty_like(own.length), np.empty_like(own.link))
    for k in sensors:
        out.length[first[k] : first[k + 1]] = own.length[first[k] : first[k + 1]]
        out.link[first[k] : first[k + 1]] = own.link[first[k] : first[k + 1]]
    length, link = out.length.ravel(), out.link.ravel()  # views: both are contiguous
    begin = 0
    for body in range(len(casts.end)):
        for n in range(begin, casts.end[body]):
            ray = casts.zone_ray[n]
            if casts.hit[n] < length[ray]:
                length[ray], link[ray] = casts.hit[n], body
        begin = casts.end[body]
    return out


@compiled
def explain_returns(
    sensors: NDArray[np.intp],
    reported: Array,
    two_sided: bool,
    fan: Fan,
    hulls: Hulls,
    own: Returns,
    casts: Casts,
    judged: Judgement,
) -> None:
    """Judge the zones of `sensors` (m,) by what their rays met; their rows of `judged` are written.

    reported: (S,) [m].   two_sided: keep what lies behind the body.   own: on what is fixed to a
    sensor; the rest is cast.   judged.rays: is read.
    """
    returns = _nearest_hits(sensors, fan.first, own, casts)
    for k in sensors:
        mine = slice(fan.first[k], fan.first[k + 1])
        z, rays, noise = reported[mine], judged.rays[mine], fan.noise[k]
        distance, link, count = _sorted_reports(
            returns.length[mine], returns.link[mine], fan.report[mine], rays
        )
        pulses = _pulses(z, distance, link, count, rays, fan.pulse[k])
        for i in range(len(z)):
            sigmas = SIGMAS * noise_of(noise[0], noise[1], z[i])
            who = pulses.link[i] if pulses.link[i] >= 0 else fan.link[k]
            across, front, zone = pulses.across[i], pulses.front_link[i], fan.first[k] + i
            eps = max(hulls.least[who, across], hulls.base[who, across] + sigmas)
            judged.link[zone], judged.gap[zone] = pulses.link[i], pulses.gap[i]
            judged.eps[zone], judged.edge[zone] = eps, across == 1
            judged.verdict[zone] = KEPT
            if abs(pulses.gap[i]) <= eps:
                judged.verdict[zone] = SELF
            elif front >= 0 and not two_sided:
                behind = max(hulls.least[front, across], hulls.base[front, across] + sigmas)
                if pulses.front_gap[i] < -behind:
                    judged.verdict[zone] = BEHIND


@compiled
def _sorted_reports(
    length: NDArray[np.float32],
    link: NDArray[np.int16],
    report: NDArray[np.float32],
    rays: NDArray[np.uint8],
) -> tuple[Array, NDArray[np.int16], NDArray[np.int64]]:
    """What a sensor would report of each of its rays that met a body, near to far: distance (n, R)
    [m], link (n, R) and how many there are (n,), of `rays` (n,) of each zone."""
    out, who = np.empty(length.shape), np.empty(length.shape, dtype=np.int16)
    count = np.zeros(len(length), dtype=np.int64)
    for zone in range(len(length)):
        seen = 0
        for ray in range(rays[zone]):
            if link[zone, ray] < 0:
                continue
            d = length[zone, ray] * report[zone, ray]
            at = seen
            while at > 0 and out[zone, at - 1] > d:
                out[zone, at], who[zone, at] = out[zone, at - 1], who[zone, at - 1]
                at -= 1
            out[zone, at], who[zone, at] = d, link[zone, ray]
            seen += 1
        count[zone] = seen
    return out, who, count


@compiled
def _pulses(
    reported: Array,
    distance: Array,
    link: NDArray[np.int16],
    count: NDArray[np.int64],
    rays: NDArray[np.uint8],
    pulse: Array,
) -> Pulses:
    """Gather the sorted returns of a sensor's zones into pulses; pulse: (2,) of its type."""
    n = len(reported)
    out = Pulses(
        np.full(n, np.inf), np.full(n, -1, dtype=np.int16), np.full(n, np.inf),
        np.full(n, -1, dtype=np.int16), np.zeros(n, dtype=np.int64),
    )  # fmt: skip
    for zone in range(n):
        first = 0
        while first < count[zone]:
            nearest = distance[zone, first]
            farthest = nearest + pulse_of(pulse[0], pulse[1], nearest)
            total, end = 0.0, first
            while end < count[zone] and distance[zone, end] <= farthest:
                total += distance[zone, end]
                end += 1
            gap = total / (end - first) - reported[zone]
            if first == 0:
                out.front_gap[zone], out.front_link[zone] = gap, link[zone, 0]
                out.across[zone] = 1 if end < rays[zone] else 0
            if abs(gap) < abs(out.gap[zone]):  # this group explains the measurement best
                out.gap[zone], out.link[zone] = gap, link[zone, first]
            first = end
    return out
