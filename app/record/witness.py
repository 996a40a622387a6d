"""A witness of a tick's Outputs: enough to tell whether they were computed again, and where not."""

from dataclasses import dataclass, fields
from typing import Any

from app.digest import digest
from app.messages import Array, Mode
from app.tick import Outputs

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
                last = self._last[name] = value, bytes.fromhex(digest(value))
            digests[name] = last[1]
        return Witness(
            digests, out.command.qd, out.T_base_tool[:3, 3], out.body.minimum, out.status.mode,
            out.reached, out.command.activation,
        )  # fmt: skip


def witness_of(out: Outputs) -> Witness:
    """The witness of one tick alone."""
    return WitnessOf()(out)
