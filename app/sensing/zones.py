"""The compiled parts of the simulated sensors: where their rays are, and what a zone reports."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.raycast import Beams, Hits
from app.robot.skin import PULSE, PULSE_SHARE
from app.sensing.error_model import MERGE_DEPTH

NOTHING = -2  # label of a ray that ends in the air, beside the links' own and WORLD


class Fan(NamedTuple):
    """The sub-rays of all K sensors in the frames of their links, sensor by sensor.

    link:   (K,) int64.   lens: (K, 3) [m].   axis: (K, 3) unit.   half_angle: [rad] round it.
    first:  (K + 1,) int64: rays first[k] to first[k + 1] are those of sensor k.
    direction: (n, 3) unit.   cosine: (n,) to the axis.
    """

    link: NDArray[np.int64]
    lens: Array
    axis: Array
    half_angle: float
    first: NDArray[np.int64]
    direction: Array
    cosine: Array


@compiled
def rays_in_base(
    fan: Fan, own: Hits, sensors: NDArray[np.int64], T_base_link: Array
) -> tuple[Beams, Hits, Array]:
    """The rays of `sensors` (m,) in the base frame, their `own` hits and their cosines.

    T_base_link: (L, 4, 4).   own: of all rays of the fan.
    """
    m = len(sensors)
    first = np.zeros(m + 1, dtype=np.int64)
    for b in range(m):
        first[b + 1] = first[b] + fan.first[sensors[b] + 1] - fan.first[sensors[b]]
    origin, axis = np.empty((m, 3)), np.empty((m, 3))
    direction, cosine = np.empty((first[m], 3)), np.empty(first[m])
    length, label = np.empty(first[m], dtype=np.float32), np.empty(first[m], dtype=np.int16)
    for b in range(m):
        k = sensors[b]
        T = T_base_link[fan.link[k]]
        for i in range(3):
            lens, way = fan.lens[k], fan.axis[k]
            origin[b, i] = T[i, 3] + T[i, 0] * lens[0] + T[i, 1] * lens[1] + T[i, 2] * lens[2]
            axis[b, i] = T[i, 0] * way[0] + T[i, 1] * way[1] + T[i, 2] * way[2]
        r = fan.first[k]
        for n in range(first[b], first[b + 1]):
            d = fan.direction[r]
            for i in range(3):
                direction[n, i] = T[i, 0] * d[0] + T[i, 1] * d[1] + T[i, 2] * d[2]
            cosine[n], length[n], label[n] = fan.cosine[r], own.length[r], own.label[r]
            r += 1
    return Beams(origin, axis, fan.half_angle, first, direction), Hits(length, label), cosine


@compiled
def merge_rays(
    first: NDArray[np.int64],
    hits: Hits,
    cosine: Array,
    sub: int,
    depth: Array,
    merged: NDArray[np.bool_],
    label: NDArray[np.int16],
    pure: NDArray[np.bool_],
) -> None:
    """Merge the `sub` rays of each zone as the sensor's pulse detection does.

    Rays first[b] to first[b + 1] are those of sensor b, zone by zone; cosine (n,) to its axis.
    Writes depth, merged, label and pure (m, 64), each row as in `Reading`.
    """
    for b in range(len(depth)):
        depth[b], merged[b], label[b], pure[b] = np.inf, False, NOTHING, True
        for zone in range((first[b + 1] - first[b]) // sub):
            begin = first[b] + zone * sub
            least, nearest = np.inf, begin
            for i in range(begin, begin + sub):
                pure[b, zone] &= hits.label[i] == hits.label[begin]
                d = hits.length[i] * cosine[i]
                if hits.label[i] != NOTHING and d < least:
                    least, nearest = d, i
            label[b, zone] = hits.label[nearest]
            if least == np.inf:
                continue
            total, count = 0.0, 0
            pulse = least + max(PULSE, PULSE_SHARE * least)
            for i in range(begin, begin + sub):
                d = hits.length[i] * cosine[i]
                if hits.label[i] == NOTHING:
                    continue
                if d <= pulse:
                    total += d
                    count += 1
                elif d < least + MERGE_DEPTH:
                    merged[b, zone] = True
            depth[b, zone] = total / count
