"""From a goal pose to a bounded tool twist."""

import numpy as np

from app.compiled import compiled
from app.messages import Array
from app.robot.posture import rotation_vector


def goal_twist(
    T_base_tool: Array,
    T_base_goal: Array,
    lambda_p: float,
    lambda_o: float,
    v_max: float,
    w_max: float,
) -> Array:
    """(6,) [m/s, rad/s] linear then angular, axes of the base, towards the goal.

    Proportional to the error with gains `lambda_p`, `lambda_o` [1/s]; each half is shortened,
    direction kept, to `v_max` [m/s] and `w_max` [rad/s].
    """
    twist = np.empty(6)
    turn = rotation_error(T_base_tool, T_base_goal)
    _twist(T_base_tool, T_base_goal, turn, lambda_p, lambda_o, v_max, w_max, twist)
    return twist


def rotation_error(T_base_tool: Array, T_base_goal: Array) -> Array:
    """Rotation vector (3,) [rad], base axes, that turns the tool into the goal."""
    return rotation_vector(T_base_goal[:3, :3] @ T_base_tool[:3, :3].T)


def goal_error(T_base_tool: Array, T_base_goal: Array) -> tuple[float, float]:
    """Distance [m] and angle [rad] between tool and goal."""
    return (
        float(np.linalg.norm(T_base_goal[:3, 3] - T_base_tool[:3, 3])),
        float(np.linalg.norm(rotation_error(T_base_tool, T_base_goal))),
    )


@compiled
def _twist(
    T_base_tool: Array,
    T_base_goal: Array,
    turn: Array,
    lambda_p: float,
    lambda_o: float,
    v_max: float,
    w_max: float,
    out: Array,
) -> None:
    for i in range(3):
        out[i] = lambda_p * (T_base_goal[i, 3] - T_base_tool[i, 3])
        out[3 + i] = lambda_o * turn[i]
    _shorten(out[:3], v_max)
    _shorten(out[3:], w_max)


@compiled
def _shorten(v: Array, longest: float) -> None:
    length = np.sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2])
    if length > longest:
        for i in range(3):
            v[i] *= longest / length
