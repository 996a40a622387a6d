"""What goes to and fro between a simulated skin and the process that measures for it."""

from math import ceil
from struct import Struct
from typing import NamedTuple

import numpy as np

from app.messages import SLOTS, Array, SensorFrame
from app.sensing.ring import Ring
from app.sensing.schedule import RATE

ASKED = 32  # requests that may wait for an answer; with more the sensors wait
_REQUEST, _FRAME = Struct("<ddq"), Struct("<dqq")
_POSE = 16 * 8  # bytes
_READY = 8  # bytes before the rings: the first says whether the other process is ready


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

    def __init__(self, memory: memoryview, sensors: int, links: int, latency: float) -> None:
        self._memory, self._sensors, self._links = memory, sensors, links
        request, frames = _REQUEST.size + links * _POSE + sensors, _frames(sensors, latency)
        split = _READY + Ring.room(request, ASKED)
        self.requests = Ring(memory[_READY:split], request, ASKED)
        self.frames = Ring(memory[split:], _FRAME.size + 10 * SLOTS, frames)

    @staticmethod
    def room(sensors: int, links: int, latency: float) -> int:
        """Bytes of memory that all of it needs."""
        requests = Ring.room(_REQUEST.size + links * _POSE + sensors, ASKED)
        return _READY + requests + Ring.room(_FRAME.size + 10 * SLOTS, _frames(sensors, latency))

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
        due = bytearray(self._sensors)
        for k in sensors:
            due[k] = 1
        self.requests.put(_REQUEST.pack(now, time, edits) + T_base_link.tobytes() + due)

    def next_request(self) -> Request | None:
        """The oldest request, left where it is until it is dropped; None without one."""
        record = self.requests.first()
        if record is None:
            return None
        now, time, edits = _REQUEST.unpack_from(record)
        T = np.frombuffer(record, np.float64, 16 * self._links, _REQUEST.size)
        due = record[_REQUEST.size + self._links * _POSE :]
        sensors = [k for k, is_due in enumerate(due) if is_due]
        return Request(now, time, edits, sensors, T.reshape(self._links, 4, 4))

    def put_frame(self, frame: SensorFrame) -> None:
        """Put a frame."""
        head = _FRAME.pack(frame.stamp, frame.sequence, frame.sensor)
        body = frame.distance.tobytes() + frame.status.tobytes() + frame.targets.tobytes()
        self.frames.put(head + body)

    def take_frame(self) -> SensorFrame | None:
        """The oldest frame, its arrays read-only; None without one."""
        record = self.frames.first()
        if record is None:
            return None
        self.frames.drop()
        stamp, sequence, sensor = _FRAME.unpack_from(record)
        at = _FRAME.size
        return SensorFrame(
            sensor=sensor,
            stamp=stamp,
            sequence=sequence,
            distance=np.frombuffer(record, np.float64, SLOTS, at),
            status=np.frombuffer(record, np.uint8, SLOTS, at + 8 * SLOTS),
            targets=np.frombuffer(record, np.uint8, SLOTS, at + 9 * SLOTS),
        )


def _frames(sensors: int, latency: float) -> int:
    """Frames that may be on their way: those within the latency, and two bursts of all sensors."""
    return sensors * (ceil(RATE * latency) + 2)
