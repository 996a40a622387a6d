"""Poses 4x4 out of what a person writes, and into quaternions."""

from collections.abc import Sequence
from math import copysign, sqrt

import numpy as np

from app.messages import Array, freeze


def pose(position_m: Sequence[float], rpy_deg: Sequence[float]) -> Array:
    """Pose (4, 4), read-only, of a table's place [m] and its turns [degrees]; see `transform`."""
    return freeze(transform(np.array(position_m, dtype=np.float64), np.radians(rpy_deg)))


def transform(position: Array, rpy: Array) -> Array:
    """Pose (4, 4) of a position (3,) [m] and turns (3,) [rad] about the fixed x, y, z axes."""
    (cr, cp, cy), (sr, sp, sy) = np.cos(rpy), np.sin(rpy)
    return np.array(
        [
            [cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr, position[0]],
            [sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr, position[1]],
            [-sp, cp * sr, cp * cr, position[2]],
            [0.0, 0.0, 0.0, 1.0],
        ]
    )


def quaternion(T: Array) -> tuple[float, float, float, float]:
    """Unit quaternion wxyz with w >= 0 of one pose (4, 4).

    The largest of the four components comes from the diagonal, the others from it (Shepperd,
    1978): in plain numbers, ten times faster than arrays of this size.
    """
    (a, b, c, _), (d, e, f, _), (g, h, i, _), _ = T.tolist()
    w, x, y, z = 1 + a + e + i, 1 + a - e - i, 1 - a + e - i, 1 - a - e + i
    largest = max(w, x, y, z)
    s = 2.0 * sqrt(largest)
    if largest == w:
        q = (0.25 * s, (h - f) / s, (c - g) / s, (d - b) / s)
    elif largest == x:
        q = ((h - f) / s, 0.25 * s, (b + d) / s, (c + g) / s)
    elif largest == y:
        q = ((c - g) / s, (b + d) / s, 0.25 * s, (f + h) / s)
    else:
        q = ((d - b) / s, (c + g) / s, (f + h) / s, 0.25 * s)
    sign = copysign(1.0, q[0])
    return sign * q[0], sign * q[1], sign * q[2], sign * q[3]


def turns(T: Array) -> tuple[float, float, float]:
    """Roll, pitch, yaw [rad] about the fixed x, y, z axes of a pose (4, 4): `transform` backwards.

    Where it looks straight up or down, the roll is taken as none.
    """
    flat = float(np.hypot(T[0, 0], T[1, 0]))
    pitch = float(np.arctan2(-T[2, 0], flat))
    if flat < 1e-6:
        return 0.0, pitch, float(np.arctan2(-T[0, 1], T[1, 1]))
    return float(np.arctan2(T[2, 1], T[2, 2])), pitch, float(np.arctan2(T[1, 0], T[0, 0]))
