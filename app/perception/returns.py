"""What the robot's own body would return to each zone, and whether that explains a measurement.

A zone whose rays meet the body at distances d_i may see it anywhere from the nearest of them to
`DEPTH` behind each, whatever share of its light comes from where:

    outside = the least by which the report lies before or behind one of [d_i, d_i + DEPTH]

outside <= eps: the zone saw the robot, unless so little of it lies there that the zone cannot
report it so near (see `app.perception.mixing`). If the report lies farther behind what its middle
meets, the point is where nothing can be seen. eps follows from what is known of the sensor (see
`app.perception.uncertainty`), or from what was measured of the link:

    eps = max(CALIBRATED, measured + sigmas * noise(reported))
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.casting import DEPTH, Aims, Casts, Hulls
from app.perception.footprint import Fan
from app.perception.mixing import least_report
from app.perception.rules import Rules
from app.perception.uncertainty import Known
from app.robot.traits import noise_of, pulse_of

KEPT, SELF, BEHIND = int(Verdict.KEPT), int(Verdict.SELF), int(Verdict.BEHIND)
CALIBRATED = 1e-3  # [m] smallest threshold of a link with one of its own: meshes are no better


class Judgement(NamedTuple):
    """What became of S zones.

    verdict: KEPT, SELF or BEHIND.   link: in the zone's way, or -1.
    gap:     [m] from the report to the d_i that explains it best, or to the least that the zone can
             report, positive where the report lies before it; +inf where no body is in the way.
    eps:     [m] threshold.   edge: the zone lies across an edge of what is in its way.
    aims:    how the zones were looked at.
    """

    verdict: NDArray[np.uint8]
    link: NDArray[np.int16]
    gap: Array
    eps: Array
    edge: NDArray[np.bool_]
    aims: Aims


class Returns(NamedTuple):
    """Where the rays of S zones end on the body: distance (S, R) [m] as it would be reported, and
    link (S, R), -1 for none."""

    distance: NDArray[np.float32]
    link: NDArray[np.int16]


@compiled
def take_own(
    sensors: NDArray[np.intp], fan: Fan, aims: Aims, own: Returns, returns: Returns
) -> None:
    """Let the rays that are now to be cast end where they end on what is fixed to their sensor."""
    for k in sensors:
        for zone in range(fan.first[k], fan.first[k + 1]):
            for ray in range(aims.done[zone], aims.rays[zone]):
                returns.distance[zone, ray] = own.distance[zone, ray]
                returns.link[zone, ray] = own.link[zone, ray]


@compiled
def take_hits(
    sensor_of: NDArray[np.int64], fan: Fan, aims: Aims, casts: Casts, returns: Returns
) -> None:
    """Let rays end where they were found to end, if that is nearer."""
    begin, R = 0, fan.offset.shape[1]
    for body in range(len(casts.end)):
        for n in range(begin, casts.end[body]):
            t = casts.hit[n]
            if t == np.inf:
                continue
            zone, ray = casts.zone_ray[n] // R, casts.zone_ray[n] % R
            k = sensor_of[zone]
            if not fan.radial[k]:  # by the length of a direction of unit depth
                a = aims.spread[zone] * fan.offset[k, ray, 0]
                b = aims.spread[zone] * fan.offset[k, ray, 1]
                square = 0.0
                for i in range(3):
                    c = fan.centre[zone, i] + a * fan.across[zone, i] + b * fan.down[zone, i]
                    square += c * c
                t /= np.sqrt(square)
            if t < returns.distance[zone, ray]:
                returns.distance[zone, ray], returns.link[zone, ray] = t, body
        begin = casts.end[body]


@compiled
def take_judgement(
    sensors: NDArray[np.intp], first: NDArray[np.int64], reported: Array, coming: Judgement,
    distance: Array, judged: Judgement,
) -> None:  # fmt: skip
    """Write the rows of `sensors` (m,) of the distances `reported` (S,) [m] and their judgement to
    `distance` and `judged`."""
    for k in sensors:
        for zone in range(first[k], first[k + 1]):
            distance[zone] = reported[zone]
            judged.verdict[zone], judged.link[zone] = coming.verdict[zone], coming.link[zone]
            judged.gap[zone], judged.eps[zone] = coming.gap[zone], coming.eps[zone]
            judged.edge[zone], judged.aims.done[zone] = coming.edge[zone], coming.aims.done[zone]
            judged.aims.rays[zone] = coming.aims.rays[zone]
            judged.aims.spread[zone] = coming.aims.spread[zone]
            judged.aims.eps[zone] = coming.aims.eps[zone]


@compiled
def explain_returns(
    sensors: NDArray[np.intp],
    reported: Array,
    rules: Rules,
    fan: Fan,
    known: Known,
    hulls: Hulls,
    returns: Returns,
    judged: Judgement,
) -> None:
    """Judge the zones of `sensors` (m,), which `reported` (S,) [m], by what their rays met; rows of
    `judged` are written where there are new rays. What some rays of a first look explain is KEPT
    until all are cast."""
    depth = DEPTH if rules.footprint else 0.0
    first = np.searchsorted(known.sensor_of, sensors)
    last = np.searchsorted(known.sensor_of, sensors, side="right")
    for m in range(len(sensors)):
        k = sensors[m]
        floor, share, least, more = (
            known.noise[k, 0], known.noise[k, 1], known.pulse[k, 0], known.pulse[k, 1],
        )  # fmt: skip
        for zone in range(first[m], last[m]):
            rays, z = judged.aims.rays[zone], reported[zone]
            if judged.aims.done[zone] == rays:
                continue
            gap, outside, link, across = _nearest(rays, z, depth, least, more, returns, zone)
            eps = judged.aims.eps[zone]
            if link >= 0 and not np.isnan(hulls.measured[link, across]):
                noise = known.sigmas[0] * noise_of(floor, share, z)
                eps = max(CALIBRATED, hulls.measured[link, across] + noise)
            judged.gap[zone], judged.link[zone] = gap, link
            judged.eps[zone], judged.edge[zone] = eps, across == 1
            judged.verdict[zone] = KEPT
            if outside <= eps:
                judged.verdict[zone] = SELF
                if rays > 1 and abs(returns.distance[zone, 0] - z) > eps:
                    _doubt_sides(k, zone, z, fan, known, returns, judged)
            elif not rules.two_sided and returns.distance[zone, 0] + depth < z:
                judged.verdict[zone] = BEHIND


@compiled
def _doubt_sides(
    k: int, zone: int, z: float, fan: Fan, known: Known, returns: Returns, judged: Judgement
) -> None:
    """Turn SELF into KEPT where a zone of sensor k that reports z [m] cannot report the body so
    near, or where not all of its rays have been cast yet."""
    rays, farthest = judged.aims.rays[zone], 0.0
    for ray in range(rays):
        if returns.distance[zone, ray] < np.inf:
            farthest = max(farthest, returns.distance[zone, ray])
    if z + judged.eps[zone] >= farthest:
        return  # no mean is farther
    if rays < fan.looks[k, 1]:
        judged.verdict[zone] = KEPT
        return
    least = least_report(
        returns.distance[zone, :rays], fan.offset[k, :rays], judged.aims.spread[zone],
        known.merge[k], z + judged.eps[zone],
    )  # fmt: skip
    if least > z + judged.eps[zone]:
        judged.verdict[zone], judged.gap[zone] = KEPT, least - z


@compiled
def _nearest(
    rays: int, z: float, depth: float, least: float, more: float, returns: Returns, zone: int
) -> tuple[float, float, int, int]:
    """Gap [m] of a zone that reports z, by how much it is outside [m], the link that the gap is to,
    -1 for none, and 1 if the zone lies across an edge: not all of its `rays` end within one pulse,
    which is max(least, more * d)."""
    gap, best, link, front = np.inf, np.inf, -1, np.inf
    for ray in range(rays):
        d = returns.distance[zone, ray]
        if d == np.inf:
            continue
        front = min(front, d)
        outside = max(d - z, z - d - depth, 0.0)
        if outside < best or (outside == best and abs(d - z) < abs(gap)):
            gap, best, link = d - z, outside, returns.link[zone, ray]
    across = 0
    farthest = front + pulse_of(least, more, front)
    for ray in range(rays):
        if not returns.distance[zone, ray] <= farthest:
            across = 1
    return gap, best, link, across if link >= 0 else 0
