"""The compiled parts of the obstacle's velocity: normals of a frame, robust point-to-plane flow."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict

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
    """The newest frame of K sensors and the one before, S zones, base frame; NaN is nothing.

    first: (K + 1,) zones of each sensor, grid: (K, 2) its rows and columns.
    points: (S, 3) [m], use: (S,), normals: (S, 3), stamp: (K,) [s]; old_... likewise.
    """

    first: NDArray[np.int64]
    grid: NDArray[np.int64]
    points: Array
    use: NDArray[np.bool_]
    normals: Array
    stamp: Array
    old_points: Array
    old_normals: Array
    old_stamp: Array


def no_frames(first: NDArray[np.int64], grid: NDArray[np.int64]) -> Frames:
    """Nothing has been seen yet."""
    points, normals, old_points, old_normals = np.full((4, first[-1], 3), np.nan)
    stamp, old_stamp = np.full((2, len(grid)), -np.inf)
    use = np.zeros(first[-1], dtype=bool)
    return Frames(first, grid, points, use, normals, stamp, old_points, old_normals, old_stamp)


@compiled
def surface_normals(
    points: Array, use: NDArray[np.bool_], rows: int, columns: int, normals: Array
) -> None:
    """Write unit normals (n, 3) of a frame's `points`, NaN where the surface is not known: a zone
    needs neighbours on all four sides, its own at a border, and in both directions."""
    normals[:] = np.nan
    for row in range(rows):
        for column in range(columns):
            zone = row * columns + column
            up, down = (max(row - 1, 0) * columns + column,
                        min(row + 1, rows - 1) * columns + column)  # fmt: skip
            left = row * columns + max(column - 1, 0)
            right = row * columns + min(column + 1, columns - 1)
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
def renew_frames(
    sensors: NDArray[np.int64],
    cloud: Array,
    verdict: NDArray[np.uint8],
    measured: Array,
    frames: Frames,
) -> None:
    """The frames of `sensors` (m,) in a cloud (S, 3) with its verdicts, measured at (K,) [s],
    become the newest. The same frame again changes nothing.
    """
    for k in sensors:
        if measured[k] <= frames.stamp[k]:
            continue
        a, b = frames.first[k], frames.first[k + 1]
        frames.old_points[a:b], frames.old_normals[a:b] = frames.points[a:b], frames.normals[a:b]
        frames.old_stamp[k] = frames.stamp[k]
        frames.stamp[k] = measured[k]
        frames.points[a:b] = cloud[a:b]
        for zone in range(a, b):
            frames.use[zone] = verdict[zone] == KEPT
        rows, columns = frames.grid[k, 0], frames.grid[k, 1]
        surface_normals(frames.points[a:b], frames.use[a:b], rows, columns, frames.normals[a:b])


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
    room = len(frames.use)
    at, who, n = np.empty((room, 3)), np.empty(room, dtype=np.int64), 0
    for k in range(len(frames.stamp)):
        dt = frames.stamp[k] - frames.old_stamp[k]
        if not (0.0 < dt <= OLDEST) or now - frames.stamp[k] > OLDEST:
            continue
        for zone in range(frames.first[k], frames.first[k + 1]):
            if frames.use[zone]:
                far = 0.0
                for a in range(3):
                    far += (frames.points[zone, a] - centre[a]) ** 2
                if far < AROUND * AROUND:
                    at[n], who[n] = frames.points[zone], k
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
        old, normals = frames.old_points, frames.old_normals
        best, match = NEAR * NEAR, -1
        for j in range(frames.first[k], frames.first[k + 1]):
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
