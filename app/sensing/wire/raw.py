"""A frame as a wire carries it: millimetres, the sensor's own clock, the driver's zone order."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from app.messages import SLOTS, freeze

VALID, NO_TARGET = 5, 255  # target statuses (UM3109)
FARTHEST = 4000  # [mm] distances without a status are trusted below


@dataclass(frozen=True, eq=False, slots=True)
class RawFrame:
    """One frame in the driver's order: row-major from the upper left, seen from the sensor.

    sensor:      id that the sender gives, None in formats that name no sensor.
    sequence:    16-bit counter of the sensor's frames, None where the format has none.
    t_us:        32-bit clock of the sender [us] at the measurement, None likewise.
    resolution:  8 or 4; a 4x4 frame uses the first 16 of the 64 zones.
    distance:    (64,) int16 [mm].   status: (64,) uint8, 255 = no target.
    temperature: of the sensor's silicon [degrees C], None likewise.
    """

    sensor: int | None
    sequence: int | None
    t_us: int | None
    resolution: int
    distance: NDArray[np.int16]
    status: NDArray[np.uint8]
    temperature: int | None = None


class Decoder(Protocol):
    """Chunks of bytes in, whole frames out.

    refused: how often something was not accepted, by reason; the reasons are few.
    """

    refused: Counter[str]

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames that are complete with this chunk; never raises."""
        ...


def zones(values: Sequence[int], fill: int, dtype: type, mirrored: bool) -> NDArray[Any]:
    """(64,) of 16 or 64 `values`, the rest `fill`; `mirrored` turns each row's columns round.

    Raises OverflowError where a value does not fit the type.
    """
    out: NDArray[Any] = np.full(SLOTS, fill, dtype=dtype)
    out[: len(values)] = np.array(values, dtype=dtype)
    if mirrored:
        n = 8 if len(values) == SLOTS else 4
        out[: n * n] = out[: n * n].reshape(n, n)[:, ::-1].ravel()
    return freeze(out)


def without_status(values: Sequence[int], mirrored: bool) -> RawFrame:
    """A frame of bare distances: 0 < d < 4000 mm counts as valid, all else as no target."""
    distance = zones(values, 0, np.int16, mirrored)
    status = np.where((distance > 0) & (distance < FARTHEST), VALID, NO_TARGET).astype(np.uint8)
    n = 8 if len(values) == SLOTS else 4
    return RawFrame(None, None, None, n, distance, freeze(status))


def rows(frame: RawFrame, mirrored: bool) -> tuple[NDArray[np.int16], NDArray[np.uint8]]:
    """Distances and statuses (n, n) as a format prints them."""
    n = frame.resolution
    step = -1 if mirrored else 1
    distance = frame.distance[: n * n].reshape(n, n)[:, ::step]
    return distance, frame.status[: n * n].reshape(n, n)[:, ::step]
