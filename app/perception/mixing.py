"""How near a zone can report the body, where parts of it lie at several distances.

What comes back within a pulse of the nearest part is reported as one target, at the mean of all of
it (UM3109: two targets that are nearer to each other than 60 cm merge). So a near part that fills
little of the zone draws the report little: a corner of it makes no return of its own. The least
that a zone can report is the mean of where its rays meet the body,

    sum(w d) / sum(w)      w = B a f(d) / d^2

with a the part of the zone that a ray stands for, f = (1 - (d - nearest) / merge)^3 for the share
of what lies behind that comes within the pulse, and B = `BRIGHTER` for what is nearer than that
mean, 1 for the rest: nobody knows how bright the parts are. The zone may look aside, so the mean is
taken where it is believed to look, and aside to all corners of the rays' spread; the least counts.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

BRIGHTER = 2.0  # times that the near parts of the body may send back more light than the far ones
SAME = 1e-4  # [m] means that differ by less
CORNERS = np.array([[0.0, 0.0], [-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]])


@compiled
def least_report(
    distance: NDArray[np.float32], offset: Array, wide: float, merge: float, enough: float
) -> float:
    """[m] the least that a zone may report of the body, or anything up to `enough` [m] if that
    can be reported; +inf where no ray meets the body.

    distance: (R,) [m] where the rays meet the body, +inf where they miss it.   offset: (R, 2) of
    the rays, an even grid.   wide: times that, in half widths of the zone.   merge: [m] see above.
    """
    nearest, rays = distance.min(), len(distance)
    half, aside = wide / (np.sqrt(rays) - 1.0), wide - 1.0  # half of what a ray stands for
    light, part, least = np.empty(rays), np.empty(rays), np.inf
    for i in range(rays):
        d = distance[i]
        within = max(1.0 - (d - nearest) / merge, 0.0) if d < np.inf else 0.0
        light[i] = within * within * within / max(d, 0.01) ** 2
    for c in range(len(CORNERS)):
        x, y = aside * CORNERS[c, 0], aside * CORNERS[c, 1]
        for i in range(rays):
            part[i] = light[i]
            if light[i] > 0.0:
                part[i] *= _within(wide * offset[i, 0], half, x)
                part[i] *= _within(wide * offset[i, 1], half, y)
        least = min(least, _least_mean(distance, part, enough))
        if least <= enough:
            break
    return least


@compiled
def _within(at: float, half: float, middle: float) -> float:
    """How much of at - half .. at + half lies in the zone, 1 to both sides of its middle."""
    low, high = max(at - half, middle - 1.0), min(at + half, middle + 1.0)
    return max(high - low, 0.0)


@compiled
def _least_mean(distance: NDArray[np.float32], light: Array, enough: float) -> float:
    """The mean [m] of distances (R,) weighted with their light (R,), where what is nearer than the
    mean is the brighter; +inf without light. What is up to `enough` [m] need not be the least."""
    before, mean = np.inf, np.inf
    while True:
        weight, moment = 0.0, 0.0
        for i in range(len(distance)):
            if light[i] > 0.0:
                w = BRIGHTER * light[i] if distance[i] < before else light[i]
                weight += w
                moment += w * distance[i]
        if weight == 0.0:
            return np.inf
        mean = moment / weight
        if mean <= enough or before - mean < SAME:
            return mean
        before = mean
