"""The quadratic programme of one tick, and its solver.

    x = [ qd (n) | beta (1) | s (m) ]

    minimise  k_g |J qd - beta t|^2_W + k_b |t|^2_W (1 - beta)^2 + lambda_q |qd|^2
              + lambda_a |qd - qd_prev|^2 - 2 c grad(mu) . qd + slack      (all halved)
    such that J_i qd + s_i >= low_i ,  qd in its box ,  0 <= beta <= 1 ,  s >= 0

t is the bounded twist towards the goal and beta the progress along it: an arm that is blocked
slows on its path instead of leaving it. Slack is dear enough to be zero wherever the bounds
can be met, so that there is always an answer.

Solved by ProxQP (Bambade et al., "PROX-QP: yet another quadratic programming solver for
robotics and beyond", 2022) without an initial guess: the last result is a quicker start while
rows change smoothly, but costs tens of milliseconds when they jump. "Solved" alone is not
believed: with small residuals the solver may hold a joint at the wrong end of its box. So the
duality gap is watched, and a bound that pulls though it is not touched is solved once more.
"""

from dataclasses import dataclass

import numpy as np
from proxsuite import proxqp

from app.compiled import compiled
from app.control.rows import Rows
from app.messages import Array

SIZES = (0, 4, 8, 12, 16, 24, 32)  # numbers of rows that a solver is kept ready for
FREE = 1e20  # a bound that never holds
TASK_WEIGHT = np.array([1.0, 1.0, 1.0, 0.3, 0.3, 0.3])  # of the twist: linear, angular
ACCURACY, TURNS = 1e-5, 200
PENALTIES = (1e-3, 1e-2, 0.1)  # first weights of the bounds; the first needs the fewest turns
FAR = 1e3
TOUCHED = 1e-4  # a bound this near is touched: dear slack has multipliers of hundreds
HONEST = 1e-4  # largest product of a bound's multiplier and its distance
TIGHT = 1e-4  # [m/s] a bound met this closely is one that holds the arm


@dataclass(frozen=True, eq=False, slots=True)
class Costs:
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


@dataclass(frozen=True, eq=False, slots=True)
class Answer:
    """qd (n,), progress beta, slack (m,) and whether each bound holds the arm (m,)."""

    qd: Array
    progress: float
    slack: Array
    tight: np.ndarray


class Solver:
    """One ready problem for each size; unused rows are open."""

    def __init__(self, n: int) -> None:
        self._n = n
        self._problems = {m: _Problem(n, m) for m in SIZES}

    def solve(self, costs: Costs, rows: Rows, low: Array, high: Array) -> Answer | None:
        """The minimum within low (n,) <= qd <= high (n,), None when it was not found."""
        m = len(rows.low)
        size = next(s for s in SIZES if s >= m)
        return self._problems[size].solve(costs, rows, low, high)


class _Problem:
    def __init__(self, n: int, m: int) -> None:
        size = n + 1 + m
        self._n, self._m = n, m
        self._H, self._g = np.zeros((size, size)), np.zeros(size)
        self._C = np.zeros((m, size))
        self._C[:, n + 1 :] = np.eye(m)
        self._l, self._u = np.full(m, -FREE), np.full(m, FREE)
        self._low, self._high = np.zeros(size), np.full(size, FREE)
        self._high[n] = 1.0
        self._H[np.diag_indices(size)] = 1.0
        self._qp = proxqp.dense.QP(size, 0, m, True)
        self._qp.settings.eps_abs = ACCURACY
        self._qp.settings.max_iter = TURNS
        self._qp.settings.check_duality_gap = True
        self._qp.settings.eps_duality_gap_abs = ACCURACY
        self._qp.settings.eps_duality_gap_rel = 1e-6
        self._qp.settings.initial_guess = proxqp.NO_INITIAL_GUESS
        self._qp.init(
            self._H, self._g, None, None, self._C, self._l, self._u, self._low, self._high
        )

    def solve(self, costs: Costs, rows: Rows, low: Array, high: Array) -> Answer | None:
        n, m = self._n, len(rows.low)
        _fill(
            costs.tool, costs.twist, costs.previous, costs.push,
            costs.k_g, costs.k_b, costs.lambda_q, costs.lambda_a,
            rows.jacobian, rows.low, rows.linear, rows.quadratic,
            self._H, self._g, self._C, self._l,
        )  # fmt: skip
        self._low[:n], self._high[:n] = low, high
        self._low[n] = 1.0 if costs.slide else 0.0
        x = next(filter(lambda x: x is not None, map(self._run, PENALTIES)), None)
        if x is None:
            return None
        qd = np.minimum(np.maximum(x[:n], low), high)  # the solver is accurate to ACCURACY only
        slack = np.maximum(x[n + 1 : n + 1 + m], 0.0)
        return Answer(qd, float(x[n]), slack, rows.jacobian @ qd - rows.low < TIGHT)

    def _run(self, penalty: float) -> Array | None:
        """The minimum (n + 1 + m,), None when none was found that can be believed."""
        self._qp.settings.default_mu_in = penalty
        self._qp.update(
            H=self._H, g=self._g, C=self._C, l=self._l, u=self._u,
            l_box=self._low, u_box=self._high,
        )  # fmt: skip
        self._qp.solve()
        results = self._qp.results
        if results.info.status != proxqp.PROXQP_SOLVED:
            return None
        x = np.asarray(results.x)
        pulls = _pulls(x, np.asarray(results.z), self._C, self._l, self._low, self._high)
        return x if pulls < HONEST and np.isfinite(x).all() else None


@compiled
def _pulls(x: Array, z: Array, C: Array, bound: Array, low: Array, high: Array) -> float:
    """Largest product of a multiplier and its bound's distance: zero at the minimum."""
    m, worst = len(bound), 0.0
    for i in range(len(z)):
        if i < m:
            at = 0.0
            for j in range(len(x)):
                at += C[i, j] * x[j]
            below, above = bound[i], FREE
        else:
            at, below, above = x[i - m], low[i - m], high[i - m]
        distance = at - below if z[i] < 0.0 else above - at
        pull = abs(z[i]) * min(
            max(distance - TOUCHED, 0.0), FAR
        )  # a bound that is open has rounding's multiplier
        if not abs(pull) <= worst:
            worst = abs(pull)
    return worst


@compiled
def _fill(
    tool: Array,
    twist: Array,
    previous: Array,
    push: Array,
    k_g: float,
    k_b: float,
    lambda_q: float,
    lambda_a: float,
    jacobian: Array,
    low: Array,
    linear: Array,
    quadratic: Array,
    H: Array,
    g: Array,
    C: Array,
    bound: Array,
) -> None:
    """Write the costs H, g and the rows C, bound; rows beyond the given ones stay open."""
    n, m = tool.shape[1], len(low)
    t_t = 0.0
    for r in range(6):
        t_t += TASK_WEIGHT[r] * twist[r] * twist[r]
    stay = k_b * (t_t + 1e-4)
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
        H[i, i] += lambda_q + lambda_a
        g[i] = -lambda_a * previous[i] - push[i]
    H[n, n] = k_g * t_t + stay
    g[n] = -stay
    for r in range(len(bound)):
        s = n + 1 + r
        if r < m:
            H[s, s], g[s], bound[r] = quadratic[r], linear[r], low[r]
            C[r, :n] = jacobian[r]
        else:
            H[s, s], g[s], bound[r] = 1.0, 0.0, -FREE
            C[r, :n] = 0.0
