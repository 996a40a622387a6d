"""The known cell is no obstacle: its boxes, all below its planes, and what was learned.

Learned cubes are taken with their neighbours, since noise and the zones' bias move a wall by
centimetres. Whoever stands before the wall by more than two cubes is kept.
"""

import numpy as np
from numpy.typing import NDArray

from app.cell.learned import Learned, cubes_at, grown, hold, keys_of
from app.cell.parts import Cell
from app.messages import Array
from app.perception.beams import inside


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
        out = np.asarray(inside(points, self._T, self._half, self._normal, self._offset))
        return out | self._learned(points) if len(self._grown) else out

    def _learned(self, points: Array) -> NDArray[np.bool_]:
        out = np.zeros(len(points), dtype=bool)
        finite = np.isfinite(points).all(axis=1)
        out[finite] = hold(self._grown, keys_of(cubes_at(points[finite])))
        return out
