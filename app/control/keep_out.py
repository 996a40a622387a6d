"""Keeps whatever a controller asks for out of the known cell.

The paper's controllers know of no table: what the static filter takes for the cell is hidden
from them. So their velocity is replaced by the nearest one that the cell's bounds allow:

    minimise |qd - asked|^2 / 2 + slack   such that   J qd + s >= low ,  qd in its box ,  s >= 0

Where nothing of the cell is near, what was asked for is left as it is, to the last bit.
"""

import numpy as np

from app.config import Params
from app.control.active_set import minimise
from app.control.limits import next_box
from app.control.rows import Bounds
from app.errors import FlinchError
from app.messages import Array, JointState
from app.robot.model import Robot
from app.robot.posture import Posture


class KeepOut:
    """A filter behind a controller that has no bounds of its own."""

    def __init__(self, robot: Robot, bounds: Bounds) -> None:
        self._robot, self._bounds = robot, bounds

    def allowed(
        self, asked: Array, posture: Posture, joints: JointState, params: Params,
        previous: Array, dt: float,
    ) -> Array:  # fmt: skip
        """The nearest velocity (n,) to `asked` (n,) that leaves the cell alone.

        previous: (n,) the command in force.   Raises FlinchError when none is found.
        """
        low, high = next_box(self._robot, joints.q, params.speed, dt, previous)
        # what was asked for keeps the limits already, by a rule of its own where they conflict
        low, high = np.minimum(low, asked), np.maximum(high, asked)
        rows = self._bounds.cell_rows(posture, params, low, high, previous, dt)
        if not len(rows.low) or (rows.jacobian @ asked >= rows.low).all():
            return asked
        qd = np.empty(len(asked))
        steps = minimise(
            np.eye(len(asked)), -asked, rows.jacobian, rows.low, rows.linear, rows.quadratic,
            low, high, qd,
        )  # fmt: skip
        if steps < 0:
            raise FlinchError("the cell's bounds had no solution; move the arm away from the cell")
        return qd
