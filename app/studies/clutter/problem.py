"""A problem: where the arm begins, where its tool should go, and what stands in between."""

from typing import NamedTuple

import numpy as np

from app.cell.parts import Cell
from app.control.goals import goal_error
from app.judge.truth import TrueDistance
from app.messages import Array, Goal, freeze
from app.robot.model import Robot
from app.world.scene import Scene
from app.world.world import Body, World

CLEAR = 0.03  # [m] true distance of the moving links that start and goal need
NEAR, TURNED = 0.01, np.radians(2.0)  # [m], [rad] of a pose that counts as found
STEPS, DAMPING, MOST = 200, 0.01, 0.3  # of the search, and [rad] of a joint in one step


class Problem(NamedTuple):
    """start: (n,) [rad].   T_base_goal: (4, 4) of the tool.   bodies: all that stands around."""

    name: str
    start: Array
    T_base_goal: Array
    bodies: tuple[Body, ...]

    def scene(self, robot: Robot) -> Scene:
        """Of which nothing is known to the arm."""
        goal = Goal(freeze(self.T_base_goal.copy()))
        cell, start = Cell(self.name, (), ()), freeze(self.start.copy())
        return Scene(self.name, self.name, self.bodies, cell, goal, start, robot.name)


def inverse(robot: Robot, T_base_tool: Array, q: Array) -> Array | None:
    """Joints (n,) [rad] of a pose, within their limits, from the seed `q` on; None if not found.

    Damped least squares: dq = J' (J J' + DAMPING^2 1)^-1 e, until the error is gone.
    """
    for _ in range(STEPS):
        posture = robot.posture(q)
        error = _error(posture.T_base_tool, T_base_tool)
        if float(np.abs(error).max()) < 1e-5:
            break
        J = posture.tool_jacobian()
        step = J.T @ np.linalg.solve(J @ J.T + DAMPING**2 * np.eye(6), error)
        step *= min(1.0, MOST / max(float(np.abs(step).max()), 1e-12))
        q = np.clip(q + step, robot.q_min, robot.q_max)
    away, turned = goal_error(robot.posture(q).T_base_tool, T_base_tool)
    return q if away <= NEAR and turned <= TURNED else None


def clearance(robot: Robot, truth: TrueDistance, q: Array, bodies: tuple[Body, ...]) -> float:
    """[m] of the moving links from what stands around."""
    moving = robot.supports.any(axis=1)
    return float(truth.measure(robot.posture(q).T_base_link, World(bodies))[moving].min())


def trouble(robot: Robot, truth: TrueDistance, problem: Problem, seed: Array) -> str:
    """Why a problem is none for this arm; '' for one that is. seed: (n,) joints near the goal."""
    if clearance(robot, truth, problem.start, problem.bodies) < CLEAR:
        return "the start is too near"
    goal = inverse(robot, problem.T_base_goal, seed)
    if goal is None:
        return "the goal is out of reach"
    if clearance(robot, truth, goal, problem.bodies) < CLEAR:
        return "the goal is too near"
    return ""


def _error(T: Array, T_goal: Array) -> Array:
    """(6,) place [m] and turn [rad], axes of the base, from one pose to another."""
    R = T_goal[:3, :3] @ T[:3, :3].T
    axis = 0.5 * np.array([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    sine, cosine = float(np.linalg.norm(axis)), 0.5 * (float(np.trace(R)) - 1.0)
    turn = axis * (np.arctan2(sine, cosine) / sine) if sine > 1e-9 else axis
    return np.concatenate((T_goal[:3, 3] - T[:3, 3], turn))
