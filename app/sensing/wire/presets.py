"""Text formats by name: how the sketches that people flash print their frames.

| name                  | whose print                                                       |
| lines, sparkfun       | SparkFun's VL53L5CX examples: rows, columns from the right        |
| lines-plain,          | rows as the driver has them, such as the MicroPython driver's     |
| micropython           | examples                                                          |
| table, st-arduino     | the maker's Simple Ranging example on Arduino                     |
| st-cube               | the same from X-CUBE-TOF1, whose adapter turns 5 and 9 into 0     |
| adafruit              | Adafruit's simple test: a line is a column, from the right and    |
|                       | from below                                                        |
| adafruit-web          | the same order on one line, `D:` and then statuses, `S:`          |
| uld                   | the driver's example 1: a line a zone                             |
| esphome               | the text sensor of an ESPHome component: metres, NaN              |
| json, json-status     | lists in the driver's order                                       |
| pairs-plain           | distance and status of each zone beside it, in the driver's order |
"""

from collections.abc import Callable
from dataclasses import dataclass

from app.sensing.wire import lines, printed, table, zone_lines
from app.sensing.wire.described import Print, Status
from app.sensing.wire.raw import RawFrame


@dataclass(frozen=True, slots=True)
class Preset:
    """A print, its encoder, and the usual speed [baud]."""

    how: Print
    encode: Callable[[RawFrame], bytes]
    baud: int = 115_200


def _with(write: Callable[[Print, RawFrame], bytes], how: Print) -> Preset:
    return Preset(how, lambda frame: write(how, frame))


CELL = 17  # dashes of the maker's table
TABLE = Print(from_right=True, status=Status.BESIDE, table=CELL)
TABLE_PLAIN = Print(status=Status.BESIDE, table=CELL)
CUBE = Print(from_right=True, status=Status.BESIDE, table=CELL, valid=(0,))
CUBE_PLAIN = Print(status=Status.BESIDE, table=CELL, valid=(0,))
TURNED = Print(columns=True, from_right=True, from_bottom=True, json=False)
TURNED_STATUS = Print(columns=True, from_right=True, from_bottom=True, status=Status.AFTER)
LINES = Preset(Print(from_right=True, json=False), lines.encode)
PLAIN = Preset(Print(json=False), lambda frame: lines.encode(frame, mirrored=False))
ST = Preset(TABLE, table.encode, 460_800)


def _cube(frame: RawFrame, mirrored: bool) -> bytes:
    return table.encode(frame, mirrored, {5: 0, 9: 0, 0: 255})


PRESETS = {
    "table": ST,
    "table-plain": Preset(TABLE_PLAIN, lambda frame: table.encode(frame, mirrored=False), 460_800),
    "lines": LINES,
    "lines-plain": PLAIN,
    "sparkfun": LINES,
    "micropython": PLAIN,
    "st-arduino": ST,
    "st-cube": Preset(CUBE, lambda frame: _cube(frame, True), 460_800),
    "st-cube-plain": Preset(CUBE_PLAIN, lambda frame: _cube(frame, False), 460_800),
    "adafruit": _with(printed.rows, TURNED),
    "adafruit-web": _with(printed.web_serial, TURNED_STATUS),
    "uld": Preset(zone_lines.ULD, zone_lines.encode),
    "esphome": _with(printed.esphome, Print(unit=1000.0, json=False)),
    "json": _with(printed.json_line, Print(json=True)),
    "json-status": _with(printed.json_line, Print(status=Status.AFTER, json=True)),
    "pairs-plain": _with(printed.rows, Print(status=Status.BESIDE)),
}
