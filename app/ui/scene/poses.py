"""Poses between 4x4 matrices and what viser takes."""

import numpy as np
from viser import transforms as vt

from app.messages import Array


def wxyz(T: Array) -> Array:
    """Quaternions (..., 4) wxyz of poses (..., 4, 4)."""
    return np.asarray(vt.SO3.from_matrix(T[..., :3, :3]).wxyz)


def pose(quaternion: Array, position: Array) -> Array:
    """The pose (4, 4) of a handle's `wxyz` (4,) and `position` (3,)."""
    T = np.eye(4)
    T[:3, :3] = vt.SO3(np.asarray(quaternion, dtype=np.float64)).as_matrix()
    T[:3, 3] = position
    return T
