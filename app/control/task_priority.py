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


def damping(sigma: Array, reg: Regularisation) -> Array:
    """p(sigma): lambda_r at 0, falling as a raised cosine to 0 at theta."""
    shape = 0.5 * (1.0 + np.cos(np.pi * np.minimum(sigma / reg.theta, 1.0)))
    return reg.lambda_r * shape


def regularised_inverse(M: Array, reg: Regularisation) -> Array:
    """Inverse of a symmetric positive semi-definite M (n, n), damped near singularity."""
    sigma, U = np.linalg.eigh(M)
    sigma = np.maximum(sigma, 0.0)
    inverse = np.where(
        sigma < 1e-12, 0.0, sigma / np.maximum(sigma**2 + damping(sigma, reg), 1e-300)
    )
    return (U * inverse) @ U.T


def solve(tasks: Sequence[Task], qd_max: Array, reg: Regularisation) -> tuple[Array, float]:
    """Joint velocities (n,) for `tasks`, highest priority first, and the smallest scale used.

    qd_max: (n,) bound on each joint's speed. A level that would push a joint over it is
    shortened as a whole (direction kept), so a lower level never takes from a higher one.
    """
    n = len(qd_max)
    rho, Q, smallest = np.zeros(n), np.eye(n), 1.0
    for task in tasks:
        a = task.activation
        X = task.jacobian @ Q
        XtA = X.T * a
        gram, XtAA = XtA @ X, XtA * a
        I_Q = np.eye(n) - Q
        G = regularised_inverse(gram, reg) @ XtAA
        W = X @ (regularised_inverse(gram + reg.eta * (I_Q.T @ I_Q), reg) @ XtAA)
        delta = Q @ (G @ (W @ (task.reference - task.jacobian @ rho)))
        scale = largest_step(rho, delta, qd_max)
        smallest = min(smallest, scale)
        rho = rho + scale * delta
        Q = Q @ (np.eye(n) - G @ X)
    return rho, smallest


def largest_step(rho: Array, delta: Array, qd_max: Array) -> float:
    """Largest s in [0, 1] with |rho + s delta| <= qd_max on every joint."""
    room = np.where(delta > 0.0, qd_max - rho, qd_max + rho)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        s = np.where(delta != 0.0, room / np.abs(delta), np.inf)
    return float(np.clip(s.min(), 0.0, 1.0))
