"""How well each pair's distance is known, and how old it is.

What a zone of the cloud has measured is known as `app.perception.uncertainty` says. A remembered
point is the mean of several in its voxel; which sensors saw it is not kept.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Cloud, JointState, Pairs, freeze
from app.perception.uncertainty import Known, pair_sigmas
from app.robot.posture import Posture

REMEMBERED = 0.006  # [m] 1 sigma of a remembered point: a zone's bias and its mounting at 0.3 m


def with_doubt(
    pairs: Pairs, cloud: Cloud, remembered: Array, posture: Posture, joints: JointState,
    known: Known,
) -> Pairs:  # fmt: skip
    """`pairs` with `sigma` and `age` at `joints`; remembered: (n,) [s] when each of the memory's
    points, which follow the cloud's, was seen."""
    sigma, age = pair_sigmas(known, pairs, posture, joints.qd), np.empty(len(pairs.slot))
    _fill(pairs.slot, known.sensor_of, cloud.stamp, remembered, joints.stamp, sigma, age)
    return replace(pairs, sigma=freeze(sigma), age=freeze(age))


@compiled
def _fill(
    slot: NDArray[np.int64], sensor_of: NDArray[np.int64], stamp: Array, remembered: Array,
    now: float, sigma: Array, age: Array,
) -> None:  # fmt: skip
    """Write the ages (B,) [s], and the sigmas (B,) [m] of what no sensor sees."""
    current = len(sensor_of)
    for i in range(len(slot)):
        if slot[i] < 0:
            sigma[i] = age[i] = np.inf
        elif slot[i] >= current:
            sigma[i], age[i] = REMEMBERED, now - remembered[slot[i] - current]
        else:
            age[i] = now - stamp[sensor_of[slot[i]]]
