"""A velocity that is asked for: what the joints would have to do for it, and what became of it."""

from typing import Any

import numpy as np

from app.control.goals import LAMBDA_O, LAMBDA_P
from app.control.limits import MARGIN
from app.control.qp import Answer, Costs
from app.granted import Granted, Wish
from app.messages import Array, Command, Goal, Pairs, freeze
from app.robot.model import Robot
from app.robot.posture import Posture, rotation_matrix

# A twist is done exactly down to this smallest singular value of the tool's jacobian; below it
# directions are damped, as in Nakamura and Hanafusa, "Inverse kinematic solutions with singularity
# robustness" (1986): 0.04 rad/s of the worst direction then cost a joint less than 1 rad/s
EXACT = 0.04
DONE = 0.98  # share from which on nobody needs to be told of a rest
AT_END = 0.05  # [rad] of a range's end in which it is the end that holds a joint


def joints_for(wish: Wish, posture: Posture) -> Array:
    """Joint velocities (n,) that do what is asked for, whatever bounds say."""
    if wish.qd is not None:
        return wish.qd
    assert wish.twist is not None  # one of the two is given
    U, sigma, Vt = np.linalg.svd(posture.tool_jacobian(), full_matrices=False)
    damping = EXACT * EXACT * max(0.0, 1.0 - (float(sigma[-1]) / EXACT) ** 2)
    return np.asarray(Vt.T @ (sigma / (sigma * sigma + damping) * (U.T @ wish.twist)))


def tool_twist(wish: Wish, posture: Posture) -> Array:
    """The tool's (6,) [m/s, rad/s], axes of the base, that belongs to a wish."""
    if wish.qd is not None:
        return np.asarray(posture.tool_jacobian() @ wish.qd)
    assert wish.twist is not None  # one of the two is given
    return wish.twist


def goal_ahead(wish: Wish, posture: Posture) -> Goal:
    """The pose whose pull is the wish: for who knows of goals alone."""
    twist, T = tool_twist(wish, posture), np.eye(4)
    T[:3, :3] = rotation_matrix(twist[3:] / LAMBDA_O) @ posture.T_base_tool[:3, :3]
    T[:3, 3] = posture.T_base_tool[:3, 3] + twist[:3] / LAMBDA_P
    return Goal(freeze(T))


def costs_of(wish: Wish, qd: Array, posture: Posture, k_g: float, k_b: float, near: float,
    slide: bool) -> Costs:  # fmt: skip
    """Costs that are zero at `qd` (n,) alone, the joints' velocities for the wish.

    So what no bound forbids is left as it is, and the rest is changed as little as can be: of the
    tool where its twist was asked for, of the joints where they were.
    near: weight that keeps the joints near `qd` where the tool leaves them free.
    """
    nothing = np.zeros(len(qd))
    if wish.qd is not None:
        ones = np.ones(len(qd))
        return Costs(np.eye(len(qd)), qd, qd, nothing, k_g, k_b, 0.0, near, slide, ones)
    tool = posture.tool_jacobian()
    return Costs(tool, tool @ qd, qd, nothing, k_g, k_b, 0.0, near, slide)


def unchanged(qd: Array, jacobian: Array, bound: Array, low: Array, high: Array) -> Answer | None:
    """`qd` itself where no bound (m,) and no limit (n,) forbids it, to the last bit; else None."""
    if (qd < low).any() or (qd > high).any() or (jacobian @ qd < bound).any():
        return None
    m = len(bound)
    return Answer(qd, 1.0, np.zeros(m), np.zeros(m, dtype=np.bool_))


def granted(
    wish: Wish, command: Command, posture: Posture, pairs: Pairs, robot: Robot, speed: float
) -> Granted:  # fmt: skip
    """How much of the wish a command does, and what holds the rest back.

    speed: 0..1 of the joints' velocity limits that may be used.
    """
    if wish.qd is not None:
        asked, done = wish.qd, command.qd
    else:
        asked, done = tool_twist(wish, posture), posture.tool_jacobian() @ command.qd
    size = float(asked @ asked)
    share = float(done @ asked) / size if size > 0.0 else 1.0
    by = "" if share >= DONE else _what_holds(wish, command, posture, pairs, robot, speed)
    return Granted(wish, share, by)


def _what_holds(
    wish: Wish, command: Command, posture: Posture, pairs: Pairs, robot: Robot, speed: float
) -> str:  # fmt: skip
    row = command.control_row
    if 0 <= row < len(pairs.link):
        link = robot.links[int(pairs.link[row])].removesuffix("_link").replace("_", " ")
        return f"{link}, {100.0 * float(pairs.distance[row]):.0f} cm from what is in the way"
    if command.reason:
        return command.reason
    if command.activation > 0.0:
        return "the arm's own body or the known cell"
    return _joints_hold(joints_for(wish, posture), wish, posture, robot, speed)


def _joints_hold(qd: Array, wish: Wish, posture: Posture, robot: Robot, speed: float) -> str:
    """Where a joint is at its end or too slow for `qd` (n,), or no joints can do the wish."""
    at_high = (robot.q_max - MARGIN - posture.q < AT_END) & (qd > 0.0)
    at_low = (posture.q - robot.q_min - MARGIN < AT_END) & (qd < 0.0)
    ends = at_high | at_low
    if ends.any():
        return f"{_joint(robot, np.argmax(ends * np.abs(qd)))} is at the end of its range"
    haste = np.abs(qd) / (speed * robot.qd_max)
    if haste.max() > 1.0:
        return f"{_joint(robot, np.argmax(haste))} would have to be faster than it may"
    if wish.twist is not None:
        left = posture.tool_jacobian() @ qd - wish.twist
        if float(left @ left) > (1.0 - DONE) * float(wish.twist @ wish.twist):
            return "the arm is stretched or folded: it cannot move that way here"
    return ""


def _joint(robot: Robot, j: Any) -> str:
    return robot.joints[int(j)].removesuffix("_joint").replace("_", " ")
