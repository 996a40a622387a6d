"""Which zones of a frame see one thing: neighbours in the image at about one distance."""

import numpy as np
from numpy.typing import NDArray

from app.compiled import compiled
from app.messages import Array

ALIKE = 0.10  # [m] distances of neighbouring zones that differ by less are one thing
AROUND = 0.8  # of the zones round a thing that see something nearer, if it is seen through a hole
FLAT = 0.05  # [m] as do those of one side of it in two by two zones


@compiled
def grow(
    part: NDArray[np.bool_], z: Array, kept: NDArray[np.bool_], grid: NDArray[np.int64]
) -> None:
    """Let `part` (n,) of the kept zones (n,) of a frame become all of the things that it is of.

    z: (n,) [m] distances.   grid: (2,) rows and columns.
    """
    n, columns = len(z), grid[1]
    todo, left = np.empty(n, dtype=np.int64), 0
    for i in range(n):
        if part[i]:
            todo[left] = i
            left += 1
    while left > 0:
        left -= 1
        i = todo[left]
        row, column = i // columns, i % columns
        for r in range(max(0, row - 1), min(grid[0], row + 2)):
            for c in range(max(0, column - 1), min(columns, column + 2)):
                j = r * columns + c
                if kept[j] and not part[j] and abs(z[j] - z[i]) < ALIKE:
                    part[j], todo[left] = True, j
                    left += 1


@compiled
def find_in_holes(
    z: Array, kept: NDArray[np.bool_], grid: NDArray[np.int64], known: NDArray[np.bool_]
) -> None:
    """Add to `known` (n,) the kept zones that see a thing through a hole in something nearer, which
    is kept as well; z, kept, grid: as in `grow`. What is known already is not asked."""
    n, part, seen = len(z), np.empty(len(z), dtype=np.bool_), known.copy()
    for i in range(n):
        if not kept[i] or seen[i]:
            continue
        part[:] = False
        part[i] = True
        grow(part, z, kept, grid)
        beside, nearer = _around(part, z, kept, grid)
        for j in range(n):
            seen[j] |= part[j]
            known[j] |= part[j] and nearer > 0 and nearer >= AROUND * beside


@compiled
def _around(
    part: NDArray[np.bool_], z: Array, kept: NDArray[np.bool_], grid: NDArray[np.int64]
) -> tuple[int, int]:
    """How many zones lie round a part (n,) of an image, and how many of them see something nearer
    than all of it beside them, and are kept."""
    beside, nearer, columns = 0, 0, grid[1]
    for i in range(len(z)):
        if part[i]:
            continue
        row, column = i // columns, i % columns
        farther, touches = True, False
        for r in range(max(0, row - 1), min(grid[0], row + 2)):
            for c in range(max(0, column - 1), min(columns, column + 2)):
                if part[r * columns + c]:
                    touches = True
                    farther &= z[r * columns + c] > z[i]
        beside += touches
        nearer += touches and farther and kept[i]
    return beside, nearer


@compiled
def find_thin(
    z: Array, kept: NDArray[np.bool_], sure: NDArray[np.bool_], grid: NDArray[np.int64],
    thin: NDArray[np.bool_],
) -> int:  # fmt: skip
    """Write which kept zones (n,) see a thing that is nowhere two zones wide both ways in those
    that are sure of it (n,); how many.

    z, kept, grid: as in `grow`.
    """
    columns = grid[1]
    wide = np.zeros(len(z), dtype=np.bool_)
    for row in range(grid[0] - 1):
        for column in range(columns - 1):
            i = row * columns + column
            right, below = i + 1, i + columns
            if not (sure[i] and sure[right] and sure[below] and sure[below + 1]):
                continue
            low = min(z[i], z[right], z[below], z[below + 1])
            if max(z[i], z[right], z[below], z[below + 1]) - low < FLAT:
                wide[i] = wide[right] = wide[below] = wide[below + 1] = True
    grow(wide, z, kept, grid)
    count = 0
    for i in range(len(z)):
        thin[i] = kept[i] and not wide[i]
        count += thin[i]
    return count


@compiled
def find_small(
    z: Array, kept: NDArray[np.bool_], most: int, grid: NDArray[np.int64], small: NDArray[np.bool_]
) -> None:
    """Write which kept zones (n,) see a thing that takes no more than `most` of them.

    z, kept, grid: as in `grow`.
    """
    n = len(z)
    seen, thing = np.zeros(n, dtype=np.bool_), np.zeros(n, dtype=np.bool_)
    for i in range(n):
        small[i] = False
    for i in range(n):
        if not kept[i] or seen[i]:
            continue
        for j in range(n):
            thing[j] = j == i
        grow(thing, z, kept, grid)
        count = thing.sum()
        for j in range(n):
            if thing[j]:
                seen[j], small[j] = True, count <= most
