"""Renews what of `robots/README.md` follows from the code: its tables of keys and its drawing.

    make reference

Between `<!-- keys NAME -->` and `<!-- end -->` stands a table of what may stand in a TOML table:
keys, kinds and defaults from the msgspec structs, texts from their docstrings. `ring.svg` is drawn
from the template's layout as it is loaded.
"""

from __future__ import annotations

import re
from pathlib import Path

import msgspec
import numpy as np

from app.cell.files import BoxTable, CellTable, PlaneTable
from app.messages import Array
from app.robot.layout import read_layout
from app.robot.model import load_robot
from app.robot.skin_file import RingTable, SensorTable, SkinTable, load_skin
from app.robot.tables import CoverTable, RobotTable, ToolTable

HERE = Path(__file__).parent
TABLES = (
    RobotTable, ToolTable, SkinTable, RingTable, SensorTable, CoverTable,
    CellTable, BoxTable, PlaneTable,
)  # fmt: skip
KEY = re.compile(r"^ {4}(\w+):\s+(.*?)(?=^ {4}\w+:\s|\Z)", re.M | re.S)
BLOCK = re.compile(r"(<!-- keys (\w+) -->\n).*?(<!-- end -->)", re.S)


def texts(struct: type) -> dict[str, str]:
    """What the docstrings of a struct and of its bases say of each key."""
    found: dict[str, str] = {}
    for kind in reversed(struct.__mro__):
        # the first line of a docstring has no indentation; paragraphs end an entry
        for key, text in KEY.findall(kind.__doc__ or ""):
            found[key] = " ".join(text.split("\n\n")[0].split())
    return found


def kind_words(kind: msgspec.inspect.Type) -> str:
    """What a value may be, in words."""
    i = msgspec.inspect
    match kind:
        case i.FloatType(gt=0):
            return "number above 0"
        case i.FloatType(ge=0):
            return "number from 0"
        case i.FloatType(gt=low, lt=high) if low is not None:
            return f"number from {low:g} to {high:g}"
        case i.FloatType():
            return "number"
        case i.IntType(ge=low, le=high) if low is not None:
            return f"whole number, {low} to {high}"
        case i.IntType():
            return "whole number"
        case i.BoolType():
            return "true or false"
        case i.StrType():
            return "text"
        case i.LiteralType(values=values):
            return " or ".join(map(str, values))
        case i.TupleType(item_types=items):
            return f"{len(items)} {kind_words(items[0]).replace('number', 'numbers')}"
        case i.VarTupleType(item_type=i.StructType()):
            return "tables"
        case i.ListType(item_type=item) | i.VarTupleType(item_type=item):
            return "list: " + kind_words(item).replace("number", "numbers").replace("text", "texts")
        case i.DictType(value_type=value):
            return "table of " + kind_words(value).replace("number", "numbers")
        case i.StructType():
            return "table"
        case i.UnionType(types=types):
            return " or ".join(kind_words(t) for t in types if not isinstance(t, i.NoneType))
    return type(kind).__name__


def default_words(field: msgspec.inspect.Field, told: str) -> str:
    """A key's default, in bold where it must be given; empty where its text tells it."""
    if field.required:
        return "**needed**"
    value = field.default
    if value is None or value == ():
        return "" if "default:" in told else "none"
    if isinstance(value, bool):
        return str(value).lower()
    return str(list(value)) if isinstance(value, tuple) else f"{value}"


def keys(struct: type) -> str:
    """The table of a struct's keys."""
    told = texts(struct)
    lines = ["| key | value | default | meaning |", "|---|---|---|---|"]
    for field in msgspec.inspect.type_info(struct).fields:
        lines.append(
            f"| `{field.encode_name}` | {kind_words(field.type)} "
            f"| {default_words(field, told[field.name])} | {told[field.name]} |"
        )
    return "\n".join(lines) + "\n"


def renewed(text: str) -> str:
    """The reference with its tables of keys made anew."""
    structs = {struct.__name__: struct for struct in TABLES}
    return BLOCK.sub(lambda m: m[1] + keys(structs[m[2]]) + m[3], text)


# --- the drawing -----------------------------------------------------------------------------
SCALE = 1900.0  # [px/m]
WIDTH, HEIGHT = 700, 560
VIEW = np.radians([-62.0, 28.0])  # azimuth and elevation of the eye
INK, FAINT, MARK = "#22303c", "#9aa7b2", "#c0392b"


