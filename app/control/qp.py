"""The quadratic programme of one tick, and its solver.

    x = [ qd (n) | beta (1) ] , slack s (m)

    minimise  k_g |J qd - beta t|^2_W + k_b |t|^2_W (1 - beta)^2 + lambda_q |qd|^2
              + lambda_a |qd - qd_prev|^2 - 2 c grad(mu) . qd + slack      (all halved)
    such that J_i qd + s_i >= low_i ,  qd in its box ,  0 <= beta <= 1 ,  s >= 0

t is the bounded twist towards the goal and beta the progress along it: an arm that is blocked
slows on its path instead of leaving it. Slack is dear enough to be zero wherever the bounds
can be met, so that there is always an answer.

The exact method of `app.control.active_set` answers. ProxQP (Bambade et al., "PROX-QP: yet
another quadratic programming solver for robotics and beyond", 2022) is the second opinion
where that runs out of steps. It does not come first: near a goal, where every cost is small,
it calls a joint at the wrong end of its box "solved", so its answer is believed only where
each bound that pulls is touched.
"""

from typing import NamedTuple

import numpy as np
from proxsuite import proxqp

from app.compiled import compiled
from app.control.active_set import minimise
from app.control.rows import Rows
from app.messages import Array

TASK_WEIGHT = np.array([1.0, 1.0, 1.0, 0.3, 0.3, 0.3])  # of the twist: linear, angular
LEAST_STAY = 1e-8  # keeps beta's cost above zero without a twist or its weight
TIE = 1e-6  # bounds that say the same give way one after the other
FREE = 1e20  # a bound that never holds
ACCURACY, TURNS = 1e-6, 1000  # of ProxQP
LEAST_EFFORT = 1e-6  # weights that only make the least slack's qd unique
SPARE, HELD = 1e-6, 1e6  # [m/s] by which that slack is loosened, price of more of it
TOUCHED = 1e-4  # a bound this near is touched
HONEST = 1e-4  # largest product of a bound's multiplier and its distance
TIGHT = 1e-4  # [m/s] a bound met this closely is one that holds the arm


class Costs(NamedTuple):
    """What the goal and the joints cost; k_g, k_b, lambda_q, lambda_a as above.

    tool: (6, n) jacobian.   twist: (6,) [m/s, rad/s].   previous: (n,) the last command.
    push: (n,) c grad(mu).   slide: beta is held at 1.
    """

    tool: Array
    twist: Array
    previous: Array
    push: Array
    k_g: float
    k_b: float
    lambda_q: float
    lambda_a: float
    slide: bool


class Problem(NamedTuple):
    """What `app.control.active_set.minimise` is asked: H, g, J, the box, prices; its answer x."""

    H: Array
    g: Array
    J: Array
    least: Array
    most: Array
    price: Array
    x: Array


class Answer(NamedTuple):
    """qd (n,), progress beta, slack (m,) and whether each bound holds the arm (m,)."""

    qd: Array
    progress: float
    slack: Array
    tight: np.ndarray


def solve(
    costs: Costs, rows: Rows, low: Array, high: Array, lexicographic: bool = False
) -> Answer | None:
    """The minimum within low (n,) <= qd <= high (n,), None when it was not found.

    lexicographic: the least slack is found first and no cost may add to it.
    """
    bounds = rows
    if lexicographic and len(rows.low):
        least = least_slack(rows, low, high)
        if least is None:
            return None
        bounds = rows._replace(low=rows.low - least - SPARE, linear=np.full(len(least), HELD))
    return _solve(costs, bounds, rows.low, low, high)


def least_slack(rows: Rows, low: Array, high: Array) -> Array | None:
    """The slack (m,) of least weighted square that some qd in its box needs."""
    n, m = len(low), len(rows.low)
    qd = np.empty(n)
    H, free = LEAST_EFFORT * np.eye(n), np.full(m, LEAST_EFFORT)
    steps = minimise(
        H, np.zeros(n), rows.jacobian, rows.low, free, rows.quadratic, low, high, qd
    )  # fmt: skip
    return None if steps < 0 else np.maximum(rows.low - rows.jacobian @ qd, 0.0)


def _solve(costs: Costs, rows: Rows, asked: Array, low: Array, high: Array) -> Answer | None:
    """With slack counted from the bounds that were `asked` for, (m,)."""
    n, m = len(low), len(rows.low)
    qd, slack, tight = np.empty(n), np.empty(m), np.empty(m, dtype=np.bool_)
    g, least, most, x = np.empty((4, n + 1))
    H, J, price = np.empty((n + 1, n + 1)), np.empty((m, n + 1)), np.empty(m)
    steps = _minimise(
        costs, rows.jacobian, rows.low, rows.linear, rows.quadratic, low, high,
        Problem(H, g, J, least, most, price, x),
    )  # fmt: skip
    if steps < 0:
        second = second_opinion(H, g, J, rows, least, most)
        if second is None:
            return None
        x = second
    if not _read(x, low, high, rows.jacobian, asked, qd, slack, tight):
        return None
    return Answer(qd, float(x[n]), slack, tight)


