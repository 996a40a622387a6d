"""The paper's controller and its kin: keep the closest pair apart first, go to the goal second.

    level 1   d_dot = J qd - w      = lambda (d_min + delta - d)     fading in with a(d)
    level 2   the tool's six rows   = the bounded twist towards the goal
    level 3   all joints            = 0

J is the row of the distance's rate along the pair's normal, w the speed at which the world
comes. Which control points there are (any point of the body, or the sensors' mounts) is decided
by the pairs that are asked for. With `every_link` level 1 has one row for each link that is
near, so that a change of the closest link does not move the arm.

Borelli et al., "Generating Whole-Body Avoidance Motion through Localized Proximity Sensing"
(2024) is `paper`. The others add what that lacks: a cap on what a point may ask for that the
joints can hardly move, holding on to a row among equals, and w.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.config import Params
from app.control.controller import Situation
from app.control.goals import goal_twist
from app.control.limit_task import limit_task
from app.control.limits import bring_into, velocity_box
from app.control.registry import fading_distances
from app.control.task_priority import Task, solve
from app.granted import Wish
from app.messages import Command, Goal, freeze
from app.robot.model import Robot
from app.robot.posture import Posture

# A point near the base's axes buys its few mm/s with a swing of the distal links, which at that
# moment nobody protects: without a cap 2 of 3 runs beside a person ended in contact, with it none
# (worst -0.11 m and +0.07 m; the values are the specification's, section 1.6).
KAPPA = 0.15  # share of the reachable speed along the normal that may be asked for
HARDLY = 0.05  # [m/s] a row that joints cannot move faster is left out; it fades in up to twice it
HELD = 0.01  # [m] the acted-on row stays until another is nearer by more: about one sigma of range
LAMBDA = 2.0  # [1/s] the paper gives none; above the goal's gains, far below 15 frames a second
FASTEST = 0.6  # [m/s] that the task may ask for: twice the goal speed
NOWHERE = 1e-9  # [m/s] no joint moves the point along the normal


class Safety(NamedTuple):
    """The task of level 1, None while nothing is near, and the nearest row that it acts on."""

    task: Task | None
    row: int


class TaskPriorityController:
    """every_link: a row for each near link, else one.   published: nothing that the paper lacks."""

    def __init__(self, robot: Robot, *, every_link: bool = False, published: bool = False) -> None:
        self._robot, self._every_link, self._published = robot, every_link, published
        self._rest = Task(np.eye(robot.n), np.zeros(robot.n), np.ones(robot.n))
        self.reset()

    def reset(self) -> None:
        """Hold on to no row."""
        self._held = -1  # the measured pair that was acted on

    def update(self, now: Situation) -> Command:
        """The next command."""
        robot, params = self._robot, now.params
        speed = params.joint_speed * now.share
        box = velocity_box(robot, now.joints.q, speed, now.dt, now.applied)
        safety = self._safety(now)
        self._held = now.pairs.measured(safety.row)
        tasks = [safety.task] if safety.task else []
        if now.wish is not None:
            tasks.append(wish_task(now.posture, now.wish))
        else:
            tasks += goal_tasks(now.posture, now.goal, params)
        tasks.append(self._rest)
        if params.limits_first:
            tasks.insert(0, limit_task(robot, now.joints.q))
        rho, fitting = solve(tasks, speed * robot.qd_max)
        qd, shortened = bring_into(rho, now.applied, box)
        nearest = int(np.argmax(safety.task.activation)) if safety.task else 0
        return Command(
            qd=freeze(qd),
            activation=float(safety.task.activation[nearest]) if safety.task else 0.0,
            reference=float(safety.task.reference[nearest]) if safety.task else 0.0,
            progress=min(fitting, shortened),
            control_row=safety.row,
        )

    def _safety(self, now: Situation) -> Safety:
        """Level 1 for the closest pair, or every near link, that joints can do something about."""
        pairs, params = now.pairs, now.params
        full, begins = fading_distances(params)
        near = np.flatnonzero(pairs.distance < begins)
        if len(near) == 0:
            return Safety(None, -1)
        J = now.posture.distance_rows(pairs.link[near], pairs.on_robot[near], pairs.normal[near])
        reachable = np.abs(J) @ (params.joint_speed * self._robot.qd_max)  # [m/s], all at limits
        able = reachable > (NOWHERE if self._published else HARDLY)
        if not able.any():
            return Safety(None, -1)
        order = self._order(now, near, able)
        d, J, reachable, near = pairs.distance[near][order], J[order], reachable[order], near[order]
        reference = LAMBDA * (begins - d)
        if pairs.approach is not None:
            reference = reference + pairs.approach[near]
        reference = np.minimum(np.maximum(reference, -FASTEST), FASTEST)
        a = np.array([activation(x, full, begins - full) for x in d])
        if not self._published:
            reference = np.minimum(reference, KAPPA * reachable)
            a *= np.minimum((reachable - HARDLY) / HARDLY, 1.0)
        return Safety(Task(J, reference, a), int(near[0]))

    def _order(
        self, now: Situation, near: NDArray[np.intp], able: NDArray[np.bool_]
    ) -> NDArray[np.intp]:
        """Which of the `near` rows (k,) make tasks, the nearest first; only those `able` (k,)."""
        d = now.pairs.distance[near]
        if not self._published and self._held >= 0:
            same = [now.pairs.measured(row) == self._held for row in near]
            d = d - np.where(same, HELD, 0.0)
        order = np.argsort(np.where(able, d, np.inf), kind="stable")[: int(able.sum())]
        if not self._every_link:
            return order[:1]
        _, first = np.unique(now.pairs.link[near][order], return_index=True)
        return order[np.sort(first)]


def activation(distance: float, d_min: float, delta: float) -> float:
    """a = (1 + cos(pi (d - d_min) / delta)) / 2, between 1 up to `d_min` and 0 from their sum on
    (all [m]).
    """
    share = (distance - d_min) / delta
    return float(0.5 * (1.0 + np.cos(np.pi * min(max(share, 0.0), 1.0))))


def goal_tasks(posture: Posture, goal: Goal | None, params: Params) -> list[Task]:
    """The tool's six rows as one level, or position before orientation."""
    if goal is None:
        return []
    twist = goal_twist(
        posture.T_base_tool, goal.T_base_tool, params.goal_speed, params.goal_turning
    )
    J = posture.tool_jacobian()
    levels = (slice(0, 3), slice(3, 6)) if params.position_first else (slice(0, 6),)
    return [Task(J[k], twist[k], np.ones(len(twist[k]))) for k in levels]


def wish_task(posture: Posture, wish: Wish) -> Task:
    """The velocity that is asked for as a level: of the tool, or of every joint."""
    if wish.qd is not None:
        return Task(np.eye(len(wish.qd)), wish.qd, np.ones(len(wish.qd)))
    assert wish.twist is not None  # one of the two is given
    return Task(posture.tool_jacobian(), wish.twist, np.ones(6))
