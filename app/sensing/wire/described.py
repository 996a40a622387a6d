"""How a sketch prints its frames: what nobody can see in the numbers themselves.

Which way the columns run, whether a line is a row or a column of the sensor, what the unit is and
where the statuses stand cannot be told from distances, so it is never guessed: a preset or a file
says it (`app.sensing.wire.described_file`).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.messages import freeze
from app.sensing.wire.raw import FARTHEST, NO_TARGET, VALID, Grid, RawFrame

GOOD = (5, 6, 9, 10)  # target statuses of a distance that may be used (UM3109)
STATUSES = frozenset({*range(14), NO_TARGET})  # all that there are


class Status(StrEnum):
    """Where a print has its statuses."""

    NONE = "none"
    BESIDE = "beside"  # 412:5, 412 (5), 412/5, 412[5]
    ALTERNATE = "alternate"  # distance, status, distance, status
    AFTER = "after"  # all distances, then all statuses: on the same line, the next, or a grid


@dataclass(frozen=True, slots=True)
class Print:
    """How one frame is printed.

    columns:    a printed line is a column of the sensor, not a row.
    from_right: columns are printed from the sensor's right.   from_bottom: rows from below.
    unit:       [mm] that the number 1 means.
    status:     where the statuses stand.
    valid:      those that mean a good distance; others than the sensor's own codes are turned
                into these.
    skip:       numbers at the beginning of each line that are no zones.
    zones:      a line is one zone, with its number.
    table:      dashes a cell of the borders between the rows, 0 where there need be none; what
                follows the first line of a band is left out.
    json:       it prints JSON; None: that is not said.
    sensors:    headings that tell which sensor a frame is of, in the order of their numbers.
    """

    columns: bool = False
    from_right: bool = False
    from_bottom: bool = False
    unit: float = 1.0
    status: Status = Status.NONE
    valid: tuple[int, ...] = (5, 9)
    skip: int = 0
    zones: bool = False
    table: int = 0
    json: bool | None = None
    sensors: tuple[str, ...] = ()

    def printed(self, grid: Grid) -> Grid:
        """Lines, and numbers a line, of a sensor's grid."""
        return (grid[1], grid[0]) if self.columns else grid

    def placed(self, values: Sequence[Any], grid: Grid, dtype: type) -> NDArray[Any]:
        """(n,) of the n `values` as printed, in the driver's order."""
        out: NDArray[Any] = np.array(values, dtype=dtype).reshape(self.printed(grid))
        if self.columns:
            out = out.T
        return freeze(self._turned(out).ravel())

    def laid_out(self, values: NDArray[Any], grid: Grid) -> NDArray[Any]:
        """(lines, numbers) of (n,) values in the driver's order, as they are printed."""
        out = self._turned(values.reshape(grid))
        return out.T if self.columns else out

    def _turned(self, out: NDArray[Any]) -> NDArray[Any]:
        return out[:: -1 if self.from_bottom else 1, :: -1 if self.from_right else 1]

    @property
    def own_codes(self) -> bool:
        """Are its statuses the sensor's own?"""
        return VALID in self.valid


def frame_of(
    how: Print, grid: Grid, distance: list[int], status: list[int] | None, sensor: int | None
) -> RawFrame:
    """A frame of what was printed [mm]; without statuses 0 < d < 4000 mm counts as valid."""
    mm = how.placed(distance, grid, np.int16)
    if status is None:
        codes = np.where((mm > 0) & (mm < FARTHEST), VALID, NO_TARGET).astype(np.uint8)
    else:
        codes = how.placed(status, grid, np.uint8)
        if not how.own_codes:
            codes = np.where(np.isin(codes, how.valid), VALID, codes).astype(np.uint8)
    return RawFrame(sensor, None, None, grid, mm, freeze(codes))
