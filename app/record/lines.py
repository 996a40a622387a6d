"""Ticks into lines: what is written of each, whoever keeps it, a file or a ring."""

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import msgspec
import numpy as np

from app.errors import RecordingError
from app.messages import BodyPose, BodyView, Mode, freeze
from app.record.codec import encode
from app.record.marks import Marker
from app.record.run_file import BODIES, GAP, INPUTS, LOOK, MARK, WITNESS
from app.record.witness import FIELDS, LENGTH, Witness, WitnessOf
from app.tick import Inputs, Outputs
from app.timing import date_now

SECOND = 1_000_000_000  # [ns]


class Line(NamedTuple):
    """A message to be: of which channel, what it says, and of a look its number."""

    channel: int
    data: bytes
    look: int = -1


class Scribe:
    """Sees every tick that is kept, in their order; one thread at a time."""

    def __init__(self) -> None:
        self._witness, self._marker = WitnessOf(), Marker()
        self._numbers: dict[int, tuple[int, BodyView]] = {}  # by identity
        self._next_look, self._next_tick = 0, -1

    @property
    def present(self) -> set[int]:
        """Numbers of the looks of the bodies that were there at the last look at them."""
        return {number for number, _ in self._numbers.values()}

    def lines(self, x: Inputs, out: Outputs, bodies: tuple[BodyPose, ...] | None) -> Iterator[Line]:
        """Of one tick; `bodies` None: nobody looked."""
        missing = x.tick - self._next_tick if self._next_tick >= 0 else 0
        if missing:
            yield Line(GAP, encode((x.tick, missing)))
        self._next_tick = x.tick + 1
        yield Line(INPUTS, encode(x))
        yield Line(WITNESS, witness_bytes(self._witness(out)))
        for mark in self._marker.marks(x, out):
            yield Line(MARK, encode(mark))
        if bodies is not None:
            yield from self._placed(bodies)

    def _placed(self, bodies: tuple[BodyPose, ...]) -> Iterator[Line]:
        seen: dict[int, tuple[int, BodyView]] = {}
        placed = []
        for body in bodies:
            view = body.view
            known = self._numbers.get(id(view))
            if known is None:
                known = self._next_look, view
                self._next_look += 1
                yield Line(LOOK, encode((known[0], view)), known[0])
            seen[id(view)] = known
            placed.append((known[0], body.T_base_body))
        self._numbers = seen  # who has left comes back with another number
        yield Line(BODIES, encode(tuple(placed)))


class Dates:
    """The run's clock in nanoseconds since 1970; the first tick that it is asked for is now."""

    def __init__(self) -> None:
        self._origin: int | None = None

    def of(self, now: float) -> int:
        """[ns] since 1970 of `now` [s] on the run's clock."""
        if self._origin is None:
            self._origin = round(date_now() * SECOND) - round(now * SECOND)
        return self._origin + round(now * SECOND)


def witness_bytes(w: Witness) -> bytes:
    """Without the fields' names, which stand once in the file."""
    blob = b"".join(w.digests.values())
    numbers = (w.distance, w.reached, w.activation)
    plain = (blob, w.qd.tobytes(), w.tool.tobytes(), w.mode.value, *numbers)
    return msgspec.msgpack.encode(plain)


class WitnessReader:
    """Reads them again; `names`: the fields of the Outputs in the file's order."""

    def __init__(self, names: Sequence[str] = FIELDS) -> None:
        self._names = names

    def __call__(self, data: bytes) -> Witness:
        """RecordingError where it is damaged."""
        try:
            blob, qd, tool, mode, distance, reached, activation = msgspec.msgpack.decode(data)
            parts = [blob[i : i + LENGTH] for i in range(0, len(blob), LENGTH)]
            digests = dict(zip(self._names, parts, strict=True))
            return Witness(
                digests, _floats(qd), _floats(tool), float(distance), Mode(mode), int(reached),
                float(activation),
            )  # fmt: skip
        except Exception as e:  # whatever rubbish does
            raise RecordingError(f"the recording is damaged: no witness here ({e})") from e


def _floats(data: bytes) -> Any:
    return freeze(np.frombuffer(data, np.float64).copy())
