"""Bounds on the joint velocities: one row for each pair that is to be kept apart.

A row says  J qd + s >= low , where J qd is the rate of a distance and s >= 0 the slack that it
costs `linear` s + `quadratic` s^2 / 2 to take. For a pair at distance d

    low = w - min( gamma h, sqrt(2 a h) ) ,   h = d - d_s ,   gamma = xi / (d_inf - d_s)

which is the velocity damper of Faverjon and Tournassoud ("A local based approach for path
planning of manipulators with a high number of degrees of freedom", 1987) with the obstacle's
own approach speed w added; the root is what can still be braked with the deceleration a. Only
what approaches is slowed: moving away and along is free. Inside d_s a retreat is demanded.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.config import Params
from app.control.clearance import KEPT, Gaps
from app.control.separation import allowed_speed
from app.messages import Array, Pairs
from app.robot.model import Robot
from app.robot.posture import Posture

MOVING = 0.12  # [m/s] from this approach speed on the obstacle counts as moving
URGENT = 0.5  # share of the reachable speed that may be demanded before a moving obstacle
WEAK = 3.0  # multiples of v_ach_min below which a point is left: its retreat swings the rest
BRAKING = 0.5  # share of the reachable deceleration that is counted on
DEEP = 0.05  # [m] inside d_s from which a retreat is urgent
EASE = 0.15  # [s] in which a retreat that is not urgent is taken up
SSM_REACH = 1.5  # [m] from here on a person's pace allows any speed of an arm
SELF_WITHIN = 0.15  # [m] farther links of the robot are no bounds
SELF_GAIN = 5.0  # [1/s]
STATIC_COST, MOVING_COST, SELF_COST = (50.0, 100.0), (100.0, 100.0), (500.0, 1000.0)


@dataclass(frozen=True, eq=False, slots=True)
class Rows:
    """m bounds: jacobian (m, n), low (m,) [m/s], linear and quadratic cost of slack (m,).

    source: (m,) row of the pairs that a bound came from, -1 for the robot itself and the cell.
    inside: (m,) bool, the pair is nearer than it should be.
    urgent: (m,) bool, a retreat is demanded at once.
    """

    jacobian: Array
    low: Array
    linear: Array
    quadratic: Array
    source: np.ndarray
    inside: np.ndarray
    urgent: np.ndarray


def avoidance_rows(
    robot: Robot,
    posture: Posture,
    pairs: Pairs,
    params: Params,
    approach: Array | None = None,
    most: int = 24,
) -> Rows:
    """The `most` tightest bounds of the world's pairs nearer than d_inf."""
    can_move = robot.supports[pairs.link].any(axis=1)
    near = np.flatnonzero((pairs.distance < reach(params)) & can_move)
    J = posture.distance_rows(pairs.link[near], pairs.on_robot[near], pairs.normal[near])
    h = pairs.distance[near] - params.d_s
    w = np.zeros(len(near))
    if approach is not None:
        w = np.maximum(approach[near], 0.0)  # what recedes is not followed
    moving = w > MOVING
    low = np.empty(len(near))
    kappa, urgent, least = np.inf, np.inf, 0.0
    if params.authority_cap:
        kappa, urgent = params.kappa, max(URGENT, params.kappa)
        least = WEAK * params.v_ach_min
    gamma = params.xi / (params.d_inf - params.d_s)
    _bounds(
        J, h, w, params.speed * robot.qd_max, robot.qdd_max, gamma, params.v_esc, kappa, urgent,
        least, low,
    )  # fmt: skip
    if params.mode == "ssm":
        low = -allowed_speed(pairs.distance[near], params)  # nothing gives way
    elif params.separation:
        low = np.maximum(low, -allowed_speed(pairs.distance[near], params))
    if len(near) > most:
        tightest = np.sort(np.argsort(-low, kind="stable")[:most])
        J, low, near = J[tightest], low[tightest], near[tightest]
        h, moving = h[tightest], moving[tightest]
    return Rows(
        jacobian=J,
        low=low,
        linear=np.where(moving, MOVING_COST[0], STATIC_COST[0]),
        quadratic=np.where(moving, MOVING_COST[1], STATIC_COST[1]),
        source=near,
        inside=h < 0.0,
        urgent=moving | (h < -DEEP),
    )


def reach(params: Params) -> float:
    """Pairs nearer than this [m] are bounds."""
    return SSM_REACH if params.mode == "ssm" else params.d_inf


@compiled
def _bounds(
    J: Array,
    h: Array,
    w: Array,
    qd_max: Array,
    qdd_max: Array,
    gamma: float,
    v_esc: float,
    kappa: float,
    urgent: float,
    least: float,
    low: Array,
) -> None:
    """A point that can hardly be moved is no bound: a few mm/s there swing all the rest."""
    for i in range(len(h)):
        reach, brake = 0.0, 0.0  # [m/s], [m/s^2] along the normal with all joints at their limit
        for j in range(J.shape[1]):
            reach += abs(J[i, j]) * qd_max[j]
            brake += BRAKING * abs(J[i, j]) * qdd_max[j]
        free = gamma * h[i]
        if h[i] > 0.0:
            free = min(free, np.sqrt(2.0 * brake * h[i]))
        cap = urgent if w[i] > MOVING else kappa
        low[i] = min(w[i] - free, v_esc, cap * reach)
        if reach < 2.0 * least:
            able = max(reach - least, 0.0) / least
            low[i] = able * low[i] - (1.0 - able) * reach


