"""Task priority with smooth activation and regularisation.

Levels are solved in order; each acts only in the space that the levels above leave free. A
row's activation a in [0, 1] fades it in and out without a jump. The generalised inverse of a
level with Jacobian X, activation A (diagonal) and free-space projector Q is

    X^# = reg( X^T A X + eta (I - Q)^T (I - Q) ) X^T A A

where reg inverts a symmetric matrix through its eigenvalues sigma as sigma / (sigma^2 + p),
with p a raised cosine that damps only sigma < theta (Simetti and Casalino, "A novel practical
technique to integrate inequality control objectives and task transitions in priority based
control", 2016). Mind that sigma is the SQUARE of a singular value of the Jacobian.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array


@dataclass(frozen=True, eq=False, slots=True)
class Task:
    """One level: jacobian (m, n), reference (m,) [m/s, rad/s], activation (m,) in [0, 1]."""

    jacobian: Array
    reference: Array
    activation: Array


@dataclass(frozen=True, slots=True)
class Regularisation:
    """lambda_r and theta damp small singular values; eta prefers unused directions."""

    lambda_r: float = 1e-4
    theta: float = 1e-2
    eta: float = 10.0


def solve(tasks: Sequence[Task], qd_max: Array, reg: Regularisation) -> tuple[Array, float]:
    """Joint velocities (n,) for `tasks`, highest priority first, and the smallest scale used.

    qd_max: (n,) bound on each joint's speed. A level that would push a joint over it is
    shortened as a whole (direction kept), so a lower level never takes from a higher one.
    """
    first = np.zeros(len(tasks) + 1, dtype=np.int64)
    np.cumsum([len(t.reference) for t in tasks], out=first[1:])
    rho = np.zeros(len(qd_max))
    scale = _recursion(
        np.concatenate([t.jacobian for t in tasks]),
        np.concatenate([t.reference for t in tasks]),
        np.concatenate([t.activation for t in tasks]),
        first, qd_max, reg.lambda_r, reg.theta, reg.eta, rho,
    )  # fmt: skip
    return rho, scale


@compiled
def _recursion(
    jacobian: Array,
    reference: Array,
    activation: Array,
    first: NDArray[np.int64],
    qd_max: Array,
    lambda_r: float,
    theta: float,
    eta: float,
    rho: Array,
) -> float:
    """All levels; level k has the rows first[k]:first[k + 1]. Writes rho (n,)."""
    identity = np.eye(len(qd_max))
    Q = identity.copy()
    smallest = 1.0
    for k in range(len(first) - 1):
        J = np.ascontiguousarray(jacobian[first[k] : first[k + 1]])
        a = activation[first[k] : first[k + 1]]
        X = J @ Q
        XtA = np.ascontiguousarray(X.T) * a
        XtAA = XtA * a
        gram = XtA @ X
        I_Q = identity - Q
        prefer = eta * (np.ascontiguousarray(I_Q.T) @ I_Q)
        G = regularised_inverse(gram, lambda_r, theta) @ XtAA
        # at the first level everything is free and both inverses are the same
        H = G if k == 0 else regularised_inverse(gram + prefer, lambda_r, theta) @ XtAA
        W = X @ H
        wanted = reference[first[k] : first[k + 1]] - J @ rho
        delta = Q @ (G @ (W @ wanted))
        scale = largest_step(rho, delta, qd_max)
        smallest = min(smallest, scale)
        rho += scale * delta
        Q = Q @ (identity - G @ X)
    return smallest


@compiled
def regularised_inverse(M: Array, lambda_r: float, theta: float) -> Array:
    """Inverse of a symmetric positive semi-definite M (n, n), damped near singularity."""
    sigma, U = np.linalg.eigh(M)
    for i in range(len(sigma)):
        s = max(sigma[i], 0.0)
        sigma[i] = 0.0 if s < 1e-12 else s / (s * s + damping(s, lambda_r, theta))
    return np.asarray((U * sigma) @ np.ascontiguousarray(U.T))


@compiled
def damping(sigma: float, lambda_r: float, theta: float) -> float:
    """p(sigma): lambda_r at 0, falling as a raised cosine to 0 at theta."""
    if sigma >= theta:
        return 0.0
    return lambda_r * 0.5 * (1.0 + np.cos(np.pi * sigma / theta))


@compiled
def largest_step(rho: Array, delta: Array, qd_max: Array) -> float:
    """Largest s in [0, 1] with |rho + s delta| <= qd_max on every joint."""
    s = 1.0
    for j in range(len(rho)):
        if delta[j] != 0.0:
            room = qd_max[j] - rho[j] if delta[j] > 0.0 else qd_max[j] + rho[j]
            s = min(s, room / abs(delta[j]))
    return max(s, 0.0)
