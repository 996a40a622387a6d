"""The gate: every message of every page passes here first, and most of what could is refused.

    socket ─► counted ─► a message? ─► one that a hand could send? ─► may this page? ─► viser

viser lets any connected client set any control and drag any handle, so what a page shows
disabled proves nothing; this is the one place where a page's right to act is looked at. What
is no message, or too much, ends that page's connection (`app.ui.connection`); what it may not
do is dropped, logged and answered with the true value, so that the page shows again what is.
Nothing here waits.
"""

import logging
from collections.abc import Callable
from typing import Any

import viser
from viser import _messages as m
from websockets.typing import Data

from app.timing import Clock
from app.ui.access import Access, words
from app.ui.inside import Inside
from app.ui.paced_log import PacedLog
from app.ui.pacing import Bucket
from app.ui.places import Rank
from app.ui.wire import WATCHING, UnusedError, decoded, misfit

log = logging.getLogger(__name__)
SURPLUS, SURPLUS_BURST = 200.0, 200.0  # [1/s] messages of all who watch, beyond each page's own
MOST_KNOWN = 8  # browsers that have operated and are known again
OF_A_CONTROL = (m.GuiUpdateMessage, m.GuiButtonHoldMessage, m.CommandTriggerMessage)

Answer = Callable[[int, m.Message, str], None]  # page, what it sent, why it was refused


class Gate:
    """Judges messages by the lease and by the controls of one server."""

    def __init__(self, access: Access, clock: Clock) -> None:
        self.access, self.clock = access, clock
        self.log = PacedLog(log)
        self.free: set[str] = set()  # controls by uuid that every page may use
        self.refused = 0
        self.surplus = Bucket(SURPLUS, SURPLUS_BURST)
        self._known: dict[str, None] = {}  # browsers by cookie, the newest last
        self._inside: Inside | None = None
        self._answer: Answer | None = None

    def attach(self, server: viser.ViserServer) -> Inside:
        """Judge for `server`. Raises `ServerError` where its inside is not as it should be."""
        self._inside = Inside(server)
        return self._inside

    def open(self, answer: Answer) -> None:
        """Answer each refused message, on the thread of the sockets."""
        self._answer = answer

    @property
    def inside(self) -> Inside:
        """The server's inside; there is none before it is attached."""
        assert self._inside is not None, "the gate belongs to no server: open_page does that"
        return self._inside

    def page(self, socket: Any) -> int:
        """The number of the page on a socket, -1 if viser does not know it (yet)."""
        return self._inside.page(socket) if self._inside is not None else -1

    def rank(self, socket: Any) -> Rank:
        """Who has to go first when there are too many pages."""
        page = self.page(socket)
        if page >= 0 and page == self.access.operator:
            return Rank.OPERATOR
        told = self.access.guarded and self.access.trusts(page)
        return Rank.TRUSTED if told or socket.visitor in self._known else Rank.STRANGER

    def know(self, page: int) -> None:
        """The page operates: its browser shall find a place again, whoever else comes."""
        socket = self.inside.socket(page)
        if socket is not None and socket.visitor:
            self._known.pop(socket.visitor, None)
            self._known[socket.visitor] = None
            if len(self._known) > MOST_KNOWN:
                del self._known[next(iter(self._known))]

    def passes(self, page: int, raw: Data) -> str:
        """Empty if viser shall see the message, else why not. Raises `MalformedError`."""
        try:
            message = decoded(raw)
        except UnusedError as e:
            return str(e)
        if isinstance(message, WATCHING):
            self.access.acted(page, self.clock.now())
            return ""
        why = self._misuse(page, message)
        if why and self._answer is not None:
            self._answer(page, message, why)
        return why

    def _misuse(self, page: int, message: m.Message) -> str:
        """Why the page may not send this, empty if it may."""
        name, free = f"{type(message).__name__} on {getattr(message, 'name', '')!r}", False
        if isinstance(message, OF_A_CONTROL):
            handle = self.inside.handle(page, message.uuid)
            if handle is None:
                return f"{type(message).__name__} on a control that it does not have"
            free = message.uuid in self.free
            name = f"a use of {handle.label!r}"
            if isinstance(message, m.GuiUpdateMessage):
                why = misfit(handle, message.updates)
                if why:
                    return f"{name}: {why}"
            if isinstance(message, m.GuiButtonHoldMessage) and handle.disabled:
                return f"{name}: it is disabled"
        if not free and self.access.operator != page:
            return f"{name}: it watches, {words(self.access.operator)} operates"
        self.access.acted(page, self.clock.now())
        return ""
