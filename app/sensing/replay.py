"""Real recorded frames, 8x8 or 4x4, played on one sensor of the skin with their own timing.

Format (`state_ToF.csv`): blocks of 65 lines, or of 17, first `t_ms,0,0`, then 64 or 16 lines
`distance_mm,targets,status` in the sensor's zone order. Gaps and bad statuses are played as
they were; a repeated stamp is one of the sensor's own habits and stays.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.errors import SensorError
from app.messages import Array, SensorFrame, freeze
from app.robot.posture import Posture
from app.robot.skin import Sensor, Skin
from app.sensing.source import Unfailing
from app.text_file import as_text, read_file

LARGEST = 2**30  # bytes of a recording: days of one sensor
GRIDS = ((8, 8), (4, 4))  # that such files have, the usual one first
NAME = "state_ToF.csv"
Rows = NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class Recording:
    """F frames of n zones.

    grid:  rows and columns.   begin: [s] of the first frame on the clock of who recorded it.
    stamp: (F,) [s] from the first frame; distance (F, n) [m]; status, targets (F, n).
    """

    path: Path
    grid: tuple[int, int]
    begin: float
    stamp: Array
    distance: Array
    status: NDArray[np.uint8]
    targets: NDArray[np.uint8]


def read_recording(path: Path) -> Recording:
    """Parse a `state_ToF.csv` or the folder that holds one; the error names the line."""
    file = path / NAME if path.is_dir() else path
    lines = _lines(file)
    rows = np.array([_row(file, i, line) for i, line in enumerate(lines)], dtype=np.int64)
    grid = _grid(rows)
    block = grid[0] * grid[1] + 1
    torn = len(rows) % block
    whole = rows[: len(rows) - torn].reshape(-1, block, 3)
    for f, header in enumerate(whole[:, 0]):
        if header[1] != 0 or header[2] != 0:
            raise SensorError(
                f"{file}: line {f * block + 1} should start a frame as 't_ms,0,0'; "
                "a line before it is missing or the file is another format"
            )
        if f and header[0] < whole[f - 1, 0, 0]:
            raise SensorError(
                f"{file}: line {f * block + 1}: time goes back; sort or cut the recording"
            )
    zones = whole[:, 1:]
    bad = (zones[..., 1] < 0) | (zones[..., 1] > 4) | (zones[..., 2] < 0) | (zones[..., 2] > 255)
    bad |= (zones[..., 0] < -1000) | (zones[..., 0] > 20000)
    if bad.any():
        f, z = np.argwhere(bad)[0]
        raise SensorError(
            f"{file}: line {f * block + z + 2} is no 'distance_mm,targets,status' "
            f"({lines[f * block + z + 1].strip()}); a line is missing or the file is another format"
        )
    if torn:
        raise SensorError(
            f"{file}: torn after line {len(rows)}, {torn} lines into a frame of {block}; "
            f"cut it after line {len(rows) - torn}"
        )
    return Recording(
        path=file,
        grid=grid,
        begin=float(whole[0, 0, 0]) * 1e-3,
        stamp=freeze((whole[:, 0, 0] - whole[0, 0, 0]) * 1e-3),
        distance=freeze(zones[..., 0] * 1e-3),
        status=freeze(zones[..., 2].astype(np.uint8)),
        targets=freeze(zones[..., 1].astype(np.uint8)),
    )


class Replay(Unfailing):
    """Plays a recording once on sensor `k` of a skin, from `delay` [s] after the first poll on."""

    def __init__(self, recording: Recording, skin: Skin, k: int, delay: float = 0.0) -> None:
        sensor = skin.sensors[k]
        check_grid(recording, sensor)
        where = recording.path.parent.name or recording.path.name
        self.name = f"replay of {where} on {sensor.name}"
        self.connected: NDArray[np.bool_] = np.arange(skin.count) == k
        self._recording, self._k, self._delay = recording, k, delay
        self._start: float | None = None
        self._played = 0

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Frames whose recorded time has come."""
        r = self._recording
        if self._start is None:
            self._start = now + self._delay
        due = int(np.searchsorted(r.stamp, now - self._start + 1e-9, side="right"))
        frames = [
            SensorFrame(
                self._k,
                self._start + float(r.stamp[i]),
                i,
                r.distance[i],
                r.status[i],
                r.targets[i],
            )
            for i in range(self._played, due)
        ]
        self._played = due
        return frames

    def ended(self) -> str:
        """Says so when the last frame has been played."""
        return f"the {self.name} has ended" if self._played == len(self._recording.stamp) else ""


def check_grid(recording: Recording, sensor: Sensor) -> None:
    """SensorError where a sensor has other zones than the frames of a recording."""
    if sensor.type.grid != recording.grid:
        (rows, columns), (r, c) = sensor.type.grid, recording.grid
        raise SensorError(
            f"{recording.path}: {r}x{c} frames cannot play on the {rows}x{columns} sensor "
            f"{sensor.name}; choose another one with @SENSOR, or another layout with --skin"
        )


def _lines(file: Path) -> list[str]:
    """The lines of a file, without empty ones at its end."""
    content = read_file(file, SensorError, LARGEST)
    try:
        lines = as_text(file, content, SensorError).splitlines()
    except UnicodeDecodeError as e:
        raise SensorError(f"{file}: is not text; give a {NAME} recording") from e
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise SensorError(f"{file}: is empty; give a {NAME} recording")
    return lines


def _grid(rows: Rows) -> tuple[int, int]:
    """The grid by which rows (n, 3) begin their frames where they should; the usual one if in
    doubt, so that what is wrong with a file is told of that."""
    fits = []
    for grid in GRIDS:
        block = grid[0] * grid[1] + 1
        heads = rows[: len(rows) - len(rows) % block : block]
        if len(heads) and not heads[:, 1:].any() and (np.diff(heads[:, 0]) >= 0).all():
            fits.append((len(rows) % block == 0, len(heads), grid))
    if len(fits) == 1 or (fits and fits[0][0] != fits[1][0]):
        return max(fits)[2]
    return max(fits, key=lambda fit: fit[1])[2] if fits else GRIDS[0]


def _row(file: Path, index: int, line: str) -> tuple[int, int, int]:
    parts = line.split(",")
    try:
        a, b, c = (int(p) for p in parts)
    except ValueError:
        raise SensorError(
            f"{file}: line {index + 1} is not three whole numbers ({line.strip()[:40]!r}); "
            "give a state_ToF.csv recording"
        ) from None
    return a, b, c
