"""What a described print looks like: the encoder that goes with the reader."""

import json

import numpy as np

from app.sensing.wire.described import Print, Status
from app.sensing.wire.raw import NO_TARGET, VALID, RawFrame


def rows(how: Print, frame: RawFrame, between: str = "\t", end: str = "\r\n") -> bytes:
    """Rows, and an empty line; statuses in brackets, alternating or as a second grid.

    A zone without a target is printed as 0 where there are no statuses.
    """
    distance, status = _shown(how, frame)
    lines = []
    for row, codes in zip(distance, status, strict=True):
        pairs = zip(row, codes, strict=True)
        match how.status:
            case Status.BESIDE:
                lines.append(between.join(f"{d} ({s})" for d, s in pairs))
            case Status.ALTERNATE:
                lines.append(between.join(f"{d}{between}{s}" for d, s in pairs))
            case _:
                lines.append(between.join(row))
    if how.status is Status.AFTER:
        lines = ["distance", *lines, "status", *(between.join(map(str, s)) for s in status)]
    return (end.join([*lines, "", ""])).encode()


def json_line(how: Print, frame: RawFrame) -> bytes:
    """An object a line, rows nested."""
    distance, status = _shown(how, frame)
    what: dict[str, object] = {"distances": [[json.loads(d) for d in row] for row in distance]}
    if how.status is Status.AFTER:
        what["status"] = status
    return json.dumps(what, separators=(",", ":")).encode() + b"\r\n"


def web_serial(how: Print, frame: RawFrame) -> bytes:
    """A block of lines with `D:` and `S:`, as a page reads it over Web Serial."""
    distance, status = _shown(how, frame)
    d = ",".join(v for row in distance for v in row)
    s = ",".join(str(v) for row in status for v in row)
    text = f"FRAME_START\r\nRES:{len(frame.status)}\r\nRATE:15\r\nD:{d}\r\nS:{s}\r\nFRAME_END\r\n"
    return text.encode()


def esphome(how: Print, frame: RawFrame) -> bytes:
    """Rows of metres as the text sensor of an ESPHome component logs them."""
    distance, _ = _shown(how, frame)
    text = ",\r\n".join(",".join(row) for row in distance)
    head = "[12:04:31.250][D][text_sensor:119]: 'Distance': Sending state '\r\n"
    return f"{head}{text},'\r\n".encode()


def _shown(how: Print, frame: RawFrame) -> tuple[list[list[str]], list[list[int]]]:
    """Distances and statuses in the print's lines and codes."""
    codes = frame.status
    distance = frame.distance
    if how.status is Status.NONE:
        distance = np.where(codes == NO_TARGET, 0, distance)
    if not how.own_codes:
        codes = np.where(codes == VALID, how.valid[0], codes)
    laid = how.laid_out(distance, frame.grid).tolist()
    digits = 3 if how.unit == 1000.0 else 1 if how.unit == 10.0 else 0
    shown = [[f"{d / how.unit:.{digits}f}" for d in row] for row in laid]
    return shown, how.laid_out(codes, frame.grid).tolist()
