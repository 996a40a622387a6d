"""A potential field after Khatib (1986): every link is pushed away from its nearest point."""

import numpy as np

BEGINS, STRENGTH, DAMPING = 0.15, 0.02, 1e-3  # [m] beyond the distance kept, [m^4/s], [-]


class PotentialField:
    """v = STRENGTH (1/d - 1/d0) / d^2 along the normal through J^T; damped steps to the goal."""

    row = 0  # of `near`: what it acts on, for the continuity of the control point

    def __init__(self, arm):
        self.arm = arm

    def act(self, frames, joints, goal):
        arm, near = self.arm, frames.near
        posture, qd = arm.posture(joints.q), np.zeros(arm.n)
        if goal is not None:
            J = posture.tool_jacobian()
            damped = J @ J.T + DAMPING * np.eye(6)
            qd = J.T @ np.linalg.solve(damped, arm.twist(goal, posture))
        begins = arm.params.distance_kept + BEGINS
        _, first = np.unique(near.link, return_index=True)  # the nearest of each link
        first = first[near.distance[first] < begins]
        self.row = int(first.min()) if len(first) else -1
        d = np.maximum(near.distance[first], 0.02)
        push = STRENGTH * (1.0 / d - 1.0 / begins) / d**2
        return qd + arm.rows(near, posture)[first].T @ push
