"""From the words after `replay:` to a source: recorded frames, or the bytes of a whole skin.

    PATH[@SENSOR]      several of them separated by commas

PATH is a `state_ToF.csv`, a folder that holds one, a folder of folders that bear the names of
sensors and hold one each, or a file of `flinch record-skin`. What lies in one folder was recorded
at once, on one clock; what stands between commas begins at once.
"""

from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.errors import SensorError, options
from app.messages import Array, SensorFrame
from app.paths import entries, path_and_name
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.captured import MAGIC, CapturedSkin, is_capture, read_capture
from app.sensing.port_spec import PortSpec
from app.sensing.replay import NAME, Recording, Replay, check_grid, read_recording
from app.sensing.source import Unfailing

STEP = 0.02  # [s] between two looks at a capture that is read through


class SeveralReplays(Unfailing):
    """Recordings of several sensors, played at once."""

    def __init__(self, replays: list[Replay]) -> None:
        self._replays = tuple(replays)
        self.name = f"replay of {len(replays)} sensors"
        self.connected: NDArray[np.bool_] = np.any([r.connected for r in replays], axis=0)

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Frames of all sensors whose recorded time has come, in the order of their stamps."""
        frames = [f for r in self._replays for f in r.poll(now, posture)]
        return sorted(frames, key=lambda f: f.stamp)

    def ended(self) -> str:
        """Says so when the last frame of the last sensor has been played."""
        return f"the {self.name} has ended" if all(r.ended() for r in self._replays) else ""


def open_replay(text: str, skin: Skin) -> Replay | SeveralReplays | CapturedSkin:
    """What `text`, the part after `replay:`, names; a `SensorError` names the entry."""
    parts_given = entries(text)
    if len(parts_given) == 1:
        path, sensor = path_and_name(parts_given[0])
        if is_capture(Path(path)):
            capture = read_capture(Path(path))
            return CapturedSkin(capture, skin, capture.specs(skin, sensor))
    parts = [part for entry in parts_given for part in _parts(entry, skin)]
    sensors = [k for _, k, _ in parts]
    for k in sensors:
        if sensors.count(k) > 1:
            raise SensorError(
                f"replay: {skin.sensors[k].name} is given twice; give each recording its @SENSOR"
            )
    replays = [Replay(recording, skin, k, delay) for recording, k, delay in parts]
    return replays[0] if len(replays) == 1 else SeveralReplays(replays)


def captured_ports(text: str, skin: Skin) -> tuple[PortSpec, ...]:
    """The ports of a capture that `text`, the part after `replay:`, names; none of another file."""
    path, sensor = path_and_name(text)
    return read_capture(Path(path)).specs(skin, sensor) if is_capture(Path(path)) else ()


class Reports(NamedTuple):
    """What one sensor of a recording has reported: distance (F, n) [m], status, targets (F, n)."""

    sensor: int
    distance: Array
    status: NDArray[np.uint8]
    targets: NDArray[np.uint8]


def recorded(text: str, skin: Skin, posture: Posture, k: int = 0) -> Reports:
    """All reports of one sensor of PATH[@SENSOR].

    k: the sensor that is meant where none is named; of a capture, the only one in it.
    """
    path, name = path_and_name(text)
    if not is_capture(Path(path)):
        r = read_recording(_no_run(Path(path)))
        k = skin.index(name) if name else k
        check_grid(r, skin.sensors[k])
        return Reports(k, r.distance, r.status, r.targets)
    capture = read_capture(Path(path))
    source = CapturedSkin(capture, skin, capture.specs(skin, name if capture.single else ""))
    frames = list(play_through(source, posture))
    heard = sorted({f.sensor for f in frames})
    k = skin.index(name) if name else (heard[0] if heard else k)
    mine = [f for f in frames if f.sensor == k]
    if not mine or (len(heard) > 1 and not name):
        names = [skin.sensors[i].name for i in heard]
        said = options(name, names) if names else "no sensor has said anything in it"
        raise SensorError(f"{path}: name one of its sensors as {path}@SENSOR; {said}")
    return Reports(
        k, np.array([f.distance for f in mine]), np.array([f.status for f in mine]),
        np.array([f.targets for f in mine]),
    )  # fmt: skip


def play_through(source: CapturedSkin, posture: Posture) -> Iterator[SensorFrame]:
    """All frames of a capture, as fast as it goes; silence takes no time."""
    try:
        now = 0.0
        while not source.ended():
            yield from source.poll(now, posture)
            now = max(now + STEP, source.due)
    finally:
        source.close()


def _parts(entry: str, skin: Skin) -> list[tuple[Recording, int, float]]:
    """Recordings of an entry, their sensors, and when each begins [s]."""
    path, sensor = path_and_name(entry)
    folder = _no_run(Path(path))
    names = [s.name for s in skin.sensors]
    if sensor or not folder.is_dir() or (folder / NAME).is_file():
        return [(read_recording(folder), skin.index(sensor) if sensor else 0, 0.0)]
    inside = sorted(p.name for p in folder.iterdir() if (p / NAME).is_file())
    strange = [name for name in inside if name not in names]
    if strange:
        raise SensorError(
            f"{folder}: the folder {strange[0]!r} has no sensor's name; "
            f"{options(strange[0], names)}"
        )
    if not inside:
        return [(read_recording(folder), 0, 0.0)]  # says what is missing
    recordings = [read_recording(folder / name) for name in inside]
    begin = min(r.begin for r in recordings)
    return [
        (r, skin.index(name), r.begin - begin) for name, r in zip(inside, recordings, strict=True)
    ]


def _no_run(path: Path) -> Path:
    """The path of what may hold frames; refuses a recorded run, which is played otherwise."""
    if path.is_file():
        with path.open("rb") as file:
            if file.read(len(MAGIC)) == MAGIC:
                raise SensorError(
                    f"{path}: is no recording of a skin; play a recorded run by flinch replay"
                )
    return path
