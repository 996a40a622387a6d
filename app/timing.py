"""Time is an argument. This is the only file that asks the machine what time it is.

`WallClock` is the machine's monotonic clock, `ManualClock` is moved by its owner: the
headless run and the tests use it and never sleep. `Ticker` paces a loop and keeps honest
figures of how late its ticks were. `Latest` is a mailbox of one.
"""

import os
import threading
import time
from collections import deque
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

T = TypeVar("T")
PRIORITY = 10  # of 1 to 99: before every ordinary thread, behind the kernel's own


class Clock(Protocol):
    """Seconds on a monotonic axis of arbitrary origin."""

    def now(self) -> float: ...
    def sleep_until(self, t: float) -> None: ...


class WallClock:
    """The machine's monotonic clock."""

    def now(self) -> float:
        return time.perf_counter()

    def sleep_until(self, t: float) -> None:
        wait = t - time.perf_counter()
        if wait > 0.0:
            time.sleep(wait)


def date_now() -> float:
    """[s] since 1970: when something was, never how long it took."""
    return time.time()


@dataclass
class ManualClock:
    """A clock that stands still until it is moved; sleeping moves it at once."""

    t: float = 0.0

    def now(self) -> float:
        return self.t

    def sleep_until(self, t: float) -> None:
        self.t = max(self.t, t)


@dataclass
class Ticker:
    """Paces a loop at `period` seconds and remembers how late the last ticks were.

    A tick that is late is not made up for: after a stall the schedule starts anew, so that a
    loop never runs a burst of ticks with old data.
    """

    clock: Clock
    period: float
    lateness: deque[float] = field(default_factory=lambda: deque(maxlen=10_000))
    missed: int = 0  # ticks that began more than one period late
    _next: float | None = None

    def wait(self) -> float:
        """Sleep until the next tick is due; return how late it began [s]."""
        if self._next is None:
            self._next = self.clock.now()
        self.clock.sleep_until(self._next)
        late = max(0.0, self.clock.now() - self._next)
        self.lateness.append(late)
        if late > self.period:
            self.missed += 1
            self._next = self.clock.now()
        self._next += self.period
        return late


def prefer_this_thread(priority: int = PRIORITY) -> bool:
    """Ask the system to run this thread before all ordinary ones whenever it is ready; is it so?

    A control loop sleeps most of the time, and what it waits for otherwise is not its work but
    its turn: browsers and simulations share its processors. Linux allows it to root and to whom
    `ulimit -r` grants a priority; where it does not, ticks are late as often as the machine is
    busy. What this thread starts is an ordinary one again.
    """
    try:
        policy = os.SCHED_RR | os.SCHED_RESET_ON_FORK
        os.sched_setscheduler(0, policy, os.sched_param(priority))
    except (AttributeError, OSError):  # not this system, or not this user
        return False
    return True


def give_way() -> None:
    """Let another thread that waits for the interpreter go on first."""
    time.sleep(0.0)


class Latest(Generic[T]):
    """A mailbox of one: the newest value wins, reading does not empty it."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._value: T | None = None
        self._stamp = 0.0

    def put(self, value: T, stamp: float) -> None:
        with self._lock:
            self._value, self._stamp = value, stamp

    def get(self) -> tuple[T | None, float]:
        """The newest value (None before the first) and its stamp [s]."""
        with self._lock:
            return self._value, self._stamp


class Subscription(Generic[T]):
    """A bounded queue: what finds no room is not taken, and counted in `lost`.

    `put` never waits; `take` empties the queue. One thread puts, one takes.
    """

    def __init__(self, room: int) -> None:
        self.lost = 0
        self._room = room
        self._queue: deque[T] = deque()

    def put(self, value: T) -> None:
        if len(self._queue) < self._room:
            self._queue.append(value)
        else:
            self.lost += 1

    def take(self) -> list[T]:
        """All that has come since the last call, oldest first."""
        return [self._queue.popleft() for _ in range(len(self._queue))]

    def close(self) -> None:
        """What waits may still be taken."""


class Stopwatch:
    """Laps of one tick: where the time went, by name [s]."""

    def __init__(self) -> None:
        self.laps: dict[str, float] = {}
        self._last = time.perf_counter()

    def lap(self, name: str) -> None:
        """Charge the time since the last lap to `name`."""
        now = time.perf_counter()
        self.laps[name] = self.laps.get(name, 0.0) + now - self._last
        self._last = now
