"""One-frame ghosts: a single zone that suddenly reports something near, with a good status.

A kept point that is nearer than what its part of the field of view showed one frame before
is believed when a neighbouring zone shows the same in this frame, or when it is seen again
in the next: a real thing of one zone costs one frame, 67 ms at 15 Hz. Safety comes before
neatness: points within `NEAR` of the lens, or that close before a body behind them, are
believed at once. A sensor of a single zone has no neighbours: it is asked twice.

So is a zone that lies before a body by hardly more than noise would carry it there: it is believed
when a neighbour that is clear of the body shows the same, or when the zone itself does so twice.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array, Verdict
from app.perception.returns import Judgement
from app.perception.rules import Rules
from app.perception.things import ALIKE
from app.robot.skin import Skin

KEPT, GHOST = int(Verdict.KEPT), int(Verdict.GHOST)
SURFACE = np.zeros(len(Verdict), dtype=bool)  # by verdict: has the zone seen something there?
SURFACE[[Verdict.KEPT, Verdict.SELF, Verdict.STATIC, Verdict.BEHIND]] = True
NEAR = 0.15  # [m] one frame later, at 1.5 m/s, a thing that near would be a hand's breadth away
CLOSER = 0.10  # [m] a surface may come nearer by this in a frame: 1.5 m/s at 15 Hz
HARDLY = 1.6  # times the self filter's threshold: 4 sigmas, which noise alone does not reach


class Ghosts:
    """Remembers every sensor's last frame: its distances, and what was not the robot in it."""

    def __init__(self, skin: Skin) -> None:
        self._first, self._grid = skin.first, skin.grid
        self.reset()

    def reset(self) -> None:
        """Nothing has been seen yet."""
        self._last, self._foreign = np.full((2, self._first[-1]), np.inf)

    def mark_ghosts(
        self,
        sensors: NDArray[np.intp],
        distance: Array,
        judged: Judgement,
        rules: Rules,
    ) -> None:
        """Turn KEPT into GHOST where a point, (S,) [m] away, is not yet to be believed."""
        if rules.doubts_ghosts:
            seen = Seen(distance, judged.gap, judged.eps, self._last, self._foreign)
            _mark_ghosts(sensors, self._first, self._grid, seen, judged.verdict)


class Seen(NamedTuple):
    """Of S zones [m]: distance now, gap and threshold of the self filter; distance of a surface in
    the last frame, and of one that was not the robot's, +inf where there was none."""

    distance: Array
    gap: Array
    eps: Array
    last: Array
    foreign: Array


@compiled
def _mark_ghosts(
    sensors: NDArray[np.int64],
    first: NDArray[np.int64],
    grid: NDArray[np.int64],
    seen: Seen,
    verdict: NDArray[np.uint8],
) -> None:
    """See `Ghosts.mark_ghosts`; renews `seen.last` and `seen.foreign`."""
    for k in sensors:
        begin, end = first[k], first[k + 1]
        z, gap, eps = seen.distance[begin:end], seen.gap[begin:end], seen.eps[begin:end]
        now, foreign = np.full(end - begin, np.inf), np.full(end - begin, np.inf)
        clear = np.full(end - begin, np.inf)  # of the body
        for i in range(end - begin):
            if SURFACE[verdict[begin + i]]:
                now[i] = z[i]
            if verdict[begin + i] == KEPT:
                foreign[i] = z[i]
                if gap[i] > HARDLY * eps[i] or gap[i] < 0.0:
                    clear[i] = z[i]
        before, strange = seen.last[begin:end], seen.foreign[begin:end]
        for i in range(end - begin):
            if verdict[begin + i] != KEPT:
                continue
            if clear[i] == np.inf:
                believed = abs(strange[i] - z[i]) < ALIKE or _beside(i, grid[k], clear, z[i])
            elif z[i] < NEAR or gap[i] < NEAR:
                believed = True
            else:
                believed = _confirmed(i, grid[k], now, before)
            if not believed:
                verdict[begin + i] = GHOST
        before[:], strange[:] = now, foreign


@compiled
def _confirmed(zone: int, grid: NDArray[np.int64], seen: Array, last: Array) -> bool:
    """Was the zone, or one beside it, as near a frame before, or does one beside it agree?"""
    row, column = zone // grid[1], zone % grid[1]
    for r in range(max(0, row - 1), min(grid[0], row + 2)):
        for c in range(max(0, column - 1), min(grid[1], column + 2)):
            if last[r * grid[1] + c] <= seen[zone] + CLOSER:
                return True
    return _beside(zone, grid, seen, seen[zone])


@compiled
def _beside(zone: int, grid: NDArray[np.int64], seen: Array, distance: float) -> bool:
    """Does a zone beside it see something at about that distance?"""
    row, column = zone // grid[1], zone % grid[1]
    for r in range(max(0, row - 1), min(grid[0], row + 2)):
        for c in range(max(0, column - 1), min(grid[1], column + 2)):
            other = r * grid[1] + c
            if other != zone and abs(seen[other] - distance) < ALIKE:
                return True
    return False
