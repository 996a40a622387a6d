"""What is known of each sensor: does it speak, how often, and is it any use?"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, SensorFrame, SensorHealth
from app.perception.unable import Unable
from app.robot.skin import Skin
from app.robot.traits import Traits

FORGET = 0.1  # weight of the newest frame in the running means
POOR_SHARE = 0.5  # more bad zones than this, on average, is poor
REPEATS = 5  # frames in a row with the same values in every zone: noise alone would differ
MOVED = 0.02  # [rad or m] of a joint: a centimetre or two at a lens, which no sensor misses
REJECTED = 5  # frames in a row in which a zone is of no use: it is lost until the next that is
FIRST = 0.1  # [s] that a sensor may need for its first frame beyond the age that one may have
LOST_SHARE = 0.25  # of the zones: from then on the sensor is told of by name
FEW = 3  # zones with a target below which sameness says nothing: so few may repeat by chance
AT_LENS, COVERED_SHARE = 0.02, 0.5  # [m] and share of zones that make a sensor saturated
GOOD, SLOW, POOR = int(SensorHealth.GOOD), int(SensorHealth.SLOW), int(SensorHealth.POOR)
SATURATED, FROZEN = int(SensorHealth.SATURATED), int(SensorHealth.FROZEN)
STALE, WAITING, ABSENT = (
    int(SensorHealth.STALE), int(SensorHealth.WAITING), int(SensorHealth.ABSENT)
)  # fmt: skip
SILENT_, FROZEN_, BAD_STATUS_ = int(Unable.SILENT), int(Unable.FROZEN), int(Unable.BAD_STATUS)
SLOW_SHARE = 0.5  # of the frames a second that a sensor of its type sends


class _Figures(NamedTuple):
    """Running figures of K sensors; times in seconds, NaN or -inf before there is one.

    first: (K + 1,) slots of each sensor.   traits: of their types.
    last: stamp of the newest frame.   period, delay: means.   bad, covered: mean shares of zones.
    same: frames in a row with equal values.   distance: (S,) [m] of the newest frames.
    moves: (K, n) which joints move each sensor.   since: (K, n) [rad or m] joints when the values
           began to be the same.   stuck: they are still, though the sensor was moved.
    rejected: (S,) frames in a row in which a zone was of no use.   lost: (S,) so many that it
           counts.   turns: (1,) how often any zone's `lost` has changed.
    """

    first: NDArray[np.int64]
    traits: Traits
    last: Array
    period: Array
    delay: Array
    bad: Array
    covered: Array
    same: NDArray[np.int64]
    distance: Array
    moves: Array
    since: Array
    stuck: NDArray[np.bool_]
    rejected: NDArray[np.int64]
    lost: NDArray[np.bool_]
    turns: NDArray[np.int64]


class SkinHealth:
    """Running figures of every sensor; `moves` (K, n) tells which joints move each of them."""

    def __init__(self, skin: Skin, moves: Array | None = None) -> None:
        K = skin.count
        moves = np.zeros((K, 0)) if moves is None else np.array(moves, dtype=np.float64)
        self._connected: NDArray[np.bool_] = np.zeros(K, dtype=bool)
        self._figures = _Figures(
            first=skin.first, traits=skin.traits,
            last=np.full(K, -np.inf), period=np.full(K, np.nan), delay=np.full(K, np.nan),
            bad=np.zeros(K), covered=np.zeros(K), same=np.zeros(K, dtype=np.int64),
            distance=np.full(skin.slots, np.nan),
            moves=moves, since=np.zeros(moves.shape), stuck=np.zeros(K, dtype=bool),
            rejected=np.zeros(skin.slots, dtype=np.int64), lost=np.zeros(skin.slots, dtype=bool),
            turns=np.zeros(1, dtype=np.int64),
        )  # fmt: skip

    def connect(self, connected: NDArray[np.bool_]) -> None:
        """The source speaks for these sensors (K,) from now on."""
        self._connected = connected

    @property
    def lost(self) -> NDArray[np.bool_]:
        """(S,) zones that have been of no use for several frames; written at the next frame."""
        return self._figures.lost

    @property
    def turns(self) -> int:
        """How often any of `lost` has changed."""
        return int(self._figures.turns[0])

    def update(self, frames: Sequence[SensorFrame], now: float, q: Array | None = None) -> None:
        """Take note of frames that have arrived by `now` [s]; q (n,) is where the joints are."""
        at = np.zeros(self._figures.moves.shape[1]) if q is None else q
        for f in frames:
            _note_frame(self._figures, f.sensor, f.stamp, now, f.distance, f.status, f.targets)
            _note_motion(self._figures, f.sensor, at)

    def unable(self, now: float, limit: float, since: float) -> NDArray[np.uint8]:
        """(K,) of `Unable`: silent for more than `limit` [s], counted from `since`, frozen, or of
        bad statuses; what is not connected is not missed. A sensor that has not spoken at all since
        then is not waited for so long."""
        out = np.empty(len(self._connected), dtype=np.uint8)
        _unable(self._figures, self._connected, now, limit, since, out)
        return out

    def states(self, now: float, with_age: bool = True) -> NDArray[np.uint8]:
        """(K,) of `SensorHealth`: the worst that is known of a sensor is what is told.

        with_age: is a sensor stale whose last frame is too old for its type?
        """
        state = np.empty(len(self._connected), dtype=np.uint8)
        _states(self._figures, self._connected, now, with_age, state)
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
def _note_frame(
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
    first = figures.first[k]
    zones, before = len(distance), figures.distance[figures.first[k] : figures.first[k + 1]]
    for zone in range(zones):
        covered += targets[zone] > 0 and distance[zone] <= AT_LENS
        honest = figures.traits.honest[k, status[zone]]
        usable += honest
        figures.rejected[first + zone] = 0 if honest else figures.rejected[first + zone] + 1
        lost = figures.rejected[first + zone] >= REJECTED
        figures.turns[0] += lost != figures.lost[first + zone]
        figures.lost[first + zone] = lost
        some += targets[zone] > 0
        same = same and distance[zone] == before[zone]
    _mean(figures.delay, k, now - stamp)
    gap = stamp - figures.last[k]
    if np.isfinite(gap) and gap > 0.0:
        _mean(figures.period, k, gap)
        figures.same[k] = figures.same[k] + 1 if same and some >= FEW else 0
        before[:] = distance
    figures.covered[k] += FORGET * (covered / zones - figures.covered[k])
    figures.bad[k] += FORGET * (1.0 - usable / zones - figures.bad[k])
    figures.last[k] = max(figures.last[k], stamp)


@compiled
def _note_motion(figures: _Figures, k: int, q: Array) -> None:
    """Has sensor k been moved while its values stayed the same?"""
    moved = 0.0
    for j in range(len(q)):
        moved = max(moved, figures.moves[k, j] * abs(q[j] - figures.since[k, j]))
    figures.stuck[k] = figures.same[k] >= REPEATS and (figures.stuck[k] or moved > MOVED)
    if figures.same[k] == 0:
        figures.since[k] = q


@compiled
def _unable(
    figures: _Figures,
    connected: NDArray[np.bool_],
    now: float,
    limit: float,
    since: float,
    out: NDArray[np.uint8],
) -> None:
    """Write why each sensor (K,) cannot tell."""
    for k in range(len(out)):
        out[k] = 0
        if not connected[k]:
            continue
        first, last = figures.first[k], figures.first[k + 1]
        first_by = figures.traits.oldest[k] + FIRST if figures.last[k] < since else limit
        if now - max(figures.last[k], since) > min(limit, first_by):
            out[k] = SILENT_
        elif figures.stuck[k]:
            out[k] = FROZEN_
        elif figures.lost[first:last].sum() >= LOST_SHARE * (last - first):
            out[k] = BAD_STATUS_


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
    with_age: bool,
    state: NDArray[np.uint8],
) -> None:
    """Write the state (K,) of every sensor."""
    for k in range(len(state)):
        if not connected[k]:
            state[k] = ABSENT
        elif not np.isfinite(figures.last[k]):
            state[k] = WAITING
        elif with_age and now - figures.last[k] > figures.traits.oldest[k]:
            state[k] = STALE
        elif figures.same[k] >= REPEATS:
            state[k] = FROZEN
        elif figures.covered[k] > COVERED_SHARE:
            state[k] = SATURATED
        elif figures.bad[k] > POOR_SHARE:
            state[k] = POOR
        else:
            least = SLOW_SHARE * figures.traits.rate[k]
            state[k] = SLOW if 1.0 / figures.period[k] < least else GOOD


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
