"""A small quadratic programme with bounds that may give way at a price, solved exactly.

    minimise    x'Hx/2 + g'x + sum_i ( c_i s_i + w_i s_i^2 / 2 )
    such that   J_i x + s_i >= b_i ,  s_i >= 0 ,  low <= x <= high

The dual active-set method of Goldfarb and Idnani ("A numerically stable dual method for
solving strictly convex quadratic programs", 1983): begin at the minimum without bounds, then
take in the bound that is broken most, until none is. Slack is no variable here: a bound whose
multiplier has reached its price c_i gives way and from then on pulls like a spring of
stiffness w_i, so the problem stays as small as x and always has an answer. What the factors
hold is always as if made anew from H and the bounds in use, never updated: nothing drifts.

A bound is numbered 0..m-1 for the rows, then n for the lower and n for the upper sides.
"""

from typing import NamedTuple

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
    change = np.zeros(total)
    row, dx, y = np.empty(n), np.empty(n), np.empty(n)
    f = _factors(n, total)
    kept = 0
    _begin(H, f)
    if not _cholesky(f.S, f.L):
        return -1
    for i in range(n):
        row[i] = -g[i]
    _forward(f.L, row, y)
    _backward(f.L, y, x)
    steps = 0
    while steps < TURNS:
        p = _most_broken(J, b, low, high, x, state)
        if p < 0:
            return steps
        _row(J, m, p, row)
        soft = False  # has p itself given way?
        slope = _direction(J, w, state, m, row, f, kept, y, dx, change)
        while steps < TURNS:
            steps += 1
            lacks = _lack(J, b, low, high, x, p)
            if soft and pull[p] > c[p]:
                lacks -= (pull[p] - c[p]) / w[p]
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
            for i in range(n):
                x[i] += step * dx[i]
            for i in range(total):
                pull[i] += step * change[i]
            pull[p] += step
            if who == total:  # the way stays the same, p only needs more of it
                soft = True
                slope += 1.0 / w[p]
                continue
            if who == p and not soft:
                state[p] = HARD
                kept = _keep(J, m, p, f, kept)
            elif state[who] == HARD and change[who] < 0.0:
                state[who], pull[who] = OUT, 0.0
                kept = _release(who, f, kept)
            elif state[who] == SOFT:
                state[who], pull[who] = HARD, c[who]
                _begin(H, f)
                for i in range(m):
                    if state[i] == SOFT:
                        _soften(J, w, i, f)
                kept = _renew(J, state, m, f)
            else:
                if who != p:
                    pull[who] = c[who]
                state[who] = SOFT
                _soften(J, w, who, f)
                kept = _renew(J, state, m, f)
            if who == p:
                break
            slope = _direction(J, w, state, m, row, f, kept, y, dx, change)
            if soft:
                slope += 1.0 / w[p]
    return -1


class _Factors(NamedTuple):
    """S (n, n): H with what has given way, L its lower factor, the diagonal of L inverted.

    who: (k,) the bounds that are kept.   A: (k, n) rows of L^-1 a.   A = R Q, the rows of Q
    (k, n) orthonormal, R (k, k) lower.
    """

    S: Array
    L: Array
    A: Array
    Q: Array
    R: Array
    who: NDArray[np.int64]


@compiled
def _factors(n: int, total: int) -> _Factors:
    return _Factors(
        np.empty((n, n)),
        np.empty((n, n)),
        np.empty((total, n)),
        np.empty((total, n)),
        np.empty((total, total)),
        np.empty(total, dtype=np.int64),
    )


@compiled
def _row(J: Array, m: int, i: int, row: Array) -> None:
    """The gradient (n,) of bound i."""
    n = len(row)
    if i < m:
        for j in range(n):
            row[j] = J[i, j]
        return
    for j in range(n):
        row[j] = 0.0
    if i < m + n:
        row[i - m] = 1.0
    else:
        row[i - m - n] = -1.0


@compiled
def _lack(J: Array, b: Array, low: Array, high: Array, x: Array, i: int) -> float:
    """How far bound i is from being met without giving way."""
    m, n = len(b), len(x)
    if i < m:
        at = 0.0
        for j in range(n):
            at += J[i, j] * x[j]
        return b[i] - at
    if i < m + n:
        return low[i - m] - x[i - m]
    return x[i - m - n] - high[i - m - n]


@compiled
def _most_broken(
    J: Array, b: Array, low: Array, high: Array, x: Array, state: NDArray[np.int64]
) -> int:
    worst, p = BROKEN, -1
    for i in range(len(state)):
        if state[i] == OUT:
            lacks = _lack(J, b, low, high, x, i)
            if lacks > worst:
                worst, p = lacks, i
    return p


