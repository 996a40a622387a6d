"""The compiled parts of the obstacle's velocity: normals of a frame, robust point-to-plane flow."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import SLOTS, Array, Verdict

KEPT = int(Verdict.KEPT)
CHORD = 0.25  # [m] a normal's neighbours lie no farther apart than this
AROUND = 0.25  # [m] of the pair's point: what takes part
NEAR = 0.12  # [m] between a point and where the last frame had its surface
LEAST = 6  # points that make a measurement
ROUNDS = 3
HUBER = 1.35  # of the robust scale
RIDGE = 0.01  # of the number of points: pulls directions that nothing shows to zero
OLDEST = 0.2  # [s] between two frames of one sensor that are compared


class Frames(NamedTuple):
    """The newest frame of K sensors and the one before, base frame; NaN is nothing.

    points: (K, 64, 3) [m], use: (K, 64), normals: (K, 64, 3), stamp: (K,) [s]; old_... likewise.
    """

    points: Array
    use: NDArray[np.bool_]
    normals: Array
    stamp: Array
    old_points: Array
    old_normals: Array
    old_stamp: Array


def no_frames(sensors: int) -> Frames:
    """Nothing has been seen yet."""
    points, normals, old_points, old_normals = np.full((4, sensors, SLOTS, 3), np.nan)
    stamp, old_stamp = np.full((2, sensors), -np.inf)
    use = np.zeros((sensors, SLOTS), dtype=bool)
    return Frames(points, use, normals, stamp, old_points, old_normals, old_stamp)


@compiled
def surface_normals(points: Array, use: NDArray[np.bool_], size: int, normals: Array) -> None:
    """Write unit normals (64, 3) of a frame's `points`, NaN where the surface is not known."""
    normals[:] = np.nan
    for row in range(size):
        for column in range(size):
            zone = row * size + column
            up, down = max(row - 1, 0) * size + column, min(row + 1, size - 1) * size + column
            left, right = row * size + max(column - 1, 0), row * size + min(column + 1, size - 1)
            if not (use[zone] and use[up] and use[down] and use[left] and use[right]):
                continue
            ax, ay, az = _minus(points, down, up)
            bx, by, bz = _minus(points, right, left)
            far = max(ax * ax + ay * ay + az * az, bx * bx + by * by + bz * bz)
            if far > CHORD * CHORD:
                continue
            x, y, z = ay * bz - az * by, az * bx - ax * bz, ax * by - ay * bx
            length = np.sqrt(x * x + y * y + z * z)
            if length > 1e-9:
                normals[zone, 0], normals[zone, 1] = x / length, y / length
                normals[zone, 2] = z / length


@compiled
def _minus(points: Array, a: int, b: int) -> tuple[float, float, float]:
    """Row a less row b; of whole rows numba would make an array."""
    return points[a, 0] - points[b, 0], points[a, 1] - points[b, 1], points[a, 2] - points[b, 2]


@compiled
def take_frames(
    sensors: NDArray[np.int64],
    cloud: Array,
    verdict: NDArray[np.uint8],
    taken: Array,
    size: NDArray[np.int64],
    frames: Frames,
) -> None:
    """The frames of `sensors` (m,) in a cloud with its verdicts, taken at (K,) [s], become the
    newest; size: (K,) of each sensor. The same frame again changes nothing.
    """
    for k in sensors:
        if taken[k] <= frames.stamp[k]:
            continue
        frames.old_points[k], frames.old_normals[k] = frames.points[k], frames.normals[k]
        frames.old_stamp[k] = frames.stamp[k]
        frames.stamp[k] = taken[k]
        frames.points[k] = cloud[k * SLOTS : (k + 1) * SLOTS]
        for zone in range(SLOTS):
            frames.use[k, zone] = verdict[k * SLOTS + zone] == KEPT
        surface_normals(frames.points[k], frames.use[k], size[k], frames.normals[k])


@compiled
def solve_flow(centre: Array, guess: Array, now: float, frames: Frames, velocity: Array) -> int:
    """Velocity (3,) [m/s] of the surface around `centre`, written; returns the points used.

    Fewer than `LEAST` points are no measurement.
    """
    at, who = _around(centre, now, frames)
    velocity[:] = guess
    used = len(who)
    if used < LEAST:
        return used
    step, span, plane = np.empty(used), np.empty(used), np.empty((used, 3))
    for _ in range(ROUNDS):
        used = _match(at, who, velocity, frames, step, span, plane)
        if used < LEAST:
            break
        _fit(step[:used], span[:used], plane[:used], velocity)
    return used


@compiled
def _around(centre: Array, now: float, frames: Frames) -> tuple[Array, NDArray[np.int64]]:
    """Used points (n, 3) of young frames that take part, and the sensor (n,) of each."""
    room = len(frames.stamp) * SLOTS
    at, who, n = np.empty((room, 3)), np.empty(room, dtype=np.int64), 0
    for k in range(len(frames.stamp)):
        dt = frames.stamp[k] - frames.old_stamp[k]
        if not (0.0 < dt <= OLDEST) or now - frames.stamp[k] > OLDEST:
            continue
        for zone in range(SLOTS):
            if frames.use[k, zone]:
                far = 0.0
                for a in range(3):
                    far += (frames.points[k, zone, a] - centre[a]) ** 2
                if far < AROUND * AROUND:
                    at[n], who[n] = frames.points[k, zone], k
                    n += 1
    return at[:n], who[:n]


@compiled
def _match(
    at: Array, who: NDArray[np.int64], velocity: Array, frames: Frames, step: Array, span: Array,
    plane: Array,
) -> int:  # fmt: skip
    """Lay points that move with `velocity` onto the surfaces of a frame earlier; how many fit.

    Writes for each that does its way along the surface's normal since then, step [m], the time
    that took, span [s], and the normal, plane (n, 3).
    """
    n = 0
    for i in range(len(who)):
        k = who[i]
        dt = frames.stamp[k] - frames.old_stamp[k]
        old, normals = frames.old_points[k], frames.old_normals[k]
        best, match = NEAR * NEAR, -1
        for j in range(SLOTS):
            if normals[j, 0] != normals[j, 0]:
                continue
            d = 0.0
            for a in range(3):
                d += (at[i, a] - velocity[a] * dt - old[j, a]) ** 2
            if d < best:
                best, match = d, j
        if match >= 0:
            step[n], span[n] = 0.0, dt
            for a in range(3):
                plane[n, a] = normals[match, a]
                step[n] += plane[n, a] * (at[i, a] - old[match, a])
            n += 1
    return n


@compiled
def _fit(step: Array, span: Array, plane: Array, velocity: Array) -> None:
    """Renew the velocity (3,) by robust least squares: span * plane . velocity = step."""
    n = len(step)
    error = np.empty(n)
    for i in range(n):
        error[i] = step[i]
        for a in range(3):
            error[i] -= span[i] * plane[i, a] * velocity[a]
    limit = HUBER * (1.48 * np.median(np.abs(error)) + 1e-3)
    A, b = np.zeros((3, 3)), np.zeros(3)
    for i in range(n):
        weight = 1.0 if abs(error[i]) <= limit else limit / abs(error[i])
        for r in range(3):
            b[r] += weight * span[i] * plane[i, r] * step[i]
            for c in range(3):
                A[r, c] += weight * span[i] * span[i] * plane[i, r] * plane[i, c]
        for r in range(3):
            A[r, r] += RIDGE * span[i] * span[i]
    velocity[:] = np.linalg.solve(A, b)
