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
rows change smoothly, but costs tens of milliseconds when they jump.
"""

from dataclasses import dataclass

import numpy as np
from proxsuite import proxqp

from app.control.rows import Rows
from app.messages import Array

SIZES = (0, 4, 8, 12, 16, 24, 32)  # numbers of rows that a solver is kept ready for
FREE = 1e20  # a bound that never holds
TASK_WEIGHT = np.array([1.0, 1.0, 1.0, 0.3, 0.3, 0.3])  # of the twist: linear, angular
ACCURACY, TURNS = 1e-5, 200
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
        self._joints, self._diagonal = np.arange(n), np.arange(n + 1, size)
        self._l, self._u = np.full(m, -FREE), np.full(m, FREE)
        self._low, self._high = np.zeros(size), np.full(size, FREE)
        self._high[n] = 1.0
        self._H[np.diag_indices(size)] = 1.0
        self._qp = proxqp.dense.QP(size, 0, m, True)
        self._qp.settings.eps_abs = ACCURACY
        self._qp.settings.max_iter = TURNS
        self._qp.settings.initial_guess = proxqp.NO_INITIAL_GUESS
        self._qp.init(
            self._H, self._g, None, None, self._C, self._l, self._u, self._low, self._high
        )

    def solve(self, costs: Costs, rows: Rows, low: Array, high: Array) -> Answer | None:
        n, m = self._n, len(rows.low)
        self._cost(costs, rows)
        self._C[:m, :n], self._C[m:, :n] = rows.jacobian, 0.0
        self._l[:m], self._l[m:] = rows.low, -FREE
        self._low[:n], self._high[:n] = low, high
        self._low[n] = 1.0 if costs.slide else 0.0
        self._qp.update(
            H=self._H, g=self._g, C=self._C, l=self._l, u=self._u,
            l_box=self._low, u_box=self._high,
        )  # fmt: skip
        self._qp.solve()
        if self._qp.results.info.status != proxqp.PROXQP_SOLVED:
            return None
        x = self._qp.results.x
        if not np.isfinite(x).all():
            return None
        qd = np.minimum(np.maximum(x[:n], low), high)  # the solver is accurate to ACCURACY only
        slack = np.maximum(x[n + 1 : n + 1 + m], 0.0)
        return Answer(qd, float(x[n]), slack, rows.jacobian @ qd - rows.low < TIGHT)

    def _cost(self, c: Costs, rows: Rows) -> None:
        n, m = self._n, len(rows.low)
        weighted = (c.tool.T * TASK_WEIGHT) * c.k_g
        t_t = float(c.twist @ (TASK_WEIGHT * c.twist))
        stay = c.k_b * (t_t + 1e-4)
        H, g = self._H, self._g
        H[:n, :n] = weighted @ c.tool
        H[self._joints, self._joints] += c.lambda_q + c.lambda_a
        H[:n, n] = H[n, :n] = -(weighted @ c.twist)
        H[n, n] = c.k_g * t_t + stay
        g[:n] = -c.lambda_a * c.previous - c.push
        g[n] = -stay
        H[self._diagonal[:m], self._diagonal[:m]] = rows.quadratic
        g[n + 1 : n + 1 + m] = rows.linear
        H[self._diagonal[m:], self._diagonal[m:]] = 1.0
        g[n + 1 + m :] = 0.0
