"""Whoever adds a controller writes one file: it is on the command line, the page, the plots and
in the studies, and it drives the arm.
"""

import numpy as np
import pytest

from app.config import MODES
from app.control.controller import Situation
from app.control.goals import goal_twist
from app.control.limits import bring_into, velocity_box
from app.control.registry import KINDS, controller
from app.messages import Command, freeze


class Toy:
    """To the goal by damped least squares; slower the nearer anything is, at rest from d_s on."""

    def __init__(self, robot, clearance):
        self._robot = robot

    def reset(self):
        pass

    def update(self, now: Situation) -> Command:
        robot, params, tool = self._robot, now.params, now.posture.T_base_tool
        nearest = now.pairs.minimum
        share = float(np.clip((nearest - params.d_s) / (params.d_inf - params.d_s), 0.0, 1.0))
        twist = np.zeros(6)
        if now.goal is not None:
            twist = share * goal_twist(
                tool, now.goal.T_base_tool, params.lambda_p, params.lambda_o, params.v_max,
                params.w_max,
            )  # fmt: skip
        J = now.posture.tool_jacobian()
        qd = J.T @ np.linalg.solve(J @ J.T + 1e-3 * np.eye(6), twist)
        box = velocity_box(robot, now.joints.q, params.speed * now.share, now.dt, now.applied)
        qd, _ = bring_into(qd, now.applied, box)
        return Command(freeze(qd), activation=1.0 - share, progress=share)


@pytest.fixture(scope="module", autouse=True)
def toy():
    """Registered by one call, and gone after these tests."""
    controller("toy", "Toy", "slower the nearer anything is")(Toy)
    yield
    del KINDS["toy"], MODES["toy"]
