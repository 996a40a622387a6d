"""What goes to and fro between a simulated skin and the process that measures for it."""

from math import ceil
from struct import Struct
from typing import NamedTuple

import numpy as np

from app.messages import Array, SensorFrame
from app.sensing.ring import Ring

ASKED = 32  # requests that may wait for an answer; with more the sensors wait
_REQUEST, _FRAME = Struct("<ddq"), Struct("<dqq")
_POSE = 16 * 8  # bytes
_READY = 8  # bytes before the rings: the first says whether the other process is ready


class Size(NamedTuple):
    """What goes to and fro: zones of each sensor, the fastest rate [Hz], links, latency [s]."""

    zones: tuple[int, ...]
    rate: float
    links: int
    latency: float

    @property
    def request(self) -> int:
        """Bytes of a request."""
        return _REQUEST.size + self.links * _POSE + len(self.zones)

    @property
    def frame(self) -> int:
        """Bytes of a frame; smaller ones are filled up."""
        return _FRAME.size + 10 * max(self.zones)

    @property
    def frames(self) -> int:
        """Frames that may be on their way: those within the latency, and two bursts of all."""
        return len(self.zones) * (ceil(self.rate * self.latency) + 2)


class Request(NamedTuple):
    """Who is to measure now, and where.

    now: [s].   time: [s] of the world.   edits: made of the world so far.   sensors: who is due.
    """

    now: float
    time: float
    edits: int
    sensors: list[int]
    T_base_link: Array  # (L, 4, 4)


class Traffic:
    """Requests one way and frames the other, in memory of `room` bytes that both sides see."""

    def __init__(self, memory: memoryview, size: Size) -> None:
        self._memory, self._size = memory, size
        split = _READY + Ring.room(size.request, ASKED)
        self.requests = Ring(memory[_READY:split], size.request, ASKED)
        self.frames = Ring(memory[split:], size.frame, size.frames)

    @staticmethod
    def room(size: Size) -> int:
        """Bytes of memory that all of it needs."""
        return _READY + Ring.room(size.request, ASKED) + Ring.room(size.frame, size.frames)

    @property
    def ready(self) -> bool:
        """Is the other process ready to measure?"""
        return self._memory[0] == 1

    def say_ready(self) -> None:
        """Say that this process is."""
        self._memory[0] = 1

    def put_request(self, request: Request) -> None:
        """Put a request."""
        now, time, edits, sensors, T_base_link = request
        due = bytearray(len(self._size.zones))
        for k in sensors:
            due[k] = 1
        self.requests.put(_REQUEST.pack(now, time, edits) + T_base_link.tobytes() + due)

    def next_request(self) -> Request | None:
        """The oldest request, left where it is until it is dropped; None without one."""
        record = self.requests.first()
        if record is None:
            return None
        now, time, edits = _REQUEST.unpack_from(record)
        links = self._size.links
        T = np.frombuffer(record, np.float64, 16 * links, _REQUEST.size)
        due = record[_REQUEST.size + links * _POSE :]
        sensors = [k for k, is_due in enumerate(due) if is_due]
        return Request(now, time, edits, sensors, T.reshape(links, 4, 4))

    def put_frame(self, frame: SensorFrame) -> None:
        """Put a frame."""
        head = _FRAME.pack(frame.stamp, frame.sequence, frame.sensor)
        body = frame.distance.tobytes() + frame.status.tobytes() + frame.targets.tobytes()
        self.frames.put((head + body).ljust(self._size.frame, b"\0"))

    def take_frame(self) -> SensorFrame | None:
        """The oldest frame, its arrays read-only; None without one."""
        record = self.frames.first()
        if record is None:
            return None
        self.frames.drop()
        stamp, sequence, sensor = _FRAME.unpack_from(record)
        at, n = _FRAME.size, self._size.zones[sensor]
        return SensorFrame(
            sensor=sensor,
            stamp=stamp,
            sequence=sequence,
            distance=np.frombuffer(record, np.float64, n, at),
            status=np.frombuffer(record, np.uint8, n, at + 8 * n),
            targets=np.frombuffer(record, np.uint8, n, at + 9 * n),
        )
