"""The last half minute of a run, always at hand: for whoever asks what happened just now.

Kept as lines in memory, packed, in parts that each begin with the brain's state: what is saved
replays like any recording. A part that has become too old goes as a whole.
"""

import logging
from collections import deque
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import zstandard

from app.errors import RecordingError
from app.record.codec import encode
from app.record.head import head_of
from app.record.lines import SECOND, Dates, Scribe
from app.record.recorder import LOOK, ROOM, Engine, Seen
from app.record.run_file import HEAD, RunFile
from app.record.run_file import LOOK as LOOKS
from app.record.worker import Worker
from app.setup import Setup
from app.state import Room, State
from app.tick import Tick

log = logging.getLogger(__name__)
PART = 10.0  # [s] of a part
BLOCK = 0.5  # [s] that are packed together
Row = tuple[int, int, bytes, int]  # as `RunFile.add` takes them
_pack, _unpack = msgspec.msgpack.encode, msgspec.msgpack.Decoder(list[Row]).decode


@dataclass
class Part:
    """Some seconds of ticks.

    state: packed, before the first of them; None at the run's beginning.   looks: that it shows.
    """

    first_tick: int
    state: bytes | None
    began: float = 0.0  # [s] on the run's clock
    began_ns: int = 0
    ended: float = 0.0
    ticks: int = 0
    blocks: list[bytes] = field(default_factory=list)
    looks: set[int] = field(default_factory=set)


class Ring:
    """A follower that keeps at least the last `seconds`, and at most ten more."""

    def __init__(
        self, engine: Engine, setup: Setup, seconds: float = 30.0, threaded: bool = True
    ) -> None:
        self.fault = ""  # why it keeps nothing any more; empty while it does
        self._engine, self._mind, self._seconds = engine, engine.brain, seconds
        self._head = head_of(setup, engine)
        self._scribe, self._dates = Scribe(), Dates()
        self._free = deque((Room(), Room()))  # one is written down while the next is filled
        self._next_part, self._next_look = 0.0, -1.0  # [s]
        self._known = False  # how the next tick begins
        self._over = False
        self._parts: deque[Part] = deque()
        self._rows: list[Row] = []  # not packed yet
        self._looks: dict[int, bytes] = {}
        self._packer, self._unpacker = zstandard.ZstdCompressor(1), zstandard.ZstdDecompressor()
        self._worker: Worker[Seen | tuple[int, State, Room]] = Worker(
            self._keep, ROOM, "flinch-ring", threaded
        )

    # --- in the control thread ----------------------------------------------------------------

    def put(self, value: Tick) -> None:
        """Queue a tick; never raises, never waits."""
        if self._over or self.fault:
            return
        x, out = value
        if x.tick == 0 or self._known:
            bodies = None
            if not 0.0 <= self._next_look - x.now <= LOOK:
                self._next_look = x.now + LOOK
                snapshot, _ = self._engine.snapshots.get()
                bodies = snapshot.world if snapshot is not None else None
            self._worker.put((x, out, bodies))
        if x.tick == 0:
            self._known, self._next_part = True, x.now + PART
        elif (not self._known or x.now >= self._next_part) and self._free:
            # this tick is over: what the brain knows now is how the next begins
            room = self._free.popleft()
            if self._worker.put((x.tick + 1, self._mind.capture(room), room)):
                self._known, self._next_part = True, x.now + PART
            else:
                self._free.append(room)

    def close(self) -> None:
        """Keep nothing more; what is there may still be saved."""
        self._over = True
        self._worker.close()

    # --- in any thread ------------------------------------------------------------------------

    @property
    def held(self) -> float:
        """[s] that could be saved now."""
        with self._worker.lock:
            return self._parts[-1].ended - self._parts[0].began if self._parts else 0.0

    def save(self, path: Path) -> float:
        """Write what is kept into a new file; returns its [s].

        RecordingError where there is nothing yet, or `path` exists or cannot be written.
        """
        self._worker.drain()
        with self._worker.lock:
            self._close_block()
            parts = [Part(**vars(p) | {"blocks": list(p.blocks)}) for p in self._parts if p.ticks]
            looks = dict(self._looks)
        if self.fault or not parts:
            raise RecordingError(f"{path}: nothing to save{self.fault and f': {self.fault}'}")
        first = parts[0]
        state = first.state and self._unpacker.decompress(first.state)
        head = self._head.beginning(first.first_tick, state, first.began_ns / SECOND)
        file, ticks = RunFile(path), sum(p.ticks for p in parts)
        try:
            file.add(HEAD, first.began_ns, encode(head), head.first_tick)
            for number in sorted(set().union(*(p.looks for p in parts))):
                file.add(LOOKS, first.began_ns, looks[number], head.first_tick)
            for block in (b for p in parts for b in p.blocks):
                for row in _unpack(self._unpacker.decompress(block)):
                    file.add(*row)
            file.finish(ticks, 0)
        except OSError as e:
            file.abandon(f"{e.strerror}", ticks, 0)
            raise RecordingError(f"{path}: cannot be written ({e.strerror})") from e
        return parts[-1].ended - first.began

    # --- in the ring's ------------------------------------------------------------------------

    def _keep(self, item: "Seen | tuple[int, State, Room]") -> None:
        if self.fault:
            return
        try:
            if isinstance(item[1], State):
                tick, state, room = item
                assert isinstance(tick, int) and isinstance(room, Room)
                written = self._packer.compress(self._mind.written(state))
                self._free.append(room)
                self._begin(Part(tick, written))
            else:
                self._add(item)
        except Exception as e:
            log.exception("the last half minute is kept no more")
            self.fault = repr(e)

    def _begin(self, part: Part) -> None:
        self._close_block()
        self._parts.append(part)

    def _add(self, item: Seen) -> None:
        x, out, bodies = item
        if not self._parts:
            self._begin(Part(x.tick, None))
        part, at_ns = self._parts[-1], self._dates.of(x.now)
        if not part.ticks:
            part.began, part.began_ns = x.now, at_ns
            self._forget(x.now)
        for line in self._scribe.lines(x, out, bodies):
            if line.channel == LOOKS:
                self._looks[line.look] = line.data
            else:
                self._rows.append((line.channel, at_ns, line.data, x.tick))
        if bodies is not None:
            part.looks |= self._scribe.present
        part.ticks, part.ended = part.ticks + 1, x.now
        if at_ns - self._rows[0][1] >= BLOCK * SECOND:
            self._close_block()
            self._forget(x.now)

    def _forget(self, now: float) -> None:
        """Parts that are too old, and looks that no part shows."""
        while len(self._parts) > 2 and now - self._parts[1].began >= self._seconds:
            self._parts.popleft()  # there is another one before the newest, which may be empty
        used = set().union(*(p.looks for p in self._parts), self._scribe.present)
        self._looks = {number: look for number, look in self._looks.items() if number in used}

    def _close_block(self) -> None:
        if self._rows:
            self._parts[-1].blocks.append(self._packer.compress(_pack(self._rows)))
            self._rows = []
