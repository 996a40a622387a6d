r"""What a zone of a real sensor reports: the first strong pulse of what comes back from all of it.

The zone is integrated over its solid angle. Of a surface of reflectance rho, met at a distance r
under an angle a by a ray that stands for a share w of the zone, comes back

    s = w rho cos(a) / r^2

which is the law of a diffuse surface that is larger than its share of the zone. The sensor sees
these returns spread in time by the width of its pulse. Two equal Gaussian pulses are told apart
when they lie four standard deviations apart (between them the sum then falls to a quarter of the
peaks); the maker says from which distance on his sensor tells two targets apart, so

    sigma = separate / 4

The first return at which the light within such a pulse reaches a `SHARE` of all the light of the
zone begins the target, a weaker one before it goes unnoticed. The distance is the mean of the
returns weighted with the light and with the pulse: a slanted surface is met about in its middle,
and two surfaces nearer to each other than a pulse is wide are reported somewhere between them. What
lies behind within `separate` is hidden; where it is strong, the status says so.

A dirty window sends light back too, at its own distance. The sensor does not take it for a
target, but near ones are drawn towards it.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.raycast import Hits
from app.sensing.error_model import Reading
from app.sensing.zones import NOTHING, Fan

SHARE = 0.1  # of a zone's light that makes a target


class Surfaces(NamedTuple):
    """What sends light back.

    links: (L,), bodies: (B,) reflectance of the arm's links and of the world's bodies.
    smudge: (Z,) [1/m^2] light of each zone's window: s of the formula.   window: (K,) [m] where
    it is, as a reported distance.
    """

    links: Array
    bodies: Array
    smudge: Array
    window: Array


@compiled
def first_pulses(
    sensors: NDArray[np.int64], hits: Hits, fan: Fan, surfaces: Surfaces, reading: Reading
) -> None:
    """What the zones of `sensors` (m,) report.

    hits: of all their rays, sensor by sensor.   reading: of all their zones likewise, is written.
    """
    most = 0
    for z in range(len(fan.ray) - 1):
        most = max(most, fan.ray[z + 1] - fan.ray[z])
    returns = np.empty((most, 3))
    order, who = np.empty(most, dtype=np.int64), np.empty(most, dtype=np.int16)
    begin, zone = 0, 0
    for k in sensors:
        for z in range(fan.zone[k], fan.zone[k + 1]):
            rays = fan.ray[z + 1] - fan.ray[z]
            found = 0
            for i in range(rays):
                n, r = begin + i, fan.ray[z] + i
                reading.pure[zone] &= hits.label[n] == hits.label[begin]
                label = hits.label[n]
                if label == NOTHING:
                    continue
                rho = surfaces.links[label] if label >= 0 else surfaces.bodies[hits.body[n]]
                seen = fan.weight[r] * rho * hits.cosine[n]
                returns[found, 0] = hits.length[n] * fan.report[r]
                returns[found, 1] = seen / max(hits.length[n], 0.001) ** 2
                returns[found, 2] = seen
                order[found], who[found] = found, label
                found += 1
            _sort(returns, order, found)
            glare = surfaces.smudge[z], surfaces.window[k]
            _pulse(returns, order[:found], who, fan.separate[k], glare, zone, reading)
            begin, zone = begin + rays, zone + 1


@compiled
def _sort(returns: Array, order: NDArray[np.int64], n: int) -> None:
    """Put the first n of `order` in the order of the returns' distances."""
    for i in range(1, n):
        one, j = order[i], i
        while j > 0 and returns[order[j - 1], 0] > returns[one, 0]:
            order[j] = order[j - 1]
            j -= 1
        order[j] = one


@compiled
def _pulse(
    returns: Array,
    order: NDArray[np.int64],
    who: NDArray[np.int16],
    separate: float,
    glare: tuple[float, float],
    zone: int,
    reading: Reading,
) -> None:
    """The first strong pulse of sorted returns (n, 3): distance, light, reflectance seen.

    who: (n,) label of each.   glare: light of the window and where it is.
    """
    total, sigma = 0.0, 0.25 * separate
    for i in order:
        total += returns[i, 1]
    for a in range(len(order)):
        at = returns[order[a], 0]
        light, moment, bright, hidden, strongest = 0.0, 0.0, 0.0, 0.0, 0.0
        for i in order[a:]:
            d, s, seen = returns[i, 0], returns[i, 1], returns[i, 2]
            if d >= at + separate:
                break
            share = np.exp(-0.5 * ((d - at) / sigma) ** 2)
            light += share * s
            moment += share * s * d
            bright += share * seen
            hidden += (1.0 - share) * s
            if share * s > strongest:
                strongest = share * s
                reading.label[zone] = who[i]
        if light < SHARE * total:
            continue
        share = glare[0] * np.exp(-0.5 * ((at - glare[1]) / sigma) ** 2)
        reading.depth[zone] = (moment + share * glare[1]) / (light + share)
        reading.bright[zone] = bright
        reading.merged[zone] = hidden > SHARE * total
        return
