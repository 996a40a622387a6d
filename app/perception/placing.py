"""Where each zone's point is, and the sensor's own word on it; the compiled part of the cloud."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.robot.traits import NOTHING, TRUSTED

BAD_STATUS, NO_TARGET, OUT_OF_RANGE = (
    int(v) for v in (Verdict.BAD_STATUS, Verdict.NO_TARGET, Verdict.OUT_OF_RANGE)
)


class Reports(NamedTuple):
    """What the sensors have reported, zone by zone (S,): distance [m], status, targets."""

    distance: Array
    status: NDArray[np.uint8]
    targets: NDArray[np.uint8]


class Lenses(NamedTuple):
    """Where K sensors and their S zones look, as in `app.robot.skin.Skin`, and what their types
    believe, as in `app.robot.traits.Traits`."""

    first: NDArray[np.int64]
    link: NDArray[np.int64]
    origin: Array
    reach: Array
    limits: Array
    worth: NDArray[np.uint8]


@compiled
def place_points(
    sensors: NDArray[np.intp],
    T_base_link: Array,
    reports: Reports,
    lenses: Lenses,
    verdict: NDArray[np.uint8],
    points: Array,
) -> None:
    """Put the zones' points of `sensors` (m,) into the base frame; the sensor's word overrules.

    p_base = T_base_link (origin + distance * reach). Changes verdict (S,) and writes points
    (S, 3), NaN where there is no target.
    """
    for k in sensors:
        T = T_base_link[lenses.link[k]]
        low, high = lenses.limits[k, 0], lenses.limits[k, 1]
        for slot in range(lenses.first[k], lenses.first[k + 1]):
            z = reports.distance[slot]
            worth = lenses.worth[k, reports.status[slot]]
            if reports.targets[slot] == 0 or worth == NOTHING:
                verdict[slot] = NO_TARGET
                for a in range(3):
                    points[slot, a] = np.nan
                continue
            if worth != TRUSTED:
                verdict[slot] = BAD_STATUS
            elif not (low <= z <= high):
                verdict[slot] = OUT_OF_RANGE
            for a in range(3):
                points[slot, a] = T[a, 3]
            for j in range(3):
                v = lenses.origin[k, j] + z * lenses.reach[slot, j]
                for a in range(3):
                    points[slot, a] += T[a, j] * v
