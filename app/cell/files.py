"""Cell files: a person writes boxes and planes, Flinch adds what it has learned at the end.

    title = "A table in a hall"

    [[box]]                     # in it is the cell
    name = "table"
    position_m = [0.3, 0.0, -0.05]
    rpy_deg = [0.0, 0.0, 0.0]   # zero where left out
    size_m = [1.2, 0.8, 0.1]

    [[plane]]                   # below it, without end, is the cell
    name = "floor"
    position_m = [0.0, 0.0, -0.8]
    size_m = [4.0, 4.0]         # only drawn; 2 x 2 where left out

    [learned]                   # written by Flinch; the last table of the file
    edge_m = 0.05
    cells = [[1, -3, 2]]

Metres, degrees about the fixed x, y, z axes, base frame.
"""

import os
import re
import shutil
import tomllib
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import Annotated

import numpy as np
from msgspec import Meta

from app.cell.learned import EDGE, FAR, NOTHING_LEARNED, Learned
from app.cell.parts import LEARNED, Box, Cell, HalfSpace
from app.errors import ConfigError
from app.messages import Array, freeze
from app.poses import pose
from app.text_file import as_text, read_file
from app.toml import Name, Positive, Table, Vector, read_toml

Index = Annotated[int, Meta(ge=-FAR, le=FAR)]
HEADER = re.compile(rb"^[ \t]*\[[ \t]*learned[ \t]*\]", re.MULTILINE)
KEY = "learned"
A_LINE = 8  # cubes


class BoxTable(Table, frozen=True):
    """One `[[box]]`: what is in it is the cell.

    name:       what it is called on the page and in messages.
    position_m: its middle, base frame.
    size_m:     its edges; draw it 5 cm larger than the thing.
    rpy_deg:    its turn about the fixed x, y and z axes.
    """

    name: Name
    position_m: Vector
    size_m: tuple[Positive, Positive, Positive]
    rpy_deg: Vector = (0.0, 0.0, 0.0)


class PlaneTable(Table, frozen=True):
    """One `[[plane]]`: what is below it, without end, is the cell.

    name:       what it is called on the page and in messages.
    position_m: a point on it, base frame.
    rpy_deg:    its turn about the fixed x, y and z axes; it faces its own z.
    size_m:     how much of it is drawn.
    """

    name: Name
    position_m: Vector
    rpy_deg: Vector = (0.0, 0.0, 0.0)
    size_m: tuple[Positive, Positive] = (2.0, 2.0)


class LearnedTable(Table, frozen=True):
    """`[learned]`: cubes of edge_m by their whole-numbered places."""

    edge_m: float
    cells: list[tuple[Index, Index, Index]]


class CellTable(Table, frozen=True):
    """A cell's file.

    title:   what the page calls it; default: the file's name.
    box:     `[[box]]` tables.
    plane:   `[[plane]]` tables.
    learned: written by Flinch when it has learned what stands there; the last table of the file.
    """

    title: str = ""
    box: tuple[BoxTable, ...] = ()
    plane: tuple[PlaneTable, ...] = ()
    learned: LearnedTable | None = None


def load_cell(path: Path) -> Cell:
    """Read a cell's file; a ConfigError names the file, the entry and the remedy in one line."""
    table = read_toml(path, CellTable, ConfigError)
    _check_names([*(b.name for b in table.box), *(p.name for p in table.plane)], path)
    return Cell(
        title=table.title or path.stem,
        boxes=tuple(Box(b.name, *_placed(b)) for b in table.box),
        planes=tuple(HalfSpace(p.name, *_placed(p)) for p in table.plane),
        learned=_learned(table.learned, path),
    )


def save_learned(path: Path, learned: Learned) -> None:
    """Make `learned` the file's last table and leave all above it as it is, byte for byte.

    The file is made where there is none, and replaced as a whole: a reader, or a power cut, finds
    the old one or the new one. It may take as long as the disk does: not for the control thread.
    Raises a ConfigError in one line; the file is then as it was.
    """
    path = path.resolve()  # a link goes on pointing to the file
    above = _above(path)
    text = above + (b"" if above.endswith(b"\n") or not above else b"\n") + _table(learned)
    beside = path.with_name(f".{path.name}.new")
    try:
        with beside.open("wb") as file:
            file.write(text)
            file.flush()
            os.fsync(file.fileno())
        if path.exists():
            shutil.copymode(path, beside)
        beside.replace(path)
    except OSError as e:
        with suppress(OSError):  # the reason to tell is the first one
            beside.unlink(missing_ok=True)
        raise ConfigError(
            f"{path}: cannot be written ({e.strerror}); make room, or give another cell file"
        ) from e


def _above(path: Path) -> bytes:
    """What a person wrote: all before the last table, `[learned]`."""
    if not path.exists():
        return b""
    content = read_file(path, ConfigError)
    headers = list(HEADER.finditer(content))
    cut = headers[-1].start() if headers else len(content)
    try:
        above = tomllib.loads(as_text(path, content[:cut], ConfigError))
        below = tomllib.loads(content[cut:].decode())
    except ValueError as e:  # also one that is no UTF-8
        raise ConfigError(f"{path}: not valid TOML ({e}); mend that line") from e
    if KEY in above or set(below) - {KEY}:
        raise ConfigError(f"{path}: [learned] is not the last table; move it to the end")
    return content[:cut]


def _table(learned: Learned) -> bytes:
    rows = [f"[{i}, {j}, {k}]" for i, j, k in learned.cells.tolist()]
    lines = [", ".join(rows[n : n + A_LINE]) for n in range(0, len(rows), A_LINE)]
    cells = "".join(f"\n    {line}," for line in lines) + "\n" * bool(lines)
    words = "# written by Flinch, replaced when it learns; keep your own entries above"
    return f"[learned]  {words}\nedge_m = {EDGE}\ncells = [{cells}]\n".encode()


def _learned(table: LearnedTable | None, path: Path) -> Learned:
    if table is None:
        return NOTHING_LEARNED
    if table.edge_m != EDGE:
        raise ConfigError(
            f"{path}: [learned] edge_m = {table.edge_m:g}, but cubes here have {EDGE:g}; "
            "delete that table and learn anew"
        )
    return Learned.of(np.array(table.cells, dtype=np.int64).reshape(-1, 3))


def _check_names(names: Iterable[str], path: Path) -> None:
    seen = {LEARNED}
    for name in names:
        if name in seen:
            raise ConfigError(f"{path}: the name {name!r} comes twice; rename one")
        seen.add(name)


def _placed(entry: BoxTable | PlaneTable) -> tuple[Array, Array]:
    """Pose (4, 4) and edge lengths of an entry."""
    return pose(entry.position_m, entry.rpy_deg), freeze(np.array(entry.size_m))
