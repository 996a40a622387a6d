r"""The terminal table of the sensor maker's "Simple Ranging" example, 460800 baud.

Bands of four kinds of lines, a band for each row, columns mirrored, then one more line of dashes:

     ----------------- -----------------  ...    17 dashes a cell
    |                 |                 | ...
    | ESC[38;5;10m  412ESC[0m  :      5 |  ...   distance [mm] : target status
    |   1234  :     56 |                  ...    signal : ambient, only when asked for

A cell `X : X` has no target. Of several targets a zone the first line counts, which is the
nearest or the strongest, as the program has set it. A banner with VT100 escapes stands before
every table. There is no sensor, no clock and no checksum. `app.sensing.wire.reader` reads it.
"""

from collections.abc import Mapping

from app.sensing.wire.raw import NO_TARGET, RawFrame, rows

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


def encode(frame: RawFrame, mirrored: bool = True, codes: Mapping[int, int] | None = None) -> bytes:
    """The table as the example prints it, with its banner; `codes` are its names of statuses."""
    n = frame.grid[1]
    line = " -----------------" * n + "\n"
    text = BANNER
    for distances, statuses in zip(*rows(frame, mirrored), strict=True):
        text += line + "|                 " * n + "|\n"
        for d, s in zip(distances.tolist(), statuses.tolist(), strict=True):
            text += (
                "|     X  :      X "
                if s == NO_TARGET
                else f"| \x1b[38;5;10m{d:5d}\x1b[0m  :  {(codes or {}).get(s, s):5d} "
            )
        text += "|\n"
    return (text + line).encode()
