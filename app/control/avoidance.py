"""The paper's controller: keep the closest pair apart first, go to the goal second.

Level 1 is one row, the rate of the distance along the pair's normal; level 2 the six rows of
the tool; level 3 asks every direction that is left for rest. Which control points there are
(any point of the body, or the sensors' mounts) is decided by the pairs that are handed in.
With `rows="links"` level 1 has one row for every link that is near, so that a change of the
closest link does not move the arm.
"""

from typing import Literal, NamedTuple

import numpy as np

from app.config import Params
from app.control.goals import goal_twist
from app.control.limit_task import limit_task
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
    """The avoidance task, None while nothing is near, and the nearest row that it acts on."""

    task: Task | None
    row: int


class Avoidance:
    """Turns pairs and a goal into joint velocities that keep every limit."""

    def __init__(self, robot: Robot, rows: Literal["closest", "links"] = "closest") -> None:
        self._robot, self._rows = robot, rows
        self._rest = Task(np.eye(robot.n), np.zeros(robot.n), np.ones(robot.n))
        self.reset()

    def reset(self, previous: Array | None = None) -> None:
        """Start again from rest, or from the command `previous` (n,) that is in force."""
        self.previous = np.zeros(self._robot.n) if previous is None else previous
        self._row = -1

    def update(
        self,
        posture: Posture,
        joints: JointState,
        pairs: Pairs,
        goal: Goal | None,
        params: Params,
        dt: float,
        approach: Array | None = None,
        share: float = 1.0,
    ) -> Command:
        """The next command; `goal` None means: rest where you are, but give way.

        approach: (B,) [m/s] speed of each pair's world point towards the robot.
        share: 0..1 of the allowed speed, less while the sensors are silent.
        """
        robot = self._robot
        speed = params.speed * share
        box = velocity_box(robot, joints.q, speed, dt, self.previous)
        qd_max = speed * robot.qd_max
        safety = self._safety(posture, pairs, params, params.speed * robot.qd_max, approach)
        self._row = safety.row
        tasks = [safety.task] if safety.task else []
        tasks += _goal_tasks(posture, goal, params)
        tasks.append(self._rest)
        if params.limit_task:
            tasks.insert(0, limit_task(robot, joints.q))
        reg = Regularisation(params.lambda_r, params.theta, params.eta)
        rho, scale = solve(tasks, qd_max, reg)
        qd, shortened = bring_into(rho, self.previous, box)
        self.previous = qd
        nearest = int(np.argmax(safety.task.activation)) if safety.task else 0
        return Command(
            qd=freeze(qd.copy()),
            activation=float(safety.task.activation[nearest]) if safety.task else 0.0,
            reference=float(safety.task.reference[nearest]) if safety.task else 0.0,
            scale=min(scale, shortened),
            control_row=safety.row,
        )

    def brake(self, joints: JointState, dt: float) -> Command:
        """As fast to rest as the acceleration limits allow."""
        box = velocity_box(self._robot, joints.q, 1.0, dt)
        qd, _ = bring_into(np.zeros(self._robot.n), self.previous, box)
        self.previous = qd
        return Command(qd=freeze(qd.copy()))

    def _safety(
        self,
        posture: Posture,
        pairs: Pairs,
        params: Params,
        qd_max: Array,
        approach: Array | None,
    ) -> _Safety:
        """Level 1 for the closest pair, or every near link, that joints can do something about.

        A link that cannot move (the base), or hardly along the normal (the upper arm near its
        root), is passed over: its row would buy a few mm/s with a swing of the distal links,
        which at that moment nobody protects. It fades out before that, so that no row
        vanishes at once.
        """
        near = np.flatnonzero(pairs.distance < params.d_min + params.delta)
        if len(near) == 0:
            return _Safety(None, -1)
        J = posture.distance_rows(pairs.link[near], pairs.on_robot[near], pairs.normal[near])
        reachable = np.abs(J) @ qd_max  # [m/s] along the normal with all joints at their limit
        least = params.v_ach_min if params.authority_cap else 1e-9
        able = reachable > least
        if not able.any():
            return _Safety(None, -1)
        d = pairs.distance[near]
        # hold on to the row of the last tick while no other is nearer by more than the margin
        lead = np.where(near == self._row, params.pair_hold, 0.0)
        order = np.argsort(np.where(able, d - lead, np.inf), kind="stable")[: int(able.sum())]
        if self._rows == "closest":
            order = order[:1]
        else:
            _, first = np.unique(pairs.link[near][order], return_index=True)
            order = order[np.sort(first)]  # the nearest row of each link, nearest link first
        d, J, reachable = d[order], J[order], reachable[order]
        reference = params.lambda_safety * (params.d_min + params.delta - d)
        if approach is not None:  # d_dot = J qd - w: the distance follows while the world moves
            reference = reference + approach[near[order]]
        reference = np.minimum(np.maximum(reference, -params.v_safe), params.v_safe)
        a = np.array([activation(x, params.d_min, params.delta) for x in d])
        if params.authority_cap:
            reference = np.minimum(reference, params.kappa * reachable)
            a *= np.minimum((reachable - least) / max(least, 1e-9), 1.0)
        return _Safety(Task(J, reference, a), int(near[order[0]]))


def _goal_tasks(posture: Posture, goal: Goal | None, params: Params) -> list[Task]:
    """The tool's six rows as one level, or position before orientation."""
    if goal is None:
        return []
    twist = goal_twist(
        posture.T_base_tool, goal.T_base_tool, params.lambda_p, params.lambda_o,
        params.v_max, params.w_max,
    )  # fmt: skip
    J = posture.tool_jacobian()
    levels = (slice(0, 3), slice(3, 6)) if params.goal_split else (slice(0, 6),)
    return [Task(J[k], twist[k], np.ones(len(twist[k]))) for k in levels]
