r"""The debug line: one frame with id, clock and status that a person can read.

    F,<id>,<t_us>,<sequence>,<64 distances [mm]>,<64 statuses>\n

With 16 distances and 16 statuses it is a 4x4 frame. Fields mean what they mean in the binary
frame; there is no checksum.
"""

import re
from collections import Counter

import numpy as np

from app.messages import SLOTS
from app.sensing.wire.raw import NO_TARGET, RawFrame, zones
from app.sensing.wire.text import Lines

LINE = re.compile(r"F(?:,-?\d{1,10}){4,}")
HEAD = 4


class FLines:
    """Decoder of debug lines."""

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()
        self._lines = Lines()

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames whose line has ended."""
        frames = []
        for line in self._lines.feed(chunk):
            if line.startswith("F,"):
                frame = parse(line)
                if frame is None:
                    self.refused["line"] += 1
                else:
                    frames.append(frame)
        return frames


def parse(line: str) -> RawFrame | None:
    """The frame of a line, None where it is damaged."""
    fields = line.strip().split(",")
    if len(fields) not in (HEAD + 2 * SLOTS, HEAD + 32) or not LINE.fullmatch(line.strip()):
        return None
    sensor, t_us, sequence, *values = (int(f) for f in fields[1:])
    half = len(values) // 2
    distance, status = values[:half], values[half:]
    fits = 0 <= sensor < 256 and 0 <= t_us < 2**32 and 0 <= sequence < 2**16
    fits = fits and all(-32768 <= d <= 32767 for d in distance)
    if not (fits and all(0 <= s <= 255 for s in status)):
        return None
    return RawFrame(
        sensor, sequence, t_us, 8 if half == SLOTS else 4,
        zones(distance, 0, np.int16, False), zones(status, NO_TARGET, np.uint8, False),
    )  # fmt: skip


def encode(frame: RawFrame) -> bytes:
    """The line of a frame; what it lacks is sent as 0."""
    zones_used = frame.resolution**2
    values = (
        frame.sensor or 0, frame.t_us or 0, frame.sequence or 0,
        *frame.distance[:zones_used].tolist(), *frame.status[:zones_used].tolist(),
    )  # fmt: skip
    return b"F," + ",".join(map(str, values)).encode() + b"\n"