@compiled
def _direction(
    J: Array, w: Array, state: NDArray[np.int64], m: int, row: Array,
    f: _Factors, kept: int, y: Array, dx: Array, change: Array,
) -> float:  # fmt: skip
    """Per unit of the multiplier of `row` (n,): dx (n,), the `change` of the others, the gain.

    What has given way adds its stiffness to H; what is kept must not move. The gain is zero
    where the row depends on what is kept.
    """
    n = len(row)
    _forward(f.L, row, y)
    t = f.R[kept]  # no row of it is in use beyond those kept
    whole, gain = _remove(f.Q, kept, y, t)  # y was y + Q't, and Q't = A'z with R'z = t
    for i in range(len(change)):
        change[i] = 0.0
    for i in range(kept - 1, -1, -1):
        v = t[i]
        for j in range(i + 1, kept):
            v += f.R[j, i] * change[f.who[j]]
        change[f.who[i]] = -v / f.R[i, i]
    if gain < FLAT * whole:
        for r in range(n):
            dx[r] = 0.0
        gain = 0.0
    else:
        _backward(f.L, y, dx)
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
def _keep(J: Array, m: int, i: int, f: _Factors, kept: int) -> int:
    """Bound i is kept from now on; the number of those that are."""
    _row(J, m, i, f.Q[kept])
    _forward(f.L, f.Q[kept], f.A[kept])
    f.who[kept] = i
    _straighten(f, kept)
    return kept + 1


@compiled
def _release(i: int, f: _Factors, kept: int) -> int:
    """Bound i is not kept any more; the number of those that are."""
    at = 0
    while f.who[at] != i:
        at += 1
    for k in range(at, kept - 1):
        f.who[k] = f.who[k + 1]
        for r in range(len(f.L)):
            f.A[k, r] = f.A[k + 1, r]
        _straighten(f, k)
    return kept - 1


@compiled
def _begin(H: Array, f: _Factors) -> None:
    for r in range(len(H)):
        for s in range(len(H)):
            f.S[r, s] = H[r, s]


@compiled
def _soften(J: Array, w: Array, i: int, f: _Factors) -> None:
    """Row i has given way and pulls from now on."""
    n = len(f.S)
    for r in range(n):
        part = w[i] * J[i, r]
        for s in range(n):
            f.S[r, s] += part * J[i, s]


@compiled
def _renew(J: Array, state: NDArray[np.int64], m: int, f: _Factors) -> int:
    """All factors, after S has changed; the number of bounds that are kept."""
    _cholesky(f.S, f.L)
    kept = 0
    for i in range(len(state)):
        if state[i] == HARD:
            kept = _keep(J, m, i, f, kept)
    return kept


@compiled
def _straighten(f: _Factors, k: int) -> None:
    """Row k of Q and R, from row k of A and the rows of Q before it."""
    n = len(f.L)
    for r in range(n):
        f.Q[k, r] = f.A[k, r]
    whole, rest = _remove(f.Q, k, f.Q[k], f.R[k])
    # twice the same bound: the first has all of the pull
    f.R[k, k] = np.sqrt(rest) if rest > FLAT * whole else 1.0
    scale = 1.0 / f.R[k, k] if rest > FLAT * whole else 0.0
    for r in range(n):
        f.Q[k, r] *= scale


@compiled
def _remove(Q: Array, k: int, v: Array, parts: Array) -> tuple[float, float]:
    """Take the first k rows of Q out of v (n,), their shares to `parts`; |v|^2 before and after.

    Twice where much was taken out, for then rounding has left something ("twice is enough":
    Parlett, "The Symmetric Eigenvalue Problem", 6.9).
    """
    whole, rest = 0.0, 0.0
    for r in range(len(v)):
        whole += v[r] * v[r]
    for j in range(k):
        parts[j] = 0.0
    before, rest = np.inf, whole
    while k > 0 and rest < 0.5 * before and rest > 0.0:
        before = rest
        for j in range(k):
            d = 0.0
            for r in range(len(v)):
                d += Q[j, r] * v[r]
            parts[j] += d
            for r in range(len(v)):
                v[r] -= d * Q[j, r]
        rest = 0.0
        for r in range(len(v)):
            rest += v[r] * v[r]
    return whole, rest


@compiled
def _cholesky(S: Array, L: Array) -> bool:
    """Write the lower L (n, n) with L L' = S, its diagonal inverted; False where S is not
    positive definite.
    """
    n = len(S)
    for i in range(n):
        for j in range(i + 1):
            v = S[i, j]
            for k in range(j):
                v -= L[i, k] * L[j, k]
            if i > j:
                L[i, j] = v * L[j, j]
            elif v > 0.0:
                L[i, i] = 1.0 / np.sqrt(v)
            else:
                return False
    return True


@compiled
def _forward(L: Array, b: Array, y: Array) -> None:
    for i in range(len(b)):
        v = b[i]
        for j in range(i):
            v -= L[i, j] * y[j]
        y[i] = v * L[i, i]


@compiled
def _backward(L: Array, b: Array, y: Array) -> None:
    n = len(b)
    for i in range(n - 1, -1, -1):
        v = b[i]
        for j in range(i + 1, n):
            v -= L[j, i] * y[j]
        y[i] = v * L[i, i]