def own_rows(robot: Robot, posture: Posture, gaps: Gaps, params: Params, most: int = 8) -> Rows:
    """The `most` nearest gaps of the robot to itself and to the cell, with the dearest slack."""
    order = np.argsort(gaps.distance, kind="stable")[:most]
    m, n = len(order), robot.n
    J, low = np.empty((m, n)), np.empty(m)
    _own(
        order, gaps.a, gaps.b, gaps.distance, gaps.on_a, gaps.on_b, gaps.normal,
        posture.J_base, robot.supports, params.speed * robot.qd_max,
        KEPT, params.v_esc, params.kappa, J, low,
    )  # fmt: skip
    return Rows(
        J, low, np.full(m, SELF_COST[0]), np.full(m, SELF_COST[1]),
        np.full(m, -1), gaps.distance[order] < KEPT, gaps.distance[order] < KEPT / 2.0,
    )  # fmt: skip


@compiled
def _own(
    order: NDArray[np.int64],
    a: NDArray[np.int64],
    b: NDArray[np.int64],
    distance: Array,
    on_a: Array,
    on_b: Array,
    normal: Array,
    J_base: Array,
    supports: Array,
    qd_max: Array,
    kept: float,
    v_esc: float,
    kappa: float,
    J: Array,
    low: Array,
) -> None:
    """Rate of each gap, and its bound; a gap to the cell has only the one side that moves."""
    for i, k in enumerate(order):
        n = normal[k]
        turn_a, turn_b = np.cross(on_a[k], n), np.cross(on_b[k], n)
        reach = 0.0
        for j in range(J.shape[1]):
            along, one, two = 0.0, 0.0, 0.0
            for r in range(3):
                along += n[r] * J_base[r, j]
                one += turn_a[r] * J_base[3 + r, j]
                two += turn_b[r] * J_base[3 + r, j]
            J[i, j] = supports[a[k], j] * (along + one)
            if b[k] >= 0:
                J[i, j] -= supports[b[k], j] * (along + two)
            reach += abs(J[i, j]) * qd_max[j]
        low[i] = min(-SELF_GAIN * (distance[k] - kept), v_esc, kappa * reach)


def that_can_bite(rows: Rows, low: Array, high: Array) -> Rows:
    """The rows that some qd in low (n,) <= qd <= high (n,) breaks; the others change nothing."""
    bite = np.flatnonzero(_bites(rows.jacobian, rows.low, low, high))
    if len(bite) == len(rows.low):
        return rows
    return Rows(
        rows.jacobian[bite], rows.low[bite], rows.linear[bite], rows.quadratic[bite],
        rows.source[bite], rows.inside[bite], rows.urgent[bite],
    )  # fmt: skip


@compiled
def _bites(J: Array, bound: Array, low: Array, high: Array) -> np.ndarray:
    out = np.zeros(len(bound), dtype=np.bool_)
    for i in range(len(bound)):
        least = 0.0
        for j in range(J.shape[1]):
            least += J[i, j] * (low[j] if J[i, j] > 0.0 else high[j])
        out[i] = least < bound[i]
    return out


def joined(one: Rows, two: Rows) -> Rows:
    """Both sets of bounds, in this order."""
    return Rows(
        np.concatenate((one.jacobian, two.jacobian)),
        np.concatenate((one.low, two.low)),
        np.concatenate((one.linear, two.linear)),
        np.concatenate((one.quadratic, two.quadratic)),
        np.concatenate((one.source, two.source)),
        np.concatenate((one.inside, two.inside)),
        np.concatenate((one.urgent, two.urgent)),
    )


def eased(rows: Rows, robot: Robot, previous: Array, dt: float) -> Rows:
    """The rows with demands that grow, from the last command (n,), no faster than is wise.

    Half of the reachable acceleration, as the braking towards d_s counts on: all of it would
    swing every joint for the last few mm/s. A retreat that is not urgent is taken up slowly.
    """
    low = rows.low.copy()
    share = min(dt / EASE, 1.0)
    _ease(rows.jacobian, rows.urgent, previous, robot.qdd_max * dt, share, low)
    return replace(rows, low=low)


@compiled
def _ease(
    J: Array, urgent: np.ndarray, previous: Array, change: Array, share: float, low: Array
) -> None:
    for i in range(len(low)):
        rate, most = 0.0, 0.0
        for j in range(J.shape[1]):
            rate += J[i, j] * previous[j]
            most += BRAKING * abs(J[i, j]) * change[j]
        low[i] = min(low[i], rate + most)
        rate = max(rate, 0.0)
        if low[i] > rate and not urgent[i]:
            low[i] = rate + share * (low[i] - rate)
