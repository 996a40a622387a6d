"""Task priority with smooth activation and regularisation.

Levels are solved in order; each acts only in the space that the levels above leave free. A
row's activation a in [0, 1] fades it in and out without a jump. The generalised inverse of a
level with Jacobian X, activation A (diagonal) and free-space projector Q is

    X^# = reg( X^T A X + eta (I - Q)^T (I - Q) ) X^T A A

where reg inverts a symmetric matrix through its eigenvalues sigma as sigma / (sigma^2 + p),
with p a raised cosine that damps only sigma < theta (Simetti and Casalino, "A novel practical
technique to integrate inequality control objectives and task transitions in priority based
control", 2016). Mind that sigma is the SQUARE of a singular value of the Jacobian.

Level k takes what is missing of its reference x, from what the levels above have made of rho:

    W = X X^#_Q ,   G = X^#_I ,   rho <- rho + s Q G W (x - J rho) ,   Q <- Q (I - G X) ,   X = J Q

s is the largest share that keeps every joint's speed. W is what keeps the answer continuous
while a higher level is being activated.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

# The set in the Genoa school's own code. Over 300 random postures with an avoidance of 0.2 m/s
# fully active the largest joint speed was 0.7 rad/s in the median; a hundred times more damping
# made it 0.4 and the goal's error four times larger (specification, section 1.5).
LAMBDA_R = 1e-4  # damping of a direction that is lost
THETA = 1e-2  # eigenvalues below it are damped: singular values of 0.1
ETA = 10.0  # preference for directions that no higher level uses


@dataclass(frozen=True, eq=False, slots=True)
class Task:
    """One level: jacobian (m, n), reference (m,) [m/s, rad/s], activation (m,) in [0, 1]."""

    jacobian: Array
    reference: Array
    activation: Array


class Levels(NamedTuple):
    """All levels' rows, one below another; level k has the rows first[k]:first[k + 1]."""

    jacobian: Array
    reference: Array
    activation: Array
    first: NDArray[np.int64]


def solve(tasks: Sequence[Task], qd_max: Array) -> tuple[Array, float]:
    """Joint velocities (n,) for `tasks`, highest priority first, and the smallest s.

    qd_max: (n,) bound on each joint's speed. A level that would push a joint over it is
    shortened as a whole (direction kept), so a lower level never takes from a higher one.
    """
    first = np.zeros(len(tasks) + 1, dtype=np.int64)
    np.cumsum([len(t.reference) for t in tasks], out=first[1:])
    levels = Levels(
        np.concatenate([t.jacobian for t in tasks]),
        np.concatenate([t.reference for t in tasks]),
        np.concatenate([t.activation for t in tasks]),
        first,
    )
    rho = np.zeros(len(qd_max))
    return rho, _recursion(levels, qd_max, rho)


@compiled
def _recursion(levels: Levels, qd_max: Array, rho: Array) -> float:
    """All levels. Writes rho (n,) and returns the smallest s."""
    identity = np.eye(len(qd_max))
    Q = identity.copy()
    smallest = 1.0
    for k in range(len(levels.first) - 1):
        rows = slice(levels.first[k], levels.first[k + 1])
        J = np.ascontiguousarray(levels.jacobian[rows])
        X = J @ Q
        XtA = np.ascontiguousarray(X.T) * levels.activation[rows]
        XtAA = XtA * levels.activation[rows]
        gram = XtA @ X
        I_Q = identity - Q
        prefer = ETA * (np.ascontiguousarray(I_Q.T) @ I_Q)
        G = regularised_inverse(gram) @ XtAA
        # at the first level everything is free and both inverses are the same
        H = G if k == 0 else regularised_inverse(gram + prefer) @ XtAA
        W = X @ H
        wanted = levels.reference[rows] - J @ rho
        delta = Q @ (G @ (W @ wanted))
        scale = largest_step(rho, delta, qd_max)
        smallest = min(smallest, scale)
        rho += scale * delta
        Q = Q @ (identity - G @ X)
    return smallest


@compiled
def regularised_inverse(M: Array) -> Array:
    """Inverse of a symmetric positive semi-definite M (n, n), damped near singularity."""
    sigma, U = np.linalg.eigh(M)
    for i in range(len(sigma)):
        s = max(sigma[i], 0.0)
        sigma[i] = 0.0 if s < 1e-12 else s / (s * s + damping(s))
    return np.asarray((U * sigma) @ np.ascontiguousarray(U.T))


@compiled
def damping(sigma: float) -> float:
    """p(sigma) = lambda_r (1 + cos(pi sigma / theta)) / 2 below theta, 0 from there on."""
    if sigma >= THETA:
        return 0.0
    return float(LAMBDA_R * 0.5 * (1.0 + np.cos(np.pi * sigma / THETA)))


@compiled
def largest_step(rho: Array, delta: Array, qd_max: Array) -> float:
    """Largest s in [0, 1] with |rho + s delta| <= qd_max on every joint."""
    s = 1.0
    for j in range(len(rho)):
        if delta[j] != 0.0:
            room = qd_max[j] - rho[j] if delta[j] > 0.0 else qd_max[j] + rho[j]
            s = min(s, room / abs(delta[j]))
    return max(s, 0.0)
