"""One reader thread a port. It opens, reads, and after an unplugging waits for the port again.

The reader stamps bytes and puts them down; they are decoded by whoever takes them. A thread that
wakes up 450 times a second finds cold caches, and decoding there cost it three times as much.
RTS and DTR are left as the system holds them: a pulse on them resets many boards.
"""

import errno
import logging
import os
import termios
import threading
import time
from collections import deque
from collections.abc import Callable
from dataclasses import dataclass

import serial

from app.errors import SensorError
from app.sensing.line import SOCKET, reader_of
from app.sensing.port_spec import PortSpec
from app.sensing.stream import Arrival, Stream
from app.sensing.wire.detect import format_of
from app.timing import Clock

log = logging.getLogger(__name__)
RETRY = 0.2  # [s] between attempts to open a port that is gone
TRIAL = 1.5  # [s] of bytes without a whole frame before the next speed is tried
BAUDS = (2_000_000, 115_200, 460_800, 921_600)  # tried in this order where none is given
MAILBOX = 4096  # reads that may wait to be taken, about nine seconds of a whole skin

Tap = Callable[[str, Stream, bytes, float], None]  # port, its stream, bytes, when they came [s]


@dataclass(frozen=True, slots=True)
class PortFacts:
    """What is known of a port at one moment.

    open:   it can be read.   heard: when the last bytes came [s], -inf before any.
    spoke:  when the last whole frame came [s], likewise.
    frames, damaged, lost: counted since it was opened.
    drift:  of the board's clock.   restarts: how often it began anew.
    error:  why it is not open, or why its reader has died.
    busy:   processor time of the reader [s].
    baud:   the speed at which it is read.
    trouble: why what comes is not taken, or not understood.   rate: of its frames [Hz], 0 unknown.
    clock:  why the board's stamps are not believed.
    """

    open: bool
    format: str
    heard: float
    spoke: float
    frames: int
    damaged: int
    lost: int
    drift: float
    error: str
    busy: float = 0.0
    restarts: int = 0
    baud: int = 0
    trouble: str = ""
    rate: float = 0.0
    clock: str = ""


class Port:
    """Reads a port until `close`; raises `SensorError` where it cannot be opened at first."""

    def __init__(self, spec: PortSpec, clock: Clock) -> None:
        self.name = spec.port
        self.tap: Tap | None = None  # is told of all that is taken
        self._spec, self._clock = spec, clock
        self._mailbox: deque[tuple[Stream, bytes, float]] = deque(maxlen=MAILBOX)
        self._bauds = (spec.baud,) if spec.baud else _likely(spec.format)
        if self.name.startswith(SOCKET):  # the speed is the other side's
            self._bauds = self._bauds[:1]
        self._baud = 0
        self._stream = self._new_stream()
        self._open = True
        self._error = ""
        self._heard = self._spoke = float("-inf")
        self._busy = 0.0
        self._quit = threading.Event()
        device = self._connect()
        self._thread = threading.Thread(
            target=self._run, args=(device,), name=f"flinch-port {self.name}", daemon=True
        )
        self._thread.start()

    def receive(self) -> list[Arrival]:
        """Frames that have come since the last call, in their order."""
        taken: list[Arrival] = []
        while self._mailbox:
            stream, chunk, now = self._mailbox.popleft()
            if self.tap is not None:
                self.tap(self.name, stream, chunk, now)
            arrivals = stream.feed(chunk, now)
            if arrivals:
                self._spoke = now
                taken += arrivals
        return taken

    def facts(self) -> PortFacts:
        """How it stands now."""
        s = self._stream
        return PortFacts(
            self._open, s.format, self._heard, self._spoke, s.frames, s.damaged, s.lost,
            s.drift, self._error, self._busy, s.restarts,
            self._bauds[self._baud % len(self._bauds)], s.trouble, s.rate, s.clock,
        )  # fmt: skip

    def close(self) -> None:
        """End the reader and give the port back."""
        self._quit.set()
        self._thread.join()

    def _run(self, device: serial.SerialBase) -> None:
        try:
            while not self._quit.is_set():
                try:
                    with device:
                        self._read(device)
                except (OSError, termios.error) as gone:  # pyserial's errors are OSErrors
                    self._open, self._error = False, "unplugged or switched off"
                    log.warning("port %s is lost: %s", self.name, _reason(gone))
                if not self._quit.is_set():
                    device = self._wait_for_port()
        except Exception as error:
            # a thread that dies is a stop reason, not a log line
            log.exception("the reader of port %s has died", self.name)
            self._open, self._error = False, f"its reader has died: {error!r}"

    def _read(self, device: serial.SerialBase) -> None:
        read = reader_of(device, self.name)
        tried = self._clock.now()
        while not self._quit.is_set():
            chunk = read()
            if chunk:
                self._heard = now = self._clock.now()
                decoded = not self._mailbox
                known = self._stream.frames or self._stream.trouble
                if decoded and now > tried + TRIAL and not known and len(self._bauds) > 1:
                    # bytes but no frame: perhaps it speaks at another speed
                    device.baudrate = self._next_baud()
                    read = reader_of(device, self.name)
                    self._stream, tried = self._new_stream(), now
                self._mailbox.append((self._stream, chunk, now))
            self._busy = time.thread_time()

    def _wait_for_port(self) -> serial.SerialBase:
        """The port once it is there again; another board may hang on it now."""
        while not self._quit.wait(RETRY):
            try:
                device = self._connect()
            except SensorError as still:
                log.debug("%s", still)
                continue
            self._stream = self._new_stream()
            self._open, self._error = True, ""
            log.warning("port %s is back", self.name)
            return device
        return serial.serial_for_url(self.name, do_not_open=True)

    def _new_stream(self) -> Stream:
        baud = self._bauds[self._baud % len(self._bauds)]
        return Stream(self._spec.format, self._spec.grids, baud)

    def _next_baud(self) -> int:
        self._baud += 1
        return self._bauds[self._baud % len(self._bauds)]

    def _connect(self) -> serial.SerialBase:
        baud = self._bauds[self._baud % len(self._bauds)]
        try:
            device = serial.serial_for_url(self.name, baudrate=baud, timeout=0, do_not_open=True)
            if isinstance(device, serial.Serial):
                device.exclusive = True
            device.open()
        except (OSError, ValueError, termios.error) as e:
            raise SensorError(
                f"serial port {self.name} cannot be opened ({_reason(e)}); plug it in, close "
                "the other program that uses it, or give another port"
            ) from e
        return device


def _likely(format_name: str) -> tuple[int, ...]:
    """Speeds to try, the format's usual one first."""
    usual = format_of(format_name).baud if format_name else BAUDS[0]
    return (usual, *(b for b in BAUDS if b != usual))


def _reason(error: Exception) -> str:
    """The kernel's words for it, on one line."""
    number = getattr(error, "errno", None)
    if number in (errno.EAGAIN, errno.EBUSY):
        return "another program uses it"
    return os.strerror(number) if number else " ".join(str(error).split()).rstrip(".")
