"""What was gathered while the arm moved: joint states and frames, and the file that keeps them."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.errors import SensorError
from app.messages import Array, JointState, SensorFrame
from app.robot.model import Robot
from app.robot.skin import Skin
from app.text_file import check_file

VERSION = 1
MAKE = "record one with flinch calibrate mounts --save FILE"


@dataclass(frozen=True, eq=False, slots=True)
class Recording:
    """J joint states and F frames; zones beyond a sensor's own have no target.

    joint_stamp: (J,) [s] ascending.   q: (J, n).
    sensor: (F,).   stamp: (F,) [s] as the source said.   distance: (F, Z) [m], status, targets.
    """

    robot: str
    layout: str
    joint_stamp: Array
    q: Array
    sensor: NDArray[np.int16]
    stamp: Array
    distance: NDArray[np.float32]
    status: NDArray[np.uint8]
    targets: NDArray[np.uint8]


class Recorder:
    """Collects what a calibration's motion gives."""

    def __init__(self, robot: Robot, skin: Skin) -> None:
        self._names = robot.name, skin.title
        self._zones = int(np.diff(skin.first).max())
        self._states: list[JointState] = []
        self._frames: list[SensorFrame] = []

    def add(self, state: JointState, frames: Sequence[SensorFrame]) -> None:
        """One tick's; a state that says nothing new is left out."""
        if not self._states or state.stamp > self._states[-1].stamp:
            self._states.append(state)
        self._frames += frames

    def done(self) -> Recording:
        """All that was collected."""
        F, Z = len(self._frames), self._zones
        distance = np.zeros((F, Z), dtype=np.float32)
        status, targets = np.full((F, Z), 255, dtype=np.uint8), np.zeros((F, Z), dtype=np.uint8)
        for i, f in enumerate(self._frames):
            n = len(f.distance)
            distance[i, :n], status[i, :n], targets[i, :n] = f.distance, f.status, f.targets
        return Recording(
            *self._names,
            joint_stamp=np.array([s.stamp for s in self._states]),
            q=np.array([s.q for s in self._states]),
            sensor=np.array([f.sensor for f in self._frames], dtype=np.int16),
            stamp=np.array([f.stamp for f in self._frames]),
            distance=distance, status=status, targets=targets,
        )  # fmt: skip


def save_recording(path: Path, recording: Recording) -> None:
    """Write it as NumPy's compressed archive."""
    facts: dict[str, Any] = {name: getattr(recording, name) for name in Recording.__slots__}
    try:
        with path.open("wb") as file:
            np.savez_compressed(file, version=VERSION, **facts)
    except OSError as e:
        raise SensorError(f"{path}: cannot be written ({e.strerror}); give another file") from e


def load_motion(path: Path, robot: Robot, skin: Skin) -> Recording:
    """Read what `save_recording` wrote of this robot and skin; SensorError otherwise."""
    check_file(path, SensorError, inf)
    try:
        with np.load(path, allow_pickle=False) as file:
            version = int(file["version"])
            if version > VERSION:
                raise SensorError(
                    f"{path}: version {version}, this Flinch reads {VERSION}; update it, or {MAKE}"
                )
            facts = {name: file[name] for name in Recording.__slots__}
    except (OSError, ValueError, KeyError) as e:
        raise SensorError(f"{path}: is no recorded motion ({e}); {MAKE}") from e
    facts |= {name: str(facts[name]) for name in ("robot", "layout")}
    if (facts["robot"], facts["layout"]) != (robot.name, skin.title):
        raise SensorError(
            f"{path}: is of {facts['robot']}, {facts['layout']!r}, not of {robot.name}, "
            f"{skin.title!r}; choose that robot and skin, or {MAKE}"
        )
    return Recording(**facts)
