"""Pairs that neither jump with the sensors' noise nor vanish between two frames.

Each measured pair is followed from tick to tick by a track: the same link, about the same place
on it, about the same direction. Between frames its distance changes only by what the arm does,
which is known exactly, and by what the world does:

    d <- d + n . (on(q) - on(q before)) - w dt

A measurement m is then taken over in part, the less the smaller the surprise e = m - d:

    d <- d + min(1, |e| / SURPRISE) (dt / SETTLE) e ,   m - FARTHER <= d <= m + NEARER

So noise is averaged, a lag behind the arm's own motion does not arise, and what is really nearer
is believed at once. m is what was measured less the way that its approach w has made since, at
most `AHEAD` of it: frames come late, and what is remembered later still.

What is told is nearer than d by two sigma, and comes faster than w by one if it moves: sigma is
that of the measurement and of the way since, which grows with its age. A pair that is no longer
measured stays for a moment and then moves away at a walking pace, so that the arm is let go and
not thrown off.
"""

import numpy as np

from app.messages import Pairs, freeze
from app.perception.following import ROOM, nothing_followed, nothing_told, update
from app.perception.measured import Measured
from app.robot.posture import Posture

NO_SLOT = freeze(np.full(ROOM, -1, dtype=np.intp))  # what is followed is no point of the cloud


class Steadying:
    """Measured pairs in, steady ones out."""

    def __init__(self) -> None:
        self.reset()

    def reset(self) -> None:
        """Follow nothing."""
        self._known = nothing_followed()

    def update(self, posture: Posture, pairs: Pairs, reach: float, dt: float) -> Pairs:
        """The pairs nearer than `reach` [m], steadied; `source` is the row of `pairs` of each.

        dt: [s] since the last call.
        """
        doubt = np.zeros((4, len(pairs.distance)))
        for row, known in enumerate((pairs.approach, pairs.approach_sigma, pairs.sigma, pairs.age)):
            if known is not None:
                doubt[row] = known
        measured = Measured(
            pairs.link, pairs.distance, doubt, pairs.on_robot, pairs.on_world, pairs.normal
        )  # fmt: skip
        out = nothing_told()
        n, closest = update(self._known, posture.T_base_link, measured, reach, dt, out)
        who, number, place = map(freeze, out)
        return Pairs(
            link=who[0, :n],
            distance=number[0, :n],
            on_robot=place[0, :n],
            on_world=place[1, :n],
            normal=place[2, :n],
            slot=NO_SLOT[:n],
            closest=closest,
            approach=number[1, :n],
            sigma=number[2, :n],
            age=number[3, :n],
            source=who[1, :n],
        )
