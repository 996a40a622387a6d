"""NEO on given pairs, written from its publication, solved with quadprog.

Haviland and Corke, "NEO: A novel expeditious optimisation algorithm for reactive motion control
of manipulators", RA-L 2021:  x = [ qd | d ], the d being slack in the tool's six rows,

    minimise  lambda_q |qd|^2 / 2 + |d|^2 / (2 e) - grad(mu) . qd
    such that J qd + d = t ,  -J_i qd <= xi (d_i - d_s) / (d_inf - d_s) ,  dampers of the joints
"""

from collections.abc import Callable
from importlib import import_module
from typing import Any

import numpy as np

from app.config import Params
from app.control.bounds.pairs import gamma
from app.control.goals import goal_error, goal_twist
from app.control.manipulability import manipulability, manipulability_gradient
from app.robot.model import Robot

LAMBDA_Q, LONGEST = 0.01, 10.0  # of the publication: cost of speed, bound of the slack
XI_JOINT, NEAR_JOINT, LEAST_JOINT = 1.0, 0.9, 0.05  # [1/s], [rad], [rad] of the joints' dampers


def neo_step(robot: Robot, k: int) -> Callable[[Any], bool]:
    """One step: a posture, a goal and the pairs of a case to a joint velocity."""
    solve_qp = import_module("qpsolvers").solve_qp
    params, n = Params(), robot.n
    most = np.concatenate((robot.qd_max, np.full(6, LONGEST)))

    def step(c: Any) -> bool:
        posture = robot.posture(c.posture.q)  # its own kinematics, inside of the clock
        J, q = posture.tool_jacobian(), posture.q
        T, goal = posture.T_base_tool, c.goal.T_base_tool
        t = goal_twist(T, goal, params.goal_speed, params.goal_turning)
        e = max(sum(goal_error(T, goal)), 1e-3)
        Q = np.diag(np.concatenate((np.full(n, LAMBDA_Q), np.full(6, 1.0 / e))))
        g = np.concatenate((-manipulability_gradient(posture, manipulability(J)), np.zeros(6)))
        rows = posture.distance_rows(c.pairs.link, c.pairs.on_robot, c.pairs.normal)
        near = c.pairs.distance < params.avoidance_begins
        free = gamma(params) * (c.pairs.distance - params.distance_kept)
        room = np.concatenate((robot.q_max - q, q - robot.q_min))
        close = room < NEAR_JOINT
        ends = np.concatenate((np.eye(n), -np.eye(n)))[close]
        slow = XI_JOINT * (room[close] - LEAST_JOINT) / (NEAR_JOINT - LEAST_JOINT)
        G = np.concatenate((-rows[near], ends))
        G = np.concatenate((G, np.zeros((len(G), 6))), axis=1)
        x = solve_qp(
            Q, g, G, np.concatenate((free[near], slow)),
            np.concatenate((J, np.eye(6)), axis=1), t, -most, most, solver="quadprog",
        )  # fmt: skip
        return x is not None

    return step
