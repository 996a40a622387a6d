"""What a port prints that no format can be told from: what it looks like, and what to name.

Rows of numbers look alike whichever way they run. So no frame is made of them: the port says what
came, and which names there are.
"""

from collections import Counter
from collections.abc import Sequence

from app.sensing.wire.cells import Odd, Row, is_border, read_json, read_row
from app.sensing.wire.raw import USUAL, Grid, RawFrame
from app.sensing.wire.text import HOME, Lines

ENOUGH = 4  # lines alike
ODDEST = 1100  # numbers a line
FILE = "or describe it in a file, PORT#FILE.toml"
ROWS = f"name its sketch, PORT#sparkfun, #adafruit, #micropython, #lines-plain, {FILE}"
REMEDY = {
    "rows": ROWS,
    "line": f"name its sketch, PORT#lines, #lines-plain, #adafruit-web, {FILE}",
    "fractions": f"name its sketch, PORT#esphome, {FILE}",
    "pairs": f"name it, PORT#table, #st-cube, #pairs-plain, {FILE}",
    "json": f"name it, PORT#json, #json-status, {FILE}",
    "odd": "say with skip which are no zones, in a file, PORT#FILE.toml",
}


class Shape:
    """Looks at a stream that no format has been found for; gives no frame."""

    def __init__(self, grids: Sequence[Grid] = USUAL) -> None:
        self.refused: Counter[str] = Counter()
        self._counts = {n for r, c in grids for n in (r, c, r * c)}
        self._widths = {n for r, c in grids for n in (r, c)}
        self._lines = Lines()
        self._seen: Counter[tuple[str, int]] = Counter()

    @property
    def trouble(self) -> str:
        """What has been seen, and what to do about it; empty until it is clear enough."""
        good = {k: n for k, n in self._seen.items() if n >= (1 if k[0] == "json" else ENOUGH)}
        if not good:
            return ""
        what, count = max(good, key=lambda k: (k[0] != "odd", good[k]))
        words = {
            "rows": f"it prints rows of {count} numbers and does not tell their order",
            "line": f"it prints {count} numbers a line and does not tell their order",
            "fractions": f"it prints {count} fractions a line and tells no unit and no order",
            "pairs": f"it prints {count} pairs a line and does not tell their order",
            "json": "it prints JSON and does not tell the order of its numbers",
            "odd": f"it prints {count} numbers a line, which no sensor has",
        }
        return f"{words[what]}; {REMEDY[what]}"

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """No frames."""
        for line in self._lines.feed(chunk):
            found = self._look(line)
            if found and (found in self._seen or len(self._seen) < 64):
                self._seen[found] += 1
        return []

    def _look(self, line: str) -> tuple[str, int] | None:
        if line == HOME or not line.strip() or is_border(line):
            return None
        if "{" in line or "[[" in line:
            told = read_json(line)
            if told is not None and len(told.values) in self._counts:
                return "json", len(told.values)
        row = read_row(line, self._counts.__contains__)
        if isinstance(row, Odd):
            few = row.numbers <= min(self._counts)
            return None if few or row.numbers > ODDEST else ("odd", row.numbers)
        if not isinstance(row, Row) or len(row.values) < 2:
            return None
        if row.status is not None:
            what = "pairs"
        elif any(isinstance(v, float) for v in row.values):
            what = "fractions"
        else:
            what = "rows" if len(row.values) in self._widths else "line"
        return what, len(row.values)
