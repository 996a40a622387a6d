"""How near the world is: two pairs of a tick, told apart by what the arm can do about them."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class Near:
    """One pair, and how fast the joints can take the robot's point away from the world's.

    link:     that moves the robot's point, -1 where there is no such pair.   distance: [m].
    speed:    [m/s] reachable along the normal, all joints together.
    on_robot, on_world: (3,) [m] base frame.   normal: (3,) from the world to the robot.
    """

    link: int
    distance: float
    speed: float
    on_robot: Array
    on_world: Array
    normal: Array

    @property
    def seen(self) -> bool:
        """Is there such a pair?"""
        return self.link >= 0


NOWHERE = np.full(3, np.nan)
NOWHERE.flags.writeable = False
NOT_NEAR = Near(-1, np.inf, 0.0, NOWHERE, NOWHERE, NOWHERE)


@dataclass(frozen=True, eq=False, slots=True)
class Nearness:
    """How near the world is, what the arm can do about it, and what it does.

    yields:  the closest pair that can give way: what is promised holds for it.
    stays:   the closest that cannot, since the joints hardly move it along its normal.
    holder:  the link that the avoidance acts on, -1 if none.   held_at: [m] its distance.
    blocked: [s] for how long it has come no nearer to its goal, 0 while it does.
    to_go:   [m] from the tool to its goal.
    """

    yields: Near = NOT_NEAR
    stays: Near = NOT_NEAR
    holder: int = -1
    held_at: float = np.inf
    blocked: float = 0.0
    to_go: float = 0.0


NOTHING_NEAR = Nearness()
