"""The reader of text: rows, lines or JSON as a `Print` describes them, whatever else is printed.

A frame begins after something that is no row (an empty line, a heading, a border, the cursor
going home) and is whole when its last row has come. Where an empty line ends the blocks it is
waited for, since it shows that no row came twice. A damaged line costs the frame: rows are
believed again from the next beginning on.
"""

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

from app.sensing.wire.cells import NOTHING, Odd, Row, Told, is_band, is_border, read_json, read_row
from app.sensing.wire.described import Print, Status, frame_of
from app.sensing.wire.doubts import Doubts, kind_of, like_statuses
from app.sensing.wire.raw import NO_TARGET, USUAL, Grid, RawFrame
from app.sensing.wire.text import HOME, Lines

LARGEST = 32767  # [mm] what the driver's int16 can hold
UNITS = {"mm": 1.0, "cm": 10.0, "m": 1000.0}
FEW_M = 9.0  # a fraction below is no millimetre
HEADING = 120  # characters of a heading that are kept


class Block(NamedTuple):
    """Lines of one grid: numbers as printed and [mm], statuses beside them, what came before."""

    rows: list[list[int]]
    codes: list[list[int]]
    fractions: bool = False
    before: str = ""


class TextReader:
    """Decoder of a described print; `grids` are those that a sensor may have.

    trouble: why its frames are not given, as long as it is so.
    """

    def __init__(self, how: Print, grids: Sequence[Grid] = USUAL) -> None:
        self.refused: Counter[str] = Counter()
        self.trouble = ""
        self._how, self._grids = how, tuple(grids)
        self._lines = Lines()
        self._doubts = Doubts(how)
        self._heading, self._block = "", Block([], [])
        self._near = False  # the heading stands right above the grid
        self._sure = False  # the block has a beginning that ends no other block
        self._worded = False  # words stood before the last row
        self._lost = False  # until the next beginning
        self._waits = False  # an empty line ends the blocks
        self._given = False  # the frame of this block
        self._band = False  # a border stands before the next row
        self._first: tuple[list[int], Grid, int | None] | None = None  # distances without statuses
        self._out: list[RawFrame] = []

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames whose last line has come, or the empty line after it."""
        self._out = []
        for line in self._lines.feed(chunk):
            self._line(line)
        return self._out

    def _line(self, line: str) -> None:
        if line == HOME or not line.strip():
            self._waits |= self._given and line != HOME
            self._near &= bool(self._block.rows)
            self._begin(line == HOME)
        elif is_border(line):
            self._border(line)
        elif ("{" in line or "[[" in line) and (told := read_json(line)) is not None:
            self._json(told)
        else:
            row = read_row(line, self._fits)
            if isinstance(row, Row):
                self._row(row)
            elif isinstance(row, Odd) and (row.numbers > 1 or self._begun):
                self._forget("count of numbers")
            else:
                self._begin(True)
                self._near = True
                self._heading = f"{self._heading} {line.strip()[:HEADING]}"[-HEADING:]
                if not self._how.sensors:
                    self._heading = line.strip()[:HEADING]

    @property
    def _begun(self) -> bool:
        """Is a block in the middle?"""
        return bool(self._block.rows) and not self._given

    # --- lines ----------------------------------------------------------------------------

    def _begin(self, sure: bool) -> None:
        """What is no row has come: a block ends here, another may begin."""
        if self._begun:
            self._close()
        self._empty()
        self._sure = sure

    def _empty(self) -> None:
        self._block, self._given, self._lost, self._band = Block([], []), False, False, False

    def _border(self, line: str) -> None:
        if self._how.table and not is_band(line, self._how.table):
            if line.strip(" |"):
                self._begin(True)
            return
        if self._block.rows and self._band:
            self._forget("a row is missing")
        elif self._given or not self._block.rows:
            self._begin(True)
        self._band = True

    def _forget(self, why: str) -> None:
        if not self._lost:
            self.refused[why] += 1
        self._empty()
        self._lost = True

    def _fits(self, count: int) -> bool:
        how = self._how
        count -= how.skip
        if how.status is Status.ALTERNATE:
            half, odd = divmod(count, 2)
            return not odd and self._grid(half) is not None
        twice = how.status is Status.AFTER and count % 2 == 0 and self._whole(count // 2)
        return bool(twice) or self._grid(count) is not None

    def _grid(self, count: int) -> Grid | None:
        """The grid that has so many numbers in a line, or in all."""
        sizes = ((g, self._how.printed(g)[1]) for g in self._grids)
        return next((g for g, wide in sizes if count in (wide, g[0] * g[1])), None)

    def _whole(self, count: int) -> Grid | None:
        return next((g for g in self._grids if g[0] * g[1] == count), None)

    def _row(self, row: Row) -> None:
        if self._how.table and not self._band:
            return  # signals, or a further target of a band
        self._band = False
        values, codes = row.values[self._how.skip :], row.status
        if self._how.status is Status.ALTERNATE:
            codes = [None if v is None else int(v) for v in values[1::2]]
            values = values[::2]
        elif self._how.status is Status.BESIDE and not any(v is not None for v in values):
            codes = [None] * len(values)
        beside = self._how.status in (Status.BESIDE, Status.ALTERNATE)
        if (codes is not None) != beside:
            there = "statuses stand beside" if codes is not None else "no statuses stand beside"
            self._refuse(f"{there} its distances, and its format says otherwise; name another")
            return
        if row.unit and UNITS[row.unit] != self._how.unit:
            self._refuse(f"it prints {row.unit}, and its format says otherwise; name another")
            return
        grid = self._grid(len(values))
        if grid is None or (grid[0] * grid[1] == len(values) and not self._how.table):
            self._at_once(values, codes, row.before)
            return
        self._add(values, codes, row.before)

    def _add(self, values: list[float | None], codes: list[int | None] | None, before: str) -> None:
        """One more row of a block; words before one, and before none above it, begin another."""
        if before and self._block.rows and not self._worded:
            self._begin(True)
        self._worded = bool(before)
        if self._lost:
            return
        if self._given or (self._block.rows and len(self._block.rows[0]) != len(values)):
            self._forget("count of rows" if self._given else "count of numbers")
            return
        mm = self._mm(values)
        grid = self._grid(len(values))
        if mm is None or grid is None or len(self._block.rows) > self._how.printed(grid)[0]:
            self._forget("number too large" if mm is None else "count of rows")
            return
        self._block.rows.append(mm)
        self._block.codes.append(_codes(codes))
        fractions = self._block.fractions or _fractions(values)
        begins = self._block.before or before
        self._block = self._block._replace(fractions=fractions, before=begins)
        full = len(self._block.rows) == self._how.printed(grid)[0]
        if full and self._sure and not self._waits:
            self._close()
            self._given = True

    def _close(self) -> None:
        """The block's grid, if it has as many rows as a grid of its width."""
        block = self._block
        grid = self._grid(len(block.rows[0]))
        if grid is None or len(block.rows) != self._how.printed(grid)[0]:
            self.refused["count of rows"] += 1
            return
        mm = [v for row in block.rows for v in row]
        codes = [c for row in block.codes for c in row]
        if block.fractions and self._unit_is_odd(mm):
            return
        self._take(mm, codes or None, grid, block.before)

    def _at_once(
        self, values: list[float | None], codes: list[int | None] | None, before: str
    ) -> None:
        """A line that is a whole grid."""
        self._begin(True)
        mm = self._mm(values)
        if mm is None:
            self.refused["number too large"] += 1
        elif not (_fractions(values) and self._unit_is_odd(mm)):
            grid = self._grid(len(values))
            half = self._whole(len(values) // 2)
            if grid is not None:
                self._take(mm, _codes(codes) or None, grid, before)
            elif half is not None:
                self._take(mm[: len(mm) // 2], None, half, "distance")
                tail = [None if v is None else int(v) for v in values[len(mm) // 2 :]]
                self._take(_codes(tail), None, half, "status")

    def _json(self, told: Told) -> None:
        self._begin(True)
        grid = self._whole(len(told.values))
        if grid is None or told.width not in (0, self._how.printed(grid)[1]):
            self.refused["count of numbers"] += 1
            return
        if self._how.json is False or self._how.status not in (Status.NONE, Status.AFTER):
            self._refuse("it prints JSON, and its format does not; name #json or #json-status")
            return
        if (told.status is not None) != (self._how.status is Status.AFTER):
            there = "has" if told.status is not None else "has no"
            self._refuse(f"it {there} statuses, and its format says otherwise; name another")
            return
        mm = self._mm(told.values)
        if mm is None or (_fractions(told.values) and self._unit_is_odd(mm)):
            return
        self._take(mm, None, grid, f"{told.name} distance")
        if told.status is not None and len(told.status) == len(mm):
            self._take(_codes(told.status), None, grid, f"{told.name} status")

    # --- numbers --------------------------------------------------------------------------

    def _mm(self, values: list[float | None]) -> list[int] | None:
        """[mm], 0 for nothing; None where a number is more than a sensor can say."""
        unit = self._how.unit
        out = [0 if v is None or v in NOTHING else round(v * unit) for v in values]
        return out if all(abs(v) <= LARGEST for v in out) else None

    def _unit_is_odd(self, mm: list[int]) -> bool:
        if self._how.unit == 1.0 and max(mm, default=0) < FEW_M:
            self._refuse("it prints fractions below 9, which are no millimetres; say its unit")
            return True
        return False

    def _refuse(self, why: str) -> None:
        self.trouble = why
        self.refused["not as described"] += 1
        self._empty()
        self._lost = True

    # --- grids ----------------------------------------------------------------------------

    def _take(self, values: list[int], codes: list[int] | None, grid: Grid, before: str) -> None:
        """A whole grid: a frame, or half of one."""
        heading = f"{self._heading} {before}".strip() if before else self._heading
        kind = kind_of(heading if self._near else before)
        self._heading = ""
        sensor = None
        if self._how.sensors and not (self._first and kind == "status"):
            sensor = next((k for k, s in enumerate(self._how.sensors) if s in heading), None)
            if sensor is None and not self._first:
                self.refused["no sensor's heading"] += 1
                return
        if self._how.status is Status.AFTER:
            self._half(values, grid, sensor, kind)
            return
        if kind == "other":
            return
        why = self._doubts.of_grid(heading, kind, values)
        if not why and codes is not None:
            why = self._doubts.of_statuses(codes)
        self._give(why, values, codes, grid, sensor)

    def _half(self, values: list[int], grid: Grid, sensor: int | None, kind: str) -> None:
        """Distances, or the statuses that follow them."""
        first = self._first
        if kind == "other":
            return
        status = kind == "status" or (
            not kind and like_statuses(values) and (first is not None or max(values) > 5)
        )
        if not status:
            if first is not None:
                self.refused["distances without statuses"] += 1
            self._first = values, grid, sensor
            return
        self._first = None
        if first is None or first[1] != grid or not all(0 <= v <= 255 for v in values):
            self.refused["statuses without distances"] += 1
            return
        self._give(self._doubts.of_statuses(values), first[0], values, grid, first[2])

    def _give(
        self,
        why: str,
        values: list[int],
        codes: list[int] | None,
        grid: Grid,
        sensor: int | None,
    ) -> None:
        if codes is not None and not all(0 <= c <= 255 for c in codes):
            why = why or "its statuses are no numbers from 0 to 255; name another format"
        self.trouble = why
        if why:
            self.refused["not as described"] += 1
        else:
            self._out.append(frame_of(self._how, grid, values, codes, sensor))


def _codes(codes: list[int | None] | None) -> list[int]:
    """Statuses, 255 where a mark stands for nothing."""
    return [NO_TARGET if c is None else c for c in codes or ()]


def _fractions(values: list[float | None]) -> bool:
    return any(isinstance(v, float) and v != int(v) for v in values)
