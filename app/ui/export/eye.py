"""Where a film is seen from: the side on which the fewest bodies stand before the arm."""

from typing import NamedTuple

import numpy as np

from app.messages import Array, Snapshot
from app.raycast import RigidMesh

FOV = 0.75  # [rad] from the lower to the upper edge, as the page has it
AZIMUTHS = np.radians([-57.0, -35.0, -80.0, -10.0, -105.0, 20.0, -130.0, 50.0, 155.0, 125.0])
HEIGHT = 0.42  # of the distance, above the target
AWAY = 2.1  # [m] for an arm that reaches 1.3 m
WORTH = 0.02  # of the points that an earlier direction may hide more: the page's own is the first


class Eye(NamedTuple):
    """position, target: (3,) [m] base frame."""

    position: Array
    target: Array


def choose_eye(snapshot: Snapshot, closer: float = 1.0) -> Eye:
    """A place to see the arm and its goal from; `closer` divides the distance."""
    T_links, goal = snapshot.T_base_link, snapshot.goal.T_base_tool
    points = np.vstack((T_links[:, :3, 3], snapshot.T_base_tool[:3, 3], goal[:3, 3]))
    low, high = points.min(axis=0), points.max(axis=0)
    target = 0.5 * (low + high)
    away = AWAY * max(float(np.linalg.norm(high - low)) / 1.3, 0.4) / closer
    best, most = None, -np.inf
    for k, azimuth in enumerate(AZIMUTHS):
        side = np.array([np.cos(azimuth), np.sin(azimuth), HEIGHT])
        eye = target + away * side / np.linalg.norm(side)
        seen = visible(points, eye, snapshot) - WORTH * k
        if seen > most + 1e-9:
            best, most = eye, seen
    assert best is not None
    return Eye(best, target)


def visible(points: Array, eye: Array, snapshot: Snapshot) -> float:
    """Share of `points` (n, 3) that no body of the simulated world hides from `eye` (3,)."""
    rays = points - eye
    far = np.linalg.norm(rays, axis=1)
    seen = np.ones(len(points), dtype=bool)
    for pose in snapshot.world:
        R, p = pose.T_base_body[:3, :3], pose.T_base_body[:3, 3]
        origins = np.broadcast_to((eye - p) @ R, points.shape).astype(np.float32)
        directions = ((rays / far[:, None]) @ R).astype(np.float32)
        hit = RigidMesh(pose.view.vertices, pose.view.faces).cast(origins, directions)
        seen &= hit > far - 0.02
    return float(seen.mean())
