"""One printed line into numbers, whatever stands before, between and around them."""

import json
import re
from collections.abc import Callable
from typing import NamedTuple

NUMBER = r"[-+]?\d{1,7}(?:\.\d{0,6})?"
MARK = (
    r"(?:nan|null|none|inf|n/?a|ovf|oor|x{1,8}|-{1,7}(?!\d)|\.{1,7}(?!\d)|\*{1,8}|_{1,8}|\?{1,8})"
    r"(?![a-z0-9])"
)
UNIT = r"(?:\s?(mm|cm|m)(?![a-z]))?"
CODE = rf"({NUMBER}|{MARK})"
BESIDE = rf"(?:\s*(?:[:/]\s*{CODE}|\(\s*{CODE}\s*\)|\[\s*{CODE}\s*\]))?"
CELL = re.compile(rf"(?:({NUMBER}){UNIT}|{MARK}){BESIDE}", re.IGNORECASE)
CELLS = re.compile(rf"{CELL.pattern}([\s,;|]*)", re.IGNORECASE)  # with what is between
PLAIN = re.compile(r"\s*-?\d{1,6}(?:(?:[ \t]*,[ \t]*|\t| +)-?\d{1,6})*[ \t]*,?\s*")
INTEGER = re.compile(r"-?\d+")
TWICE = re.compile(r"[,;|\t]\s*[,;|\t]")  # signs with nothing between them
BORDER = re.compile(r"[-+=|#*_:.~\s]+")
RULE = re.compile(r"[-=_~#]{8,}|[-=_]*\+|={2,}|[*#]{8,}")
# what a line may begin with before its numbers; marks for nothing are none of it
BEGINS = re.compile(
    r"""\s*(?:
      \[[^\[\]]{0,80}\](?:\s*:)?            # [12:04:31] [tof]
    | \([^()]{0,80}\)(?:\s*:)?              # (12345)
    | '[^']{0,80}'(?:\s*:)?                        # 'name'
    | \d{1,2}:\d{2}(?::\d{2})?(?:[.,]\d+)?(?=[\s\]>-])   # 12:04:31.123
    | \d{1,9}\s*(?:[:=>)]|->)               # 17:
    | (?:->|=>|>>|>|\$|\#\d*|@\d*)
    | [A-Za-z_][\w./-]{0,40}(?:(?:\s+\d{1,9})?\s*(?:[:=>]|->|\#))?
    )[\s,]*""",
    re.VERBOSE,
)
MOST = 12  # items that a line may begin with
OPEN, CLOSE = " \t,;|[{'\"", " \t,;|]}'\""
NOTHING = frozenset({65535, 8190, 8191})  # numbers that sensors' drivers give for nothing


def is_band(line: str, dashes: int) -> bool:
    """Is it a border of cells that are so many dashes wide?"""
    cells = line.split()
    return bool(cells) and all(cell == "-" * dashes for cell in cells)


class Row(NamedTuple):
    """The numbers of a line.

    values: as printed, None where a mark stands for nothing.   status: beside them, or None.
    unit:   printed with them, or empty.   before: what the line began with.
    """

    values: list[float | None]
    status: list[int | None] | None = None
    unit: str = ""
    before: str = ""


class Odd(NamedTuple):
    """A line of so many numbers that no sensor has."""

    numbers: int


Fits = Callable[[int], bool]


def is_border(line: str) -> bool:
    """Is it a rule of a table? A row of short dashes is one of marks."""
    return bool(BORDER.fullmatch(line)) and (not line.strip(" |\t") or bool(RULE.search(line)))


def read_row(line: str, fits: Fits) -> Row | Odd | None:
    """The numbers of a line if `fits` their count; None of one that is something else."""
    at, odd = 0, None
    for _ in range(MOST):
        row = _scan(line[at:], fits)
        if isinstance(row, Row):
            return row._replace(before=line[:at].strip())
        odd = odd or row
        begins = BEGINS.match(line, at)
        if not begins or CELL.fullmatch(begins[0].strip(" \t,")):
            return odd
        at = begins.end()
    return odd


