"""The learned part of a cell: cubes of space in which something stood while nothing moved."""

from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from app.messages import Array, freeze

EDGE = 0.05  # [m] of a cube
FAR = 2000  # cubes from the base, along an axis, beyond which none is believed: 100 m
_MIDDLE, _BITS = 1 << 19, 20
STEPS = (1 << 2 * _BITS, 1 << _BITS, 1)  # from a key to that of the next cube along x, y, z
Keys = NDArray[np.int64]


@dataclass(frozen=True, eq=False, slots=True)
class Learned:
    """n cubes of `EDGE`: cube (i, j, k) holds all of i <= x / EDGE < i + 1, and so on; base frame.

    cells: (n, 3) int64, each once, in rising order, read-only. `Learned.of` makes them so.
    """

    cells: NDArray[np.int64]

    @classmethod
    def of(cls, cells: NDArray[np.int64]) -> Self:
        """Cubes (n, 3) in any order."""
        return cls(freeze(cells_of(_each_once(keys_of(cells)))))

    def __len__(self) -> int:
        return len(self.cells)

    def centres(self) -> Array:
        """(n, 3) [m] centres of the cubes, base frame, read-only."""
        return freeze((self.cells + 0.5) * EDGE)

    def with_more(self, other: "Learned") -> "Learned":
        """What either of the two holds."""
        return Learned.of(np.concatenate((self.cells, other.cells)))


def cubes_at(points: Array) -> NDArray[np.int64]:
    """(n, 3) the cubes that finite points (n, 3) [m] lie in."""
    return np.asarray(np.floor(points / EDGE).astype(np.int64))


def keys_of(cells: NDArray[np.int64]) -> Keys:
    """(n,) one number for each of the cubes (n, 3); they rise with i, then j, then k."""
    i = cells + _MIDDLE
    return np.asarray((i[:, 0] << 2 * _BITS) + (i[:, 1] << _BITS) + i[:, 2])


def cells_of(keys: Keys) -> NDArray[np.int64]:
    """(n, 3) the cubes of such numbers (n,)."""
    mask = (1 << _BITS) - 1
    columns = (keys >> 2 * _BITS, (keys >> _BITS) & mask, keys & mask)
    return np.stack(columns, axis=1) - _MIDDLE


def grown(keys: Keys) -> Keys:
    """(m,) in rising order: the cubes of keys (n,) and their 26 neighbours.

    One axis after the other: walls, which most of them are, stay small on the way.
    """
    for step in STEPS:
        keys = _each_once(np.concatenate((keys - step, keys, keys + step)))
    return keys


def hold(keys: Keys, wanted: Keys) -> NDArray[np.bool_]:
    """(n,) which of `wanted` (n,) are among the rising keys (m,)?"""
    if not len(keys):
        return np.zeros(len(wanted), dtype=np.bool_)
    at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
    return np.asarray(keys[at] == wanted)


def _each_once(keys: Keys) -> Keys:
    """In rising order. A sort takes a tenth of the time of numpy's `unique`."""
    keys = np.sort(keys)
    return np.asarray(keys[np.diff(keys, prepend=-1) != 0])


NOTHING_LEARNED = Learned.of(np.empty((0, 3), dtype=np.int64))
