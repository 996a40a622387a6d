"""What was asked for beside a goal, and what became of it; part of the vocabulary of `messages`."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False, slots=True)
class Wish:
    """A velocity that is asked for instead of a goal; one of the two is given.

    twist: (6,) [m/s, rad/s] of the tool, axes of the base.   qd: (n,) [rad/s] of the joints.
    """

    twist: Array | None = None
    qd: Array | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Granted:
    """What became of a wish in one tick.

    share: of what was asked for that the command does, along it; below 0 it goes the other way.
    by:    what holds the rest back, in words; empty while nothing does.
    """

    wish: Wish
    share: float
    by: str
