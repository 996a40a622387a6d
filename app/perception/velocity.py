"""How fast the world comes nearer at each pair: robust flow of surfaces, filtered in tracks.

The distance's own rate will not do: the closest point jumps, and the arm moves. Instead the
points around the pair's point in the newest frames are laid onto the surfaces that each
sensor saw one frame earlier, all in the base frame, so that the arm's motion drops out
(point-to-plane, robust). A Kalman filter a row of pairs smooths the velocity.

Zero when unsure: no output before the third measurement in a row, inside the dead band, or
when the measurements stop; only what was known to move glides on for three periods, since the
skin sees slices, and is surely not gone for having left one. A switch of the pair's point is no
motion: a track that jumps starts again from its nearest neighbour's velocity.
"""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Cloud, Pairs, freeze
from app.perception.flow import LEAST, Frames, no_frames, renew_frames, solve_flow
from app.robot.skin import Skin

PERIOD = 1.0 / 15.0  # [s] between measurements of a track: one frame of every sensor
REACH = 0.8  # [m] farther pairs are not tracked
JUMP = 0.3  # [m] a track whose point moves farther in one tick starts again
ACCELERATION = 3.0  # [m/s^2] of the random walk
SIGMA, SIGMA_POINTS = 0.25, 0.3  # [m/s] of a measurement, and divided by the root of its points
GATE = 4.0  # sigmas; what lies beyond is clipped, not thrown away
FADE = 0.8  # of the velocity is left after a period without a measurement
SURE = 3  # measurements in a row before a track speaks
DEAD_BAND = 0.08  # [m/s]
# The filter's own deviation is that of its gains, 0.2 m/s where it settles; its errors before
# bodies that come or pass are this share of it (0.07 to 0.10 m/s rms). What is called still may
# creep.
HONEST, CREEPS = 0.4, 0.02  # of the deviation; [m/s]
MOST, LEAST_SPEED = 1.6, -0.2  # [m/s]: nothing that recedes may pull the arm behind it
MOVES, STANDS = 0.12, 0.06  # [m/s] above and below which a track is called moving or still


class Tracks(NamedTuple):
    """One for each row of pairs (B,).

    v: (B, 3) [m/s] velocity, variance of each component.   at: (B, 3) [m] its point, NaN of none.
    next: [s] when it is measured again.   sure: measurements in a row.   moving: 0..5.
    """

    v: Array
    variance: Array
    at: Array
    next: Array
    sure: NDArray[np.int64]
    moving: NDArray[np.int64]


class ObstacleSpeed:
    """Frames in, speed of approach for each row of pairs out."""

    def __init__(self, skin: Skin) -> None:
        self._skin = skin
        self.reset()

    def reset(self) -> None:
        """Forget frames and tracks."""
        self._frames = no_frames(self._skin.first, self._skin.grid)
        self._tracks = _tracks(0)

    def take(self, cloud: Cloud, sensors: NDArray[np.intp]) -> None:
        """Take note of the newest frames of `sensors` (m,)."""
        renew_frames(sensors, cloud.points, cloud.verdict, cloud.stamp, self._frames)

    def update(self, pairs: Pairs, now: float) -> Pairs:
        """`pairs` with `approach` (B,) [m/s] and its sigma filled in."""
        B = len(pairs.distance)
        if len(self._tracks.sure) != B:
            self._tracks = _tracks(B)
        out = np.empty((2, B))
        _follow(
            self._tracks, self._frames, now, pairs.distance, pairs.on_world, pairs.normal, out
        )  # fmt: skip
        freeze(out)
        return replace(pairs, approach=out[0], approach_sigma=out[1])

    def moving(self) -> Array:
        """(m, 3) [m] points of the tracks that are known to move, base frame."""
        return self._tracks.at[self._tracks.moving >= SURE]


def _tracks(rows: int) -> Tracks:
    return Tracks(
        np.zeros((rows, 3)), np.full(rows, SIGMA**2), np.full((rows, 3), np.nan),
        np.full(rows, -np.inf), *np.zeros((2, rows), dtype=np.int64),
    )  # fmt: skip


@compiled
def _follow(
    tracks: Tracks,
    frames: Frames,
    now: float,
    distance: Array,
    on_world: Array,
    normal: Array,
    out: Array,
) -> None:
    """Carry the tracks on to the pairs (B,), measure those that are due, write what they say:
    (2, B) approach and its sigma [m/s]."""
    for row in range(len(distance)):
        if not distance[row] < REACH:
            tracks.v[row], tracks.at[row] = 0.0, np.nan
            tracks.sure[row] = tracks.moving[row] = 0
    for row in range(len(distance)):
        if distance[row] < REACH and not _apart(tracks.at[row], on_world[row]) <= JUMP:
            _seed(tracks, row, on_world[row])
    for row in range(len(distance)):
        if distance[row] < REACH:
            tracks.at[row] = on_world[row]
            if now >= tracks.next[row] - 1e-9:
                _measure(tracks, frames, row, now)
        w = 0.0
        for a in range(3):
            if distance[row] < REACH:
                w += normal[row, a] * tracks.v[row, a]
        if abs(w) < DEAD_BAND or tracks.sure[row] < SURE:
            w = 0.0
        out[0, row] = min(max(w, LEAST_SPEED), MOST)
        out[1, row] = HONEST * np.sqrt(tracks.variance[row]) if w > 0.0 else CREEPS


@compiled
def _apart(a: Array, b: Array) -> float:
    return float(np.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2))


@compiled
def _seed(tracks: Tracks, row: int, point: Array) -> None:
    """A new place: the velocity of the nearest other track, if one is there."""
    tracks.v[row], tracks.variance[row] = 0.0, SIGMA**2
    tracks.sure[row] = tracks.moving[row] = 0
    best, other = JUMP, -1
    for i in range(len(tracks.sure)):
        apart = _apart(tracks.at[i], point)
        if i != row and apart < best:  # NaN is no track
            best, other = apart, i
    if other >= 0:
        tracks.v[row], tracks.sure[row] = tracks.v[other], tracks.sure[other]


@compiled
def _measure(tracks: Tracks, frames: Frames, row: int, now: float) -> None:
    dt = PERIOD
    if np.isfinite(tracks.next[row]):
        dt += max(0.0, now - tracks.next[row])
    tracks.next[row] = now + PERIOD
    v, step = tracks.v[row], np.empty(3)
    n = solve_flow(tracks.at[row], v, now, frames, step)
    tracks.variance[row] += (ACCELERATION * dt) ** 2
    if n < LEAST:
        tracks.v[row] = FADE * v
        if tracks.moving[row] < SURE:
            tracks.sure[row] = 0
        tracks.moving[row] = max(0, tracks.moving[row] - 1)
        return
    spread = tracks.variance[row] + (SIGMA + SIGMA_POINTS / np.sqrt(n)) ** 2
    step -= v
    length, longest = np.sqrt((step * step).sum()), GATE * np.sqrt(spread)
    if length > longest:
        step *= longest / length
    gain = tracks.variance[row] / spread
    tracks.v[row] = v + gain * step
    tracks.variance[row] *= 1.0 - gain
    tracks.sure[row] += 1
    speed = np.sqrt((tracks.v[row] ** 2).sum())
    if speed > MOVES:
        tracks.moving[row] = min(5, tracks.moving[row] + 1)
    elif speed < STANDS:
        tracks.moving[row] = max(0, tracks.moving[row] - 1)
