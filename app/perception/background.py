"""The learned background: where the world was while nothing moved.

While learning, the cells of all kept points are counted. A cell belongs to the background if
it was seen in the first and in the last half of the time, so that who walks through is not
learned. Afterwards points in those cells and beside them are static: noise and the zones' bias
move a wall by centimetres. Whoever stands before the wall by more than two cells is kept.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.errors import SensorError
from app.messages import Array, BackgroundView, freeze

EDGE = 0.05  # [m] of a cell
LEAST = 2  # times a cell is seen in each half
Cells = NDArray[np.int64]
NOWHERE = np.empty((0, 3))


class Background:
    """Cells of the learned background; empty until something has been learned or loaded."""

    def __init__(self) -> None:
        self.cells: Cells = np.empty(0, dtype=np.int64)
        self._grown: Cells = self.cells
        self._until = -np.inf
        self._half = -np.inf
        self._seen: list[Cells] = []
        self._later: list[Cells] = []

    def learn(self, now: float, seconds: float) -> None:
        """Forget what is known and begin anew; `finish` is due after `seconds`."""
        self._set(np.empty(0, dtype=np.int64))
        self._seen, self._later = [], []
        self._half, self._until = now + seconds / 2, now + seconds

    @property
    def learning(self) -> bool:
        """Is it being learned just now?"""
        return np.isfinite(self._until)

    def take(self, points: Array, now: float) -> None:
        """Kept points (n, 3) [m] of one frame, base frame."""
        if self.learning:
            (self._seen if now < self._half else self._later).append(_cells(points))

    def finish(self, now: float) -> bool:
        """Ends the learning when its time is over; tells whether it did just now."""
        if not self.learning or now < self._until:
            return False
        self._until = -np.inf
        self._set(np.intersect1d(_often(self._seen), _often(self._later)))
        return True

    def inside(self, points: Array) -> NDArray[np.bool_]:
        """(n,) is a point (n, 3) in or beside the background? NaN is not."""
        out = np.zeros(len(points), dtype=bool)
        if len(self._grown):
            finite = np.isfinite(points).all(axis=1)
            cells = _cells(points[finite])
            at = np.minimum(np.searchsorted(self._grown, cells), len(self._grown) - 1)
            out[finite] = self._grown[at] == cells
        return out

    def save(self, path: Path) -> None:
        """Write the cells."""
        try:
            np.savetxt(path, self.cells, fmt="%d", header=f"background cells of {EDGE} m")
        except OSError as e:
            raise SensorError(f"{path}: cannot be written ({e.strerror}); give another") from e

    def load(self, path: Path) -> None:
        """Read what `save` wrote."""
        try:
            self._set(np.unique(np.loadtxt(path, dtype=np.int64, ndmin=1)))
        except (OSError, ValueError) as e:
            raise SensorError(f"{path}: is no learned background ({e}); learn it anew") from e

    def view(self, now: float) -> BackgroundView:
        """For onlookers."""
        left = max(self._until - now, 0.0) if self.learning else 0.0
        return BackgroundView(NOWHERE, NOWHERE, left)

    def _set(self, cells: Cells) -> None:
        self.cells = freeze(cells)
        steps = [-1, 0, 1]
        offsets = np.array([(x << 40) + (y << 20) + z for x in steps for y in steps for z in steps])
        self._grown = np.unique(cells[:, None] + offsets)


def _cells(points: Array) -> Cells:
    i = np.floor(points / EDGE).astype(np.int64) + (1 << 19)
    return np.asarray((i[:, 0] << 40) + (i[:, 1] << 20) + i[:, 2])


def _often(frames: list[Cells]) -> Cells:
    if not frames:
        return np.empty(0, dtype=np.int64)
    cells, count = np.unique(np.concatenate(frames), return_counts=True)
    return np.asarray(cells[count >= LEAST])
