"""Joint limits that always hold: position, velocity and the change of velocity."""

from dataclasses import dataclass

import numpy as np

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


def velocity_box(robot: Robot, q: Array, speed: float, dt: float) -> VelocityBox:
    """The box at q for the next `dt` [s]; `speed` is the share of the velocity limits in use.

    Towards a position limit the speed falls linearly with the distance and never exceeds
    what can still be braked; beyond it (a start outside) the way back is demanded.
    """
    qd_max = speed * robot.qd_max
    high = np.clip(_approach(robot.q_max - MARGIN - q, robot.qdd_max), -qd_max, qd_max)
    low = -np.clip(_approach(q - robot.q_min - MARGIN, robot.qdd_max), -qd_max, qd_max)
    return VelocityBox(low, high, robot.qdd_max * dt)


def bring_into(qd: Array, previous: Array, box: VelocityBox) -> tuple[Array, float]:
    """The nearest allowed command on the way from `previous` to `qd` (n,), and its share 0..1.

    A joint at the end of its range is held alone, so that it does not hold the others. The
    change of speed is shortened as a whole, so that the motion keeps its direction. Where
    both cannot be had, position wins over acceleration.
    """
    wanted = np.clip(qd, box.low, box.high)
    change = np.abs(wanted - previous)
    over = change > box.change
    share = float((box.change[over] / change[over]).min()) if over.any() else 1.0
    return np.clip(previous + share * (wanted - previous), box.low, box.high), share


def _approach(distance: Array, qdd_max: Array) -> Array:
    inside = np.maximum(distance, 0.0)
    speed = np.minimum(STIFFNESS * inside, np.sqrt(2.0 * BRAKING * qdd_max * inside))
    return np.where(distance < 0.0, STIFFNESS * distance, speed)
