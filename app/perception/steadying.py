"""Pairs that neither jump with the sensors' noise nor vanish between two frames.

Each measured pair is followed from tick to tick by a track: the same link, about the same place
on it, about the same direction. Between frames its distance changes only by what the arm does,
which is known exactly, and by what the world does:

    d <- d + n . (on(q) - on(q before)) - w dt

A measurement m is then taken over in part, the less the smaller the surprise e = m - d:

    d <- d + min(1, |e| / SURPRISE) (dt / SETTLE) e ,   m - FARTHER <= d <= m + NEARER

So noise is averaged, a lag behind the arm's own motion does not arise, and what is really nearer
is believed at once. A pair that is no longer measured stays for a moment and then moves away at
a walking pace, so that the arm is let go and not thrown off.
"""

from dataclasses import replace

import numpy as np

from app.messages import Pairs, freeze
from app.perception.following import ROOM, Measured, nothing_followed, nothing_told, update
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

        dt: [s] since the last call. Ages are not followed.
        """
        w = np.zeros(len(pairs.distance)) if pairs.approach is None else pairs.approach
        measured = Measured(
            pairs.link, pairs.distance, w, pairs.on_robot, pairs.on_world, pairs.normal
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
            source=who[1, :n],
        )


def aged(steady: Pairs, pairs: Pairs, lost: float) -> Pairs:
    """`steady` with the ages [s] of the `pairs` that each came from, `lost` of one out of sight."""
    assert pairs.age is not None and steady.source is not None
    age = np.full(len(steady.source), lost)
    seen = steady.source >= 0
    age[seen] = pairs.age[steady.source[seen]]
    return replace(steady, age=freeze(age))
