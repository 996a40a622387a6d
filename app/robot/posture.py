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

from app.compiled import compiled
from app.messages import Array
from app.robot.gears import Gears


@dataclass(frozen=True, eq=False, slots=True)
class Posture:
    """Kinematics at joint positions q.

    T_base_link: (L, 4, 4) poses of the body links.   T_base_tool: (4, 4).
    J_base:      (6, n) spatial Jacobian of the whole chain, base frame, at the base origin.
    supports:    (L, n) 1.0 where joint j moves link l, else 0.0.   tool_support: (n,).
    gears:       which joints follow another: rates are told for those that follow none.
    """

    q: Array
    T_base_link: Array
    T_base_tool: Array
    J_base: Array
    supports: Array
    tool_support: Array
    gears: Gears

    def tool_jacobian(self) -> Array:
        """(6, n) of the tool frame's origin, axes of the base, linear rows first."""
        out = np.empty(self.J_base.shape)
        _tool(self.J_base, self.tool_support, self.T_base_tool, out)
        return _folded(out, self.gears)

    def distance_rows(self, links: NDArray[np.intp], points: Array, normals: Array) -> Array:
        """J_d (m, n): speed of material `points` (m, 3) of `links` along unit `normals` (m, 3).

        For a pair's nearest point and retreat direction this is the rate of the distance
        while the world stands still: d_dot = J_d qd - n . v_o.
        """
        out = np.empty((len(points), self.J_base.shape[1]))
        _rates(links, points, normals, self.J_base, self.supports, out)
        return _folded(out, self.gears)

    def link_twists(self, qd: Array) -> Array:
        """(L, 6) velocity of each link at joint speeds qd (n,), base frame: [m/s] of what of it is
        at the base's origin, and [rad/s]; a point p of it moves with v + w x p."""
        return np.asarray((self.supports * qd) @ self.J_base.T)


def _folded(rates: Array, gears: Gears) -> Array:
    """Rates (m, n) with what a follower does in its master's column; changed in place."""
    for j in np.flatnonzero(~gears.own):
        rates[:, gears.into[j]] += gears.times[j] * rates[:, j]
        rates[:, j] = 0.0
    return rates


@compiled
def _tool(J_base: Array, support: Array, T_base_tool: Array, out: Array) -> None:
    x, y, z = T_base_tool[0, 3], T_base_tool[1, 3], T_base_tool[2, 3]
    for j in range(J_base.shape[1]):
        a, b, c = J_base[3, j], J_base[4, j], J_base[5, j]
        out[0, j] = support[j] * (J_base[0, j] + b * z - c * y)
        out[1, j] = support[j] * (J_base[1, j] + c * x - a * z)
        out[2, j] = support[j] * (J_base[2, j] + a * y - b * x)
        out[3, j], out[4, j], out[5, j] = support[j] * a, support[j] * b, support[j] * c


@compiled
def _rates(
    links: NDArray[np.int64],
    points: Array,
    normals: Array,
    J_base: Array,
    supports: Array,
    out: Array,
) -> None:
    for i in range(len(links)):
        px, py, pz = points[i, 0], points[i, 1], points[i, 2]
        nx, ny, nz = normals[i, 0], normals[i, 1], normals[i, 2]
        ax, ay, az = py * nz - pz * ny, pz * nx - px * nz, px * ny - py * nx
        for j in range(J_base.shape[1]):
            v = nx * J_base[0, j] + ny * J_base[1, j] + nz * J_base[2, j]
            v += ax * J_base[3, j] + ay * J_base[4, j] + az * J_base[5, j]
            out[i, j] = v * supports[links[i], j]


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
