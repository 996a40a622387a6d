"""Which links and bodies can still be near: lower bounds from exact distances measured before.

An exact answer costs up to a millisecond. Since a pair was last measured, no point of the link
can have moved farther against the body than its bounding sphere has, turned and shifted. So the
last answer less that way is a lower bound.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, BodyPose
from app.robot.model import Robot

ROUNDING = 1e-5  # [m] exact answers differ by less from the truth


class PairBounds:
    """Of `links` (rows of the robot's body links) and a number of bodies."""

    def __init__(self, robot: Robot, links: NDArray[np.intp], bodies: int) -> None:
        balls = [robot.rigid[i] for i in links]
        self._centre = np.array([[*b.centre, 1.0] for b in balls])
        self._radius = np.array([b.radius for b in balls])[:, None]
        self._bound = np.full((len(links), bodies), -np.inf)
        self._T_body_link = np.tile(np.eye(4), (len(links), bodies, 1, 1))  # when it was found

    def now(self, T_link: Array, bodies: Sequence[BodyPose]) -> Array:
        """Lower bounds [m] (links, bodies) with the links at T_link (links, 4, 4)."""
        T_body = np.array([b.T_base_body for b in bodies]).reshape(-1, 4, 4)
        self._T = np.linalg.inv(T_body)[None] @ T_link[:, None]
        moved = self._T - self._T_body_link
        way = np.linalg.norm(np.einsum("lbij,lj->lbi", moved, self._centre), axis=-1)
        # the largest stretch of a difference of two rotations is its Frobenius norm by sqrt(2)
        turn = np.linalg.norm(moved[..., :3, :3], axis=(-2, -1)) / np.sqrt(2.0)
        return np.asarray(self._bound - way - turn * self._radius - ROUNDING)

    def measured(self, link: int, body: int, distance: float) -> None:
        """Keep a distance [m], exact or a bound, of a pair as it now is; of contact nothing is."""
        self._bound[link, body] = distance if distance > 0.0 else -np.inf
        self._T_body_link[link, body] = self._T[link, body]
