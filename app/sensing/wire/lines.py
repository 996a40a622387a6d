r"""Number lines: bare distances in millimetres, as example programs print them.

As many whole numbers as a sensor has zones, separated by commas, tabs or spaces, either on one
line, or in rows that a blank line ends: 64 or 8 rows of 8, 16 or 4 rows of 4, or what the
layout's sensors have. The rows of the usual example programs look like this, columns mirrored,
115200 baud:

    \t1012\t998\t ... \t640\r\n      8 times, then
    \r\n

There is no sensor, no clock and no status: 0 < d < 4000 mm counts as valid. There is no
checksum either: a damaged digit is believed. `app.sensing.wire.reader` reads them.
"""

import numpy as np

from app.sensing.wire.raw import NO_TARGET, RawFrame, rows


def encode(frame: RawFrame, mirrored: bool = True) -> bytes:
    """Rows as the usual example programs print them; a zone without a target is printed as 0."""
    distance, status = rows(frame, mirrored)
    shown = np.where(status == NO_TARGET, 0, distance)
    text = "".join("".join(f"\t{d}" for d in row) + "\r\n" for row in shown.tolist())
    return text.encode() + b"\r\n"
