"""A skin's bytes as they came, with their times, in a file: what `flinch record-skin` writes.

The file is an MCAP container, profile `flinch.skin`. Its metadata, first in it, names the ports
as `serial:` does. A channel is a stream from its first byte on, so that a port that is plugged
again, or is tried at another speed, begins another one; a message is what one read gave, its time
when it came. All of it goes to the disk as it comes: a file of a program that was killed can be
read up to its last second.
"""

from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

import msgspec
from mcap.writer import Writer

from app.errors import SensorError
from app.sensing.stream import Stream
from app.timing import Clock, date_now

PROFILE = "flinch.skin"
VERSION = "1"
FLUSH = 0.5  # [s] after which what came is given to the disk


class CaptureWriter:
    """Writes one file; `put` is a port's tap. Raises `SensorError` where it cannot."""

    def __init__(self, path: Path, entries: Sequence[str], clock: Clock) -> None:
        """entries: one a port, as `serial:` takes them."""
        self.path, self.bytes = path, 0
        self._clock, self._began = clock, clock.now()
        self._date = round(date_now() * 1e9)
        self._channels: dict[Stream, int] = {}
        self._flushed = self._began
        try:
            self._file = path.open("xb")
        except FileExistsError:
            raise SensorError(f"{path}: is there already; give another name") from None
        except OSError as e:
            raise self._unable(e) from e
        self._writer = Writer(self._file, use_chunking=False)
        self._writer.start(profile=PROFILE, library="flinch")
        ports = msgspec.json.encode(list(entries)).decode()
        self._writer.add_metadata(PROFILE, {"version": VERSION, "ports": ports})

    def put(self, port: str, stream: Stream, chunk: bytes, now: float) -> None:
        """What one read of a port gave at `now` [s]."""
        at_ns = self._date + round((now - self._began) * 1e9)
        if stream not in self._channels:
            facts = {"baud": str(stream.baud)}
            self._channels[stream] = self._writer.register_channel(port, "", 0, facts)
        self.bytes += len(chunk)
        try:
            self._writer.add_message(self._channels[stream], at_ns, chunk, at_ns)
            if now - self._flushed >= FLUSH:
                self._flushed = now
                self._file.flush()
        except OSError as e:
            raise self._unable(e) from e

    def close(self) -> None:
        """Finish the file; one that cannot be finished is readable as far as it goes."""
        with suppress(OSError):
            self._writer.finish()  # type: ignore[no-untyped-call]
        with suppress(OSError):
            self._file.close()

    def _unable(self, e: OSError) -> SensorError:
        return SensorError(
            f"{self.path}: cannot be written ({e.strerror}); make room, or give another place"
        )
