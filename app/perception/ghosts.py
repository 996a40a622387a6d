"""One-frame ghosts: a single zone that suddenly reports something near, with a good status.

A kept point that is nearer than what its part of the field of view showed one frame before
is believed when a neighbouring zone shows the same in this frame, or when it is seen again
in the next: a real thing of one zone costs one frame, 67 ms at 15 Hz. Safety comes before
neatness: points within `NEAR` of the lens, or that close before a body behind them, are
believed at once. A sensor of a single zone has no neighbours: it is asked twice.
"""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.rules import Rules
from app.robot.skin import Skin

KEPT, GHOST = int(Verdict.KEPT), int(Verdict.GHOST)
SURFACE = np.zeros(len(Verdict), dtype=bool)  # by verdict: has the zone seen something there?
SURFACE[[Verdict.KEPT, Verdict.SELF, Verdict.STATIC, Verdict.BEHIND]] = True
NEAR = 0.15  # [m] one frame later, at 1.5 m/s, a thing that near would be a hand's breadth away
ALIKE = 0.10  # [m] distances of neighbouring zones that differ by less are one thing
CLOSER = 0.10  # [m] a surface may come nearer by this in a frame: 1.5 m/s at 15 Hz


class Ghosts:
    """Remembers the distances of every sensor's last frame."""

    def __init__(self, skin: Skin) -> None:
        self._first, self._grid = skin.first, skin.grid
        self.reset()

    def reset(self) -> None:
        """Nothing has been seen yet."""
        self._last = np.full(self._first[-1], np.inf)

    def mark_ghosts(
        self,
        sensors: NDArray[np.intp],
        distance: Array,
        verdict: NDArray[np.uint8],
        gap: Array,
        rules: Rules,
    ) -> None:
        """Turn KEPT into GHOST in `verdict` where a point is not yet to be believed; all (S,)."""
        near = NEAR if rules.doubts_ghosts else np.inf
        _mark_ghosts(sensors, self._first, self._grid, near, distance, gap, verdict, self._last)


@compiled
def _mark_ghosts(
    sensors: NDArray[np.int64],
    first: NDArray[np.int64],
    grid: NDArray[np.int64],
    near: float,
    distance: Array,
    gap: Array,
    verdict: NDArray[np.uint8],
    last: Array,
) -> None:
    """Points nearer than `near` to the lens or a body are believed; renews `last` (S,)."""
    for k in sensors:
        begin, end, rows, columns = first[k], first[k + 1], grid[k, 0], grid[k, 1]
        seen = np.empty(end - begin)
        for i in range(end - begin):
            seen[i] = distance[begin + i] if SURFACE[verdict[begin + i]] else np.inf
        before = last[begin:end]
        for i in range(end - begin):
            zone = begin + i
            if verdict[zone] != KEPT or seen[i] < near or gap[zone] < near:
                continue
            if not _confirmed(i, rows, columns, seen, before):
                verdict[zone] = GHOST
        before[:] = seen


@compiled
def _confirmed(zone: int, rows: int, columns: int, seen: Array, last: Array) -> bool:
    """Was the zone, or one beside it, as near a frame before, or does one beside it agree?"""
    row, column = zone // columns, zone % columns
    for r in range(max(0, row - 1), min(rows, row + 2)):
        for c in range(max(0, column - 1), min(columns, column + 2)):
            other = r * columns + c
            if last[other] <= seen[zone] + CLOSER:
                return True
            if other != zone and abs(seen[other] - seen[zone]) < ALIKE:
                return True
    return False