class Sheet:
    """An SVG seen along one direction: points (3,) [m] become pixels."""

    def __init__(self, middle: Array) -> None:
        a, e = VIEW
        self.toward = np.array([np.cos(e) * np.cos(a), np.cos(e) * np.sin(a), np.sin(e)])
        right = np.array([-np.sin(a), np.cos(a), 0.0])
        self._basis = np.array([right, -np.cross(self.toward, right)])
        self._middle = middle
        self.items: list[str] = []

    def at(self, p: Array) -> str:
        """Pixels of a point."""
        x, y = SCALE * self._basis @ (p - self._middle) + [0.46 * WIDTH, 0.42 * HEIGHT]
        return f"{x:.1f},{y:.1f}"

    def line(self, points: Array, colour: str = INK, extra: str = "", fill: str = "none") -> None:
        shape = " ".join(self.at(p) for p in points)
        self.items.append(f'<polyline points="{shape}" fill="{fill}" stroke="{colour}" {extra}/>')

    def arrow(self, start: Array, end: Array, colour: str, width: float = 2.0) -> None:
        tip = "mark" if colour == MARK else "ink"
        self.line(
            np.array([start, end]), colour, f'stroke-width="{width}" marker-end="url(#{tip})"'
        )

    def text(self, p: Array, words: str, colour: str = INK, extra: str = "") -> None:
        x, y = self.at(p).split(",")
        self.items.append(f'<text x="{x}" y="{y}" fill="{colour}" {extra}>{words}</text>')

    def svg(self) -> str:
        """The file's content."""
        tips = "".join(
            f'<marker id="{name}" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="7" '
            f'markerHeight="7" orient="auto"><path d="M0,0 L8,4 L0,8 z" fill="{colour}"/></marker>'
            for name, colour in (("ink", INK), ("mark", MARK))
        )
        head = (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" '
            'font-family="sans-serif" font-size="15" stroke-linejoin="round">'
            f'<defs>{tips}</defs><rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>'
        )
        return "\n".join([head, *self.items, "</svg>", ""])


def drawing() -> str:
    """A ring of the template: axis, start and count, as the code places its sensors."""
    robot = load_robot(HERE / "template")
    assert robot.layout is not None
    ring = read_layout(robot.layout).ring[0]
    skin = load_skin(robot.layout, robot)
    sensors = [s for s in skin.sensors if s.name.startswith(f"{ring.name}-")]
    centre, axis, start = (np.array(v) for v in (ring.centre_m, ring.axis, ring.start))
    side, sheet = np.cross(axis, start), Sheet(centre)

    def around(radius: float, height: float, low: float = 0.0, high: float = 360.0) -> Array:
        turn = np.radians(np.linspace(low, high, 91))[:, None]
        return centre + height * axis + radius * (np.cos(turn) * start + np.sin(turn) * side)

    bare = 0.6 * ring.radius_m
    for height in (-0.085, 0.085):
        sheet.line(around(bare, height), FAINT, "", "#eef1f4")
    for edge in (1.0, -1.0):
        right = np.cross(axis, sheet.toward)
        out = edge * bare * right / np.linalg.norm(right)
        sheet.line(centre + out + np.array([[-0.085], [0.085]]) * axis, FAINT)
    sheet.line(around(ring.radius_m, 0.0), FAINT, 'stroke-dasharray="4 4"')
    sheet.arrow(centre - 0.1 * axis, centre + 0.125 * axis, MARK)
    sheet.text(centre + 0.118 * axis, "axis", MARK, 'dx="10"')
    for s in sorted(sensors, key=lambda s: float(s.T_link_sensor[:3, 3] @ sheet.toward)):
        lens, z = s.T_link_sensor[:3, 3], s.T_link_sensor[:3, 2]
        x, y = 0.006 * s.T_link_sensor[:3, 0], 0.006 * s.T_link_sensor[:3, 1]
        colour = INK if z @ sheet.toward > -0.1 else FAINT
        sheet.line(np.array([lens - x - y, lens + x - y, lens + x + y, lens - x + y,
                             lens - x - y]), colour, 'stroke-width="1.5"', "#ffffff")  # fmt: skip
        sheet.line(np.array([lens - x - y, lens + x - y]), colour, 'stroke-width="4"')
        sheet.line(np.array([lens, lens + 0.028 * z]), colour,
                   'stroke-width="1.5" marker-end="url(#ink)"')  # fmt: skip
        sheet.text(lens + 0.043 * z, s.name[-2:], colour, 'text-anchor="middle" dy="5"')
    first = sensors[0].T_link_sensor[:3, 3]
    sheet.arrow(centre, first, MARK, 2.5)
    sheet.text(centre + 0.5 * (first - centre), "start", MARK, 'dx="-16" dy="-9"')
    arc = around(ring.radius_m + 0.062, 0.0, 5.0, 360.0 / ring.count - 5.0)
    sheet.line(arc, MARK, 'stroke-width="2" marker-end="url(#mark)"')
    last = sensors[-1].name[-2:]
    words = (
        ("centre_m: where the red arrows cross", INK),
        ("radius_m: from there to a lens", INK),
        (f"count = {ring.count}: 01 is at start, and on to {last} as", INK),
        ("a right hand's fingers go whose thumb is the axis", INK),
        ("thick edge: the upper edge of a sensor's image", INK),
    )
    for i, (line, colour) in enumerate(words):
        sheet.items.append(f'<text x="14" y="{HEIGHT - 94 + 20 * i}" fill="{colour}">{line}</text>')
    return sheet.svg()


def main(folder: Path = HERE) -> None:
    """Renew the reference and its drawing in a folder."""
    readme = folder / "README.md"
    readme.write_text(renewed(readme.read_text("utf-8")), "utf-8")
    (folder / "ring.svg").write_text(drawing(), "utf-8")


if __name__ == "__main__":
    main()
