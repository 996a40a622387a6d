r"""The terminal table of the sensor maker's "Simple Ranging" example, 460800 baud.

Bands of four kinds of lines, a band for each row, columns mirrored, then one more line of dashes:

     ----------------- -----------------  ...    17 dashes a cell
    |                 |                 | ...
    | ESC[38;5;10m  412ESC[0m  :      5 |  ...   distance [mm] : target status
    |   1234  :     56 |                  ...    signal : ambient, only when asked for

A cell `X : X` has no target. Of several targets a zone the first line counts, which is the
nearest or the strongest, as the program has set it. A banner with VT100 escapes stands before
every table. There is no sensor, no clock and no checksum.
"""

import re
from collections import Counter
from collections.abc import Sequence

import numpy as np

from app.sensing.wire.raw import NO_TARGET, USUAL, Grid, RawFrame, rows, zones
from app.sensing.wire.text import Lines

ESCAPES = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
DASHES = re.compile(r"\s*(?:-{17} ?)+\s*")
EMPTY = re.compile(r"[|\s]+")
CELL = re.compile(r"\s*(-?\d{1,5}|X)\s*:\s*(\d{1,3}|X)\s*")


class RangingTable:
    """Decoder of the table; `mirrored` says that the columns are printed from the right.

    grids: that a sensor may have; of those of a table's width the first one counts.
    """

    def __init__(self, mirrored: bool = True, grids: Sequence[Grid] = USUAL) -> None:
        self.refused: Counter[str] = Counter()
        self._mirrored = mirrored
        self._height = {width: height for height, width in reversed(grids)}
        self._lines = Lines()
        self._rows: list[list[tuple[int, int]]] = []
        self._width = 0  # of the table that has begun, 0 outside of one
        self._open = False  # a band has begun and its distances have not come

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames whose last row of distances has come."""
        frames = []
        for line in self._lines.feed(chunk):
            frame = self._line(ESCAPES.sub("", line))
            if frame is not None:
                frames.append(frame)
        return frames

    def _line(self, line: str) -> RawFrame | None:
        if DASHES.fullmatch(line) and (width := line.count("-") // 17) in self._height:
            if self._open or width != self._width:
                self._forget("a row is missing")
            self._width, self._open = width, True
        elif not line.startswith("|"):
            self._forget("a row is missing" if self._rows else "")
        elif self._open and not EMPTY.fullmatch(line):
            row = cells(line)
            if len(row) == self._width:
                self._open = False
                self._rows.append(row)
                if len(self._rows) == self._height[self._width]:
                    return self._frame()
            else:
                self._forget("a cell is missing")
        return None

    def _forget(self, why: str) -> None:
        if why and self._rows:
            self.refused[why] += 1
        self._rows, self._width, self._open = [], 0, False

    def _frame(self) -> RawFrame:
        flat = [cell for row in self._rows for cell in row]
        grid = len(self._rows), self._width
        distance = zones([d for d, _ in flat], grid, np.int16, self._mirrored)
        status = zones([s for _, s in flat], grid, np.uint8, self._mirrored)
        self._rows, self._width, self._open = [], 0, False
        return RawFrame(None, None, None, grid, distance, status)


def cells(line: str) -> list[tuple[int, int]]:
    """Distance and status of every cell; none where a cell is anything else."""
    out = []
    for text in line.rstrip().strip("|").split("|"):
        match = CELL.fullmatch(text)
        if not match:
            return []
        if "X" in match.groups():
            out.append((0, NO_TARGET))
            continue
        distance, status = int(match[1]), int(match[2])
        if abs(distance) > 32767 or status > 255:
            return []
        out.append((distance, status))
    return out


BANNER = (
    "\x1b[2H53L8A1 Simple Ranging demo application\n"
    "--------------------------------------\n\n"
    "Use the following keys to control application\n"
    " 'r' : change resolution\n"
    " 's' : enable signal and ambient\n"
    " 'c' : clear screen\n\n"
    "Cell Format :\n\n"
    " \x1b[38;5;10m       Distance [mm]\x1b[0m :               Status\n\n\n"
)


def encode(frame: RawFrame, mirrored: bool = True) -> bytes:
    """The table as the example prints it, with its banner."""
    n = frame.grid[1]
    line = " -----------------" * n + "\n"
    text = BANNER
    for distances, statuses in zip(*rows(frame, mirrored), strict=True):
        text += line + "|                 " * n + "|\n"
        for d, s in zip(distances.tolist(), statuses.tolist(), strict=True):
            text += (
                "|     X  :      X "
                if s == NO_TARGET
                else f"| \x1b[38;5;10m{d:5d}\x1b[0m  :  {s:5d} "
            )
        text += "|\n"
    return (text + line).encode()
