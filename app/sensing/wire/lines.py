r"""Number lines: bare distances in millimetres, as example programs print them.

As many whole numbers as a sensor has zones, separated by commas, tabs or spaces, either on one
line, or in rows that a blank line ends: 64 or 8 rows of 8, 16 or 4 rows of 4, or what the
layout's sensors have. `DATA:` may stand before them. Whatever else comes
(banners, comments) is skipped and ends a block of rows. The rows of the usual example programs
look like this, columns mirrored, 115200 baud:

    \t1012\t998\t ... \t640\r\n      8 times, then
    \r\n

There is no sensor, no clock and no status: 0 < d < 4000 mm counts as valid. There is no
checksum either: a damaged digit is believed.
"""

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from app.sensing.wire.raw import NO_TARGET, USUAL, Grid, RawFrame, rows, without_status
from app.sensing.wire.text import Lines

NUMBERS = re.compile(r"-?\d{1,5}(?:[\s,]+-?\d{1,5})*")
NUMBER = re.compile(r"-?\d+")
AROUND = " \t,"
LIMIT = 32767  # what the driver's int16 can hold


class NumberLines:
    """Decoder of number lines; `mirrored` says that the columns are printed from the right.

    grids: that a sensor may have; of those that a line's numbers would fit the first one counts.
    """

    def __init__(self, mirrored: bool = True, grids: Sequence[Grid] = USUAL) -> None:
        self.refused: Counter[str] = Counter()
        self._mirrored, self._grids = mirrored, tuple(grids)
        self._lines = Lines()
        self._block: list[list[int]] = []

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames that are complete: with their line, or with the line after their rows."""
        frames = []
        for line in self._lines.feed(chunk):
            values = numbers(line)
            width = len(values)
            grid = next((g for g in self._grids if width in (g[1], g[0] * g[1])), None)
            part = grid is not None and width < grid[0] * grid[1]
            if not part or (self._block and len(self._block[0]) != width):
                frames += self._close()
            if part and grid is not None:
                self._block = [*self._block[: grid[0] + 1], values]
            elif grid is not None:
                frames.append(without_status(values, grid, self._mirrored))
            elif values:
                self.refused["count of numbers"] += 1
        return frames

    def _close(self) -> list[RawFrame]:
        """The frame of the rows so far, if they are as many as a grid of their width has."""
        block, self._block = self._block, []
        if not block:
            return []
        grid = len(block), len(block[0])
        if grid not in self._grids:
            self.refused["count of rows"] += 1
            return []
        return [without_status([v for row in block for v in row], grid, self._mirrored)]


def numbers(line: str) -> list[int]:
    """The numbers of a line; none where it holds anything else or what no sensor can say."""
    text = line.strip(AROUND).removeprefix("DATA:").strip(AROUND)
    values = [int(v) for v in NUMBER.findall(text)] if NUMBERS.fullmatch(text) else []
    return values if all(abs(v) <= LIMIT for v in values) else []


def encode(frame: RawFrame, mirrored: bool = True) -> bytes:
    """Rows as the usual example programs print them; a zone without a target is printed as 0."""
    distance, status = rows(frame, mirrored)
    shown = np.where(status == NO_TARGET, 0, distance)
    text = "".join("".join(f"\t{d}" for d in row) + "\r\n" for row in shown.tolist())
    return text.encode() + b"\r\n"
