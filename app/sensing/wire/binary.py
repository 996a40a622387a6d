"""The binary skin frame: a whole skin over one port.

    0x00-delimited packets, each COBS-encoded (Cheshire and Baker, IEEE/ACM ToN 7(2), 1999):
    204 bytes of payload and their CRC-32, 210 bytes on the wire with overhead and delimiter.

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
"""

import struct
import zlib
from collections import Counter

import numpy as np
from cobs import cobs

from app.messages import SLOTS
from app.sensing.wire.raw import NO_TARGET, RawFrame

KIND = 0x11
HEADER = struct.Struct("<BBBHIbBB")
CRC = struct.Struct("<I")
STATUS_AT = HEADER.size + 2 * SLOTS
PAYLOAD = STATUS_AT + SLOTS
PACKET = PAYLOAD + CRC.size + 1  # COBS adds one byte below 254


class Binary:
    """Decoder of binary skin frames."""

    def __init__(self) -> None:
        self.refused: Counter[str] = Counter()
        self._rest = b""

    def feed(self, chunk: bytes) -> list[RawFrame]:
        """Frames whose delimiter has come."""
        *packets, rest = (self._rest + chunk).split(b"\0")
        self._rest = rest[: PACKET + 1]  # what is longer is no frame, however it ends
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
    if len(packet) != PACKET:
        return "length" if packet else ""
    try:
        payload = cobs.decode(packet)
    except cobs.DecodeError:
        return "stuffing"
    if len(payload) != PAYLOAD + CRC.size:
        return "stuffing"
    if zlib.crc32(payload[:PAYLOAD]) != CRC.unpack_from(payload, PAYLOAD)[0]:
        return "checksum"
    kind, sensor, resolution, sequence, t_us, temperature, targets, _ = HEADER.unpack_from(payload)
    if kind != KIND:
        return "kind"
    resolution &= 0x0F
    if resolution not in (4, 8):
        return "resolution"
    status = np.frombuffer(payload, np.uint8, SLOTS, STATUS_AT)
    if SLOTS - payload.count(NO_TARGET, STATUS_AT, PAYLOAD) != targets:
        return "targets"
    distance = np.frombuffer(payload, "<i2", SLOTS, HEADER.size)
    return RawFrame(sensor, sequence, t_us, resolution, distance, status, temperature)


def encode(frame: RawFrame) -> bytes:
    """The bytes of a frame, delimiter included; what a frame lacks is sent as 0."""
    payload = HEADER.pack(
        KIND,
        frame.sensor or 0,
        frame.resolution,
        frame.sequence or 0,
        frame.t_us or 0,
        frame.temperature or 0,
        int(np.count_nonzero(frame.status != NO_TARGET)),
        0,
    )
    payload += frame.distance.astype("<i2").tobytes() + frame.status.tobytes()
    return bytes(cobs.encode(payload + CRC.pack(zlib.crc32(payload)))) + b"\0"
