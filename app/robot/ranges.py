"""What each zone's range is wrong by, and the file that remembers it.

A VL53L8CX's zones are off by a constant share each (1.5 % of the distance, one sigma, on real
frames) and by some millimetres below 0.2 m. A wall shown square to a sensor at a few known
distances tells how much; between and beyond them the error is taken as proportional.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.errors import SensorError
from app.messages import Array, freeze
from app.text_file import check_file

OFF, OFF_SHARE = 0.01, 0.08  # [m] and of the distance: no zone is wrong by more
FEWEST = 10  # good measurements of a zone before its error is believed


@dataclass(frozen=True, eq=False)
class RangeTable:
    """Corrections of a skin: at (m,) [m], ascending; offset (S, m) [m], true less measured, both
    along the optical axis."""

    at: Array
    offset: Array

    def corrected(self, slots: NDArray[np.intp], depth: Array) -> Array:
        """Depths (n,) [m] along the axis, in these slots (n,), with the errors taken off."""
        at, offset = self.at, self.offset[slots]
        if len(at) == 1:
            return np.asarray(depth * (1.0 + offset[:, 0] / at[0]))
        i = np.clip(np.searchsorted(at, depth) - 1, 0, len(at) - 2)
        share = (depth - at[i]) / (at[i + 1] - at[i])
        row = np.arange(len(depth))
        low, high = offset[row, i], offset[row, i + 1]
        between = low + np.clip(share, 0.0, 1.0) * (high - low)
        beyond = np.maximum(depth / at[-1], 1.0)
        return np.asarray(depth + between * beyond)


def wall_offset(depth: Array, distance: float) -> Array:
    """(n,) [m] to add to each zone's depth, from frames (F, n) of a wall at `distance` [m].

    The wall stands square to the sensor, so every zone's true depth is the same. NaN marks
    bad measurements; a zone with too few of them gets NaN, and so does one that is further off
    than zones are: something else was in its way.
    """
    enough = np.isfinite(depth).sum(axis=0) >= FEWEST
    out = np.full(depth.shape[1], np.nan)
    out[enough] = distance - np.nanmedian(depth[:, enough], axis=0)
    out[np.abs(out) > OFF + OFF_SHARE * distance] = np.nan
    return out


def with_wall(
    table: RangeTable | None, first: NDArray[np.int64], k: int, distance: float, offset: Array
) -> RangeTable:
    """The table with one more wall of sensor k, `offset` (n,) of its zones; NaN where nothing is
    known. first: (K + 1,) slots of all sensors."""
    if table is None:
        table = RangeTable(np.array([distance]), np.full((first[-1], 1), np.nan))
    at, offsets = table.at, table.offset
    i = int(np.searchsorted(at, distance - 1e-6))
    if i == len(at) or abs(at[i] - distance) > 1e-6:
        at = np.insert(at, i, distance)
        offsets = np.insert(offsets, i, np.nan, axis=1)
    offsets = offsets.copy()
    offsets[first[k] : first[k + 1], i] = offset
    return RangeTable(freeze(at), freeze(offsets))


def complete(table: RangeTable) -> RangeTable:
    """NaN replaced: by the zone's neighbouring distances in proportion, by 0 without any."""
    offset = table.offset.copy()
    at = table.at
    for zone in offset:
        known = np.isfinite(zone)
        if known.any():
            zone[~known] = at[~known] * np.interp(at[~known], at[known], (zone / at)[known])
        else:
            zone[:] = 0.0
    return RangeTable(table.at, freeze(offset))


def save_ranges(path: Path, table: RangeTable) -> None:
    """Write a table, one line a zone; NaN stays."""
    head = "range corrections [m] at distances [m]: " + " ".join(f"{d:.4f}" for d in table.at)
    try:
        np.savetxt(path, table.offset, fmt="%.5f", header=head)
    except OSError as e:
        raise SensorError(f"{path}: cannot be written ({e.strerror}); give another") from e


def load_ranges(path: Path, slots: int) -> RangeTable:
    """Read what `save_ranges` wrote for a skin of so many zones."""
    check_file(path, SensorError)
    try:
        with path.open(encoding="utf-8") as file:
            at = np.array(file.readline().partition(":")[2].split(), dtype=np.float64)
        offset = np.loadtxt(path, ndmin=2)
    except (OSError, ValueError) as e:
        raise SensorError(
            f"{path}: is no table of ranges ({e}); write one with flinch calibrate ranges"
        ) from e
    if len(at) == 0 or offset.shape != (slots, len(at)) or np.any(np.diff(at) <= 0.0):
        raise SensorError(
            f"{path}: has {len(offset)} zones at {len(at)} distances, this skin has "
            f"{slots}; give the file of this skin, or measure it with calibrate ranges"
        )
    return RangeTable(freeze(at), freeze(offset))
