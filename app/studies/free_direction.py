"""Could an arm have given way? The same question for every controller.

A free direction existed where some joint velocity within the speed limits moves every link
that is near something away at least as fast as that comes, whatever the controller chose.
"""

import numpy as np

from app.control.solver import FREE, Problem, minimise
from app.errors import StudyError
from app.messages import Array, Pairs
from app.robot.model import Robot
from app.robot.posture import Posture

NEAR = 0.15  # [m] links nearer than this must not be approached
SHORT = 1e-3  # [m/s] less than this is missing only by rounding


def free_direction(
    robot: Robot, posture: Posture, pairs: Pairs, coming: Array, speed: float
) -> bool:
    """May every near link be moved away at the speed `coming` (B,) [m/s] of its obstacle?

    pairs: one a link, as perceived.   speed: share of the joints' velocity limits.
    """
    moves = robot.supports[pairs.link].any(axis=1)
    near = np.flatnonzero((pairs.distance < NEAR) & moves)
    J = posture.distance_rows(pairs.link[near], pairs.on_robot[near], pairs.normal[near])
    n, m = robot.n, len(near)
    most = speed * robot.qd_max
    low, high = np.concatenate((-most, coming[near])), np.concatenate((most, np.full(m, FREE)))
    dear, stiff = np.full(m, 50.0), np.full(m, 100.0)
    qd = minimise(Problem(1e-3 * np.eye(n), np.zeros(n), J, low, high, dear, stiff))
    if qd is None:
        raise StudyError("whether there was a free direction was not found; report the seed")
    return float((coming[near] - J @ qd).max(initial=0.0)) < SHORT
