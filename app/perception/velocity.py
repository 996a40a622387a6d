"""How fast the world comes nearer at each pair: robust flow of surfaces, filtered in tracks.

The distance's own rate will not do: the closest point jumps, and the arm moves. Instead the
points around the pair's point in the newest frames are laid onto the surfaces that each
sensor saw one frame earlier, all in the base frame, so that the arm's motion drops out
(point-to-plane, robust). A Kalman filter a row of pairs smooths the velocity.

Zero when unsure: no output before the third measurement in a row, inside the dead band, or
when the measurements stop. A switch of the pair's point is no motion: a track that jumps
starts again from its nearest neighbour's velocity.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from app.messages import SLOTS, Array, Cloud, Pairs, freeze
from app.perception.flow import LEAST, solve_flow, take_frames
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
MOST, LEAST_SPEED = 1.6, -0.2  # [m/s]: nothing that recedes may pull the arm behind it
MOVES, STANDS = 0.12, 0.06  # [m/s] above and below which a track is called moving or still


class ObstacleSpeed:
    """Frames in, speed of approach for each row of pairs out."""

    def __init__(self, skin: Skin) -> None:
        self._size = np.array([s.resolution for s in skin.sensors])
        self.reset()

    def reset(self) -> None:
        """Forget frames and tracks."""
        K = len(self._size)
        self._points, self._old_points = (np.full((K, SLOTS, 3), np.nan) for _ in range(2))
        self._normals, self._old_normals = (np.full((K, SLOTS, 3), np.nan) for _ in range(2))
        self._stamp, self._old_stamp = (np.full(K, -np.inf) for _ in range(2))
        self._use = np.zeros((K, SLOTS), dtype=bool)
        self._tracks(0)

    def _tracks(self, rows: int) -> None:
        self._v = np.zeros((rows, 3))
        self._variance = np.full(rows, SIGMA**2)
        self._at = np.full((rows, 3), np.nan)
        self._next = np.full(rows, -np.inf)
        self._sure = np.zeros(rows, dtype=np.int64)
        self._moving = np.zeros(rows, dtype=np.int64)

    def take(self, cloud: Cloud, sensors: NDArray[np.intp]) -> None:
        """Take note of the newest frames of `sensors` (m,)."""
        take_frames(
            sensors, cloud.points, cloud.verdict, cloud.stamp, self._size, self._points, self._use,
            self._normals, self._stamp, self._old_points, self._old_normals, self._old_stamp,
        )  # fmt: skip

    def update(self, pairs: Pairs, now: float) -> Pairs:
        """`pairs` with `approach` (B,) and `approach_sigma` (B,) [m/s] filled in."""
        B = len(pairs.distance)
        if len(self._v) != B:
            self._tracks(B)
        near = pairs.distance < REACH
        self._v[~near], self._sure[~near], self._moving[~near] = 0.0, 0, 0
        self._at[~near] = np.nan
        due = near & (now >= self._next - 1e-9)
        rows = np.flatnonzero(near)
        moved = np.linalg.norm(pairs.on_world[rows] - self._at[rows], axis=1)
        for row in rows[~(moved <= JUMP)]:  # NaN is a new track
            self._seed(int(row), pairs.on_world[row])
        self._at[rows] = pairs.on_world[rows]
        for row in np.flatnonzero(due):
            self._measure(int(row), now)
        w = np.zeros(B)
        w[rows] = np.einsum("ij,ij->i", pairs.normal[rows], self._v[rows])
        w[(np.abs(w) < DEAD_BAND) | (self._sure < SURE)] = 0.0
        return replace(
            pairs,
            approach=freeze(np.clip(w, LEAST_SPEED, MOST)),
            approach_sigma=freeze(np.sqrt(self._variance)),
        )

    def moving(self) -> Array:
        """(m, 3) [m] points of the tracks that are known to move, base frame."""
        return self._at[self._moving >= SURE]

    def _seed(self, row: int, point: Array) -> None:
        """A new place: the velocity of the nearest other track, if one is there."""
        self._v[row], self._sure[row], self._variance[row] = 0.0, 0, SIGMA**2
        self._moving[row] = 0
        apart = np.linalg.norm(self._at - point, axis=1)
        apart[row] = np.nan
        if (apart < JUMP).any():
            other = int(np.nanargmin(apart))
            self._v[row], self._sure[row] = self._v[other], self._sure[other]

    def _measure(self, row: int, now: float) -> None:
        dt = PERIOD if not np.isfinite(self._next[row]) else PERIOD + max(0, now - self._next[row])
        self._next[row] = now + PERIOD
        v, measured = self._v[row], np.empty(3)
        n = solve_flow(
            self._at[row], v, now, self._points, self._use, self._stamp,
            self._old_points, self._old_normals, self._old_stamp, measured,
        )  # fmt: skip
        self._variance[row] += (ACCELERATION * dt) ** 2
        if n < LEAST:
            self._v[row] = FADE * v
            self._sure[row] = 0
            self._moving[row] = max(0, self._moving[row] - 1)
            return
        noise = (SIGMA + SIGMA_POINTS / np.sqrt(n)) ** 2
        spread = self._variance[row] + noise
        step = measured - v
        length = float(np.linalg.norm(step))
        longest = GATE * np.sqrt(spread)
        if length > longest:
            step *= longest / length
        gain = self._variance[row] / spread
        self._v[row] = v + gain * step
        self._variance[row] *= 1.0 - gain
        self._sure[row] += 1
        speed = float(np.linalg.norm(self._v[row]))
        if speed > MOVES:
            self._moving[row] = min(5, self._moving[row] + 1)
        elif speed < STANDS:
            self._moving[row] = max(0, self._moving[row] - 1)
