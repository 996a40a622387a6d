"""What one port says: bytes into stamped frames, and figures of how well it goes. No device."""

from collections.abc import Sequence
from dataclasses import dataclass

from app.sensing.device_clock import DeviceClock
from app.sensing.rate import Rate
from app.sensing.wire.detect import Detector
from app.sensing.wire.raw import USUAL, Grid, RawFrame

TURN = 1 << 16  # sequences count modulo this
BEHIND = 0x8000  # a step this large is a step back


@dataclass(frozen=True, eq=False, slots=True)
class Arrival:
    """A frame, its board's stamp, or its arrival where it has none, and when its last byte came
    [s, host's clock].

    size: [bytes] that a frame of this stream takes on the line, mean.
    """

    frame: RawFrame
    stamp: float
    arrived: float
    size: float = 0.0


class Stream:
    """One board's stream from its first byte on; another board needs another one.

    grids:        of the sensors that may speak, for formats that do not tell theirs.
    baud:         the speed at which its bytes are read, 0 where that means nothing.
    frames, lost: whole frames, and those that a gap in a sensor's sequence tells of.
    restarts:     how often the board's clock began anew.
    """

    def __init__(self, format_name: str = "", grids: Sequence[Grid] = USUAL, baud: int = 0) -> None:
        self.baud = baud
        self.frames = self.lost = 0
        self._detector = Detector(format_name, grids)
        self._clock = DeviceClock()
        self._sequence: dict[int, int] = {}
        self._rate = Rate()
        self.restarts = 0
        self._heard = 0  # bytes since the first frame ended, or since the stream began

    @property
    def format(self) -> str:
        """The format that speaks, empty until it is known."""
        return self._detector.name

    @property
    def damaged(self) -> int:
        """How often something came that was no whole frame."""
        return self._detector.refused.total()

    @property
    def trouble(self) -> str:
        """Why what comes cannot be right as it is read, or cannot be read; empty while it can."""
        return self._rate.trouble or self._detector.trouble

    @property
    def clock(self) -> str:
        """Why the board's stamps are not believed, so that its frames are not given."""
        return self._clock.trouble

    @property
    def rate(self) -> float:
        """[Hz] of frames, of a format that names no sensor, lately; 0 while it is not known."""
        return self._rate.hz

    @property
    def drift(self) -> float:
        """How much slower the board's clock runs than the host's."""
        return self._clock.drift

    def feed(self, chunk: bytes, now: float) -> list[Arrival]:
        """Frames complete with `chunk`, which has come at `now` [s]."""
        arrivals = []
        self._heard += len(chunk)
        for frame in self._detector.feed(chunk):
            stamp = now if frame.t_us is None else self._clock.stamp(frame.t_us, now)
            if self._clock.restarts > self.restarts:
                self.restarts = self._clock.restarts
                self._sequence.clear()
            self._count(frame)
            if frame.t_us is None and self._rate.count(frame, now):
                continue
            if self._clock.trouble and frame.t_us is not None:
                continue  # nobody knows how old it is
            arrivals.append(Arrival(frame, stamp, now, self._heard / max(self.frames - 1, 1)))
            if self.frames == 1:
                self._heard = 0
        return arrivals

    def _count(self, frame: RawFrame) -> None:
        self.frames += 1
        if frame.sensor is None or frame.sequence is None:
            return
        last = self._sequence.get(frame.sensor)
        step = 1 if last is None else (frame.sequence - last) % TURN
        if 0 < step < BEHIND:
            self.lost += step - 1
            self._sequence[frame.sensor] = frame.sequence
        elif step and self.lost:
            self.lost -= 1  # it was not lost, it came late
