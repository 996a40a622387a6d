"""Which links and bodies can still be near: lower bounds from exact distances measured before.

An exact answer costs up to a millisecond. Since a pair was last measured, no point of the link
can have moved farther against the body than its bounding sphere has, turned and shifted. So the
last answer less that way is a lower bound.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, BodyPose
from app.robot.model import Robot

ROUNDING = 1e-5  # [m] exact answers differ by less from the truth


class PairBounds:
    """Of `links` (rows of the robot's body links) and a number of bodies."""

    def __init__(self, robot: Robot, links: NDArray[np.intp], bodies: int) -> None:
        balls = [robot.rigid[i] for i in links]
        self._centre = np.array([b.centre for b in balls]).reshape(-1, 3)
        self._radius = np.array([b.radius for b in balls])
        self._bound = np.full((len(links), bodies), -np.inf)
        self._T_body_link = np.tile(np.eye(4), (len(links), bodies, 1, 1))  # when it was found
        self._T = self._T_body_link.copy()  # now

    def now(self, T_link: Array, bodies: Sequence[BodyPose]) -> Array:
        """Lower bounds [m] (links, bodies) with the links at T_link (links, 4, 4)."""
        T_body = np.array([b.T_base_body for b in bodies]).reshape(-1, 4, 4)
        out = np.empty(self._bound.shape)
        _lessened(
            self._bound, self._T_body_link, self._centre, self._radius, T_link, T_body, self._T, out
        )
        return out

    def measured(self, link: int, body: int, distance: float) -> None:
        """Keep a distance [m], exact or a bound, of a pair as it now is; of contact nothing is."""
        self._bound[link, body] = distance if distance > 0.0 else -np.inf
        self._T_body_link[link, body] = self._T[link, body]


@compiled
def _lessened(
    bound: Array, T_then: Array, centre: Array, radius: Array, T_link: Array, T_body: Array,
    T_body_link: Array, out: Array,
) -> None:  # fmt: skip
    """Write where the links are in the bodies' frames (l, b, 4, 4), and the bounds (l, b) that are
    left [m] of those of when they were at `T_then`."""
    D = np.empty((3, 4))
    for n in range(len(T_link)):
        for b in range(len(T_body)):
            T, L, B = T_body_link[n, b], T_link[n], T_body[b]
            way, turn = 0.0, 0.0
            for i in range(3):
                for j in range(4):
                    T[i, j] = 0.0
                    for k in range(3):
                        T[i, j] += B[k, i] * (L[k, j] - (B[k, 3] if j == 3 else 0.0))
                    D[i, j] = T[i, j] - T_then[n, b, i, j]
                c, step = centre[n], D[i, 3]
                for j in range(3):
                    step += D[i, j] * c[j]
                    turn += D[i, j] ** 2
                way += step * step
            # the largest stretch of a difference of two rotations is its Frobenius norm by sqrt(2)
            farthest = np.sqrt(way) + np.sqrt(turn / 2.0) * radius[n]
            out[n, b] = bound[n, b] - farthest - ROUNDING
