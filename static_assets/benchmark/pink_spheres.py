"""pink (pip install pin-pink): differential IK with a barrier at every near point of the world."""

import numpy as np
import pinocchio as pin
from pink import Configuration, solve_ik
from pink.barriers import Barrier
from pink.exceptions import NoSolutionFound
from pink.limits import ConfigurationLimit, VelocityLimit
from pink.tasks import FrameTask

HARDLY, LED = 0.15, 0.5  # [m/s] slower points are no barrier; share of their speed asked for


class Points(Barrier):
    """h = d - d_s - w / gain of the given pairs, so that J qd - w >= -gain (d - d_s)."""

    def __init__(self, h, J, gain):
        super().__init__(len(h), gain=gain)
        self.h, self.J = h, J

    def compute_barrier(self, configuration):
        return self.h

    def compute_jacobian(self, configuration):
        return self.J


class PinkSpheres:
    """Its frame task, limits and barriers, solved by daqp; where that fails, come no nearer."""

    def __init__(self, arm):
        self.arm = arm
        self.configuration = Configuration(arm.model, arm.model.createData(), arm.home)
        self.task = FrameTask(arm.tool_frame, position_cost=1.0, orientation_cost=0.5)

    def act(self, frames, joints, goal):
        arm, near, p = self.arm, frames.near, self.arm.params
        posture, gain = arm.posture(joints.q), 1.0 / (p.avoidance_begins - p.distance_kept)
        self.configuration.update(np.array(joints.q))
        T = posture.T_base_tool if goal is None else arm.step_to(goal, posture)
        self.task.set_target(pin.SE3(T[:3, :3], T[:3, 3]))
        qd_max, J = p.joint_speed * arm.share * arm.qd_max, arm.rows(near, posture)
        most = np.abs(J) @ qd_max  # [m/s] at which a point can be led away at all
        able = most > HARDLY
        h = near.distance - p.distance_kept - np.maximum(near.approach, 0.0) / gain
        h = np.maximum(h, -LED * most / gain)[able]
        for ease in (0.0, 0.5, 1.0):  # it has no slack: in the end standing will do
            barrier = Points(np.where(h < 0.0, (1.0 - ease) * h, h), J[able], gain)
            limits = [ConfigurationLimit(arm.model), VelocityLimit(arm.model, qd_max)]
            try:
                return solve_ik(
                    self.configuration,
                    [self.task],
                    arm.dt,
                    "daqp",
                    limits=limits,
                    damping=1e-4,
                    barriers=[barrier],
                    safety_break=False,
                )
            except NoSolutionFound:
                continue
        return np.zeros(arm.n)
