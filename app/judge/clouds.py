"""The paper's distance: from the robot's cloud to the environment's."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.judge.sampling import surface_points
from app.messages import Array
from app.robot.model import Robot

ROUNDING = 1e-6  # [m]
SPACING = 0.010  # [m] of the robot's cloud


class CloudDistance:
    """d_paper(t) = min |p - s| over points p of the environment and samples s of the robot [m].

    The robot's meshes are sampled at `SPACING`, no point of them farther than twice that from a
    sample; so the figure is a few millimetres too large, at most that much before a corner, and by
    all that no sensor sees.
    links: rows of the robot's body links that count.
    """

    def __init__(self, robot: Robot, links: Sequence[int] | NDArray[np.intp]) -> None:
        self._links = [int(i) for i in links]
        bodies = [robot.bodies[i] for i in self._links]
        self._trees = [KDTree(surface_points(b.vertices, b.faces, SPACING)) for b in bodies]
        self._centre = np.array([robot.rigid[i].centre for i in self._links])
        self._radius = np.array([robot.rigid[i].radius for i in self._links])

    def measure(self, T_base_link: Array, points: Array) -> float:
        """With the links at T_base_link (L, 4, 4) and the environment's points (m, 3) [m], base
        frame; +inf without any."""
        if not len(points):
            return np.inf
        T = T_base_link[self._links]
        at = np.einsum("lij,lj->li", T[:, :3, :3], self._centre) + T[:, :3, 3]
        least = np.linalg.norm(points - at[:, None], axis=2) - self._radius[:, None] - ROUNDING
        best = np.inf
        for i in np.argsort(least.min(axis=1)):  # few points and links can be the nearest
            near = least[i] < best
            if near.any():
                own = (points - T[i, :3, 3]) @ T[i, :3, :3]
                away, _ = self._trees[i].query(own[near], distance_upper_bound=best)
                best = min(best, float(np.min(away)))
        return best
