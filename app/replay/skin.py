"""The frames of a recording as a skin: what its sensors said then is said again to a live brain.

The world that they measured does not answer to the arm: it is an open loop, as with every recorded
skin. Faults and ends of the recorded ports are said again as well.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from app.choices import build_robot, choose_skin
from app.errors import SensorError, options
from app.messages import Array, SensorFrame
from app.paths import path_and_name
from app.record.reader import FileRecording, open_recording
from app.record.recording import Recording
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.captured import MAGIC, is_capture
from app.setup import Setup


def recorded_skin(setup: Setup, skin: Skin) -> "RecordedSkin | None":
    """What `replay:FILE[@SENSOR]` names, if that is a recorded run; None where it is not."""
    kind, _, what = setup.sensors.partition("+simulated")[0].partition(":")
    name, sensor = path_and_name(what)
    if kind != "replay" or not is_run(Path(name)):
        return None
    recording = open_recording(Path(name))
    try:
        if not len(recording):
            raise SensorError(f"{name}: holds no tick; record one with flinch run --record FILE")
        was = skin_of(recording, setup, skin)
        return RecordedSkin(Path(name).name, recording, was, skin, sensor)
    except BaseException:
        recording.close()
        raise


def is_run(path: Path) -> bool:
    """Is it a file of a recorded run? Other recordings of sensors are `app.sensing.replays`'."""
    if not path.is_file() or is_capture(path):
        return False
    with path.open("rb") as file:
        return file.read(len(MAGIC)) == MAGIC


def skin_of(recording: Recording, setup: Setup, skin: Skin) -> Skin:
    """The skin that was recorded; `skin` itself if `setup` names the same one."""
    was = recording.head.setup
    same = ("robot", "urdf", "skin", "choice")
    if all(getattr(was, name) == getattr(setup, name) for name in same):
        return skin
    return choose_skin(was, build_robot(was))


class RecordedSkin:
    """Plays the frames of `recording` once, each when it arrived, from the first poll on."""

    def __init__(
        self, name: str, recording: Recording, was: Skin, skin: Skin, only: str = ""
    ) -> None:
        """was: the recorded skin, whose sensors are sought in `skin` by name; only: one of them.

        SensorError where `skin` has no such sensor, or one with other zones.
        """
        self.name = f"replay of {name}" + (f", {only} alone" if only else "")
        self._recording, self._times = recording, np.asarray(recording.times)
        self._index = places(was, skin, only)
        self.connected: NDArray[np.bool_] = np.zeros(skin.count, dtype=bool)
        self._start: float | None = None
        self._played = 0
        self._last = recording.inputs(0).source

    @property
    def posture(self) -> Array | None:
        """(n,) where the recorded arm stood at first; None where it did not say so."""
        q = self._recording.inputs(0).joints.q
        return q if np.isfinite(q).all() else None

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Frames that had arrived by then, their stamps on the clock of now."""
        if self._start is None:
            self._start = now
        shift = self._start - float(self._times[0])
        due = int(np.searchsorted(self._times, now - shift + 1e-9, side="right"))
        frames: list[SensorFrame] = []
        for i in range(self._played, due):
            x = self._recording.inputs(i)
            self._last = x.source
            frames += [
                replace(f, sensor=self._index[f.sensor], stamp=f.stamp + shift)
                for f in x.frames
                if f.sensor in self._index
            ]
        self._played = max(due, self._played)
        for was, k in self._index.items():
            self.connected[k] = self._last.connected[was]
        return frames

    def ended(self) -> str:
        """Says so when the last tick has been played."""
        over = self._played == len(self._times)
        return self._last.ended or (f"the {self.name} has ended" if over else "")

    def fault(self, now: float, silence: float, used: NDArray[np.bool_]) -> str:
        """What the recorded source had to say."""
        return self._last.fault

    def inputs(self, now: float) -> tuple[tuple[str, str], ...]:
        """Its inputs, as they were."""
        return self._last.inputs

    def close(self) -> None:
        """Give the file back, if it is one."""
        if isinstance(self._recording, FileRecording):
            self._recording.close()


def places(was: Skin, skin: Skin, only: str) -> dict[int, int]:
    """Where each recorded sensor sits in `skin`, by their indices."""
    names = {s.name: k for k, s in enumerate(skin.sensors)}
    if only and only not in {s.name for s in was.sensors}:
        raise SensorError(
            f"the recording has no sensor {only!r}; {options(only, (s.name for s in was.sensors))}"
        )
    found: dict[int, int] = {}
    for i, sensor in enumerate(was.sensors):
        if only and sensor.name != only:
            continue
        k = names.get(sensor.name, -1)
        if k < 0 or skin.sensors[k].type.grid != sensor.type.grid:
            why = "has none of that name" if k < 0 else "has other zones there"
            raise SensorError(
                f"the recording's sensor {sensor.name} cannot play on {skin.title!r}, which {why}; "
                f"choose its layout ({was.title!r}) with --skin"
            )
        found[i] = k
    return found
