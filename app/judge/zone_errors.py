"""What a real zone's report of a known distance is off by: the bench's own, not the simulator's.

Standard deviations are those of recorded 8x8 frames of a VL53L5CX beside a motion-capture
system, as a table that is interpolated; the simulator's are a formula that was fitted to them.
"""

import numpy as np

from app.messages import Array

# [m] distance, and standard deviation of a report there: an upper bound, since the walls moved
NOISE = np.array([
    [0.03, 0.0006], [0.15, 0.0009], [0.3, 0.0031], [0.55, 0.0040], [0.85, 0.0055],
    [1.75, 0.0097], [2.5, 0.0148], [3.5, 0.0216],
])  # fmt: skip
BIAS = 0.015  # of the distance, standard deviation over the zones of what each is always off by
AT_THE_LENS, GONE_AT = 0.005, 0.2  # [m] added at the lens, less and less up to there
STEP = 0.001  # [m] a sensor reports whole millimetres


def deviation(distance: Array) -> Array:
    """[m] standard deviation of reports of a distance [m]."""
    return np.asarray(np.interp(distance, NOISE[:, 0], NOISE[:, 1]))


class ZoneErrors:
    """The errors of `zones` zones: what each is always off by is drawn once."""

    def __init__(self, zones: int, rng: np.random.Generator) -> None:
        self._share, self._rng = BIAS * rng.standard_normal(zones), rng

    def reported(self, distance: Array) -> Array:
        """What is reported of true distances (zones,) [m], drawn anew at each call."""
        lens = AT_THE_LENS * np.clip(1.0 - distance / GONE_AT, 0.0, 1.0)
        noise = self._rng.standard_normal(distance.shape) * deviation(distance)
        exact = distance * (1.0 + self._share) + lens + noise
        return np.asarray(STEP * np.rint(exact / STEP))