def second_opinion(
    H: Array, g: Array, J: Array, rows: Rows, low: Array, high: Array
) -> Array | None:
    """The minimum x (n + 1,) as ProxQP finds it, None when that cannot be believed."""
    n, m = len(g), len(rows.low)
    size = n + m
    wide, cost = np.zeros((size, size)), np.concatenate((g, rows.linear))
    wide[:n, :n] = H
    wide[range(n, size), range(n, size)] = rows.quadratic
    C = np.concatenate((J, np.eye(m)), axis=1)
    least = np.concatenate((low, np.zeros(m)))
    most = np.concatenate((high, np.full(m, FREE)))
    qp = proxqp.dense.QP(size, 0, m, True)
    qp.settings.eps_abs, qp.settings.max_iter = ACCURACY, TURNS
    qp.settings.check_duality_gap = True
    qp.settings.initial_guess = proxqp.NO_INITIAL_GUESS
    qp.init(wide, cost, None, None, C, rows.low, np.full(m, FREE), least, most)
    qp.solve()
    x, z = np.asarray(qp.results.x), np.asarray(qp.results.z)
    if qp.results.info.status != proxqp.PROXQP_SOLVED or not np.isfinite(x).all():
        return None
    below = np.concatenate((C @ x - rows.low, x - least))
    above = np.concatenate((np.full(m, FREE), most - x))
    distance = np.where(z < 0.0, below, above)
    open_end = distance > 0.5 * FREE  # has the multiplier of rounding
    pulls = np.abs(z) * np.maximum(np.where(open_end, 0.0, distance) - TOUCHED, 0.0)
    return x[:n] if pulls.max(initial=0.0) < HONEST else None


@compiled
def _read(
    x: Array,
    low: Array,
    high: Array,
    jacobian: Array,
    asked: Array,
    qd: Array,
    slack: Array,
    tight: np.ndarray,
) -> bool:
    """Write qd (n,) and what each bound (m,) lacks; False where a number is not finite."""
    n = len(qd)
    for j in range(n):
        if not np.isfinite(x[j]):
            return False
        qd[j] = min(max(x[j], low[j]), high[j])
    for i in range(len(asked)):
        rest = asked[i]
        for j in range(n):
            rest -= jacobian[i, j] * qd[j]
        slack[i], tight[i] = max(rest, 0.0), rest > -TIGHT
    return bool(np.isfinite(x[n]))


@compiled
def _minimise(
    costs: Costs, jacobian: Array, bound: Array, linear: Array, quadratic: Array, low: Array,
    high: Array, out: Problem,
) -> int:  # fmt: skip
    """Write the problem and its answer; the steps taken, -1 without an answer."""
    _build(costs, jacobian, linear, low, high, out)
    H, g, J, least, most, price, x = out
    return int(minimise(H, g, J, bound, price, quadratic, least, most, x))


@compiled
def _build(
    costs: Costs, jacobian: Array, linear: Array, low: Array, high: Array, out: Problem
) -> None:
    """Write the problem of x = [qd | beta].

    The prices (m,) of slack differ a little, so that equal bounds give way one by one.
    """
    H, g, J, least, most, price = out[:6]
    tool, twist, k_g = costs.tool, costs.twist, costs.k_g
    n = tool.shape[1]
    t_t = 0.0
    for r in range(6):
        t_t += TASK_WEIGHT[r] * twist[r] * twist[r]
    stay = costs.k_b * (t_t + 1e-4) + LEAST_STAY
    for i in range(n):
        for j in range(n):
            v = 0.0
            for r in range(6):
                v += TASK_WEIGHT[r] * tool[r, i] * tool[r, j]
            H[i, j] = k_g * v
        v = 0.0
        for r in range(6):
            v += TASK_WEIGHT[r] * tool[r, i] * twist[r]
        H[i, n] = H[n, i] = -k_g * v
        H[i, i] += costs.lambda_q + costs.lambda_a
        g[i] = -costs.lambda_a * costs.previous[i] - costs.push[i]
    H[n, n] = k_g * t_t + stay
    g[n] = -stay
    J[:, :n] = jacobian
    J[:, n] = 0.0
    least[:n], most[:n] = low, high
    least[n], most[n] = (1.0 if costs.slide else 0.0), 1.0
    for i in range(len(linear)):
        price[i] = linear[i] * (1.0 + TIE * i)
