"""What is known of each sensor: does it speak, how often, and is it any use?"""

from collections.abc import Sequence
from typing import NamedTuple

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
GOOD, SLOW, POOR = int(SensorHealth.GOOD), int(SensorHealth.SLOW), int(SensorHealth.POOR)
SATURATED, FROZEN = int(SensorHealth.SATURATED), int(SensorHealth.FROZEN)
STALE, WAITING, ABSENT = (
    int(SensorHealth.STALE), int(SensorHealth.WAITING), int(SensorHealth.ABSENT)
)  # fmt: skip
SLOW_RATE = 7.5  # [Hz] half of what an 8x8 sensor can do


class _Figures(NamedTuple):
    """Running figures of K sensors; times in seconds, NaN or -inf before there is one.

    last: stamp of the newest frame.   period, delay: means.   bad, covered: mean shares of zones.
    same: frames in a row with equal values.   distance: (K, 64) of the newest frame.
    """

    last: Array
    period: Array
    delay: Array
    bad: Array
    covered: Array
    same: NDArray[np.int64]
    distance: Array


class SkinHealth:
    """Running figures of every sensor."""

    def __init__(self, connected: NDArray[np.bool_]) -> None:
        self._connected = connected
        K = len(connected)
        self._figures = _Figures(
            last=np.full(K, -np.inf), period=np.full(K, np.nan), delay=np.full(K, np.nan),
            bad=np.zeros(K), covered=np.zeros(K), same=np.zeros(K, dtype=np.int64),
            distance=np.full((K, SLOTS), np.nan),
        )  # fmt: skip

    def connect(self, connected: NDArray[np.bool_]) -> None:
        """The source speaks for these sensors (K,) from now on."""
        self._connected = connected

    def update(self, frames: Sequence[SensorFrame], now: float) -> None:
        """Take note of frames that have arrived by `now` [s]."""
        for f in frames:
            _take(self._figures, f.sensor, f.stamp, now, f.distance, f.status, f.targets)

    def states(self, now: float, allowed_age: float) -> NDArray[np.uint8]:
        """(K,) of `SensorHealth`: the worst that is known of a sensor is what is told."""
        state = np.empty(len(self._connected), dtype=np.uint8)
        _states(self._figures, self._connected, now, allowed_age, state)
        return state

    def rates(self) -> Array:
        """(K,) [frames/s], 0 before the second frame."""
        rate = np.empty(len(self._connected))
        _rates(self._figures.period, rate)
        return rate

    def delays(self) -> Array:
        """(K,) [s] from measurement to the tick that used it, on average; NaN before a frame."""
        return self._figures.delay.copy()

    def silent(self, now: float, limit: float, since: float) -> int:
        """Connected sensors without a frame for more than `limit` [s], counted from `since`."""
        return int(_silent(self._figures.last, self._connected, now, limit, since))

    def quiet(self, now: float, limit: float, since: float) -> NDArray[np.bool_]:
        """(K,) connected sensors without a frame for more than `limit` [s], from `since` on."""
        return (now - np.maximum(self._figures.last, since) > limit) & self._connected

    def heard_since(self, since: float) -> bool:
        """Is there a frame that was measured at `since` [s] or later?"""
        return bool(_heard(self._figures.last, since))

    def age(self, now: float, since: float, share: float) -> float:
        """Silence [s] that this share of the connected sensors has reached, from `since` on."""
        quiet = np.sort(now - np.maximum(self._figures.last, since)[self._connected])[::-1]
        return float(quiet[max(int(np.ceil(share * len(quiet))) - 1, 0)]) if len(quiet) else 0.0


@compiled
def _take(
    figures: _Figures,
    k: int,
    stamp: float,
    now: float,
    distance: Array,
    status: NDArray[np.uint8],
    targets: NDArray[np.uint8],
) -> None:
    """Take note of a frame of sensor k."""
    covered, usable, some, same = 0, 0, 0, True
    for zone in range(SLOTS):
        covered += targets[zone] > 0 and distance[zone] <= AT_LENS
        usable += USABLE[status[zone]]
        some += targets[zone] > 0
        same = same and distance[zone] == figures.distance[k, zone]
    _mean(figures.delay, k, now - stamp)
    gap = stamp - figures.last[k]
    if np.isfinite(gap) and gap > 0.0:
        _mean(figures.period, k, gap)
        figures.same[k] = figures.same[k] + 1 if same and some >= FEW else 0
        figures.distance[k] = distance
    figures.covered[k] += FORGET * (covered / SLOTS - figures.covered[k])
    figures.bad[k] += FORGET * (1.0 - usable / SLOTS - figures.bad[k])
    figures.last[k] = max(figures.last[k], stamp)


@compiled
def _mean(mean: Array, k: int, value: float) -> None:
    """Let the running mean of sensor k follow a value; the first one is taken as it is."""
    old = mean[k]
    mean[k] = value if np.isnan(old) else old + FORGET * (value - old)


@compiled
def _states(
    figures: _Figures,
    connected: NDArray[np.bool_],
    now: float,
    allowed_age: float,
    state: NDArray[np.uint8],
) -> None:
    """Write the state (K,) of every sensor."""
    for k in range(len(state)):
        if not connected[k]:
            state[k] = ABSENT
        elif not np.isfinite(figures.last[k]):
            state[k] = WAITING
        elif now - figures.last[k] > allowed_age:
            state[k] = STALE
        elif figures.same[k] >= REPEATS:
            state[k] = FROZEN
        elif figures.covered[k] > COVERED_SHARE:
            state[k] = SATURATED
        elif figures.bad[k] > POOR_SHARE:
            state[k] = POOR
        else:
            state[k] = SLOW if 1.0 / figures.period[k] < SLOW_RATE else GOOD


@compiled
def _silent(
    last: Array, connected: NDArray[np.bool_], now: float, limit: float, since: float
) -> int:
    """How many of the connected have been silent for more than `limit`."""
    count = 0
    for k in range(len(last)):
        count += connected[k] and now - max(last[k], since) > limit
    return count


@compiled
def _heard(last: Array, since: float) -> bool:
    """Has anyone spoken at `since` or later?"""
    found = False
    for k in range(len(last)):
        found |= last[k] >= since
    return found


@compiled
def _rates(period: Array, rate: Array) -> None:
    """Write frames a second (K,), 0 where no period is known."""
    for k in range(len(period)):
        rate[k] = 0.0 if np.isnan(period[k]) else 1.0 / period[k]
