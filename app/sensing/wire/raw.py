"""A frame as a wire carries it: millimetres, the sensor's own clock, the driver's zone order."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from app.messages import freeze

VALID, NO_TARGET = 5, 255  # target statuses (UM3109)
FARTHEST = 4000  # [mm] distances without a status are trusted below
Grid = tuple[int, int]  # rows and columns of zones
USUAL: tuple[Grid, ...] = ((8, 8), (4, 4))  # that text formats are read as, whatever the layout


@dataclass(frozen=True, eq=False, slots=True)
class RawFrame:
    """One frame in the driver's order: row-major from the upper left, seen from the sensor.

    sensor:      id that the sender gives, None in formats that name no sensor.
    sequence:    16-bit counter of the sensor's frames, None where the format has none.
    t_us:        32-bit clock of the sender [us] at the measurement, None likewise.
    grid:        rows and columns of its zones, n in all.
    distance:    (n,) int16 [mm].   status: (n,) uint8, 255 = no target.
    temperature: of the sensor's silicon [degrees C], None likewise.
    """

    sensor: int | None
    sequence: int | None
    t_us: int | None
    grid: Grid
    distance: NDArray[np.int16]
    status: NDArray[np.uint8]
    temperature: int | None = None


class Decoder(Protocol):
    """Chunks of bytes in, whole frames out.

    refused: how often something was not accepted, by reason; the reasons are few.
    trouble: why what it reads cannot be right as it is described; empty while it can.
    """

    refused: Counter[str]
    trouble: str

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames that are complete with this chunk; never raises."""
        ...


def grid_of(count: int, grids: Sequence[Grid]) -> Grid | None:
    """The first of `grids` that has so many zones, for formats that do not tell rows."""
    return next((g for g in grids if g[0] * g[1] == count), None)


def zones(values: Sequence[int], dtype: type) -> NDArray[Any]:
    """(n,) of `values`. Raises OverflowError where one does not fit the type."""
    out: NDArray[Any] = np.array(values, dtype=dtype)
    return freeze(out)


def rows(frame: RawFrame, mirrored: bool) -> tuple[NDArray[np.int16], NDArray[np.uint8]]:
    """Distances and statuses (rows, columns) as a format prints them."""
    step = -1 if mirrored else 1
    distance = frame.distance.reshape(frame.grid)[:, ::step]
    return distance, frame.status.reshape(frame.grid)[:, ::step]
