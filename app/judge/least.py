"""The least true distance of a whole run, for a few exact measurements.

An exact answer costs up to a millisecond. Since a pair was last measured, no point of the link
can have moved farther against the body than its bounding sphere has, turned and shifted. So the
last answer less that way is a lower bound, and while that is not below the least distance so
far, the pair is left alone.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.judge.truth import TrueDistance
from app.messages import Array, BodyPose
from app.robot.model import Robot
from app.world.world import World

ROUNDING = 1e-5  # [m] exact answers differ by less from the truth


class LeastDistance:
    """Watches `links` (rows of the robot's body links) and the bodies that `world` now has."""

    def __init__(
        self, truth: TrueDistance, robot: Robot, links: NDArray[np.intp], world: World
    ) -> None:
        self.least = np.inf  # [m] so far; zero or less on contact, and then no depth
        self._truth, self._links = truth, links
        self._shapes = list(world.shapes().values())
        balls = [robot.rigid[i] for i in links]
        self._centre = np.array([[*b.centre, 1.0] for b in balls])
        self._radius = np.array([b.radius for b in balls])[:, None]
        pairs = (len(links), len(self._shapes))
        self._bound = np.full(pairs, -np.inf)
        self._T_body_link = np.tile(np.eye(4), (*pairs, 1, 1))  # when the bound was found

    def update(self, T_base_link: Array, bodies: Sequence[BodyPose]) -> float:
        """The least distance [m] until now, with links at T_base_link (L, 4, 4), all of them."""
        T_link = T_base_link[self._links]
        T_body = np.array([b.T_base_body for b in bodies]).reshape(-1, 4, 4)
        T = np.linalg.inv(T_body)[None] @ T_link[:, None]
        moved = T - self._T_body_link
        way = np.linalg.norm(np.einsum("lbij,lj->lbi", moved, self._centre), axis=-1)
        # the largest stretch of a difference of two rotations is its Frobenius norm by sqrt(2)
        turn = np.linalg.norm(moved[..., :3, :3], axis=(-2, -1)) / np.sqrt(2.0)
        bound = self._bound - way - turn * self._radius - ROUNDING
        for pair in np.argsort(bound, axis=None):
            i, j = divmod(int(pair), len(bodies))
            needed = max(self.least, 0.0)
            if bound[i, j] > needed:
                break
            link = int(self._links[i])
            d = self._truth.pair(link, T_link[i], self._shapes[j], T_body[j], needed)
            self.least = min(self.least, d)
            self._bound[i, j] = d if d > 0.0 else -np.inf
            self._T_body_link[i, j] = T[i, j]
        return self.least
