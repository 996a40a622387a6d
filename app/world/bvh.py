"""Motion files of the kind BVH: a tree of joints, and angles for every frame.

Own reader, since what registries hold is either old, or brings a viewer, or both. The format:
Meredith and Maddock, "Motion Capture File Formats Explained", University of Sheffield, 2001.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from app.errors import WorldError
from app.messages import Array
from app.text_file import read_text

MOVES = {"Xposition": 0, "Yposition": 1, "Zposition": 2}
TURNS = {"Xrotation": 0, "Yrotation": 1, "Zrotation": 2}
DEEPEST = 200  # joints below each other
LONGEST = 50_000  # frames: seven minutes at 120 Hz
END = " end"  # of a name: where the last bone of a chain ends


@dataclass(frozen=True, eq=False)
class Joint:
    """A joint of the tree; an end has no channels. parent: its row, -1 of the root."""

    name: str
    parent: int
    offset: tuple[float, ...] = (0.0, 0.0, 0.0)
    channels: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Joints in the file's order, and where they are.

    frame_time: [s].   points: (F, J, 3) in the file's own units and axes.
    """

    joints: tuple[Joint, ...]
    frame_time: float
    points: Array


def load_bvh(path: Path) -> Skeleton:
    """The joints of a file over time; WorldError naming the line and the remedy."""
    reader = _Reader(path, read_text(path, WorldError))
    joints = reader.hierarchy()
    frame_time, values = reader.motion(sum(len(j.channels) for j in joints))
    return Skeleton(joints, frame_time, _points(joints, values))


@dataclass
class _Reader:
    """Goes through the words of a file and knows their lines."""

    path: Path
    text: str
    _words: Iterator[tuple[int, str]] = field(init=False)
    _line: int = 0

    def __post_init__(self) -> None:
        self._lines = self.text.splitlines()
        self._words = ((n, word) for n, line in enumerate(self._lines, 1) for word in line.split())

    def hierarchy(self) -> tuple[Joint, ...]:
        """All joints, with an end of each chain."""
        self._expect("HIERARCHY")
        self._expect("ROOT")
        joints: list[Joint] = []
        self._joint(joints, -1, self._word("a name"), 0)
        return tuple(joints)

    def motion(self, channels: int) -> tuple[float, Array]:
        """Seconds a frame, and the channels' values (F, channels)."""
        self._expect("MOTION")
        self._expect("Frames:")
        frames = self._number("the number of frames")
        self._expect("Frame")
        self._expect("Time:")
        frame_time = self._number("the seconds of a frame")
        if frames < 1 or frames != int(frames) or not 1e-4 <= frame_time <= 10.0:
            raise self._wrong(
                f"{frames:g} frames of {frame_time:g} s; give a whole number and 0.0001 to 10 s"
            )
        if frames > LONGEST:
            raise self._wrong(f"{frames:g} frames; cut the clip to {LONGEST} or fewer")
        rows = []
        for number, line in enumerate(self._lines[self._line :], self._line + 1):
            if line.strip():
                rows.append(self._row(number, line, channels))
        if len(rows) != int(frames):
            raise self._wrong(
                f"Frames says {frames:g}, but {len(rows)} follow; correct the number, or export "
                "the file again if it is torn"
            )
        return frame_time, np.array(rows)

    def _row(self, number: int, line: str, channels: int) -> Array:
        self._line = number
        try:
            row = np.array(line.split(), dtype=np.float64)
        except ValueError as e:
            raise self._wrong(f"{e}; give numbers only") from e
        if len(row) != channels or not np.isfinite(row).all():
            raise self._wrong(
                f"{len(row)} values for {channels} channels; give one finite number each"
            )
        return row

    def _joint(self, joints: list[Joint], parent: int, name: str, depth: int) -> None:
        if depth > DEEPEST:
            raise self._wrong(f"more than {DEEPEST} joints below each other; export fewer")
        self._expect("{")
        me = len(joints)
        offset: tuple[float, ...] = (0.0, 0.0, 0.0)
        channels: tuple[str, ...] = ()
        joints.append(Joint(name, parent))
        while (word := self._word("OFFSET, CHANNELS, JOINT, End or }")) != "}":
            match word:
                case "OFFSET":
                    offset = tuple(self._number("an offset") for _ in range(3))
                case "CHANNELS":
                    channels = self._channels()
                case "JOINT":
                    self._joint(joints, me, self._word("a name"), depth + 1)
                case "End":
                    self._expect("Site")
                    self._joint(joints, me, name + END, depth + 1)
                case _:
                    raise self._wrong(f"{word!r}; give OFFSET, CHANNELS, JOINT, End Site or }}")
        joints[me] = Joint(name, parent, offset, channels)

    def _channels(self) -> tuple[str, ...]:
        count = self._number("the number of channels")
        names = tuple(self._word("a channel") for _ in range(int(count)))
        known = MOVES | TURNS
        for name in names:
            if name not in known:
                raise self._wrong(f"unknown channel {name!r}; known: {', '.join(known)}")
        return names

    def _word(self, wanted: str) -> str:
        self._line, word = next(self._words, (len(self._lines), ""))
        if not word:
            raise self._wrong(f"the file ends, {wanted} is missing; export it again")
        return word

    def _expect(self, wanted: str) -> None:
        if (word := self._word(wanted)).upper() != wanted.upper():
            raise self._wrong(f"{word!r} where {wanted} belongs; export it as BVH")

    def _number(self, what: str) -> float:
        word = self._word(what)
        try:
            number = float(word)
        except ValueError as e:
            raise self._wrong(f"{word!r} for {what}; give a number") from e
        if not np.isfinite(number):
            raise self._wrong(f"{word} for {what}; give a finite number")
        return number

    def _wrong(self, why: str) -> WorldError:
        return WorldError(f"clip {self.path}, line {self._line}: {why}")


def _points(joints: tuple[Joint, ...], values: Array) -> Array:
    """Where every joint is in every frame, (F, J, 3).

    Channels that move a joint stand for its offset; turns are made in the order of the channels.
    """
    frames, at = len(values), 0
    points = np.empty((frames, len(joints), 3))
    R = np.empty((frames, len(joints), 3, 3))
    for j, joint in enumerate(joints):
        way = np.tile(np.array(joint.offset), (frames, 1))
        turned = np.tile(np.eye(3), (frames, 1, 1))
        for channel in joint.channels:
            if channel in MOVES:
                way[:, MOVES[channel]] = values[:, at]
            else:
                turned = turned @ _turns(TURNS[channel], np.radians(values[:, at]))
            at += 1
        if joint.parent < 0:
            points[:, j], R[:, j] = way, turned
        else:
            up = R[:, joint.parent]
            points[:, j] = points[:, joint.parent] + np.einsum("fij,fj->fi", up, way)
            R[:, j] = up @ turned
    return points


def _turns(axis: int, angle: Array) -> Array:
    """Rotations (F, 3, 3) about a coordinate axis."""
    R = np.tile(np.eye(3), (len(angle), 1, 1))
    a, b = (axis + 1) % 3, (axis + 2) % 3
    R[:, a, a] = R[:, b, b] = np.cos(angle)
    R[:, b, a] = np.sin(angle)
    R[:, a, b] = -np.sin(angle)
    return R
