"""The binary skin frame: a whole skin over one port.

    0x00-delimited packets, each COBS-encoded (Cheshire and Baker, IEEE/ACM ToN 7(2), 1999): a
    payload and its CRC-32. Two versions; a decoder reads both, and a board may send both.

Version 1 is for sensors of 8x8 or 4x4 zones: 204 bytes, 210 on the wire.

    offset size  little-endian payload
         0    1  0x11: version 1 in the high nibble, type 1 (frame) in the low one
         1    1  sensor id: its index in the skin's layout, 0..255
         2    1  zones a row, 8 or 4, in the low nibble; the high one is 0 and ignored
         3    2  sequence, counts this sensor's frames and wraps
         5    4  t_us, the board's microsecond clock at the measurement, wraps
         9    1  temperature of the sensor, signed [degrees C]
        10    1  number of zones with a target, i.e. with a status other than 255
        11    1  reserved, 0 and ignored
        12  128  distance, int16 x 64 [mm], in the driver's zone order
       140   64  target status, uint8 x 64; 255 = no target
       204    4  CRC-32 of the 204 bytes before (IEEE 802.3, as zlib's), little-endian

A 4x4 frame fills the first 16 zones; the others hold distance 0 and status 255.

Version 2 is for any other grid of n = rows * columns zones, 1024 at most: 14 + 3 n bytes.

         0    1  0x21: version 2, type 1
         1    1  sensor id
         2    1  rows, 1..32
         3    1  columns, 1..32
         4    2  sequence
         6    4  t_us
        10    1  temperature
        11    2  number of zones with a target
        13    1  reserved, 0 and ignored
        14  2 n  distance, int16 [mm]
    14+2 n    n  target status
    14+3 n    4  CRC-32 of all before
"""

import struct
import zlib
from collections import Counter

import numpy as np
from cobs import cobs

from app.sensing.wire.raw import NO_TARGET, USUAL, RawFrame

KIND, KIND_2 = 0x11, 0x21
ZONES = 64  # of version 1, used or not
HEADER, HEADER_2 = struct.Struct("<BBBHIbBB"), struct.Struct("<BBBBHIbHB")
CRC = struct.Struct("<I")
STATUS_AT = HEADER.size + 2 * ZONES
PAYLOAD = STATUS_AT + ZONES
PACKET = PAYLOAD + CRC.size + 1  # COBS adds one byte below 254
SIDE = 32  # most rows, and columns, of version 2
_LARGEST = HEADER_2.size + 3 * SIDE * SIDE + CRC.size
LONGEST = _LARGEST + _LARGEST // 254 + 1  # with what COBS adds


class Binary:
    """Decoder of binary skin frames."""

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()
        self.trouble = ""
        self._rest = b""

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames whose delimiter has come."""
        *packets, rest = (self._rest + chunk).split(b"\0")
        self._rest = rest[: LONGEST + 1]  # what is longer is no frame, however it ends
        frames = []
        for packet in packets:
            frame = parse(packet)
            if isinstance(frame, RawFrame):
                frames.append(frame)
            elif frame:
                self.refused[frame] += 1
        return frames


def parse(packet: bytes) -> RawFrame | str:
    """The frame between two delimiters, or why it is none; an empty packet is no loss."""
    second = packet[1:2] == bytes([KIND_2])  # no byte before it is a zero, so it is not stuffed
    if len(packet) > LONGEST or (len(packet) != PACKET and not second):
        return "length" if packet else ""
    try:
        content = cobs.decode(packet)
    except cobs.DecodeError:
        return "stuffing"
    if len(content) != PAYLOAD + CRC.size and not second:
        return "stuffing"
    if len(content) < HEADER_2.size + CRC.size:
        return "length"
    payload = content[: -CRC.size]
    if zlib.crc32(payload) != CRC.unpack_from(content, len(payload))[0]:
        return "checksum"
    return _second(payload) if payload[0] == KIND_2 else _first(payload)


def _first(payload: bytes) -> RawFrame | str:
    kind, sensor, side, sequence, t_us, temperature, targets, _ = HEADER.unpack_from(payload)
    if kind != KIND:
        return "kind"
    side &= 0x0F
    if (side, side) not in USUAL:
        return "resolution"
    if ZONES - payload.count(NO_TARGET, STATUS_AT) != targets:
        return "targets"
    status = np.frombuffer(payload, np.uint8, side * side, STATUS_AT)
    distance = np.frombuffer(payload, "<i2", side * side, HEADER.size)
    return RawFrame(sensor, sequence, t_us, (side, side), distance, status, temperature)


def _second(payload: bytes) -> RawFrame | str:
    _, sensor, rows, columns, sequence, t_us, temperature, targets, _ = HEADER_2.unpack_from(
        payload
    )
    n, at = rows * columns, HEADER_2.size
    if not (1 <= rows <= SIDE and 1 <= columns <= SIDE) or len(payload) != at + 3 * n:
        return "resolution"
    if n - payload.count(NO_TARGET, at + 2 * n) != targets:
        return "targets"
    distance = np.frombuffer(payload, "<i2", n, at)
    status = np.frombuffer(payload, np.uint8, n, at + 2 * n)
    return RawFrame(sensor, sequence, t_us, (rows, columns), distance, status, temperature)


def encode(frame: RawFrame) -> bytes:
    """The bytes of a frame, delimiter included; what a frame lacks is sent as 0."""
    sensor, sequence = frame.sensor or 0, frame.sequence or 0
    t_us, temperature = frame.t_us or 0, frame.temperature or 0
    targets = int(np.count_nonzero(frame.status != NO_TARGET))
    distance, status = frame.distance.astype("<i2"), frame.status
    if frame.grid in USUAL:
        head = HEADER.pack(KIND, sensor, frame.grid[0], sequence, t_us, temperature, targets, 0)
        unused = ZONES - len(status)
        distance = np.append(distance, np.zeros(unused, dtype="<i2"))
        status = np.append(status, np.full(unused, NO_TARGET, dtype=np.uint8))
    else:
        head = HEADER_2.pack(KIND_2, sensor, *frame.grid, sequence, t_us, temperature, targets, 0)
    payload = head + distance.tobytes() + status.tobytes()
    return bytes(cobs.encode(payload + CRC.pack(zlib.crc32(payload)))) + b"\0"
