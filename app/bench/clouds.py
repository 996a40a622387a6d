"""Rays and clouds that ours and its peers are asked about."""

import numpy as np

from app.messages import Array
from app.perception.proximity import BodyPairs
from app.robot.posture import Posture
from app.robot.skin import Skin


def points_outside(body: BodyPairs, posture: Posture, rng: np.random.Generator, n: int) -> Array:
    """Points (n, 3) around the arm and outside of it, so that unsigned answers are the same."""
    out, one = np.empty((0, 3)), np.ones(1, dtype=bool)
    while len(out) < n:
        points = rng.uniform(-1.0, 1.0, (n, 3))
        clear = [body.search(p[None], one, posture).minimum > 0.0 for p in points]
        out = np.concatenate((out, points[clear]))
    return out[:n]


def centre_rays(skin: Skin, posture: Posture, near: float) -> tuple[Array, Array]:
    """Origins and unit directions (S, 3) of the centre rays, base frame, near cut applied."""
    T = posture.T_base_link[skin.link[skin.sensor_of]]
    direction = np.einsum("sij,sj->si", T[:, :3, :3], skin.reach)
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    lens = skin.origin[skin.sensor_of]
    origin = np.einsum("sij,sj->si", T[:, :3, :3], lens) + T[:, :3, 3]
    return origin + near * direction, direction


def count_unlike(hit: Array, depth: Array, length: Array) -> int:
    """Zones whose hit differs by more than 0.1 mm from ours, or is there for one only."""
    theirs = hit / length
    both = np.isfinite(theirs) & np.isfinite(depth)
    far = np.zeros(len(hit), dtype=bool)
    far[both] = np.abs(theirs[both] - depth[both]) > 1e-4
    return int((far | (np.isfinite(theirs) != np.isfinite(depth))).sum())
