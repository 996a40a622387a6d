"""Records a run into a file while it goes on: from its first tick, or from any later one.

The control thread only queues ticks. A recording that begins in the middle of a run begins with
the brain's state, which is copied between two ticks, in a millisecond, and written down later.
A disk that fails ends the recording by name; the arm goes on.
"""

import logging
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from app.actions import Action, Remark
from app.errors import FlinchError
from app.messages import BodyPose, Snapshot, Timing
from app.record.codec import encode
from app.record.head import Head, Runs, head_of
from app.record.lines import SECOND, Dates, Scribe
from app.record.run_file import HEAD, RunFile
from app.record.views.views import Views
from app.record.views.writer import ViewWriter
from app.record.worker import Worker
from app.setup import Setup
from app.state import Room, State
from app.tick import Follower, Inputs, Outputs, Tick, snapshot_of
from app.timing import Latest, date_now

log = logging.getLogger(__name__)
ROOM = 750  # ticks that may wait: three seconds of a disk that does not answer
LOOK = 1.0 / 30.0  # [s] between two looks at the simulated bodies
PICTURE = 1.0 / 15.0  # [s] between two pictures for other viewers
FLUSH = 0.5  # [s] that a sudden end may cost
TOO_SLOW = "the recording lacks ticks, this machine or its disk is too slow for it"
NO_TIMING = Timing({}, 0.0)
Seen = tuple[Inputs, Outputs, tuple[BodyPose, ...] | None]


class Engine(Runs, Protocol):
    """What is asked of an engine that is recorded."""

    snapshots: Latest[Snapshot]

    def post(self, action: Action) -> None: ...
    def follow(self, follower: Follower) -> None: ...
    def unfollow(self, follower: Follower) -> None: ...


@dataclass(frozen=True, slots=True)
class Progress:
    """How a recording stands: [bytes] in the file, [s] and ticks kept, ticks dropped, and why
    it has ended by itself, if it has."""

    path: Path
    bytes: int
    seconds: float
    ticks: int
    dropped: int
    fault: str


class Recorder:
    """A follower that writes `path`; RecordingError where that cannot be written.

    threaded: in a thread of its own, as beside an arm in real time; else in `put` itself.
    """

    def __init__(
        self, path: Path, head: Head, engine: Engine, threaded: bool = True, views: bool = True
    ) -> None:
        self._file = RunFile(path)
        self._head, self._engine, self._mind = head, engine, engine.brain
        self._scribe = Scribe()
        self._views = _views(self._file, engine) if views else None
        self._room = Room() if threaded else None
        self._begun = self._over = False
        self._look = -1.0  # [s] when somebody looks again
        self._ticks = self._dropped = 0
        self._fault = ""
        self._first = self._last = self._flushed = self._pictured = 0.0  # [s] of ticks
        self._dates = Dates()
        self._bodies: tuple[BodyPose, ...] = ()
        self._headed = False
        self._worker: Worker[Seen | tuple[int, State]] = Worker(
            self._write, ROOM, "flinch-recorder", threaded
        )

    @property
    def state(self) -> Progress:
        """How it stands; in any thread."""
        return Progress(
            self._file.path, self._file.size, self._last - self._first, self._ticks,
            self._dropped, self._fault,
        )  # fmt: skip

    # --- in the control thread ----------------------------------------------------------------

    def put(self, value: Tick) -> None:
        """Queue a tick; never raises, never waits for the disk."""
        if self._over or self._fault:
            return
        x, out = value
        if not self._begun:
            self._begun = True
            if x.tick > 0:  # this tick is over: what the brain knows now is how the next begins
                self._worker.put((x.tick + 1, self._mind.capture(self._room)))
                return
        bodies = None
        if not 0.0 <= self._look - x.now <= LOOK:
            self._look = x.now + LOOK
            snapshot, _ = self._engine.snapshots.get()
            bodies = snapshot.world if snapshot is not None else None
        if not self._worker.put((x, out, bodies)):
            if not self._dropped:
                self._engine.post(Remark(f"{TOO_SLOW}: {self._file.path}", refused=True))
            self._dropped += 1

    def close(self) -> None:
        """Write what waits, and the file's end; may be called twice."""
        if self._over:
            return
        self._over = True
        self._worker.close()
        if self._fault:
            return
        try:
            if not self._headed:
                self._begin(self._head)
            self._file.finish(self._ticks, self._dropped)
        except OSError as e:
            self._fail(f"{e.strerror}")

    # --- in the recorder's --------------------------------------------------------------------

    def _write(self, item: "Seen | tuple[int, State]") -> None:
        if self._fault:
            return
        try:
            if len(item) == 2:
                tick, state = item
                written = self._mind.written(state)
                self._begin(self._head.beginning(tick, written, date_now()))
            else:
                self._add(*item)
        except OSError as e:
            self._fail(f"{e.strerror}")
        except Exception as e:
            log.exception("the recording has ended")
            self._fail(str(e) if isinstance(e, FlinchError) else repr(e))

    def _begin(self, head: Head) -> None:
        self._headed = True
        self._head = head
        self._file.add(HEAD, round(head.began * SECOND), encode(head), head.first_tick)
        self._file.flush()

    def _add(self, x: Inputs, out: Outputs, bodies: tuple[BodyPose, ...] | None) -> None:
        at_ns = self._dates.of(x.now)
        if not self._headed:
            self._begin(self._head.beginning(x.tick, None, at_ns / SECOND))
        if self._ticks == 0:
            self._first = self._flushed = x.now
            self._pictured = x.now - PICTURE
        for line in self._scribe.lines(x, out, bodies):
            self._file.add(line.channel, at_ns, line.data, x.tick)
        self._bodies = self._bodies if bodies is None else bodies
        self._show(x, out, at_ns)
        self._ticks += 1
        self._last = x.now
        if x.now - self._flushed >= FLUSH:
            self._flushed = x.now
            self._file.flush()

    def _show(self, x: Inputs, out: Outputs, at_ns: int) -> None:
        """For other viewers, which are not read again."""
        if self._views is None:
            return
        full = x.now - self._pictured >= PICTURE
        if full:
            self._pictured = x.now
        self._views.write(snapshot_of(x, out, NO_TIMING, self._bodies), at_ns, full)

    def _fail(self, why: str) -> None:
        self._fault = f"the recording {self._file.path} has ended: {why}"
        self._file.abandon(why, self._ticks, self._dropped)
        self._engine.post(Remark(f"{self._fault}; what came before is kept", refused=True))


def _views(file: RunFile, engine: Engine) -> ViewWriter:
    mind = engine.brain
    return ViewWriter(file.writer, Views(mind.robot, mind.skin, mind.cell))


def start_recording(
    engine: Engine, setup: Setup, path: Path, threaded: bool = True, views: bool = True
) -> Recorder:
    """Record `engine`, which was built from `setup`, from its next tick on; in any thread.

    RecordingError where `path` exists or cannot be written. `stop_recording` ends it, or the
    engine's end.
    """
    recorder = Recorder(path, head_of(setup, engine), engine, threaded, views)
    engine.follow(recorder)
    return recorder


def stop_recording(engine: Engine, recorder: Recorder) -> Progress:
    """End it, and how it stands then."""
    engine.unfollow(recorder)
    recorder.close()
    return recorder.state
