"""What is known of each sensor: does it speak, how often, and is it any use?"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.messages import SLOTS, Array, SensorFrame, SensorHealth

FORGET = 0.1  # weight of the newest frame in the running means
USABLE = np.zeros(256, dtype=bool)  # by status: usable, or honestly nothing there
USABLE[[5, 6, 9, 10, 255]] = True
POOR_SHARE = 0.5  # more bad zones than this, on average, is poor
REPEATS = 8  # frames in a row with the same values in every zone: noise alone would differ
FEW = 8  # zones with a target below which sameness says nothing
AT_LENS, COVERED_SHARE = 0.02, 0.5  # [m] and share of zones that make a sensor saturated
SLOW_RATE = 7.5  # [Hz] half of what an 8x8 sensor can do


class SkinHealth:
    """Running figures of every sensor."""

    def __init__(self, connected: NDArray[np.bool_]) -> None:
        self._connected = connected
        K = len(connected)
        self._last = np.full(K, -np.inf)
        self._period = np.full(K, np.nan)
        self._bad = np.zeros(K)
        self._covered = np.zeros(K)
        self._same = np.zeros(K, dtype=np.int64)
        self._distance = np.full((K, SLOTS), np.nan)
        self._delay = np.full(K, np.nan)

    def connect(self, connected: NDArray[np.bool_]) -> None:
        """The source speaks for these sensors (K,) from now on."""
        self._connected = connected

    def update(self, frames: Sequence[SensorFrame], now: float) -> None:
        """Take note of frames that have arrived by `now` [s]."""
        if not frames:
            return
        status = np.array([f.status for f in frames])
        targets = np.array([f.targets for f in frames])
        at_lens = (targets > 0) & (np.array([f.distance for f in frames]) <= AT_LENS)
        shares = at_lens.sum(axis=1) / SLOTS, 1.0 - USABLE[status].sum(axis=1) / SLOTS
        for f, covered, bad in zip(frames, *shares, strict=True):
            k = f.sensor
            late = now - f.stamp
            old = self._delay[k]
            self._delay[k] = late if np.isnan(old) else old + FORGET * (late - old)
            gap = f.stamp - self._last[k]
            if np.isfinite(gap) and gap > 0.0:
                old = self._period[k]
                self._period[k] = gap if np.isnan(old) else old + FORGET * (gap - old)
                same = bool((f.distance == self._distance[k]).all())
                some = np.count_nonzero(f.targets) >= FEW
                self._same[k] = self._same[k] + 1 if same and some else 0
                self._distance[k] = f.distance
            self._covered[k] += FORGET * (covered - self._covered[k])
            self._bad[k] += FORGET * (bad - self._bad[k])
            self._last[k] = max(self._last[k], f.stamp)

    def states(self, now: float, allowed_age: float) -> NDArray[np.uint8]:
        """(K,) of `SensorHealth`."""
        state = np.full(len(self._last), SensorHealth.GOOD, dtype=np.uint8)
        # the worst that is known of a sensor is what is told
        with np.errstate(invalid="ignore"):
            state[1.0 / self._period < SLOW_RATE] = SensorHealth.SLOW
        state[self._bad > POOR_SHARE] = SensorHealth.POOR
        state[self._covered > COVERED_SHARE] = SensorHealth.SATURATED
        state[self._same >= REPEATS] = SensorHealth.FROZEN
        state[now - self._last > allowed_age] = SensorHealth.STALE
        state[~np.isfinite(self._last)] = SensorHealth.WAITING
        state[~self._connected] = SensorHealth.ABSENT
        return state

    def rates(self) -> Array:
        """(K,) [frames/s], 0 before the second frame."""
        return np.where(np.isnan(self._period), 0.0, 1.0 / self._period)

    def delays(self) -> Array:
        """(K,) [s] from measurement to the tick that used it, on average; NaN before a frame."""
        return self._delay.copy()

    def silent(self, now: float, limit: float, since: float) -> int:
        """Connected sensors without a frame for more than `limit` [s], counted from `since`."""
        quiet = now - np.maximum(self._last, since) > limit
        return int((quiet & self._connected).sum())

    def heard_since(self, since: float) -> bool:
        """Is there a frame that was measured at `since` [s] or later?"""
        return bool((self._last >= since).any())

    def age(self, now: float, since: float, share: float) -> float:
        """Silence [s] that this share of the connected sensors has reached, from `since` on."""
        quiet = np.sort(now - np.maximum(self._last, since)[self._connected])[::-1]
        return float(quiet[max(int(np.ceil(share * len(quiet))) - 1, 0)]) if len(quiet) else 0.0
