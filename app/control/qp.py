"""The quadratic programme of one tick.

    x = [ qd (n) | beta (1) ] , slack s (m)

    minimise  k_g |J qd - beta t|^2_W + k_b |t|^2_W (1 - beta)^2 + lambda_q |qd|^2
              + lambda_a |qd - qd_prev|^2 - 2 c grad(mu) . qd + slack      (all halved)
    such that J_i qd + s_i >= low_i ,  qd in its box ,  0 <= beta <= 1 ,  s >= 0

t is the bounded twist towards the goal and beta the progress along it: an arm that is blocked
slows on its path instead of leaving it. Slack is dear enough to be zero wherever the bounds
can be met, so that there is always an answer; see `app.control.solver`.
"""

from typing import NamedTuple

import numpy as np

from app.compiled import compiled
from app.control.bounds.rows import Rows
from app.control.solver import FREE, Problem, minimise
from app.messages import Array

TASK_WEIGHT = np.array([1.0, 1.0, 1.0, 0.3, 0.3, 0.3])  # of the twist: linear, angular
LEAST_STAY = 1e-8  # keeps beta's cost above zero without a twist or its weight
TIE = 1e-6  # bounds that say the same give way one after the other
LEAST_EFFORT = 1e-6  # weights that only make the least slack's qd unique
SPARE, HELD = 1e-6, 1e6  # [m/s] by which that slack is loosened, price of more of it
TIGHT = 1e-4  # [m/s] a bound met this closely is one that holds the arm


class Costs(NamedTuple):
    """What the goal and the joints cost; k_g, k_b, lambda_q, lambda_a as above.

    tool: (6, n) jacobian.   twist: (6,) [m/s, rad/s].   previous: (n,) a command to stay near.
    push: (n,) c grad(mu).   slide: beta is held at 1.   weight: (6,) W's diagonal.
    Where joints are asked for, t are their velocities (n,), J is the identity and W (n,).
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
    weight: Array = TASK_WEIGHT


class Answer(NamedTuple):
    """qd (n,), progress beta, slack (m,) and whether each bound holds the arm (m,)."""

    qd: Array
    progress: float
    slack: Array
    tight: np.ndarray


def solve(
    costs: Costs, rows: Rows, low: Array, high: Array, lexicographic: bool = False,
    solver: str = "daqp",
) -> Answer | None:  # fmt: skip
    """The minimum within low (n,) <= qd <= high (n,), None when it was not found.

    lexicographic: the least slack is found first and no cost may add to it.
    """
    bound, linear = rows.low, rows.linear
    if lexicographic and len(bound):
        least = least_slack(rows, low, high, solver)
        if least is None:
            return None
        bound, linear = bound - least - SPARE, np.full(len(least), HELD)
    x = minimise(problem(costs, rows._replace(low=bound, linear=linear), low, high), solver)
    if x is None:
        return None
    qd, slack, tight = x[:-1].copy(), np.empty(len(rows.low)), np.empty(len(rows.low), np.bool_)
    _lacking(rows.jacobian, rows.low, qd, slack, tight)
    return Answer(qd, float(x[-1]), slack, tight)


def least_slack(rows: Rows, low: Array, high: Array, solver: str = "daqp") -> Array | None:
    """The slack (m,) of least weighted square that some qd in its box needs."""
    n, m = len(low), len(rows.low)
    p = Problem(
        LEAST_EFFORT * np.eye(n), np.zeros(n), rows.jacobian, np.concatenate((low, rows.low)),
        np.concatenate((high, np.full(m, FREE))), np.full(m, LEAST_EFFORT), rows.quadratic,
    )  # fmt: skip
    qd = minimise(p, solver)
    return None if qd is None else np.maximum(rows.low - rows.jacobian @ qd, 0.0)


def problem(costs: Costs, rows: Rows, low: Array, high: Array) -> Problem:
    """The problem of x = [qd | beta]; low, high: (n,) of qd."""
    n, m = len(low), len(rows.low)
    least, most = np.empty((2, n + 1 + m))
    p = Problem(
        np.empty((n + 1, n + 1)), np.empty(n + 1), np.empty((m, n + 1)), least, most, np.empty(m),
        rows.quadratic,
    )  # fmt: skip
    _write(costs, rows.jacobian, rows.linear, rows.low, low, high, p)
    return p


@compiled
def _lacking(J: Array, low: Array, qd: Array, slack: Array, tight: np.ndarray) -> None:
    """Write what each bound (m,) lacks at qd, and whether it holds the arm."""
    for i in range(len(low)):
        rest = low[i]
        for j in range(len(qd)):
            rest -= J[i, j] * qd[j]
        slack[i], tight[i] = max(rest, 0.0), rest > -TIGHT


@compiled
def _write(
    costs: Costs, J: Array, linear: Array, bound: Array, low: Array, high: Array, out: Problem
) -> None:
    """Write H, g, J, prices, the box and the rows' bounds.

    The prices (m,) of slack differ a little, so that equal bounds give way one by one.
    """
    tool, twist, W, k_g = costs.tool, costs.twist, costs.weight, costs.k_g
    n = tool.shape[1]
    t_t = 0.0
    for r in range(len(twist)):
        t_t += W[r] * twist[r] * twist[r]
    stay = costs.k_b * (t_t + 1e-4) + LEAST_STAY
    for i in range(n):
        for j in range(n):
            v = 0.0
            for r in range(len(twist)):
                v += W[r] * tool[r, i] * tool[r, j]
            out.H[i, j] = k_g * v
        v = 0.0
        for r in range(len(twist)):
            v += W[r] * tool[r, i] * twist[r]
        out.H[i, n] = out.H[n, i] = -k_g * v
        out.H[i, i] += costs.lambda_q + costs.lambda_a
        out.g[i] = -costs.lambda_a * costs.previous[i] - costs.push[i]
    out.H[n, n] = k_g * t_t + stay
    out.g[n] = -stay
    out.low[:n], out.high[:n] = low, high
    out.low[n], out.high[n] = (1.0 if costs.slide else 0.0), 1.0
    for i in range(len(bound)):
        out.J[i, :n], out.J[i, n] = J[i], 0.0
        out.low[n + 1 + i], out.high[n + 1 + i] = bound[i], FREE
        out.c[i] = linear[i] * (1.0 + TIE * i)
