"""What the types of a skin's sensors say, as kernels read it: a row of numbers a sensor."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, freeze
from app.robot.sensor_type import SensorType

REJECTED, TRUSTED, NOTHING = 0, 1, 2  # what a status is worth


class Traits(NamedTuple):
    """Of K sensors.

    noise:  (K, 2) [m], share: a distance's standard deviation is max(m, share * distance).
    pulse:  (K, 2) [m], share: returns within max(m, share * distance) are one target.
    limits: (K, 2) [m] least and most distance that is believed.
    worth:  (K, 256) of each status: REJECTED, TRUSTED or NOTHING there.
    honest: (K, 256) of each status: does the zone work?
    rate:   (K,) [Hz] frames a second.   oldest: (K,) [s] an older frame is stale.
    """

    noise: Array
    pulse: Array
    limits: Array
    worth: NDArray[np.uint8]
    honest: NDArray[np.bool_]
    rate: Array
    oldest: Array


def traits_of(types: Sequence[SensorType]) -> Traits:
    """The traits of sensors of these types."""
    worth = np.full((len(types), 256), REJECTED, dtype=np.uint8)
    honest = np.zeros((len(types), 256), dtype=bool)
    for k, t in enumerate(types):
        worth[k, list(t.status.trusted)] = TRUSTED
        worth[k, t.status.no_target] = NOTHING
        honest[k, list(t.status.honest)] = True
    return Traits(
        noise=freeze(np.array([(t.error.noise_floor_m, t.error.noise_share) for t in types])),
        pulse=freeze(np.array([(t.pulse_m, t.pulse_share) for t in types])),
        limits=freeze(np.array([(t.least_m, t.most_m) for t in types])),
        worth=freeze(worth),
        honest=freeze(honest),
        rate=freeze(np.array([t.rate_hz for t in types])),
        oldest=freeze(np.array([t.oldest for t in types])),
    )


# Kernels call these for every zone, so they take numbers: each array that a kernel hands to
# another one is counted twice, and thirty of them a zone cost more than the zone itself.


@compiled
def noise_of(floor: float, share: float, distance: float) -> float:
    """Standard deviation [m] of a distance [m], of a row of `Traits.noise`."""
    return max(floor, share * abs(distance))


@compiled
def pulse_of(least: float, share: float, distance: float) -> float:
    """How far [m] behind the nearest return, at `distance` [m], others merge with it, of a row of
    `Traits.pulse`."""
    return max(least, share * distance)
