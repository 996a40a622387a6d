"""Posture: the proof that kinematics are current at this q.

Whoever needs poses or Jacobians takes a `Posture`, never a bare q, so that stale kinematics
cannot be used by mistake.

The Jacobian is kept once, as the spatial Jacobian J_base (6, n): linear rows first, the
velocity of the point that is now at the base origin. A point p on link l then moves with

    v_p = J_lin qd + (J_ang qd) x p           (columns of joints beyond l are zero)

which is the rigid-body shift of the paper's S matrix from the base origin instead of the
link's. So for a unit vector n,  n . v_p = [n, p x n] J_base  restricted to l's own joints,
and the rows of many points are one matrix product.
"""

from dataclasses import dataclass

import numpy as np
import pinocchio as pin
from numpy.typing import NDArray

from app.messages import Array


@dataclass(frozen=True, eq=False, slots=True)
class Posture:
    """Kinematics at joint positions q.

    T_base_link: (L, 4, 4) poses of the body links.   T_base_tool: (4, 4).
    J_base:      (6, n) spatial Jacobian of the whole chain, base frame, at the base origin.
    supports:    (L, n) 1.0 where joint j moves link l, else 0.0.   tool_support: (n,).
    """

    q: Array
    T_base_link: Array
    T_base_tool: Array
    J_base: Array
    supports: Array
    tool_support: Array

    def tool_jacobian(self) -> Array:
        """(6, n) of the tool frame's origin, axes of the base, linear rows first."""
        out = self.J_base * self.tool_support
        x, y, z = self.T_base_tool[:3, 3]
        a, b, c = out[3:]
        # np.cross of so few numbers costs 30 us; written out it is 6
        out[0] += b * z - c * y
        out[1] += c * x - a * z
        out[2] += a * y - b * x
        return out

    def distance_rows(self, links: NDArray[np.intp], points: Array, normals: Array) -> Array:
        """J_d (m, n): speed of material `points` (m, 3) of `links` along unit `normals` (m, 3).

        For a pair's nearest point and retreat direction this is the rate of the distance
        while the world stands still: d_dot = J_d qd - n . v_o.
        """
        wrench = np.empty((len(points), 6))
        wrench[:, :3] = normals
        # np.cross costs 20 us for one row; written out it is 4
        px, py, pz = points[:, 0], points[:, 1], points[:, 2]
        nx, ny, nz = normals[:, 0], normals[:, 1], normals[:, 2]
        wrench[:, 3] = py * nz - pz * ny
        wrench[:, 4] = pz * nx - px * nz
        wrench[:, 5] = px * ny - py * nx
        return (wrench @ self.J_base) * self.supports[links]


def rotation_vector(R: Array) -> Array:
    """Axis times angle (3,) [rad] of a rotation matrix, the angle at most pi."""
    return np.asarray(pin.log3(R))


def rotation_matrix(v: Array) -> Array:
    """Rotation (3, 3) of a rotation vector (3,) [rad]."""
    return np.asarray(pin.exp3(np.asarray(v, dtype=np.float64)))


def rigid(T: Array) -> Array:
    """The rigid pose nearest to a 4x4 matrix that is nearly one; refuses what is not finite."""
    T = np.asarray(T, dtype=np.float64)
    if T.shape != (4, 4) or not np.isfinite(T).all():
        raise ValueError("a pose must be a finite 4x4 matrix")
    U, _, Vt = np.linalg.svd(T[:3, :3])
    out = np.eye(4)
    out[:3, :3] = U @ np.diag([1.0, 1.0, np.linalg.det(U @ Vt)]) @ Vt
    out[:3, 3] = T[:3, 3]
    return out
