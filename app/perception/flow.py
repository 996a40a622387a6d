"""The compiled parts of the obstacle's velocity: normals of a frame, robust point-to-plane flow."""

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
            a, b = points[down] - points[up], points[right] - points[left]
            if (a * a).sum() > CHORD * CHORD or (b * b).sum() > CHORD * CHORD:
                continue
            n = np.array(
                [
                    a[1] * b[2] - a[2] * b[1],
                    a[2] * b[0] - a[0] * b[2],
                    a[0] * b[1] - a[1] * b[0],
                ]
            )
            length = np.sqrt((n * n).sum())
            if length > 1e-9:
                normals[zone] = n / length


@compiled
def take_frames(
    sensors: NDArray[np.intp],
    cloud: Array,
    verdict: NDArray[np.uint8],
    taken: Array,
    size: NDArray[np.int64],
    points: Array,
    use: NDArray[np.bool_],
    normals: Array,
    stamp: Array,
    old_points: Array,
    old_normals: Array,
    old_stamp: Array,
) -> None:
    """The frames of `sensors` in a cloud with its verdicts, taken at (K,) [s], become the newest.

    The others (K, 64, ...) are as in `solve_flow`. The same frame again changes nothing.
    """
    for k in sensors:
        if taken[k] <= stamp[k]:
            continue
        old_points[k], old_normals[k], old_stamp[k] = points[k], normals[k], stamp[k]
        stamp[k] = taken[k]
        for zone in range(SLOTS):
            points[k, zone] = cloud[k * SLOTS + zone]
            use[k, zone] = verdict[k * SLOTS + zone] == KEPT
        surface_normals(points[k], use[k], size[k], normals[k])


@compiled
def solve_flow(
    centre: Array,
    guess: Array,
    now: float,
    points: Array,
    use: NDArray[np.bool_],
    stamp: Array,
    old_points: Array,
    old_normals: Array,
    old_stamp: Array,
    velocity: Array,
) -> int:
    """Velocity (3,) [m/s] of the surface around `centre`, written; returns the points used.

    points, use: (K, 64, ...) newest frames, base frame; old_...: each sensor's frame before.
    Fewer than `LEAST` points are no measurement.
    """
    K = len(stamp)
    at = np.empty((K * SLOTS, 3))
    who = np.empty(K * SLOTS, dtype=np.int64)
    count = 0
    for k in range(K):
        dt = stamp[k] - old_stamp[k]
        if not (0.0 < dt <= OLDEST) or now - stamp[k] > OLDEST:
            continue
        for zone in range(SLOTS):
            if use[k, zone]:
                far = 0.0
                for a in range(3):
                    far += (points[k, zone, a] - centre[a]) ** 2
                if far < AROUND * AROUND:
                    at[count] = points[k, zone]
                    who[count] = k
                    count += 1
    velocity[:] = guess
    if count < LEAST:
        return count
    step, span = np.empty(count), np.empty(count)
    plane = np.empty((count, 3))
    used = 0
    for _ in range(ROUNDS):
        used = 0
        for i in range(count):
            k = who[i]
            dt = stamp[k] - old_stamp[k]
            best, match = NEAR * NEAR, -1
            for j in range(SLOTS):
                if old_normals[k, j, 0] != old_normals[k, j, 0]:
                    continue
                d = 0.0
                for a in range(3):
                    d += (at[i, a] - velocity[a] * dt - old_points[k, j, a]) ** 2
                if d < best:
                    best, match = d, j
            if match >= 0:
                step[used] = 0.0
                for a in range(3):
                    plane[used, a] = old_normals[k, match, a]
                    step[used] += plane[used, a] * (at[i, a] - old_points[k, match, a])
                span[used] = dt
                used += 1
        if used < LEAST:
            return used
        error = np.empty(used)
        for i in range(used):
            error[i] = step[i]
            for a in range(3):
                error[i] -= span[i] * plane[i, a] * velocity[a]
        limit = HUBER * (1.48 * np.median(np.abs(error)) + 1e-3)
        A, b = np.zeros((3, 3)), np.zeros(3)
        for i in range(used):
            weight = 1.0 if abs(error[i]) <= limit else limit / abs(error[i])
            for r in range(3):
                b[r] += weight * span[i] * plane[i, r] * step[i]
                for c in range(3):
                    A[r, c] += weight * span[i] * span[i] * plane[i, r] * plane[i, c]
            for r in range(3):
                A[r, r] += RIDGE * span[i] * span[i]
        velocity[:] = np.linalg.solve(A, b)
    return used
