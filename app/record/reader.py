"""A recording's file, read: by number of tick, whole or as far as it goes.

Opening looks at the records' heads and at the messages' places; a piece is unpacked when one of
its ticks is asked for. A file that ends in the middle of a record is read up to there.
"""

import json
import struct
import zlib
from array import array
from bisect import bisect_left, bisect_right
from collections import OrderedDict
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from math import inf
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
from mcap.exceptions import McapError
from mcap.records import Channel, Chunk, Footer, Header, Message, MessageIndex, Metadata
from mcap.stream_reader import StreamReader, breakup_chunk, get_chunk_data_stream
from zstandard import ZstdError

from app.errors import RecordingError
from app.messages import Array, BodyPose, BodyView
from app.record.codec import Decoder
from app.record.head import FORMAT, Head
from app.record.lines import WitnessReader
from app.record.marks import Mark
from app.record.run_file import (
    ABOUT,
    BODIES,
    END,
    GAP,
    HEAD,
    INPUTS,
    LOOK,
    MARK,
    PROFILE,
    TOPICS,
    WITNESS,
)
from app.record.witness import Witness
from app.text_file import check_file
from app.tick import Inputs

OPEN_PIECES = 8  # unpacked pieces that are kept
LARGEST = 1 << 28  # [bytes] of an unpacked piece; beyond it is no recording but a trap
MESSAGE_HEAD = struct.Struct("<BQHIQQ")  # opcode, length, channel, sequence, log, publish
BROKEN = (McapError, ZstdError, struct.error, ValueError, EOFError, MemoryError, OverflowError)


class Piece(NamedTuple):
    """Where a chunk of the file lies, and all that unpacking it needs."""

    start: int
    chunk: Chunk  # without its data
    length: int


@dataclass
class Places:
    """Of one channel's messages: [ns] time, which piece, where in it."""

    at: "array[int]" = field(default_factory=lambda: array("q"))
    piece: "array[int]" = field(default_factory=lambda: array("q"))
    offset: "array[int]" = field(default_factory=lambda: array("q"))

    def __len__(self) -> int:
        return len(self.at)

    def cut(self, count: int) -> None:
        for column in (self.at, self.piece, self.offset):
            del column[count:]


