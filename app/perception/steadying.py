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
from numpy.typing import NDArray

from app.messages import Pairs, freeze
from app.perception.following import Measured, nothing_followed, update
from app.robot.posture import Posture


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
        out = nothing_followed()
        n, closest = update(self._known, posture.T_base_link, measured, reach, dt, out)
        source = freeze(out.row[:n])
        return Pairs(
            link=freeze(out.link[:n]),
            distance=freeze(out.distance[:n]),
            on_robot=freeze(out.on_robot[:n]),
            on_world=freeze(out.on_world[:n]),
            normal=freeze(out.normal[:n]),
            slot=_slots(pairs, source),
            closest=closest,
            approach=freeze(out.approach[:n]),
            source=source,
        )


def aged(steady: Pairs, pairs: Pairs, lost: float) -> Pairs:
    """`steady` with the ages [s] of the `pairs` that each came from, `lost` of one out of sight."""
    assert pairs.age is not None and steady.source is not None
    age = np.full(len(steady.source), lost)
    seen = steady.source >= 0
    age[seen] = pairs.age[steady.source[seen]]
    return replace(steady, age=freeze(age))


def _slots(pairs: Pairs, source: NDArray[np.intp]) -> NDArray[np.intp]:
    """Where each world point came from, -1 of a lost one."""
    slot = np.full(len(source), -1, dtype=np.intp)
    seen = source >= 0
    slot[seen] = pairs.slot[source[seen]]
    return freeze(slot)
