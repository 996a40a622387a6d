"""Where the rays of the simulated sensors are, and what a zone reports in an ideal world.

In an ideal world a zone is what the self filter takes it for: the same few rays, merged by the
same rule. `app.sensing.response` has the zone of a real sensor.
"""

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
    """The rays of all K sensors with Z zones, n of them, in the frames of their links.

    link:  (K,) int64.   lens: (K, 3) [m].
    zone:  (K + 1,) int64: zones zone[k] to zone[k + 1] are those of sensor k.
    axis:  (Z, 3) unit, of each zone.   half_angle: (Z,) [rad] of the cone round it that holds
           the zone's rays.   ray: (Z + 1,) int64: rays ray[z] to ray[z + 1] are those of zone z.
    direction: (n, 3) unit.   weight: (n,) solid angle, those of a zone add up to 1.
    report: (n,) reported distance per metre: its cosine to the sensor's axis or 1.
    separate: (K,) [m] a second target this far behind the first is told apart.   pulse: (K, 2),
           see `app.robot.traits.Traits`.
    """

    link: NDArray[np.int64]
    lens: Array
    zone: NDArray[np.int64]
    axis: Array
    half_angle: Array
    ray: NDArray[np.int64]
    direction: Array
    weight: Array
    report: Array
    separate: Array
    pulse: Array


@compiled
def rays_in_base(
    fan: Fan, own: Hits, sensors: NDArray[np.int64], T_base_link: Array
) -> tuple[Beams, Hits]:
    """The rays of `sensors` (m,) in the base frame, a bundle a zone, and their `own` hits.

    T_base_link: (L, 4, 4).   own: of all rays of the fan.
    """
    zones, rays = 0, 0
    for k in sensors:
        zones += fan.zone[k + 1] - fan.zone[k]
        rays += fan.ray[fan.zone[k + 1]] - fan.ray[fan.zone[k]]
    first = np.zeros(zones + 1, dtype=np.int64)
    origin, axis, half_angle = np.empty((zones, 3)), np.empty((zones, 3)), np.empty(zones)
    direction = np.empty((rays, 3))
    hits = Hits(
        np.empty(rays, dtype=np.float32), np.empty(rays, dtype=np.int16),
        np.empty(rays, dtype=np.int16), np.empty(rays, dtype=np.float32),
    )  # fmt: skip
    b, n = 0, 0
    for k in sensors:
        T, lens = T_base_link[fan.link[k]], fan.lens[k]
        for z in range(fan.zone[k], fan.zone[k + 1]):
            half_angle[b] = fan.half_angle[z]
            for i in range(3):
                origin[b, i] = T[i, 3] + T[i, 0] * lens[0] + T[i, 1] * lens[1] + T[i, 2] * lens[2]
            _turn(T, fan.axis[z], axis[b])
            for r in range(fan.ray[z], fan.ray[z + 1]):
                _turn(T, fan.direction[r], direction[n])
                hits.length[n], hits.label[n] = own.length[r], own.label[r]
                hits.body[n], hits.cosine[n] = own.body[r], own.cosine[r]
                n += 1
            b += 1
            first[b] = n
    return Beams(origin, axis, half_angle, first, direction), hits


@compiled
def _turn(T: Array, v: Array, out: Array) -> None:
    for i in range(3):
        out[i] = T[i, 0] * v[0] + T[i, 1] * v[1] + T[i, 2] * v[2]


def no_reading(zones: int) -> Reading:
    """Of so many zones in which nothing is."""
    return Reading(
        np.full(zones, np.inf), np.zeros(zones, dtype=np.bool_),
        np.full(zones, NOTHING, dtype=np.int16), np.ones(zones, dtype=np.bool_),
        np.full(zones, np.nan),
    )  # fmt: skip


@compiled
def merge_rays(sensors: NDArray[np.int64], hits: Hits, fan: Fan, reading: Reading) -> None:
    """Merge the rays of each zone of `sensors` (m,) as the self filter does.

    hits: of all their rays, sensor by sensor.   reading: of all their zones likewise, is written.
    """
    ray, zone = 0, 0
    for k in sensors:
        for z in range(fan.zone[k], fan.zone[k + 1]):
            _merge(k, z, ray, zone, hits, fan, reading)
            ray, zone = ray + fan.ray[z + 1] - fan.ray[z], zone + 1


@compiled
def _merge(k: int, z: int, begin: int, zone: int, hits: Hits, fan: Fan, reading: Reading) -> None:
    """Zone z of sensor k, the reading's `zone`; its rays are those of `hits` from `begin` on."""
    report = fan.report[fan.ray[z] : fan.ray[z + 1]]
    least, nearest = np.inf, 0
    for i in range(len(report)):
        reading.pure[zone] &= hits.label[begin + i] == hits.label[begin]
        d = hits.length[begin + i] * report[i]
        if hits.label[begin + i] != NOTHING and d < least:
            least, nearest = d, i
    reading.label[zone] = hits.label[begin + nearest]
    if least == np.inf:
        return
    total, count = 0.0, 0
    pulse = least + pulse_of(fan.pulse[k, 0], fan.pulse[k, 1], least)
    for i in range(len(report)):
        d = hits.length[begin + i] * report[i]
        if hits.label[begin + i] == NOTHING:
            continue
        if d <= pulse:
            total += d
            count += 1
        elif d < least + fan.separate[k]:
            reading.merged[zone] = True
    reading.depth[zone] = total / count
