"""What it is worth to see something coming to a patch, from a direction, at a gap.

    u(gap) = min(gap, horizon) / horizon

A thing that is never seen is worth 0, one that is seen at the horizon 1. With the best of the
sensors for each way the sum is monotone and submodular in the set of sensors (facility location),
so that what is chosen greedily is near the best (Nemhauser, Wolsey and Fisher 1978).

A way's weight is the patch's area, times how fast the patch moves along it when the joints do at
half of their speeds (what stands is met by what moves), times where people come from: level ways
count most, and those from below the floor not at all.
"""

import numpy as np
from numpy.typing import NDArray

from app.coverage.look import Look, Subject
from app.coverage.patches import Posed
from app.messages import Array
from app.robot.posture import Posture

HORIZON = 0.4  # [m]
STEPS = 250  # that a worth is kept in
STANDING = 0.3  # [m/s] of what comes to a part that does not move
STEEP = 0.2  # of a level way's weight, straight from above or below
FLOOR = 0.0  # [m] nothing comes from below what the arm stands on
AHEAD = 0.5  # [m] how far out a way is looked at for that


def worths(gap: NDArray[np.float32], horizon: float = HORIZON) -> NDArray[np.uint8]:
    """Of gaps (...) [m]; `STEPS` is 1."""
    return np.asarray(np.rint(np.minimum(gap / horizon, 1.0) * STEPS), dtype=np.uint8)


def weights(subject: Subject, posture: Posture, at: Posed, barred: NDArray[np.bool_]) -> Array:
    """(P, M) of every way to every patch at a posture; 0 for those that are barred."""
    up = at.direction[..., 2]
    level = STEEP + (1.0 - STEEP) * np.sqrt(np.maximum(1.0 - up**2, 0.0))
    above = at.point[:, None, 2] + AHEAD * up >= FLOOR
    worth = subject.patches.area[:, None] * _speeds(subject, posture, at) * level
    return np.asarray(np.where(~barred & above, worth, 0.0))


def _speeds(subject: Subject, posture: Posture, at: Posed) -> Array:
    """(P, M) [m/s] of the patch along each of its ways: root of the summed squares over the joints,
    each at half of its speed. A patch that no joint moves can give way to nothing: 0."""
    robot, link = subject.robot, subject.patches.link
    linear, angular = posture.J_base[:3].T, posture.J_base[3:].T
    rates = linear + np.cross(angular, at.point[:, None])  # (P, n, 3)
    rates = rates * (posture.supports[link] * robot.qd_max / 2.0)[..., None]
    along = np.einsum("pnk,pmk->pmn", rates, at.direction)
    moves = np.any(robot.supports[link] > 0.0, axis=1, keepdims=True)
    return np.asarray((STANDING + np.sqrt((along**2).sum(axis=2))) * moves)


def value(look: Look, weight: Array, horizon: float = HORIZON) -> float:
    """The share of the weight of ways (P, M) that a look's sensors are worth, 0 to 1."""
    gap = look.gap.max(axis=0, initial=0.0)
    return float((weight * np.minimum(gap / horizon, 1.0)).sum() / weight.sum())
