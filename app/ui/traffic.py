"""What the page costs on the wire: messages and bytes of one frame, for one client."""

from collections.abc import Iterator
from contextlib import contextmanager

import msgspec
import viser

from app.ui.inside import Inside

EVERY = 1.0  # [s] counting costs as much as sending, so only one frame a second is counted


class Traffic:
    """Figures of the last counted frame (before the small compression of the text part)."""

    def __init__(self, server: viser.ViserServer) -> None:
        # viser counts nothing itself, but numbers every message to all
        self._inside = Inside(server)
        self._counted_at = float("-inf")
        self.messages = 0
        self.bytes = 0

    @contextmanager
    def frame(self, now: float) -> Iterator[None]:
        """Wrap the assignments of one frame; `now` [s] decides whether it is counted."""
        before = self._inside.said()
        yield
        if now - self._counted_at < EVERY:
            return
        self._counted_at = now
        queued = self._inside.kept(range(before + 1, self._inside.said() + 1))
        arrays: list[memoryview] = []
        texts = [message.as_serializable_dict(arrays) for message in queued]
        self.messages = len(queued)
        self.bytes = len(msgspec.msgpack.encode(texts)) + sum(a.nbytes for a in arrays)
