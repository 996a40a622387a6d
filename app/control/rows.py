"""Bounds on the joint velocities: one row for each pair that is to be kept apart.

A row says  J qd + s >= low , where J qd is the rate of a distance and s >= 0 the slack that it
costs `linear` s + `quadratic` s^2 / 2 to take. For a pair at distance d

    low = w - min( gamma h, sqrt(2 a h) ) ,   h = d - d_s ,   gamma = xi / (d_inf - d_s)

which is the velocity damper of Faverjon and Tournassoud ("A local based approach for path
planning of manipulators with a high number of degrees of freedom", 1987) with the obstacle's
own approach speed w added; the root is what can still be braked with the deceleration a. Only
what approaches is slowed: moving away and along is free. Inside d_s a retreat is demanded.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import Learned
from app.cell.parts import Cell
from app.compiled import compiled
from app.config import Params
from app.control.clearance import Clearance
from app.control.gaps import KEPT, Gaps
from app.control.separation import FASTEST, ceiling, in_use
from app.messages import Array, Pairs
from app.robot.model import Robot
from app.robot.posture import Posture

MOVING = 0.12  # [m/s] from this approach speed on the obstacle counts as moving
URGENT = 0.5  # share of the reachable speed that may be demanded before a moving obstacle
WEAK = 3.0  # multiples of v_ach_min below which a point is left: its retreat swings the rest
BRAKING = 0.5  # share of the reachable deceleration that is counted on
CLOSE = 0.12  # [m] nearer than this also such a point is led away, fully from half of it on
DEEP = 0.05  # [m] inside d_s from which a retreat is urgent
EASE = 0.15  # [s] in which a retreat that is not urgent is taken up
SELF_WITHIN = 0.15  # [m] farther links of the robot are no bounds
CELL_WITHIN = 0.3  # [m] nor farther parts of the cell, at which a stretched arm can come fast
SELF_GAIN = 5.0  # [1/s]
SPARE = 0.5  # share of that deceleration to plan with: a wrist that turns takes the rest
LEVER = 0.01  # [m, or 1 for a sliding joint] see `_own`
MOST, MOST_OWN = 24, 12  # rows: of the world, and of the robot itself with the cell
NOTHING = np.empty(0)
STATIC_COST, MOVING_COST, SELF_COST = (50.0, 100.0), (100.0, 100.0), (500.0, 1000.0)


class Rows(NamedTuple):
    """m bounds: jacobian (m, n), low (m,) [m/s], linear and quadratic cost of slack (m,).

    source: (m,) row of the pairs that a bound came from, -1 for the robot itself and the cell.
    inside: (m,) bool, the pair is nearer than it should be.
    urgent: (m,) bool, a retreat is demanded at once.
    """

    jacobian: Array
    low: Array
    linear: Array
    quadratic: Array
    source: NDArray[np.int64]
    inside: NDArray[np.bool_]
    urgent: NDArray[np.bool_]


class Bounds:
    """Makes the rows of each tick: the world's first, then the robot's own and the cell's."""

    def __init__(self, robot: Robot, cell: Cell | None = None) -> None:
        self._robot, self._clearance = robot, Clearance(robot, cell)

    def know(self, learned: Learned) -> None:
        """From now on this is what was learned of the cell, instead of what was before."""
        self._clearance.know(learned)

    def rows(
        self,
        posture: Posture,
        pairs: Pairs,
        params: Params,
        low: Array,
        high: Array,
        previous: Array,
        dt: float,
    ) -> Rows:
        """The bounds that some qd in low (n,) <= qd <= high (n,) breaks; others change nothing.

        At most `MOST` of the world's, the tightest, and `MOST_OWN` of the own, the nearest.
        What is demanded grows, from the `previous` command (n,), no faster than is wise: half
        of the reachable acceleration, as the braking towards d_s counts on. All of it would
        swing every joint for the last few mm/s. A retreat that is not urgent is eased in.
        """
        robot, n = self._robot, self._robot.n
        room = max(len(pairs.distance), MOST) + MOST_OWN
        J, bound, linear, quadratic = np.empty((room, n)), *np.empty((3, room))
        source, (inside, urgent) = np.empty(room, np.int64), np.empty((2, room), np.bool_)
        box = _Box(low, high, previous, robot.qd_max, robot.qdd_max, params.speed, dt)
        m = _fill(
            posture.distance_rows(pairs.link, pairs.on_robot, pairs.normal), pairs.distance,
            NOTHING if pairs.approach is None else pairs.approach,
            ceiling(pairs, params) if in_use(params) else NOTHING,
            _damping(params), box, self._clearance.measure(posture, CELL_WITHIN, SELF_WITHIN),
            posture.J_base, robot.supports, params.v_esc, params.kappa,
            Rows(J, bound, linear, quadratic, source, inside, urgent),
        )  # fmt: skip
        return Rows(J[:m], bound[:m], linear[:m], quadratic[:m], source[:m], inside[:m], urgent[:m])

    def cell_rows(
        self, posture: Posture, params: Params, low: Array, high: Array, previous: Array, dt: float
    ) -> Rows:
        """The known cell's bounds alone, for a controller that has none of its own."""
        robot, room = self._robot, MOST_OWN
        bound, linear, quadratic = np.empty((3, room))
        inside, urgent = np.empty((2, room), np.bool_)
        J, source = np.empty((room, robot.n)), np.empty(room, np.int64)
        rows = Rows(J, bound, linear, quadratic, source, inside, urgent)
        box = _Box(low, high, previous, robot.qd_max, robot.qdd_max, params.speed, dt)
        gaps = self._clearance.measure(posture, SELF_WITHIN)
        gaps = Gaps._make(column[gaps.b < 0] for column in gaps)
        m = _own(
            gaps, posture.J_base, robot.supports, params.v_esc, params.kappa, box, 0, rows
        )  # fmt: skip
        return Rows._make(column[:m] for column in rows)


