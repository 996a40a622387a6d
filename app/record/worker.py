"""A queue between the control thread and who is slower: bounded, and never waited for.

The thread behind it is woken by every item, so that it works while the control thread sleeps until
its next tick, and it is preferred by the system as that one is, though a little less: else an
ordinary process could take its processor while it holds the interpreter's lock, and a tick would
wait for both.
"""

import queue
import threading
from collections import deque
from collections.abc import Callable
from typing import Generic, TypeVar

from app.timing import PRIORITY, give_way, prefer_this_thread

T = TypeVar("T")
AT_ONCE = 64  # items that wait, without a thread, until `put` does the work itself


class Worker(Generic[T]):
    """Hands items to `work` in their order: in a thread of its own, or without one in `put`.

    Without a thread, for runs that do not keep to real time, nothing is ever dropped.
    """

    def __init__(self, work: Callable[[T], None], room: int, name: str, threaded: bool) -> None:
        """room: items that may wait."""
        self.lock = threading.RLock()  # held by who works
        self._work, self._room = work, room
        self._items: deque[T] = deque()
        self._calls: queue.SimpleQueue[bool] = queue.SimpleQueue()  # go on?
        self._thread: threading.Thread | None = None
        if threaded:
            self._thread = threading.Thread(target=self._run, name=name, daemon=True)
            self._thread.start()

    def put(self, item: T) -> bool:
        """Queue an item; False if there is no room for it."""
        if self._thread is None:
            self._items.append(item)
            if len(self._items) >= AT_ONCE:
                self.drain()
            return True
        if len(self._items) >= self._room:
            return False
        self._items.append(item)
        self._calls.put(True)
        return True

    def drain(self) -> None:
        """Return when all that was put before this call is done, whoever does it."""
        with self.lock:
            for _ in range(len(self._items)):
                self._work(self._items.popleft())
                give_way()

    def close(self) -> None:
        """Do what waits, and end."""
        self._calls.put(False)
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join()
        self.drain()

    def _run(self) -> None:
        prefer_this_thread(PRIORITY - 1)
        while self._calls.get():
            self.drain()
