"""Real recorded 8x8 frames, played on one sensor of the skin with their own timing.

Format (`state_ToF.csv`): blocks of 65 lines, first `t_ms,0,0`, then 64 lines
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
from app.robot.skin import Skin
from app.sensing.source import Unfailing

GRID = (8, 8)
BLOCK = GRID[0] * GRID[1] + 1  # lines of a frame


@dataclass(frozen=True, eq=False)
class Recording:
    """stamp (F,) [s] from the first frame; distance (F, 64) [m]; status, targets (F, 64)."""

    path: Path
    stamp: Array
    distance: Array
    status: NDArray[np.uint8]
    targets: NDArray[np.uint8]


def read_recording(path: Path) -> Recording:
    """Parse a `state_ToF.csv` or the folder that holds one; the error names the line."""
    file = path / "state_ToF.csv" if path.is_dir() else path
    try:
        lines = file.read_text(encoding="ascii").splitlines()
    except OSError as e:
        raise SensorError(f"{file}: cannot be read ({e.strerror}); give a recording") from e
    except UnicodeDecodeError as e:
        raise SensorError(f"{file}: is not text; give a state_ToF.csv recording") from e
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise SensorError(f"{file}: is empty; give a state_ToF.csv recording")
    rows = np.array([_row(file, i, line) for i, line in enumerate(lines)])
    torn = len(rows) % BLOCK
    whole = rows[: len(rows) - torn].reshape(-1, BLOCK, 3)
    for f, header in enumerate(whole[:, 0]):
        if header[1] != 0 or header[2] != 0:
            raise SensorError(
                f"{file}: line {f * BLOCK + 1} should start a frame as 't_ms,0,0'; "
                "a line before it is missing or the file is another format"
            )
        if f and header[0] < whole[f - 1, 0, 0]:
            raise SensorError(
                f"{file}: line {f * BLOCK + 1}: time goes back; sort or cut the recording"
            )
    zones = whole[:, 1:]
    bad = (zones[..., 1] < 0) | (zones[..., 1] > 4) | (zones[..., 2] < 0) | (zones[..., 2] > 255)
    bad |= (zones[..., 0] < -1000) | (zones[..., 0] > 20000)
    if bad.any():
        f, z = np.argwhere(bad)[0]
        raise SensorError(
            f"{file}: line {f * BLOCK + z + 2} is no 'distance_mm,targets,status' "
            f"({lines[f * BLOCK + z + 1].strip()}); a line is missing or the file is another format"
        )
    if torn:
        raise SensorError(
            f"{file}: torn after line {len(rows)}, {torn} lines into a frame of {BLOCK}; "
            f"cut it after line {len(rows) - torn}"
        )
    return Recording(
        path=file,
        stamp=freeze((whole[:, 0, 0] - whole[0, 0, 0]) * 1e-3),
        distance=freeze(zones[..., 0] * 1e-3),
        status=freeze(zones[..., 2].astype(np.uint8)),
        targets=freeze(zones[..., 1].astype(np.uint8)),
    )


class Replay(Unfailing):
    """Plays a recording once on sensor `k` of a skin, from the first poll on."""

    def __init__(self, recording: Recording, skin: Skin, k: int) -> None:
        sensor = skin.sensors[k]
        if sensor.type.grid != GRID:
            rows, columns = sensor.type.grid
            raise SensorError(
                f"{recording.path}: 8x8 frames cannot play on the {rows}x{columns} sensor "
                f"{sensor.name}; choose an 8x8 one with @SENSOR"
            )
        where = recording.path.parent.name or recording.path.name
        self.name = f"replay of {where} on {sensor.name}"
        self.connected: NDArray[np.bool_] = np.arange(skin.count) == k
        self._recording, self._k = recording, k
        self._start: float | None = None
        self._played = 0

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Frames whose recorded time has come."""
        r = self._recording
        if self._start is None:
            self._start = now
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