def reach(params: Params) -> float:
    """Pairs nearer than this [m] are bounds."""
    return FASTEST if in_use(params) else params.d_inf


class _Damping(NamedTuple):
    """Numbers of the world's bounds: [m] reach and d_s, [1/s] gamma, [m/s] v_esc, and so on."""

    reach: float
    d_s: float
    gamma: float
    v_esc: float
    kappa: float  # share of the reachable speed that may be demanded, and before what moves
    urgent: float
    least: float  # [m/s] see `WEAK`
    gives_way: bool


def _damping(params: Params) -> _Damping:
    kappa, urgent, least = np.inf, np.inf, 0.0
    if params.authority_cap:
        kappa, urgent = params.kappa, max(URGENT, params.kappa)
        least = WEAK * params.v_ach_min
    gamma = params.xi / (params.d_inf - params.d_s)
    return _Damping(
        reach(params), params.d_s, gamma, params.v_esc, kappa, urgent, least, params.mode != "ssm"
    )


class _Box(NamedTuple):
    """low (n,) <= qd <= high (n,) of this tick, the last command, and the arm's limits (n,)."""

    low: Array
    high: Array
    previous: Array
    qd_max: Array
    qdd_max: Array
    speed: float  # share of qd_max in use
    dt: float  # [s]


@compiled
def _fill(
    J: Array,
    distance: Array,
    approach: Array,
    ceiling: Array,
    damping: _Damping,
    box: _Box,
    gaps: Gaps,
    J_base: Array,
    supports: Array,
    v_esc: float,
    kappa: float,
    out: Rows,
) -> int:
    """Write all rows, and how many; J: (B, n) the rates of the pairs' distances."""
    m = _world(J, distance, approach, ceiling, damping, box, out)
    return _own(gaps, J_base, supports, v_esc, kappa, box, m, out)


@compiled
def _world(
    J: Array,
    distance: Array,
    approach: Array,
    ceiling: Array,
    damping: _Damping,
    box: _Box,
    out: Rows,
) -> int:
    """Write the rows of the world's pairs; how many."""
    m, n = 0, len(box.low)
    for i in range(len(distance)):
        h = distance[i] - damping.d_s
        if not distance[i] < damping.reach:
            continue
        reach, brake = 0.0, 0.0  # [m/s], [m/s^2] along the normal with all joints at their limit
        for j in range(n):
            out.jacobian[m, j] = J[i, j]
            reach += abs(J[i, j]) * box.speed * box.qd_max[j]
            brake += BRAKING * abs(J[i, j]) * box.qdd_max[j]
        if reach == 0.0:  # the base
            continue
        w = max(approach[i], 0.0) if len(approach) else 0.0  # what recedes is not followed
        free = damping.gamma * h
        if h > 0.0:
            free = min(free, np.sqrt(2.0 * brake * h))
        close = min(max(2.0 * (CLOSE - distance[i]) / CLOSE, 0.0), 1.0)
        cap = damping.urgent if w > MOVING else damping.kappa
        if close > 0.0:
            cap = max(cap, close * damping.urgent)
        bound = min(w - free, damping.v_esc, cap * reach)
        if reach < 2.0 * damping.least:
            # a point that can hardly be moved is no bound: a few mm/s there swing all the rest
            able = max(reach - damping.least, 0.0) / damping.least
            able = max(able, close * min(2.0 * reach / damping.least, 1.0))
            bound = able * bound - (1.0 - able) * reach
        if len(ceiling):
            bound = max(bound, -ceiling[i]) if damping.gives_way else -ceiling[i]
        if not _bites(out.jacobian[m], bound, box):
            continue
        moving = w > MOVING
        out.low[m], out.source[m] = bound, i
        out.linear[m] = MOVING_COST[0] if moving else STATIC_COST[0]
        out.quadratic[m] = MOVING_COST[1] if moving else STATIC_COST[1]
        out.inside[m], out.urgent[m] = h < 0.0, moving or h < -DEEP
        m += 1
    while m > MOST:
        loosest = 0
        for i in range(m):
            if out.low[i] <= out.low[loosest]:
                loosest = i
        for i in range(loosest, m - 1):
            _copy(out, i + 1, i)
        m -= 1
    for i in range(m):
        _ease(out, i, box)
    return m


