"""Poses 4x4 out of what a person writes."""

from collections.abc import Sequence

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
