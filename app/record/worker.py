"""A queue between the control thread and who is slower: bounded, and never waited for."""

import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

T = TypeVar("T")
PAUSE = 0.02  # [s] between two looks: a few ticks together, and no call of the system in `put`
AT_ONCE = 64  # items that wait, without a thread, until `put` does the work itself


class Worker(Generic[T]):
    """Hands items to `work` in their order: in a thread of its own, or without one in `put`.

    A thread takes what has come every 20 ms; `put` itself only appends. Without a thread, for
    runs that do not keep to real time, nothing is ever dropped.
    """

    def __init__(self, work: Callable[[T], None], room: int, name: str, threaded: bool) -> None:
        """room: items that may wait."""
        self._work, self._room = work, room
        self._queue: deque[T] = deque()
        self.lock = threading.RLock()  # held by who works
        self._quit = threading.Event()
        self._thread: threading.Thread | None = None
        if threaded:
            self._thread = threading.Thread(target=self._run, name=name, daemon=True)
            self._thread.start()

    def put(self, item: T) -> bool:
        """Queue an item; False if there is no room for it."""
        if self._thread is None:
            self._queue.append(item)
            if len(self._queue) >= AT_ONCE:
                self.drain()
            return True
        if len(self._queue) >= self._room:
            return False
        self._queue.append(item)
        return True

    def drain(self) -> None:
        """Return when all that was put before this call is done, whoever does it."""
        with self.lock:
            for _ in range(len(self._queue)):
                self._work(self._queue.popleft())

    def close(self) -> None:
        """Do what waits, and end."""
        self._quit.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        self.drain()

    def _run(self) -> None:
        while not self._quit.wait(PAUSE):
            self.drain()
