"""The file of a recording: MCAP, in pieces small enough that a sudden end costs half a second.

    profile 'flinch'; metadata 'flinch.run': format, and the fields of each kind of value
    flinch/head      once: `Head`
    flinch/inputs    every tick: `Inputs`
    flinch/witness   every tick: what came out of it, see `app.record.lines`
    flinch/look      once a body of the simulated world: (number, `BodyView`)
    flinch/bodies    about 30 times a second: ((number of its look, T_base_body), ...)
    flinch/mark      `Mark`
    flinch/gap       (tick, ticks that are missing before it)
    metadata 'flinch.end': why it ended, where it could be said

Beside them the topics of `app.record.views`, which nothing here reads again. Times are
nanoseconds since 1970; a message's sequence is the number of its tick.
"""

import contextlib
import json
import os
from pathlib import Path
from typing import Any

from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer, Metadata
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from app import __version__
from app.errors import RecordingError
from app.record.head import FORMAT
from app.record.kinds import NAMES
from app.record.witness import FIELDS

PROFILE, ABOUT, END = "flinch", "flinch.run", "flinch.end"
HEAD, INPUTS, WITNESS, LOOK, BODIES, MARK, GAP = range(1, 8)  # the channels' numbers
TOPICS = {
    HEAD: "flinch/head", INPUTS: "flinch/inputs", WITNESS: "flinch/witness", LOOK: "flinch/look",
    BODIES: "flinch/bodies", MARK: "flinch/mark", GAP: "flinch/gap",
}  # fmt: skip
CHUNK = 1 << 20  # [bytes] of a piece; half a second of thirty sensors is less


class RunFile:
    """A new file; RecordingError where there cannot be one. OSError later: `abandon` it then."""

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._stream = _Stream(path)
        except FileExistsError as e:
            raise RecordingError(f"{path}: exists already; give another name") from e
        except OSError as e:
            raise RecordingError(f"{path}: cannot be written ({e.strerror})") from e
        stream: Any = self._stream  # it is asked for no more than it has
        self.writer = Writer(stream, chunk_size=CHUNK, compression=CompressionType.ZSTD)
        try:
            self.writer.start(PROFILE, f"flinch {__version__}")
            about = {"kinds": json.dumps(NAMES), "outputs": ",".join(FIELDS)}
            self.writer.add_metadata(
                ABOUT, {"format": str(FORMAT), "flinch": __version__} | about
            )  # fmt: skip
            for number, topic in TOPICS.items():
                given = self.writer.register_channel(topic, "msgpack", 0)
                assert given == number
            self._stream.flush()
        except OSError as e:
            self._stream.close()
            path.unlink()
            raise RecordingError(f"{path}: cannot be written ({e.strerror})") from e

    @property
    def size(self) -> int:
        """[bytes] that are in the file."""
        return self._stream.safe

    def add(self, channel: int, at_ns: int, data: bytes, tick: int) -> None:
        """A message; kept in memory until `flush`, or until there are many."""
        self.writer.add_message(channel, at_ns, data, at_ns, tick & 0xFFFFFFFF)

    def flush(self) -> None:
        """What was added is safe from the end of this process."""
        self.writer.flush()  # type: ignore[no-untyped-call]

    def finish(self, ticks: int, dropped: int) -> None:
        """The end as it should be."""
        self.writer.add_metadata(END, _end("", ticks, dropped))
        self.writer.finish()  # type: ignore[no-untyped-call]
        self._stream.flush()
        self._stream.close()

    def abandon(self, why: str, ticks: int, dropped: int) -> None:
        """The end after an OSError: what was flushed stays, and the reason if there is room."""
        with contextlib.suppress(OSError):
            self._stream.forget()
            end = RecordBuilder()
            Metadata(END, _end(why, ticks, dropped)).write(end)
            DataEnd(0).write(end)
            Footer(0, 0, 0).write(end)  # valid without a summary
            self._stream.write(end.end() + MCAP0_MAGIC)  # type: ignore[no-untyped-call]
            self._stream.flush()
        self._stream.close()


def _end(why: str, ticks: int, dropped: int) -> dict[str, str]:
    return {"why": why, "ticks": str(ticks), "dropped": str(dropped)}


class _Stream:
    """What mcap writes to: nothing reaches the disk but whole pieces, at `flush`."""

    def __init__(self, path: Path) -> None:
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL
        self._file = os.open(path, flags, 0o644)
        self._pending = bytearray()
        self.safe = 0  # [bytes] that are whole in the file

    def write(self, data: bytes) -> int:
        self._pending += data
        return len(data)

    def tell(self) -> int:
        return self.safe + len(self._pending)

    def flush(self) -> None:
        left = memoryview(bytes(self._pending))
        while left:
            left = left[os.write(self._file, left) :]
        self.safe += len(self._pending)
        self._pending.clear()

    def forget(self) -> None:
        """Drop what is not whole in the file."""
        self._pending.clear()
        os.ftruncate(self._file, self.safe)
        os.lseek(self._file, self.safe, os.SEEK_SET)

    def close(self) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1
