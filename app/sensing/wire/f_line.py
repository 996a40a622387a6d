r"""The debug line: one frame with id, clock and status that a person can read.

    F,<id>,<t_us>,<sequence>,<n distances [mm]>,<n statuses>\n

The zones' number says which grid it is: 64 are 8x8, 16 are 4x4, others as the layout's sensors
have them. Fields mean what they mean in the binary frame; there is no checksum.
"""

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from app.sensing.wire.raw import USUAL, Grid, RawFrame, grid_of, zones
from app.sensing.wire.text import Lines

LINE = re.compile(r"F(?:,-?\d{1,10}){4,}")
HEAD = 4


class FLines:
    """Decoder of debug lines; `grids` are those that a sensor may have."""

    def __init__(self, grids: Sequence[Grid] = USUAL) -> None:
        self.refused: Counter[str] = Counter()
        self.trouble = ""
        self._grids = grids
        self._lines = Lines()

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames whose line has ended."""
        frames = []
        for line in self._lines.feed(chunk):
            if line.startswith("F,"):
                frame = parse(line, self._grids)
                if frame is None:
                    self.refused["line"] += 1
                else:
                    frames.append(frame)
        return frames


def parse(line: str, grids: Sequence[Grid] = USUAL) -> RawFrame | None:
    """The frame of a line, None where it is damaged or has another number of zones."""
    fields = line.strip().split(",")
    count, odd = divmod(len(fields) - HEAD, 2)
    grid = None if odd else grid_of(count, grids)
    if grid is None or not LINE.fullmatch(line.strip()):
        return None
    sensor, t_us, sequence, *values = (int(f) for f in fields[1:])
    distance, status = values[:count], values[count:]
    fits = 0 <= sensor < 256 and 0 <= t_us < 2**32 and 0 <= sequence < 2**16
    fits = fits and all(-32768 <= d <= 32767 for d in distance)
    if not (fits and all(0 <= s <= 255 for s in status)):
        return None
    return RawFrame(
        sensor, sequence, t_us, grid,
        zones(distance, np.int16), zones(status, np.uint8),
    )  # fmt: skip


def encode(frame: RawFrame) -> bytes:
    """The line of a frame; what it lacks is sent as 0."""
    values = (
        frame.sensor or 0, frame.t_us or 0, frame.sequence or 0,
        *frame.distance.tolist(), *frame.status.tolist(),
    )  # fmt: skip
    return b"F," + ",".join(map(str, values)).encode() + b"\n"
