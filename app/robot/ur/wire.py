"""RTDE, protocol version 2: packets and values as pure functions of bytes.

A packet is its size (u16, header included), its kind (u8) and a payload, all big-endian.
Recipes are names joined by commas; some clients leave a trailing comma, which names nothing.
Source: the maker's RTDE guide.
"""

import struct
from collections.abc import Sequence
from typing import NamedTuple

from app.errors import FlinchError

_HEADER = struct.Struct(">HB")
LONGEST = 4096  # bytes; the recipes of a greedy client have about 1000


class Kind:
    """The kinds of packets, in both directions."""

    VERSION = ord("V")
    CONTROLLER = ord("v")
    TEXT = ord("M")
    DATA = ord("U")
    OUTPUTS = ord("O")
    INPUTS = ord("I")
    START = ord("S")
    PAUSE = ord("P")


FORMATS = {
    "BOOL": "?",
    "UINT8": "B",
    "UINT32": "I",
    "UINT64": "Q",
    "INT32": "i",
    "DOUBLE": "d",
    "VECTOR3D": "3d",
    "VECTOR6D": "6d",
    "VECTOR6INT32": "6i",
    "VECTOR6UINT32": "6I",
}
Value = int | float | Sequence[float]


class WireError(FlinchError):
    """Bytes that are no RTDE; the connection that sent them is closed."""


class Packet(NamedTuple):
    """One packet without its size."""

    kind: int
    payload: bytes


def pack(kind: int, payload: bytes = b"") -> bytes:
    """The bytes of a packet."""
    return _HEADER.pack(_HEADER.size + len(payload), kind) + payload


def split(buffer: bytes) -> tuple[list[Packet], bytes]:
    """The whole packets at the head of `buffer`, and the rest; WireError for a silly size."""
    packets, at = [], 0
    while len(buffer) - at >= _HEADER.size:
        size, kind = _HEADER.unpack_from(buffer, at)
        if not _HEADER.size <= size <= LONGEST:
            raise WireError(f"a packet claims {size} bytes; RTDE has from 3 to {LONGEST}")
        if len(buffer) - at < size:
            break
        packets.append(Packet(kind, buffer[at + _HEADER.size : at + size]))
        at += size
    return packets, buffer[at:]


def names(recipe: bytes) -> list[str]:
    """The variables of a recipe, without the empty name after a trailing comma."""
    try:
        return [name.strip() for name in recipe.decode("ascii").split(",") if name.strip()]
    except UnicodeDecodeError as e:
        raise WireError("a recipe is not ASCII; give names joined by commas") from e


def output_recipe(rate: float, variables: Sequence[str]) -> bytes:
    """What a client asks to be sent: `variables`, `rate` [Hz] times a second."""
    return struct.pack(">d", rate) + ",".join(variables).encode("ascii")


def output_setup(payload: bytes) -> tuple[float, list[str]]:
    """Rate [Hz] and names that a client asks to be sent."""
    if len(payload) < 8:
        raise WireError(f"an output recipe has {len(payload)} bytes; it begins with its rate (8)")
    (rate,) = struct.unpack(">d", payload[:8])
    if not 1.0 <= rate <= 500.0:
        raise WireError(f"an output rate of {rate:g} Hz; give 1 to 500")
    return rate, names(payload[8:])


def layout(types: Sequence[str]) -> struct.Struct:
    """How the values of these types lie in a data packet, after its recipe's id."""
    return struct.Struct(">" + "".join(FORMATS[t] for t in types))


def pack_values(types: Sequence[str], values: Sequence[Value]) -> bytes:
    """The values' bytes; a vector's are given as a sequence."""
    flat: list[float] = []
    for value in values:
        flat.extend([value] if isinstance(value, int | float) else value)
    return layout(types).pack(*flat)


def unpack_values(types: Sequence[str], payload: bytes) -> list[Value]:
    """The values of a data packet; WireError when its length is another."""
    shape = layout(types)
    if len(payload) != shape.size:
        raise WireError(f"a data packet has {len(payload)} bytes; its recipe has {shape.size}")
    flat, values, at = shape.unpack(payload), [], 0
    for t in types:
        width = int(FORMATS[t][0]) if FORMATS[t][0].isdigit() else 1
        values.append(flat[at] if width == 1 else flat[at : at + width])
        at += width
    return values
