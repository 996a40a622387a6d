"""The known cell is no obstacle: its boxes, all below its planes, and what was learned.

Learned cubes are taken with their neighbours, since noise and the zones' bias move a wall by
centimetres. Whoever stands before the wall by more than two cubes is kept.
"""

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import Learned, cubes_at, grown, hold, keys_of
from app.cell.parts import Cell
from app.compiled import compiled
from app.messages import Array

STEP = 0.025  # [m] along a ray through learned cubes: half of one


class StaticFilter:
    """Tells which points lie in the known cell."""

    def __init__(self, cell: Cell) -> None:
        self._T = np.array([b.T_base_box for b in cell.boxes]).reshape(-1, 4, 4)
        self._half = np.array([b.size for b in cell.boxes]).reshape(-1, 3) / 2.0
        T = np.array([p.T_base_plane for p in cell.planes]).reshape(-1, 4, 4)
        self._normal = np.ascontiguousarray(T[:, :3, 2])
        self._offset = np.einsum("ij,ij->i", T[:, :3, 2], T[:, :3, 3])
        self.know(cell.learned)

    def know(self, learned: Learned) -> None:
        """From now on this is what was learned, instead of what was before."""
        self._grown = grown(keys_of(learned.cells))

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """(n,) bool for points (n, 3) [m], base frame; NaN points are nowhere."""
        out = np.asarray(_inside(points, self._T, self._half, self._normal, self._offset))
        return out | self._learned(points) if len(self._grown) else out

    def met(self, begin: Array, rays: Array, reach: Array) -> NDArray[np.bool_]:
        """(n,) do unit rays (n, 3) from (n, 3) [m], base frame, come into it within (n,) [m]?"""
        cell = self._T, self._half, self._normal, self._offset
        out = np.asarray(_met(begin, rays, reach, *cell))
        left = np.flatnonzero(~out)
        if len(self._grown) and len(left):
            steps = np.arange(1, int(np.ceil(reach[left].max() / STEP)) + 1) * STEP
            steps = np.minimum(steps, reach[left, None])  # none goes farther than its own
            along = begin[left, None] + steps[..., None] * rays[left, None]
            out[left] = self._learned(along.reshape(-1, 3)).reshape(steps.shape).any(axis=1)
        return out

    def _learned(self, points: Array) -> NDArray[np.bool_]:
        out = np.zeros(len(points), dtype=bool)
        finite = np.isfinite(points).all(axis=1)
        out[finite] = hold(self._grown, keys_of(cubes_at(points[finite])))
        return out


@compiled
def _inside(
    points: Array, T_base_box: Array, half: Array, normal: Array, offset: Array
) -> NDArray[np.bool_]:
    """(n,) is a point in one of the boxes or behind one of the planes? NaN is nowhere."""
    out = np.zeros(len(points), dtype=np.bool_)
    for i in range(len(points)):
        p = points[i]
        if not (np.isfinite(p[0]) and np.isfinite(p[1]) and np.isfinite(p[2])):
            continue
        for b in range(len(half)):
            T = T_base_box[b]
            x, y, z = p[0] - T[0, 3], p[1] - T[1, 3], p[2] - T[2, 3]
            within = True
            for a in range(3):
                within &= abs(T[0, a] * x + T[1, a] * y + T[2, a] * z) <= half[b, a]
            out[i] |= within
        for b in range(len(offset)):
            height = normal[b, 0] * p[0] + normal[b, 1] * p[1] + normal[b, 2] * p[2]
            out[i] |= height <= offset[b]
    return out


@compiled
def _met(
    begin: Array, rays: Array, reach: Array, T_base_box: Array, half: Array, normal: Array,
    offset: Array,
) -> NDArray[np.bool_]:  # fmt: skip
    """(n,) does a ray come into one of the boxes, or behind one of the planes, within its reach?"""
    out = np.zeros(len(begin), dtype=np.bool_)
    for i in range(len(begin)):
        for b in range(len(half)):
            T, low, high = T_base_box[b], 0.0, reach[i]
            for a in range(3):
                at = u = 0.0
                for c in range(3):
                    at += T[c, a] * (begin[i, c] - T[c, 3])
                    u += T[c, a] * rays[i, c]
                if abs(u) > 1e-12:
                    near, far = (-half[b, a] - at) / u, (half[b, a] - at) / u
                    low, high = max(low, min(near, far)), min(high, max(near, far))
                elif abs(at) > half[b, a]:
                    high = -1.0
            if low <= high:
                out[i] = True
                break
        for b in range(len(offset)):
            height = -offset[b]
            for c in range(3):
                height += normal[b, c] * (begin[i, c] + max(reach[i], 0.0) * rays[i, c])
            out[i] |= height <= 0.0
    return out
