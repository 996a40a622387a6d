"""A witness of a tick's Outputs: enough to tell whether they were computed again, and where not."""

import hashlib
from dataclasses import dataclass, fields
from typing import Any

import msgspec
import numpy as np

from app.messages import Array, Mode
from app.tick import Outputs

LENGTH = 8  # [bytes] of a digest
FIELDS = tuple(f.name for f in fields(Outputs))


@dataclass(frozen=True, eq=False, slots=True)
class Witness:
    """Of one tick's Outputs.

    digests:  8 bytes of each field by its name; equal values, equal bytes.
    qd:       (n,) [rad/s] the command.   tool: (3,) [m] where the tool is, base frame.
    distance: [m] smallest of the whole body, +inf without a point.
    mode, reached, activation: as in the Outputs and their parts.
    """

    digests: dict[str, bytes]
    qd: Array
    tool: Array
    distance: float
    mode: Mode
    reached: int
    activation: float


def field_digest(value: Any) -> bytes:
    """8 bytes of a value that Outputs may hold; equal to the last bit, equal bytes.

    A quarter of the time of `app.digest`, which reads what it has never heard of.
    """
    return hashlib.sha256(_pack(value)).digest()[:LENGTH]


def _numbers(value: Any) -> Any:
    """Arrays and numpy's numbers as what msgspec knows."""
    if isinstance(value, np.ndarray):
        return value.dtype.char, value.shape, value.tobytes()
    if isinstance(value, np.generic):
        return value.dtype.char, value.tobytes()
    raise TypeError(f"a {type(value).__name__} has no witness")


_pack = msgspec.msgpack.Encoder(enc_hook=_numbers).encode


class WitnessOf:
    """Makes witnesses of ticks in a row: what is the same object as before is not read again."""

    def __init__(self) -> None:
        self._last: dict[str, tuple[Any, bytes]] = {}

    def __call__(self, out: Outputs) -> Witness:
        digests = {}
        for name in FIELDS:
            value = getattr(out, name)
            last = self._last.get(name)
            if last is None or last[0] is not value:
                last = self._last[name] = value, field_digest(value)
            digests[name] = last[1]
        return Witness(
            digests, out.command.qd, out.T_base_tool[:3, 3], out.body.minimum, out.status.mode,
            out.reached, out.command.activation,
        )  # fmt: skip


def witness_of(out: Outputs) -> Witness:
    """The witness of one tick alone."""
    return WitnessOf()(out)