def _scan(body: str, fits: Fits) -> Row | Odd | None:
    """The numbers of what is nothing but numbers, marks and what separates them."""
    body = body.lstrip(OPEN).rstrip(" \t,;|}'\"")
    if body.endswith("]") and body.count("[") < body.count("]"):
        body = body.rstrip(CLOSE)
    if PLAIN.fullmatch(body):
        plain: list[float | None] = [int(v) for v in INTEGER.findall(body)]
        return Row(plain) if fits(len(plain)) else Odd(len(plain))
    first = CELLS.match(body)
    if not first or not (first[6] or first.end() == len(body)):
        return None
    found = CELLS.findall(body)
    if CELLS.sub("", body) or not all(f[-1] for f in found[:-1]):
        return None  # something else stands there, or sticks to a number
    numbers = [f for f in found if f[0]]
    units = {f[1].lower() for f in numbers}
    told = [bool(f[2] or f[3] or f[4]) for f in numbers]
    if len(units) > 1 or (any(told) and not all(told)):
        return None
    gaps = [_empties(f[-1]) for f in found[:-1]] if TWICE.search(body) else []
    full, dense = fits(len(found) + sum(gaps)), fits(len(found))
    if not (full or dense) or (full and dense and any(gaps)):
        return Odd(len(found))
    values: list[float | None] = [_number(f[0]) for f in found]
    status = [_code(f[2] or f[3] or f[4]) for f in found]
    if full and any(gaps):
        for i in range(len(gaps) - 1, -1, -1):
            values[i + 1 : i + 1] = [None] * gaps[i]
            status[i + 1 : i + 1] = [None] * gaps[i]
    beside = any(told) or any(s is not None for s in status)
    return Row(values, status if beside else None, next(iter(units), ""))


def _number(text: str) -> float | None:
    if not text:
        return None
    return float(text) if "." in text else int(text)


def _code(text: str) -> int | None:
    return int(text) if text.isdecimal() else None


def _empties(between: str) -> int:
    """How many places between two numbers are empty."""
    if between.isspace() and "\t" not in between:
        return 0
    most = max(between.count(","), between.count(";"), between.count("|"), between.count("\t"))
    return max(0, most - 1)


DISTANCES = re.compile(r"^(d|dist\w*|distance\w*|range\w*|mm|depth\w*)$", re.IGNORECASE)
CODES = re.compile(r"^(s|st|stat\w*|status\w*|target_?status\w*)$", re.IGNORECASE)
NAME = re.compile(r"^(sensor\w*|id|dev\w*|name|tof)$", re.IGNORECASE)


class Told(NamedTuple):
    """What a line of JSON tells: its numbers, how many a line where they are nested, statuses,
    and the sensor's name."""

    values: list[float | None]
    width: int
    status: list[int | None] | None
    name: str


def read_json(line: str) -> Told | None:
    """The lists of a line of JSON; None of what is none."""
    text = line.strip()
    if not text.startswith(("{", "[[")) and not text.startswith('["'):
        return None
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return None
    parts = found if isinstance(found, dict) else {"d": found}
    distance = next((v for k, v in parts.items() if DISTANCES.match(k) and _flat(v)), None)
    flat = _flat(distance)
    if flat is None:
        return None
    status = next((_flat(v) for k, v in parts.items() if CODES.match(k)), None)
    name = next((str(v) for k, v in parts.items() if NAME.match(k)), "")
    width = len(distance[0]) if isinstance(distance, list) and _nested(distance) else 0
    codes = None if status is None else [None if s is None else int(s) for s in status]
    return Told(flat, width, codes, name[:40])


def _nested(value: list[object]) -> bool:
    return bool(value) and isinstance(value[0], list)


def _flat(value: object) -> list[float | None] | None:
    """Numbers and nothings of a list, or of a list of lists as long as one another."""
    if not isinstance(value, list):
        return None
    if _nested(value):
        if any(not isinstance(row, list) or len(row) != len(value[0]) for row in value):
            return None
        value = [v for row in value for v in row]
    out: list[float | None] = []
    for v in value:
        if isinstance(v, bool) or not (v is None or isinstance(v, int | float)):
            return None
        out.append(v if v is not None and abs(v) < 1e7 else None)  # NaN, too
    return out
