"""From a goal pose to a bounded tool twist."""

import numpy as np

from app.compiled import compiled
from app.messages import Array
from app.robot.posture import rotation_vector

# [1/s] of place and turn; an error is halved in half a second, which 0.3 m/s bounds beyond 0.25 m
LAMBDA_P, LAMBDA_O = 1.2, 1.5
CERTAIN = 3.1  # [rad] beyond it a turn's axis comes from another formula


def goal_twist(
    T_base_tool: Array,
    T_base_goal: Array,
    v_max: float,
    w_max: float,
) -> Array:
    """(6,) [m/s, rad/s] linear then angular, axes of the base, towards the goal.

    Proportional to the error with LAMBDA_P and LAMBDA_O; each half is shortened, direction kept,
    to `v_max` [m/s] and `w_max` [rad/s].
    """
    twist = np.empty(6)
    if not _twist(T_base_tool, T_base_goal, v_max, w_max, twist):
        turn = rotation_vector(T_base_goal[:3, :3] @ T_base_tool[:3, :3].T)
        twist[3:] = turn * min(LAMBDA_O, w_max / float(np.linalg.norm(turn)))
    return twist


def goal_error(T_base_tool: Array, T_base_goal: Array) -> tuple[float, float]:
    """Distance [m] and angle [rad] between tool and goal."""
    return _error(T_base_tool, T_base_goal)


@compiled
def _twist(
    T_base_tool: Array,
    T_base_goal: Array,
    v_max: float,
    w_max: float,
    out: Array,
) -> bool:
    """Write the twist (6,); False where the turn is half a one, so that its axis is not certain."""
    for i in range(3):
        out[i] = LAMBDA_P * (T_base_goal[i, 3] - T_base_tool[i, 3])
    angle = _turn(T_base_tool, T_base_goal, out[3:])
    for i in range(3):
        out[3 + i] *= LAMBDA_O
    _shorten(out[:3], v_max)
    _shorten(out[3:], w_max)
    return angle < CERTAIN


@compiled
def _error(T_base_tool: Array, T_base_goal: Array) -> tuple[float, float]:
    square = 0.0
    for i in range(3):
        square += (T_base_goal[i, 3] - T_base_tool[i, 3]) ** 2
    return np.sqrt(square), _turn(T_base_tool, T_base_goal, np.empty(3))


@compiled
def _turn(T_base_tool: Array, T_base_goal: Array, out: Array) -> float:
    """Write the rotation vector (3,), base axes, that turns the tool into the goal; its angle.

    R - R' holds twice the axis times the sine, the trace of R one and twice the cosine.
    """
    R, trace = np.empty((3, 3)), 0.0
    for i in range(3):
        for j in range(3):
            R[i, j] = 0.0
            for k in range(3):
                R[i, j] += T_base_goal[i, k] * T_base_tool[j, k]
        trace += R[i, i]
    out[0], out[1], out[2] = R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]
    sine = np.sqrt(out[0] ** 2 + out[1] ** 2 + out[2] ** 2)
    angle = np.arctan2(sine, trace - 1.0)
    share = angle / sine if sine > 0.0 else 0.5
    for i in range(3):
        out[i] *= share
    return float(angle)


@compiled
def _shorten(v: Array, longest: float) -> None:
    length = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if length > longest:
        for i in range(3):
            v[i] *= longest / length
