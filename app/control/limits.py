"""Joint limits that always hold: position, velocity and the change of velocity.

Towards the end of its range, a distance r away, a joint moves no faster than

    min( k r , sqrt(2 a r) )        k: STIFFNESS,  a: BRAKING of its acceleration limit

which it can still brake; beyond the end (a start outside) the way back, k r, is demanded.
"""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from app.compiled import compiled
from app.messages import Array
from app.robot.model import Robot

MARGIN = 0.02  # [rad or m] kept free before a position limit: a degree, as a UR's own margin
STIFFNESS = 2.0  # [1/s] the specification's k_q (section 4.6)
BRAKING = 0.5  # share of the acceleration limit that the approach counts on; the rest is reserve


@dataclass(frozen=True, eq=False, slots=True)
class VelocityBox:
    """What the joints may do next: low (n,) <= qd <= high (n,), |change of qd| <= change (n,)."""

    low: Array
    high: Array
    change: Array


class Step(NamedTuple):
    """What the joints can do in the tick ahead, all (n,): low <= qd <= high, changes included.

    previous: the command in force.   qd_max: speed that is in use.   qdd_max: [rad/s^2].
    dt:       [s] until the next tick.
    """

    low: Array
    high: Array
    previous: Array
    qd_max: Array
    qdd_max: Array
    dt: float


class _Range(NamedTuple):
    """A robot's limits, (n,) each."""

    q_min: Array
    q_max: Array
    qd_max: Array
    qdd_max: Array


def velocity_box(
    robot: Robot, q: Array, speed: float, dt: float, previous: Array | None = None
) -> VelocityBox:
    """The box at q for the next `dt` [s]; `speed` is the share of the velocity limits in use.

    With the `previous` command (n,) a lower share is reached by braking, not by a jump.
    """
    low, high = np.empty((2, robot.n))
    running = np.zeros(robot.n) if previous is None else previous
    _velocities(_range(robot), q, running, speed, dt, low, high)
    return VelocityBox(low, high, robot.qdd_max * dt)


def next_step(robot: Robot, q: Array, speed: float, dt: float, previous: Array) -> Step:
    """The step ahead at q. Where limits contradict each other, position wins."""
    out = np.empty((3, robot.n))
    _next(_range(robot), q, previous, speed, dt, out)
    low, high, qd_max = out
    return Step(low, high, previous, qd_max, robot.qdd_max, dt)


def bring_into(qd: Array, previous: Array, box: VelocityBox) -> tuple[Array, float]:
    """The nearest allowed command on the way from `previous` to `qd` (n,), and its share 0..1.

    A joint at the end of its range is held alone, so that it does not hold the others. The
    change of speed is shortened as a whole, so that the motion keeps its direction. Where
    both cannot be had, position wins over acceleration.
    """
    out = np.empty(len(qd))
    return out, _bring(qd, previous, box.low, box.high, box.change, out)


def braked(robot: Robot, q: Array, dt: float, previous: Array) -> Array:
    """The command (n,) after `previous` (n,) that comes to rest as fast as the limits allow."""
    return bring_into(np.zeros(robot.n), previous, velocity_box(robot, q, 1.0, dt))[0]


def _range(robot: Robot) -> _Range:
    return _Range(robot.q_min, robot.q_max, robot.qd_max, robot.qdd_max)


@compiled
def _velocities(
    limits: _Range, q: Array, previous: Array, speed: float, dt: float, low: Array, high: Array
) -> None:
    """Write the box of position and velocity."""
    for j in range(len(q)):
        still_braking = abs(previous[j]) - limits.qdd_max[j] * dt
        v = min(max(speed * limits.qd_max[j], still_braking), limits.qd_max[j])
        qdd_max = limits.qdd_max[j]
        high[j] = min(max(_approach(limits.q_max[j] - MARGIN - q[j], qdd_max), -v), v)
        low[j] = -min(max(_approach(q[j] - limits.q_min[j] - MARGIN, qdd_max), -v), v)


@compiled
def _next(limits: _Range, q: Array, previous: Array, speed: float, dt: float, out: Array) -> None:
    """Write the box of position, velocity and acceleration, and the velocities in use: (3, n)."""
    low, high = out[0], out[1]
    _velocities(limits, q, previous, speed, dt, low, high)
    for j in range(len(low)):
        out[2, j] = speed * limits.qd_max[j]
        change = limits.qdd_max[j] * dt
        least = min(max(low[j], previous[j] - change), high[j])
        high[j] = max(min(high[j], previous[j] + change), low[j])
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
