"""Known, static parts of the cell are not obstacles: points inside crop boxes are set aside."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, CropBox


class StaticFilter:
    """Tells which points lie in one of the boxes that a person drew around the cell."""

    def __init__(self, crops: Sequence[CropBox]) -> None:
        self.crops = tuple(crops)
        T = np.array([c.T_base_box for c in crops]).reshape(-1, 4, 4)
        self._R = T[:, :3, :3]
        self._p = T[:, :3, 3]
        self._half = np.array([c.size for c in crops]).reshape(-1, 3) / 2.0

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """(n,) bool for points (n, 3) [m], base frame; NaN points are in no box."""
        if len(self._half) == 0:
            return np.zeros(len(points), dtype=bool)
        local = (points[None] - self._p[:, None]) @ self._R  # (B, n, 3), R^T applied from the right
        return np.asarray((np.abs(local) <= self._half[:, None]).all(axis=2).any(axis=0))
