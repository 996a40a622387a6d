"""What is known of each sensor: does it speak, how often, and is it any use?"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import SLOTS, Array, SensorFrame, SensorHealth

FORGET = 0.1  # weight of the newest frame in the running means
USABLE = np.zeros(256, dtype=bool)  # by status: usable, or honestly nothing there
USABLE[[5, 6, 9, 10, 255]] = True
POOR_SHARE = 0.5  # more bad zones than this, on average, is poor
REPEATS = 8  # frames in a row with the same values in every zone: noise alone would differ
FEW = 8  # zones with a target below which sameness says nothing
AT_LENS, COVERED_SHARE = 0.02, 0.5  # [m] and share of zones that make a sensor saturated
SLOW_RATE = 7.5  # [Hz] half of what an 8x8 sensor can do
GOOD, SLOW, POOR, SATURATED, FROZEN, STALE, WAITING, ABSENT = (
    int(h)
    for h in (
        SensorHealth.GOOD, SensorHealth.SLOW, SensorHealth.POOR, SensorHealth.SATURATED,
        SensorHealth.FROZEN, SensorHealth.STALE, SensorHealth.WAITING, SensorHealth.ABSENT,
    )
)  # fmt: skip
LAST, PERIOD, DELAY, BAD, COVERED, SAME = range(6)  # columns of the figures: see `SkinHealth`


class SkinHealth:
    """Running figures of every sensor, a row each: stamp of the last frame [s], time between two
    and from measurement to use [s], shares of bad and of covered zones, and how many frames in a
    row were the same. Means are running ones, NaN before there is one.
    """

    def __init__(self, connected: NDArray[np.bool_]) -> None:
        self._connected = connected
        self._figures = np.zeros((len(connected), 6))
        self._figures[:, [LAST, PERIOD, DELAY]] = -np.inf, np.nan, np.nan
        self._distance = np.full((len(connected), SLOTS), np.nan)

    def connect(self, connected: NDArray[np.bool_]) -> None:
        """The source speaks for these sensors (K,) from now on."""
        self._connected = connected

    def update(self, frames: Sequence[SensorFrame], now: float) -> None:
        """Take note of frames that have arrived by `now` [s]."""
        if frames:
            _take_note(
                np.array([f.sensor for f in frames]), np.array([f.stamp for f in frames]),
                np.array([f.distance for f in frames]), np.array([f.status for f in frames]),
                np.array([f.targets for f in frames]), now, self._figures, self._distance,
            )  # fmt: skip

    def states(self, now: float, allowed_age: float) -> NDArray[np.uint8]:
        """(K,) of `SensorHealth`."""
        out = np.empty(len(self._figures), dtype=np.uint8)
        _judge(self._figures, self._connected, now, allowed_age, out)
        return out

    def rates(self) -> Array:
        """(K,) [frames/s], 0 before the second frame."""
        period = self._figures[:, PERIOD]
        return np.where(np.isnan(period), 0.0, 1.0 / period)

    def delays(self) -> Array:
        """(K,) [s] from measurement to the tick that used it, on average; NaN before a frame."""
        return self._figures[:, DELAY].copy()

    def silent(self, now: float, limit: float, since: float) -> int:
        """Connected sensors without a frame for more than `limit` [s], counted from `since`."""
        quiet = now - np.maximum(self._figures[:, LAST], since) > limit
        return int((quiet & self._connected).sum())

    def heard_since(self, since: float) -> bool:
        """Is there a frame that was measured at `since` [s] or later?"""
        return bool((self._figures[:, LAST] >= since).any())

    def age(self, now: float, since: float, share: float) -> float:
        """Silence [s] that this share of the connected sensors has reached, from `since` on."""
        quiet = np.sort(now - np.maximum(self._figures[:, LAST], since)[self._connected])[::-1]
        return float(quiet[max(int(np.ceil(share * len(quiet))) - 1, 0)]) if len(quiet) else 0.0


@compiled
def _take_note(
    sensors: NDArray[np.int64],
    stamp: Array,
    distance: Array,
    status: NDArray[np.uint8],
    targets: NDArray[np.uint8],
    now: float,
    figures: Array,
    before: Array,
) -> None:
    """Renew figures (K, 6) and the last distances, before (K, 64), by m frames (m, 64)."""
    for i in range(len(sensors)):
        k = sensors[i]
        figure, covered, bad, some, same = figures[k], 0, 0, 0, True
        for zone in range(SLOTS):
            covered += targets[i, zone] > 0 and distance[i, zone] <= AT_LENS
            bad += not USABLE[status[i, zone]]
            some += targets[i, zone] > 0
            same &= distance[i, zone] == before[k, zone]
        late, gap = now - stamp[i], stamp[i] - figure[LAST]
        figure[DELAY] = late if np.isnan(figure[DELAY]) else _mean(figure[DELAY], late)
        if np.isfinite(gap) and gap > 0.0:
            figure[PERIOD] = gap if np.isnan(figure[PERIOD]) else _mean(figure[PERIOD], gap)
            figure[SAME] = figure[SAME] + 1.0 if same and some >= FEW else 0.0
            before[k] = distance[i]
        figure[COVERED] = _mean(figure[COVERED], covered / SLOTS)
        figure[BAD] = _mean(figure[BAD], bad / SLOTS)
        figure[LAST] = max(figure[LAST], stamp[i])


@compiled
def _mean(old: float, new: float) -> float:
    return old + FORGET * (new - old)


@compiled
def _judge(
    figures: Array, connected: NDArray[np.bool_], now: float, allowed_age: float,
    out: NDArray[np.uint8],
) -> None:  # fmt: skip
    """Write the worst that is known of each sensor (K,)."""
    for k in range(len(figures)):
        figure = figures[k]
        if not connected[k]:
            out[k] = ABSENT
        elif not np.isfinite(figure[LAST]):
            out[k] = WAITING
        elif now - figure[LAST] > allowed_age:
            out[k] = STALE
        elif figure[SAME] >= REPEATS:
            out[k] = FROZEN
        elif figure[COVERED] > COVERED_SHARE:
            out[k] = SATURATED
        elif figure[BAD] > POOR_SHARE:
            out[k] = POOR
        elif 1.0 / figure[PERIOD] < SLOW_RATE:
            out[k] = SLOW
        else:
            out[k] = GOOD
