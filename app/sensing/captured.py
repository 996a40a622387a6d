"""A skin's captured bytes, played through the decoders of a live one.

The same reads at the same times go into the same `Stream` and the same `SerialSkin`, so that what
a port said wrong, late or in another format is seen again as it was. The file is read as it is
played: an hour of it takes no more room than a second.
"""

from collections.abc import Generator, Mapping
from dataclasses import dataclass, replace
from math import inf
from pathlib import Path
from typing import Protocol

import msgspec
import numpy as np
from mcap.records import Channel, Header, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader

from app.errors import SensorError
from app.messages import SensorFrame
from app.robot.posture import Posture
from app.robot.skin import Skin
from app.sensing.capture import PROFILE, VERSION
from app.sensing.port import PortFacts, Tap
from app.sensing.port_spec import PortSpec, named_sensors, parse_ports
from app.sensing.serial_skin import SerialSkin
from app.sensing.stream import Arrival, Stream
from app.text_file import check_file

MAGIC = b"\x89MCAP0\r\n"
LARGEST = 1 << 26  # [bytes] of a record; a larger one is a torn length


@dataclass(frozen=True, slots=True)
class Capture:
    """A file and its ports, as `serial:` takes them."""

    path: Path
    entries: tuple[str, ...]

    @property
    def single(self) -> bool:
        """Is it of one port?"""
        return len(self.entries) == 1

    def specs(self, skin: Skin, sensors: str = "") -> tuple[PortSpec, ...]:
        """What its ports may speak for; `sensors` of this name instead of what was recorded."""
        specs = parse_ports(",".join(self.entries), skin)
        if not sensors:
            return specs
        if not self.single:
            raise SensorError(f"{self.path}: holds {len(specs)} ports; leave @{sensors} out")
        return (replace(specs[0], sensors=named_sensors(sensors, skin)),)


def is_capture(path: Path) -> bool:
    """Is it a file of this kind? False of one that cannot be read."""
    records = _records(path)
    try:
        first = next(records, None)
    except SensorError:
        return False
    finally:
        records.close()
    return isinstance(first, Header) and first.profile == PROFILE


def read_capture(path: Path) -> Capture:
    """The head of a file; the error says what it is not."""
    for record in _records(path):
        if isinstance(record, Header) and record.profile != PROFILE:
            break
        if isinstance(record, Metadata) and record.name == PROFILE:
            if record.metadata.get("version") != VERSION:
                raise SensorError(f"{path}: is of another version of Flinch; record it anew")
            try:
                entries = msgspec.json.decode(record.metadata.get("ports", ""), type=list[str])
            except msgspec.DecodeError:
                break
            return Capture(path, tuple(entries))
    raise SensorError(f"{path}: is no recording of a skin; give one of flinch record-skin")


class CapturedSkin(SerialSkin):
    """Plays a capture once, from the first poll on."""

    def __init__(self, capture: Capture, skin: Skin, specs: tuple[PortSpec, ...]) -> None:
        self._heard_ports = [HeardPort(spec) for spec in specs]
        super().__init__(skin, self._heard_ports, specs)
        self.name = f"replay of {capture.path.name}"
        self._tape = Tape(capture.path, {p.name: p for p in self._heard_ports})

    def poll(self, now: float, posture: Posture) -> list[SensorFrame]:
        """Frames of the bytes whose time has come."""
        self._tape.play(now)
        return super().poll(now, posture)

    @property
    def due(self) -> float:
        """[s] on the clock that polls, when the next bytes come; -inf before the first poll."""
        return self._tape.due

    def ended(self) -> str:
        """Says so when the last byte has been played, and why there are no more if it is torn."""
        if not self._tape.over:
            return ""
        torn = f": {self._tape.torn}" if self._tape.torn else ""
        return f"the {self.name} has ended{torn}"

    def close(self) -> None:
        super().close()
        self._tape.close()


class HeardPort:
    """A port whose bytes are put in by hand."""

    def __init__(self, spec: PortSpec) -> None:
        self.name = spec.port
        self.tap: Tap | None = None
        self._spec = spec
        self._number = -1
        self._stream = Stream(spec.format, spec.grids, spec.baud)
        self._heard = self._spoke = -np.inf
        self._taken: list[Arrival] = []

    def hear(self, stream: int, baud: int, chunk: bytes, now: float) -> None:
        """What one read gave at `now` [s], of another stream or of the last one."""
        if stream != self._number:
            self._number = stream
            self._stream = Stream(self._spec.format, self._spec.grids, baud)
        if self.tap is not None:
            self.tap(self.name, self._stream, chunk, now)
        self._heard = now
        arrivals = self._stream.feed(chunk, now)
        if arrivals:
            self._spoke = now
            self._taken += arrivals

    def receive(self) -> list[Arrival]:
        taken, self._taken = self._taken, []
        return taken

    def facts(self) -> PortFacts:
        s = self._stream
        return PortFacts(
            True, s.format, self._heard, self._spoke, s.frames, s.damaged, s.lost, s.drift, "",
            restarts=s.restarts, baud=s.baud, trouble=s.trouble, rate=s.rate, clock=s.clock,
        )  # fmt: skip

    def close(self) -> None:
        """Nothing is held."""


class Ear(Protocol):
    """Who is told what a port said: in which stream, at which speed, and when [s]."""

    def hear(self, stream: int, baud: int, chunk: bytes, now: float) -> None: ...


class Tape:
    """Hands a file's messages to its ports when their time has come; `over` after the last."""

    def __init__(self, path: Path, ports: Mapping[str, Ear]) -> None:
        """ports: by their names in the file."""
        self.torn, self.over = "", False
        self.due = -np.inf
        self._ports = ports
        self._channels: dict[int, Channel] = {}
        self._records = _records(path)
        self._zero: float | None = None  # [s] on the runtime's clock, of the first message
        self._first = 0
        self._next = self._read()

    def play(self, now: float) -> None:
        """All messages up to `now` [s]."""
        if self._zero is None:
            self._zero = now
            self._first = self._next.log_time if self._next else 0
        while self._next is not None:
            self.due = self._zero + (self._next.log_time - self._first) * 1e-9
            if self.due > now + 1e-9:
                return
            channel = self._channels[self._next.channel_id]
            baud = channel.metadata.get("baud", "")
            number = int(baud) if baud.isascii() and baud.isdecimal() and len(baud) < 10 else 0
            self._ports[channel.topic].hear(channel.id, number, self._next.data, self.due)
            self._next = self._read()
        self.over = True

    def close(self) -> None:
        self._records.close()

    def _read(self) -> Message | None:
        try:
            for record in self._records:
                if isinstance(record, Channel) and record.topic in self._ports:
                    self._channels[record.id] = record
                elif isinstance(record, Message) and record.channel_id in self._channels:
                    return record
        except SensorError as e:
            self.torn = str(e)
        return None


def _records(path: Path) -> Generator[McapRecord]:
    """Records in their order; a SensorError where the file is torn."""
    check_file(path, SensorError, inf)
    try:
        with path.open("rb") as file:
            yield from StreamReader(file, record_size_limit=LARGEST).records
    except OSError as e:
        raise SensorError(f"{path}: cannot be read ({e.strerror}); give a recording") from e
    except Exception as e:  # what a torn file makes of its reader has many names
        raise SensorError(f"{path}: is torn here ({type(e).__name__})") from e
