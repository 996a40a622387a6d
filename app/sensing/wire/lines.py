r"""Number lines: bare distances in millimetres, as example programs print them.

64 (or 16) whole numbers separated by commas, tabs or spaces, either on one line, or as 8 (4)
rows of 8 (4) that a blank line ends. `DATA:` may stand before them. Whatever else comes
(banners, comments) is skipped and ends a block of rows. The rows of the usual example programs
look like this, columns mirrored, 115200 baud:

    \t1012\t998\t ... \t640\r\n      8 times, then
    \r\n

There is no sensor, no clock and no status: 0 < d < 4000 mm counts as valid. There is no
checksum either: a damaged digit is believed.
"""

import re
from collections import Counter

import numpy as np

from app.sensing.wire.raw import NO_TARGET, RawFrame, rows, without_status
from app.sensing.wire.text import Lines

NUMBERS = re.compile(r"-?\d{1,5}(?:[\s,]+-?\d{1,5})*")
NUMBER = re.compile(r"-?\d+")
AROUND = " \t,"
LIMIT = 32767  # what the driver's int16 can hold


class NumberLines:
    """Decoder of number lines; `mirrored` says that the columns are printed from the right."""

    def __init__(self, mirrored: bool = True) -> None:
        self.refused: Counter[str] = Counter()
        self._mirrored = mirrored
        self._lines = Lines()
        self._block: list[list[int]] = []

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames that are complete: with their line, or with the line after their rows."""
        frames = []
        for line in self._lines.feed(chunk):
            values = numbers(line)
            width = len(values)
            if width not in (4, 8) or (self._block and len(self._block[0]) != width):
                frames += self._close()
            if width in (16, 64):
                frames.append(without_status(values, self._mirrored))
            elif width in (4, 8):
                self._block = [*self._block[: width + 1], values]
            elif values:
                self.refused["count of numbers"] += 1
        return frames

    def _close(self) -> list[RawFrame]:
        """The frame of the rows so far, if they are as many as a row is wide."""
        block, self._block = self._block, []
        if block and len(block) != len(block[0]):
            self.refused["count of rows"] += 1
            return []
        values = [v for row in block for v in row]
        return [without_status(values, self._mirrored)] if block else []


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
