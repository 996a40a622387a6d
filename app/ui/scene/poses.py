"""Poses between 4x4 matrices and what viser takes; and how many nodes are moved at once.

Assigning one pose to a viser handle takes a quarter of a millisecond, nearly all of it to find
out whether it differs from the last one. So a frame's poses are compared here together, and what
moved less than an eye can see is not sent: what is sent later is told from the last pose that was.
"""

from collections.abc import Sequence

import numpy as np
import viser
from viser import _messages as m
from viser import transforms as vt

from app.messages import Array
from app.poses import quaternion

STILL = 2e-4  # [m] of a place, and of an entry of a rotation matrix: less is not seen


class Nodes:
    """Nodes of the scene that are moved together, in their parents' frames."""

    def __init__(self, handles: Sequence[viser.SceneNodeHandle]) -> None:
        self._handles = tuple(handles)
        self._shown = np.full((len(self._handles), 4, 4), np.nan)

    def show(self, T: Array) -> None:
        """Move the nodes to `T` (N, 4, 4)."""
        off = ~(np.abs(T - self._shown) <= STILL)  # NaN: never shown
        for i in np.flatnonzero(off[:, :3, 3].any(axis=1)).tolist():
            self._shown[i, :3, 3] = T[i, :3, 3]
            place(self._handles[i], T[i, :3, 3])
        for i in np.flatnonzero(off[:, :3, :3].any(axis=(1, 2))).tolist():
            self._shown[i, :3, :3] = T[i, :3, :3]
            turn(self._handles[i], quaternion(T[i]))


def follow(handle: viser.SceneNodeHandle, T: Array) -> None:
    """Move to `T` (4, 4) a node that a mouse may have moved; q and -q are the same turn."""
    if np.abs(T[:3, 3] - handle.position).max() > STILL:
        place(handle, T[:3, 3])
    wxyz = quaternion(T)
    if abs(float(np.dot(wxyz, handle.wxyz))) < 1.0 - STILL**2:
        turn(handle, wxyz)


def place(handle: viser.SceneNodeHandle, position: Array) -> None:
    """What assigning `position` (3,) does, without the comparison."""
    node = handle._impl
    node.position[:] = position
    x, y, z = position.tolist()
    node.api._queue_scene_message(m.SetPositionMessage(node.name, (x, y, z)))


def turn(handle: viser.SceneNodeHandle, wxyz: tuple[float, float, float, float]) -> None:
    """What assigning `wxyz` does, without the comparison."""
    node = handle._impl
    node.wxyz[:] = wxyz
    node.api._queue_scene_message(m.SetOrientationMessage(node.name, wxyz))


def wxyz(T: Array) -> Array:
    """Quaternions (..., 4) wxyz of poses (..., 4, 4)."""
    return np.asarray(vt.SO3.from_matrix(T[..., :3, :3]).wxyz)


def pose(quaternion: Array, position: Array) -> Array:
    """The pose (4, 4) of a handle's `wxyz` (4,) and `position` (3,)."""
    T = np.eye(4)
    T[:3, :3] = vt.SO3(np.asarray(quaternion, dtype=np.float64)).as_matrix()
    T[:3, 3] = position
    return T
