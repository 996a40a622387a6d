"""The simulated arm behind the virtual controller: velocities under an acceleration limit."""

import numpy as np

from app.messages import Array

QD_LIMIT = np.radians([120.0, 120.0, 180.0, 180.0, 180.0, 180.0])  # [rad/s] the UR10e's
Q_LIMIT = np.radians(360.0)  # [rad]


class Joints:
    """Six joints that follow a velocity exactly, but for the acceleration of the leading one."""

    def __init__(self, q: Array) -> None:
        self.q = np.array(q, dtype=np.float64)
        self.qd = np.zeros(6)
        self.target = np.zeros(6)

    def step(self, target: Array, acceleration: float, dt: float) -> None:
        """Go on for `dt` [s] towards the velocity `target` (6,) [rad/s].

        The leading axis takes `acceleration` [rad/s^2], the others their share of it.
        """
        self.target = np.clip(target, -QD_LIMIT, QD_LIMIT)
        change = self.target - self.qd
        largest = np.abs(change).max()
        if largest > acceleration * dt:
            change *= acceleration * dt / largest
        before, self.qd = self.qd, self.qd + change
        q = self.q + 0.5 * (before + self.qd) * dt
        self.q = np.clip(q, -Q_LIMIT, Q_LIMIT)
        self.qd = np.where(self.q == q, self.qd, 0.0)

    @property
    def still(self) -> bool:
        """Does no joint move?"""
        return not self.qd.any()
