r"""A line a zone, with its number, as the maker's driver examples print it.

    Print data no :   7\n
    Zone :   0, Status :   5, Distance :  412 mm\n      16 or 64 times

Zones are numbered in the driver's order, the unit stands there, so nothing has to be described.
A frame is whole with its last zone, once it is known how many there are; until then with the line
that follows it.
"""

import re
from collections import Counter
from collections.abc import Sequence

from app.sensing.wire.described import Print, Status, frame_of
from app.sensing.wire.doubts import Doubts
from app.sensing.wire.raw import NO_TARGET, USUAL, Grid, RawFrame, grid_of
from app.sensing.wire.reader import LARGEST, UNITS
from app.sensing.wire.text import Lines

ZONE = re.compile(
    r"\b(?:zone|pixel|px|z)\s*[:=#]?\s*\[?\s*(\d{1,4})\]?[\s:,;|-]+(.*)$", re.IGNORECASE
)
STATUS = re.compile(r"\b(?:target[_ ])?(?:status|stat|st|s)\s*[:=]\s*(\d{1,3})\b", re.IGNORECASE)
DISTANCE = re.compile(
    r"\b(?:distance|dist|range|d)\s*[:=]\s*(-?\d{1,6}(?:\.\d{0,6})?|[xX*.-]+|nan)\s*(mm|cm|m)\b",
    re.IGNORECASE,
)
MOST = 1024  # zones


class ZoneLines:
    """Decoder of zone lines; `grids` are those that a sensor may have."""

    def __init__(self, how: Print, grids: Sequence[Grid] = USUAL) -> None:
        self.refused: Counter[str] = Counter()
        self.trouble = ""
        self._how, self._grids = how, tuple(grids)
        self._lines = Lines()
        self._doubts = Doubts(how)
        self._block: list[tuple[int, int]] = []  # distance [mm] and status of each zone
        self._count = 0  # of zones a frame, once it is known
        self._lost = True  # until zone 0

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames whose last zone has come."""
        out: list[RawFrame] = []
        for line in self._lines.feed(chunk):
            zone = parse_zone(line)
            frame = self._close() if zone is None else self._zone(*zone)
            if frame is not None:
                out.append(frame)
        return out

    def _zone(self, number: int, mm: int, status: int) -> RawFrame | None:
        closed = None
        if number == 0:
            late = self._block
            closed = self._close()
            if late and closed is not None:
                closed = None  # it waited for the next one: too old
            self._lost = False
        if self._lost:
            return None
        if number != len(self._block) or number >= MOST or abs(mm) > LARGEST or status > 255:
            self.refused["a zone is missing"] += 1
            self._block, self._lost = [], True
            return None
        self._block.append((mm, status))
        return self._close() if len(self._block) == self._count else closed

    def _close(self) -> RawFrame | None:
        """The frame of the zones so far, if a grid has so many."""
        block, self._block = self._block, []
        if not block:
            return None
        self._lost = True
        grid = grid_of(len(block), self._grids)
        if grid is None or (self._count and len(block) < self._count):
            self.refused["a zone is missing"] += 1
            self._count = 0
            return None
        self._count = len(block)
        codes = [c for _, c in block]
        self.trouble = self._doubts.of_statuses(codes)
        if self.trouble:
            self.refused["not as described"] += 1
            return None
        return frame_of(self._how, grid, [d for d, _ in block], codes, None)


def parse_zone(line: str) -> tuple[int, int, int] | None:
    """Number, distance [mm] and status of a zone's line; None of any other line."""
    zone = ZONE.search(line)
    if zone is None:
        return None
    distance, status = DISTANCE.search(zone[2]), STATUS.search(zone[2])
    if distance is None or status is None:
        return None
    number = distance[1]
    if not number[-1].isdigit():
        return int(zone[1]), 0, NO_TARGET
    return int(zone[1]), round(float(number) * UNITS[distance[2].lower()]), int(status[1])


def encode(frame: RawFrame) -> bytes:
    """The lines of a frame as the maker's example prints them, with its end."""
    text = f"Print data no : {frame.sequence or 0:3d}\n"
    for zone, (d, s) in enumerate(zip(frame.distance.tolist(), frame.status.tolist(), strict=True)):
        text += f"Zone : {zone:3d}, Status : {s:3d}, Distance : {d:4d} mm\n"
    return text.encode() + b"\n"


ULD = Print(status=Status.BESIDE, zones=True)
