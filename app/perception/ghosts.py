"""One-frame ghosts: a single zone that suddenly reports something near, with a good status.

A kept point that is nearer than what its part of the field of view showed one frame before
is believed when a neighbouring zone shows the same in this frame, or when it is seen again
in the next: a real thing of one zone costs one frame, 67 ms. Safety comes before neatness:
points within `ghost_near` of the lens, or that close before a body behind them, are believed
at once.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.config import Params
from app.messages import SLOTS, Array, Verdict
from app.robot.skin import Skin

KEPT, GHOST = int(Verdict.KEPT), int(Verdict.GHOST)
SURFACE = np.zeros(len(Verdict), dtype=bool)  # by verdict: has the zone seen something there?
SURFACE[[Verdict.KEPT, Verdict.SELF, Verdict.STATIC, Verdict.BEHIND]] = True
ALIKE = 0.10  # [m] depths of neighbouring zones that differ by less are one thing
CLOSER = 0.10  # [m] a surface may come nearer by this in a frame: 1.5 m/s at 15 Hz


class Ghosts:
    """Remembers the depths of every sensor's last frame."""

    def __init__(self, skin: Skin) -> None:
        self._size = np.array([s.resolution for s in skin.sensors])
        self.reset()

    def reset(self) -> None:
        """Nothing has been seen yet."""
        self._last = np.full((len(self._size), SLOTS), np.inf)

    def doubt(
        self,
        sensors: NDArray[np.intp],
        depth: Array,
        verdict: NDArray[np.uint8],
        gap: Array,
        params: Params,
    ) -> None:
        """Turn KEPT into GHOST in `verdict` (m, 64) where a point is not yet to be believed."""
        near = params.ghost_near if params.ghost_filter else np.inf
        _doubt(sensors, self._size, depth, gap, near, verdict, self._last)


@compiled
def _doubt(
    sensors: NDArray[np.int64],
    size: NDArray[np.int64],
    depth: Array,
    gap: Array,
    near: float,
    verdict: NDArray[np.uint8],
    last: Array,
) -> None:
    """Points nearer than `near` to the lens or a body are believed; renews `last` (K, 64)."""
    seen = np.empty(SLOTS)
    for m in range(len(sensors)):
        n, before = size[sensors[m]], last[sensors[m]]
        for zone in range(SLOTS):
            seen[zone] = depth[m, zone] if SURFACE[verdict[m, zone]] else np.inf
        for zone in range(n * n):
            d = seen[zone]
            if verdict[m, zone] != KEPT or d < near or gap[m, zone] < near:
                continue
            row, column = zone // n, zone % n
            believed = False
            for r in range(max(0, row - 1), min(n, row + 2)):
                for c in range(max(0, column - 1), min(n, column + 2)):
                    other = r * n + c
                    believed |= before[other] <= d + CLOSER
                    believed |= other != zone and abs(seen[other] - d) < ALIKE
            if not believed:
                verdict[m, zone] = GHOST
        before[:] = seen
