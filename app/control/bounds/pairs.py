"""Every near pair of the world is a bound: what approaches is slowed, inside d_s it is led away.

For a pair at distance d, with h = d - d_s, the rate of the distance is at least

    low = w - min( gamma h , sqrt(2 a h) ) ,   gamma = xi / (d_inf - d_s)

which is the velocity damper of Faverjon and Tournassoud ("A local based approach for path
planning of manipulators with a high number of degrees of freedom", 1987) with the obstacle's
own approach speed w added; the root is what can still be braked with the deceleration a. What
moves away or along is free; what recedes is not followed. Inside d_s no more is demanded than

    min( v_esc , k v )      v: the reachable speed along the normal,  k: SHARE, URGENT

A point that can hardly be moved is no bound, or a few mm/s there would swing all the rest: up
to twice HARDLY it fades in. What is CLOSE is led away even so.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.config import Params
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
from app.messages import Array, Pairs

MOST = 24  # rows; the tightest are kept. The specification's m_e (section 4.2)
MOVING = 0.12  # [m/s] from this approach on the obstacle counts as moving: the estimate's own limit
SHARE = 0.15  # of the reachable speed that may be demanded: task priority's kappa, same reason
URGENT = 0.5  # the same before what moves (specification, section 4.4)
HARDLY = 0.15  # [m/s] reachable speed: three times what task priority takes, which has one row
CLOSE = 0.12  # [m] nearer than this also such a point is led away, fully from half of it on
DEEP = 0.05  # [m] inside d_s from which a retreat is urgent: about half way to CLOSE
STATIC_COST, MOVING_COST = (50.0, 100.0), (100.0, 100.0)  # of slack (specification, section 4.7)
XI = 1.0  # [m/s] approach that is free where avoidance begins: the most a goal may ask of a tool
NOTHING = np.empty(0)


class Damper(NamedTuple):
    """The settings: [m] reach (d_inf) and d_s, [1/s] gamma, [m/s] v_esc."""

    reach: float
    d_s: float
    gamma: float
    v_esc: float


class Near(NamedTuple):
    """The pairs (B,): link, distance [m], approach [m/s] or nothing, places and normals (B, 3)."""

    link: NDArray[np.int64]
    distance: Array
    approach: Array
    on_robot: Array
    normal: Array


class PairBounds:
    """The bounds of the world's pairs, the tightest of them."""

    def append(self, now: Situation, step: Step, sheet: Sheet) -> None:
        """Append at most `MOST`."""
        _append(near(now.pairs), damper(now.params), motion(now.posture), step, sheet)


def near(pairs: Pairs) -> Near:
    """The pairs' arrays."""
    w = NOTHING if pairs.approach is None else pairs.approach
    return Near(pairs.link, pairs.distance, w, pairs.on_robot, pairs.normal)


def gamma(params: Params) -> float:
    """[1/s] how the free approach speed grows with the distance beyond d_s."""
    return XI / (params.avoidance_begins - params.distance_kept)


def damper(params: Params) -> Damper:
    """The settings of the damper."""
    return Damper(
        params.avoidance_begins, params.distance_kept, gamma(params), params.retreat_speed
    )


@compiled
def _append(pairs: Near, law: Damper, moves: Motion, step: Step, sheet: Sheet) -> None:
    first = sheet.filled[0]
    for i in range(len(pairs.distance)):
        if pairs.distance[i] < law.reach:
            _append_pair(i, pairs, law, moves, step, sheet)
    keep_tightest(sheet, first, MOST)
    for i in range(first, sheet.filled[0]):
        ease(sheet, i, step)


@compiled
def _append_pair(i: int, pairs: Near, law: Damper, moves: Motion, step: Step, sheet: Sheet) -> None:
    """Append the bound of pair i if it bites."""
    J = sheet.jacobian[sheet.filled[0]]
    J[:] = 0.0
    add_rate(pairs.link[i], pairs.on_robot[i], pairs.normal[i], 1.0, moves, J)
    speed, brake = authority(J, step.qd_max, step.qdd_max)
    if speed == 0.0:  # the base
        return
    w = max(pairs.approach[i], 0.0) if len(pairs.approach) else 0.0
    h, moving = pairs.distance[i] - law.d_s, w > MOVING
    close = min(max(2.0 * (CLOSE - pairs.distance[i]) / CLOSE, 0.0), 1.0)
    share = URGENT if moving else SHARE
    if close > 0.0:
        share = max(share, close * URGENT)
    low = min(w - _free(h, brake, law.gamma), law.v_esc, share * speed)
    if speed < 2.0 * HARDLY:
        able = max(speed - HARDLY, 0.0) / HARDLY
        able = max(able, close * min(2.0 * speed / HARDLY, 1.0))
        low = able * low - (1.0 - able) * speed
    if not bites(J, low, step.low, step.high):
        return
    put(sheet, low, MOVING_COST if moving else STATIC_COST, i, h < 0.0, moving or h < -DEEP)


@compiled
def _free(h: float, brake: float, gamma: float) -> float:
    """Speed [m/s] at which a still point may be approached: min( gamma h , sqrt(2 a h) )."""
    free = gamma * h
    return min(free, np.sqrt(2.0 * brake * h)) if h > 0.0 else free
