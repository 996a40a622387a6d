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
    inverse = np.linalg.inv(J)
    v, w = J[:3].T, J[3:].T
    out = np.zeros(n)
    for j in range(n - 1):
        linear = np.cross(w[j], v[j + 1 :]) + np.cross(v[j], w[j + 1 :])
        angular = np.cross(w[j], w[j + 1 :])
        change = np.concatenate((linear, angular), axis=1)  # (n - j - 1, 6)
        out[j] = mu * float((inverse[j + 1 :] * change).sum())
    return out