class FileRecording:
    """A file that was opened; see `app.record.recording.Recording`. For one thread."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._pieces: list[Piece] = []
        self._places = {number: Places() for number in TOPICS}
        self._open: OrderedDict[int, bytes] = OrderedDict()
        self._looks: dict[int, BodyView] = {}
        self._about: dict[str, str] = {}
        self._end: dict[str, str] | None = None
        check_file(path, RecordingError, inf)
        try:
            self._file: BinaryIO = path.open("rb")
        except OSError as e:
            raise RecordingError(f"{path}: cannot be read ({e.strerror}); give another file") from e
        try:
            self._cut = self._scan()
            self._decoder, self._witnesses = self._reading()
            self.head = self._read_head()
        except BaseException:
            self._file.close()
            raise
        self._count = min(len(self._places[INPUTS]), len(self._places[WITNESS]))
        self.torn = self._torn()

    def __len__(self) -> int:
        return self._count

    def __enter__(self) -> "FileRecording":
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def close(self) -> None:
        """Give the file back."""
        self._file.close()

    @cached_property
    def times(self) -> Array:
        """(N,) [s] on the run's clock, to the nanosecond; `Inputs.now` has the last bits."""
        if not self._count:
            return np.empty(0)
        at = np.array(self._places[INPUTS].at[: self._count])
        return np.asarray(self.inputs(0).now + (at - at[0]) * 1e-9)

    @cached_property
    def marks(self) -> tuple[Mark, ...]:
        """All of them, in their order."""
        count = len(self._places[MARK])
        return tuple(self._decoder.decode(self._data(MARK, i), Mark) for i in range(count))

    @cached_property
    def dropped(self) -> int:
        """Ticks that are missing in between."""
        count = len(self._places[GAP])
        return sum(self._decoder.decode(self._data(GAP, i), tuple)[1] for i in range(count))

    def inputs(self, i: int) -> Inputs:
        """What entered tick i."""
        return self._decoder.decode(self._data(INPUTS, self._index(i)), Inputs)

    def witness(self, i: int) -> Witness:
        """Of what came out of tick i."""
        return self._witnesses(self._data(WITNESS, self._index(i)))

    def bodies(self, i: int) -> tuple[BodyPose, ...]:
        """The simulated bodies as they were last seen by tick i, or were seen first."""
        at = self._places[INPUTS].at[self._index(i)]
        if not len(self._places[BODIES]):
            return ()
        last = max(bisect_right(self._places[BODIES].at, at) - 1, 0)
        placed = self._decoder.decode(self._data(BODIES, last), tuple)
        try:
            return tuple(BodyPose(self._views[number], T) for number, T in placed)
        except (KeyError, TypeError, ValueError) as e:
            raise self._damaged(f"bodies without a look ({e})") from e

    @cached_property
    def _views(self) -> dict[int, BodyView]:
        looks = (self._decoder.decode(self._data(LOOK, i), tuple)
                 for i in range(len(self._places[LOOK])))  # fmt: skip
        return {number: view for number, view in looks}

    def _index(self, i: int) -> int:
        if not -self._count <= i < self._count:
            raise IndexError(f"tick {i} of {self._count}")
        return i % self._count

    # --- opening ------------------------------------------------------------------------------

    def _scan(self) -> bool:
        """Find every message; is the file cut off?"""
        size = self._path.stat().st_size
        whole, began = False, False
        try:
            for record in StreamReader(
                self._file, emit_chunks=True, record_size_limit=size
            ).records:
                if not began and not (isinstance(record, Header) and record.profile == PROFILE):
                    raise self._foreign()
                began = True
                self._take(record)
                whole = isinstance(record, Footer)
        except BROKEN as e:
            if not began:
                raise self._foreign() from e
            whole = False
        if not whole:
            self._mend()
        return not whole

    def _take(self, record: object) -> None:
        if isinstance(record, Chunk):
            length = len(record.data)
            start = self._file.tell() - length
            record.data = b""
            self._pieces.append(Piece(start, record, length))
        elif isinstance(record, MessageIndex) and record.channel_id in self._places:
            self._note(record.channel_id, record.records)
        elif isinstance(record, Metadata) and record.name == ABOUT:
            self._about = dict(record.metadata)
        elif isinstance(record, Metadata) and record.name == END:
            self._end = dict(record.metadata)

    def _note(self, channel: int, messages: Sequence[tuple[int, int]]) -> None:
        places = self._places[channel]
        for at, offset in messages:
            places.at.append(at)
            places.piece.append(len(self._pieces) - 1)
            places.offset.append(offset)

    def _mend(self) -> None:
        """The last piece may be cut off, or have no index: look through it."""
        if not self._pieces:
            return
        last = len(self._pieces) - 1
        for places in self._places.values():
            places.cut(bisect_left(places.piece, last))
        try:
            content = self._unpacked(last)
        except RecordingError:
            self._pieces.pop()
            return
        for channel, at, offset in _messages(content):
            if channel in self._places:
                self._note(channel, [(at, offset)])

    def _reading(self) -> tuple[Decoder, WitnessReader]:
        if self._cut and not self._about:
            raise RecordingError(f"{self._path}: was cut off before its first tick")
        if self._about.get("format") != str(FORMAT):
            raise RecordingError(
                f"{self._path}: a recording in format {self._about.get('format', 'unknown')} by "
                f"Flinch {self._about.get('flinch', 'unknown')}; this one reads format {FORMAT}"
            )
        try:
            kinds = json.loads(self._about["kinds"])
            names = {str(kind): [str(n) for n in fields] for kind, fields in kinds.items()}
            return Decoder(names), WitnessReader(self._about["outputs"].split(","))
        except (KeyError, ValueError, AttributeError, TypeError) as e:
            raise self._damaged(f"it does not tell its fields ({e})") from e

    def _read_head(self) -> Head:
        if not len(self._places[HEAD]):
            raise RecordingError(
                f"{self._path}: was cut off before its first tick; nothing is left"
            )
        for channel, topic in self._channels():
            if TOPICS.get(channel, topic) != topic:
                raise self._damaged(f"{topic} is channel {channel}")
        try:
            return self._decoder.decode(self._data(HEAD, 0), Head)
        except RecordingError as e:
            raise RecordingError(f"{self._path}: {e}") from e

    def _channels(self) -> Iterator[tuple[int, str]]:
        piece = self._pieces[0]
        chunk = Chunk(**vars(piece.chunk) | {"data": self._packed(piece)})
        try:
            for record in breakup_chunk(chunk):
                if isinstance(record, Channel):
                    yield record.id, record.topic
                elif isinstance(record, Message):
                    return
        except BROKEN as e:
            raise self._damaged(f"{e}") from e

    def _torn(self) -> str:
        if self._end is not None and self._end.get("why"):
            return f"the recording ended by itself: {self._end['why']}"
        if self._end is not None and not self._cut:
            return ""
        seconds = self.times[-1] - self.times[0] if self._count else 0.0
        return f"cut off: it ends after {seconds:.1f} s without an end"

    # --- reading ------------------------------------------------------------------------------

    def _data(self, channel: int, i: int) -> bytes:
        """The message i of a channel."""
        places = self._places[channel]
        content, offset = self._unpacked(places.piece[i]), places.offset[i]
        try:
            _, length, found, *_ = MESSAGE_HEAD.unpack_from(content, offset)
        except struct.error as e:
            raise self._damaged(f"{e}") from e
        end = offset + 9 + length
        if found != channel or end > len(content):
            raise self._damaged(f"{TOPICS[channel]} is not where it should be")
        return content[offset + MESSAGE_HEAD.size : end]

    def _unpacked(self, number: int) -> bytes:
        """The content of a piece."""
        content = self._open.get(number)
        if content is not None:
            self._open.move_to_end(number)
            return content
        piece = self._pieces[number]
        if piece.chunk.uncompressed_size > LARGEST:
            raise self._damaged(f"a piece of {piece.chunk.uncompressed_size} bytes")
        chunk = Chunk(**vars(piece.chunk) | {"data": self._packed(piece)})
        try:
            stream, length = get_chunk_data_stream(chunk)
            content = stream.read(length)
        except BROKEN as e:
            raise self._damaged(f"{e}") from e
        if chunk.uncompressed_crc and zlib.crc32(content) != chunk.uncompressed_crc:
            raise self._damaged("a piece is not what was written")
        self._open[number] = content
        if len(self._open) > OPEN_PIECES:
            self._open.popitem(last=False)
        return content

    def _packed(self, piece: Piece) -> bytes:
        self._file.seek(piece.start)
        return self._file.read(piece.length)

    def _damaged(self, how: str) -> RecordingError:
        return RecordingError(f"{self._path}: the recording is damaged: {how}")

    def _foreign(self) -> RecordingError:
        return RecordingError(
            f"{self._path}: no recording of a run; `flinch run --record` makes one"
        )


def open_recording(path: Path) -> FileRecording:
    """A recording that `flinch run --record` or the page has made.

    RecordingError in one line where it is none, or one of another version that is not understood.
    """
    return FileRecording(path)


def _messages(content: bytes) -> Iterator[tuple[int, int, int]]:
    """Channel, [ns] time and place of each message of a piece."""
    offset = 0
    while offset + 9 <= len(content):
        opcode, length = struct.unpack_from("<BQ", content, offset)
        if opcode == 5 and offset + MESSAGE_HEAD.size <= len(content):
            _, _, channel, _, at, _ = MESSAGE_HEAD.unpack_from(content, offset)
            yield channel, at, offset
        offset += 9 + length
