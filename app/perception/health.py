"""What is known of each sensor: does it speak, how often, and is it any use?"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, SensorFrame, SensorHealth

FORGET = 0.1  # weight of the newest frame in the running means
TRUSTED = np.array([5, 6, 9, 10, 255], dtype=np.uint8)  # usable, or honestly nothing there
POOR_SHARE = 0.5  # more bad zones than this, on average, is poor


class SkinHealth:
    """Running figures of every sensor."""

    def __init__(self, connected: NDArray[np.bool_]) -> None:
        self._connected = connected
        K = len(connected)
        self._last = np.full(K, -np.inf)
        self._period = np.full(K, np.nan)
        self._bad = np.zeros(K)

    def update(self, frames: Sequence[SensorFrame]) -> None:
        """Take note of frames that have arrived."""
        for f in frames:
            k = f.sensor
            gap = f.stamp - self._last[k]
            if np.isfinite(gap) and gap > 0.0:
                old = self._period[k]
                self._period[k] = gap if np.isnan(old) else old + FORGET * (gap - old)
            bad = 1.0 - np.isin(f.status, TRUSTED).mean()
            self._bad[k] += FORGET * (bad - self._bad[k])
            self._last[k] = max(self._last[k], f.stamp)

    def states(self, now: float, allowed_age: float) -> NDArray[np.uint8]:
        """(K,) of `SensorHealth`."""
        state = np.full(len(self._last), SensorHealth.GOOD, dtype=np.uint8)
        state[self._bad > POOR_SHARE] = SensorHealth.POOR
        state[now - self._last > allowed_age] = SensorHealth.STALE
        state[~np.isfinite(self._last)] = SensorHealth.WAITING
        state[~self._connected] = SensorHealth.ABSENT
        return state

    def rates(self) -> Array:
        """(K,) [frames/s], 0 before the second frame."""
        return np.nan_to_num(1.0 / self._period, nan=0.0)

    def silent(self, now: float, limit: float, since: float) -> int:
        """Connected sensors without a frame for more than `limit` [s], counted from `since`."""
        quiet = now - np.maximum(self._last, since) > limit
        return int((quiet & self._connected).sum())

    def age(self, now: float, since: float, share: float) -> float:
        """Silence [s] that this share of the connected sensors has reached, from `since` on."""
        quiet = np.sort(now - np.maximum(self._last, since)[self._connected])[::-1]
        return float(quiet[max(int(np.ceil(share * len(quiet))) - 1, 0)]) if len(quiet) else 0.0

    @property
    def heard(self) -> bool:
        """Has any sensor spoken yet?"""
        return bool(np.isfinite(self._last).any())
