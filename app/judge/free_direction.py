"""Could an arm have given way? The same question for every controller, asked of the truth.

A free direction existed where some joint velocity within the speed limits moves every link
that is near something away at least as fast as that comes, whatever the controller chose:

    find qd:   n_i . v_i(qd) >= n_i . u_i  for each near pair i,   |qd| <= most

n_i from the body to the link, v_i the velocity of the link's point, u_i that of the body's. It
is a linear programme, and the rows are finite differences of the kinematics: nothing is shared
with the controllers that are judged.
"""

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.optimize import linprog

from app.errors import StudyError
from app.judge.truth import TruePair
from app.messages import Array
from app.robot.model import Robot

NEAR = 0.15  # [m] links nearer than this must not be approached
SHORT = 1e-3  # [m/s] less than this is missing only by rounding
STEP = 1e-6  # [rad or m] of a finite difference


def free_direction(
    robot: Robot, q: Array, pairs: Sequence[TruePair], motions: Mapping[str, Array], speed: float,
    touched: Sequence[TruePair] = (),
) -> bool:  # fmt: skip
    """May every near link be moved away as fast as what is near it comes?

    pairs: the true ones at joint positions q (n,); those from `NEAR` on do not count.
    motions: body's name to the pose (4, 4) that carries its points a second on, linearly.
    speed:   share of the joints' velocity limits.
    touched: the same of what will touch, which count however far they are.
    """
    moves = np.asarray(robot.supports.any(axis=1))
    near = [p for p in pairs if p.distance < NEAR and moves[p.link]]
    near += [p for p in touched if p.distance >= NEAR and moves[p.link]]
    if not near:
        return True
    rows = np.array([speed_row(robot, q, p) for p in near])
    coming = np.array([p.normal @ point_velocity(motions[p.body], p.on_body) for p in near])
    # the least by which some row must fall short
    cost = np.append(np.zeros(robot.n), 1.0)
    most = speed * robot.qd_max
    bounds = [*zip(-most, most, strict=True), (0.0, None)]
    A = np.column_stack((-rows, -np.ones(len(near))))
    found = linprog(cost, A_ub=A, b_ub=-coming, bounds=bounds, method="highs")
    if not found.success or found.fun is None:
        raise StudyError(f"whether there was a free direction was not found: {found.message}")
    return found.fun < SHORT


def speed_row(robot: Robot, q: Array, pair: TruePair) -> Array:
    """(n,) by how much each joint's velocity moves the link's point along the normal [m/s]."""
    p = np.linalg.inv(robot.posture(q).T_base_link[pair.link]) @ np.append(pair.on_link, 1.0)
    row = np.empty(robot.n)
    for j, step in enumerate(STEP * np.eye(robot.n)):
        ahead = robot.posture(q + step).T_base_link[pair.link] @ p
        behind = robot.posture(q - step).T_base_link[pair.link] @ p
        row[j] = pair.normal @ (ahead - behind)[:3] / (2.0 * STEP)
    return row


def motion_between(before: Array, after: Array, seconds: float) -> Array:
    """What carries a body's points on (4, 4) [1/s], from its poses at two times."""
    return np.asarray((after @ np.linalg.inv(before) - np.eye(4)) / seconds)


def point_velocity(motion: Array, point: Array) -> Array:
    """(3,) [m/s] of a body's point (3,) [m], base frame; see `motion_between`."""
    return np.asarray((motion @ np.append(point, 1.0))[:3])