@compiled
def _copy(table: Rows, a: int, b: int) -> None:
    """Row a to row b."""
    table.jacobian[b] = table.jacobian[a]
    table.low[b], table.source[b] = table.low[a], table.source[a]
    table.linear[b], table.quadratic[b] = table.linear[a], table.quadratic[a]
    table.inside[b], table.urgent[b] = table.inside[a], table.urgent[a]


@compiled
def _bites(J: Array, bound: float, box: _Box) -> bool:
    """Does some qd in the box break the bound?"""
    least = 0.0
    for j in range(len(J)):
        if J[j] != 0.0:
            least += J[j] * (box.low[j] if J[j] > 0.0 else box.high[j])
    return least < bound


@compiled
def _own(
    gaps: Gaps,
    J_base: Array,
    supports: Array,
    v_esc: float,
    kappa: float,
    box: _Box,
    m: int,
    out: Rows,
) -> int:
    """Append the rows of the nearest gaps that can bound; how many rows there are then.

    A gap is bound as one to the world is, w and d_s being zero and `KEPT`. One to the cell has
    only the one side that moves. Where all joints together cannot move
    that side along the normal it is no bound, however near it is: the turning shoulder stands
    in the table's margin for ever, and a demand to leave would only swing the rest. It fades
    in over `LEVER`; what is left out within it changes a distance of 10 cm from an axis by 2 mm.
    """
    if len(gaps.distance) == 0:
        return m
    most = m + MOST_OWN
    for k in np.argsort(gaps.distance, kind="mergesort"):
        if m == most:
            break
        d, b, where = gaps.distance[k], gaps.who[k, 2], gaps.where[k]
        J, reach, brake, lever = out.jacobian[m], 0.0, 0.0, 0.0
        J[:] = 0.0
        _add_rate(gaps.who[k, 1], where[0], where[2], 1.0, J_base, supports, J)
        if b >= 0:
            _add_rate(b, where[1], where[2], -1.0, J_base, supports, J)
        for j in range(len(J)):
            reach += abs(J[j]) * box.speed * box.qd_max[j]
            brake += BRAKING * abs(J[j]) * box.qdd_max[j]
            lever += abs(J[j])
        free = SELF_GAIN * (d - KEPT)
        if free > 0.0:
            free = min(free, np.sqrt(2.0 * SPARE * brake * (d - KEPT)))
        bound = min(-free, v_esc, kappa * reach)
        if b < 0 and lever < 2.0 * LEVER:
            if lever <= LEVER:
                continue
            able = lever / LEVER - 1.0
            bound = able * bound - (1.0 - able) * reach
        if not _bites(J, bound, box):
            continue
        out.low[m], out.source[m] = bound, -1
        out.linear[m], out.quadratic[m] = SELF_COST
        out.inside[m], out.urgent[m] = d < KEPT, d < KEPT / 2.0
        _ease(out, m, box)
        m += 1
    return m


@compiled
def _add_rate(
    link: int, at: Array, n: Array, sign: float, J_base: Array, supports: Array, J: Array
) -> None:
    """Add to J (n,) the rate, times `sign`, of the point `at` (3,) of a link along n (3,)."""
    x = at[1] * n[2] - at[2] * n[1]
    y = at[2] * n[0] - at[0] * n[2]
    z = at[0] * n[1] - at[1] * n[0]
    for j in range(len(J)):
        if supports[link, j] != 0.0:
            along = n[0] * J_base[0, j] + n[1] * J_base[1, j] + n[2] * J_base[2, j]
            turn = x * J_base[3, j] + y * J_base[4, j] + z * J_base[5, j]
            J[j] += sign * supports[link, j] * (along + turn)


@compiled
def _ease(out: Rows, i: int, box: _Box) -> None:
    """Let the demand of row i grow no faster than is wise; see `Bounds.rows`."""
    rate, most = 0.0, 0.0
    for j in range(len(box.low)):
        rate += out.jacobian[i, j] * box.previous[j]
        most += BRAKING * abs(out.jacobian[i, j]) * box.qdd_max[j] * box.dt
    out.low[i] = min(out.low[i], rate + most)
    rate = max(rate, 0.0)
    if out.low[i] > rate and not out.urgent[i]:
        out.low[i] = rate + min(box.dt / EASE, 1.0) * (out.low[i] - rate)
