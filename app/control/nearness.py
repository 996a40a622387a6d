"""What can give way, what cannot, and what holds the arm: said of the pairs that were measured.

A point that the joints hardly move along its normal cannot give way, whatever the controller: the
upper arm beside the base, say, which turns past what is there and not away from it. Its distance
is no failure of the avoidance, and hides one where it is told in the same number.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.control.bounds.pairs import HARDLY
from app.control.bounds.rows import Motion, add_rate, motion
from app.control.goals import goal_error
from app.messages import Array, Goal, Pairs
from app.near import NOT_NEAR, Near, Nearness
from app.robot.posture import Posture

ABLE = 1.5 * HARDLY  # [m/s] reachable speed: the middle of where the bound of a pair fades in


def nearness(
    pairs: Pairs, told: Pairs, row: int, posture: Posture, qd_max: Array, goal: Goal,
    blocked: float,
) -> Nearness:  # fmt: skip
    """What a person should know of this tick.

    pairs: measured, of the body's points.   told: what the controller was told, and the row of
    it that it acted on, -1 for none.   qd_max: (n,) [rad/s].   blocked: [s] it has been so.
    """
    speed = np.empty(len(pairs.distance))
    able, unable = _closest(
        pairs.link, pairs.distance, pairs.on_robot, pairs.normal, motion(posture), qd_max, speed
    )
    acts = 0 <= row < len(told.link)
    to_go, _ = goal_error(posture.T_base_tool, goal.T_base_tool)
    return Nearness(
        yields=_near(pairs, able, speed),
        stays=_near(pairs, unable, speed),
        holder=int(told.link[row]) if acts else -1,
        held_at=float(told.distance[row]) if acts else np.inf,
        blocked=blocked,
        to_go=to_go,
    )


def _near(pairs: Pairs, row: int, speed: Array) -> Near:
    """The pair of this row, -1 for none."""
    if row < 0:
        return NOT_NEAR
    return Near(
        int(pairs.link[row]), float(pairs.distance[row]), float(speed[row]), pairs.on_robot[row],
        pairs.on_world[row], pairs.normal[row],
    )  # fmt: skip


@compiled
def _closest(
    link: NDArray[np.int64], distance: Array, on_robot: Array, normal: Array, moves: Motion,
    qd_max: Array, speed: Array,
) -> tuple[int, int]:  # fmt: skip
    """The closest rows that can give way and that cannot, -1 for none; the base is neither.

    Writes each row's reachable speed along its normal (B,) [m/s], 0 without a pair.
    """
    able, unable = -1, -1
    J = np.empty(len(qd_max))
    for i in range(len(distance)):
        speed[i] = 0.0
        if not np.isfinite(distance[i]) or not moves.supports[link[i]].any():
            continue
        J[:] = 0.0
        add_rate(link[i], on_robot[i], normal[i], 1.0, moves, J)
        for j in range(len(J)):
            speed[i] += abs(J[j]) * qd_max[j]
        if speed[i] >= ABLE:
            if able < 0 or distance[i] < distance[able]:
                able = i
        elif unable < 0 or distance[i] < distance[unable]:
            unable = i
    return able, unable
