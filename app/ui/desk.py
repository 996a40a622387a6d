"""The recordings of a running arm, as a page asks for them: begin, end, keep the last half minute.

Where they go is the starter's choice, and each is named by its time and, after a stop, by its
reason: a page has no say in a file's name. What is asked here waits for the disk, so it is not
asked on the thread of the sockets.
"""

import re
import threading
import unicodedata
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

from app.errors import FlinchError, RecordingError
from app.record.recorder import Engine, Progress, Recorder, start_recording, stop_recording
from app.record.ring import Ring
from app.setup import Setup
from app.timing import date_now

LONGEST = 60  # letters of a reason in a file's name
TRIES = 100  # names of one second


class Kept(NamedTuple):
    """A file that is finished: where, and of how many seconds."""

    path: Path
    seconds: float


class Desk:
    """One recording at a time, and the ring. Any thread may ask."""

    def __init__(
        self,
        engine: Engine,
        setup: Setup,
        folder: Path,
        ring: Ring,
        recorder: Recorder | None = None,
    ) -> None:
        """recorder: one that runs already."""
        self.folder = folder
        self.kept: Kept | None = None  # the last that was finished
        self.fault = ""  # why the last wish was not fulfilled; empty if it was
        self._engine, self._setup, self._ring = engine, setup, ring
        self._recorder = recorder
        self._lock = threading.Lock()

    @property
    def scene(self) -> str:
        """Name or path of the scene of this run."""
        return self._setup.scene

    @property
    def progress(self) -> Progress | None:
        """Of the recording that runs, or of one that has ended by itself; None without one."""
        recorder = self._recorder
        return recorder.state if recorder is not None else None

    @property
    def held(self) -> float:
        """[s] that `save_last` would keep now."""
        return self._ring.held

    def begin(self) -> None:
        """Record from the next tick on; nothing if it records already."""
        with self._lock:
            if self._recorder is not None and not self._recorder.state.fault:
                return
            self._end()
            self.fault = ""
            try:
                path = self._new_file()
                self._recorder = start_recording(self._engine, self._setup, path)
            except FlinchError as error:
                self.fault = str(error)

    def end(self) -> None:
        """End the recording that runs, if one does."""
        with self._lock:
            self.fault = ""
            self._end()

    def save_last(self, reason: str = "") -> None:
        """Keep what the ring holds; `reason`: of the stop that is looked into, for the name."""
        with self._lock:
            self.fault = ""
            try:
                path = self._new_file(reason or "asked for")
                self.kept = Kept(path, self._ring.save(path))
            except FlinchError as error:
                self.fault = str(error)

    def _end(self) -> None:
        recorder, self._recorder = self._recorder, None
        if recorder is not None:
            progress = stop_recording(self._engine, recorder)
            self.kept = Kept(progress.path, progress.seconds)

    def _new_file(self, reason: str = "") -> Path:
        """A name that is free, in the folder, which is made if it is missing."""
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
        except OSError as e:
            raise RecordingError(
                f"{self.folder}: cannot be made ({e.strerror}); start with --recordings DIR"
            ) from e
        stem = file_stem(date_now(), reason)
        for k in range(TRIES):
            path = self.folder / f"{stem}{f'_{k + 1}' if k else ''}.mcap"
            if not path.exists():
                return path
        raise RecordingError(f"{self.folder}: {stem}.mcap is there already; wait a second")


def file_stem(date: float, reason: str = "") -> str:
    """`2026-11-27_09-32-10Z`, and the reason in letters that every file system takes."""
    when = datetime.fromtimestamp(date, UTC).strftime("%Y-%m-%d_%H-%M-%SZ")
    plain = unicodedata.normalize("NFKD", reason).encode("ascii", "ignore").decode("ascii")
    words = re.sub(r"[^a-z0-9]+", "-", plain.lower()).strip("-")[:LONGEST].strip("-")
    return f"{when}_{words}" if words else when
