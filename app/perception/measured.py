"""What was measured of pairs, as it is believed now: nearer and faster by what is not known."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

SIGMAS = 2.0  # of its deviation that a distance may be shorter: 95 % are not
AHEAD = 0.2  # [s] of age that is counted with: what is known to move is known so for no longer
# [m/s] an approach is counted on with its age, and believed to be a deviation more, from the first
# of these speeds on more and more, fully from the second: below, most of what is measured stands
# still, and a distance that jumped with it made the arm twitch
FASTER = (0.08, 0.16)
APPROACH, APPROACH_SIGMA, SIGMA, AGE = 0, 1, 2, 3  # rows of `Measured.doubt`


class Measured(NamedTuple):
    """The pairs (B,) of this tick, as in `Pairs`.

    doubt: (4, B) approach [m/s], its sigma [m/s], the distance's sigma [m], age [s].
    """

    link: NDArray[np.int64]
    distance: Array
    doubt: Array
    on_robot: Array
    on_world: Array
    normal: Array


# They take numbers: each array that a kernel hands to another one is counted twice.


@compiled
def moves(w: float) -> float:
    """0..1, how surely what approaches at w [m/s] does."""
    low, high = FASTER
    return min(max((w - low) / (high - low), 0.0), 1.0)


@compiled
def distance_now(measured: float, w: float, age: float) -> float:
    """[m] of a pair as far as its approach w [m/s] is known: nobody is believed to have gone."""
    return measured - moves(w) * w * min(age, AHEAD)


@compiled
def sigma_now(sigma: float, w_sigma: float, age: float) -> float:
    """[m] 1 sigma of that: of what was measured, and of the way since."""
    return float(np.hypot(sigma, w_sigma * min(age, AHEAD)))


@compiled
def approach_now(w: float, w_sigma: float) -> float:
    """[m/s] by a deviation faster than measured, if it moves at all."""
    return w + moves(w) * w_sigma
