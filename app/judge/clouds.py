"""The paper's distance: from the robot's cloud to the environment's."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from app.judge.sampling import surface_points
from app.messages import Array
from app.robot.model import Robot

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

    def measure(self, T_base_link: Array, points: Array) -> float:
        """With the links at T_base_link (L, 4, 4) and the environment's points (m, 3) [m], base
        frame; +inf without any."""
        best = np.inf
        for link, tree in zip(self._links, self._trees, strict=True):
            R, p = T_base_link[link, :3, :3], T_base_link[link, :3, 3]
            away, _ = tree.query((points - p) @ R, distance_upper_bound=best)
            best = min(best, float(np.min(away, initial=np.inf)))
        return best
