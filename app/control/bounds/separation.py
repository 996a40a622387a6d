"""Speed and separation as a bound: no pair closes faster than its distance allows, however far.

    -J qd - s <= v_max(d)

v_max is that of `app.control.separation`. It limits the approach of the body's point and never
demands a retreat. A model, not a certified function.
"""

import numpy as np

from app.compiled import compiled
from app.control.bounds.pairs import MOST, STATIC_COST, Near, near
from app.control.bounds.rows import (
    Motion,
    Sheet,
    add_rate,
    authority,
    bites,
    ease,
    keep_tightest,
    motion,
    put,
)
from app.control.controller import Situation
from app.control.limits import Step
from app.control.separation import ceiling
from app.messages import Array


class SeparationBounds:
    """The bounds of all pairs that are followed, near or far, the tightest of them."""

    def append(self, now: Situation, step: Step, sheet: Sheet) -> None:
        """Append at most `MOST`."""
        most = ceiling(now.pairs, now.params)
        _append(near(now.pairs), most, now.params.distance_kept, motion(now.posture), step, sheet)


@compiled
def _append(pairs: Near, most: Array, d_s: float, moves: Motion, step: Step, sheet: Sheet) -> None:
    first = sheet.filled[0]
    for i in range(len(pairs.distance)):
        J = sheet.jacobian[sheet.filled[0]]
        if not pairs.distance[i] < np.inf:
            continue
        J[:] = 0.0
        add_rate(pairs.link[i], pairs.on_robot[i], pairs.normal[i], 1.0, moves, J)
        speed, _ = authority(J, step.qd_max, step.qdd_max)
        if speed == 0.0 or not bites(J, -most[i], step.low, step.high):
            continue
        put(sheet, -most[i], STATIC_COST, i, pairs.distance[i] < d_s, False)
    keep_tightest(sheet, first, MOST)
    for i in range(first, sheet.filled[0]):
        ease(sheet, i, step)
