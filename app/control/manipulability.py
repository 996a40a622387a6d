"""How far the arm is from a singular posture, and which way leads out (Yoshikawa 1985)."""

import numpy as np

from app.compiled import compiled
from app.messages import Array
from app.robot.posture import Posture

LEAST = 1e-6  # [m^3] below it no direction is better than another


def manipulability(tool: Array) -> float:
    """mu = sqrt(det(J J^T)) of a tool jacobian (6, n)."""
    if tool.shape[0] == tool.shape[1]:
        return abs(_determinant(tool.copy()))
    return float(np.sqrt(max(np.linalg.det(tool @ tool.T), 0.0)))


@compiled
def _determinant(M: Array) -> float:
    """By elimination in place; numpy's way costs ten times as much for so few numbers."""
    n, out = len(M), 1.0
    for k in range(n):
        pivot = k
        for i in range(k + 1, n):
            if abs(M[i, k]) > abs(M[pivot, k]):
                pivot = i
        if M[pivot, k] == 0.0:
            return 0.0
        if pivot != k:
            out = -out
            for j in range(n):
                M[k, j], M[pivot, j] = M[pivot, j], M[k, j]
        out *= M[k, k]
        for i in range(k + 1, n):
            f = M[i, k] / M[k, k]
            for j in range(k, n):
                M[i, j] -= f * M[k, j]
    return out


def manipulability_gradient(posture: Posture, mu: float) -> Array:
    """d mu / d q (n,) of an arm with six joints; zero for others and at the singularity itself.

    Turning joint j moves the axes of the joints behind it as rigid bodies: column k of the
    spatial jacobian changes by the Lie bracket of columns j and k. The determinant is the
    same at the base's origin and at the tool.
    """
    J = posture.J_base
    n = J.shape[1]
    if J.shape[0] != n or not posture.tool_support.all() or mu < LEAST:
        return np.zeros(n)
    out = np.zeros(n)
    _gradient(J, np.asarray(np.linalg.inv(J), dtype=np.float64), mu, out)
    return out


@compiled
def _gradient(J: Array, inverse: Array, mu: float, out: Array) -> None:
    n = len(out)
    for j in range(n - 1):
        for k in range(j + 1, n):
            for a in range(3):
                b, c = (a + 1) % 3, (a + 2) % 3
                linear = J[3 + b, j] * J[c, k] - J[3 + c, j] * J[b, k]
                linear += J[b, j] * J[3 + c, k] - J[c, j] * J[3 + b, k]
                angular = J[3 + b, j] * J[3 + c, k] - J[3 + c, j] * J[3 + b, k]
                out[j] += mu * (inverse[k, a] * linear + inverse[k, 3 + a] * angular)
