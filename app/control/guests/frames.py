"""What a guest is told in each tick of what the sensors see, from raw to what is believed of it."""

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.control.controller import Situation
from app.messages import Array, Cloud, Pairs, SensorFrame, Verdict

NO_POINTS = np.empty((0, 3))


class Near(NamedTuple):
    """The near pairs (m,) of world and arm, up to four a link, the nearest first.

    They are what Flinch's own controllers are told: exact, steadied, followed from tick to tick.

    link:      that moves the arm's point.   distance: [m] signed, positive outside the body.
    on_robot, on_world: (m, 3) [m] base frame.   normal: (m, 3) unit, the direction of retreat.
    approach:  [m/s] speed of the world's point towards the arm; 0 where it is not known.
    row:       of the tick's own pairs.
    """

    link: NDArray[np.intp]
    distance: Array
    on_robot: Array
    on_world: Array
    normal: Array
    approach: Array
    row: NDArray[np.intp]


@dataclass(frozen=True, eq=False, slots=True)
class Frames:
    """Raw frames and what Flinch's perception makes of them: use whichever you like.

    raw:    the newest frame of every sensor that has spoken, by its number; those that stand now
            came at `stamp`. Distances, statuses and targets are the sensor's own, unfiltered.
    cloud:  every zone as a point with its verdict, base frame.
    memory: (n, 3) [m] points that have left the field of view, base frame.
    near:   the closest pairs.
    """

    raw: tuple[SensorFrame, ...]
    cloud: Cloud | None
    memory: Array
    near: Near

    @property
    def points(self) -> Array:
        """(n, 3) [m] of the world, base frame, after Flinch's own self filter: those seen, those
        at a lens, and those remembered."""
        if self.cloud is None:
            return self.memory
        verdict = self.cloud.verdict
        seen = (verdict == int(Verdict.KEPT)) | (verdict == int(Verdict.CONTACT))
        return np.concatenate((self.cloud.points[seen], self.memory))


def frames_of(now: Situation, newest: dict[int, SensorFrame]) -> Frames:
    """The frames of a tick; `newest` by sensor."""
    raw = tuple(newest[k] for k in sorted(newest))
    memory = NO_POINTS if now.memory is None else now.memory
    return Frames(raw, now.cloud, memory, near_of(now.pairs))


def near_of(pairs: Pairs) -> Near:
    """The pairs that there are, from near to far."""
    order = np.argsort(pairs.distance, kind="stable")
    order = order[np.isfinite(pairs.distance[order])]
    approach = np.zeros(len(pairs.distance)) if pairs.approach is None else pairs.approach
    return Near(
        pairs.link[order], pairs.distance[order], pairs.on_robot[order], pairs.on_world[order],
        pairs.normal[order], approach[order], order,
    )  # fmt: skip
