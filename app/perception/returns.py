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


class Reports(NamedTuple):
    """What a sensor of up to n zones would report of each ray that met a body, near to far:
    distance (n, R) [m], link (n, R), and how many there are, seen (n,)."""

    distance: Array
    link: NDArray[np.int16]
    seen: NDArray[np.int64]


class Pulses(NamedTuple):
    """What those reports come to: gap (n,) [m] and link (n,) of the group that explains the
    measurement best and of the nearest one, +inf and -1 without any; across (n,): 1 over an edge,
    else 0."""

    gap: Array
    link: NDArray[np.int16]
    front_gap: Array
    front_link: NDArray[np.int16]
    across: NDArray[np.int64]


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
    returns = _nearest_hits(sensors, fan.first, own, casts, judged.rays)
    most = np.diff(fan.first).max()
    reports, pulses = _no_reports(most, own.link.shape[1]), _no_pulses(most)
    for k in sensors:
        mine = slice(fan.first[k], fan.first[k + 1])
        z, rays, noise = reported[mine], judged.rays[mine], fan.noise[k]
        _sort(returns.length[mine], returns.link[mine], fan.report[mine], rays, reports)
        _gather(z, rays, fan.pulse[k], reports, pulses)
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
def _nearest_hits(
    sensors: NDArray[np.intp],
    first: NDArray[np.int64],
    own: Returns,
    casts: Casts,
    rays: NDArray[np.uint8],
) -> Returns:
    """Where the `rays` (S,) of each zone of `sensors` end: on what is fixed to the sensor or on
    what was cast at. Others are not set.   first: (K + 1,) zones of each sensor.
    """
    out = Returns(np.empty_like(own.length), np.empty_like(own.link))
    for k in sensors:
        for zone in range(first[k], first[k + 1]):
            for ray in range(rays[zone]):
                out.length[zone, ray] = own.length[zone, ray]
                out.link[zone, ray] = own.link[zone, ray]
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
def _no_reports(zones: int, rays: int) -> Reports:
    return Reports(
        np.empty((zones, rays)), np.empty((zones, rays), dtype=np.int16),
        np.empty(zones, dtype=np.int64),
    )  # fmt: skip


@compiled
def _no_pulses(zones: int) -> Pulses:
    return Pulses(
        np.empty(zones), np.empty(zones, dtype=np.int16), np.empty(zones),
        np.empty(zones, dtype=np.int16), np.empty(zones, dtype=np.int64),
    )  # fmt: skip


@compiled
def _sort(
    length: NDArray[np.float32],
    link: NDArray[np.int16],
    report: NDArray[np.float32],
    rays: NDArray[np.uint8],
    out: Reports,
) -> None:
    """Write the reports of a sensor's zones, whose `rays` (n,) end at `length` (n, R) [m] on `link`
    (n, R); report: (n, R) reported distance per metre."""
    for zone in range(len(length)):
        seen = 0
        for ray in range(rays[zone]):
            if link[zone, ray] < 0:
                continue
            d = length[zone, ray] * report[zone, ray]
            at = seen
            while at > 0 and out.distance[zone, at - 1] > d:
                out.distance[zone, at] = out.distance[zone, at - 1]
                out.link[zone, at] = out.link[zone, at - 1]
                at -= 1
            out.distance[zone, at], out.link[zone, at] = d, link[zone, ray]
            seen += 1
        out.seen[zone] = seen


@compiled
def _gather(
    reported: Array, rays: NDArray[np.uint8], pulse: Array, reports: Reports, out: Pulses
) -> None:
    """Gather the sorted reports of a sensor's zones into pulses; pulse: (2,) of its type."""
    for zone in range(len(reported)):
        gap, link = np.inf, np.int16(-1)
        out.front_gap[zone], out.front_link[zone], out.across[zone] = np.inf, -1, 0
        first, count = 0, reports.seen[zone]
        while first < count:
            nearest = reports.distance[zone, first]
            farthest = nearest + pulse_of(pulse[0], pulse[1], nearest)
            total, end = 0.0, first
            while end < count and reports.distance[zone, end] <= farthest:
                total += reports.distance[zone, end]
                end += 1
            g = total / (end - first) - reported[zone]
            if first == 0:
                out.front_gap[zone], out.front_link[zone] = g, reports.link[zone, 0]
                out.across[zone] = 1 if end < rays[zone] else 0
            if abs(g) < abs(gap):  # this group explains the measurement best
                gap, link = g, reports.link[zone, first]
            first = end
        out.gap[zone], out.link[zone] = gap, link
