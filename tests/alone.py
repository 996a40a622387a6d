"""A controller by itself: what it asks for is what the arm is told, and pairs are as they are."""

from dataclasses import replace

import numpy as np

from app.cell.parts import Cell
from app.control.bounds.rows import empty_sheet, rows_of
from app.control.clearance import Clearance
from app.control.controller import Situation
from app.control.limits import Step, braked
from app.control.qp_controller import QpController
from app.control.registry import kind_of
from app.control.task_priority_controller import TaskPriorityController
from app.messages import JointState

__all__ = ["Alone", "QpController", "TaskPriorityController", "alone", "bound_by"]


class Alone:
    """Steps a controller without perception, program and supervisor."""

    def __init__(self, robot, controller, clearance=None):
        self.robot, self.controller, self.clearance = robot, controller, clearance
        self.reset()

    def reset(self, previous=None):
        self.previous = np.zeros(self.robot.n) if previous is None else previous
        self.controller.reset()

    def update(self, posture, joints, pairs, goal, params, dt, approach=None, share=1.0):
        if approach is not None:
            pairs = replace(pairs, approach=approach)
        now = Situation(posture, joints, pairs, goal, params, dt, share, self.previous)
        command = self.controller.update(now)
        self.previous = command.qd.copy()
        return command

    def brake(self, joints, dt):
        self.previous = braked(self.robot, joints.q, dt, self.previous)
        return self.previous


def bound_by(robot, bound, posture, pairs, params, previous=None, dt=1e6):
    """The rows of one kind of bound, or of several, as wide as can be: none is left out because
    no velocity breaks it, and by default none is eased in.
    """
    wide, before = np.full(robot.n, np.inf), np.zeros(robot.n) if previous is None else previous
    step = Step(-wide, wide, before, params.joint_speed * robot.qd_max, robot.qdd_max, dt)
    now = Situation(
        posture, JointState(0.0, posture.q, before), pairs, None, params, dt, 1.0, before
    )  # fmt: skip
    sheet = empty_sheet(2 * len(pairs.distance) + 64, robot.n)
    for kind in bound if isinstance(bound, tuple) else (bound,):
        kind.append(now, step, sheet)
    return rows_of(sheet)


def alone(robot, mode="qp", cell=None):
    """The controller of a mode, by itself."""
    clearance = Clearance(robot, cell or Cell())
    return Alone(robot, kind_of(mode).make(robot, clearance), clearance)
