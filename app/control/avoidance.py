"""The paper's controller: keep the closest pair apart first, go to the goal second.

Level 1 is one row, the rate of the distance along the pair's normal; level 2 the six rows of
the tool; level 3 asks every direction that is left for rest. Which control points there are
(any point of the body, or the sensors' mounts) is decided by the pairs that are handed in.
"""

from typing import NamedTuple

import numpy as np

from app.config import Params
from app.control.goals import goal_twist
from app.control.limits import bring_into, velocity_box
from app.control.task_priority import Regularisation, Task, solve
from app.messages import Array, Command, Goal, JointState, Pairs, freeze
from app.robot.model import Robot
from app.robot.posture import Posture


def activation(distance: float, d_min: float, delta: float) -> float:
    """1 up to `d_min`, 0 from `d_min + delta` on, a raised cosine between (all [m])."""
    share = (distance - d_min) / delta
    return float(0.5 * (1.0 + np.cos(np.pi * min(max(share, 0.0), 1.0))))


class _Safety(NamedTuple):
    """The avoidance task, None while nothing is near, and the row of the pairs it acts on."""

    task: Task | None
    row: int


class Avoidance:
    """Turns pairs and a goal into joint velocities that keep every limit."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self.reset()

    def reset(self) -> None:
        """Start again from rest."""
        self._previous = np.zeros(self._robot.n)
        self._row = -1

    def update(
        self,
        posture: Posture,
        joints: JointState,
        pairs: Pairs,
        goal: Goal | None,
        params: Params,
        dt: float,
    ) -> Command:
        """The next command; `goal` None means: rest where you are, but give way."""
        robot = self._robot
        box = velocity_box(robot, joints.q, params.speed, dt)
        qd_max = params.speed * robot.qd_max
        safety = self._safety(posture, pairs, params, qd_max)
        self._row = safety.row
        tasks = [t for t in (safety.task, _goal_task(posture, goal, params)) if t is not None]
        tasks.append(Task(np.eye(robot.n), np.zeros(robot.n), np.ones(robot.n)))
        reg = Regularisation(params.lambda_r, params.theta, params.eta)
        rho, scale = solve(tasks, qd_max, reg)
        qd, shortened = bring_into(rho, self._previous, box)
        self._previous = qd
        return Command(
            qd=freeze(qd.copy()),
            activation=float(safety.task.activation[0]) if safety.task else 0.0,
            reference=float(safety.task.reference[0]) if safety.task else 0.0,
            scale=min(scale, shortened),
            control_row=safety.row,
        )

    def brake(self, joints: JointState, dt: float) -> Command:
        """As fast to rest as the acceleration limits allow."""
        box = velocity_box(self._robot, joints.q, 1.0, dt)
        qd, _ = bring_into(np.zeros(self._robot.n), self._previous, box)
        self._previous = qd
        return Command(qd=freeze(qd.copy()))

    def _safety(self, posture: Posture, pairs: Pairs, params: Params, qd_max: Array) -> _Safety:
        """Level 1 for the closest pair that the joints can do something about.

        A link that cannot move (the base), or hardly along the normal (the upper arm near its
        root), is passed over: its row would buy a few mm/s with a swing of the distal links,
        which at that moment nobody protects.
        """
        near = np.flatnonzero(pairs.distance < params.d_min + params.delta)
        if len(near) == 0:
            return _Safety(None, -1)
        J = posture.distance_rows(pairs.link[near], pairs.on_robot[near], pairs.normal[near])
        reachable = np.abs(J) @ qd_max  # [m/s] along the normal with all joints at their limit
        able = reachable > (params.v_ach_min if params.authority_cap else 1e-9)
        if not able.any():
            return _Safety(None, -1)
        # hold on to the row of the last tick while no other is nearer by more than the margin
        lead = np.where(near == self._row, params.pair_hold, 0.0)
        i = int(np.argmin(np.where(able, pairs.distance[near] - lead, np.inf)))
        d = float(pairs.distance[near[i]])
        # d_dot = J qd - w: adding w lets the distance follow lambda (...) while the world moves
        w = 0.0 if pairs.approach is None else float(pairs.approach[near[i]])
        reference = w + params.lambda_safety * (params.d_min + params.delta - d)
        reference = min(max(reference, -params.v_safe), params.v_safe)
        if params.authority_cap:
            reference = min(reference, params.kappa * float(reachable[i]))
        a = activation(d, params.d_min, params.delta)
        return _Safety(Task(J[i : i + 1], np.array([reference]), np.array([a])), int(near[i]))


def _goal_task(posture: Posture, goal: Goal | None, params: Params) -> Task | None:
    if goal is None:
        return None
    twist = goal_twist(
        posture.T_base_tool, goal.T_base_tool, params.lambda_p, params.lambda_o,
        params.v_max, params.w_max,
    )  # fmt: skip
    return Task(posture.tool_jacobian(), twist, np.ones(6))
