"""A level above all others that leaves the ends of the joints' ranges.

The box of `app.control.limits` only stops a joint at its end, and the levels below may go on
leaning on it; this level moves it away in good time, fading in over the last of its range.
"""

import numpy as np

from app.control.limits import MARGIN
from app.control.task_priority import Task
from app.messages import Array
from app.robot.model import Robot

NEAR = 0.2  # [rad or m] of a range's end in which the level fades in
GAIN = 1.0  # [1/s]


def limit_task(robot: Robot, q: Array) -> Task:
    """One row a joint: activation 0 from `NEAR` on, 1 at the end that the box keeps."""
    to_low, to_high = q - robot.q_min - MARGIN, robot.q_max - MARGIN - q
    near = np.minimum(to_low, to_high)
    away = np.where(to_low < to_high, 1.0, -1.0)
    share = np.clip(1.0 - near / NEAR, 0.0, 1.0)
    activation = 0.5 * (1.0 - np.cos(np.pi * share))
    return Task(np.eye(robot.n), GAIN * away * np.maximum(NEAR - near, 0.0), activation)
