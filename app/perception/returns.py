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
from app.robot.traits import Traits, noise_of, pulse_of

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
    """The groups of a zone's returns: gap [m] and link of the one that explains the measurement
    best and of the nearest one; +inf and -1 without any. across: 1 over an edge, else 0."""

    gap: float
    link: int
    front_gap: float
    front_link: int
    across: int


@compiled
def explain_returns(
    sensors: NDArray[np.intp],
    reported: Array,
    two_sided: bool,
    fan: Fan,
    hulls: Hulls,
    returns: Returns,
    judged: Judgement,
) -> None:
    """Judge the zones of `sensors` (m,) by what their rays met; their rows of `judged` are written.

    reported: (S,) [m].   two_sided: keep what lies behind the body.   judged.rays: is read.
    """
    distance = np.empty(returns.length.shape[1])
    link = np.empty(len(distance), dtype=np.int16)
    for k in sensors:
        for zone in range(fan.first[k], fan.first[k + 1]):
            rays, z = judged.rays[zone], reported[zone]
            n = _sort(zone, rays, fan, returns, distance, link)
            found = _group(k, z, distance[:n], link[:n], rays, fan.traits)
            noise = SIGMAS * noise_of(fan.traits, k, z)
            who = found.link if found.link >= 0 else fan.link[k]
            eps = _threshold(hulls, who, found.across, noise)
            judged.link[zone], judged.gap[zone] = found.link, found.gap
            judged.eps[zone], judged.edge[zone] = eps, found.across == 1
            judged.verdict[zone] = KEPT
            if abs(found.gap) <= eps:
                judged.verdict[zone] = SELF
            elif found.front_link >= 0 and not two_sided:
                front = _threshold(hulls, found.front_link, found.across, noise)
                if found.front_gap < -front:
                    judged.verdict[zone] = BEHIND


@compiled
def _threshold(hulls: Hulls, link: int, across: int, noise: float) -> float:
    return max(hulls.least[link, across], hulls.base[link, across] + noise)


@compiled
def gather_returns(
    sensors: NDArray[np.intp], fan: Fan, own: Returns, casts: Casts, returns: Returns
) -> None:
    """Write the nearest hit of each ray of `sensors`: on what is fixed to the sensor, `own`, or
    on what was cast at."""
    for k in sensors:
        first, last = fan.first[k], fan.first[k + 1]
        returns.length[first:last] = own.length[first:last]
        returns.link[first:last] = own.link[first:last]
    length, link = returns.length.ravel(), returns.link.ravel()  # views: both are contiguous
    first = 0
    for body in range(len(casts.end)):
        for n in range(first, casts.end[body]):
            if casts.hit[n] < length[casts.zone_ray[n]]:
                length[casts.zone_ray[n]] = casts.hit[n]
                link[casts.zone_ray[n]] = body
        first = casts.end[body]


@compiled
def _sort(
    zone: int, rays: int, fan: Fan, returns: Returns, distance: Array, link: NDArray[np.int16]
) -> int:
    """Write the predicted reports of a zone's rays that met a body, near to far; how many."""
    seen = 0
    for ray in range(rays):
        if returns.link[zone, ray] < 0:
            continue
        d = returns.length[zone, ray] * fan.report[zone, ray]
        at = seen
        while at > 0 and distance[at - 1] > d:
            distance[at], link[at] = distance[at - 1], link[at - 1]
            at -= 1
        distance[at], link[at] = d, returns.link[zone, ray]
        seen += 1
    return seen


@compiled
def _group(
    k: int, z: float, distance: Array, link: NDArray[np.int16], rays: int, traits: Traits
) -> Pulses:
    """Gather sorted returns (n,) of a zone that reports `z` into pulses."""
    gap, who = np.inf, -1
    front, front_link, across = np.inf, -1, 0
    first = 0
    while first < len(distance):
        farthest = distance[first] + pulse_of(traits, k, distance[first])
        total, end = 0.0, first
        while end < len(distance) and distance[end] <= farthest:
            total += distance[end]
            end += 1
        g = total / (end - first) - z
        if first == 0:
            front, front_link = g, int(link[0])
            across = 1 if end < rays else 0
        if abs(g) < abs(gap):  # this group explains the measurement best
            gap, who = g, int(link[first])
        first = end
    return Pulses(gap, who, front, front_link, across)
