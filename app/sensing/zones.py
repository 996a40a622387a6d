"""The compiled parts of the simulated sensors: which links may be seen, and what a zone reports."""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array
from app.robot.skin import PULSE, PULSE_SHARE
from app.sensing.error_model import MERGE_DEPTH


@compiled
def aim(
    T_base_link: Array,
    mount: int,
    welded: NDArray[np.bool_],
    centre: Array,
    radius: Array,
    origin: Array,
    axis: Array,
    cone: float,
    far: float,
    T_link_mount: Array,
    seen: NDArray[np.bool_],
) -> None:
    """Which links a ray of a sensor's cone may reach, and how the sensor's link lies in theirs.

    origin, axis: (3,) of the sensor in its link `mount`; centre (L, 3), radius (L,) of the
    links' spheres. Writes T_link_mount (L, 4, 4) of the links that are seen (L,).
    """
    B = T_base_link[mount]
    for link in range(len(T_base_link)):
        seen[link] = False
        if welded[link]:
            continue
        A, T = T_base_link[link], T_link_mount[link]
        for i in range(3):
            T[i, 3] = 0.0
            for j in range(3):
                T[i, 3] += A[j, i] * (B[j, 3] - A[j, 3])
                T[i, j] = A[0, i] * B[0, j] + A[1, i] * B[1, j] + A[2, i] * B[2, j]
        square, along = 0.0, 0.0
        for i in range(3):
            v = centre[link, i] - T[i, 3]
            a = 0.0
            for j in range(3):
                v -= T[i, j] * origin[j]
                a += T[i, j] * axis[j]
            square += v * v
            along += v * a
        distance = np.sqrt(square)
        if distance > radius[link]:
            if distance - radius[link] > far:
                continue
            angle = np.arccos(min(1.0, max(-1.0, along / distance)))
            if angle > cone + np.arcsin(radius[link] / distance):
                continue
        seen[link] = True


@compiled
def turned(T: Array, origin: Array, rays: Array) -> tuple[NDArray[np.float32], NDArray[np.float32]]:
    """Origins and directions (n, 3), float32, of rays (n, 3) from one origin, moved by T (4, 4)."""
    at = np.empty(3)
    for i in range(3):
        at[i] = T[i, 3] + T[i, 0] * origin[0] + T[i, 1] * origin[1] + T[i, 2] * origin[2]
    origins = np.empty(rays.shape, dtype=np.float32)
    directions = np.empty(rays.shape, dtype=np.float32)
    for n in range(len(rays)):
        for i in range(3):
            origins[n, i] = at[i]
            directions[n, i] = T[i, 0] * rays[n, 0] + T[i, 1] * rays[n, 1] + T[i, 2] * rays[n, 2]
    return origins, directions


@compiled
def nearer(
    t: NDArray[np.float32], what: int, hit: NDArray[np.float32], label: NDArray[np.int16]
) -> None:
    """Where t (n,) is the smaller ray length, it becomes `hit` (n,) and `what` its label (n,)."""
    for n in range(len(t)):
        if t[n] < hit[n]:
            hit[n], label[n] = t[n], what


@compiled
def gather(
    hit: NDArray[np.float32],
    label: NDArray[np.int16],
    cosine: Array,
    sub: int,
    depth: Array,
    merged: NDArray[np.bool_],
    what: NDArray[np.int16],
    pure: NDArray[np.bool_],
) -> None:
    """Merge the sub-rays of each zone as the sensor's pulse detection does.

    hit, label, cosine: (zones * sub,) ray lengths, what was hit, cosine to the axis. Writes
    depth, merged, what and pure (64,), as in `Reading`.
    """
    zones = len(hit) // sub
    for zone in range(zones, len(depth)):
        depth[zone], merged[zone], what[zone], pure[zone] = np.inf, False, -2, True
    for zone in range(zones):
        first, nearest = np.inf, zone * sub
        pure[zone] = True
        for i in range(zone * sub, (zone + 1) * sub):
            d = hit[i] * cosine[i]
            if d < first:
                first, nearest = d, i
            pure[zone] &= label[i] == label[zone * sub]
        what[zone] = label[nearest]
        merged[zone] = False
        depth[zone] = first
        if first == np.inf:
            continue
        total, count = 0.0, 0
        reach = first + max(PULSE, PULSE_SHARE * first)
        for i in range(zone * sub, (zone + 1) * sub):
            d = hit[i] * cosine[i]
            if d <= reach:
                total += d
                count += 1
            elif d < first + MERGE_DEPTH:
                merged[zone] = True
        depth[zone] = total / count
