"""A quadratic programme whose bounds may give way at a price, and who solves it.

    minimise    x'Hx/2 + g'x + sum_i ( c_i s_i + w_i s_i^2 / 2 )
    such that   J_i x + s_i >= b_i ,  s_i >= 0 ,  low <= x <= high

Two maintained libraries can: DAQP (Arnstroem, Bemporad and Axehill, "A dual active-set solver
for embedded quadratic programming using recursive LDL' updates", 2022), exact and the fastest
here, and ProxQP (Bambade et al., "PROX-QP: yet another quadratic programming solver for robotics
and beyond", 2022). Whatever either says is believed only with a proof: with its multipliers mu
of the rows as a point of the dual, the cost of x above the minimum is at most

    sum_i ( c_i s_i + w_i s_i^2 / 2 - mu_i (b_i - J_i x) + max(mu_i - c_i, 0)^2 / (2 w_i) )
    + sum_j max( r_j (x_j - low_j) , r_j (x_j - high_j) ) ,      r = H x + g - J' mu

since x'Hx/2 lies above its tangent. An answer without it is asked for a second time, of the
other library. Slack is rarely needed, so DAQP is first asked without any: where no multiplier
exceeds its price the answer is the same.
"""

from collections.abc import Callable
from typing import NamedTuple

import daqp
import numpy as np
from proxsuite import proxqp

from app.compiled import compiled
from app.messages import Array

FREE = 1e20  # a bound that never holds; both libraries take it for none
EXACT = 1e-9  # cost above the minimum, as a share of one more than the cost's own size
MET = 1e-10  # [m/s] a bound that lacks less is met; DAQP's own 1e-6 costs 1e-4 at these prices
ACCURACY, TURNS = 1e-11, 100  # of ProxQP: with 1e-9 a quarter of its answers has no proof


class Problem(NamedTuple):
    """H (n, n) positive definite, g (n,), J (m, n), c, w (m,) as above, w > 0.

    low, high: (n + m,) of x and of J x as libraries take them: the box, then b and `FREE`.
    """

    H: Array
    g: Array
    J: Array
    low: Array
    high: Array
    c: Array
    w: Array


# x (n,) or more, and the rows' multipliers (m,), which are negative where b holds
Found = tuple[Array, Array] | None


def minimise(p: Problem, solver: str = "daqp") -> Array | None:
    """The minimum x (n,), within its box; None where neither library has proved to have it."""
    x = np.empty(len(p.g))
    for attempt in ATTEMPTS[solver]:
        found = attempt(p)
        if found is not None and _proved(p, found[0], found[1], x):
            return x
    return None


def with_slack(p: Problem) -> Problem:
    """The same with x = [x | s], whose rows never give way."""
    n, m = len(p.g), len(p.c)
    size = n + m
    out = Problem(
        np.zeros((size, size)), np.empty(size), np.zeros((m, size)), np.empty(size + m),
        np.full(size + m, FREE), p.c, p.w,
    )  # fmt: skip
    _widen(p, out)
    return out


def _daqp(p: Problem) -> Found:
    """By DAQP without slack: the minimum as long as no multiplier exceeds its price."""
    x, _, status, info = daqp.solve(p.H, p.g, p.J, p.high, p.low, primal_tol=MET)
    return (x, info["lam"][len(x) :]) if status > 0 else None  # those of the box come first


def _daqp_with_slack(p: Problem) -> Found:
    """By DAQP where bounds have to give way."""
    return _daqp(with_slack(p)) if len(p.c) else None


def _proxqp(p: Problem) -> Found:
    """By ProxQP, always with slack: without it, it takes seconds to say that there is no answer."""
    m = len(p.c)
    p = with_slack(p)
    n = len(p.g)
    qp = proxqp.dense.QP(n, 0, m, True)
    s = qp.settings
    s.eps_abs, s.eps_rel, s.max_iter, s.initial_guess = ACCURACY, 0.0, TURNS, NO_GUESS
    s.check_duality_gap = True
    qp.init(p.H, p.g, None, None, p.J, p.low[n:], p.high[n:], p.low[:n], p.high[:n])
    qp.solve()
    return np.array(qp.results.x), np.array(qp.results.z)[:m]  # those of the rows come first


NO_GUESS = proxqp.NO_INITIAL_GUESS  # warm starts took up to 56 ms where rows jump (spec., 4.2)
ATTEMPTS: dict[str, tuple[Callable[[Problem], Found], ...]] = {
    "daqp": (_daqp, _daqp_with_slack, _proxqp),
    "proxqp": (_proxqp, _daqp, _daqp_with_slack),
}


@compiled
def _widen(p: Problem, out: Problem) -> None:
    """Write the problem with slack into zeros."""
    n, m = len(p.g), len(p.c)
    for i in range(n):
        out.H[i, :n] = p.H[i]
        out.g[i], out.low[i], out.high[i] = p.g[i], p.low[i], p.high[i]
    for i in range(m):
        out.J[i, :n] = p.J[i]
        out.J[i, n + i] = 1.0
        out.H[n + i, n + i], out.g[n + i] = p.w[i], p.c[i]
        out.low[n + i], out.low[n + m + i] = 0.0, p.low[n + i]


@compiled
def _proved(p: Problem, found: Array, pull: Array, x: Array) -> bool:
    """Write the answer that was found, (n,) or more, within its box; is it the minimum?

    pull: (m,) the rows' multipliers, negative where b holds.
    """
    n, cost, excess = len(x), 0.0, 0.0
    for j in range(n):
        if not np.isfinite(found[j]):
            return False
        x[j] = min(max(found[j], p.low[j]), p.high[j])
    for j in range(n):
        slope = 0.0
        for k in range(n):
            slope += p.H[j, k] * x[k]
        cost += (0.5 * slope + p.g[j]) * x[j]
        slope += p.g[j]
        for i in range(len(p.c)):
            slope += p.J[i, j] * min(pull[i], 0.0)
        excess += max(slope * (x[j] - p.low[j]), slope * (x[j] - p.high[j]))
    for i in range(len(p.c)):
        mu, lack = max(-pull[i], 0.0), p.low[n + i]
        for j in range(n):
            lack -= p.J[i, j] * x[j]
        s = max(lack - MET, 0.0)
        price = p.c[i] * s + 0.5 * p.w[i] * s * s
        cost += price
        excess += price - mu * lack + 0.5 * max(mu - p.c[i], 0.0) ** 2 / p.w[i]
    return bool(excess <= EXACT * (1.0 + abs(cost)))
