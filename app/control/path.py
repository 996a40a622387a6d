"""A straight way from one pose to another, travelled within speed limits."""

from dataclasses import dataclass

import numpy as np

from app.messages import Array, freeze
from app.robot.posture import rotation_matrix, rotation_vector


@dataclass(frozen=True, eq=False, slots=True)
class StraightPath:
    """From pose `start` to `end` (4, 4): the origin on a line, the turn about one axis.

    duration: [s] at the speed limits, the slower of way and turn.
    """

    start: Array
    end: Array
    duration: float

    def pose(self, share: float) -> Array:
        """(4, 4) after `share` 0..1 of the way."""
        s = min(max(share, 0.0), 1.0)
        turn = rotation_vector(self.end[:3, :3] @ self.start[:3, :3].T)
        T = np.eye(4)
        T[:3, :3] = rotation_matrix(s * turn) @ self.start[:3, :3]
        T[:3, 3] = self.start[:3, 3] + s * (self.end[:3, 3] - self.start[:3, 3])
        return freeze(T)


def straight_path(start: Array, end: Array, speed: float, turn_speed: float) -> StraightPath:
    """The path at no more than `speed` [m/s] and `turn_speed` [rad/s]."""
    way = float(np.linalg.norm(end[:3, 3] - start[:3, 3]))
    turn = float(np.linalg.norm(rotation_vector(end[:3, :3] @ start[:3, :3].T)))
    return StraightPath(start, end, max(way / speed, turn / turn_speed))
