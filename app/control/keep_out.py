"""Keeps whatever a controller asks for out of the known cell.

The paper's controllers know of no table: what the static filter takes for the cell is hidden
from them. So their velocity is replaced by the nearest one that the cell's bounds allow:

    minimise |qd - asked|^2 / 2 + slack   such that   J qd + s >= low ,  qd in its box ,  s >= 0

Where nothing of the cell is near, what was asked for is left as it is, to the last bit.
"""

import numpy as np

from app.control.bounds.cell import CellBounds
from app.control.bounds.gap_rows import MOST
from app.control.bounds.rows import empty_sheet, rows_of
from app.control.clearance import Clearance
from app.control.controller import Situation
from app.control.limits import next_step
from app.control.solver import FREE, Problem, minimise
from app.errors import FlinchError
from app.messages import Array
from app.robot.model import Robot


class KeepOut:
    """A filter behind a controller that has no bounds of its own."""

    def __init__(self, robot: Robot, clearance: Clearance) -> None:
        self._robot, self._cell = robot, CellBounds(clearance)

    def allowed(self, asked: Array, now: Situation) -> Array:
        """The nearest velocity (n,) to `asked` (n,) that leaves the cell alone.

        Raises FlinchError when none is found.
        """
        step = next_step(self._robot, now.joints.q, now.params.joint_speed, now.dt, now.applied)
        # what was asked for keeps the limits already, by a rule of its own where they conflict
        step = step._replace(low=np.minimum(step.low, asked), high=np.maximum(step.high, asked))
        sheet = empty_sheet(MOST, self._robot.n)
        self._cell.append(now, step, sheet)
        rows = rows_of(sheet)
        if (rows.jacobian @ asked >= rows.low).all():
            return asked
        nearest = Problem(
            np.eye(len(asked)), -asked, rows.jacobian, np.concatenate((step.low, rows.low)),
            np.concatenate((step.high, np.full(len(rows.low), FREE))), rows.linear, rows.quadratic,
        )  # fmt: skip
        qd = minimise(nearest, now.params.solver)
        if qd is None:
            raise FlinchError("the cell's bounds had no solution; move the arm away from the cell")
        return qd
