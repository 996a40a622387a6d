"""Known, static parts of the cell are not obstacles: points inside crop boxes or behind planes."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, CropBox
from app.perception.beams import inside


class StaticFilter:
    """Tells which points lie in a box or behind a plane that a person drew around the cell."""

    def __init__(self, crops: Sequence[CropBox]) -> None:
        self.crops = tuple(crops)
        boxes = [c for c in crops if not c.plane]
        planes = [c for c in crops if c.plane]
        self._T = np.array([c.T_base_box for c in boxes]).reshape(-1, 4, 4)
        self._half = np.array([c.size for c in boxes]).reshape(-1, 3) / 2.0
        T = np.array([c.T_base_box for c in planes]).reshape(-1, 4, 4)
        self._normal = np.ascontiguousarray(T[:, :3, 2])
        self._offset = np.einsum("ij,ij->i", T[:, :3, 2], T[:, :3, 3])

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """(n,) bool for points (n, 3) [m], base frame; NaN points are nowhere."""
        return np.asarray(inside(points, self._T, self._half, self._normal, self._offset))
