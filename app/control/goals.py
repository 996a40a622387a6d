"""From a goal pose to a bounded tool twist."""

from math import sqrt

import numpy as np

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
    twist[:3] = _shorten(lambda_p * (T_base_goal[:3, 3] - T_base_tool[:3, 3]), v_max)
    twist[3:] = _shorten(lambda_o * rotation_error(T_base_tool, T_base_goal), w_max)
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


def _shorten(v: Array, longest: float) -> Array:
    length = sqrt(v @ v)
    return v if length <= longest else v * (longest / length)
