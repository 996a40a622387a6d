"""The rows of gaps, to the arm's own links or to the cell: the nearest that can bound.

A gap d is bound as a pair of the world is, w and d_s being zero and `KEPT`:

    low = -min( k d , sqrt(2 a d) )        d beyond `KEPT`,  k: GAIN,  a: SPARE of what is reachable

One to the cell has only the one side that moves. Where all joints together cannot move that side
along the normal it is no bound, however near it is: the turning shoulder stands in the table's
margin for ever, and a demand to leave would only swing the rest. It fades in over `LEVER`.
"""

import numpy as np

from app.compiled import compiled
from app.control.bounds.pairs import SHARE
from app.control.bounds.rows import Motion, Sheet, add_rate, authority, bites, ease, put
from app.control.gaps import KEPT, Gaps
from app.control.limits import Step

GAIN = 5.0  # [1/s] (specification, section 4.5)
SPARE = 0.5  # share of the wise deceleration to plan with: a wrist that turns takes the rest
# [m, or 1 for a sliding joint] sum of a row; what is left out within it changes a distance of
# 10 cm from an axis by 2 mm
LEVER = 0.01
MOST = 12  # rows of each kind, the nearest (the specification's m_s is 8, without a cell)
COST = (500.0, 1000.0)  # of slack: above all of the world's (specification, section 4.7)


@compiled
def append_gaps(gaps: Gaps, v_esc: float, moves: Motion, step: Step, sheet: Sheet) -> None:
    """Append the bounds of the nearest `MOST` gaps that bite."""
    first = sheet.filled[0]
    if len(gaps.distance) == 0:
        return
    for k in np.argsort(gaps.distance, kind="mergesort"):
        if sheet.filled[0] == first + MOST:
            return
        _append_gap(gaps, k, v_esc, moves, step, sheet)


@compiled
def _append_gap(gaps: Gaps, k: int, v_esc: float, moves: Motion, step: Step, sheet: Sheet) -> None:
    """Append the bound of gap k if it bites."""
    b, where = gaps.who[k, 2], gaps.where[k]
    J, d, lever = sheet.jacobian[sheet.filled[0]], gaps.distance[k] - KEPT, 0.0
    J[:] = 0.0
    add_rate(gaps.who[k, 1], where[0], where[2], 1.0, moves, J)
    if b >= 0:
        add_rate(b, where[1], where[2], -1.0, moves, J)
    for j in range(len(J)):
        lever += abs(J[j])
    speed, brake = authority(J, step.qd_max, step.qdd_max)
    free = GAIN * d
    if free > 0.0:
        free = min(free, np.sqrt(2.0 * SPARE * brake * d))
    low = min(-free, v_esc, SHARE * speed)
    if b < 0 and lever < 2.0 * LEVER:
        if lever <= LEVER:
            return
        able = lever / LEVER - 1.0
        low = able * low - (1.0 - able) * speed
    if not bites(J, low, step.low, step.high):
        return
    ease(sheet, put(sheet, low, COST, -1, d < 0.0, d < -KEPT / 2.0), step)
