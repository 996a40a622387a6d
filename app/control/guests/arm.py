"""The arm as a guest sees it: its kinematics, its limits and where its sensors look."""

from functools import cached_property
from typing import Any

import numpy as np

from app.config import Params
from app.control.goals import goal_twist
from app.control.guests.frames import Near
from app.errors import RobotError
from app.messages import Array, SensorFrame
from app.robot.model import Robot
from app.robot.posture import Posture, rotation_matrix
from app.robot.skin import Skin
from app.robot.skin_file import load_skin


class Arm:
    """Joint values are (n,) in rad and rad/s, poses 4x4 in the base frame.

    name, n, joints, links, tool_frame, home, q_min, q_max, qd_max, qdd_max: the robot's facts.
    dt:      [s] that the next command will hold.
    params:  the settings in force: `distance_kept`, `goal_speed`, `joint_speed`, ...
    share:   0..1 of the speed that is allowed now; commands are cut to it.
    applied: (n,) what the arm was told in the last tick.
    """

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.name, self.n, self.tool_frame = robot.name, robot.n, robot.tool_frame
        self.joints, self.links, self.home = robot.joints, robot.links, robot.home
        self.q_min, self.q_max = robot.q_min, robot.q_max
        self.qd_max, self.qdd_max = robot.qd_max, robot.qdd_max
        self.dt, self.share = 0.004, 1.0
        self.params = Params()
        self.applied: Array = np.zeros(robot.n)

    @property
    def model(self) -> Any:
        """pinocchio's model of the arm."""
        return self._robot._model

    @cached_property
    def skin(self) -> Skin:
        """Where every sensor and zone looks, as the layout says; RobotError without one."""
        if self._robot.layout is None:
            raise RobotError(f"{self.name} wears no skin; choose a layout with --skin")
        return load_skin(self._robot.layout, self._robot)

    def posture(self, q: Array) -> Posture:
        """Kinematics at q: `T_base_tool`, `T_base_link` (L, 4, 4), `tool_jacobian()` (6, n),
        linear rows first."""
        return self._robot.posture(q)

    def rows(self, near: Near, posture: Posture) -> Array:
        """(m, n) by how much each joint's velocity makes the distance of each pair grow:
        d_dot = row . qd - approach."""
        return posture.distance_rows(near.link, near.on_robot, near.normal)

    def twist(self, goal: Array, posture: Posture) -> Array:
        """(6,) [m/s, rad/s] towards the goal, as fast as the settings allow: the same that
        Flinch's own controllers follow."""
        p = self.params
        return goal_twist(posture.T_base_tool, goal, p.goal_speed, p.goal_turning)

    def step_to(self, goal: Array, posture: Posture) -> Array:
        """(4, 4) where the tool should be after the next `dt`, on its way to the goal."""
        twist, T = self.twist(goal, posture) * self.dt, np.eye(4)
        T[:3, :3] = rotation_matrix(twist[3:]) @ posture.T_base_tool[:3, :3]
        T[:3, 3] = posture.T_base_tool[:3, 3] + twist[:3]
        return T

    def zones(self, frame: SensorFrame, posture: Posture) -> Array:
        """(zones, 3) [m] points of a raw frame, base frame, with all that is on them: the arm's
        own body, ghosts, junk; NaN where the sensor saw nothing. `posture`: where the arm was."""
        skin = self.skin
        k, T = frame.sensor, posture.T_base_link[skin.link[frame.sensor]]
        d = skin.believed(k, frame.distance, frame.status, frame.targets)
        local = skin.origin[k] + d[:, None] * skin.reach[skin.zones(k)]
        return np.asarray(local @ T[:3, :3].T + T[:3, 3])
