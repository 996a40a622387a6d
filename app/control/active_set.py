"""A small quadratic programme with bounds that may give way at a price, solved exactly.

    minimise    x'Hx/2 + g'x + sum_i ( c_i s_i + w_i s_i^2 / 2 )
    such that   J_i x + s_i >= b_i ,  s_i >= 0 ,  low <= x <= high

The dual active-set method of Goldfarb and Idnani ("A numerically stable dual method for
solving strictly convex quadratic programs", 1983): begin at the minimum without bounds, then
take in the bound that is broken most, until none is. Slack is no variable here: a bound whose
multiplier has reached its price c_i gives way and from then on pulls like a spring of
stiffness w_i, so the problem stays as small as x and always has an answer. Each step solves
the conditions anew from the factors of H; nothing is carried over, so nothing drifts.

A bound is numbered 0..m-1 for the rows, then n for the lower and n for the upper sides.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

OUT, HARD, SOFT = 0, 1, 2  # not in use, kept, given way
BROKEN = 1e-10  # [units of x] less than this is rounding
FLAT = 1e-14  # share of a bound that is left when those kept are taken out: it depends on them
STILL = 1e-12  # share of its parts below which a sum is rounding
TURNS = 400  # steps; tens are usual


@compiled
def minimise(
    H: Array, g: Array, J: Array, b: Array, c: Array, w: Array, low: Array, high: Array, x: Array
) -> int:
    """Write the minimum to x (n,) and return the number of steps, -1 when there was no answer.

    H: (n, n) positive definite.   g: (n,).   J: (m, n), b, c, w: (m,) as above, w > 0.
    low, high: (n,) with low <= high.
    """
    n, m = len(g), len(b)
    total = m + 2 * n
    state = np.zeros(total, dtype=np.int64)
    pull = np.zeros(total)  # multipliers
    change = np.empty(total)
    row, dx = np.empty(n), np.empty(n)
    L = np.empty((n, n))
    if not _cholesky(H, L):
        return -1
    _backward(L, _forward(L, -g), x)
    steps = 0
    while steps < TURNS:
        p = _most_broken(J, b, c, w, low, high, x, state)
        if p < 0:
            return steps
        soft = False  # has p itself given way?
        while steps < TURNS:
            steps += 1
            _row(J, m, p, row)
            slope = _direction(H, J, w, state, m, row, L, dx, change)
            if soft:
                slope += 1.0 / w[p]
            lacks = _lack(J, b, c, w, low, high, x, p, pull[p] if soft else 0.0)
            step, who = np.inf, -1
            if slope > 0.0:
                step, who = max(lacks, 0.0) / slope, p
            if p < m and not soft and pull[p] + step > c[p]:
                step, who = c[p] - pull[p], total
            for i in range(total):
                if state[i] == OUT or change[i] == 0.0:
                    continue
                if change[i] < 0.0:
                    floor = c[i] if state[i] == SOFT else 0.0
                    t = (pull[i] - floor) / -change[i]
                elif state[i] == HARD and i < m:
                    t = (c[i] - pull[i]) / change[i]
                else:
                    continue
                if t < step:
                    step, who = max(t, 0.0), i
            if who < 0:
                return -1
            x += step * dx
            pull += step * change
            pull[p] += step
            if who == p:
                state[p] = SOFT if soft else HARD
                break
            if who == total:
                soft = True
            elif state[who] == SOFT:
                state[who], pull[who] = HARD, c[who]
            elif change[who] < 0.0:
                state[who], pull[who] = OUT, 0.0
            else:
                state[who], pull[who] = SOFT, c[who]
    return -1


@compiled
def _row(J: Array, m: int, i: int, row: Array) -> None:
    """The gradient (n,) of bound i."""
    n = len(row)
    if i < m:
        row[:] = J[i]
        return
    row[:] = 0.0
    if i < m + n:
        row[i - m] = 1.0
    else:
        row[i - m - n] = -1.0


@compiled
def _lack(
    J: Array, b: Array, c: Array, w: Array, low: Array, high: Array, x: Array, i: int, pull: float
) -> float:
    """How far bound i is from being met; `pull` > c lets a row that has given way off."""
    m, n = len(b), len(x)
    if i < m:
        at = 0.0
        for j in range(n):
            at += J[i, j] * x[j]
        slack = (pull - c[i]) / w[i] if pull > c[i] else 0.0
        return b[i] - at - slack
    if i < m + n:
        return low[i - m] - x[i - m]
    return x[i - m - n] - high[i - m - n]


@compiled
def _most_broken(
    J: Array, b: Array, c: Array, w: Array, low: Array, high: Array, x: Array,
    state: NDArray[np.int64],
) -> int:  # fmt: skip
    worst, p = BROKEN, -1
    for i in range(len(state)):
        if state[i] == OUT:
            lacks = _lack(J, b, c, w, low, high, x, i, 0.0)
            if lacks > worst:
                worst, p = lacks, i
    return p


@compiled
def _direction(
    H: Array, J: Array, w: Array, state: NDArray[np.int64], m: int, row: Array,
    L: Array, dx: Array, change: Array,
) -> float:  # fmt: skip
    """Per unit of the multiplier of `row` (n,): dx (n,), the `change` of the others, the gain.

    What has given way adds its stiffness to H; what is kept must not move. The gain is zero
    where the row depends on what is kept.
    """
    n = len(row)
    S = H.copy()
    hard = np.empty(n, dtype=np.int64)
    k = 0
    for i in range(len(state)):
        if state[i] == SOFT:
            for r in range(n):
                for s in range(n):
                    S[r, s] += w[i] * J[i, r] * J[i, s]
        elif state[i] == HARD:
            hard[k] = i
            k += 1
    _cholesky(S, L)
    y = _forward(L, row)
    A = np.empty((k, n))  # rows of L^-1 A'
    a = np.empty(n)
    for i in range(k):
        _row(J, m, hard[i], a)
        A[i] = _forward(L, a)
    change[:] = 0.0
    whole = (y * y).sum()
    Q, R = np.empty((k, n)), np.zeros((k, k))  # A = R Q, the rows of Q orthonormal
    for i in range(k):
        Q[i] = A[i]
        _remove(Q, i, Q[i], R[i])
        rest = (Q[i] * Q[i]).sum()
        if rest > FLAT * (A[i] * A[i]).sum():
            R[i, i] = np.sqrt(rest)
            Q[i] /= R[i, i]
        else:  # twice the same bound: the first has all of the pull
            R[i, i] = 1.0
            Q[i] = 0.0
    t = np.zeros(k)
    _remove(Q, k, y, t)  # what was y is now y + Q't, and Q't = A'z with R'z = t
    for i in range(k - 1, -1, -1):
        v = t[i]
        for j in range(i + 1, k):
            v += R[j, i] * change[hard[j]]
        change[hard[i]] = -v / R[i, i]
    _backward(L, y, dx)
    gain = (y * y).sum()
    if gain < FLAT * whole:
        gain = 0.0
        dx[:] = 0.0
    for i in range(m):
        if state[i] == SOFT:
            d, size = 0.0, 0.0
            for r in range(n):
                d += J[i, r] * dx[r]
                size += abs(J[i, r] * dx[r])
            if abs(d) > STILL * size:
                change[i] = -w[i] * d
    return gain


@compiled
def _remove(Q: Array, k: int, v: Array, parts: Array) -> None:
    """Take the first k rows of Q out of v (n,), twice for accuracy, and add up their `parts`."""
    for _ in range(2):
        for j in range(k):
            d = 0.0
            for r in range(len(v)):
                d += Q[j, r] * v[r]
            parts[j] += d
            for r in range(len(v)):
                v[r] -= d * Q[j, r]


@compiled
def _cholesky(S: Array, L: Array) -> bool:
    """Write the lower L (n, n) with L L' = S; False where S is not positive definite."""
    n = len(S)
    for i in range(n):
        for j in range(i + 1):
            v = S[i, j]
            for k in range(j):
                v -= L[i, k] * L[j, k]
            if i > j:
                L[i, j] = v / L[j, j]
            elif v > 0.0:
                L[i, i] = np.sqrt(v)
            else:
                return False
    return True


@compiled
def _forward(L: Array, b: Array) -> Array:
    n = len(b)
    y = np.empty(n)
    for i in range(n):
        v = b[i]
        for j in range(i):
            v -= L[i, j] * y[j]
        y[i] = v / L[i, i]
    return y


@compiled
def _backward(L: Array, b: Array, y: Array) -> None:
    n = len(b)
    for i in range(n - 1, -1, -1):
        v = b[i]
        for j in range(i + 1, n):
            v -= L[j, i] * y[j]
        y[i] = v / L[i, i]
