"""The compiled parts of the simulated sensors: where their rays are, and what a zone reports."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.raycast import Beams, Hits
from app.robot.traits import pulse_of
from app.sensing.error_model import Reading

NOTHING = -2  # label of a ray that ends in the air, beside the links' own and WORLD


class Fan(NamedTuple):
    """The sub-rays of all K sensors in the frames of their links, sensor by sensor.

    link:   (K,) int64.   lens: (K, 3) [m].   axis: (K, 3) unit.   half_angle: (K,) [rad] round it.
    first:  (K + 1,) int64: rays first[k] to first[k + 1] are those of sensor k, zone by zone.
    zone:   (K + 1,) int64: likewise its zones.
    direction: (n, 3) unit.   report: (n,) reported distance per metre: its cosine to the axis or 1.
    separate: (K,) [m] a second target this far behind the first is told apart.   pulse: (K, 2), see
            `app.robot.traits.Traits`.
    """

    link: NDArray[np.int64]
    lens: Array
    axis: Array
    half_angle: Array
    first: NDArray[np.int64]
    zone: NDArray[np.int64]
    direction: Array
    report: Array
    separate: Array
    pulse: Array


@compiled
def rays_in_base(
    fan: Fan, own: Hits, sensors: NDArray[np.int64], T_base_link: Array
) -> tuple[Beams, Hits]:
    """The rays of `sensors` (m,) in the base frame and their `own` hits.

    T_base_link: (L, 4, 4).   own: of all rays of the fan.
    """
    m = len(sensors)
    first = np.zeros(m + 1, dtype=np.int64)
    for b in range(m):
        first[b + 1] = first[b] + fan.first[sensors[b] + 1] - fan.first[sensors[b]]
    origin, axis, half_angle = np.empty((m, 3)), np.empty((m, 3)), np.empty(m)
    direction = np.empty((first[m], 3))
    length, label = np.empty(first[m], dtype=np.float32), np.empty(first[m], dtype=np.int16)
    for b in range(m):
        k = sensors[b]
        T = T_base_link[fan.link[k]]
        half_angle[b] = fan.half_angle[k]
        for i in range(3):
            lens, way = fan.lens[k], fan.axis[k]
            origin[b, i] = T[i, 3] + T[i, 0] * lens[0] + T[i, 1] * lens[1] + T[i, 2] * lens[2]
            axis[b, i] = T[i, 0] * way[0] + T[i, 1] * way[1] + T[i, 2] * way[2]
        r = fan.first[k]
        for n in range(first[b], first[b + 1]):
            d = fan.direction[r]
            for i in range(3):
                direction[n, i] = T[i, 0] * d[0] + T[i, 1] * d[1] + T[i, 2] * d[2]
            length[n], label[n] = own.length[r], own.label[r]
            r += 1
    return Beams(origin, axis, half_angle, first, direction), Hits(length, label)


def no_reading(zones: int) -> Reading:
    """Of so many zones in which nothing is."""
    return Reading(
        np.full(zones, np.inf), np.zeros(zones, dtype=np.bool_),
        np.full(zones, NOTHING, dtype=np.int16), np.ones(zones, dtype=np.bool_),
    )  # fmt: skip


@compiled
def merge_rays(sensors: NDArray[np.int64], hits: Hits, fan: Fan, reading: Reading) -> None:
    """Merge the rays of each zone of `sensors` (m,) as their pulse detection does.

    hits: of all their rays, sensor by sensor.   reading: of all their zones likewise, is written.
    """
    ray, zone = 0, 0
    for k in sensors:
        zones = fan.zone[k + 1] - fan.zone[k]
        _merge_rays(k, ray, hits, fan, _part(reading, zone, zone + zones))
        ray, zone = ray + fan.first[k + 1] - fan.first[k], zone + zones


@compiled
def _part(reading: Reading, a: int, b: int) -> Reading:
    return Reading(reading.depth[a:b], reading.merged[a:b], reading.label[a:b], reading.pure[a:b])


@compiled
def _merge_rays(k: int, first: int, hits: Hits, fan: Fan, reading: Reading) -> None:
    """The zones of sensor k; its rays are those of `hits` from `first` on."""
    ray = fan.first[k]  # the same as first, but in the fan
    sub = (fan.first[k + 1] - ray) // len(reading.depth)
    for zone in range(len(reading.depth)):
        begin = first + zone * sub
        report = fan.report[ray + zone * sub : ray + (zone + 1) * sub]
        least, nearest = np.inf, 0
        for i in range(sub):
            reading.pure[zone] &= hits.label[begin + i] == hits.label[begin]
            d = hits.length[begin + i] * report[i]
            if hits.label[begin + i] != NOTHING and d < least:
                least, nearest = d, i
        reading.label[zone] = hits.label[begin + nearest]
        if least == np.inf:
            continue
        total, count = 0.0, 0
        pulse = least + pulse_of(fan.pulse[k, 0], fan.pulse[k, 1], least)
        for i in range(sub):
            d = hits.length[begin + i] * report[i]
            if hits.label[begin + i] == NOTHING:
                continue
            if d <= pulse:
                total += d
                count += 1
            elif d < least + fan.separate[k]:
                reading.merged[zone] = True
        reading.depth[zone] = total / count
