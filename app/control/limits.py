"""Joint limits that always hold: position, velocity and the change of velocity."""

from dataclasses import dataclass

import numpy as np

from app.compiled import compiled
from app.messages import Array
from app.robot.model import Robot

MARGIN = 0.02  # [rad or m] kept free before a position limit
STIFFNESS = 2.0  # [1/s] the speed towards a position limit falls with the distance to it
BRAKING = 0.5  # share of the acceleration limit that the approach to a limit counts on


@dataclass(frozen=True, eq=False, slots=True)
class VelocityBox:
    """What the joints may do next: low (n,) <= qd <= high (n,), |change of qd| <= change (n,)."""

    low: Array
    high: Array
    change: Array


def velocity_box(
    robot: Robot, q: Array, speed: float, dt: float, previous: Array | None = None
) -> VelocityBox:
    """The box at q for the next `dt` [s]; `speed` is the share of the velocity limits in use.

    Towards a position limit the speed falls linearly with the distance and never exceeds
    what can still be braked; beyond it (a start outside) the way back is demanded. With the
    `previous` command (n,) a lower share is reached by braking, not by a jump.
    """
    low, high, change = np.empty(robot.n), np.empty(robot.n), robot.qdd_max * dt
    running = np.zeros(robot.n) if previous is None else previous
    _fill(
        q, robot.q_min, robot.q_max, robot.qd_max, robot.qdd_max, speed, running, change, low, high
    )
    return VelocityBox(low, high, change)


def next_box(
    robot: Robot, q: Array, speed: float, dt: float, previous: Array
) -> tuple[Array, Array]:
    """low (n,) <= qd <= high (n,) of the next tick, the change of speed included.

    Where limits contradict each other, position wins.
    """
    low, high, change = np.empty(robot.n), np.empty(robot.n), robot.qdd_max * dt
    _fill(
        q, robot.q_min, robot.q_max, robot.qd_max, robot.qdd_max, speed, previous, change, low, high
    )
    _narrow(previous, change, low, high)
    return low, high


def bring_into(qd: Array, previous: Array, box: VelocityBox) -> tuple[Array, float]:
    """The nearest allowed command on the way from `previous` to `qd` (n,), and its share 0..1.

    A joint at the end of its range is held alone, so that it does not hold the others. The
    change of speed is shortened as a whole, so that the motion keeps its direction. Where
    both cannot be had, position wins over acceleration.
    """
    out = np.empty(len(qd))
    return out, _bring(qd, previous, box.low, box.high, box.change, out)


@compiled
def _fill(
    q: Array,
    q_min: Array,
    q_max: Array,
    qd_max: Array,
    qdd_max: Array,
    speed: float,
    previous: Array,
    change: Array,
    low: Array,
    high: Array,
) -> None:
    for j in range(len(q)):
        still_braking = abs(previous[j]) - change[j]
        v = min(max(speed * qd_max[j], still_braking), qd_max[j])
        high[j] = min(max(_approach(q_max[j] - MARGIN - q[j], qdd_max[j]), -v), v)
        low[j] = -min(max(_approach(q[j] - q_min[j] - MARGIN, qdd_max[j]), -v), v)


@compiled
def _narrow(previous: Array, change: Array, low: Array, high: Array) -> None:
    for j in range(len(low)):
        least = min(max(low[j], previous[j] - change[j]), high[j])
        high[j] = max(min(high[j], previous[j] + change[j]), low[j])
        low[j] = least
        high[j] = max(low[j], high[j])


@compiled
def _approach(distance: float, qdd_max: float) -> float:
    if distance < 0.0:
        return STIFFNESS * distance
    return min(STIFFNESS * distance, float(np.sqrt(2.0 * BRAKING * qdd_max * distance)))


@compiled
def _bring(qd: Array, previous: Array, low: Array, high: Array, most: Array, out: Array) -> float:
    share = 1.0
    for j in range(len(qd)):
        out[j] = min(max(qd[j], low[j]), high[j])
        change = abs(out[j] - previous[j])
        if change > most[j]:
            share = min(share, most[j] / change)
    for j in range(len(qd)):
        out[j] = min(max(previous[j] + share * (out[j] - previous[j]), low[j]), high[j])
    return share
